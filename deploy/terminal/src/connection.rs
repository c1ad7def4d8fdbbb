//! A connection of the view, which never blocks, with its pending requests.

use rc_management::supervisor::Notification;
use rc_management::{Client, Incoming};
use serde::Serialize;
use serde_json::Value;
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::path::Path;
use std::time::Duration;

/// Subject of a pending request.
#[derive(Debug)]
pub(crate) enum Pending {
    Status,
    Chains,
    Events,
    Parameters,
    Action(String),
}

/// A connection to the supervisor or to a component.
#[derive(Debug)]
pub(crate) struct Connection {
    client: Client,
    pending: Vec<(u64, Pending)>,
}

/// A received message.
#[derive(Debug)]
pub(crate) enum Received {
    /// The answer to a request, or the reason of its failure.
    Answer(Pending, Result<Value, String>),
    /// A notification of the supervisor.
    Notification(Notification),
}

impl Connection {
    pub(crate) fn connect(path: &Path) -> io::Result<Self> {
        Ok(Self {
            client: Client::connect(path, Duration::ZERO)?,
            pending: Vec::new(),
        })
    }

    pub(crate) fn has_output(&self) -> bool {
        self.client.has_output()
    }

    /// The requests without an answer.
    pub(crate) fn pending(&self) -> impl Iterator<Item = &Pending> {
        self.pending.iter().map(|(_, about)| about)
    }

    pub(crate) fn send(&mut self, about: Pending, request: &impl Serialize) {
        let number = self.client.send(request);
        self.pending.push((number, about));
    }

    /// Returns what has arrived, and whether the connection is still open.
    pub(crate) fn receive(&mut self) -> (Vec<Received>, bool) {
        let (incoming, open) = self.client.receive();
        let received = incoming.into_iter().filter_map(|incoming| match incoming {
            Incoming::Answer(number, result) => {
                let at = self
                    .pending
                    .iter()
                    .position(|(of, _)| Some(*of) == number)?;
                let (_, about) = self.pending.swap_remove(at);
                let result = result.map_err(|error| error.reason());
                Some(Received::Answer(about, result))
            }
            Incoming::Notification(method, params) => {
                Notification::decode(&method, params).map(Received::Notification)
            }
            Incoming::Unknown(_) => None,
        });
        (received.collect(), open)
    }
}

impl AsFd for Connection {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.client.as_fd()
    }
}
