//! Joins a replica of the shared world with the slots of a component.
//!
//! A component with a world publishes and subscribes to `World` and `WorldStream`: all replicas of
//! a network meet at these topics. [`Member`] publishes the messages of the replica and passes it
//! the received ones. Generated code opens it in the context, calls [`Member::turn`] in each turn
//! of the event loop, and [`Member::leave`] at the end.
//!
#![doc = include_str!("example.md")]

mod slot;

pub use slot::slot;

use graph_schema::Schema;
use property_graph::{Edit, Time};
use rc_runtime::middleware::typed::{HandlerError, TypedPublisher};
use rc_runtime::middleware::{OpenError, Reader, SendError};
use rc_runtime::{Core, EarlySamples, Places, Ports, RecordedClock, WorldReport, WorldStatus};
use rc_world::{
    Error, Message, News, Rights, STATE, STREAM, Seen, Setup, Status, Steady, Token, Topic, Watch,
    World,
};
use std::ops::{Deref, DerefMut};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How many messages of a replica are published at once at most. The others follow in the next
/// turn.
const MOST_A_TURN: usize = 64;

/// The longest time for which a worker waits for a change.
const LONGEST_WAIT: Duration = Duration::from_hours(1);

/// The shortest pause between two log lines about refused messages.
const REPORTS: Duration = Duration::from_secs(10);

/// A replica of the shared world in a component, and what drives it. It dereferences to the replica.
/// A component whose context has the publishers passes them as a function that sends.
pub struct Driver {
    world: Arc<World>,
    news: rc_world::Reader,
    /// The time of this turn, in nanoseconds: the replica asks for it.
    time: Arc<AtomicU64>,
    /// The time of the replica's protocol.
    steady: Steady,
    due: Duration,
    /// The messages since the last turn: at most as many as the event loop passes on in one.
    waiting: Vec<Message>,
    shown: u64,
    /// How many refused messages are logged already.
    refused: u64,
    /// When it may say so again.
    says_next: Duration,
    watch: Watch,
    told: WorldReport,
}

/// Sends a message on its topic.
type Send<'s> = &'s mut dyn FnMut(&Message) -> Result<(), SendError>;

impl Deref for Driver {
    type Target = World;

    fn deref(&self) -> &World {
        &self.world
    }
}

impl Driver {
    /// A replica that is empty so far.
    pub fn new(core: &Core, schema: Arc<Schema>, rights: Rights) -> Self {
        let now = core.now().as_nanos();
        let time = Arc::new(AtomicU64::new(now));
        let clock = Arc::clone(&time);
        let setup = Setup::new(core.name(), schema)
            .with_rights(rights)
            // 0 is nobody, and the start of a world has 1.
            .with_writer(core.unique().max(2))
            .with_clock(move || Time::from_nanos(clock.load(Ordering::Relaxed)));
        let world = Arc::new(World::new(setup));
        Self {
            news: world.reader(),
            world,
            time,
            steady: Steady::new(Duration::from_nanos(now)),
            due: Duration::ZERO,
            waiting: Vec::new(),
            shown: 0,
            refused: 0,
            says_next: Duration::ZERO,
            watch: Watch::default(),
            told: core.world_report(),
        }
    }

    /// The replica, for other threads: they read it, and what they change is sent in the next turn.
    pub fn shared(&self) -> Arc<World> {
        Arc::clone(&self.world)
    }

    /// Takes a sample of a topic of `World`.
    ///
    /// # Errors
    /// The bytes are no such message.
    pub fn receive_state(
        &mut self,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.receive(STATE.get(topic), reader)
    }

    /// Takes a sample of a topic of `WorldStream`.
    ///
    /// # Errors
    /// The bytes are no such message.
    pub fn receive_stream(
        &mut self,
        topic: usize,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        self.receive(STREAM.get(topic), reader)
    }

    fn receive(
        &mut self,
        topic: Option<&Topic>,
        reader: &mut Reader<'_>,
    ) -> Result<(), HandlerError> {
        let topic = topic.ok_or_else(|| HandlerError("a world has no such topic".to_owned()))?;
        let message = Message::decode(*topic, reader)?;
        // A turn without work is not recorded: at a replay, only the time of the next one is known.
        self.waiting.push(message);
        self.due = Duration::ZERO;
        Ok(())
    }

    /// Does the work that is due at a time of the network, and sends the messages of the replica.
    /// Returns whether there was any.
    pub fn turn(&mut self, now: rc_runtime::Time, send: Send<'_>) -> bool {
        let now = now.as_nanos();
        self.time.store(now, Ordering::Relaxed);
        self.steady.follow(Duration::from_nanos(now));
        // What was changed goes first, also by those who have the replica without this driver. Values of streams
        // are due then.
        let has_changed = self.world.snapshot().version() != self.shown;
        let sent = has_changed && self.send(send);
        for message in self.waiting.drain(..) {
            self.world.receive(self.steady.time(), message);
        }
        let is_due = has_changed || self.steady.time() >= self.due;
        if is_due {
            self.due = self.world.turn(self.steady.time());
        }
        if let Some(seen) = self.watch.look(&self.world, self.steady.time()) {
            self.told.set(status_of(seen));
        }
        self.report();
        let told = self.send(send) || sent;
        let version = self.world.snapshot().version();
        let is_new = std::mem::replace(&mut self.shown, version) != version;
        told || is_new || is_due
    }

