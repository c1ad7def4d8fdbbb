//! A component that follows the time of its network.

use super::ends::{self, drain};
use super::protocol::{DONE, Done, Tick, turn_of};
use super::schedule::Schedule;
use crate::clock::{Clock, SimulatedClock, Time};
use rc_middleware::linked::NodeClock;
use rc_middleware::typed::TypedClient;
use rc_middleware::{Address, Backend, OpenError, Subscriber};
use std::os::fd::BorrowedFd;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a source may be silent. It announces its tick twice a second, also while time stands.
pub(crate) const SILENCE_LIMIT: Duration = Duration::from_secs(3);
/// How often a follower without a source searches one, and repeats what was not accepted.
const RETRY: Duration = Duration::from_millis(100);

/// The transport of time.
enum Feed {
    /// From a source of ours, which gets acknowledgements.
    Source(TypedClient),
    /// From the clock of a middleware's nodes.
    Nodes(NodeClock),
}

pub(crate) struct Follower {
    name: String,
    turn_number: u64,
    clock: Arc<SimulatedClock>,
    feed: Feed,
    port: Box<dyn Subscriber>,
    /// Whether the port's descriptor was readable.
    pub(crate) woken: bool,
    epoch: u64,
    number: u64,
    lockstep: bool,
    /// The tick that is under way.
    turn: Option<u64>,
    /// Last finished tick, and whether the source has the acknowledgement.
    done: Option<(u64, u64)>,
    unsent: bool,
    tried: Option<Instant>,
    heard: Option<Instant>,
    pub(crate) schedule: Schedule,
}

/// Changes by received ticks.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct ClockChange {
    /// Time has jumped back, from the first time to the second.
    pub(crate) jump: Option<(Time, Time)>,
    /// A new tick: time may have changed.
    pub(crate) ticked: bool,
    /// It is this component's turn.
    pub(crate) turn: bool,
}

impl Follower {
    /// Follows the source of the network over `backend`.
    pub(crate) fn open(
        backend: &dyn Backend,
        address: &Address,
        name: &str,
        clock: Arc<SimulatedClock>,
    ) -> Result<Self, OpenError> {
        let port = ends::subscriber(backend, address)?;
        let client = TypedClient::new(ends::client(backend, address)?, RETRY);
        Ok(Self::new(name, clock, port, Feed::Source(client)))
    }

    /// Follows the clock of a middleware's nodes.
    pub(crate) fn open_nodes(
        backend: &dyn Backend,
        address: &Address,
        name: &str,
        clock: Arc<SimulatedClock>,
        of_nodes: NodeClock,
    ) -> Result<Self, OpenError> {
        let port = ends::node_clock_subscriber(backend, address, &of_nodes)?;
        Ok(Self::new(name, clock, port, Feed::Nodes(of_nodes)))
    }

    fn new(name: &str, clock: Arc<SimulatedClock>, port: Box<dyn Subscriber>, feed: Feed) -> Self {
        Self {
            name: name.to_owned(),
            turn_number: turn_of(name),
            clock,
            feed,
            port,
            woken: true,
            epoch: 0,
            number: 0,
            lockstep: false,
            turn: None,
            done: None,
            unsent: false,
            tried: None,
            heard: None,
            schedule: Schedule::default(),
        }
    }

