//! What the library says, in the log.

use rc_network::Seldom;

/// What the library has to say.
pub(crate) fn library(is_error: bool, message: &str) {
    static WARNINGS: Seldom = Seldom::new();
    static ERRORS: Seldom = Seldom::new();
    let seldom = if is_error { &ERRORS } else { &WARNINGS };
    let Some(passed_over) = seldom.now() else {
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
