//! Starts components, and sends managed ones the goals whose turn it is.

use crate::supervisor::start_scheduler::StartInputs;
use crate::supervisor::supervise::{StopReason, Supervisor};
use crate::supervisor::unit::Unit;
use rc_deploy_network::process_name;
use rc_management::event::Severity;
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

impl Supervisor<'_> {
    /// The processes that have ended for good, or that a command has stopped.
    pub(super) fn gone(&self) -> BTreeSet<String> {
        let gone = self.units.iter().filter(|unit| unit.is_gone());
        gone.map(|unit| process_name(unit.name())).collect()
    }

    /// Starts a few of the units that may start, and notes when it is the turn of the next ones.
    pub(super) fn start_ready_units(&mut self) {
        let now = Instant::now();
        let at = StartInputs::new(&self.order, &self.units, &self.hosts, &self.network_guard);
        self.starts.begin_turn(now, at);
        let mut from = 0;
        while self.ending.is_none() {
            let at = StartInputs::new(&self.order, &self.units, &self.hosts, &self.network_guard);
            let Some(i) = self.starts.next_start(from, at) else {
                break;
            };
            self.start(i);
            let (machine, end) = (self.hosts.of(i), self.units[i].starting());
            self.starts.started(machine, end);
            from = i + 1;
        }
        self.starts.end_turn(now);
    }

    /// Writes how the network has started, or how far it came, unless it was up before.
    pub(super) fn save_start(&mut self) {
        if !self.is_up {
            self.start_times.look(&self.units);
            let network = &self.plan.network;
            self.start_times.save(network, &self.units, &self.order);
        }
    }

    /// Starts the process of a unit, with all units of that process.
    pub(super) fn start(&mut self, i: usize) {
        let gone = self.gone();
        let mates = self.order.mates(i);
        for &j in mates {
            self.units[j].event(self.report, Severity::Info, "starting", "starting");
        }
        let mark = self.network_guard.mark();
        let inside = |j: usize| -> Vec<String> {
            let after = self.order.needs_inside(j);
            let names = after.map(|k| process_name(&self.plan.components[k].name));
            names.collect()
        };
        let units = self.units.iter_mut().enumerate();
        let units = units.filter(|(j, _)| mates.contains(j));
        let mut units: Vec<_> = units.map(|(j, unit)| (unit, inside(j))).collect();
        match Unit::start(&mut units, mark, &gone) {
            Ok(()) => {
                if let Some(process) = self.units[i].registered() {
                    self.network_guard.started(process);
                }
            }
            Err(reason) => self.not_started(i, &reason),
        }
    }

    /// The process of a unit could not be started.
    pub(super) fn not_started(&mut self, i: usize, reason: &str) {
        let unit = &self.units[i];
        // A unit that has run before is restarted by its policy: the user may be building its
        // program.
        if !unit.is_restarted() {
            return self.fail(i, reason);
        }
        let text = unit.failure(reason);
        for &j in self.order.mates(i) {
            self.commands.failed(j, reason);
        }
        unit.process_event(self.report, Severity::Error, "start-failed", text);
        let next = self.follow(i, Duration::ZERO, true);
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
                && self.order.may_go(i, goal, &self.units, self.is_up)
            {
                let limit = self.units[i].component.ready;
                self.units[i].send_goal(goal, limit);
                self.start_times.asked(i, goal);
            }
        }
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
