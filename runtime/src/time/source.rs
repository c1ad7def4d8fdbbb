//! The component that publishes the time of its network.

use super::ends::{self, Receiving, drain};
use super::lockstep::{FollowerMessage, Order, State, TimeError};
use super::protocol::{Done, TICK, Tick};
use crate::clock::{Clock, Time};
use crate::exact::entry::Kind;
use crate::exact::mode::Exact;
use rc_middleware::linked::NodeClock;
use rc_middleware::typed::TypedPublisher;
use rc_middleware::{Address, Backend, OpenError, SendError, Server};
use std::cell::RefCell;
use std::os::fd::BorrowedFd;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How often a source repeats its present tick.
const REPEAT: Duration = Duration::from_millis(500);
/// Advances the time of the network: `ctx.time` of a component whose `.cdsl` has `simulates time;`.
///
/// Time advances when the present call of the worker returns: then the runtime sends the tick.
///
/// ```no_run
/// # use std::time::Duration;
/// # use rc_runtime::{TimeError, TimeSource};
/// # fn initialize(time: &mut TimeSource) {
/// // Each tick waits until all followers have done the one before, at most for a second.
/// time.wait_for_all(Duration::from_secs(1));
/// // compute() comes as soon as they have, not with its period.
/// time.set_paced(false);
/// # }
/// # fn compute(time: &mut TimeSource) -> Result<(), TimeError> {
/// if time.missing().is_empty() {
///     time.advance(Duration::from_millis(10))?;
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct TimeSource(Option<Rc<RefCell<State>>>, Exact);

impl TimeSource {
    pub(crate) fn new(state: Option<Rc<RefCell<State>>>, exact: Exact) -> Self {
        Self(state, exact)
    }

    /// Whether the network takes its time from this component. Otherwise nothing here has an
    /// effect.
    pub fn is_active(&self) -> bool {
        self.0.is_some()
    }

    /// Moves time forward. Gives the number of the tick, from 1. It fails while the source waits
    /// for the tick before and [`TimeSource::missing`] is empty.
    pub fn advance(&mut self, step: Duration) -> Result<u64, TimeError> {
        let state = self.0.as_ref().ok_or(TimeError::Inactive)?;
        let clock = Arc::clone(&state.borrow().clock);
        let time = self.1.now(|| clock.now()) + step;
        self.set(time)
    }

    /// Sets time, possibly to an earlier one: followers begin their periods again and report the
    /// jump. Otherwise as [`TimeSource::advance`].
    pub fn set(&mut self, time: Time) -> Result<u64, TimeError> {
        let state = self.0.as_ref().ok_or(TimeError::Inactive)?;
        self.1.advance(time);
        let begun = || match state.borrow_mut().begin(time) {
            Ok(tick) => tick.to_string(),
            Err(TimeError::Waiting { tick, waiting_for }) => {
                format!("{tick} {}", waiting_for.join(","))
            }
            Err(TimeError::Inactive) => String::new(),
        };
        let begun = self.1.text(Kind::Time, begun);
        let (tick, waiting_for) = match begun.split_once(' ') {
            Some((tick, names)) => (tick, Some(names)),
            None => (begun.as_str(), None),
        };
        let tick = tick.parse().map_err(|_| TimeError::Inactive)?;
        match waiting_for {
            None => Ok(tick),
            Some(names) => Err(TimeError::Waiting {
                tick,
                waiting_for: split(names),
            }),
        }
    }

    /// From the next tick on, `compute()` runs when every follower has done the work of the tick,
    /// or when none has for `limit`, to within 50 ms; then [`TimeSource::missing`] names the
    /// missing ones. A `compute()` that does not advance goes on waiting.
    pub fn wait_for_all(&mut self, limit: Duration) {
        self.with(|state| state.limit = Some(limit));
    }

    /// From the next tick on, `compute()` runs with its period and waits for no follower.
    pub fn wait_for_nobody(&mut self) {
        self.with(|state| state.limit = None);
    }

    /// Sets the order in which followers do a tick that this component waits for.
    pub fn set_order(&mut self, order: Order) {
        self.with(|state| state.order = order);
    }

    /// Whether `compute()` runs with its period, in real time (the default), or as soon as all have
    /// done the tick. Without [`TimeSource::wait_for_all`] it always runs with its period.
    pub fn set_paced(&mut self, paced: bool) {
        self.with(|state| state.paced = paced);
    }

