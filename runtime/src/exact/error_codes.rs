//! Errors of calls and of sending, as entries of a recording.

use super::entry::{Entry, Kind};
use crate::worker_error::WorkerError;
use rc_middleware::{CallError, SendError};
use std::borrow::Cow;
use std::time::Duration;

/// The first number of an error in `operation`; smaller numbers are encodings of a reply.
const ERRORS: u16 = 16;

/// The error of a call as an entry, and as the worker gets it: as it can be repeated.
pub(super) fn of_call(kind: Kind, slot: usize, error: &CallError) -> (Entry<'static>, CallError) {
    let entry = |number: u16, limit: Duration, text: &str| Entry {
        value: limit.as_nanos() as u64,
        text: Cow::Owned(text.to_owned()),
        ..Entry::at(kind, slot, usize::from(ERRORS + number))
    };
    let none = Duration::ZERO;
    let recorded = match error {
        CallError::NoServer(address) => entry(0, none, address),
        CallError::Deadline { address, limit } => entry(1, *limit, address),
        CallError::ServerDied(address) => entry(2, none, address),
        CallError::QueueFull(address) => entry(3, none, address),
        CallError::Refused(reason) => entry(4, none, reason),
        CallError::Stopping => entry(5, none, ""),
        CallError::TooManyStarted => entry(8, none, ""),
        CallError::Stale { age } => entry(9, *age, ""),
        CallError::NoValue => entry(10, none, ""),
        CallError::Unavailable { state } => entry(7, none, state),
        CallError::Backend { address, reason } => entry(6, none, &format!("{address}\n{reason}")),
        other => entry(6, none, &format!("\n{other}")),
    };
    let error = call_error(&recorded);
    (recorded, error)
}

/// The error of a call that an entry holds.
pub(super) fn call_error(entry: &Entry<'_>) -> CallError {
    let text = entry.text.to_string();
    match entry.operation.saturating_sub(ERRORS) {
        0 => CallError::NoServer(text),
        1 => CallError::Deadline {
            address: text,
            limit: Duration::from_nanos(entry.value),
        },
        2 => CallError::ServerDied(text),
        3 => CallError::QueueFull(text),
        4 => CallError::Refused(text),
        5 => CallError::Stopping,
        7 => CallError::Unavailable { state: text },
        8 => CallError::TooManyStarted,
        9 => CallError::Stale {
            age: Duration::from_nanos(entry.value),
        },
        10 => CallError::NoValue,
        _ => {
            let (address, reason) = parts(&text);
            CallError::Backend { address, reason }
        }
    }
}

/// Whether an entry holds an error.
pub(super) fn is_error(entry: &Entry<'_>) -> bool {
    entry.operation >= ERRORS
}

/// The error of publishing as an entry, and as the worker gets it.
pub(super) fn of_sending(slot: usize, error: &SendError) -> (Entry<'static>, SendError) {
    let text = match error {
        SendError::Backend { address, reason } => format!("{address}\n{reason}"),
        other => format!("\n{other}"),
    };
    let entry = Entry {
        text: Cow::Owned(text),
        ..Entry::at(Kind::Failed, slot, usize::from(ERRORS + 6))
    };
    let error = send_error(&entry);
    (entry, error)
}

/// The error of publishing that an entry holds.
pub(super) fn send_error(entry: &Entry<'_>) -> SendError {
    let (address, reason) = parts(&entry.text);
    SendError::Backend { address, reason }
}

fn parts(text: &str) -> (String, String) {
    let (address, reason) = text.split_once('\n').unwrap_or(("", text));
    (address.to_owned(), reason.to_owned())
}

/// The error of a function of the worker.
pub(super) fn of_worker(error: &WorkerError) -> Entry<'_> {
    let (number, text) = match error {
        WorkerError::Failed(text) => (0, text),
        WorkerError::Emergency(text) => (1, text),
        WorkerError::Fatal(text) => (2, text),
    };
    Entry {
        value: number,
        text: Cow::Borrowed(text),
        ..Entry::of(Kind::Error)
    }
}