    /// Waits until this replica has a change. Returns whether it has it. See
    /// [`Driver::wait_until`].
    pub fn wait_for(
        &mut self,
        token: Token,
        limit: Duration,
        early: &EarlySamples,
        send: Send<'_>,
    ) -> bool {
        self.wait_until(|world| world.has(token), limit, early, send)
    }

    /// Waits until something holds, at most for `limit` of the system's time, and for an hour. Returns
    /// whether it holds. Meanwhile the replica receives, and no handler runs. In simulated time it
    /// does not wait, because nothing arrives within a turn.
    pub fn wait_until(
        &mut self,
        holds: impl Fn(&World) -> bool,
        limit: Duration,
        early: &EarlySamples,
        send: Send<'_>,
    ) -> bool {
        let until = Instant::now() + limit.min(LONGEST_WAIT);
        // The next turn of the loop shows the changes.
        let shown = self.shown;
        while !holds(&self.world) {
            let Some(came) = early.next(until) else {
                break;
            };
            if let Some((interface, topic, bytes)) = came.sample {
                let topics: &[Topic] = if interface == 0 { &STATE } else { &STREAM };
                // The event loop reports invalid messages later.
                let _ = self.receive(topics.get(topic), &mut Reader::new(&bytes));
            }
            self.turn(came.now, send);
        }
        self.shown = shown;
        holds(&self.world)
    }

    /// Says in the log that messages were refused: those of a replica with another schema, for example.
    fn report(&mut self) {
        let refused = self.world.refused();
        if refused == self.refused || self.steady.time() < self.says_next {
            return;
        }
        let count = refused - self.refused;
        let reason = self.world.last_refusal();
        rc_runtime::tracing::warn!(
            "the world refused {count} messages, the last one because {reason}"
        );
        self.refused = refused;
        self.says_next = self.steady.time().saturating_add(REPORTS);
    }

    /// The changes since the last call. `None` if there are none.
    pub fn news(&mut self) -> Option<News> {
        self.world.news(&mut self.news)
    }

    /// Announces the end, so that no other replica waits for this one.
    pub fn leave(&mut self, send: Send<'_>) {
        self.world.leave();
        self.send(send);
    }

    /// For tests: another replica, which is empty and may write everything. [`World::meet`]
    /// synchronizes both.
    pub fn others(&self) -> World {
        let schema = Arc::clone(self.world.snapshot().schema());
        let time = Arc::clone(&self.time);
        let setup = Setup::new("others", schema);
        World::new(setup.with_clock(move || Time::from_nanos(time.load(Ordering::Relaxed))))
    }

    /// State of the replica.
    pub fn state(&self) -> Status {
        self.world.status(self.steady.time())
    }

    /// Sends the messages of the replica. A message that cannot be sent is repaired later.
    fn send(&mut self, send: Send<'_>) -> bool {
        let mut failed = None;
        let messages = std::iter::from_fn(|| self.world.take()).take(MOST_A_TURN);
        let sent = messages
            .map(|message| send(&message).unwrap_or_else(|error| failed = Some(error)))
            .count();
        if let Some(error) = failed {
            rc_runtime::tracing::warn!("the world cannot tell what has changed: {error}");
        }
        if sent == MOST_A_TURN {
            self.due = Duration::ZERO;
        }
        sent > 0
    }
}

/// The report of a component about its replica to its supervisor.
fn status_of(seen: Seen) -> WorldStatus {
    WorldStatus {
        behind: seen.health.behind,
        behind_ms: seen.behind_for.as_millis() as u64,
        conflicts: seen.health.conflicts as u64,
        first_conflicts: seen.health.first_conflicts,
        fault: seen.health.fault,
        refused: seen.health.refused,
        last_refusal: seen.health.last_refusal,
        silent: seen.silent,
        more_silent: seen.more_silent as u64,
    }
}

/// Where frames are, for connections that convert.
struct Known(Arc<World>);

impl Places for Known {
    fn transform(&self, to: &str, from: &str, nanoseconds: u64) -> Result<[f64; 12], String> {
        rc_world::transform(&self.0, to, from, Time::from_nanos(nanoseconds))
    }
}

/// A [`Driver`] with its publishers.
pub struct Member {
    driver: Driver,
    early: EarlySamples,
    clock: RecordedClock,
    state: Vec<TypedPublisher>,
    stream: Vec<TypedPublisher>,
}

