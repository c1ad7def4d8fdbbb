//! All middlewares, for programs that may use any of them: tools, and workers in other languages. A
//! component in Rust links those of its slots only.
//!
//! # Example
//!
//! ```
//! // A program that may use any middleware chooses it by its word.
//! let backend = rc_backends::find("iceoryx2");
//! assert!(backend.is_some());
//! ```

use rc_middleware::Linked;
use rc_vocabulary::Middleware;

/// The backend of a middleware.
pub fn of(middleware: Middleware) -> Linked {
    match middleware {
        Middleware::Iceoryx2 => rc_iceoryx2::LINKED,
        Middleware::Dds => rc_dds::LINKED,
        Middleware::Ros2 => rc_ros2::LINKED,
        Middleware::Local => rc_local::LINKED,
    }
}

/// The backend of the middleware with this word.
///
/// ```
/// assert!(rc_backends::find("dds").is_some());
/// assert!(rc_backends::find("carrier pigeon").is_none());
/// ```
pub fn find(word: &str) -> Option<Linked> {
    Middleware::from_word(word).map(of)
}
