//! Interface of the runtime to a generated component.

use crate::context::Core;
use crate::lifecycle::Hook;
use crate::machine::Parts;
use crate::member::Member;
use crate::worker_error::WorkerError;
use rc_configuration::{ParamChange, Values};
use rc_middleware::typed::{HandlerError, Request};
use rc_middleware::{Encoding, KeptSample, Reader};

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
    fn emergency(&mut self);

    /// Runs once between the states Emergency and Running.
    fn restore(&mut self);

    /// Runs once, after all other calls.
    fn finalize(&mut self);

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

    /// Answers a request to an implemented slot.
    fn serve(&mut self, slot: usize, request: &mut Request<'_>) -> Result<(), HandlerError> {
        let _ = slot;
        request.unknown()
    }

    /// Handles a sample of a subscribed topic.
    fn receive(
        &mut self,
        slot: usize,
        operation: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        let _ = (slot, operation, reader);
        Err(HandlerError(
            "the component subscribes to nothing".to_owned(),
        ))
    }

    /// Whether the handler of a subscribed topic may keep samples: then it gets them by
    /// [`Component::receive_kept`] where the middleware gives them away. Asked for a member with
    /// the number of its array.
    fn keeps(&self, slot: usize, operation: usize) -> bool {
        let _ = (slot, operation);
        false
    }

    /// Handles a sample that it may keep, see [`Component::keeps`]. `member` is that of a slot
    /// array, and `slot` then the number of the array.
    fn receive_kept(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        encoding: Encoding,
        sample: Box<dyn KeptSample>,
    ) -> Result<(), HandlerError> {
        let reader = &mut Reader::of(sample.memory(), encoding);
        match member {
            Some(member) => self.receive_member(slot, member, operation, reader),
            None => self.receive(slot, operation, reader),
        }
    }

    /// Answers a request to a member of an implemented slot array. `slot` is the number of the
    /// array.
    fn serve_member(
        &mut self,
        slot: usize,
        member: &Member,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        let _ = (slot, member);
        request.unknown()
    }

    /// Handles a sample of a member of a subscribed slot array. `slot` is the number of the array.
    fn receive_member(
        &mut self,
        slot: usize,
        member: &Member,
        operation: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        let _ = (slot, member, operation, reader);
        Err(HandlerError(
            "the component has no array that subscribes".to_owned(),
        ))
    }
}
