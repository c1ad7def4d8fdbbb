//! The server: between the messages of the network and its clients.

use crate::client::Client;
use crate::command_line::{Failure, Options, system};
use crate::delivery::deliver;
use crate::jobs::{Done, Jobs};
use crate::offers::{Change, Offers, Reading, Source, of_component};
use crate::parameters::{like, values};
use crate::poll::Snapshot;
use crate::protocol::{self, Call, ENCODING, Request};
use crate::subscriptions::SUBSCRIPTIONS;
use rc_diagnostics::foreign::clean;
use rc_observe::{FeedId, Observer, Poller, TimeTopic};
use rc_record::{definition, system_time};
use rc_values::decode;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::{Map, Value as Json};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{ErrorKind, Read, Write as _};
use std::net::TcpListener;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tungstenite::Message;

/// The longest wait.
const TURN: Duration = Duration::from_millis(500);
/// How many clients are served, with those whose handshake is not over.
const CLIENTS: usize = 16;
/// How many connections are accepted in a turn.
const ACCEPTED: usize = 64;
/// For how long none are accepted after the system could not: it has no descriptors left, say.
const REST: Duration = Duration::from_millis(100);
/// After how long a source that could not be opened is tried again.
const RETRY: Duration = Duration::from_secs(30);
/// How many different problems are told.
const PROBLEMS: usize = 1000;

/// Serves a network.
pub(crate) struct Bridge {
    options: Options,
    origins: Arc<[String]>,
    listener: TcpListener,
    /// Until when no connections are accepted.
    rests: Option<Instant>,
    session: u64,
    clients: BTreeMap<u64, Client>,
    next_client: u64,
    offers: Offers,
    observer: Observer,
    feeds: BTreeMap<FeedId, Source>,
    opened: BTreeMap<Source, FeedId>,
    refused: BTreeMap<Source, Instant>,
    /// The feed of the network's time, if it is not that of the system, and the last time.
    time: Option<(FeedId, TimeTopic)>,
    now: Option<u64>,
    poller: Poller<Snapshot>,
    jobs: Jobs,
    wake: UnixStream,
    processes: BTreeSet<u32>,
    problems: BTreeSet<String>,
}

impl Bridge {
    /// Poller at the network, and listens.
    pub(crate) fn begin(options: Options) -> Result<Self, Failure> {
        let snapshot = Snapshot::once(&options.network)?;
        for (name, _) in &options.frames {
            rc_observe::Source::find(&snapshot.network, name)?;
        }
        let observer = Observer::new(&snapshot.network)?;
        let pipe = || {
            let (read, write) = UnixStream::pair()?;
            read.set_nonblocking(true)?;
            write.set_nonblocking(true)?;
            Ok((read, write.try_clone()?, write))
        };
        let pipe = pipe().map_err(|error: std::io::Error| system("make a pipe", &error))?;
        let (wake, for_poller, for_jobs) = pipe;
        let at = (options.address, options.port);
        let action = format!("listen on {} port {}", options.address, options.port);
        let listener = TcpListener::bind(at).map_err(|error| system(&action, &error))?;
        let nonblocking = listener.set_nonblocking(true);
        nonblocking.map_err(|error| system(&action, &error))?;
        let (name, mut wake_bridge) = (options.network.clone(), for_poller);
        // If the pipe is full, the bridge is awake anyway.
        let notify = move || drop(wake_bridge.write(&[0]));
        let poller = Poller::begin(move || Snapshot::or_nothing(&name), notify);
        let poller = poller.map_err(|error| system("start a thread", &error))?;
        let mut bridge = Self {
            origins: options.origins.clone().into(),
            listener,
            rests: None,
            session: system_time(),
            clients: BTreeMap::new(),
            next_client: 0,
            offers: Offers::default(),
            observer,
            feeds: BTreeMap::new(),
            opened: BTreeMap::new(),
            refused: BTreeMap::new(),
            time: None,
            now: None,
            poller,
            jobs: Jobs::new(for_jobs),
            wake,
            processes: BTreeSet::new(),
            problems: BTreeSet::new(),
            options,
        };
        bridge.update(&snapshot);
        Ok(bridge)
    }

