//! The loop's part in the time of its network: whose turn it is, and which work is due.

use super::EventLoop;
use super::port::Port;
use crate::clock::Time;
use crate::time::TimeRole;
use rc_management::component::Role;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// How often the ports are served, at most, before a turn ends: a sender that does not follow the
/// network's time may send without pause.
const ROUNDS_A_TURN: usize = 16;
/// The longest time for which a component holds tick 0 until it has found its peers, or a tick
/// until they have its messages.
const PEERS_LIMIT: Duration = Duration::from_secs(5);
/// How long a turn waits at once for its messages to arrive, before it looks for commands.
const ARRIVAL_WAIT: Duration = Duration::from_millis(20);

/// A time by which the silence of topics is measured: the network's, or the time since the loop
/// began.
pub(super) fn stamp(role: &TimeRole, began: Instant, now: Instant) -> Time {
    match role {
        TimeRole::System => Time::ZERO + now.saturating_duration_since(began),
        TimeRole::Follower(follower) => follower.now(),
        TimeRole::Source(source) => source.now(),
    }
}

impl TimeRole {
    /// The end of this number was readable.
    pub(super) fn wake(&mut self, at: usize) {
        match self {
            Self::System => {}
            Self::Follower(follower) => follower.woken = true,
            Self::Source(source) => source.wake(at),
        }
    }

    /// Whether the loop must not sleep.
    pub(super) fn is_in_a_hurry(&self) -> bool {
        matches!(self, Self::Source(source) if source.is_in_a_hurry())
    }

    /// Whether a source waits for this component, or this component for others.
    pub(crate) fn is_lockstep(&self) -> bool {
        match self {
            Self::System => false,
            Self::Follower(follower) => follower.is_lockstep(),
            Self::Source(source) => source.waits(),
        }
    }

    /// Whether the worker may take no longer than its period. No simulated time passes while it
    /// runs.
    pub(super) fn keeps_period(&self) -> bool {
        match self {
            Self::System => true,
            Self::Follower(_) => false,
            Self::Source(source) => source.is_paced(),
        }
    }

    fn has_turn(&self) -> bool {
        match self {
            Self::System => false,
            Self::Follower(follower) => follower.has_turn(),
            Self::Source(source) => source.has_turn(),
        }
    }
}

