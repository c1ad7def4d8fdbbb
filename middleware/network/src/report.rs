//! Messages of the library, in the log.

use crate::RateLimit;
use rc_diagnostics::foreign::clean;

/// Logs a message of the library.
pub(crate) fn library(is_error: bool, message: &str) {
    static WARNINGS: RateLimit = RateLimit::new();
    static ERRORS: RateLimit = RateLimit::new();
    let rate_limit = if is_error { &ERRORS } else { &WARNINGS };
    let message = clean(message);
    let Some(suppressed) = rate_limit.allow() else {
        return;
    };
    let more = match suppressed {
        0 => String::new(),
        count => format!(" ({count} more suppressed)"),
    };
    if is_error {
        tracing::error!("Cyclone DDS: {message}{more}");
    } else {
        tracing::warn!("Cyclone DDS: {message}{more}");
    }
}