    /// Serves until a signal comes.
    pub(crate) fn serve(mut self, interrupts: &UnixStream) -> Result<(), Failure> {
        let address = self.listener.local_addr();
        let address = address.map_err(|error| system("listen", &error))?;
        if !address.ip().is_loopback() {
            let what = if self.options.read_only {
                "see the network"
            } else {
                "call its operations and change its parameters; `--read-only` forbids that"
            };
            let note = format!("rcfoxglove: note: whoever reaches {address} can {what}\n");
            let _ = std::io::stderr().write_all(note.as_bytes());
        }
        crate::print(&format!(
            "network {} is at ws://{address}; open it in Foxglove as a Foxglove WebSocket\n",
            self.options.network
        ))?;
        while !self.wait(interrupts) {
            self.accept();
            self.receive();
            self.take_messages();
            for snapshot in self.poller.take() {
                self.update(&snapshot);
            }
            for (client, done) in self.jobs.take() {
                self.finished(client, done);
            }
            for client in self.clients.values_mut() {
                client.flush();
            }
            let before = self.clients.len();
            self.clients.retain(|_, client| !client.is_closed());
            if self.clients.len() < before {
                self.follow();
            }
        }
        Ok(())
    }

    /// Waits until there is something to do. Says whether a signal has come.
    fn wait(&mut self, interrupts: &UnixStream) -> bool {
        let now = Instant::now();
        self.rests = self.rests.filter(|end| *end > now);
        let mut limit = self.rests.map_or(TURN, |end| end - now);
        if self.clients.values().any(Client::has_more) {
            limit = Duration::ZERO;
        }
        let read = |fd| PollFd::from_borrowed_fd(fd, PollFlags::IN);
        let mut polled = vec![read(interrupts.as_fd()), read(self.wake.as_fd())];
        if self.rests.is_none() {
            polled.push(read(self.listener.as_fd()));
        }
        polled.extend(self.observer.descriptors().map(read));
        let clients = self.clients.values().filter_map(Client::polled);
        polled.extend(clients.map(|(fd, flags)| PollFd::from_borrowed_fd(fd, flags)));
        let limit = Timespec::try_from(limit).ok();
        // An interrupted wait is a short one.
        let _ = poll(&mut polled, limit.as_ref());
        let has_signal = !polled[0].revents().is_empty();
        let _ = (&self.wake).read(&mut [0; 64]);
        has_signal
    }

    fn accept(&mut self) {
        for _ in 0..ACCEPTED {
            if self.rests.is_some() {
                break;
            }
            let stream = match self.listener.accept() {
                Ok((stream, _)) => stream,
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(_) => {
                    // The listener stays readable.
                    self.rests = Some(Instant::now() + REST);
                    break;
                }
            };
            if self.clients.len() >= CLIENTS {
                // It is closed.
                continue;
            }
            if let Some(client) = Client::accept(stream, &self.origins) {
                let id = self.next_client;
                self.next_client += 1;
                let is_open = client.is_open();
                self.clients.insert(id, client);
                if is_open {
                    self.welcome(id);
                }
            }
        }
        let ids: Vec<u64> = self.clients.keys().copied().collect();
        for id in ids {
            let has_begun = self.clients.get_mut(&id).is_some_and(Client::greet);
            if has_begun {
                self.welcome(id);
            }
        }
    }

    fn welcome(&mut self, id: u64) {
        let mut capabilities = vec!["parameters", "parametersSubscribe", "connectionGraph"];
        if !self.options.read_only {
            capabilities.push("services");
        }
        if self.time.is_some() {
            capabilities.push("time");
        }
        let info = protocol::server_info(&self.options.network, self.session, &capabilities);
        if let Some(client) = self.clients.get_mut(&id) {
            client.send(&info);
            for document in self.offers.advertisements() {
                client.send(&document);
            }
        }
    }