    /// Readable when a tick may have arrived.
    pub(crate) fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.descriptor()
    }

    /// The number of the present tick.
    pub(crate) fn tick(&self) -> u64 {
        self.number
    }

    /// The present time.
    pub(crate) fn now(&self) -> Time {
        self.clock.now()
    }

    /// Whether the source waits for its followers.
    pub(crate) fn is_lockstep(&self) -> bool {
        self.lockstep
    }

    /// Whether the tick under way waits for this component.
    pub(crate) fn has_turn(&self) -> bool {
        self.turn.is_some()
    }

    /// How long the source has been silent, if that is too long. A clock of ROS nodes may be
    /// silent; then its publisher must be missing, too.
    pub(crate) fn silence(&self, now: Instant) -> Option<Duration> {
        let silence = now.saturating_duration_since(self.heard?);
        let is_lost = silence >= SILENCE_LIMIT
            && (matches!(self.feed, Feed::Source(_)) || self.port.peers() == 0);
        is_lost.then_some(silence)
    }

    /// Takes the received ticks. Of several, the newest counts.
    pub(crate) fn receive(&mut self, now: Instant, sweep: bool) -> ClockChange {
        let mut change = ClockChange::default();
        let woken = std::mem::take(&mut self.woken);
        if woken || sweep {
            let mut newest = None;
            let of_nodes = match &self.feed {
                Feed::Nodes(clock) => Some(*clock),
                Feed::Source(_) => None,
            };
            let number = &mut self.number;
            drain(&mut self.port, woken, &mut |reader| {
                if let Some(clock) = of_nodes {
                    newest = (clock.read)(reader).ok().map(|time| {
                        *number += 1;
                        Tick {
                            epoch: 1,
                            number: *number,
                            time,
                            ..Tick::default()
                        }
                    });
                } else if let Ok(tick) = Tick::read(reader) {
                    newest = Some(tick);
                }
            });
            if let Some(tick) = newest.filter(|tick| tick.epoch != 0) {
                if of_nodes.is_some() {
                    self.number = tick.number - 1;
                }
                self.heard = Some(now);
                self.apply(tick, &mut change);
            }
        }
        self.report(now);
        change
    }

    fn apply(&mut self, tick: Tick, change: &mut ClockChange) {
        let new_source = tick.epoch != self.epoch;
        if new_source {
            if self.epoch != 0 {
                tracing::info!("the source of time has restarted");
            }
            self.epoch = tick.epoch;
            self.turn = None;
            self.done = None;
            self.schedule.restart();
        }
        let (before, time) = (self.clock.now(), Time::from_nanos(tick.time));
        let fresh = new_source || tick.number != self.number;
        if fresh {
            if time < before {
                change.jump = Some((before, time));
                self.schedule.restart();
            }
            self.clock.set(time);
            change.ticked = tick.number > 0;
            self.turn = None;
        }
        self.number = tick.number;
        self.lockstep = tick.lockstep;
        if !tick.lockstep {
            self.turn = None;
            // It joins; the source does not wait for it.
            if self.done.is_none_or(|(epoch, _)| epoch != self.epoch) {
                self.finish();
            }
            return;
        }
        let mine = tick.turn == 0 || tick.turn == self.turn_number;
        if self.done == Some((self.epoch, self.number)) {
            // The source repeats itself, possibly because it missed the message of this component.
            self.unsent |= !fresh && mine;
        } else if mine && self.turn.is_none() {
            self.turn = Some(self.number);
            change.turn = true;
        } else if self.done.is_none() && self.turn.is_none() {
            // It joins, and waits for its turn.
            self.unsent = true;
        }
    }

    /// Acknowledges the present tick: all due work has run.
    pub(crate) fn finish(&mut self) {
        self.turn = None;
        self.done = Some((self.epoch, self.number));
        self.unsent = true;
        self.tried = None;
    }

    /// Sends the acknowledgements that the source does not have yet.
    pub(crate) fn report(&mut self, now: Instant) {
        let pause = |tried: Instant| now.saturating_duration_since(tried) < RETRY;
        if (!self.unsent && self.epoch != 0) || self.tried.is_some_and(pause) {
            return;
        }
        self.tried = Some(now);
        let (epoch, number) = self.done.unwrap_or_default();
        if self.send(epoch, number, false) {
            self.unsent = false;
        }
    }

    /// Leaves: the source no longer waits for this component.
    pub(crate) fn leave(&mut self) {
        if self.epoch != 0 {
            self.send(self.epoch, self.number, true);
        }
    }

    /// Whether the source has accepted it.
    fn send(&mut self, epoch: u64, number: u64, leaving: bool) -> bool {
        let Feed::Source(client) = &mut self.feed else {
            return true;
        };
        let done = Done {
            epoch,
            number,
            follower: self.name.clone(),
            leaving,
        };
        client.send_with(&DONE, |writer| done.write(writer)).is_ok()
    }
}
