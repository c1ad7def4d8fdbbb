//! Moves a managed component towards the goal of its life cycle.
//!
//! It knows reports, goals and times, and neither processes nor links, so its unit tests drive it
//! alone.

use rc_diagnostics::foreign::clean;
use rc_management::lifecycle::{LifecycleState, Transition};
use rc_management::link::{LifecycleReport, SupervisorMessage};
use std::time::{Duration, Instant};

/// The life cycle of one managed component.
#[derive(Debug)]
pub(super) struct LifecycleControl {
    /// The wanted state. A state that others set becomes the goal, so that a restart returns the
    /// component to it.
    goal: LifecycleState,
    /// The goal that it reached last; at first, the one that the network has for it.
    reached: LifecycleState,
    /// Whether the goal is given up, and a hook that was begun for it still runs.
    is_abandoned: bool,
    /// The number of the last goal that was sent. It counts over all runs, so that a late report
    /// of an earlier run answers no goal of this one.
    number: u64,
    run: Run,
}

/// Life cycle of one run of the process.
#[derive(Debug, Default)]
struct Run {
    /// Whether the loop of the component runs, so that it takes goals.
    is_looping: bool,
    /// The state that the component has reported.
    state: Option<LifecycleState>,
    /// A goal that was sent and is not reached, and when it must be.
    sent: Option<(LifecycleState, Instant)>,
    /// Whether the component has reached its goal once.
    has_settled: bool,
    /// Whether the component has reached its goal, and no other goal was set since.
    is_steady: bool,
    /// Why the last goal was missed.
    missed: Option<String>,
}

impl LifecycleControl {
    /// The control of a component that is to become active.
    pub(super) fn new() -> Self {
        Self {
            goal: LifecycleState::Active,
            reached: LifecycleState::Active,
            is_abandoned: false,
            number: 0,
            run: Run::default(),
        }
    }

    /// The state to which the component is to come.
    pub(super) fn goal(&self) -> LifecycleState {
        self.goal
    }

    /// The state that the component has reported in this run.
    pub(super) fn state(&self) -> Option<LifecycleState> {
        self.run.state
    }

    /// Whether the component is in the state of its goal, and no goal is on its way.
    pub(super) fn is_settled(&self) -> bool {
        self.run.sent.is_none() && self.run.state == Some(self.goal)
    }

    /// Whether the component has settled once in this run.
    pub(super) fn has_settled(&self) -> bool {
        self.run.has_settled
    }

    /// Whether the component is ready: its loop runs, and it is configured or settled.
    pub(super) fn is_ready(&self) -> bool {
        let is_configured = self.run.state.is_some_and(LifecycleState::is_configured);
        self.run.is_looping && (is_configured || self.is_settled())
    }

    /// Forgets the last run. The goal stays, unless it was given up.
    pub(super) fn begin_run(&mut self) {
        self.run = Run::default();
        self.settle_abandoned();
    }

    /// Notes that the loop of the component runs.
    pub(super) fn loop_runs(&mut self) {
        self.run.is_looping = true;
    }

    /// Sets the state to which the component is to come.
    pub(super) fn set_goal(&mut self, goal: LifecycleState) {
        self.goal = goal;
        self.is_abandoned = false;
        self.run.is_steady = false;
    }

    /// Gives the goal up. If `stays`, the component keeps running: it rests where it is, or where
    /// the hook that runs leads.
    pub(super) fn abandon(&mut self, stays: bool) {
        self.is_abandoned = true;
        if stays {
            self.settle_abandoned();
        }
    }

    /// The state to which `transition` would bring the component, from where it is or is about to
    /// be.
    pub(super) fn meant(&self, transition: Transition) -> LifecycleState {
        let state = self.run.state.filter(|state| state.is_primary());
        let sent = self.run.sent.map(|(goal, _)| goal);
        transition.meant(sent.or(state).unwrap_or(self.goal))
    }

    /// The goal to send next: none while one is in progress, was missed, or cannot be reached.
    pub(super) fn next_goal(&self) -> Option<LifecycleState> {
        let is_free = self.run.is_looping && self.run.sent.is_none();
        if !is_free || self.run.missed.is_some() {
            return None;
        }
        let state = self.run.state.filter(|state| state.is_primary())?;
        // One transition at a time: what follows waits for others, and a command may give it up.
        Some(state.towards(self.goal)?.goal())
    }

