//! The result of a call across the border, as `enum rc_status` of `abi.h` numbers it.

use rc_host::HostError;
use rc_middleware::{CallError, SendError};
use rc_runtime::{TimeError, WorkerError};

pub(crate) const DONE: i32 = 0;
/// An exception that the operation declares; `number` is its hash.
pub(crate) const EXCEPTION: i32 = 1;
const NO_SERVER: i32 = 10;
const TIMEOUT: i32 = 11;
const SERVER_DIED: i32 = 12;
const QUEUE_FULL: i32 = 13;
const REFUSED: i32 = 14;
const UNAVAILABLE: i32 = 15;
const STOPPING: i32 = 16;
pub(crate) const INVALID_ARGUMENT: i32 = 17;
const MALFORMED_REPLY: i32 = 18;
const MIDDLEWARE: i32 = 19;
pub(crate) const INVALID_SAMPLE: i32 = 20;
pub(crate) const NOT_SENT: i32 = 21;
/// `number` is the age in nanoseconds.
const STALE: i32 = 22;
const NO_VALUE: i32 = 23;
const TOO_MANY_STARTED: i32 = 24;
/// A started call has no result that can be taken.
pub(crate) const NOT_ENDED: i32 = 25;
/// The time of the network did not advance.
const NOT_ADVANCED: i32 = 26;
pub(crate) const WRONG_THREAD: i32 = 30;
/// A panic, or a number that the description does not have.
pub(crate) const INTERNAL: i32 = 31;
/// A member of a slot array was not opened.
const NO_MEMBER: i32 = 32;

/// Outcomes of a function of the worker.
pub(crate) const FAILED: i32 = 40;
const EMERGENCY: i32 = 41;
const FATAL: i32 = 42;
/// The worker does not have the function.
pub(crate) const NOT_WRITTEN: i32 = 43;

/// Result of a call across the border.
#[derive(Clone)]
pub(crate) struct Answer {
    pub(crate) status: i32,
    pub(crate) number: i64,
    /// A value in CDR, or a text.
    pub(crate) bytes: Vec<u8>,
}

impl Answer {
    pub(crate) fn new(status: i32, number: i64, bytes: impl Into<Vec<u8>>) -> Self {
        Self {
            status,
            number,
            bytes: bytes.into(),
        }
    }

    /// The error of a function of the worker.
    pub(crate) fn of_worker(error: &WorkerError) -> Self {
        match error {
            WorkerError::Failed(reason) => Self::new(FAILED, 0, reason.as_str()),
            WorkerError::Emergency(reason) => Self::new(EMERGENCY, 0, reason.as_str()),
            WorkerError::Fatal(reason) => Self::new(FATAL, 0, reason.as_str()),
        }
    }

    /// Success.
    pub(crate) fn number(number: i64) -> Self {
        Self::new(DONE, number, [])
    }

    pub(crate) fn text(text: &str) -> Self {
        Self::new(DONE, 0, text)
    }

    /// The text of the answer of a worker, which may have any encoding.
    pub(crate) fn reason(&self) -> String {
        String::from_utf8_lossy(&self.bytes).into_owned()
    }

    /// Outcome of a function that returns nothing. `None`: the worker does not have it.
    pub(crate) fn outcome(&self) -> Option<Result<(), WorkerError>> {
        match self.status {
            NOT_WRITTEN => None,
            FAILED => Some(Err(WorkerError::Failed(self.reason()))),
            EMERGENCY => Some(Err(WorkerError::Emergency(self.reason()))),
            FATAL => Some(Err(WorkerError::Fatal(self.reason()))),
            _ => Some(Ok(())),
        }
    }
}

impl From<HostError> for Answer {
    fn from(error: HostError) -> Self {
        let status = match error {
            HostError::WrongThread => WRONG_THREAD,
            HostError::Member(_) => NO_MEMBER,
            _ => INTERNAL,
        };
        Self::new(status, 0, error.to_string())
    }
}

impl From<TimeError> for Answer {
    fn from(error: TimeError) -> Self {
        Self::new(NOT_ADVANCED, 0, error.to_string())
    }
}

impl From<CallError> for Answer {
    fn from(error: CallError) -> Self {
        let status = match error {
            CallError::NoServer(_) => NO_SERVER,
            CallError::Deadline { .. } => TIMEOUT,
            CallError::ServerDied(_) => SERVER_DIED,
            CallError::QueueFull(_) => QUEUE_FULL,
            CallError::Refused(_) => REFUSED,
            CallError::Unavailable { .. } => UNAVAILABLE,
            CallError::Stopping => STOPPING,
            CallError::Stale { .. } => STALE,
            CallError::NoValue => NO_VALUE,
            CallError::TooManyStarted => TOO_MANY_STARTED,
            CallError::Invalid(_) => INVALID_ARGUMENT,
            CallError::Malformed(_) => MALFORMED_REPLY,
            _ => MIDDLEWARE,
        };
        let age = match error {
            CallError::Stale { age } => i64::try_from(age.as_nanos()).unwrap_or(i64::MAX),
            _ => 0,
        };
        Self::new(status, age, error.to_string())
    }
}

impl From<SendError> for Answer {
    fn from(error: SendError) -> Self {
        let status = match error {
            SendError::Invalid(_) => INVALID_SAMPLE,
            _ => NOT_SENT,
        };
        Self::new(status, 0, error.to_string())
    }
}
