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

/// Lets a few components start at a time: a few in a turn of the loop, a few on each machine.
#[derive(Debug)]
pub(super) struct StartQuota {
    /// How many start at once on a machine.
    limit: usize,
    /// The ends of the times for which starts count, of each machine. `None` is this one.
    starting: HashMap<Option<usize>, Vec<Instant>>,
    /// How many have started in this turn.
    started: usize,
    /// When a component may start that waits for the starts of others, or for the next turn.
    next: Option<Instant>,
}

impl StartQuota {
    /// At most `limit` components start at once on a machine.
    pub(super) fn new(limit: usize) -> Self {
        Self {
            limit,
            starting: HashMap::new(),
            started: 0,
            next: None,
        }
    }

    /// Begins a turn. `starting` has the machine of each component that starts, and until when it
    /// counts.
    fn begin_turn(&mut self, starting: impl IntoIterator<Item = (Option<usize>, Instant)>) {
        self.starting.clear();
        self.started = 0;
        self.next = None;
        for (machine, end) in starting {
            self.starting.entry(machine).or_default().push(end);
        }
    }

    /// Whether no more component starts in this turn.
    fn is_used_up(&self) -> bool {
        self.started >= STARTS
    }

    /// Whether a component of this machine may start now. If not, [`Self::next`] says when one may.
    fn has_room(&mut self, machine: Option<usize>) -> bool {
        let beside = self.starting.entry(machine).or_default();
        if beside.len() < self.limit {
            return true;
        }
        self.next = beside.iter().copied().chain(self.next).min();
        false
    }

    /// Notes a start. It counts until `end`; `None` if the component could not be started.
    fn note(&mut self, machine: Option<usize>, end: Option<Instant>) {
        self.started += 1;
        self.starting.entry(machine).or_default().extend(end);
    }

    /// Ends a turn. More components may start at once if some have, also those that waited for one
    /// that could not be started.
    fn end_turn(&mut self, now: Instant) {
        if self.started > 0 {
            self.next = Some(now);
        }
    }

    /// When a component may start that waits.
    pub(super) fn next(&self) -> Option<Instant> {
        self.next
    }
}

impl Supervisor<'_> {
    /// The processes that have ended for good, or that a command has stopped.
    pub(super) fn gone(&self) -> BTreeSet<String> {
        let gone = self.units.iter().filter(|unit| unit.is_gone());
        gone.map(|unit| process_name(unit.name())).collect()
    }

    /// Starts a few of the units that may start, and notes when it is the turn of the next ones.
    pub(super) fn start_ready_units(&mut self) {
        let now = Instant::now();
        let units = self.units.iter().enumerate();
        let starting = units.filter(|(i, _)| self.mates[*i].first() == Some(i));
        let starting = starting.filter_map(|(i, unit)| Some((self.hosts.of(i), unit.starting()?)));
        let starting = starting.filter(|(_, end)| now < *end);
        self.quota.begin_turn(starting);
        for i in 0..self.units.len() {
            if !self.may_start(i) {
                continue;
            }
            if self.quota.is_used_up() {
                break;
            }
            if self.quota.has_room(self.hosts.of(i)) {
                self.start(i);
                self.quota.note(self.hosts.of(i), self.units[i].starting());
            }
        }
        self.quota.end_turn(now);
    }

    /// Whether nothing but the number of starts holds the process of a unit back. Of the units of
    /// one process, the first one stands for all.
    fn may_start(&self, i: usize) -> bool {
        let mates = &self.mates[i];
        let name = self.units[i].process_name();
        self.ending.is_none()
            && mates.first() == Some(&i)
            && mates.iter().all(|&j| self.lets_its_process_start(j))
            && !self.sweeps.hold_back(name)
            && (self.hosts.of(i).is_some() || self.network_guard.lets_start(name))
            && self.hosts.lets_start(i)
    }

    /// Whether a unit does not hold its process back.
    fn lets_its_process_start(&self, i: usize) -> bool {
        let lets = |&j: &usize| self.units[j].lets_start(&self.units[i]);
        let is_elsewhere = self.hosts.of(i).is_some();
        self.needs[i].difference(&self.mates[i]).all(lets)
            && self.units[i].is_due()
            && (is_elsewhere || self.network_guard.lets_start(self.units[i].name()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_turn_starts_a_few() {
        let mut quota = StartQuota::new(10);
        let now = Instant::now();
        quota.begin_turn([]);
        for _ in 0..STARTS {
            assert!(!quota.is_used_up() && quota.has_room(None));
            quota.note(None, None);
        }
        assert!(quota.is_used_up());
        quota.end_turn(now);
        assert_eq!(quota.next(), Some(now), "the others are not forgotten");
        quota.begin_turn([]);
        quota.end_turn(now);
        assert_eq!(quota.next(), None);
    }

    #[test]
    fn each_machine_has_a_limit() {
        let mut quota = StartQuota::new(2);
        let now = Instant::now();
        let after = |seconds| now + Duration::from_secs(seconds);
        quota.begin_turn([(None, after(3)), (None, after(2)), (Some(0), after(9))]);
        assert!(!quota.has_room(None));
        assert_eq!(
            quota.next(),
            Some(after(2)),
            "when the first one counts no more"
        );
        assert!(quota.has_room(Some(0)) && quota.has_room(Some(1)));
        quota.note(Some(0), Some(after(1)));
        assert!(!quota.has_room(Some(0)));
        assert_eq!(quota.next(), Some(after(1)));
        quota.end_turn(now);
        assert_eq!(quota.next(), Some(now));
    }
}
