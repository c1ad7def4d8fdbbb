//! The loop's part in the life cycle of a managed component: transitions between two turns.

use super::EventLoop;
use crate::firing::not_active;
use crate::lifecycle::{Goal, Hook, Lifecycle, LifecycleState, Missed, Task, too_late};
use crate::notify::{self, ServiceState};
use std::sync::Arc;
use std::time::Instant;

impl EventLoop<'_> {
    /// The state of the life cycle, if it keeps `compute()` and handlers from running.
    pub(super) fn idle_state(&self) -> Option<LifecycleState> {
        let lifecycle = self.shared.lifecycle.as_ref()?;
        (!lifecycle.is_active()).then(|| lifecycle.state())
    }

    /// Takes the transitions that are asked for. A component that is not active afterwards refuses
    /// the events of tools.
    pub(super) fn change_lifecycle(&mut self) {
        let Some(lifecycle) = self.shared.lifecycle.clone() else {
            return;
        };
        while !self.shared.wake_event.is_stopping()
            && self.fatal.is_none()
            && let Some(task) = lifecycle.next()
        {
            match task {
                Task::Transition(request) if request.is_late() => {
                    let late = too_late(request.transition, lifecycle.state());
                    request.end(Err(late));
                }
                Task::Transition(request) => {
                    let component = &mut *self.component;
                    let run = |hook: Hook<'_>| component.run_hook(hook);
                    let result = lifecycle.take(request.transition, run);
                    self.note_missed(&result);
                    request.end(result.map_err(|missed| missed.to_string()));
                }
                Task::Goal(goal) => self.reach(&lifecycle, goal),
            }
            // A hook takes as long as its device. The loop has turned.
            self.shared.turned(Instant::now());
        }
        if let Some(state) = self.idle_state()
            && let Some(machine) = self.component.machine()
        {
            machine.refuse_outside(&not_active(state));
        }
    }

    fn reach(&mut self, lifecycle: &Arc<Lifecycle>, goal: Goal) {
        let component = &mut *self.component;
        let result = lifecycle.go_to(goal.state, |hook| component.run_hook(hook));
        self.note_missed(&result);
        let reason = result.err().map(|missed| missed.to_string());
        match (goal.number, reason) {
            (Some(number), reason) => lifecycle.goal_ended(number, reason.as_deref()),
            (None, None) => notify::notify(ServiceState::Ready),
            (None, Some(reason)) => self.fatal = Some(reason),
        }
    }

    /// A hook may demand the end of the component.
    fn note_missed(&mut self, result: &Result<LifecycleState, Missed>) {
        if let Err(missed) = result {
            self.shared.status().last_error = Some(missed.reason.clone());
            if missed.is_fatal {
                self.fatal = Some(missed.reason.clone());
            }
        }
    }

    /// Takes a component that ends through `deactivate`, `cleanup` and `shutdown`. After a hook
    /// that fails, only `shutdown` follows.
    pub(super) fn finish_lifecycle(&mut self) {
        let Some(lifecycle) = self.shared.lifecycle.clone() else {
            return;
        };
        let component = &mut *self.component;
        lifecycle.finish(|hook| component.run_hook(hook));
    }
}