    /// The number of the last tick.
    pub fn tick(&self) -> u64 {
        let tick = || self.0.as_ref().map_or(0, |state| state.borrow().number);
        self.1.number(Kind::Time, tick)
    }

    /// Followers that have not done the last tick within its limit. If followers run in turn, the
    /// one whose turn it is.
    pub fn missing(&self) -> Vec<String> {
        self.ask(|state| state.missing.join(","))
    }

    /// The components that follow.
    pub fn followers(&self) -> Vec<String> {
        self.ask(|state| state.names(|entry| entry.is_here).join(","))
    }

    /// The names that `answer` lists with commas.
    fn ask(&self, answer: impl FnOnce(&State) -> String) -> Vec<String> {
        let Some(state) = &self.0 else {
            return Vec::new();
        };
        split(&self.1.text(Kind::Time, || answer(&state.borrow())))
    }

    /// Waits no more for a follower, until it acknowledges again. Says whether there was one of
    /// this name.
    pub fn release(&mut self, name: &str) -> bool {
        let Some(state) = &self.0 else { return false };
        let release = || u64::from(state.borrow_mut().release(name));
        self.1.number(Kind::Time, release) != 0
    }

    fn with(&self, change: impl FnOnce(&mut State)) {
        if let Some(state) = &self.0 {
            change(&mut state.borrow_mut());
        }
    }
}

fn split(names: &str) -> Vec<String> {
    let names = names.split(',').filter(|name| !name.is_empty());
    names.map(str::to_owned).collect()
}

/// The ends of a source over one middleware.
struct Link {
    ticks: TypedPublisher,
    server: Box<dyn Server>,
    woken: bool,
    /// The clock of the middleware's nodes, and its topic.
    node_clock: Option<(NodeClock, TypedPublisher)>,
}

pub(crate) struct Source {
    state: Rc<RefCell<State>>,
    links: Vec<Link>,
    /// When the present tick began, or the wait for it was renewed.
    began: Instant,
    /// Last sent tick, and its time.
    sent: Option<Tick>,
    sent_at: Instant,
    /// The period is over.
    pub(crate) is_due: bool,
    has_turn: bool,
}

