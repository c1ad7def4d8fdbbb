//! Sends recorded samples of topics and recorded answers of servers.

mod answers;
mod conversion;
mod target;

use crate::bag::{Selecting, Selection, length_text};
use crate::error::RecordError;
use crate::keys;
use crate::latched::Latched;
use crate::meaning::Converter;
use crate::reader::{Channel, Message, Reader, Record};
use answers::Answers;
use conversion::Conversion;
use rc_diagnostics::foreign::clean;
use rc_observe::{Network, Topic};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::os::fd::BorrowedFd;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use target::Target;

/// Selection of messages to play, and speed.
#[derive(Clone, Debug)]
pub struct Playing {
    /// The messages.
    pub selection: Selection,
    /// How many times faster than it was recorded.
    pub rate: f64,
    /// A longer time without messages, in the recording, is skipped. So is a step of its clock.
    pub max_gap: Duration,
    /// Topics of the recording, each with the name of a topic of the network.
    pub remap: Vec<(String, String)>,
    /// Whether values of other types are converted by the names of their members.
    pub convert: bool,
    /// Converts values by data prototypes, before that.
    pub meaning: Option<Arc<Converter>>,
    /// Whether recorded replies answer the calls of the network.
    pub answers: bool,
    /// Becomes true when the user ends it: what reads the file returns early.
    pub stop: Arc<AtomicBool>,
}

/// Where the messages of a channel go.
struct Route {
    /// The index of the topic in [`Player::topics`].
    topic: usize,
    conversion: Conversion,
}

/// Plays a recording into a network.
pub struct Player {
    path: PathBuf,
    network: Arc<Network>,
    playing: Playing,
    reader: Reader,
    selecting: Selecting,
    /// The routes of channels; `None` for a channel that no component wants.
    routes: BTreeMap<u32, Option<Route>>,
    topics: Vec<Target>,
    answers: Option<Answers>,
    next: Option<Message>,
    /// Messages to send before the reader goes on.
    following: VecDeque<Message>,
    /// The values that hold where the selection begins.
    latched: Latched,
    /// The recorded times of the last message that was sent: at its receiver, and at its sender.
    last: Option<(u64, u64)>,
    /// The recorded time from which on the clock runs, and when that was.
    begin: Option<(u64, Instant)>,
    /// While the clock is held: the recorded time from which on it goes on.
    held: Option<u64>,
    /// The last time of the network that was given.
    given: u64,
    /// Where it was sought, until the next message is sent.
    sought: Duration,
    first: Option<u64>,
    notes: Vec<String>,
    noted: BTreeSet<String>,
    sent: u64,
    left_out: u64,
}

impl Player {
    /// Opens a recording for a network that runs.
    pub fn open(path: &Path, network: Network, playing: Playing) -> Result<Self, RecordError> {
        let mut reader = Reader::open(path)?;
        let selecting = playing.selection.clone().begin(&reader);
        selecting.limit(&mut reader);
        let mut player = Self {
            path: path.to_owned(),
            first: reader.times().first,
            reader,
            selecting,
            routes: BTreeMap::new(),
            topics: Vec::new(),
            answers: None,
            next: None,
            following: VecDeque::new(),
            latched: Latched::default(),
            last: None,
            begin: None,
            held: None,
            given: 0,
            sought: Duration::ZERO,
            notes: Vec::new(),
            noted: BTreeSet::new(),
            sent: 0,
            left_out: 0,
            playing,
            network: Arc::new(network),
        };
        for (_, to) in &player.playing.remap {
            player.network.topic(plain(to))?;
        }
        player.open_routes()?;
        player.advance()?;
        Ok(player)
    }

    /// Opens all topics before the clock begins to run, with what answers calls.
    fn open_routes(&mut self) -> Result<(), RecordError> {
        let channels = match self.reader.listed() {
            Some(listed) => listed.to_vec(),
            None => self.find_channels()?,
        };
        if self.is_stopped() {
            return Ok(());
        }
        for (from, _) in &self.playing.remap {
            let mut topics = channels.iter().map(|channel| plain(&channel.topic));
            if !topics.any(|topic| is_end(topic, plain(from))) {
                let from = clean(from);
                let text = format!("the recording has no messages of a topic `{from}`");
                return Err(RecordError::Value(text));
            }
        }
        if self.playing.answers {
            let stop = Arc::clone(&self.playing.stop);
            let (answers, notes) = Answers::open(&self.path, &self.network, &channels, stop)?;
            notes.into_iter().for_each(|note| self.note(note));
            self.answers = Some(answers);
        }
        for channel in channels {
            let is_played = self.playing.selection.has_topic(&channel.topic);
            if is_played && !self.is_stopped() {
                let route = self.route(&channel)?;
                self.routes.insert(channel.id, route);
            }
        }
        Ok(())
    }

