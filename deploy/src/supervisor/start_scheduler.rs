//! Decides which components start now: those whose needs are ready, a few at a time.

use crate::guard::network_guard::NetworkGuard;
use crate::process::identity::Mark;
use crate::process::orphans::OrphanSweeps;
use crate::remote::Hosts;
use crate::supervisor::start_order::StartOrder;
use crate::supervisor::unit::Unit;
use std::collections::HashMap;
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
struct StartQuota {
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
    fn new(limit: usize) -> Self {
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
    fn next(&self) -> Option<Instant> {
        self.next
    }
}

/// Decides which processes start now.
#[derive(Debug)]
pub(super) struct StartScheduler {
    quota: StartQuota,
    /// Processes left by earlier runs of components are killed before their next start.
    sweeps: OrphanSweeps,
}

/// The supervisor's data for decisions about starts.
#[derive(Clone, Copy)]
pub(super) struct StartInputs<'a> {
    order: &'a StartOrder,
    units: &'a [Unit],
    hosts: &'a Hosts,
    guard: &'a NetworkGuard,
}

impl<'a> StartInputs<'a> {
    pub(super) fn new(
        order: &'a StartOrder,
        units: &'a [Unit],
        hosts: &'a Hosts,
        guard: &'a NetworkGuard,
    ) -> Self {
        Self {
            order,
            units,
            hosts,
            guard,
        }
    }
}

impl StartScheduler {
    pub(super) fn new() -> Self {
        Self {
            quota: StartQuota::new(*LIMIT),
            sweeps: OrphanSweeps::default(),
        }
    }

    /// When the scheduler has to be asked again.
    pub(super) fn deadline(&self) -> Option<Instant> {
        let both = self.quota.next().into_iter().chain(self.sweeps.deadline());
        both.min()
    }

    /// Searches the processes that a run of a component has left. Until then the component does not
    /// start again.
    pub(super) fn sweep(&mut self, component: &str, mark: &Mark, run: String) {
        self.sweeps.begin(component, mark, run);
    }

    /// The components whose sweeps are over, with the numbers of killed processes.
    pub(super) fn swept(&mut self) -> Vec<(String, usize)> {
        self.sweeps.done()
    }

    /// Begins a turn of the loop.
    pub(super) fn begin_turn(&mut self, now: Instant, at: StartInputs<'_>) {
        let leaders = at
            .units
            .iter()
            .enumerate()
            .filter(|(i, _)| at.order.leads(*i));
        let starting = leaders.filter_map(|(i, unit)| Some((at.hosts.of(i), unit.starting()?)));
        self.quota
            .begin_turn(starting.filter(|(_, end)| now < *end));
    }

    /// The first unit from `from` on whose process may start, if one more may in this turn.
    pub(super) fn next_start(&mut self, from: usize, at: StartInputs<'_>) -> Option<usize> {
        if self.quota.is_used_up() {
            return None;
        }
        let mut all = from..at.units.len();
        all.find(|&i| self.may_start(i, at) && self.quota.has_room(at.hosts.of(i)))
    }

    /// Notes a start on a machine. It counts until `end`; `None` if the component could not be
    /// started.
    pub(super) fn started(&mut self, machine: Option<usize>, end: Option<Instant>) {
        self.quota.note(machine, end);
    }

    /// Ends a turn of the loop.
    pub(super) fn end_turn(&mut self, now: Instant) {
        self.quota.end_turn(now);
    }

    /// Whether only the number of starts delays the process of a unit. Of the units of one process,
    /// the first one represents all.
    fn may_start(&self, i: usize, at: StartInputs<'_>) -> bool {
        let name = at.units[i].process_name();
        at.order.leads(i)
            && at
                .order
                .mates(i)
                .iter()
                .all(|&j| lets_its_process_start(j, at))
            && !self.sweeps.hold_back(name)
            && (at.hosts.of(i).is_some() || at.guard.lets_start(name))
            && at.hosts.lets_start(i)
    }
}

/// Whether a unit does not hold its process back.
fn lets_its_process_start(i: usize, at: StartInputs<'_>) -> bool {
    let unit = &at.units[i];
    let mut needs = at.order.needs_outside(i);
    needs.all(|j| at.units[j].lets_start(unit))
        && unit.is_due()
        && (at.hosts.of(i).is_some() || at.guard.lets_start(unit.name()))
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
