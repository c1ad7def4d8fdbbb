//! The socket between a component and the supervisor that has started it: JSON-RPC 2.0 notifications, one a line.

use rc_configuration::ParamChange;
use serde_json::{Map, Value, json};
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;

/// A longer line is not notified, and not taken.
const LONGEST_LINE: usize = 64 * 1024;
/// How many paths are notified of what is too long to be kept.
const LISTED: usize = 16;

/// The component's end.
pub(crate) struct Link {
    stream: UnixStream,
    read: Vec<u8>,
    /// The changes that were notified last.
    notified: Value,
}

/// What has come from the supervisor.
#[derive(Debug, Default)]
pub(crate) struct LinkInput {
    /// It is closed.
    pub(crate) closed: bool,
    /// What is to be set before the component is ready: changes that an earlier run had not saved.
    pub(crate) restore: Option<Map<String, Value>>,
}

impl Link {
    /// The link of a process that a supervisor has started; its standard input.
    pub(crate) fn inherited() -> io::Result<Option<Self>> {
        if std::env::var_os("RC_SUPERVISED").is_none() {
            return Ok(None);
        }
        let stream = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
        stream.set_nonblocking(true)?;
        Ok(Some(Self {
            stream,
            read: Vec::new(),
            notified: changes(&[]),
        }))
    }

    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }

    /// Tells something.
    pub(crate) fn notify(&self, method: &str, params: &Value) {
        let line = json!({ "jsonrpc": "2.0", "method": method, "params": params });
        // A supervisor that does not read loses heartbeats, not its component.
        let _ = (&self.stream).write_all(format!("{line}\n").as_bytes());
    }

    /// Tells which values are not in the configuration file, where these are others than before.
    pub(crate) fn notify_changes(&mut self, unsaved: &[ParamChange]) {
        let now = changes(unsaved);
        if now != self.notified {
            self.notify("parameters", &now);
            self.notified = now;
        }
    }

    /// Takes what has come.
    pub(crate) fn receive(&mut self) -> LinkInput {
        let mut input = LinkInput::default();
        let mut bytes = [0; 4096];
        loop {
            match self.stream.read(&mut bytes) {
                Ok(0) => input.closed = true,
                Ok(count) => {
                    self.read.extend_from_slice(&bytes[..count]);
                    if self.read.len() <= 2 * LONGEST_LINE {
                        continue;
                    }
                    self.read.clear();
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => input.closed = error.kind() != io::ErrorKind::WouldBlock,
            }
            break;
        }
        while let Some(end) = self.read.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = self.read.drain(..=end).collect();
            // What a supervisor of another version says is none of ours.
            let Ok(mut message) = serde_json::from_slice::<Value>(&line) else {
                continue;
            };
            if message["method"] == "restore"
                && let Value::Object(changes) = message["params"]["changes"].take()
            {
                input.restore = Some(changes);
            }
        }
        input
    }
}

/// `{"changed": {PATH: VALUE}, "unkept": [PATH]}`: a secret stays in its process, and what is too long for a line is not notified.
fn changes(unsaved: &[ParamChange]) -> Value {
    let (secret, open): (Vec<_>, Vec<_>) = unsaved.iter().partition(|change| change.secret);
    let paths = |of: &[&ParamChange]| -> Vec<String> {
        of.iter()
            .take(LISTED)
            .map(|change| change.path.clone())
            .collect()
    };
    let changed: Map<String, Value> = open
        .iter()
        .map(|change| (change.path.clone(), change.new.to_json()))
        .collect();
    let notified = json!({ "changed": changed, "unkept": paths(&secret) });
    // The rest of the line is short.
    if notified.to_string().len() + 1024 > LONGEST_LINE {
        return json!({ "changed": {}, "unkept": paths(&Vec::from_iter(unsaved)) });
    }
    notified
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
        let notified = changes(&[
            change("token", text("hush"), true),
            change("name", text("left"), false),
        ]);
        assert_eq!(
            notified,
            json!({ "changed": { "name": "left" }, "unkept": ["token"] })
        );
    }

    #[test]
    fn what_fits_into_no_line_is_named() {
        let text = Parameter::Text("x".repeat(LONGEST_LINE));
        let notified = changes(&[change("long", text, false)]);
        assert_eq!(notified, json!({ "changed": {}, "unkept": ["long"] }));
    }
}
