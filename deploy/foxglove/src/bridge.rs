//! The server: between the messages of the network and its clients.

mod feeds;
mod requests;

use crate::client::Client;
use crate::command_line::{Failure, Options, system};
use crate::jobs::Jobs;
use crate::offers::{Offers, Source};
use crate::poll::Snapshot;
use crate::protocol;
use crate::world::Teller;
use rc_observe::{FeedId, Observer, Poller, Processes, TimeTopic};
use rc_record::system_time;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{ErrorKind, Read, Write as _};
use std::net::TcpListener;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The longest wait.
const TURN: Duration = Duration::from_millis(500);
/// How many clients are served, including those in the handshake.
const CLIENTS: usize = 16;
/// How many connections are accepted in a turn.
const ACCEPTED: usize = 64;
/// The pause in accepting after the system refused, for example without free descriptors.
const REST: Duration = Duration::from_millis(100);
/// How many different problems are reported.
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
    /// Wakes this thread when something has moved in the world.
    wake_world: UnixStream,
    world: Option<Teller>,
    processes: Processes,
    problems: BTreeSet<String>,
}

impl Bridge {
    /// Looks at the network, and listens.
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
            Ok((read, write.try_clone()?, write.try_clone()?, write))
        };
        let pipe = pipe().map_err(|error: std::io::Error| system("make a pipe", &error))?;
        let (wake, for_poller, for_jobs, wake_world) = pipe;
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
            wake_world,
            world: None,
            processes: Processes::default(),
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
            rc_diagnostics::print::error(format_args!(
                "rcfoxglove: note: whoever reaches {address} can {what}"
            ));
        }
        rc_diagnostics::print::line(format_args!(
            "network {} is at ws://{address}; open it in Foxglove as a Foxglove WebSocket",
            self.options.network
        ));
        while !self.wait(interrupts) {
            self.accept();
            self.receive();
            self.take_messages();
            self.take_world();
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

    /// Reports a problem to all clients, once.
    fn tell(&mut self, problem: &str) {
        if self.problems.len() < PROBLEMS && self.problems.insert(problem.to_owned()) {
            let clients = self.clients.values_mut();
            let open = clients.filter(|client| client.is_open());
            open.for_each(|client| client.complain(problem));
        }
    }
}
