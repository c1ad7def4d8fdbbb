//! The consequences of the end of a component: events, its restart policy, and the end of the
//! network.

use crate::supervisor::restart::Next;
use crate::supervisor::supervise::{StopReason, Supervisor};
use rc_management::event::{Event, Severity};
use std::time::Duration;

impl Supervisor<'_> {
    /// Decides what follows an end of the process of a unit, for all of its units alike.
    pub(super) fn follow(&mut self, i: usize, ran: Duration, failed: bool) -> Next {
        let mut next = Next::Nothing;
        for &j in self.order.mates(i) {
            next = self.units[j].follow(ran, failed);
        }
        next
    }

    /// Handles the end of the process of a unit, for all of its units.
    pub(super) fn unit_ended(&mut self, i: usize) {
        let mates = self.order.mates(i).clone();
        let asked = self.units[i].is_asked_to_stop();
        let is_thread = self.units[i].component.thread.is_some();
        let name = self.units[i].process_name().to_owned();
        let mut end = None;
        for &j in &mates {
            // One that has ended before the others has reported it.
            let Some(own) = self.units[j].end(self.report) else {
                continue;
            };
            if is_thread {
                let text = format!("ended with process {name}");
                self.units[j].event(self.report, Severity::Info, "exited", text);
            }
            end = Some(own);
        }
        let Some(end) = end else {
            return;
        };
        let goes_on = self.ending.is_none();
        if self.hosts.of(i).is_none() {
            self.network_guard.ended(&name, goes_on);
        }
        let unit = &self.units[i];
        // At the end of the network all are looked for at once; on another machine, its agent has
        // looked.
        if goes_on && self.hosts.of(i).is_none() {
            let mark = self.network_guard.mark();
            self.starts.sweep(&name, mark, unit.run());
        }
        if goes_on && unit.is_stopped() {
            let severity = if end.done {
                Severity::Info
            } else {
                Severity::Warning
            };
            return unit.process_event(
                self.report,
                severity,
                "stopped",
                format!("stopped: {}", end.text),
            );
        }
        let mut unsettled = mates.iter().filter(|&&j| !self.units[j].has_settled());
        if let Some(&j) = unsettled.next()
            && goes_on
            && !unit.is_restarted()
        {
            return self.fail(j, &format!("ended before it was ready: {}", end.text));
        }
        let all_ready = mates.iter().all(|&j| self.units[j].is_ready());
        // While the network goes on, only a component is asked that did not get ready again; others
        // wait for one that ends without getting ready, however well it ends.
        let failed = !end.done || (goes_on && (asked || !all_ready));
        let text = format!("ended: {}", end.text);
        let reason = unit.failure(&text);
        if !failed {
            unit.process_event(self.report, Severity::Info, "exited", text);
        } else if asked {
            unit.process_event(self.report, Severity::Warning, "exited", text);
        } else {
            unit.process_event(self.report, Severity::Error, "exited", reason.clone());
        }
        for &j in &mates {
            if failed {
                self.commands.failed(j, &reason);
            }
            if self.commands.changes_lifecycle(j) {
                self.units[j].abandon_goal();
            }
        }
        let next = if goes_on {
            self.follow(i, end.ran, failed)
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
    pub(super) fn follow_up(&mut self, i: usize, next: Next, failed: bool) {
        let unit = &self.units[i];
        match next {
            Next::Nothing if failed => self.failed.push(unit.process_name().to_owned()),
            Next::Nothing => {}
            Next::Again(pause) => {
                let text = format!("restarts in {pause:?}");
                unit.process_event(self.report, Severity::Warning, "restarting", text);
            }
            Next::GiveUp(why) => {
                let text = unit.failure(&why);
                unit.process_event(self.report, Severity::Error, "gave-up", text.clone());
                let message = format!("{}: {text}", unit.process_name());
                let why = "a component reached its restart limit";
                self.stop(StopReason::Failed(message), why);
            }
        }
    }
}