    fn receive(&mut self) {
        let ids: Vec<u64> = self.clients.keys().copied().collect();
        for id in ids {
            if let Some(client) = self.clients.get_mut(&id) {
                client.begin_turn();
            }
            while let Some(message) = self.clients.get_mut(&id).and_then(Client::receive) {
                let handled = match &message {
                    Message::Text(text) => match serde_json::from_str(text) {
                        Ok(request) => self.request(id, request),
                        Err(error) => Err(format!("the request cannot be read: {error}")),
                    },
                    Message::Binary(bytes) => match Call::read(bytes) {
                        Some(call) => {
                            self.call(id, &call);
                            Ok(())
                        }
                        None => Err("the binary message is no call".to_owned()),
                    },
                    _ => Ok(()),
                };
                if let (Err(reason), Some(client)) = (handled, self.clients.get_mut(&id)) {
                    client.complain(&reason);
                }
            }
        }
    }

    fn request(&mut self, id: u64, request: Request) -> Result<(), String> {
        let Some(client) = self.clients.get_mut(&id) else {
            return Ok(());
        };
        match request {
            Request::Subscribe { subscriptions } => {
                let mut refusals = subscriptions.iter().filter_map(|one| {
                    if self.offers.channels.contains_key(&one.channel_id) {
                        client.subscriptions.add(one.id, one.channel_id).err()
                    } else {
                        Some(format!("there is no channel {}", one.channel_id))
                    }
                });
                // One complaint for a request, however many it brings.
                let first = refusals.next();
                let others = refusals.count();
                self.follow();
                return match first {
                    None => Ok(()),
                    Some(first) if others == 0 => Err(first),
                    Some(first) => Err(format!("{first}; {others} others were refused, too")),
                };
            }
            Request::Unsubscribe { subscription_ids } => {
                for one in subscription_ids {
                    client.subscriptions.remove(one);
                }
                self.follow();
            }
            Request::GetParameters {
                parameter_names,
                id: request,
            } => {
                let document = values(&self.offers, &parameter_names, request.as_deref());
                client.send(&document);
            }
            Request::SetParameters { parameters, id: of } => {
                if self.options.read_only {
                    return Err("parameters cannot be changed: `--read-only`".to_owned());
                }
                return self.set(id, parameters, of);
            }
            Request::SubscribeParameterUpdates { parameter_names } => {
                if parameter_names.is_empty() {
                    client.watched = None;
                } else if let Some(watched) = &mut client.watched {
                    if watched.len() + parameter_names.len() > SUBSCRIPTIONS {
                        return Err(format!("more than {SUBSCRIPTIONS} parameters"));
                    }
                    watched.extend(parameter_names);
                }
            }
            Request::UnsubscribeParameterUpdates { parameter_names } => {
                if parameter_names.is_empty() {
                    client.watched = Some(BTreeSet::new());
                }
                if let Some(watched) = &mut client.watched {
                    for name in &parameter_names {
                        watched.remove(name);
                    }
                }
            }
            Request::SubscribeConnectionGraph => {
                client.watches_graph = true;
                let whole = crate::offers::Graph::default().update_to(&self.offers.graph);
                whole.iter().for_each(|document| client.send(document));
            }
            Request::UnsubscribeConnectionGraph => client.watches_graph = false,
        }
        Ok(())
    }

    fn set(
        &mut self,
        client: u64,
        parameters: Vec<protocol::Parameter>,
        id: Option<String>,
    ) -> Result<(), String> {
        let mut changes: BTreeMap<String, Map<String, Json>> = BTreeMap::new();
        let mut names = Vec::new();
        for one in parameters {
            let Some(known) = self.offers.parameters.get(&one.name) else {
                return Err(format!("there is no parameter `{}`", one.name));
            };
            let Some(value) = one.value else {
                return Err(format!("the parameter `{}` cannot be removed", one.name));
            };
            let of = changes.entry(known.component.clone()).or_default();
            of.insert(known.path.clone(), like(&known.value, value));
            names.push(one.name);
        }
        let network = &self.options.network;
        self.jobs.set(client, network, changes, names, id)
    }

