//! A message of a tool, between the management thread and the worker's.

use crate::waker::Waker;
use rc_management::rpc::Error;
use rc_middleware::{DeferredReply, ReceiveError, Reply};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// A message of a tool, which the worker handles.
#[derive(Debug)]
pub(crate) struct ToolMessage {
    pub(crate) slot: usize,
    /// The operation of a sample; none for a request.
    pub(crate) operation: Option<usize>,
    pub(crate) body: Vec<u8>,
    deadline: Instant,
    state: Mutex<MessageState>,
    management: Waker,
}

#[derive(Debug)]
enum MessageState {
    Waits,
    /// The worker has begun, or the client waits no more.
    Begun,
    Handled(Result<Vec<u8>, String>),
}

impl ToolMessage {
    pub(crate) fn new(
        (slot, operation): (usize, Option<usize>),
        body: Vec<u8>,
        deadline: Instant,
        management: Waker,
    ) -> Self {
        Self {
            slot,
            operation,
            body,
            deadline,
            state: Mutex::new(MessageState::Waits),
            management,
        }
    }

    pub(crate) fn deadline(&self) -> Instant {
        self.deadline
    }

    fn state(&self) -> MutexGuard<'_, MessageState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins to handle the message; false if its time has passed.
    pub(crate) fn begin(&self) -> bool {
        let mut state = self.state();
        let waits = matches!(*state, MessageState::Waits) && Instant::now() < self.deadline;
        *state = MessageState::Begun;
        waits
    }

    /// Hands the reply to the client.
    pub(crate) fn end(&self, result: Result<Vec<u8>, String>) {
        *self.state() = MessageState::Handled(result);
        self.management.wake();
    }

    /// The result, if there is one or the time has passed.
    pub(crate) fn result(&self, now: Instant) -> Option<Result<Vec<u8>, Error>> {
        let mut state = self.state();
        match std::mem::replace(&mut *state, MessageState::Begun) {
            MessageState::Handled(result) => {
                Some(result.map_err(|reason| Error::new(Error::WORKER_REFUSES, reason)))
            }
            _ if now >= self.deadline => {
                let message = "the component has not replied in time";
                Some(Err(Error::new(Error::WORKER_TIMEOUT, message)))
            }
            other @ (MessageState::Waits | MessageState::Begun) => {
                *state = other;
                None
            }
        }
    }
}

/// Takes the reply to the request of a tool.
pub(crate) struct ToolReply<'m> {
    message: &'m Arc<ToolMessage>,
    pub(crate) body: Vec<u8>,
    /// Whether it comes later.
    pub(crate) is_deferred: bool,
}

impl<'m> ToolReply<'m> {
    pub(crate) fn new(message: &'m Arc<ToolMessage>) -> Self {
        Self {
            message,
            body: Vec::new(),
            is_deferred: false,
        }
    }
}

impl Reply for ToolReply<'_> {
    fn body(&mut self) -> &mut Vec<u8> {
        &mut self.body
    }

    fn defer(&mut self) -> Option<Box<dyn DeferredReply>> {
        self.is_deferred = true;
        Some(Box::new(ToolDeferred(Arc::clone(self.message))))
    }
}

/// A deferred reply.
struct ToolDeferred(Arc<ToolMessage>);

impl DeferredReply for ToolDeferred {
    fn send(self: Box<Self>, write: &mut dyn FnMut(&mut dyn Reply)) -> Result<(), ReceiveError> {
        let mut body = Vec::new();
        write(&mut body);
        self.0.end(Ok(body));
        Ok(())
    }
}