impl Source {
    /// Publishes time over all `backends`, and as `of_nodes`, by the name of its middleware.
    pub(crate) fn open(
        backends: &[(&'static str, Box<dyn Backend>)],
        of_nodes: Option<(&'static str, NodeClock)>,
        address: &Address,
        state: Rc<RefCell<State>>,
    ) -> Result<Self, OpenError> {
        let mut links = Vec::new();
        for (name, backend) in backends {
            let backend = backend.as_ref();
            let server = ends::server(backend, address)?;
            let ticks = TypedPublisher::new(ends::publisher(backend, address)?, TICK);
            let node_clock = match of_nodes {
                Some((middleware, clock)) if middleware == *name => {
                    let publisher = ends::node_clock_publisher(backend, address, &clock)?;
                    Some((clock, TypedPublisher::new(publisher, TICK)))
                }
                _ => None,
            };
            links.push(Link {
                ticks,
                server,
                woken: true,
                node_clock,
            });
        }
        let now = Instant::now();
        Ok(Self {
            state,
            links,
            began: now,
            sent: None,
            sent_at: now,
            is_due: false,
            has_turn: false,
        })
    }

    /// Readable when a follower may have sent a message, by number.
    pub(crate) fn descriptors(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        self.links.iter().map(|link| link.server.descriptor())
    }

    /// The descriptor of this number was readable.
    pub(crate) fn wake(&mut self, at: usize) {
        if let Some(link) = self.links.get_mut(at) {
            link.woken = true;
        }
    }

    /// The number of the present tick.
    pub(crate) fn tick(&self) -> u64 {
        self.state.borrow().number
    }

    /// The present time.
    pub(crate) fn now(&self) -> Time {
        self.state.borrow().clock.now()
    }

    /// The components that follow, and those that are missing.
    pub(crate) fn followers(&self) -> (Vec<String>, Vec<String>) {
        let state = self.state.borrow();
        (state.names(|entry| entry.is_here), state.missing.clone())
    }

    /// Whether it waits for its followers.
    pub(crate) fn waits(&self) -> bool {
        self.state.borrow().limit.is_some()
    }

    /// Whether `compute()` runs with its period.
    pub(crate) fn is_paced(&self) -> bool {
        let state = self.state.borrow();
        state.paced || state.limit.is_none()
    }

    /// Whether it is this component's turn, after all followers.
    pub(crate) fn has_turn(&self) -> bool {
        self.has_turn
    }

    /// `compute()` has run.
    pub(crate) fn end_turn(&mut self) {
        self.has_turn = false;
    }

    /// Handles messages of followers, and sends the tick that they cause.
    pub(crate) fn receive(&mut self, now: Instant, sweep: bool) {
        let (mut joined, mut done, state) = (false, false, &self.state);
        for link in &mut self.links {
            let woken = std::mem::take(&mut link.woken);
            if woken || sweep {
                let server: &mut dyn Receiving = &mut link.server;
                drain(server, woken, &mut |reader| {
                    if let Ok(message) = Done::read(reader) {
                        match state.borrow_mut().receive(message) {
                            FollowerMessage::Nothing => {}
                            FollowerMessage::Done => done = true,
                            FollowerMessage::Joins => joined = true,
                        }
                    }
                });
            }
        }
        if done {
            self.began = now;
        }
        self.send(now, joined);
        let mut state = self.state.borrow_mut();
        if state.is_complete() {
            state.missing.clear();
        } else if let Some(limit) = state.limit
            && !self.has_turn
            && state.missing.is_empty()
            && now.saturating_duration_since(self.began) >= limit
        {
            state.missing = state.waiting_for();
            tracing::warn!(
                "tick {} waits for {} for {limit:?}",
                state.number,
                state.missing.join(", ")
            );
        }
    }

    /// Whether `compute()` is to run: its turn begins.
    pub(crate) fn takes_turn(&mut self, now: Instant) -> bool {
        if self.has_turn {
            return false;
        }
        let state = self.state.borrow();
        if state.limit.is_none() {
            drop(state);
            return std::mem::take(&mut self.is_due);
        }
        let complete = state.is_complete();
        let hurries = !state.paced && state.advanced && complete;
        // While a follower is missing, it comes once a limit.
        let waited = now.saturating_duration_since(self.began) >= state.limit.unwrap_or_default();
        let may = complete || (waited && !state.missing.is_empty());
        drop(state);
        if !may || !(self.is_due || hurries) {
            return false;
        }
        self.is_due = false;
        self.has_turn = true;
        self.began = now;
        self.state.borrow_mut().advanced = false;
        true
    }

    /// Whether the loop must not sleep: `compute()` follows at once.
    pub(crate) fn is_in_a_hurry(&self) -> bool {
        let state = self.state.borrow();
        let hurries = state.limit.is_some() && !state.paced && state.advanced;
        hurries && !self.has_turn && state.is_complete()
    }

    /// Sends the tick that the worker has begun, another turn of it, or repeats it. A tick that
    /// begins in this component's turn follows at the end of the turn.
    pub(crate) fn send(&mut self, now: Instant, repeat: bool) {
        let held = self.sent.filter(|_| self.has_turn);
        let mut state = self.state.borrow_mut();
        let fresh = held.is_none() && std::mem::take(&mut state.unsent);
        if fresh {
            self.began = now;
        }
        let tick = held.unwrap_or_else(|| Tick {
            epoch: state.epoch,
            number: state.number,
            time: state.clock.now().as_nanos(),
            turn: state.turn(),
            lockstep: state.limit.is_some(),
        });
        drop(state);
        let old = now.saturating_duration_since(self.sent_at) >= REPEAT;
        if !fresh && !repeat && !old && self.sent == Some(tick) {
            return;
        }
        self.sent = Some(tick);
        self.sent_at = now;
        for link in &mut self.links {
            let mut sent = link.ticks.publish_with(|writer| tick.write(writer));
            if fresh && let Some(clock) = &mut link.node_clock {
                let (clock, topic) = clock;
                let of_nodes = topic.publish_with(|writer| (clock.write)(tick.time, writer));
                sent = sent.and(of_nodes);
            }
            report(sent);
        }
    }
}

fn report(sent: Result<(), SendError>) {
    if let Err(error) = sent {
        tracing::warn!("a tick was not sent: {error}");
    }
}
