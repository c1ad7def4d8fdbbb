//! Connects a component's process with the control of its life cycle.

use crate::log::reporter::Reporter;
use crate::supervisor::lifecycle_control::LifecycleControl;
use crate::supervisor::unit::{Phase, Stop, Unit};
use rc_management::event::Severity;
use rc_management::lifecycle::{LifecycleState, Transition};
use rc_management::link::{LifecycleReport, SupervisorMessage};
use rc_management::rpc;
use std::time::{Duration, Instant};

impl Unit {
    /// Whether it has the life cycle of a managed component.
    pub(crate) fn is_managed(&self) -> bool {
        self.lifecycle.is_some()
    }

    /// The state of its life cycle in this run.
    pub(super) fn lifecycle_state(&self) -> Option<LifecycleState> {
        self.lifecycle.as_ref()?.state()
    }

    /// The state to which its life cycle is to come.
    pub(super) fn lifecycle_goal(&self) -> Option<LifecycleState> {
        self.lifecycle.as_ref().map(LifecycleControl::goal)
    }

    /// Whether it is ready and, if it is managed, in the state that is wanted of it.
    pub(crate) fn is_settled(&self) -> bool {
        let control = self.lifecycle.as_ref();
        self.ready && control.is_none_or(LifecycleControl::is_settled)
    }

    /// Whether it was settled once since its last start.
    pub(super) fn has_settled(&self) -> bool {
        let control = self.lifecycle.as_ref();
        self.ready && control.is_none_or(LifecycleControl::has_settled)
    }

    /// Whether those that depend on it can work: it does, or will not by itself.
    pub(crate) fn lets_others_work(&self) -> bool {
        let Some(control) = &self.lifecycle else {
            return self.lets_others_start();
        };
        let finalized = control.state() == Some(LifecycleState::Finalized);
        self.is_gone() || finalized || (self.ready && control.is_settled())
    }

    /// Whether a dependent may start. A managed one may be configured before this one is active.
    pub(crate) fn lets_start(&self, dependent: &Unit) -> bool {
        if dependent.is_managed() {
            self.lets_others_start()
        } else {
            self.lets_others_work()
        }
    }

    /// Sets the state to which it is to come.
    pub(super) fn set_lifecycle_goal(&mut self, goal: LifecycleState) {
        if let Some(control) = &mut self.lifecycle {
            control.set_goal(goal);
        }
    }

    /// The state to which a command would bring it, from where it is or is about to be.
    pub(super) fn meant(&self, transition: Transition) -> Option<LifecycleState> {
        let control = self.lifecycle.as_ref()?;
        Some(control.meant(transition))
    }

    /// Gives up its goal: it stays as it is. A hook that runs ends first, and it stays where the
    /// hook leads.
    pub(super) fn abandon_goal(&mut self) {
        let stays = self.is_alive() && !self.is_asked_to_stop();
        if let Some(control) = &mut self.lifecycle {
            control.abandon(stays);
        }
    }

    /// Whether a hook runs, which may take longer than two heartbeats.
    pub(super) fn is_in_transition(&self) -> bool {
        self.lifecycle_state()
            .is_some_and(|state| !state.is_primary())
    }

    /// Takes its report.
    pub(super) fn take_lifecycle(&mut self, report: LifecycleReport, events: &Reporter) {
        let stays = !self.is_asked_to_stop();
        let Some(control) = &mut self.lifecycle else {
            return;
        };
        let state = report.state;
        if control.take(report, stays) {
            let severity = match state {
                LifecycleState::ErrorProcessing | LifecycleState::Finalized if stays => {
                    Severity::Warning
                }
                LifecycleState::Unconfigured
                | LifecycleState::Inactive
                | LifecycleState::Active
                | LifecycleState::Finalized
                | LifecycleState::Configuring
                | LifecycleState::CleaningUp
                | LifecycleState::ShuttingDown
                | LifecycleState::Activating
                | LifecycleState::Deactivating
                | LifecycleState::ErrorProcessing => Severity::Info,
            };
            self.event(events, severity, "lifecycle", state.word());
        }
    }

    /// Whether it has become ready: it is configured, or where it is wanted.
    pub(super) fn is_configured(&self) -> bool {
        let control = self.lifecycle.as_ref();
        control.is_none_or(LifecycleControl::is_ready)
    }

    /// The goal that it waits for: none while it is in progress, or cannot be reached.
    pub(super) fn next_goal(&self) -> Option<LifecycleState> {
        let control = self.lifecycle.as_ref()?;
        let takes_goals = self.is_alive() && !self.is_asked_to_stop();
        takes_goals.then(|| control.next_goal()).flatten()
    }

    /// Sends it a goal, which it has to reach within `limit`.
    pub(super) fn send_goal(&mut self, goal: LifecycleState, limit: Duration) {
        let Some(control) = &mut self.lifecycle else {
            return;
        };
        // If the line is lost, the limit ends the wait.
        let message = control.send(goal, Instant::now() + limit);
        self.tell(&message);
    }

    /// Sends a message on its link. One without room is lost.
    pub(super) fn tell(&self, message: &SupervisorMessage) {
        if let Phase::Alive(running) = &self.phase {
            let line = rpc::notification(message);
            running.handle.send_line(&String::from_utf8_lossy(&line));
        }
    }

    /// When a goal must be reached.
    pub(super) fn goal_deadline(&self) -> Option<Instant> {
        let control = self.lifecycle.as_ref()?;
        let Phase::Alive(running) = &self.phase else {
            return None;
        };
        control.deadline().filter(|_| running.stop() == Stop::No)
    }

    /// Takes why its last goal was missed, or is late at this time.
    pub(super) fn missed_goal(&mut self, now: Instant) -> Option<String> {
        self.lifecycle.as_mut()?.missed(now, self.component.ready)
    }
}
