//! What follows when a component ends, or does not start: events, its restart policy, and the end
//! of the network.

use crate::supervisor::restart::Next;
use crate::supervisor::supervise::{StopReason, Supervisor};
use rc_management::event::{Event, Severity};
use std::time::Duration;

impl Supervisor<'_> {
    pub(super) fn not_started(&mut self, i: usize, reason: &str) {
        let unit = &mut self.units[i];
        // A unit that has run before is restarted by its policy: the user may be building its
        // program.
        if !unit.is_restarted() {
            return self.fail(i, reason);
        }
        let text = unit.failure(reason);
        self.commands.failed(i, reason);
        unit.event(self.report, Severity::Error, "start-failed", text);
        let next = unit.follow(Duration::ZERO, true);
        self.follow_up(i, next, true);
    }

    /// Stops the network: a component did not get ready.
    pub(super) fn fail(&mut self, i: usize, reason: &str) {
        let unit = &self.units[i];
        let text = unit.failure(reason);
        unit.event(self.report, Severity::Error, "start-failed", text.clone());
        let message = format!("{}: {text}", unit.name());
        self.stop(StopReason::Failed(message), "a component did not start");
    }

    pub(super) fn unit_ended(&mut self, i: usize) {
        let asked = self.units[i].is_asked_to_stop();
        let Some(end) = self.units[i].end(self.report) else {
            return;
        };
        let goes_on = self.ending.is_none();
        if self.hosts.of(i).is_none() {
            self.network_guard.ended(self.units[i].name(), goes_on);
        }
        let unit = &self.units[i];
        // At the end of the network all are looked for at once; on another machine, its agent has
        // looked.
        if goes_on && self.hosts.of(i).is_none() {
            let mark = self.network_guard.mark();
            self.sweeps.begin(unit.name(), mark, unit.run());
        }
        if goes_on && unit.is_stopped() {
            let severity = if end.done {
                Severity::Info
            } else {
                Severity::Warning
            };
            return unit.event(
                self.report,
                severity,
                "stopped",
                format!("stopped: {}", end.text),
            );
        }
        if goes_on && !unit.has_settled() && !unit.is_restarted() {
            return self.fail(i, &format!("ended before it was ready: {}", end.text));
        }
        // While the network goes on, only a component is asked that did not get ready again; others
        // wait for one that ends without getting ready, however well it ends.
        let failed = !end.done || (goes_on && (asked || !unit.is_ready()));
        let text = format!("ended: {}", end.text);
        if failed {
            self.commands.failed(i, &unit.failure(&text));
        }
        if self.commands.changes_lifecycle(i) {
            self.units[i].abandon_goal();
        }
        let unit = &self.units[i];
        if !failed {
            unit.event(self.report, Severity::Info, "exited", text);
        } else if asked {
            unit.event(self.report, Severity::Warning, "exited", text);
        } else {
            let text = unit.failure(&text);
            unit.event(self.report, Severity::Error, "exited", text);
        }
        let next = if goes_on {
            self.units[i].follow(end.ran, failed)
        } else {
            Next::Nothing
        };
        self.follow_up(i, next, failed && (goes_on || !asked));
    }

    /// Reports how many orphaned processes of a component were killed.
    pub(super) fn left_over(&self, name: &str, count: usize) {
        if count > 0 {
            let text = format!("killed {count} orphaned processes");
            let event = Event::component(name, Severity::Warning, "left-over", text);
            self.report.event(event);
        }
    }

    /// Restarts or gives up a unit that has ended.
    fn follow_up(&mut self, i: usize, next: Next, failed: bool) {
        let unit = &self.units[i];
        match next {
            Next::Nothing if failed => self.failed.push(unit.name().to_owned()),
            Next::Nothing => {}
            Next::Again(pause) => {
                let text = format!("restarts in {pause:?}");
                unit.event(self.report, Severity::Warning, "restarting", text);
            }
            Next::GiveUp(why) => {
                let text = unit.failure(&why);
                unit.event(self.report, Severity::Error, "gave-up", text.clone());
                let message = format!("{}: {text}", unit.name());
                let why = "a component reached its restart limit";
                self.stop(StopReason::Failed(message), why);
            }
        }
    }
}
