//! The log of a component, and what it prints.

use crate::error::StartError;
use std::io::Write;

/// Sends the log to standard error if it `prints`, with messages of this level and above.
pub(crate) fn start(level: &str, prints: bool) -> Result<(), StartError> {
    let level: tracing::Level = level.parse().map_err(|_| {
        StartError::Usage(format!(
            "`{level}` is not a log level; there are error, warn, info, debug and trace"
        ))
    })?;
    if !prints {
        return Ok(());
    }
    // A second component of one process, as in tests, uses the log of the first.
    let _ = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .with_ansi(false)
        // A line that cannot be written is lost; an error message about it on the same stream would panic.
        .log_internal_errors(false)
        .with_writer(std::io::stderr)
        .try_init();
    Ok(())
}

/// Prints to standard output. A reader that has left is not an error.
pub(crate) fn print(text: &str) {
    let _ = std::io::stdout().write_all(text.as_bytes());
}

/// Prints to standard error, which may be a log on a full disk, where `eprintln!` would panic.
pub(crate) fn print_error(text: &str) {
    let _ = std::io::stderr().write_all(text.as_bytes());
}
