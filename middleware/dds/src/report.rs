//! What the library says, in the log.

use rc_network::RateLimit;

/// What the library has to say.
pub(crate) fn library(is_error: bool, message: &str) {
    static WARNINGS: RateLimit = RateLimit::new();
    static ERRORS: RateLimit = RateLimit::new();
    let rate_limit = if is_error { &ERRORS } else { &WARNINGS };
    let Some(passed_over) = rate_limit.allow() else {
        return;
    };
    let more = match passed_over {
        0 => String::new(),
        count => format!(" ({count} more before)"),
    };
    if is_error {
        tracing::error!("Cyclone DDS: {message}{more}");
    } else {
        tracing::warn!("Cyclone DDS: {message}{more}");
    }
}
