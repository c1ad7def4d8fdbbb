//! Which components start now: those whose needs are ready, a few at a time.

use crate::supervisor::supervise::Supervisor;
use rc_deploy_network::process_name;
use std::collections::{BTreeSet, HashMap};
use std::sync::LazyLock;
use std::time::Instant;

/// How many components of a machine start at once, for each processor. More would only delay each
/// other, the supervisor, and those that run.
const STARTS_PER_PROCESSOR: usize = 4;
/// How many components one turn of the loop starts: each takes a millisecond or more. Between two
/// turns, clients are served.
const STARTS: usize = 2;
/// How many components of a machine start at once. Other machines count as this one.
pub(super) static LIMIT: LazyLock<usize> = LazyLock::new(|| {
    STARTS_PER_PROCESSOR * std::thread::available_parallelism().map_or(1, usize::from)
});

impl Supervisor<'_> {
    /// The processes that have ended for good, or that a command has stopped.
    pub(super) fn gone(&self) -> BTreeSet<String> {
        let gone = self.units.iter().filter(|unit| unit.is_gone());
        gone.map(|unit| process_name(unit.name())).collect()
    }

    /// Starts a few of the units that may start, and notes when it is the turn of the next ones.
    pub(super) fn start_ready_units(&mut self) {
        let now = Instant::now();
        let mut started = 0;
        self.next_start = None;
        // The ends of the times for which starts count, of each machine.
        let mut starting: HashMap<Option<usize>, Vec<Instant>> = HashMap::new();
        for (unit, host) in self.units.iter().zip(&self.host_of) {
            if let Some(end) = unit.starting().filter(|end| now < *end) {
                starting.entry(*host).or_default().push(end);
            }
        }
        for i in 0..self.units.len() {
            let lets = |&j: &usize| self.units[j].lets_start(&self.units[i]);
            let may = self.needs[i].iter().all(lets);
            let name = self.units[i].name();
            let due = self.units[i].is_due() && !self.sweeps.hold_back(name);
            let held = self.host_of[i].is_some() || self.custody.lets_start(name);
            if self.ending.is_some() || !(may && due && held && self.has_host(i)) {
                continue;
            }
            if started >= STARTS {
                break;
            }
            let beside = starting.entry(self.host_of[i]).or_default();
            if beside.len() >= *LIMIT {
                let next = beside.iter().copied().chain(self.next_start).min();
                self.next_start = next;
                continue;
            }
            self.start(i);
            started += 1;
            beside.extend(self.units[i].starting());
        }
        // More may start at once, also those that waited for one that could not be started.
        if started > 0 {
            self.next_start = Some(now);
        }
    }
}
