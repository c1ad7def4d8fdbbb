//! Printing and failing of commands.

use rc_deploy_client::Format;
use rc_deploy_client::error::print_error;
use rc_diagnostics::foreign::is_hidden;
use rc_diagnostics::print;
pub(super) use rc_diagnostics::print::{
    data as print_data, findings as print_findings, line as print_line,
};
use rustix::event::{PollFd, PollFlags, Timespec};
use serde::Serialize;
use std::fmt::Display;
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

/// Prints a value as a line of JSON.
pub(super) fn print_json<T: Serialize>(value: &T) -> Result<(), Failure> {
    print_data(&format!("{}\n", json_text(value)?));
    Ok(())
}

/// A value as JSON, as [`visible`] shows it.
pub(super) fn json_text<T: Serialize>(value: &T) -> Result<String, Failure> {
    let text = serde_json::to_string(value).map_err(|e| system(&e))?;
    Ok(visible(text))
}

/// JSON in which the characters that a terminal obeys are escapes: a writer of JSON escapes only
/// those of ASCII.
pub(super) fn visible(text: String) -> String {
    if !text.chars().any(is_hidden) {
        return text;
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_hidden(c) {
            // They occur only in strings.
            for unit in c.encode_utf16(&mut [0; 2]) {
                out.push_str(&format!("\\u{unit:04x}"));
            }
        } else {
            out.push(c);
        }
    }
    out
}

/// Prints an answer.
pub(super) fn show<T: Serialize>(
    format: Format,
    answer: &T,
    human: impl FnOnce(&T) -> String,
) -> Result<u8, Failure> {
    match format {
        Format::Human => print_line(format_args!("{}", human(answer).trim_end())),
        Format::Json => print_json(answer)?,
    }
    Ok(0)
}

/// A number with its unit: `1 component`, `2 components`.
pub(super) fn counted(count: impl Into<u64>, what: &str) -> String {
    match count.into() {
        1 => format!("1 {what}"),
        count => format!("{count} {what}s"),
    }
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
    ExitCode::from(code_of(result))
}

/// Ends the process before its command begins.
pub(super) fn end(failure: Failure) -> ! {
    std::process::exit(code_of(Err(failure)).into())
}

fn code_of(result: Result<u8, Failure>) -> u8 {
    let (code, message) = match result {
        Ok(code) => (code, None),
        Err(Failure(code, message)) => (code, Some(message).filter(|m| !m.is_empty())),
    };
    let (code, message) = print::exit_code(code, message, 3);
    if let Some(message) = message {
        print_failure(&message);
    }
    code
}

/// Whether standard output is a pipe, or a terminal, that nobody reads any more.
pub(super) fn is_output_closed() -> bool {
    let output = rustix::stdio::stdout();
    let mut polled = [PollFd::from_borrowed_fd(output, PollFlags::empty())];
    let found = rustix::event::poll(&mut polled, Some(&Timespec::default()));
    let ends = PollFlags::ERR | PollFlags::HUP;
    found.is_ok() && polled[0].revents().intersects(ends)
}

#[cfg(test)]
mod tests {
    use super::json_text;

    #[test]
    fn json_sends_no_control_characters_to_a_terminal() {
        let value = serde_json::json!({ "a\u{202e}": "x\u{1b}\u{9b}5n\u{e0041}é\n" });
        let Ok(text) = json_text(&value) else {
            panic!("it is JSON");
        };
        assert_eq!(
            text,
            "{\"a\\u202e\":\"x\\u001b\\u009b5n\\udb40\\udc41é\\n\"}"
        );
        let same: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(same, value);
    }
}
