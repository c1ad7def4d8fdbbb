//! A component whose turns are recorded.

use super::entry::{Entry, Kind};
use super::recorder::Recorder;
use crate::collect::{Collect, Collected};
use crate::component::{CallEnd, Component, Sample};
use crate::context::Core;
use crate::lifecycle::Hook;
use crate::machine::Parts;
use crate::worker_error::WorkerError;
use rc_configuration::{ParamChange, Values};
use rc_middleware::Member;
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{HandlerError, Request};
use std::borrow::Cow;
use std::os::fd::BorrowedFd;
use std::rc::Rc;
use std::time::Duration;

/// Passes all calls to a component, and records them. Samples and requests are recorded where they
/// arrive.
pub(crate) struct Recorded<C> {
    component: C,
    recorder: Rc<Recorder>,
}

impl<C: Component> Recorded<C> {
    pub(crate) fn new(component: C, recorder: Rc<Recorder>) -> Self {
        Self {
            component,
            recorder,
        }
    }

    fn run<T>(&mut self, kind: Kind, text: String, run: impl FnOnce(&mut C) -> T) -> T {
        self.recorder.begin_turn(&Entry {
            text: Cow::Owned(text),
            ..Entry::of(kind)
        });
        run(&mut self.component)
    }

    fn ended(&self, result: Result<(), WorkerError>) -> Result<(), WorkerError> {
        self.recorder.result(&result);
        self.recorder.end_turn();
        result
    }
}

#[deny(
    clippy::missing_trait_methods,
    reason = "a call that is not passed on does nothing"
)]
impl<C: Component> Component for Recorded<C> {
    fn core(&mut self) -> &mut Core {
        self.component.core()
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        let result = self.run(Kind::Compute, String::new(), Component::compute);
        self.ended(result)
    }

    fn set_parameters(&mut self, values: &Values) {
        self.run(Kind::Parameters, values.to_record().to_string(), |c| {
            c.set_parameters(values);
        });
        self.recorder.end_turn();
    }

    fn parameters_changed(&mut self, changes: &[ParamChange]) -> Result<(), WorkerError> {
        let text = ParamChange::to_record(changes).to_string();
        let result = self.run(Kind::Changed, text, |c| c.parameters_changed(changes));
        self.ended(result)
    }

    fn react(&mut self) -> Result<(), WorkerError> {
        let Some(machine) = self.component.machine() else {
            return self.component.react();
        };
        let before = (machine.has_events(), machine.next_due());
        let result = self.run(Kind::React, String::new(), Component::react);
        self.recorder.result(&result);
        let machine = self.component.machine();
        let after = machine.map(|machine| (machine.has_events(), machine.next_due()));
        let has_effect = before.0 || after != Some(before);
        self.recorder.end_idle_turn(has_effect);
        result
    }

    fn has_turns(&self) -> bool {
        self.component.has_turns()
    }

    fn turn(&mut self) -> bool {
        let did = self.run(Kind::Turn, String::new(), Component::turn);
        self.recorder.end_idle_turn(did);
        did
    }

    fn has_window(&self) -> bool {
        self.component.has_window()
    }

    fn wait_in_window(
        &mut self,
        events: BorrowedFd<'_>,
        limit: Duration,
    ) -> Result<(), WorkerError> {
        self.component.wait_in_window(events, limit)
    }

    fn machine(&mut self) -> Option<&mut Parts> {
        self.component.machine()
    }

    fn run_hook(&mut self, hook: Hook<'_>) -> Result<(), WorkerError> {
        self.component.run_hook(hook)
    }

    fn emergency(&mut self) {
        self.run(Kind::Emergency, String::new(), Component::emergency);
        self.recorder.end_turn();
    }

    fn restore(&mut self) {
        self.run(Kind::Restore, String::new(), Component::restore);
        self.recorder.end_turn();
    }

    fn finalize(&mut self) {
        self.run(Kind::Finalize, String::new(), Component::finalize);
        self.recorder.end_turn();
    }

    fn sending_peers(&self, peers: &mut [usize]) {
        self.component.sending_peers(peers);
    }

    fn unavailable(&mut self, slot: usize) -> Option<String> {
        self.component.unavailable(slot)
    }

    fn serve(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        request: &mut Request<'_>,
    ) -> Result<(), HandlerError> {
        self.component.serve(slot, member, request)
    }

    fn receive(
        &mut self,
        slot: usize,
        member: Option<&Member>,
        operation: usize,
        sample: Sample<'_>,
    ) -> Result<(), HandlerError> {
        self.component.receive(slot, member, operation, sample)
    }

    fn collects(&self) -> &'static [Collect] {
        self.component.collects()
    }

    fn collected(&mut self, number: usize, samples: &[Collected]) -> Result<(), HandlerError> {
        self.component.collected(number, samples)
    }

    fn has_room(&self, slot: usize, member: Option<&Member>) -> bool {
        self.component.has_room(slot, member)
    }

    fn keeps(&self, slot: usize, operation: usize) -> bool {
        self.component.keeps(slot, operation)
    }

    fn starts_calls(&self, slot: usize) -> bool {
        self.component.starts_calls(slot)
    }

    /// The port of the client begins the turn where a call ends.
    fn end_call(&mut self, slot: usize, member: Option<&Member>) -> Option<CallEnd> {
        let ended = self.component.end_call(slot, member);
        self.recorder.end_begun_turn();
        ended
    }

    fn end_in_order(&mut self, slot: usize, member: Option<&Member>, keeps: bool) {
        self.component.end_in_order(slot, member, keeps);
    }

    fn awaiting(&mut self, slot: usize, member: Option<&Member>) -> Option<Awaiting<'_>> {
        self.component.awaiting(slot, member)
    }
}
