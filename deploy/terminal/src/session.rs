//! The event loop of the view: one thread, one `poll` over keys, sockets, log and a clock of one
//! second.

use super::connection::{Connection, Pending, Received};
use super::input::{Key, Keys};
use super::log::Log;
use super::model::{Host, LOG, Model, Page};
use super::screen::Screen;
use super::{render, screen, usage};
use rc_deploy_client::error::{Error, ErrorContext};
use rc_deploy_client::{by_hand, place};
use rc_management::chains::Chains;
use rc_management::component;
use rc_management::supervisor::{self, NetworkStatus, Notification};
use rc_middleware::RunDirectory;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, ErrorKind};
use std::os::fd::{AsFd, BorrowedFd};
use std::time::{Duration, Instant};

/// How often the view asks for status.
const TICK: Duration = Duration::from_secs(1);

/// The shortest time between two pictures.
const FRAME: Duration = Duration::from_millis(40);

/// Reason for which the view ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// The user has left the view.
    Left,
    /// The network is down.
    Down,
    /// The terminal is closed.
    Gone,
}

/// Asks for the chains without the messages that came to their ends.
const CHAINS: supervisor::Request = supervisor::Request::Chains { known: None };

#[derive(Clone, Debug, PartialEq)]
enum Source {
    Keys,
    /// The terminal was closed.
    Gone,
    Terminal,
    Owner,
    Supervisor,
    Component(String),
    Action(usize),
    Log,
}

pub(crate) struct Session<'s> {
    pub(super) screen: &'s mut Screen,
    pub(super) model: Model,
    pub(super) directory: RunDirectory,
    start: Instant,
    keys: Keys,
    /// When an incomplete key is taken as it is.
    keys_due: Option<Instant>,
    /// Ends the view when it becomes readable.
    owner: BorrowedFd<'s>,
    /// None if all components were started by hand.
    supervisor: Option<Connection>,
    pub(super) components: BTreeMap<String, Connection>,
    /// Components without an answer so far, unknown to the supervisor.
    unknown: BTreeSet<String>,
    /// Commands to the supervisor in progress, each on its own connection.
    pub(super) actions: Vec<Connection>,
    pub(super) log: Option<Log>,
    pub(super) changed: bool,
    pub(super) end: Option<End>,
}