    fn call(&mut self, id: u64, call: &Call<'_>) {
        let begun = self.begin_call(id, call);
        if let (Err(reason), Some(client)) = (begun, self.clients.get_mut(&id)) {
            client.send(&protocol::failure(
                call.service,
                call.number,
                &clean(&reason),
            ));
        }
    }

    fn begin_call(&mut self, id: u64, call: &Call<'_>) -> Result<(), String> {
        let service = self.offers.services.get(&call.service);
        let service = service.ok_or_else(|| format!("there is no service {}", call.service))?;
        if call.encoding != ENCODING.as_bytes() {
            return Err(format!("expected a request in the encoding `{ENCODING}`"));
        }
        let operation = service.operation.clone();
        let body = definition::body(call.body)?;
        let request = &operation.operation.request;
        let parameters = decode(request, rc_middleware::Encoding::Cdr, body)
            .map_err(|error| format!("the request cannot be decoded: {error}"))?;
        let network = &self.options.network;
        let call = (call.service, call.number);
        self.jobs.call(id, network, operation, parameters, call)
    }

    fn finished(&mut self, id: u64, done: Done) {
        match done {
            Done::Called {
                service,
                call,
                reply,
            } => {
                let Some(client) = self.clients.get_mut(&id) else {
                    return;
                };
                match reply {
                    Ok(body) => client.send_binary(protocol::reply(service, call, &body)),
                    Err(reason) => {
                        client.send(&protocol::failure(service, call, &clean(&reason)));
                    }
                }
            }
            Done::Set {
                names,
                id: of,
                failures,
                listed,
            } => {
                for (component, listed) in &listed {
                    let mut all = std::mem::take(&mut self.offers.parameters);
                    // The values before are still those that others know.
                    let is_other = |name: &String, new: &Json| {
                        all.get(name).is_none_or(|old| old.value != *new)
                    };
                    let new: Vec<_> = of_component(component, listed).collect();
                    let others = new.iter().filter(|(name, one)| is_other(name, &one.value));
                    let others = others.map(|(name, _)| name.clone()).collect();
                    all.extend(new);
                    self.offers.parameters = all;
                    self.tell_parameters(&others, Some(id));
                }
                if let Some(client) = self.clients.get_mut(&id) {
                    failures.iter().for_each(|reason| client.complain(reason));
                    client.send(&values(&self.offers, &names, of.as_deref()));
                }
            }
        }
    }

    /// Tells those that watch these parameters their values, all but one client.
    fn tell_parameters(&mut self, names: &BTreeSet<String>, but: Option<u64>) {
        let others = self.clients.iter_mut();
        let others = others.filter(|(id, client)| client.is_open() && but != Some(**id));
        for (_, client) in others {
            let wanted = names.iter();
            let wanted = wanted.filter(|name| {
                let watched = client.watched.as_ref();
                watched.is_none_or(|watched| watched.contains(*name))
            });
            let wanted: Vec<String> = wanted.cloned().collect();
            if !wanted.is_empty() {
                client.send(&values(&self.offers, &wanted, None));
            }
        }
    }