    /// The channels with messages of a recording without a summary: it is read to its end.
    fn find_channels(&self) -> Result<Vec<Arc<Channel>>, RecordError> {
        let mut whole = Reader::open(&self.path)?;
        let mut channels = BTreeMap::new();
        while let Some(record) = whole.next() {
            if let Record::Message(Message { channel, .. }) = record {
                channels.entry(channel.id).or_insert(channel);
            }
            if self.is_stopped() {
                break;
            }
        }
        Ok(channels.into_values().collect())
    }

    fn is_stopped(&self) -> bool {
        self.playing.stop.load(Ordering::Relaxed)
    }

    /// Takes the notes since the last call, each once.
    pub fn notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }

    fn note(&mut self, note: String) {
        if self.noted.len() < 1000 && self.noted.insert(note.clone()) {
            self.notes.push(note);
        }
    }

    /// The number of messages that were sent.
    pub fn sent(&self) -> u64 {
        self.sent
    }

    /// The number of messages that were left out because they cannot be decoded.
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// The number of calls that were answered, and of those whose parameters were not recorded.
    pub fn answered(&self) -> (u64, u64) {
        let answers = self.answers.as_ref();
        answers.map_or((0, 0), Answers::counts)
    }

    /// The time since the beginning of the recording.
    pub fn position(&self) -> Duration {
        let last = self.last.map(|(log_time, _)| log_time);
        let since = last
            .zip(self.first)
            .map(|(last, first)| last.saturating_sub(first));
        since.map_or(self.sought, Duration::from_nanos)
    }

    /// Whether everything was sent.
    pub fn is_over(&self) -> bool {
        self.next.is_none()
    }

    /// When the next message is due. `None` at the end.
    pub fn due(&mut self) -> Option<Instant> {
        self.skip_gap();
        let next = self.next.as_ref()?;
        let from = self.held.take().unwrap_or(next.log_time);
        let (time, at) = *self
            .begin
            .get_or_insert((from.min(next.log_time), Instant::now()));
        let passed = Duration::from_nanos(next.log_time.saturating_sub(time));
        Some(at + passed.div_f64(self.playing.rate))
    }

    /// Lets the clock go on at the next message, if it is far from the last one.
    fn skip_gap(&mut self) {
        let (Some(next), Some((last, _))) = (&self.next, self.last) else {
            return;
        };
        let (time, gap) = (
            next.log_time,
            Duration::from_nanos(next.log_time.abs_diff(last)),
        );
        let is_new = self.begin.is_none_or(|(from, _)| from != time);
        if gap <= self.playing.max_gap || !is_new {
            return;
        }
        (self.begin, self.held) = (Some((time, Instant::now())), None);
        let at = length_text(self.position());
        let gap = length_text(gap);
        self.note(if time > last {
            format!("{gap} without messages are skipped at {at}; --max-gap sets the longest gap")
        } else {
            format!("the clock of the recording goes back by {gap} at {at}")
        });
    }

    /// Holds the clock: it goes on from here when the next message is asked for.
    pub fn hold_clock(&mut self) {
        if let Some((time, at)) = self.begin.take() {
            self.held = Some(time.saturating_add(self.passed(at)));
        }
    }

    /// The recorded time that has passed since a moment.
    fn passed(&self, since: Instant) -> u64 {
        let passed = since.elapsed().mul_f64(self.playing.rate).as_nanos();
        u64::try_from(passed).unwrap_or(u64::MAX)
    }

    /// The time of the recorded network at this moment, in nanoseconds: that of the last message,
    /// on the way to that of the next one. It goes back only after [`Player::seek`].
    pub fn network_time(&mut self) -> Option<u64> {
        self.given = self.given.max(self.present()?);
        Some(self.given)
    }

    fn present(&self) -> Option<u64> {
        let next = self.next.as_ref().map(|m| (m.log_time, m.publish_time));
        let (from, time) = self.last.or(next)?;
        let (Some((to, next_time)), Some((began, at))) = (next, self.begin) else {
            return Some(time);
        };
        let now = began.saturating_add(self.passed(at));
        let now = now.clamp(from, to.max(from));
        let (part, whole) = (now - from, to.saturating_sub(from).max(1));
        let step = u128::from(next_time.saturating_sub(time)) * u128::from(part);
        Some(time + (step / u128::from(whole)) as u64)
    }

    /// Sends the next message, if a component wants it.
    pub fn send(&mut self) -> Result<(), RecordError> {
        let Some(message) = self.next.take() else {
            return Ok(());
        };
        let position = self.last.map_or(0, |(log_time, _)| log_time);
        let back = Duration::from_nanos(position.saturating_sub(message.log_time));
        let time = if back > self.playing.max_gap {
            message.log_time
        } else {
            message.log_time.max(position)
        };
        self.last = Some((time, message.publish_time));
        if let Some(Some(Route { topic, conversion })) = self.routes.get(&message.channel.id) {
            match conversion.body(&message, self.playing.meaning.as_deref()) {
                Ok(body) => match self.topics[*topic].send(&body) {
                    Ok(()) => self.sent += 1,
                    Err(error) => {
                        self.left_out += 1;
                        let topic = &message.channel.topic;
                        self.note(format!("messages of `{topic}` are left out: {error}"));
                    }
                },
                Err(reason) => {
                    self.left_out += 1;
                    let topic = &message.channel.topic;
                    self.note(format!("messages of `{topic}` are left out: {reason}"));
                }
            }
        }
        self.advance()
    }

    /// Sends messages until one went to a component.
    pub fn step(&mut self) -> Result<(), RecordError> {
        let before = self.sent;
        while !self.is_over() && self.sent == before {
            self.send()?;
        }
        // The clock goes on from this message.
        self.begin = None;
        self.held = self.last.map(|(log_time, _)| log_time);
        Ok(())
    }

    /// Goes to this time after the beginning of the recording.
    pub fn seek(&mut self, to: Duration) -> Result<(), RecordError> {
        self.reader = Reader::open(&self.path)?;
        let selection = Selection {
            from: Some(self.playing.selection.from.unwrap_or_default().max(to)),
            ..self.playing.selection.clone()
        };
        self.selecting = selection.begin(&self.reader);
        self.selecting.limit(&mut self.reader);
        (self.begin, self.held, self.last, self.next) = (None, None, None, None);
        (self.following, self.latched) = (VecDeque::new(), Latched::default());
        (self.given, self.sought) = (0, to);
        self.advance()
    }

    /// Reads up to the next message of the selection.
    fn advance(&mut self) -> Result<(), RecordError> {
        self.note_failures();
        self.next = self.following.pop_front();
        while self.next.is_none()
            && !self.is_stopped()
            && let Some(record) = self.reader.next()
        {
            let Record::Message(message) = record else {
                continue;
            };
            self.first.get_or_insert(message.log_time);
            if !self.selecting.takes(&message) {
                if self.selecting.holds_before(&message) {
                    self.latched.keep(message);
                }
                continue;
            }
            if !self.routes.contains_key(&message.channel.id) {
                let route = self.route(&message.channel)?;
                self.routes.insert(message.channel.id, route);
            }
            self.following.extend(self.latched.take(message.log_time));
            self.following.push_back(message);
            self.next = self.following.pop_front();
            return Ok(());
        }
        let faults = self.reader.faults();
        if self.next.is_none() && !faults.is_none() {
            self.note(format!("the recording is incomplete: {faults}"));
        }
        Ok(())
    }

    /// Takes the failures of topics whose messages are sent by threads.
    fn note_failures(&mut self) {
        let failures = self.topics.iter().filter_map(|target| {
            let (count, error) = target.failures()?;
            Some((
                count,
                format!(
                    "messages of `{}` are left out: {error}",
                    target.topic.address
                ),
            ))
        });
        for (count, note) in failures.collect::<Vec<_>>() {
            self.left_out += count;
            self.sent = self.sent.saturating_sub(count);
            self.note(note);
        }
    }

    /// Finds the topic of the network for a channel.
    fn route(&mut self, channel: &Channel) -> Result<Option<Route>, RecordError> {
        let is_sample = channel.get(keys::KIND).is_none_or(|kind| kind == "sample");
        if !is_sample || channel.get(keys::EXACT).is_some() {
            return Ok(None);
        }
        let (name, encoding) = (&channel.topic, &channel.encoding);
        if encoding != "cdr" {
            self.note(format!(
                "`{name}` is left out: its messages are `{encoding}`, not `cdr`"
            ));
            return Ok(None);
        }
        let Some(topic) = self.topic(channel)? else {
            self.note(format!(
                "no component subscribes to `{name}`; it is left out"
            ));
            return Ok(None);
        };
        let conversion = match Conversion::of(
            channel,
            &topic,
            self.playing.convert,
            self.playing.meaning.as_deref(),
        ) {
            Ok(conversion) => conversion,
            Err(reason) => {
                self.note(format!("`{name}` is left out: {reason}"));
                return Ok(None);
            }
        };
        let mut known = self.topics.iter();
        let known = known.position(|known| {
            let known = &known.topic;
            known.address == topic.address && known.middleware == topic.middleware
        });
        let topic = if let Some(at) = known {
            at
        } else {
            self.topics.push(Target::open(&self.network, topic)?);
            self.topics.len() - 1
        };
        Ok(Some(Route { topic, conversion }))
    }

    /// The topic of the network: as it is remapped, at the same address, of the same operation, or
    /// of the same type in ROS 2.
    fn topic(&mut self, channel: &Channel) -> Result<Option<Topic>, RecordError> {
        let name = plain(&channel.topic);
        let mut remap = self.playing.remap.iter();
        if let Some((_, to)) = remap.find(|(from, _)| is_end(name, plain(from))) {
            return Ok(Some(self.network.topic(plain(to))?));
        }
        let topics = self.network.topics().into_iter();
        let wanted: Vec<Topic> = topics.filter(|t| !t.subscribers.is_empty()).collect();
        let address = channel.get(keys::ADDRESS).unwrap_or(name);
        // Another name of the network makes other addresses.
        let here = format!("{}/{}", self.network.name, rest(address));
        let at = |address: &str| wanted.iter().find(|topic| topic.address == address);
        if let Some(topic) = at(address) {
            return Ok(Some(topic.clone()));
        }
        if let Some(topic) = at(&here).cloned() {
            if let Some((network, _)) = address.split_once('/') {
                let (network, here) = (clean(network), &self.network.name);
                self.note(format!(
                    "the recording is of the network `{network}`; it is played into `{here}`"
                ));
            }
            return Ok(Some(topic));
        }
        // Of several, none is meant.
        let only = |is_meant: &dyn Fn(&Topic) -> bool| {
            let mut found = wanted.iter().filter(|topic| is_meant(topic));
            found.next().filter(|_| found.next().is_none()).cloned()
        };
        let operation = channel
            .get(keys::INTERFACE)
            .zip(channel.get(keys::OPERATION));
        let same = only(&|topic| {
            operation == Some((topic.interface.name.as_str(), topic.operation.name.as_str()))
        });
        let found = same.or_else(|| only(&|topic| conversion::has_type(topic, &channel.type_name)));
        if let Some(topic) = &found {
            let (from, to) = (&channel.topic, topic.name());
            self.note(format!("`{from}` goes to {to}, the only topic of its type"));
        }
        Ok(found)
    }

    /// The descriptors that are readable when a call may have arrived.
    pub fn descriptors(&self) -> Vec<BorrowedFd<'_>> {
        let answers = self.answers.as_ref();
        answers.map_or_else(Vec::new, Answers::descriptors)
    }

    /// Answers the calls that are there, as they were answered at this time of the recording.
    pub fn answer(&mut self) {
        let next = self.next.as_ref().map(|message| message.log_time);
        let position = self.last.map(|(log_time, _)| log_time).or(next);
        let answers = self.answers.as_mut();
        let errors = answers.map(|answers| answers.serve(position.unwrap_or(0)));
        for note in errors.unwrap_or_default() {
            self.note(note);
        }
    }

    /// Waits until the last samples and replies have arrived.
    pub fn finish(self) {
        for target in self.topics {
            target.finish();
        }
        if let Some(answers) = self.answers {
            answers.finish();
        }
    }
}

/// A topic without its first `/`.
fn plain(name: &str) -> &str {
    name.trim_start_matches('/')
}

/// An address without the name of its network.
fn rest(address: &str) -> &str {
    address.split_once('/').map_or("", |(_, rest)| rest)
}

/// Whether a name is this one, or ends with it.
fn is_end(name: &str, end: &str) -> bool {
    let before = name.strip_suffix(end);
    before.is_some_and(|before| before.is_empty() || before.ends_with('/'))
}