    /// Notes that `goal` is sent and must be reached at `until`. Returns the message.
    pub(super) fn send(&mut self, goal: LifecycleState, until: Instant) -> SupervisorMessage {
        self.number += 1;
        self.run.is_steady = false;
        self.run.sent = Some((goal, until));
        let number = self.number;
        SupervisorMessage::Lifecycle { number, goal }
    }

    /// When the goal that was sent must be reached.
    pub(super) fn deadline(&self) -> Option<Instant> {
        self.run.sent.map(|(_, until)| until)
    }

    /// Takes a report of the component. Returns whether its state has changed. Unless it `stays`,
    /// it is on the way to its end and passes through states that change no goal.
    pub(super) fn take(&mut self, report: LifecycleReport, stays: bool) -> bool {
        let LifecycleReport { state, done, error } = report;
        let changed = self.run.state.replace(state) != Some(state);
        if self.run.sent.is_some() && done == self.number {
            self.run.sent = None;
            self.run.missed = error.as_deref().map(clean);
        }
        if !stays {
            return changed;
        }
        self.settle_abandoned();
        let is_idle = self.run.sent.is_none() && self.run.missed.is_none();
        let rests = state.is_primary() && state != LifecycleState::Finalized;
        if state == self.goal && is_idle {
            self.run.has_settled = true;
            self.run.is_steady = true;
            self.reached = state;
        } else if self.run.is_steady && is_idle && rests {
            // A tool of ROS 2, or a client of its socket, has changed it.
            self.goal = state;
            self.reached = state;
        }
        changed
    }

    /// Takes why the last goal was missed: the component said so, or it is late at `now`. `limit`
    /// is the time that it had.
    pub(super) fn missed(&mut self, now: Instant, limit: Duration) -> Option<String> {
        if let Some(reason) = self.run.missed.take() {
            return Some(reason);
        }
        let (goal, _) = self.run.sent.take_if(|(_, until)| now >= *until)?;
        let state = self.run.state.map_or("silent", LifecycleState::word);
        Some(format!("is {state}, not {goal}, after {limit:?}"))
    }