    fn update(&mut self, snapshot: &Snapshot) {
        let processes = snapshot.network.components.iter().map(|c| c.described.pid);
        let processes: BTreeSet<u32> = processes.collect();
        if self.processes.is_disjoint(&processes) && !processes.is_empty() {
            // All components are new: also the shared memory is another one.
            match Observer::new(&snapshot.network) {
                Ok(observer) => {
                    self.feeds.clear();
                    self.opened.clear();
                    self.refused.clear();
                    (self.time, self.now) = (None, None);
                    self.observer = observer;
                }
                Err(error) => {
                    // The next poll tries again; until then, the old network stays.
                    self.tell(&error.to_string());
                    return;
                }
            }
        }
        self.processes = processes;
        let change: Change =
            self.offers
                .update(snapshot, &self.options.frames, self.options.read_only);
        for client in self.clients.values_mut().filter(|client| client.is_open()) {
            change.documents.iter().for_each(|d| client.send(d));
            if client.watches_graph {
                change.graph.iter().for_each(|d| client.send(d));
            }
            let channels = &self.offers.channels;
            client
                .subscriptions
                .retain(|channel| channels.contains_key(&channel));
        }
        self.tell_parameters(&change.parameters, None);
        if self.time.is_none()
            && let Some(time) = snapshot.network.time()
            && let Ok(feed) = self.observer.open(time.topic())
        {
            self.time = Some((feed, time));
        }
        self.follow();
        let feeds: Vec<FeedId> = self.feeds.keys().copied().collect();
        for feed in feeds {
            for report in self.observer.errors(feed) {
                self.tell(&report);
            }
        }
    }

    /// Opens what clients have subscribed to, and closes what they want no longer.
    fn follow(&mut self) {
        let subscribed = self.clients.values();
        let subscribed = subscribed.flat_map(|client| client.subscriptions.channels());
        let wanted = subscribed.filter_map(|channel| self.offers.channels.get(channel));
        let wanted = wanted.flat_map(|channel| channel.sources.iter().cloned());
        let wanted: BTreeSet<Source> = wanted.collect();
        self.opened.retain(|source, feed| {
            let stays = wanted.contains(source);
            if !stays {
                self.observer.close(*feed);
                self.feeds.remove(feed);
            }
            stays
        });
        self.refused.retain(|_, since| since.elapsed() < RETRY);
        for source in wanted {
            if self.opened.contains_key(&source) || self.refused.contains_key(&source) {
                continue;
            }
            let opened = match (self.offers.readings.get(&source), &source) {
                (Some(Reading::Topic(topic)), _) => self.observer.open(topic),
                (
                    Some(Reading::Calls { .. }),
                    Source::Calls {
                        component, slot, ..
                    },
                ) => self.observer.tap(component, slot),
                _ => continue,
            };
            match opened {
                Ok(feed) => {
                    self.feeds.insert(feed, source.clone());
                    self.opened.insert(source, feed);
                }
                Err(error) => {
                    self.refused.insert(source, Instant::now());
                    self.tell(&error.to_string());
                }
            }
        }
    }

    /// Tells all clients a problem, once.
    fn tell(&mut self, problem: &str) {
        if self.problems.len() < PROBLEMS && self.problems.insert(problem.to_owned()) {
            let clients = self.clients.values_mut();
            let open = clients.filter(|client| client.is_open());
            open.for_each(|client| client.complain(problem));
        }
    }

    fn take_messages(&mut self) {
        let Self {
            observer,
            feeds,
            offers,
            clients,
            time,
            now,
            ..
        } = self;
        let mut problems = Vec::new();
        observer.take(&mut |feed, observed| {
            if let Some((of_time, topic)) = time
                && *of_time == feed
            {
                if let Some(time) = topic.read(&observed) {
                    *now = Some(time);
                    let open = clients.values_mut().filter(|client| client.is_open());
                    open.for_each(|client| client.publish(protocol::time(time)));
                }
                return;
            }
            let Some(source) = feeds.get(&feed) else {
                return;
            };
            let Some(reading) = offers.readings.get(source) else {
                return;
            };
            let channels = offers.channels.iter();
            let channels = channels.filter(|(_, channel)| channel.sources.contains(source));
            let clients = clients.values_mut();
            let fits = deliver(reading, &observed, channels, clients, *now);
            if !fits && problems.len() < 8 {
                problems.push(source.clone());
            }
        });
        for source in problems {
            let what = match source {
                Source::Topic { address, .. } => address,
                Source::Calls {
                    component, slot, ..
                } => format!("{component}.{slot}"),
            };
            self.tell(&format!("a message of {what} does not fit its description"));
        }
    }
}
