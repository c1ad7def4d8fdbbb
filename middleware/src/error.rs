//! The ways in which communication fails. A peer that is not there is an error value, never a hang.

use crate::cdr::{DecodeError, EncodeError};
use std::time::Duration;

/// A call that did not bring its answer, or a command that is in no server's queue.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CallError {
    /// Nobody serves the address.
    #[error("no server at `{0}`; is the component that implements it running?")]
    NoServer(String),
    /// The answer did not come in time.
    #[error("no answer from `{address}` within {limit:?}")]
    Deadline {
        /// Whom was called.
        address: String,
        /// How long was waited.
        limit: Duration,
    },
    /// The server ended while it held the request.
    #[error("the server at `{0}` died while it held the call")]
    ServerDied(String),
    /// The server has not taken the earlier requests yet.
    #[error(
        "the queue of the server at `{0}` is full; it takes requests more slowly than they are sent"
    )]
    QueueFull(String),
    /// The server did not accept the request.
    #[error("the server refused: {0}")]
    Refused(String),
    /// This component is stopping: it asks for no more answers. Commands are still sent.
    #[error("this component is stopping")]
    Stopping,
    /// An argument cannot be sent.
    #[error("the argument cannot be sent: {0}")]
    Invalid(#[from] EncodeError),
    /// The answer cannot be read.
    #[error("the answer cannot be read: {0}")]
    Malformed(#[from] DecodeError),
    /// The middleware failed.
    #[error("the middleware failed at `{address}`: {reason}")]
    Backend {
        /// Whom was called.
        address: String,
        /// What the middleware says.
        reason: String,
    },
}

/// A value that was not published.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// The value cannot be sent.
    #[error("the value cannot be sent: {0}")]
    Invalid(#[from] EncodeError),
    /// The middleware failed.
    #[error("the middleware failed at `{address}`: {reason}")]
    Backend {
        /// The topic.
        address: String,
        /// What the middleware says.
        reason: String,
    },
}

/// Something that arrived and could not be taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the middleware failed at `{address}`: {reason}")]
pub struct ReceiveError {
    /// The topic or service.
    pub address: String,
    /// What the middleware says.
    pub reason: String,
}

/// A connection that could not be opened.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OpenError {
    /// Another server is alive at this address.
    #[error(
        "`{address}` already has a server: {holder}; stop it, or give this one another address with --network, --name or --bind"
    )]
    AddressTaken {
        /// The address.
        address: String,
        /// Who serves it.
        holder: String,
    },
    /// The ends of a connection have different types.
    #[error(
        "the ends of `{address}` differ in type: this one has {ours}, the other one {theirs}; regenerate and rebuild both from the same .idsl"
    )]
    TypeMismatch {
        /// The address.
        address: String,
        /// The type here.
        ours: String,
        /// The type there.
        theirs: String,
    },
    /// The middleware failed.
    #[error("`{address}` cannot be opened: {reason}")]
    Backend {
        /// The address.
        address: String,
        /// What the middleware says, and what helps.
        reason: String,
    },
}
