//! A replica of a running network's world that only listens: it announces nothing about itself, so
//! that no component counts it or waits for it, and asks for what it lacks.

use super::newcomers::Newcomers;
use crate::cli::look::look;
use crate::cli::messages::{interrupts, is_interrupted};
use crate::cli::output::{Failure, is_output_closed, print_note, system};
use graph_language::Schema;
use rc_diagnostics::foreign::clean;
use rc_management::component::ClockKind;
use rc_middleware::{Encoding, Reader, Writer};
use rc_observe::{FeedId, Network, Observer, Sender, Topic};
use rc_world::{Message, STATE, STREAM, Setup, Token, World};
use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// The longest silence of a replica: each one announces its state once a second.
const HEARING: Duration = Duration::from_millis(2500);
/// How long a world may take to arrive.
const ARRIVING: Duration = Duration::from_secs(20);
/// After so long, the values of streams are here that do not change at the moment.
const STREAMING: Duration = Duration::from_millis(1300);
/// How long a change may take to reach all replicas.
const SPREADING: Duration = Duration::from_secs(5);
/// After so long without all replicas, a change is sent again: it may have been lost.
const AGAIN: Duration = Duration::from_millis(1500);
/// The longest wait.
pub(super) const TURN: Duration = Duration::from_millis(20);

/// A message as it arrived.
pub(super) struct ReceivedMessage {
    pub(super) kind: rc_world::Topic,
    pub(super) value: rc_values::Value,
    pub(super) bytes: usize,
}

/// A replica that listens.
pub(super) struct Listener {
    pub(super) network: Network,
    pub(super) world: World,
    /// Replicas that came later.
    pub(super) newcomers: Newcomers,
    /// The files of the schema; none if no component provides them.
    pub(super) files: Vec<(String, String)>,
    observer: Observer,
    feeds: BTreeMap<FeedId, (Topic, rc_world::Topic)>,
    /// How many components have replicas.
    expected: usize,
    /// The instance whose replica alone is heard, if only one is.
    only: Option<String>,
    /// The writer of that replica.
    writer: Option<u64>,
    senders: BTreeMap<rc_world::Topic, Vec<Sender>>,
    interrupts: UnixStream,
    begin: Instant,
    /// The clock of the network, in nanoseconds, and when it showed that.
    time: Arc<AtomicU64>,
    /// The reading of the clock of the network at the start, if it is that of the system.
    goes_from: Option<u64>,
    heard: BTreeSet<u64>,
    /// Whether the values of streams were those of another replica when that announced its state.
    has_streams: bool,
    /// When all changes were here.
    arrived: Option<Instant>,
}

/// The topic of a world that an operation of an interface is.
pub(super) fn topic_of(interface: &str, operation: &str) -> Option<rc_world::Topic> {
    let names = ["change", "digest", "ask", "chunk"];
    match interface {
        "RcWorld::World" => {
            let at = names.iter().position(|name| *name == operation)?;
            STATE.get(at).copied()
        }
        "RcWorld::WorldStream" => STREAM.first().copied(),
        _ => None,
    }
}

fn kind(topic: &Topic) -> Option<rc_world::Topic> {
    topic_of(&topic.interface.name, &topic.operation.name)
}

/// Whether components of a network share a world.
pub(super) fn has_world(network: &Network) -> bool {
    !replicas(network, &network.topics()).is_empty()
}

/// The components of a network that have replicas, of those that publish these topics.
fn replicas(network: &Network, topics: &[Topic]) -> BTreeSet<String> {
    let digests = topics
        .iter()
        .filter(|topic| kind(topic) == Some(rc_world::Topic::Digest));
    let names: BTreeSet<&str> = digests
        .flat_map(|topic| &topic.publishers)
        .map(|end| end.component.as_str())
        .collect();
    let own = network.components.iter();
    let own = own.filter(|own| own.has_world() && names.contains(own.name.as_str()));
    own.map(|own| own.name.clone()).collect()
}

