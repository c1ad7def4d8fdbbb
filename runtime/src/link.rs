//! The socket between a component and the supervisor that started it.

use rc_configuration::ParamChange;
use rc_management::lines::{LIMIT, Line, Lines, Overlong};
use rc_management::link::{ComponentMessage, SupervisorMessage, UnsavedParameters};
use rc_management::rpc;
use serde_json::{Map, Value};
use std::io::{self, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;

/// How many paths are listed of values that are too long for a line.
const LISTED: usize = 16;
/// How often the link is read at once.
const READS: usize = 8;
/// Room for the rest of a line with parameters, in bytes.
const MARGIN: usize = 1024;

/// The component's end.
pub(crate) struct Link {
    stream: UnixStream,
    lines: Lines,
    /// The unsaved parameters that the supervisor knows.
    sent: UnsavedParameters,
}

/// What has come from the supervisor.
#[derive(Debug, Default)]
pub(crate) struct LinkInput {
    /// The supervisor has ended.
    pub(crate) closed: bool,
    /// Parameters that an earlier run had not saved, to be set before the component is ready.
    pub(crate) restore: Option<Map<String, Value>>,
}

impl Link {
    /// The link at standard input, if a supervisor has started this process.
    pub(crate) fn inherited() -> io::Result<Option<Self>> {
        if std::env::var_os("RC_SUPERVISED").is_none() {
            return Ok(None);
        }
        let stream = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
        stream.set_nonblocking(true)?;
        Ok(Some(Self {
            stream,
            lines: Lines::new(Overlong::Skip),
            sent: UnsavedParameters::default(),
        }))
    }

    /// Sends a message. A supervisor that does not read loses messages; it never holds up its component.
    pub(crate) fn send(&self, message: &ComponentMessage) {
        let _ = (&self.stream).write_all(&rpc::notification(message));
    }

    /// Sends the unsaved parameters, if they are others than before.
    pub(crate) fn send_unsaved(&mut self, changes: &[ParamChange]) {
        let unsaved = unsaved(changes);
        if unsaved != self.sent {
            self.send(&ComponentMessage::Parameters(unsaved.clone()));
            self.sent = unsaved;
        }
    }

    /// Reads what has come: a line of [`LIMIT`] bytes takes several reads.
    pub(crate) fn receive(&mut self) -> LinkInput {
        let mut input = LinkInput::default();
        for _ in 0..READS {
            let (lines, closed) = self.lines.read(&self.stream);
            for line in lines.iter().filter_map(Line::bytes) {
                if let Some(SupervisorMessage::Restore { changes }) =
                    SupervisorMessage::decode(line)
                {
                    input.restore = Some(changes);
                }
            }
            if closed {
                input.closed = true;
                break;
            }
        }
        input
    }
}

impl AsFd for Link {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}

/// Secrets stay in this process. If the values are too long for a line, only paths are sent.
fn unsaved(changes: &[ParamChange]) -> UnsavedParameters {
    let paths = |changes: &mut dyn Iterator<Item = &ParamChange>| -> Vec<String> {
        changes
            .take(LISTED)
            .map(|change| change.path.clone())
            .collect()
    };
    let open = changes.iter().filter(|change| !change.secret);
    let unsaved = UnsavedParameters {
        changed: open
            .map(|change| (change.path.clone(), change.new.to_json()))
            .collect(),
        unkept: paths(&mut changes.iter().filter(|change| change.secret)),
    };
    let line = rpc::notification(&ComponentMessage::Parameters(unsaved.clone()));
    if line.len() + MARGIN > LIMIT {
        return UnsavedParameters {
            changed: Map::new(),
            unkept: paths(&mut changes.iter()),
        };
    }
    unsaved
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_configuration::model::Value as Parameter;

    fn change(path: &str, new: Parameter, secret: bool) -> ParamChange {
        ParamChange {
            path: path.to_owned(),
            old: Parameter::Text(String::new()),
            new,
            secret,
        }
    }

    #[test]
    fn a_secret_does_not_leave_the_process() {
        let text = |text: &str| Parameter::Text(text.to_owned());
        let sent = unsaved(&[
            change("token", text("hush"), true),
            change("name", text("left"), false),
        ]);
        let changed = Map::from_iter([("name".to_owned(), "left".into())]);
        let unkept = vec!["token".to_owned()];
        assert_eq!(sent, UnsavedParameters { changed, unkept });
    }

    #[test]
    fn values_that_are_too_long_for_a_line_are_listed_by_path() {
        let text = Parameter::Text("x".repeat(LIMIT));
        let sent = unsaved(&[change("long", text, false)]);
        let unkept = vec!["long".to_owned()];
        let changed = Map::new();
        assert_eq!(sent, UnsavedParameters { changed, unkept });
    }
}
