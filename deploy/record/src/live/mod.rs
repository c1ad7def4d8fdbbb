//! Records a running network: topics, calls, events, parameters, states and descriptions.

mod feed;
mod output;
mod poll;
mod recording_clock;

pub use output::Progress;

use crate::error::RecordError;
use crate::sink::Sink;
use feed::{Feed, FeedSource};
use output::Output;
use poll::{Snapshot, poll};
use rc_management::supervisor::{self, Event, Severity};
use rc_management::{Client, Incoming};
use rc_observe::{End, FeedId, Network, Observer, Poller, Processes, Service, Source};
use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// After how many polls without any component the network has ended.
const GONE: u32 = 2;

/// Selection of what is recorded of a network.
#[derive(Clone, Debug, Default)]
pub struct RecordSelection {
    /// The names of topics and of operations. Empty for all.
    pub names: Vec<String>,
    /// Whether all calls are recorded, if nothing is named.
    pub calls: bool,
}

/// The topics and operations that were named, by their addresses.
#[derive(Default)]
struct Selected {
    topics: BTreeSet<String>,
    /// The operations of each end.
    calls: BTreeMap<End, BTreeSet<String>>,
}

/// Records a network into a sink.
pub struct Recorder {
    selected: Option<Selected>,
    calls: bool,
    observer: Observer,
    feeds: BTreeMap<FeedId, Feed>,
    /// Feeds by source, so that nothing is opened twice.
    known: BTreeMap<String, FeedId>,
    time: Option<FeedId>,
    output: Output,
    events: Option<Client>,
    poller: Poller<Option<Snapshot>>,
    /// Whether the next polls begin to follow the events of the supervisor.
    wants_events: Arc<AtomicBool>,
    /// The processes of the components at the last poll.
    processes: Processes,
    empty_polls: u32,
    notes: Vec<String>,
    noted: BTreeSet<String>,
}

impl Recorder {
    /// Begins to record a network that runs. `sink` is called when all names are known.
    pub fn begin(
        network: &Network,
        wanted: &RecordSelection,
        sink: impl FnOnce() -> Result<Sink, RecordError>,
    ) -> Result<Self, RecordError> {
        let selected = (!wanted.names.is_empty()).then(|| Selected::find(network, &wanted.names));
        let selected = selected.transpose()?;
        let observer = Observer::new(network)?;
        let name = network.name.clone();
        let wants_events = Arc::new(AtomicBool::new(false));
        let (polled, wanted_events) = (name.clone(), Arc::clone(&wants_events));
        // A component that hangs delays this look. Queues that are open meanwhile would overflow.
        let mut known = None;
        let first = poll(&name, &mut known, true);
        let look = move || poll(&polled, &mut known, wanted_events.load(Ordering::Relaxed));
        let poller = Poller::begin(look, || {});
        let poller =
            poller.map_err(|e| RecordError::Value(format!("no thread can be started: {e}")))?;
        let mut recorder = Self {
            selected,
            calls: wanted.calls,
            observer,
            feeds: BTreeMap::new(),
            known: BTreeMap::new(),
            time: None,
            output: Output::new(&name, sink()?),
            events: None,
            poller,
            wants_events,
            processes: Processes::of(network),
            empty_polls: 0,
            notes: Vec::new(),
            noted: BTreeSet::new(),
        };
        let failed = recorder.join(network);
        if let Some((_, error)) = failed.into_iter().next() {
            return Err(error);
        }
        if let Some(first) = first {
            recorder.output.note(&first);
            recorder.follow(first.events);
        }
        Ok(recorder)
    }

    /// How far the recording is.
    pub fn progress(&self) -> Progress {
        Progress {
            feeds: self.feeds.len() - usize::from(self.time.is_some()),
            ..self.output.progress
        }
    }

    /// Where the messages go.
    pub fn sink(&mut self) -> &mut Sink {
        &mut self.output.sink
    }

