//! A JSON-RPC client that never waits: what the view talks to, besides the user.

use crate::client::connection::ANSWER_LENGTH;
use crate::client::lines::{Line, Lines, Overlong};
use crate::client::params::reason;
use serde_json::{Value, json};
use std::io::{self, ErrorKind, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;

/// A connection, and what was asked on it.
#[derive(Debug)]
pub(crate) struct Peer<A> {
    stream: UnixStream,
    lines: Lines,
    out: Vec<u8>,
    next: u64,
    asked: Vec<(u64, A)>,
}

/// What came.
#[derive(Debug)]
pub(crate) enum Said<A> {
    /// The answer to what was asked.
    Answer(A, Result<Value, String>),
    /// Something that nobody asked for: its method and parameters.
    Notice(String, Value),
}

impl<A> Peer<A> {
    pub(crate) fn connect(path: &Path) -> io::Result<Self> {
        let stream = UnixStream::connect(path)?;
        stream.set_nonblocking(true)?;
        Ok(Self {
            stream,
            lines: Lines::up_to(ANSWER_LENGTH, Overlong::Skip),
            out: Vec::new(),
            next: 0,
            asked: Vec::new(),
        })
    }

    pub(crate) fn stream(&self) -> &UnixStream {
        &self.stream
    }

    pub(crate) fn has_output(&self) -> bool {
        !self.out.is_empty()
    }

    /// What is not answered yet.
    pub(crate) fn waiting(&self) -> impl Iterator<Item = &A> {
        self.asked.iter().map(|(_, about)| about)
    }

    pub(crate) fn ask(&mut self, about: A, method: &str, params: &Value) {
        self.next += 1;
        let id = self.next;
        let request = json!({"jsonrpc": "2.0", "id": id, "method": method, "params": params});
        self.out
            .extend_from_slice(format!("{request}\n").as_bytes());
        self.asked.push((id, about));
        // What does not go now goes when there is room; that the other side is gone is seen when it is read.
        let _ = self.write();
    }

    fn write(&mut self) -> io::Result<()> {
        while !self.out.is_empty() {
            match self.stream.write(&self.out) {
                Ok(count) => drop(self.out.drain(..count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// What has come, and whether the other side is still there.
    pub(crate) fn turn(&mut self) -> (Vec<Said<A>>, bool) {
        let written = self.write().is_ok();
        let (lines, ended) = self.lines.read(&self.stream);
        let said = lines.into_iter().filter_map(|line| self.heard(&line));
        (said.collect(), written && !ended)
    }

    fn heard(&mut self, line: &Line) -> Option<Said<A>> {
        let Line::Text(text) = line else { return None };
        let mut message: Value = serde_json::from_str(text).ok()?;
        if let Some(method) = message["method"].as_str() {
            let method = method.to_owned();
            return Some(Said::Notice(method, message["params"].take()));
        }
        let id = message["id"].as_u64()?;
        let at = self.asked.iter().position(|(asked, _)| *asked == id)?;
        let (_, about) = self.asked.swap_remove(at);
        let answer = match message.get_mut("result") {
            Some(result) => Ok(result.take()),
            None => Err(reason(&message["error"]).unwrap_or_else(|| text.clone())),
        };
        Some(Said::Answer(about, answer))
    }
}
