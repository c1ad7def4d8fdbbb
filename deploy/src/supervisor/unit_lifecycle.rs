//! What a component does on the way to the goal of its life cycle.

use crate::log::reporter::Reporter;
use crate::supervisor::lifecycle_control::{LifecycleControl, Run};
use crate::supervisor::unit::{Phase, Stop, Unit};
use rc_diagnostics::foreign::clean;
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
        self.lifecycle.as_ref()?.run.state
    }

    /// The state to which its life cycle is to come.
    pub(super) fn lifecycle_goal(&self) -> Option<LifecycleState> {
        self.lifecycle.as_ref().map(|control| control.goal)
    }

    /// Whether it is ready and, if it is managed, in the state that is wanted of it.
    pub(crate) fn is_settled(&self) -> bool {
        let control = self.lifecycle.as_ref();
        self.ready && control.is_none_or(LifecycleControl::is_settled)
    }

    /// Whether it was settled once since its last start.
    pub(super) fn has_settled(&self) -> bool {
        let control = self.lifecycle.as_ref();
        self.ready && control.is_none_or(|control| control.run.has_settled)
    }

    /// Whether those that depend on it can work: it does, or will not by itself.
    pub(crate) fn lets_others_work(&self) -> bool {
        let Some(control) = &self.lifecycle else {
            return self.lets_others_start();
        };
        let finalized = control.run.state == Some(LifecycleState::Finalized);
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

    /// Forgets the last run. The goal stays.
    pub(super) fn begin_lifecycle(&mut self) {
        if let Some(control) = &mut self.lifecycle {
            control.run = Run::default();
            control.settle_abandoned();
        }
    }

    /// Sets the state to which it is to come.
    pub(super) fn set_lifecycle_goal(&mut self, goal: LifecycleState) {
        if let Some(control) = &mut self.lifecycle {
            control.goal = goal;
            control.is_abandoned = false;
            control.run.is_steady = false;
        }
    }

    /// The state to which a command would bring it, from where it is or is about to be.
    pub(super) fn meant(&self, transition: Transition) -> Option<LifecycleState> {
        let control = self.lifecycle.as_ref()?;
        let state = control.run.state.filter(|state| state.is_primary());
        let sent = control.run.sent.map(|(goal, _)| goal);
        Some(transition.meant(sent.or(state).unwrap_or(control.goal)))
    }

    /// Gives up its goal: it stays as it is. A hook that runs ends first, and it stays where the
    /// hook leads.
    pub(super) fn abandon_goal(&mut self) {
        let stays = self.is_alive() && !self.is_asked_to_stop();
        if let Some(control) = &mut self.lifecycle {
            control.is_abandoned = true;
            if stays {
                control.settle_abandoned();
            }
        }
    }

    /// Its loop runs: it takes goals.
    pub(super) fn lifecycle_runs(&mut self) {
        if let Some(control) = &mut self.lifecycle {
            control.run.runs = true;
        }
    }

    /// Whether a hook runs, which may take longer than two heartbeats.
    pub(super) fn is_in_transition(&self) -> bool {
        self.lifecycle_state()
            .is_some_and(|state| !state.is_primary())
    }

    /// Takes its report.
    pub(super) fn take_lifecycle(&mut self, report: LifecycleReport, events: &Reporter) {
        // On the way to its end, it passes through states that nothing wants of it.
        let stays = !self.is_asked_to_stop();
        let Some(control) = &mut self.lifecycle else {
            return;
        };
        let LifecycleReport { state, done, error } = report;
        let changed = control.run.state.replace(state) != Some(state);
        if control.run.sent.is_some() && done == control.number {
            control.run.sent = None;
            control.run.missed = error.as_deref().map(clean);
        }
        if stays {
            control.settle_abandoned();
        }
        let is_idle = control.run.sent.is_none() && control.run.missed.is_none();
        if state == control.goal && is_idle && stays {
            control.run.has_settled = true;
            control.run.is_steady = true;
            control.reached = state;
        } else if control.run.is_steady
            && is_idle
            && stays
            && state.is_primary()
            && state != LifecycleState::Finalized
        {
            // A tool of ROS 2, or a client of its socket, has changed it.
            control.goal = state;
            control.reached = state;
        }
        if changed {
            let severity = match state {
                LifecycleState::ErrorProcessing | LifecycleState::Finalized if stays => {
                    Severity::Warning
                }
                _ => Severity::Info,
            };
            self.event(events, severity, "lifecycle", state.word());
        }
    }

    /// Whether it has become ready: it is configured, or where it is wanted.
    pub(super) fn is_configured(&self) -> bool {
        let Some(control) = &self.lifecycle else {
            return true;
        };
        let configured = control.run.state.is_some_and(LifecycleState::is_configured);
        control.run.runs && (configured || control.is_settled())
    }

    /// The goal that it waits for: none while it is on the way, or cannot come there.
    pub(super) fn next_goal(&self) -> Option<LifecycleState> {
        let control = self.lifecycle.as_ref()?;
        let is_free = control.run.runs && control.run.sent.is_none();
        if !is_free || !self.is_alive() || self.is_asked_to_stop() || control.run.missed.is_some() {
            return None;
        }
        let state = control.run.state.filter(|state| state.is_primary())?;
        // One transition at a time: what follows waits for others, and a command may give it up.
        Some(state.towards(control.goal)?.goal())
    }

    /// Sends it a goal, which it has to reach within `limit`.
    pub(super) fn send_goal(&mut self, goal: LifecycleState, limit: Duration) {
        let Some(control) = &mut self.lifecycle else {
            return;
        };
        control.number += 1;
        control.run.is_steady = false;
        control.run.sent = Some((goal, Instant::now() + limit));
        let number = control.number;
        let line = rpc::notification(&SupervisorMessage::Lifecycle { number, goal });
        if let Phase::Alive(running) = &self.phase {
            // If the line is lost, the limit ends the wait.
            running.handle.send_line(&String::from_utf8_lossy(&line));
        }
    }

    /// When a goal must be reached.
    pub(super) fn goal_deadline(&self) -> Option<Instant> {
        let sent = self.lifecycle.as_ref()?.run.sent?;
        let Phase::Alive(running) = &self.phase else {
            return None;
        };
        (running.stop == Stop::No).then_some(sent.1)
    }

    /// Takes why its last goal was missed, or is late at this time.
    pub(super) fn missed_goal(&mut self, now: Instant) -> Option<String> {
        let control = self.lifecycle.as_mut()?;
        if let Some(reason) = control.run.missed.take() {
            return Some(reason);
        }
        let (goal, _) = control.run.sent.take_if(|(_, until)| now >= *until)?;
        let state = control.run.state.map_or("silent", LifecycleState::word);
        let limit = self.component.ready;
        Some(format!("is {state}, not {goal}, after {limit:?}"))
    }
}