impl Deref for Member {
    type Target = Driver;

    fn deref(&self) -> &Driver {
        &self.driver
    }
}

impl DerefMut for Member {
    fn deref_mut(&mut self) -> &mut Driver {
        &mut self.driver
    }
}

impl Member {
    /// A replica that is empty so far. `slots` are the numbers of the slots that publish `World` and
    /// `WorldStream`.
    ///
    /// # Errors
    /// A slot cannot be opened.
    pub fn open(
        core: &Core,
        ports: &Ports,
        slots: [usize; 2],
        schema: Arc<Schema>,
        rights: Rights,
    ) -> Result<Self, OpenError> {
        let open = |slot: usize, topics: &[Topic]| {
            let numbers = 0..topics.len();
            numbers
                .map(ports.publishers(slot))
                .collect::<Result<Vec<_>, _>>()
        };
        let driver = Driver::new(core, schema, rights);
        ports.know_frames(Rc::new(Known(driver.shared())));
        Ok(Self {
            driver,
            early: ports.early_samples().clone(),
            clock: core.recorded_clock(),
            state: open(slots[0], &STATE)?,
            stream: open(slots[1], &STREAM)?,
        })
    }

    /// Makes several changes, which all readers get in one version, and sends them.
    ///
    /// # Errors
    /// Those of [`World::change`].
    pub fn change(
        &mut self,
        make: impl FnOnce(&mut Edit) -> Result<(), Error>,
    ) -> Result<Token, Error> {
        self.change_with(make).map(|((), token)| token)
    }

    /// As above, with a result.
    ///
    /// # Errors
    /// Those of [`World::change`].
    pub fn change_with<T>(
        &mut self,
        make: impl FnOnce(&mut Edit) -> Result<T, Error>,
    ) -> Result<(T, Token), Error> {
        // That of the last turn may not be recorded.
        let now = self.clock.now().as_nanos();
        self.driver.time.store(now, Ordering::Relaxed);
        let changed = self.driver.world.change_with(make)?;
        self.driver.due = Duration::ZERO;
        let (state, stream) = (&mut self.state, &mut self.stream);
        self.driver
            .send(&mut |message| publish(state, stream, message));
        Ok(changed)
    }

    /// Waits until this replica has a change, as [`Driver::wait_for`] does.
    pub fn wait_for(&mut self, token: Token, limit: Duration) -> bool {
        let (state, stream) = (&mut self.state, &mut self.stream);
        let send = &mut |message: &Message| publish(state, stream, message);
        self.driver.wait_for(token, limit, &self.early, send)
    }

    /// Waits until this replica has what the others have, or anything of it, as [`Driver::wait_until`]
    /// does. One that is alone knows so after 2.5 s.
    pub fn wait_for_others(&mut self, limit: Duration) -> bool {
        let (state, stream) = (&mut self.state, &mut self.stream);
        let send = &mut |message: &Message| publish(state, stream, message);
        let holds = |world: &World| world.has_joined() || world.snapshot().nodes().next().is_some();
        self.driver.wait_until(holds, limit, &self.early, send)
    }

    /// Does the work that is due at the time of the network. Returns whether there was any.
    pub fn turn(&mut self, core: &Core) -> bool {
        let (state, stream) = (&mut self.state, &mut self.stream);
        self.driver
            .turn(core.now(), &mut |message| publish(state, stream, message))
    }

    /// Announces the end, so that no other replica waits for this one.
    pub fn leave(&mut self) {
        let (state, stream) = (&mut self.state, &mut self.stream);
        self.driver
            .leave(&mut |message| publish(state, stream, message));
    }

    /// The number of other replicas of the topic that has most.
    pub fn subscribers(&self) -> usize {
        let all = self.state.iter().chain(&self.stream);
        all.map(TypedPublisher::peers).max().unwrap_or(0)
    }
}

fn publish(
    state: &mut [TypedPublisher],
    stream: &mut [TypedPublisher],
    message: &Message,
) -> Result<(), SendError> {
    let publisher = match place(message) {
        (Interface::World, at) => state.get_mut(at),
        (Interface::WorldStream, at) => stream.get_mut(at),
    };
    match publisher {
        Some(publisher) => publisher.publish_with(|writer| message.encode(writer)),
        None => Ok(()),
    }
}

/// An interface of `World.idsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interface {
    /// Losses are repaired.
    World,
    /// The newest value counts.
    WorldStream,
}

/// The topic of a message: its interface, and its number there.
pub fn place(message: &Message) -> (Interface, usize) {
    let topic = message.topic();
    let at = |topics: &[Topic]| topics.iter().position(|own| *own == topic);
    match at(&STREAM) {
        Some(at) => (Interface::WorldStream, at),
        None => (Interface::World, at(&STATE).unwrap_or_default()),
    }
}
