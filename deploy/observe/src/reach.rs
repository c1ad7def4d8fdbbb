//! The reach of messages of a middleware.

use rc_vocabulary::Middleware;

/// Whether messages of this middleware travel in shared memory.
pub(crate) fn shares_memory(middleware: &str) -> bool {
    let known = Middleware::from_word(middleware);
    known.is_some_and(|middleware| middleware.can().shares_memory)
}

/// Whether messages of this middleware stay in their process.
pub(crate) fn is_inside_process(middleware: &str) -> bool {
    let known = Middleware::from_word(middleware);
    known.is_some_and(|middleware| !middleware.can().joins_processes)
}
