//! Errors of communication. A missing peer is an error value, never a hang.

use crate::cdr::{DecodeError, EncodeError};
use std::time::Duration;

/// A call failed, or a command was not queued at a server.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CallError {
    /// No server of the address is alive.
    #[error("no server at `{0}`; is the component that implements it running?")]
    NoServer(String),
    /// The reply did not arrive in time.
    #[error("no reply from `{address}` within {limit:?}")]
    Deadline {
        /// The address of the server.
        address: String,
        /// The limit of the call.
        limit: Duration,
    },
    /// The server ended before it replied.
    #[error("the server at `{0}` died while it held the call")]
    ServerDied(String),
    /// The server has not taken enough of the earlier requests.
    #[error(
        "the queue of the server at `{0}` is full; it takes requests more slowly than they are sent"
    )]
    QueueFull(String),
    /// A call is not started: [`STARTED_CALLS`](crate::qos::STARTED_CALLS) of this client have
    /// not ended, or their results were not taken.
    #[error(
        "{} started calls have not ended, or nobody has taken their results",
        crate::qos::STARTED_CALLS
    )]
    TooManyStarted,
    /// The server refused the request, for this reason.
    #[error("the server refused: {0}")]
    Refused(String),
    /// The server does not serve the operation in its present state.
    #[error("the server does not serve this in its state `{state}`")]
    Unavailable {
        /// The active states of the server, or the state of its life cycle.
        state: String,
    },
    /// The value is older than the slot allows with `fresh`, and `stale refuse` refuses it.
    #[error("the value is {age:?} old, which is more than `fresh` allows")]
    Stale {
        /// Its age.
        age: Duration,
    },
    /// No value has come yet.
    #[error("no value has come yet")]
    NoValue,
    /// This component is stopping: it makes no more calls. It can still send commands.
    #[error("this component is stopping")]
    Stopping,
    /// An argument cannot be encoded.
    #[error("the argument cannot be sent: {0}")]
    Invalid(#[from] EncodeError),
    /// The reply cannot be decoded.
    #[error("the reply cannot be decoded: {0}")]
    Malformed(#[from] DecodeError),
    /// The middleware failed.
    #[error("the middleware failed at `{address}`: {reason}")]
    Backend {
        /// The address of the server.
        address: String,
        /// The reason that the middleware gives.
        reason: String,
    },
}

/// A sample was not published.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SendError {
    /// The sample cannot be encoded.
    #[error("the value cannot be sent: {0}")]
    Invalid(#[from] EncodeError),
    /// The middleware failed.
    #[error("the middleware failed at `{address}`: {reason}")]
    Backend {
        /// The address of the topic.
        address: String,
        /// The reason that the middleware gives.
        reason: String,
    },
}

/// A message arrived and could not be received.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("a message at `{address}` cannot be received: {reason}")]
pub struct ReceiveError {
    /// The address of the topic or of the server.
    pub address: String,
    /// The reason that the middleware gives, or what cannot be converted.
    pub reason: String,
}

/// A port could not be opened.
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
        /// The process that serves it.
        holder: String,
    },
    /// Two endpoints of a connection have different types.
    #[error(
        "the endpoints of `{address}` differ in type: this one has {ours}, the other one {theirs}; regenerate and rebuild both from the same .idsl"
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
        /// The reason that the middleware gives, and the remedy.
        reason: String,
    },
}
