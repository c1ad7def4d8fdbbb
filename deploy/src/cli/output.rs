//! How commands print, and how they fail.

use rc_deploy_client::Format;
use rc_deploy_client::error::print_error;
use serde::Serialize;
use std::fmt::{Arguments, Display};
use std::io::Write;
use std::process::ExitCode;

/// A failed command: its exit code, and a message that is still to be printed. The message may be
/// empty.
pub(super) struct Failure(pub(super) u8, pub(super) String);

impl From<rc_deploy_network::Error> for Failure {
    fn from(error: rc_deploy_network::Error) -> Self {
        let code = match error {
            rc_deploy_network::Error::Workspace(_) => 1,
            _ => 3,
        };
        Self(code, error.to_string())
    }
}

impl From<rc_deploy_client::Error> for Failure {
    fn from(error: rc_deploy_client::Error) -> Self {
        Self(error.exit_code(), error.to_string())
    }
}

pub(super) fn system(error: &dyn Display) -> Failure {
    Failure(3, error.to_string())
}

/// Prints a line. A closed pipe is no failure.
pub(super) fn print_line(line: Arguments<'_>) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// Prints an answer.
pub(super) fn show<T: Serialize>(
    format: Format,
    answer: &T,
    human: impl FnOnce(&T) -> String,
) -> Result<u8, Failure> {
    match format {
        Format::Human => print_line(format_args!("{}", human(answer).trim_end())),
        Format::Json => print_line(format_args!(
            "{}",
            serde_json::to_string(answer).map_err(|e| system(&e))?
        )),
    }
    Ok(0)
}

/// Prints findings or other text as it is. If it cannot be printed, the exit code still holds.
pub(super) fn print_findings(text: &str) {
    let _ = std::io::stderr().write_all(text.as_bytes());
}

/// Prints a note about something that is not an error.
pub(super) fn print_note(note: &dyn Display) {
    print_error(format_args!("rcdeploy: note: {note}"));
}

/// Prints the reason of a failure.
pub(super) fn print_failure(reason: &dyn Display) {
    print_error(format_args!("rcdeploy: error: {reason}"));
}

/// The exit code of a command, after its failure is printed.
pub(super) fn exit_code(result: Result<u8, Failure>) -> ExitCode {
    match result {
        Ok(code) => ExitCode::from(code),
        Err(Failure(code, message)) => {
            if !message.is_empty() {
                print_failure(&message);
            }
            ExitCode::from(code)
        }
    }
}