    /// Takes the notes on sources that could not be recorded, each once.
    pub fn notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }

    /// Whether no component of the network runs any more.
    pub fn has_network_ended(&self) -> bool {
        self.empty_polls >= GONE
    }

    /// Records messages until `limit` has passed, or until one of `others` is readable. Returns the
    /// events.
    pub fn step(&mut self, others: &[BorrowedFd<'_>], limit: Duration) -> Vec<Event> {
        let mut waited = others.to_vec();
        waited.extend(self.events.as_ref().map(AsFd::as_fd));
        self.observer.wait(&waited, limit);
        self.take();
        let events = self.take_events();
        for found in self.poller.take() {
            match found {
                Some(found) => self.update(found),
                None => self.empty_polls += 1,
            }
        }
        events
    }

    fn take(&mut self) {
        let Self {
            observer,
            feeds,
            output,
            time,
            ..
        } = self;
        // The messages that came with a tick have its time, not that of the previous tick.
        if let Some(id) = time
            && let Some(feed) = feeds.get_mut(id)
        {
            observer.take_of(*id, &mut |observed| feed.take(&observed, output));
        }
        observer.take(&mut |id, observed| {
            if let Some(feed) = feeds.get_mut(&id) {
                feed.take(&observed, output);
            }
        });
        for (id, feed) in feeds {
            output.note_loss(feed.address(), observer.lost(*id));
        }
    }

    fn update(&mut self, found: Snapshot) {
        self.empty_polls = 0;
        let network = &found.network;
        match self.renew(network) {
            Ok(()) => {
                for (what, error) in self.join(network) {
                    self.note(format!("{what} is not recorded: {error}"));
                }
            }
            // The next look tries again.
            Err(error) => self.note(error.to_string()),
        }
        self.output.note(&found);
        self.follow(found.events);
        let reports = self.feeds.keys().flat_map(|id| self.observer.errors(*id));
        let reports: Vec<String> = reports.collect();
        for report in reports {
            self.note(report);
        }
    }

    /// Observes again if all components are new.
    fn renew(&mut self, network: &Network) -> Result<(), rc_observe::Error> {
        let processes = Processes::of(network);
        if self.processes.were_replaced_by(&processes) {
            self.observer = Observer::new(network)?;
            self.feeds.clear();
            self.known.clear();
            self.time = None;
            self.output.simulated = None;
        }
        self.processes.update(processes);
        Ok(())
    }

    /// Follows the events from now on, unless they are followed already.
    fn follow(&mut self, events: Option<Client>) {
        if self.events.is_none() {
            self.events = events;
        }
        self.wants_events
            .store(self.events.is_none(), Ordering::Relaxed);
    }

    /// Keeps a note, unless it is a repetition.
    fn note(&mut self, note: String) {
        // A note that changes is repeated, up to a bound.
        if self.noted.len() < 1000 && self.noted.insert(note.clone()) {
            self.notes.push(note);
        }
    }

    /// Opens new sources of the network, and closes those that have ended. Returns failures.
    fn join(&mut self, network: &Network) -> Vec<(String, RecordError)> {
        let ended = self.known.iter().map(|(key, id)| (key.clone(), *id));
        let ended = ended.filter(|(_, id)| self.observer.has_ended(*id));
        let ended: Vec<_> = ended.collect();
        for (key, id) in ended {
            self.observer.close(id);
            self.feeds.remove(&id);
            self.known.remove(&key);
        }
        let mut failed = Vec::new();
        for topic in network.topics() {
            let selected = self.selected.as_ref();
            if selected.is_some_and(|selected| !selected.topics.contains(&topic.address)) {
                continue;
            }
            let (address, hash) = (topic.address.clone(), topic.operation.hash);
            let key = format!("{address} {} {hash:016x}", topic.middleware);
            let source = Source::Topic(topic.clone());
            self.open(
                key,
                &address,
                &mut failed,
                FeedSource::topic(topic),
                |observer| source.open(observer),
            );
        }
        for service in network.services() {
            self.join_calls(network, &service, &mut failed);
        }
        if self.time.is_none()
            && let Some(time) = network.time()
        {
            // Without it, messages have the time of the system.
            if let Ok(id) = self.observer.open(time.topic()) {
                self.time = Some(id);
                self.feeds
                    .insert(id, Feed::new(FeedSource::Time(Box::new(time))));
            }
        }
        failed
    }

    /// Taps the server of calls, or its clients if the server is not a component of the network.
    fn join_calls(
        &mut self,
        network: &Network,
        service: &Service,
        failed: &mut Vec<(String, RecordError)>,
    ) {
        let ends = if service.servers.is_empty() {
            &service.clients
        } else {
            &service.servers
        };
        for end in ends {
            let only = match &self.selected {
                None if self.calls => None,
                None => continue,
                Some(selected) => match selected.calls.get(end) {
                    Some(only) => Some(only.clone()),
                    None => continue,
                },
            };
            let Some(component) = network.component(&end.component) else {
                continue;
            };
            // Another process of the same name is tapped again.
            let key = format!("{end} {}", component.described.pid);
            let what = FeedSource::calls(end, service, only);
            self.open(key, &end.to_string(), failed, what, |observer| {
                observer.tap(&end.component, &end.slot)
            });
        }
    }

    fn open(
        &mut self,
        key: String,
        name: &str,
        failed: &mut Vec<(String, RecordError)>,
        what: FeedSource,
        open: impl FnOnce(&mut Observer) -> Result<FeedId, rc_observe::Error>,
    ) {
        if self.known.contains_key(&key) {
            return;
        }
        match open(&mut self.observer) {
            Ok(id) => {
                self.known.insert(key, id);
                self.feeds.insert(id, Feed::new(what));
            }
            Err(error) => failed.push((name.to_owned(), error.into())),
        }
    }

    fn take_events(&mut self) -> Vec<Event> {
        let Some(client) = &mut self.events else {
            return Vec::new();
        };
        let (received, is_open) = client.receive();
        let events = received.into_iter().filter_map(|incoming| {
            let Incoming::Notification(method, params) = incoming else {
                return None;
            };
            Some(match supervisor::Notification::decode(&method, params)? {
                supervisor::Notification::Event(event) => event,
                supervisor::Notification::Missed { events } => {
                    let text = format!("{events} events were missed");
                    Event::network(Severity::Warning, "missed", text)
                }
            })
        });
        let events: Vec<Event> = events.collect();
        if !is_open {
            self.events = None;
            self.wants_events.store(true, Ordering::Relaxed);
        }
        events.iter().for_each(|event| self.output.event(event));
        events
    }

    /// Ends the recording. Returns where the messages went, and how many.
    pub fn finish(mut self) -> (Sink, Progress) {
        let progress = self.progress();
        self.output.conclude();
        (self.output.sink, progress)
    }
}

impl Selected {
    fn find(network: &Network, names: &[String]) -> Result<Self, RecordError> {
        let mut selected = Self::default();
        for name in names {
            match Source::find(network, name)? {
                Source::Topic(topic) => {
                    selected.topics.insert(topic.address);
                }
                Source::Calls(operation) => {
                    let calls = selected.calls.entry(operation.server).or_default();
                    calls.insert(operation.operation.name);
                }
            }
        }
        Ok(selected)
    }
}
