//! The order in which managed components are configured, activated and deactivated.

use crate::supervisor::supervise::Supervisor;
use rc_management::event::Severity;
use rc_management::lifecycle::LifecycleState;
use std::time::Instant;

impl Supervisor<'_> {
    /// Sends managed units the goals whose turn it is.
    pub(super) fn advance_lifecycles(&mut self) {
        let now = Instant::now();
        if self.ending.is_some() {
            // A goal that is late must not wake the loop again.
            for unit in &mut self.units {
                unit.missed_goal(now);
            }
            return;
        }
        for i in 0..self.units.len() {
            if let Some(reason) = self.units[i].missed_goal(now) {
                self.lifecycle_missed(i, &reason);
            } else if let Some(goal) = self.units[i].next_goal()
                && self.may_go(i, goal)
            {
                let limit = self.units[i].component.ready;
                self.units[i].send_goal(goal, limit);
            }
        }
    }

    fn may_go(&self, i: usize, goal: LifecycleState) -> bool {
        let active = LifecycleState::Active;
        if goal == active {
            let all_configured = self.is_up || self.order.are_configured(&self.units);
            let needs = self.order.needs(i);
            return all_configured && needs.iter().all(|&j| self.units[j].lets_others_work());
        }
        if self.units[i].lifecycle_state() != Some(active) {
            return true;
        }
        // Dependents that are to be deactivated, too, go first.
        let dependents = self.order.dependents(i);
        let mut waiting = dependents.filter(|&k| {
            let unit = &self.units[k];
            let goal = unit.lifecycle_goal();
            let goes_on = match unit.lifecycle_state() {
                Some(LifecycleState::Active) => true,
                Some(LifecycleState::Inactive) => goal == Some(LifecycleState::Unconfigured),
                _ => unit.is_in_transition(),
            };
            unit.is_alive() && goes_on && goal != Some(active)
        });
        waiting.next().is_none()
    }

    /// A unit has not come to its goal. The first start of a network is all or nothing; after that,
    /// its command or its restart policy decides.
    fn lifecycle_missed(&mut self, i: usize, reason: &str) {
        let unit = &mut self.units[i];
        if unit.is_asked_to_stop() {
            return;
        }
        let is_first = !unit.has_settled() && !self.commands.changes_lifecycle(i);
        if is_first && !unit.is_restarted() {
            return self.fail(i, reason);
        }
        self.commands.failed(i, reason);
        let unit = &mut self.units[i];
        unit.event(self.report, Severity::Warning, "not-changed", reason);
        if is_first {
            unit.ask_to_stop();
        } else {
            unit.abandon_goal();
        }
    }
}