impl EventLoop<'_> {
    /// Leaves the network's time: its source waits for this component no more.
    pub(super) fn leave_time(&mut self) {
        if let TimeRole::Follower(follower) = &mut self.role {
            follower.leave();
        }
    }

    /// The ends of the network's time, which have to stay open until the last message has arrived.
    pub(crate) fn into_time(self) -> TimeRole {
        self.role
    }

    /// Whether samples and events wait for this component's turn, or for the next one: a turn that
    /// waits for replies handles no more of them, since the time of the replies would decide which.
    pub(super) fn is_gated(&self) -> bool {
        self.role.is_lockstep() && (!self.role.has_turn() || self.has_computed())
    }

    /// Whether this component's turn has handled its samples, and run `compute()` if it was due.
    pub(super) fn has_computed(&self) -> bool {
        self.role.has_turn() && self.rounds >= ROUNDS_A_TURN
    }

    pub(super) fn is_overrun(&self, took: Duration) -> bool {
        took > self.period && self.role.keeps_period()
    }

    /// Takes ticks, or acknowledgements of them. `due`: the period of the system's clock is over.
    /// Says whether `compute()` is due.
    pub(super) fn follow_time(&mut self, now: Instant, sweep: bool, due: bool) -> bool {
        let mut is_due = false;
        let may_begin = !matches!(self.role, TimeRole::Source(_)) || self.may_begin(now);
        let begins = match &mut self.role {
            TimeRole::System => return due,
            TimeRole::Follower(follower) => {
                let moved = follower.receive(now, sweep);
                self.shared
                    .time
                    .tick
                    .store(follower.tick(), Ordering::Relaxed);
                if let Some((from, to)) = moved.jump {
                    tracing::warn!("time jumped back from {from} to {to}");
                    self.shared.status().delta.jumped(from, to);
                    for port in &mut self.ports {
                        port.last_sample = port.last_sample.map(|_| to);
                    }
                }
                if moved.ticked && !moved.turn && !follower.is_lockstep() {
                    is_due = self.is_due();
                }
                moved.turn
            }
            TimeRole::Source(source) => {
                source.is_due |= due;
                source.receive(now, sweep);
                let takes = may_begin && source.takes_turn(now);
                is_due = takes && !source.has_turn();
                takes && !is_due
            }
        };
        if begins {
            self.rounds = 0;
            self.arriving_since = None;
            self.calls.ended_in_turn = 0;
            self.ports.iter_mut().for_each(|port| port.wake(false));
        }
        if sweep {
            self.note_time(now);
        }
        is_due
    }

    /// Whether the period of simulated time is over.
    fn is_due(&mut self) -> bool {
        let TimeRole::Follower(follower) = &mut self.role else {
            return false;
        };
        let missed = follower.schedule.take(follower.now(), self.period);
        if let Some(missed) = missed.filter(|missed| *missed > 0) {
            self.shared.status().overruns += missed;
        }
        missed.is_some()
    }

    /// Whether all samples of this turn are handled, so that `compute()` follows if it is due.
    pub(super) fn ends_turn(&mut self) -> bool {
        if !self.role.has_turn() {
            return false;
        }
        if self.rounds >= ROUNDS_A_TURN {
            return false;
        }
        self.rounds += 1;
        if self.rounds < ROUNDS_A_TURN && self.ports.iter().any(|port: &Port| port.ready) {
            return false;
        }
        self.rounds = ROUNDS_A_TURN;
        match &self.role {
            TimeRole::System => false,
            TimeRole::Follower(follower) => follower.tick() > 0 && self.is_due(),
            TimeRole::Source(_) => true,
        }
    }

    /// Acknowledges a tick whose work is done, or sends the one that the worker has begun.
    pub(super) fn tell_time(&mut self, now: Instant) {
        let is_held = self.role.has_turn() && (self.holds_turn() || !self.have_arrived(now));
        let ends = self.has_computed() && !is_held && self.may_begin(now);
        match &mut self.role {
            TimeRole::System => {}
            TimeRole::Follower(follower) => {
                if ends {
                    follower.finish();
                    follower.report(now);
                }
            }
            TimeRole::Source(source) => {
                if ends {
                    source.end_turn();
                }
                source.send(now, false);
                self.shared
                    .time
                    .tick
                    .store(source.tick(), Ordering::Relaxed);
            }
        }
    }

    /// Whether the messages of this turn have arrived. Otherwise their speed, and that of the
    /// acknowledgement, would decide in which tick their receivers handle them.
    fn have_arrived(&mut self, now: Instant) -> bool {
        if !self.has_computed() || self.connections.have_arrived(ARRIVAL_WAIT) {
            self.arriving_since = None;
            return true;
        }
        let since = *self.arriving_since.get_or_insert(now);
        let is_late = now.saturating_duration_since(since) >= PEERS_LIMIT;
        if is_late {
            self.arriving_since = None;
            tracing::warn!(
                "messages of this tick have not arrived after {PEERS_LIMIT:?}; this run may not repeat exactly"
            );
        }
        is_late
    }

    /// Whether a follower may acknowledge its tick, or a source in lockstep begin the next one. Each
    /// holds tick 0 until it has found the servers and publishers that it needs. Otherwise the speed
    /// of discovery would decide which of the first calls and samples arrive, and a run would not
    /// repeat.
    fn may_begin(&mut self, now: Instant) -> bool {
        let is_at_0 = match &self.role {
            TimeRole::System => false,
            TimeRole::Follower(follower) => follower.tick() == 0,
            TimeRole::Source(source) => source.waits() && source.tick() == 0,
        };
        if !is_at_0 {
            self.waits_since = None;
            return true;
        }
        let since = *self.waits_since.get_or_insert(now);
        let missing = self.missing_peers(now);
        let may_wait = now.saturating_duration_since(since) < PEERS_LIMIT;
        if !missing.is_empty() && !may_wait {
            let missing = missing.join(", ");
            tracing::warn!("no peer of {missing} was found; this run may not repeat exactly");
        }
        missing.is_empty() || !may_wait
    }

    /// The names of the slots that need a server or a publisher and have found none.
    fn missing_peers(&mut self, now: Instant) -> Vec<String> {
        let counts = self.count_peers(now);
        let slots = self.connections.slots().all().into_iter();
        slots
            .zip(counts)
            .filter(|(slot, count)| {
                *count == 0
                    && !slot.is_whole_array()
                    && matches!(slot.slot.role, Role::Requires | Role::SubscribesTo)
                    && !self.connections.has_default(slot.described)
            })
            .map(|(slot, _)| slot.name.to_string())
            .collect()
    }

    /// Updates the rarely changing parts of the status.
    fn note_time(&mut self, now: Instant) {
        match &mut self.role {
            TimeRole::System => {}
            TimeRole::Follower(follower) => {
                let silence = follower.silence(now).unwrap_or_default();
                let was_lost = self.shared.time.lost_ms.swap(
                    u64::try_from(silence.as_millis()).unwrap_or(u64::MAX),
                    Ordering::Relaxed,
                ) > 0;
                match (was_lost, !silence.is_zero()) {
                    (false, true) => tracing::warn!(
                        "the source of time has been silent for {silence:.1?}; time stands"
                    ),
                    (true, false) => tracing::info!("the source of time is back"),
                    _ => {}
                }
            }
            TimeRole::Source(source) => {
                let (followers, waiting_for) = source.followers();
                let mut status = self.shared.status();
                status.followers = followers;
                status.waiting_for = waiting_for;
            }
        }
    }
}