impl<'s> Session<'s> {
    /// A view of a running network.
    pub(crate) fn new(
        screen: &'s mut Screen,
        model: Model,
        owner: BorrowedFd<'s>,
    ) -> Result<Self, Error> {
        let directory = place::directory(&model.network);
        let socket = directory.socket(supervisor::SOCKET);
        let supervisor = match Connection::connect(&socket) {
            Ok(connection) => Some(connection),
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::NotFound | ErrorKind::ConnectionRefused
                ) =>
            {
                None
            }
            Err(source) => {
                return Err(Error::System {
                    action: format!("connect to {}", socket.display()),
                    source,
                });
            }
        };
        let mut session = Self {
            screen,
            model,
            directory,
            start: Instant::now(),
            keys: Keys::default(),
            keys_due: None,
            owner,
            supervisor,
            components: BTreeMap::new(),
            unknown: BTreeSet::new(),
            actions: Vec::new(),
            log: None,
            changed: true,
            end: None,
        };
        session.greet();
        Ok(session)
    }

    fn greet(&mut self) {
        if let Some(supervisor) = &mut self.supervisor {
            supervisor.send(Pending::Events, &supervisor::Request::Events);
            supervisor.send(Pending::Status, &supervisor::Request::Status);
            supervisor.send(Pending::Chains, &CHAINS);
        }
    }

    /// Shows the network until something ends it.
    pub(crate) fn run(mut self) -> Result<End, Error> {
        let mut tick = Instant::now();
        let mut drawn: Option<Instant> = None;
        loop {
            let now = Instant::now();
            if now >= tick {
                // Missed ticks are skipped.
                tick = now + TICK;
                self.tick();
            }
            self.finish_keys(now)?;
            self.follow_log(now);
            self.request_parameters();
            let frame = drawn.map_or(now, |drawn| drawn + FRAME);
            if self.changed && now >= frame {
                self.draw()?;
                drawn = Some(now);
                self.changed = false;
            }
            if let Some(end) = self.end {
                return Ok(end);
            }
            let due = self.log.as_ref().and_then(|log| log.due);
            let frame = self.changed.then_some(frame);
            let wake = [Some(tick), due, frame, self.keys_due]
                .into_iter()
                .flatten()
                .min();
            for source in self.wait(wake.unwrap_or(tick)) {
                self.turn(&source)?;
            }
        }
    }

    fn draw(&mut self) -> Result<(), Error> {
        if !screen::is_taken() {
            self.end = Some(End::Gone);
            return Ok(());
        }
        let model = &mut self.model;
        let drawn = self.screen.terminal.draw(|frame| {
            let area = frame.area();
            model.size = (area.width, area.height);
            render::draw(model, area, frame.buffer_mut());
        });
        drawn.map(drop).context("draw on the terminal")
    }

    fn wait(&self, wake: Instant) -> Vec<Source> {
        let stdin = io::stdin();
        let mut all: Vec<(Source, BorrowedFd<'_>, bool)> = vec![
            (Source::Keys, stdin.as_fd(), false),
            (Source::Terminal, self.screen.changes(), false),
            (Source::Owner, self.owner, false),
        ];
        if let Some(supervisor) = &self.supervisor {
            let output = supervisor.has_output();
            all.push((Source::Supervisor, supervisor.as_fd(), output));
        }
        for (name, connection) in &self.components {
            let source = Source::Component(name.clone());
            all.push((source, connection.as_fd(), connection.has_output()));
        }
        for (at, connection) in self.actions.iter().enumerate() {
            all.push((
                Source::Action(at),
                connection.as_fd(),
                connection.has_output(),
            ));
        }
        if let Some(log) = self.log.as_ref().and_then(Log::descriptor) {
            all.push((Source::Log, log, false));
        }
        let polled = all.iter().map(|(_, fd, output)| {
            let flags = if *output {
                PollFlags::IN | PollFlags::OUT
            } else {
                PollFlags::IN
            };
            PollFd::from_borrowed_fd(*fd, flags)
        });
        let mut polled: Vec<PollFd<'_>> = polled.collect();
        let left = wake.saturating_duration_since(Instant::now());
        let timeout = Timespec::try_from(left).ok();
        match poll(&mut polled, timeout.as_ref()) {
            Ok(_) => {
                let mut ready = Vec::new();
                for (fd, (source, ..)) in polled.iter().zip(&all) {
                    let events = fd.revents();
                    let broken =
                        events.intersects(PollFlags::HUP | PollFlags::ERR | PollFlags::NVAL);
                    if *source == Source::Keys && broken {
                        // The terminal is closed.
                        return vec![Source::Gone];
                    }
                    if !events.is_empty() {
                        ready.push(source.clone());
                    }
                }
                // Last first, so that indices stay valid after a removal.
                ready.reverse();
                ready
            }
            Err(error) => {
                if error != rustix::io::Errno::INTR {
                    std::thread::sleep(Duration::from_millis(10));
                }
                Vec::new()
            }
        }
    }

    fn turn(&mut self, source: &Source) -> Result<(), Error> {
        match source {
            Source::Keys => self.read_keys()?,
            Source::Gone => self.end = Some(End::Gone),
            Source::Terminal => {
                self.screen.renew().context("set up the terminal")?;
                self.changed = true;
            }
            Source::Owner => {
                self.end = Some(match self.model.host {
                    Host::Up => End::Down,
                    Host::Top => End::Left,
                });
            }
            Source::Supervisor => {
                let Some(supervisor) = &mut self.supervisor else {
                    return Ok(());
                };
                let (received, open) = supervisor.receive();
                received
                    .into_iter()
                    .for_each(|message| self.supervisor_message(message));
                if !open {
                    self.supervisor_gone();
                }
            }
            Source::Component(name) => {
                let Some(connection) = self.components.get_mut(name) else {
                    return Ok(());
                };
                let (received, open) = connection.receive();
                if !open {
                    self.components.remove(name);
                    self.leave_by_hand(name);
                }
                for message in received {
                    self.component_message(name, message);
                }
            }
            Source::Action(at) => {
                let Some(connection) = self.actions.get_mut(*at) else {
                    return Ok(());
                };
                let (received, open) = connection.receive();
                let done = !received.is_empty() || !open;
                if received.is_empty() && !open {
                    self.model.say("the supervisor does not answer", true);
                }
                for message in received {
                    self.answered(message);
                }
                if done {
                    self.actions.remove(*at);
                }
                self.changed = true;
            }
            Source::Log => {
                if let Some(log) = &mut self.log {
                    log.wake(FRAME);
                }
            }
        }
        Ok(())
    }

    fn read_keys(&mut self) -> Result<(), Error> {
        let mut bytes = [0; 1024];
        let count = match rustix::io::read(io::stdin(), &mut bytes) {
            Ok(0) => {
                self.end = Some(End::Gone);
                return Ok(());
            }
            Ok(count) => count,
            Err(rustix::io::Errno::INTR | rustix::io::Errno::AGAIN) => 0,
            Err(error) => return Err(error).context("read keys"),
        };
        for key in self.keys.push(&bytes[..count]) {
            self.press(key)?;
        }
        let half = self.keys.is_half();
        self.keys_due = half.then(|| Instant::now() + FRAME);
        Ok(())
    }

    fn finish_keys(&mut self, now: Instant) -> Result<(), Error> {
        if self.keys_due.is_some_and(|due| now >= due) {
            self.keys_due = None;
            if let Some(key) = self.keys.finish() {
                self.press(key)?;
            }
        }
        Ok(())
    }

    fn press(&mut self, key: Key) -> Result<(), Error> {
        self.changed = true;
        match self.model.key(key) {
            Some(command) => self.perform(command),
            None => Ok(()),
        }
    }

    /// Asks the supervisor and the components for their status.
    fn tick(&mut self) {
        let now = self.start.elapsed();
        self.changed = true;
        self.ask_supervisor();
        self.ask_chains();
        self.find_by_hand();
        let model = &mut self.model;
        let running: Vec<(String, Option<i32>, bool)> = model
            .components
            .iter()
            .map(|c| (c.status.name.clone(), c.status.pid, c.status.host.is_none()))
            .collect();
        let unknown = &self.unknown;
        self.components
            .retain(|name, _| unknown.contains(name) || running.iter().any(|(n, ..)| n == name));
        for (name, pid, here) in running {
            let Some(pid) = pid else {
                self.components.remove(&name);
                model.sample(&name, None, now);
                continue;
            };
            // The pid of another machine means another process here.
            let sample = here.then(|| usage::sample(pid)).flatten();
            model.sample(&name, sample, now);
            if !self.components.contains_key(&name) {
                // A component that starts will listen soon.
                let socket = self.directory.socket(&name.replace('.', "-"));
                if let Ok(connection) = Connection::connect(&socket) {
                    self.components.insert(name.clone(), connection);
                }
            }
            if let Some(connection) = self.components.get_mut(&name) {
                if !connection.pending().any(|a| matches!(a, Pending::Status)) {
                    connection.send(Pending::Status, &component::Request::Status);
                }
                if model.page == Page::Parameters
                    && model.selected == name
                    && !connection
                        .pending()
                        .any(|a| matches!(a, Pending::Parameters))
                {
                    connection.send(
                        Pending::Parameters,
                        &component::Request::Parameters { paths: None },
                    );
                }
            }
        }
        model.tick(now);
    }

    /// Asks the supervisor for its status, unless that is asked already.
    fn ask_supervisor(&mut self) {
        if let Some(supervisor) = &mut self.supervisor
            && !supervisor.pending().any(|a| matches!(a, Pending::Status))
        {
            supervisor.send(Pending::Status, &supervisor::Request::Status);
        }
    }

    /// Asks the supervisor for its chains, unless it has none or is asked already.
    fn ask_chains(&mut self) {
        if let Some(supervisor) = &mut self.supervisor
            && !self.model.chains.is_empty()
            && !supervisor.pending().any(|a| matches!(a, Pending::Chains))
        {
            supervisor.send(Pending::Chains, &CHAINS);
        }
    }

    /// Connects to components that were started by hand. They are shown when they have answered.
    fn find_by_hand(&mut self) {
        // Before its first answer, the supervisor may know each of them.
        if self.supervisor.is_some() && self.model.components.is_empty() {
            return;
        }
        let known = self.model.components.iter();
        let known = known.filter(|c| !c.status.by_hand);
        let found = by_hand::sockets(&self.directory, known.map(|c| c.status.name.as_str()));
        self.unknown.clear();
        for name in found {
            let mut shown = self.model.components.iter();
            if shown.any(|c| c.status.name == name) {
                continue;
            }
            if !self.components.contains_key(&name) {
                let Ok(mut connection) = Connection::connect(&self.directory.socket(&name)) else {
                    continue;
                };
                connection.send(Pending::Status, &component::Request::Status);
                self.components.insert(name.clone(), connection);
            }
            self.unknown.insert(name);
        }
        let is_over = self.supervisor.is_none()
            && self.model.components.is_empty()
            && self.unknown.is_empty();
        if is_over {
            self.end = Some(End::Down);
        }
    }

    /// A component has closed its connection. If it was started by hand, it has ended.
    fn leave_by_hand(&mut self, name: &str) {
        let mut components = self.model.components.iter();
        if components.any(|c| c.status.name == name && c.status.by_hand) {
            self.model.remove(name);
            self.changed = true;
        }
    }

    fn supervisor_message(&mut self, received: Received) {
        self.changed = true;
        match received {
            Received::Answer(Pending::Status, Ok(status)) => {
                if let Ok(status) = NetworkStatus::deserialize(status) {
                    let first = self.model.components.is_empty();
                    self.model.status(status);
                    if first {
                        self.tick();
                    }
                }
            }
            Received::Answer(Pending::Chains, Ok(chains)) => {
                if let Ok(chains) = Chains::deserialize(chains) {
                    self.model.chains = chains.chains;
                }
            }
            Received::Notification(Notification::Event(event)) => {
                self.model.stopping |= event.code == "stopping";
                // An event of a component changes its row.
                if event.code != "log" {
                    self.ask_supervisor();
                }
                if event.code == "down" {
                    self.end = Some(End::Down);
                }
                self.model.event(event);
            }
            Received::Notification(Notification::Missed { events }) => {
                self.model.say(format!("{events} events were missed"), true);
            }
            Received::Answer(Pending::Events, Err(reason)) => self.model.say(reason, true),
            Received::Answer(..) => {}
        }
    }

    /// The supervisor closes its socket when all is down, or when it has too many clients.
    fn supervisor_gone(&mut self) {
        match Connection::connect(&self.directory.socket(supervisor::SOCKET)) {
            Ok(connection) if self.end.is_none() => {
                self.supervisor = Some(connection);
                self.model.events.clear();
                self.greet();
            }
            _ => self.end = Some(End::Down),
        }
    }

    fn component_message(&mut self, name: &str, received: Received) {
        self.changed = true;
        match received {
            Received::Answer(Pending::Status, Ok(report)) => {
                if let Ok(report) = component::Status::deserialize(report) {
                    let now = self.start.elapsed();
                    let mut components = self.model.components.iter();
                    if components.all(|c| c.status.name != name || c.status.by_hand) {
                        self.model.by_hand(by_hand::status(&report));
                    }
                    self.model.report(name, report, now);
                }
            }
            Received::Answer(Pending::Parameters, answer) => {
                let answer = answer.and_then(|known| {
                    serde_json::from_value(known).map_err(|error| error.to_string())
                });
                self.model.parameters(name, answer);
            }
            received @ (Received::Answer(..) | Received::Notification(_)) => {
                self.answered(received);
                self.show_parameters(name);
            }
        }
    }

    pub(super) fn show_parameters(&mut self, name: &str) {
        if self.model.page == Page::Parameters
            && self.model.selected == name
            && let Some(connection) = self.components.get_mut(name)
        {
            connection.send(
                Pending::Parameters,
                &component::Request::Parameters { paths: None },
            );
        }
    }

    /// Reads the log that is to be shown.
    fn follow_log(&mut self, now: Instant) {
        let selected = self.model.component();
        let shown = selected.filter(|_| self.model.page == Page::Log);
        let shown = shown.filter(|c| !c.status.log.as_os_str().is_empty());
        let Some((name, path)) = shown.map(|c| (c.status.name.clone(), c.status.log.clone()))
        else {
            self.log = None;
            return;
        };
        if self.log.as_ref().is_none_or(|log| log.name != name) {
            self.model.log.clear();
            self.log = Some(Log::new(name, path, now));
        }
        let lines = self.log.as_mut().map(|log| log.read(now, LOG, FRAME));
        let lines = lines.unwrap_or_default();
        if !lines.is_empty() {
            self.model.log_lines(lines);
            self.changed = true;
        }
    }

    /// Requests the shown parameters, unless a request is pending.
    fn request_parameters(&mut self) {
        if self.model.page != Page::Parameters || self.model.parameters.is_some() {
            return;
        }
        let name = self.model.selected.clone();
        let connection = self.components.get(&name);
        if connection.is_some_and(|c| !c.pending().any(|p| matches!(p, Pending::Parameters))) {
            self.show_parameters(&name);
        }
    }
}
