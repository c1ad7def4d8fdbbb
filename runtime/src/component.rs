//! Interface of the runtime to a generated component.

use crate::collect::{Collect, Collected};
use crate::context::Core;
use crate::lifecycle::Hook;
use crate::machine::Parts;
use crate::worker_error::WorkerError;
use rc_configuration::{ParamChange, Values};
use rc_middleware::shared_value::HeldValue;
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{Ended, HandlerError, Request};
use rc_middleware::{Encoding, KeptSample, Member, Message, Reader};
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// A worker with its context, as generated code joins them.
///
/// The runtime calls all methods on one thread.
pub trait Component {
    /// The part of the context that the runtime shares with the worker.
    fn core(&mut self) -> &mut Core;

    /// Runs the worker's `compute()`.
    fn compute(&mut self) -> Result<(), WorkerError>;

    /// Gives the context new values of its parameters.
    fn set_parameters(&mut self, values: &Values) {
        let _ = values;
    }

    /// Runs the worker's `params_changed()`, after [`Component::set_parameters`]. An error refuses
    /// the changes.
    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        let _ = changes;
        Ok(())
    }

    /// Handles the events of the component's state machine that wait. Runs after handlers.
    fn react(&mut self) -> Result<(), WorkerError> {
        Ok(())
    }

    /// Whether the component does something in turns of the event loop, in addition to handlers.
    fn has_turns(&self) -> bool {
        false
    }

    /// Runs in each turn of the event loop, after handlers. Returns whether it did anything.
    fn turn(&mut self) -> bool {
        false
    }

    /// Whether the worker is a window, whose events run while the event loop waits.
    fn has_window(&self) -> bool {
        false
    }

    /// Runs the events of the window until `events` is readable or `limit` is over. An error is that
    /// of an event.
    fn wait_in_window(
        &mut self,
        events: BorrowedFd<'_>,
        limit: Duration,
    ) -> Result<(), WorkerError> {
        let _ = (events, limit);
        Ok(())
    }

    /// The state machine of the component.
    fn machine(&mut self) -> Option<&mut Parts> {
        None
    }

    /// Runs a function of the worker for its life cycle.
    fn run_hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError> {
        let _ = hook;
        Ok(())
    }

    /// Runs in place of `compute()` in the state Emergency.
    fn emergency(&mut self) {}

    /// Runs once between the states Emergency and Running.
    fn restore(&mut self) {}

    /// Runs once, after all other calls.
    fn finalize(&mut self) {}

    /// Writes the number of peers of each slot that requires or publishes into `peers`, at the
    /// number of the slot or of the member.
    fn sending_peers(&self, peers: &mut [usize]) {
        let _ = peers;
    }

    /// The state in which the component refuses all requests to an implemented slot; `None` if it
    /// serves them. Asked before each request; for a member, of its array.
    fn unavailable(&mut self, slot: usize) -> Option<String> {
        let _ = slot;
        None
    }

    /// Answers a request to an implemented slot. `member` is that of a slot array, and `slot` then
    /// the number of the array.
    fn serve(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let _ = (slot, member);
        request.unknown()
    }

    /// Handles a sample of a subscribed topic. `member` is that of a slot array, and `slot` then
    /// the number of the array.
    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        let _ = (slot, member, operation, sample);
        Err(HandlerError(
            "the component subscribes to nothing".to_owned(),
        ))
    }

    /// Collections of samples.
    fn collects(&self) -> &'static [Collect] {
        &[]
    }

    /// Handles the samples of a collection, one of each topic, in their order. `number` is that of the
    /// collection.
    fn collected(&mut self, number: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        let _ = (number, samples);
        Ok(())
    }

    /// Whether an implemented slot takes one more request: else requests wait in the queue of their
    /// middleware until a started call has ended.
    fn has_room(&self, slot: usize, member: Option<&Member>) -> bool {
        let _ = (slot, member);
        true
    }

    /// Whether the handler of a subscribed topic may keep samples: then it gets [`Body::Kept`]
    /// where the middleware gives samples away. Asked for a member with the number of its array.
    fn keeps(&self, slot: usize, operation: usize) -> bool {
        let _ = (slot, operation);
        false
    }

    /// Whether the worker may start calls through a required slot. Asked for a member with the
    /// number of its array.
    fn starts_calls(&self, slot: usize) -> bool {
        let _ = slot;
        false
    }

    /// Lets the worker handle the end of a call that it has started through a required slot. `None`
    /// if none has ended. `member` is that of a slot array, and `slot` then the number of the
    /// array.
    fn end_call(&mut self, slot: usize, member: Option<&Member>) -> Option<CallEnd> {
        let _ = (slot, member);
        None
    }

    /// Whether calls that were started through a slot end in the order of their start.
    fn end_in_order(&mut self, slot: usize, member: Option<&Member>, keeps: bool) {
        let _ = (slot, member, keeps);
    }

    /// The descriptor and time to wait for while calls that were started through a slot have not
    /// ended.
    fn awaiting(&mut self, slot: usize, member: Option<&Member>) -> Option<Awaiting<'_>> {
        let _ = (slot, member);
        None
    }
}

/// How a started call ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallEnd {
    /// At its deadline, without a reply.
    Deadline,
    /// By a reply, or by an error that did not wait for the deadline.
    Earlier,
}

impl CallEnd {
    /// How this call ended.
    pub fn of(ended: &Ended<'_>) -> Self {
        if ended.is_late() {
            Self::Deadline
        } else {
            Self::Earlier
        }
    }
}

/// A received sample.
pub struct Sample<'a> {
    /// How its body is encoded.
    pub encoding: Encoding,
    /// When it was sent, see [`rc_middleware::Header::sent`].
    pub sent: u64,
    /// The memory of its body.
    pub body: Body<'a>,
}

/// The memory of a sample's body.
pub enum Body<'a> {
    /// Valid while the handler runs.
    Borrowed(&'a [u8]),
    /// The handler may keep it, see [`Component::keeps`].
    Kept(Box<dyn KeptSample>),
    /// From a publisher in this process, not encoded.
    Value(HeldValue),
}

impl<'a> From<Message<'a>> for Body<'a> {
    fn from(message: Message<'a>) -> Self {
        match message {
            Message::Bytes(body) => Self::Borrowed(body),
            Message::Value(value) => Self::Value(value),
        }
    }
}

impl Sample<'_> {
    /// Reads the body.
    pub fn reader(&self) -> Reader<'_> {
        match &self.body {
            Body::Value(value) => value.reader(),
            body @ (Body::Borrowed(_) | Body::Kept(_)) => Reader::of(body.memory(), self.encoding),
        }
    }
}

impl Body<'_> {
    /// The encoded body.
    pub fn memory(&self) -> &[u8] {
        match self {
            Self::Borrowed(body) => body,
            Self::Kept(sample) => sample.memory(),
            Self::Value(value) => value.bytes(),
        }
    }
}