/// The schema of these files.
fn schema(files: &[(String, String)]) -> Result<Schema, Failure> {
    if files.is_empty() {
        return Ok(Schema::anything());
    }
    graph_language::of_texts(files)
        .map_err(|found| Failure(3, format!("the schema of a component is wrong: {found}")))
}

impl Listener {
    /// Opens the topics of a network's world. `only` is the one instance whose replica is heard.
    pub(super) fn open(network: &str, only: Option<&str>) -> Result<Self, Failure> {
        let network = look(network)?;
        let topics = network.topics();
        let names = replicas(&network, &topics);
        let topics = topics.into_iter();
        let topics = topics.filter_map(|topic| Some((kind(&topic)?, topic)));
        if names.is_empty() {
            let message = format!("no component of `{}` has a world", clean(&network.name));
            return Err(Failure(1, message));
        }
        if let Some(only) = only.filter(|only| !names.contains(*only)) {
            let hint = match rc_diagnostics::nearest(only, names.iter().map(String::as_str)) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("there are {}", Vec::from_iter(names).join(", ")),
            };
            let (only, network) = (clean(only), clean(&network.name));
            let message = format!("`{network}` has no replica `{only}`; {hint}");
            return Err(Failure(1, message));
        }
        let described = network.components.iter();
        let files = described.map(|component| &component.described.world);
        let files = files.clone().find(|files| !files.is_empty()).cloned();
        let files = files.unwrap_or_default();
        let sharing = network
            .components
            .iter()
            .find(|one| names.contains(&one.name));
        let seconds = sharing.map_or(0.0, |component| component.status.clock.time_s);
        let time = Arc::new(AtomicU64::new((seconds.max(0.0) * 1e9) as u64));
        let is_system =
            sharing.is_none_or(|component| component.status.clock.kind == ClockKind::System);
        let clock = Arc::clone(&time);
        let setup = Setup::new("rcdeploy", Arc::new(schema(&files)?))
            .without_tidying()
            .with_clock(move || {
                rc_world::property_graph::Time::from_nanos(clock.load(Ordering::Relaxed))
            });
        let mut observer = Observer::new(&network)?;
        let mut feeds = BTreeMap::new();
        for (kind, topic) in topics {
            if kind != rc_world::Topic::Ask {
                feeds.insert(observer.open(&topic)?, (topic, kind));
            }
        }
        Ok(Self {
            world: World::new(setup),
            newcomers: Newcomers::default(),
            network,
            files,
            observer,
            feeds,
            expected: only.map_or(names.len(), |_| 1),
            only: only.map(str::to_owned),
            writer: None,
            senders: BTreeMap::new(),
            interrupts: interrupts()?,
            begin: Instant::now(),
            goes_from: is_system.then(|| time.load(Ordering::Relaxed)),
            time,
            heard: BTreeSet::new(),
            has_streams: false,
            arrived: None,
        })
    }

    /// Opens the network's world, and waits until all of it is here. `None` at Ctrl-C.
    pub(super) fn joined(network: &str, only: Option<&str>) -> Result<Option<Self>, Failure> {
        let mut own = Self::open(network, only)?;
        loop {
            if !own.turn(&mut |_| {})? {
                return Ok(None);
            }
            if own.has_arrived()? {
                return Ok(Some(own));
            }
        }
    }

    /// Joins as [`joined`](Self::joined), and waits until a change is here. `None` at Ctrl-C.
    pub(super) fn joined_after(
        network: &str,
        token: Option<Token>,
    ) -> Result<Option<Self>, Failure> {
        let Some(mut own) = Self::joined(network, None)? else {
            return Ok(None);
        };
        let Some(token) = token else {
            return Ok(Some(own));
        };
        let until = Instant::now() + SPREADING;
        while !own.world.has(token) {
            if Instant::now() >= until {
                let name = clean(&own.network.name);
                let message =
                    format!("the world of `{name}` has no change {token} yet, after {SPREADING:?}");
                return Err(Failure(3, message));
            }
            if !own.turn(&mut |_| {})? {
                return Ok(None);
            }
        }
        Ok(Some(own))
    }

    /// Whether all of the world is here. Fails after a time.
    fn has_arrived(&mut self) -> Result<bool, Failure> {
        let waited = self.begin.elapsed();
        if waited >= ARRIVING {
            let message = format!(
                "the world of `{}` has not arrived in {ARRIVING:?}; `rcdeploy world {0}` shows its replicas",
                clean(&self.network.name)
            );
            return Err(Failure(3, message));
        }
        let all_told = self.heard.len() >= self.expected || waited >= HEARING;
        if !all_told || !self.is_here()? {
            return Ok(false);
        }
        // Values of streams follow with the next digest of the replica that has answered.
        let arrived = self.arrived.get_or_insert_with(Instant::now);
        Ok(self.has_streams || arrived.elapsed() >= STREAMING)
    }

    /// Takes the received messages without waiting. Returns whether the whole world is here.
    pub(super) fn advance(&mut self) -> Result<bool, Failure> {
        self.step(Duration::ZERO, &mut |_| {})?;
        self.has_arrived()
    }

    /// Whether the replica has everything that others have announced.
    fn is_here(&self) -> Result<bool, Failure> {
        if self.heard.is_empty() {
            let name = clean(&self.network.name);
            let who = self.only.as_ref().map_or_else(
                || format!("no replica of `{name}`"),
                |only| format!("the replica `{}` of `{name}` has not", clean(only)),
            );
            let told = if self.only.is_some() {
                "told"
            } else {
                "announced its state"
            };
            return Err(Failure(3, format!("{who} {told}")));
        }
        let status = self.world.status(self.begin.elapsed());
        if status.peers.iter().all(|peer| peer.has_other_schema) {
            let message = if self.files.is_empty() {
                "no component provides the schema of this world"
            } else {
                "the replicas have another schema than the components tell: build them again"
            };
            return Err(Failure(3, message.to_owned()));
        }
        Ok(!status.is_behind)
    }

    /// Takes the received messages, and asks for missing parts. Returns whether to go on: not after
    /// Ctrl-C, nor if the reader of a pipe has gone.
    pub(super) fn turn(&mut self, hear: &mut dyn FnMut(&ReceivedMessage)) -> Result<bool, Failure> {
        self.step(TURN, hear)
    }

    fn step(
        &mut self,
        longest: Duration,
        hear: &mut dyn FnMut(&ReceivedMessage),
    ) -> Result<bool, Failure> {
        if self.is_interrupted() {
            return Ok(false);
        }
        let now = self.begin.elapsed();
        if let Some(from) = self.goes_from {
            let now = from.saturating_add(now.as_nanos() as u64);
            self.time.fetch_max(now, Ordering::Relaxed);
        }
        let is_system = self.goes_from.is_some();
        let Self {
            observer,
            feeds,
            world,
            newcomers,
            only,
            writer,
            heard,
            has_streams,
            time,
            ..
        } = self;
        let more = observer.take(&mut |feed, observed| {
            let Some((topic, kind)) = feeds.get(&feed) else {
                return;
            };
            let value = match topic.decode(&observed) {
                Ok(value) => value,
                Err(error) => {
                    return print_note(&format!("a message of {}: {error}", topic.address));
                }
            };
            let json = serde_json::to_value(&value).unwrap_or_default();
            let inner = &json[kind_name(*kind)];
            // Only a clock other than that of the system, because nobody may set that one.
            if let Some(made) = inner["time"].as_u64().filter(|_| !is_system) {
                time.fetch_max(made, Ordering::Relaxed);
            }
            let sender = inner["sender"].as_u64();
            if let Some(sender) = sender.filter(|_| *kind == rc_world::Topic::Digest) {
                let is_wanted = only.as_ref().is_none_or(|only| inner["name"] == **only);
                if is_wanted {
                    heard.insert(sender);
                    let own = world.status(now).streams;
                    *has_streams |= inner["streams"].as_u64() == Some(own);
                    *writer = only.as_ref().map(|_| sender);
                }
            }
            let is_wanted = only.is_none() || sender.is_some() && *writer == sender;
            if is_wanted && observed.header.encoding == Encoding::Cdr {
                match Message::decode(*kind, &mut Reader::new(observed.body)) {
                    Ok(message) => {
                        let passed = newcomers.pass(sender, message, observed.body.len());
                        if let Some(message) = passed {
                            world.receive(now, message);
                        }
                    }
                    Err(error) => print_note(&format!("a message of {}: {error}", topic.address)),
                }
            }
            hear(&ReceivedMessage {
                kind: *kind,
                value,
                bytes: observed.body.len(),
            });
        });
        let due = self.world.turn(now);
        while let Some(message) = self.world.take() {
            // Its state is not announced, because components do not count tools.
            if matches!(
                message.topic(),
                rc_world::Topic::Ask | rc_world::Topic::Change
            ) {
                self.send(&message)?;
            }
        }
        if !more && !longest.is_zero() {
            let left = due.saturating_sub(self.begin.elapsed()).min(longest);
            self.observer.wait(&[self.interrupts.as_fd()], left);
        }
        Ok(true)
    }

    /// Takes the messages of newcomers that came before a time: they are of the same run of the network.
    pub(super) fn take_newcomers(&mut self, before: Instant) {
        let now = self.begin.elapsed();
        for message in self.newcomers.accept(before) {
            self.world.receive(now, message);
        }
    }

    fn send(&mut self, message: &Message) -> Result<(), Failure> {
        let kind = message.topic();
        if !self.senders.contains_key(&kind) {
            let topics = self.network.topics().into_iter();
            let topics = topics.filter(|topic| self::kind(topic) == Some(kind));
            let mut senders = Vec::new();
            for topic in topics {
                senders.push(Sender::open(&self.network, &topic)?);
            }
            self.senders.insert(kind, senders);
        }
        let mut writer = Writer::default();
        message.encode(&mut writer);
        writer.finish().map_err(|error| system(&error))?;
        let body = writer.into_bytes();
        for sender in self.senders.get_mut(&kind).into_iter().flatten() {
            sender.send_body(&body)?;
        }
        Ok(())
    }

    /// Whether Ctrl-C has come, or the reader of the output has gone.
    pub(super) fn is_interrupted(&self) -> bool {
        // Without output, no error would say that the reader has gone.
        is_interrupted(&self.interrupts) || is_output_closed()
    }

    /// Waits until all replicas that take part have a change. `None` at Ctrl-C.
    pub(super) fn spread(&mut self, token: Token) -> Result<Option<()>, Failure> {
        let (begin, mut again) = (Instant::now(), Instant::now() + AGAIN);
        let mut messages = Vec::new();
        while let Some(message) = self.world.take() {
            if message.topic() == rc_world::Topic::Change {
                messages.push(message);
            }
        }
        if messages.is_empty() {
            let message = "the change has more than 60 KiB: a tool changes less at once";
            return Err(Failure(2, message.to_owned()));
        }
        for message in &messages {
            self.send(message)?;
        }
        while begin.elapsed() < SPREADING {
            if !self.turn(&mut |_| {})? {
                return Ok(None);
            }
            if self.world.all_have(token) {
                return Ok(Some(()));
            }
            if Instant::now() >= again {
                again += AGAIN;
                for message in &messages {
                    self.send(message)?;
                }
            }
        }
        let name = clean(&self.network.name);
        Err(Failure(
            3,
            format!(
                "not all replicas of `{name}` have the change after {SPREADING:?}; `rcdeploy world {name}` shows which"
            ),
        ))
    }
}

/// The parameter of a topic.
pub(super) fn kind_name(kind: rc_world::Topic) -> &'static str {
    match kind {
        rc_world::Topic::Change => "change",
        rc_world::Topic::Samples => "samples",
        rc_world::Topic::Digest => "digest",
        rc_world::Topic::Ask => "ask",
        rc_world::Topic::Chunk => "chunk",
    }
}

impl From<rc_world::Error> for Failure {
    fn from(error: rc_world::Error) -> Self {
        system(&error)
    }
}