    /// Makes the state in which the component rests its goal, if the goal is given up and no hook
    /// runs for it any more. If the run has no such state, the goal reached last takes its place.
    fn settle_abandoned(&mut self) {
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

#[cfg(test)]
impl LifecycleControl {
    /// The number of the last goal, and that goal if it is still on its way.
    pub(super) fn sent(&self) -> (u64, Option<LifecycleState>) {
        (self.number, self.run.sent.map(|(goal, _)| goal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use LifecycleState::{
        Activating, Active, Configuring, Deactivating, Finalized, Inactive, Unconfigured,
    };

    const LIMIT: Duration = Duration::from_secs(5);

    fn report(state: LifecycleState, done: u64) -> LifecycleReport {
        let error = None;
        LifecycleReport { state, done, error }
    }

    /// A control whose component runs and is unconfigured.
    fn running() -> LifecycleControl {
        let mut control = LifecycleControl::new();
        control.loop_runs();
        assert!(control.take(report(Unconfigured, 0), true));
        control
    }

    /// Sends the next goal, and lets the component reach it.
    fn step(control: &mut LifecycleControl) -> LifecycleState {
        let goal = control.next_goal().expect("a goal");
        control.send(goal, Instant::now() + LIMIT);
        let number = control.number;
        control.take(report(goal, number), true);
        goal
    }

    fn active() -> LifecycleControl {
        let mut control = running();
        assert_eq!([step(&mut control), step(&mut control)], [Inactive, Active]);
        control
    }

    #[test]
    fn one_goal_at_a_time_leads_to_the_goal() {
        let mut control = running();
        assert!(!control.is_ready(), "it is not configured");
        assert_eq!(step(&mut control), Inactive);
        assert!(control.is_ready() && !control.is_settled() && !control.has_settled());
        let goal = control.next_goal().expect("a goal");
        let until = Instant::now() + LIMIT;
        let message = control.send(goal, until);
        let (number, goal) = (2, Active);
        assert_eq!(message, SupervisorMessage::Lifecycle { number, goal });
        assert_eq!(control.deadline(), Some(until));
        assert_eq!(control.next_goal(), None, "one is on its way");
        control.take(report(Activating, 1), true);
        assert_eq!(
            control.deadline(),
            Some(until),
            "that answers the first goal"
        );
        control.take(report(Active, 2), true);
        assert!(control.is_settled() && control.has_settled());
        assert_eq!((control.next_goal(), control.deadline()), (None, None));
    }

    #[test]
    fn nothing_is_sent_before_the_loop_runs_or_while_a_hook_does() {
        let mut control = LifecycleControl::new();
        control.take(report(Unconfigured, 0), true);
        assert_eq!(control.next_goal(), None, "its loop does not run");
        control.loop_runs();
        assert_eq!(control.next_goal(), Some(Inactive));
        control.take(report(Configuring, 0), true);
        assert_eq!(control.next_goal(), None, "a hook runs");
        control.take(report(Finalized, 0), true);
        assert_eq!(control.next_goal(), None, "no way leads from there");
    }

    #[test]
    fn a_goal_is_missed_by_a_report_or_by_its_limit() {
        let mut control = running();
        let now = Instant::now();
        control.send(Inactive, now + LIMIT);
        let mut failed = report(Unconfigured, 1);
        failed.error = Some("no camera\u{1b}[2J".to_owned());
        control.take(failed, true);
        assert_eq!(control.next_goal(), None, "until the reason is taken");
        let reason = control.missed(now, LIMIT).expect("a reason");
        assert!(reason.starts_with("no camera") && !reason.contains('\u{1b}'));
        assert_eq!(control.missed(now, LIMIT), None, "it is taken once");
        control.send(Inactive, now + LIMIT);
        assert_eq!(control.missed(now, LIMIT), None, "it has time");
        let reason = control.missed(now + LIMIT, LIMIT);
        let wanted = "is unconfigured, not inactive, after 5s";
        assert_eq!(reason.as_deref(), Some(wanted));
        assert_eq!(control.deadline(), None);
    }

    #[test]
    fn others_change_the_goal_of_a_settled_component_only() {
        let mut control = running();
        control.take(report(Inactive, 0), true);
        assert_eq!(control.goal(), Active, "it has not settled");
        let mut control = active();
        control.take(report(Deactivating, 2), true);
        assert_eq!(control.goal(), Active, "a hook runs");
        control.take(report(Inactive, 2), true);
        assert_eq!(control.goal(), Inactive);
        control.begin_run();
        assert_eq!(control.goal(), Inactive, "a restart brings it there");
        assert_eq!(control.state(), None);
    }

    #[test]
    fn states_on_the_way_to_the_end_change_no_goal() {
        let mut control = active();
        for state in [Deactivating, Inactive, Finalized] {
            assert!(control.take(report(state, 2), false));
            assert!(!control.take(report(state, 2), false), "{state} is known");
        }
        assert_eq!(control.goal(), Active);
        let mut control = running();
        control.set_goal(Inactive);
        control.send(Inactive, Instant::now() + LIMIT);
        control.take(report(Inactive, 1), false);
        assert!(!control.has_settled());
        let mut control = active();
        control.take(report(Finalized, 2), true);
        assert_eq!(control.goal(), Active, "a finalized one is to come back");
    }

    #[test]
    fn an_abandoned_goal_is_where_the_hook_leads() {
        let mut control = active();
        control.set_goal(Unconfigured);
        control.send(Inactive, Instant::now() + LIMIT);
        control.take(report(Deactivating, 2), true);
        control.abandon(true);
        assert_eq!(control.goal(), Unconfigured, "the hook runs");
        control.take(report(Inactive, 3), true);
        assert_eq!(control.goal(), Inactive);
        assert!(control.is_settled());
    }

    #[test]
    fn a_run_that_ends_with_an_abandoned_goal_is_followed_by_the_one_that_was_reached() {
        let mut control = active();
        control.set_goal(Unconfigured);
        control.abandon(false);
        assert_eq!(control.goal(), Unconfigured);
        control.begin_run();
        assert_eq!(control.goal(), Active);
    }

    #[test]
    fn a_late_report_of_an_earlier_run_answers_no_goal() {
        let mut control = active();
        control.begin_run();
        control.loop_runs();
        control.take(report(Unconfigured, 0), true);
        control.send(Inactive, Instant::now() + LIMIT);
        control.take(report(Unconfigured, 1), true);
        assert_eq!(control.sent(), (3, Some(Inactive)));
    }

    #[test]
    fn a_transition_means_a_state_from_where_the_component_is_about_to_be() {
        let mut control = LifecycleControl::new();
        let meant = |control: &LifecycleControl| control.meant(Transition::Deactivate);
        assert_eq!(meant(&control), Inactive, "its goal is active");
        control.loop_runs();
        control.take(report(Unconfigured, 0), true);
        let here = Transition::Deactivate.meant(Unconfigured);
        assert_eq!(meant(&control), here);
        control.send(Active, Instant::now() + LIMIT);
        assert_eq!(meant(&control), Inactive);
    }
}
