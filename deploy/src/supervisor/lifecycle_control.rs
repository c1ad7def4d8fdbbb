//! The goal of a managed component, and what is known of its life cycle in this run.

use rc_management::lifecycle::LifecycleState;
use std::time::Instant;

/// The life cycle of one managed component.
#[derive(Debug)]
pub(super) struct LifecycleControl {
    /// The state to which it is to come. What others bring it to is the goal from then on, so that
    /// a restart returns the component to it.
    pub(super) goal: LifecycleState,
    /// The goal that it reached last; at first, the one that the network has for it.
    pub(super) reached: LifecycleState,
    /// Whether the goal is given up, and a hook still runs that was begun for it.
    pub(super) is_abandoned: bool,
    /// The number of the last goal that was sent in this run.
    pub(super) number: u64,
    pub(super) run: Run,
}

/// Life cycle of one run of the process.
#[derive(Debug, Default)]
pub(super) struct Run {
    /// Whether its loop runs, so that it takes goals.
    pub(super) runs: bool,
    /// The state that it has reported.
    pub(super) state: Option<LifecycleState>,
    /// A goal that was sent and is not reached, and when it must be.
    pub(super) sent: Option<(LifecycleState, Instant)>,
    /// Whether it has reached its goal once.
    pub(super) has_settled: bool,
    /// Whether it has reached its goal, and no other one was set since.
    pub(super) is_steady: bool,
    /// Why the last goal was missed.
    pub(super) missed: Option<String>,
}

impl LifecycleControl {
    /// That of a component that is to become active.
    pub(super) fn new() -> Self {
        Self {
            goal: LifecycleState::Active,
            reached: LifecycleState::Active,
            is_abandoned: false,
            number: 0,
            run: Run::default(),
        }
    }

    pub(super) fn is_settled(&self) -> bool {
        self.run.sent.is_none() && self.run.state == Some(self.goal)
    }

    /// Makes the state in which it rests the goal, if the goal is given up and no hook runs for it
    /// any more. Where the run has no such state, that is the goal that it reached last.
    pub(super) fn settle_abandoned(&mut self) {
        let in_hook = self.run.state.is_some_and(|state| !state.is_primary());
        if !self.is_abandoned || self.run.sent.is_some() || in_hook {
            return;
        }
        let state = self.run.state;
        self.goal = state
            .filter(|state| *state != LifecycleState::Finalized)
            .unwrap_or(self.reached);
        self.reached = self.goal;
        self.is_abandoned = false;
    }
}
