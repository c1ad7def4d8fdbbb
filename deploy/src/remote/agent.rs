//! `rcdeploy agent`: runs components of this machine for a supervisor on another one, over ssh. Its
//! standard streams are the connection. When the connection ends, the agent ends all components.

use super::SupervisorMessage;
use super::agent_health::Health;
use super::agent_renewal::{Renewal, Start};
use super::copies;
use super::log_tail::LogTail;
use super::socket_proxy::{ProxyConnections, ROOM as CALLER_ROOM, Received};
use super::timed_stream::TimedStream;
use super::{BEAT, HOST_LIMIT};
use crate::guard::guard_process::GuardCommand;
use crate::guard::lock::Lock;
use crate::guard::network_guard::{GuardChange, NetworkGuard};
use crate::process::descriptors;
use crate::process::launch::LocalProcess;
use crate::process::orphans::OrphanSweeps;
use crate::process::signals::Signals;
use rc_deploy_client::error::{Error, ErrorContext, print_error};
use rc_deploy_client::names::check_name;
use rc_deploy_client::{DirectoryWatch, logs};
use rc_deploy_network::plan::Component;
use rc_deploy_network::process_name;
use rc_management::Output;
use rc_management::agent::{AgentMessage, Exit, LONGEST};
use rc_management::lines::{self, Line, Lines, Overlong};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::collections::BTreeMap;
use std::io::{self, BufReader, Write as _};
use std::os::fd::{AsFd, OwnedFd};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// The shortest time between two reads of the logs.
const LOOK: Duration = Duration::from_millis(50);
/// How many bytes of output may wait before logs are read on.
const ROOM: usize = 256 * 1024;
/// How many bytes of output may wait in total.
const WAITING: usize = 8 << 20;

/// Event source of the loop.
#[derive(Clone, Debug)]
enum Source {
    Supervisor,
    Output,
    Signals,
    Guard,
    GuardLink,
    Logs,
    ProxyConnection(u64),
    Link(String),
    Process(String),
}

/// Why the agent ends.
enum Ending {
    Farewell,
    Alone(String),
}

/// A process and its run.
pub(super) struct Running {
    pub(super) process: LocalProcess,
    run: String,
}

pub(super) struct Agent {
    network: String,
    /// The folder of the copies.
    root: PathBuf,
    pub(super) network_guard: NetworkGuard,
    signals: Signals,
    pub(super) logs: PathBuf,
    watch: DirectoryWatch,
    /// When to read the logs after a write.
    look: Option<Instant>,
    printed: BTreeMap<String, LogTail>,
    pub(super) running: BTreeMap<String, Running>,
    /// The components that have ended and how many orphans were killed, until they may start again.
    ended: BTreeMap<String, (Exit, usize)>,
    sweeps: OrphanSweeps,
    pub(super) health: Health,
    pub(super) renewal: Renewal,
    connections: ProxyConnections,
    input: OwnedFd,
    lines: Lines,
    output: OwnedFd,
    out: Output,
    heard: Instant,
    beat: Instant,
}

impl Agent {
    pub(super) fn new(
        network: &str,
        root: PathBuf,
        lock: Lock,
        services: &str,
        memory_pause: Duration,
        input: BufReader<TimedStream>,
        mut output: TimedStream,
    ) -> Result<Self, Error> {
        let command = GuardCommand::own().context("find out which program this is")?;
        let services = serde_json::from_str(services)
            .map_err(|error| Error::Plan(format!("its supervisor sent wrong services: {error}")))?;
        // The supervisor knows how many components come.
        descriptors::raise(0)?;
        let logs = logs::open_directory(network)?;
        let guard_log = logs::file(&logs, logs::GUARD);
        logs::clear(&guard_log).context(format!("write {}", guard_log.display()))?;
        let watch = DirectoryWatch::new(&logs).context("follow the logs")?;
        let signals = Signals::new().context("listen to signals")?;
        let mut network_guard = NetworkGuard::new(network, lock, command, guard_log, services)?;
        network_guard.start_guard()?;
        // The supervisor starts components as soon as this agent is ready.
        network_guard.await_services(BEAT, || {
            let beat = output.write_all(&lines::encode(&AgentMessage::Heartbeat));
            beat.context("answer its supervisor")
        })?;
        let now = Instant::now();
        Ok(Self {
            network: network.to_owned(),
            root,
            network_guard,
            signals,
            logs,
            watch,
            look: None,
            printed: BTreeMap::new(),
            running: BTreeMap::new(),
            ended: BTreeMap::new(),
            sweeps: OrphanSweeps::default(),
            health: Health::new(memory_pause),
            renewal: Renewal::default(),
            connections: ProxyConnections::default(),
            // The supervisor waits for the answer, so the buffer is empty.
            input: input.into_inner().0,
            lines: Lines::up_to(LONGEST, Overlong::Skip),
            output: output.0,
            out: Output::up_to(WAITING),
            heard: now,
            beat: now,
        })
    }

    pub(super) fn send(&mut self, message: &AgentMessage) {
        self.out.push(&lines::encode(message));
    }

    pub(super) fn run(mut self, cleanup: &dyn Fn()) {
        let ending = loop {
            let now = Instant::now();
            if now >= self.beat {
                self.send(&AgentMessage::Heartbeat);
                self.beat = now + BEAT;
                self.look_around();
            }
            self.measure(now);
            if self.look.is_some_and(|at| now >= at) {
                self.read_logs();
            }
            self.report_ends();
            if let Err(error) = self.renew(cleanup) {
                break Ending::Alone(error.to_string());
            }
            self.network_guard.check(now);
            self.save();
            if let Err(why) = self.write() {
                break Ending::Alone(why);
            }
            if now >= self.heard + HOST_LIMIT {
                break Ending::Alone(format!("no message came from it for {HOST_LIMIT:?}"));
            }
            let mut ending = None;
            for source in self.wait() {
                if let Some(end) = self.turn(&source) {
                    ending = Some(end);
                    break;
                }
            }
            if let Some(ending) = ending {
                break ending;
            }
        };
        self.end(&ending, cleanup);
    }

    fn wait(&mut self) -> Vec<Source> {
        let mut polled: Vec<PollFd<'_>> = Vec::new();
        let mut sources = Vec::new();
        let mut add = |source, descriptor, flags| {
            polled.push(PollFd::from_borrowed_fd(descriptor, flags));
            sources.push(source);
        };
        add(Source::Supervisor, self.input.as_fd(), PollFlags::IN);
        add(Source::Signals, self.signals.descriptor(), PollFlags::IN);
        if !self.out.is_empty() {
            add(Source::Output, self.output.as_fd(), PollFlags::OUT);
        }
        if let Some(guard) = self.network_guard.descriptor() {
            add(Source::Guard, guard.as_fd(), PollFlags::IN);
        }
        if let Some((link, flags)) = self.network_guard.link() {
            add(Source::GuardLink, link.as_fd(), flags);
        }
        if self.look.is_none() {
            add(Source::Logs, self.watch.descriptor().as_fd(), PollFlags::IN);
        }
        let room = self.out.len() < CALLER_ROOM;
        for (number, descriptor, flags) in self.connections.descriptors(room) {
            add(Source::ProxyConnection(number), descriptor, flags);
        }
        // Links come before processes, so that the last messages of a component count.
        for (name, Running { process, .. }) in &self.running {
            if let Some(link) = process.link() {
                add(Source::Link(name.clone()), link.as_fd(), PollFlags::IN);
            }
        }
        for (name, Running { process, .. }) in &self.running {
            let descriptor = process.descriptor().as_fd();
            add(Source::Process(name.clone()), descriptor, PollFlags::IN);
        }
        let silence = self.heard + HOST_LIMIT;
        let times = [
            Some(self.beat),
            Some(silence),
            self.look,
            self.sweeps.deadline(),
            Some(self.health.deadline()),
            self.network_guard.deadline(),
        ];
        let next = times.into_iter().flatten().min().unwrap_or(silence);
        let left = next.saturating_duration_since(Instant::now());
        let timeout = Timespec::try_from(left).ok();
        match poll(&mut polled, timeout.as_ref()) {
            Ok(_) => polled
                .iter()
                .zip(sources)
                .filter(|(fd, _)| !fd.revents().is_empty())
                .map(|(_, source)| source)
                .collect(),
            // Interrupted, or out of memory for a moment.
            Err(error) => {
                if error != rustix::io::Errno::INTR {
                    std::thread::sleep(Duration::from_millis(10));
                }
                Vec::new()
            }
        }
    }

    fn turn(&mut self, source: &Source) -> Option<Ending> {
        match source {
            Source::Supervisor => return self.receive(),
            Source::Signals => return Some(Ending::Alone("a signal ended this agent".to_owned())),
            Source::Output => {}
            Source::Guard => match self.network_guard.guard_ended() {
                Some(GuardChange::NotStarted(text) | GuardChange::Restarted(text)) => {
                    self.send(&AgentMessage::Note(text));
                }
                Some(GuardChange::Lost(text)) => self.begin_condition("guard-lost", text),
                None => {}
            },
            Source::GuardLink => {
                self.network_guard.turn();
                self.check_memory();
            }
            Source::Logs => {
                self.watch.drain();
                self.look = Some(Instant::now() + LOOK);
            }
            Source::ProxyConnection(wire) => {
                let room = self.out.len() < CALLER_ROOM;
                if let Some(Received { text, there }) = self.connections.turn(*wire, room) {
                    let wire = *wire;
                    if !text.is_empty() {
                        self.send(&AgentMessage::Data { wire, text });
                    }
                    if !there {
                        self.send(&AgentMessage::Close(wire));
                    }
                }
            }
            Source::Link(name) => self.read_link(name),
            Source::Process(name) => self.ended(name),
        }
        None
    }

    fn receive(&mut self) -> Option<Ending> {
        let (lines, ended) = self.lines.read(Stream(&self.input));
        for line in lines {
            self.heard = Instant::now();
            let message = match &line {
                Line::Complete(line) => serde_json::from_slice(line).ok(),
                Line::TooLong => None,
            };
            match message {
                Some(SupervisorMessage::Start {
                    component,
                    run,
                    greeting,
                }) => self.start(Start {
                    component,
                    run,
                    greeting,
                }),
                Some(SupervisorMessage::LinkLine { name, line }) => {
                    self.running
                        .get(&name)
                        .inspect(|running| running.process.send_line(&line));
                }
                Some(SupervisorMessage::Stop(name)) => match self.running.get(&name) {
                    Some(running) => running.process.terminate(),
                    None => self.cancel(&name),
                },
                Some(SupervisorMessage::Kill(name)) => match self.running.get(&name) {
                    Some(running) => running.process.kill(),
                    None => self.cancel(&name),
                },
                Some(SupervisorMessage::Connect { wire, name }) => {
                    let path = self.network_guard.directory().socket(&process_name(&name));
                    if self.connections.call(wire, &path).is_err() {
                        self.send(&AgentMessage::Close(wire));
                    }
                }
                Some(SupervisorMessage::Data { wire, text }) => {
                    if !self.connections.send(wire, &text) {
                        self.send(&AgentMessage::Close(wire));
                    }
                }
                Some(SupervisorMessage::Close(wire)) => self.connections.shut(wire),
                Some(SupervisorMessage::Heartbeat) => {}
                Some(SupervisorMessage::Farewell) => return Some(Ending::Farewell),
                Some(SupervisorMessage::Network { .. }) | None => {
                    let why = "its supervisor sent an unknown message".to_owned();
                    return Some(Ending::Alone(why));
                }
            }
        }
        ended.then(|| Ending::Alone("the connection has ended".to_owned()))
    }

    /// Starts a component.
    pub(super) fn start_now(&mut self, start: &Start) {
        let component = &*start.component;
        let name = component.name.clone();
        match self.launch(component, &start.run, start.greeting.as_deref()) {
            Ok(process) => {
                let registered = process.registered(component, component.stop);
                let pid = process.pid();
                let run = start.run.clone();
                self.running.insert(name.clone(), Running { process, run });
                self.network_guard.started(registered);
                self.send(&AgentMessage::Started { name, pid });
            }
            Err(reason) => self.send(&AgentMessage::NotStarted { name, reason }),
        }
    }

    fn launch(
        &mut self,
        component: &Component,
        run: &str,
        greeting: Option<&str>,
    ) -> Result<LocalProcess, String> {
        check_name("component", &component.name).map_err(|e| e.to_string())?;
        if self.running.contains_key(&component.name) {
            return Err("it runs already".to_owned());
        }
        let cannot = |what: &str, error: io::Error| format!("cannot {what}: {error}");
        if !self.printed.contains_key(&component.name) {
            let printed = LogTail::new(&self.logs, &component.name);
            let printed = printed.map_err(|e| cannot("make its log", e))?;
            self.printed.insert(component.name.clone(), printed);
        }
        // A workspace that the user has named must exist.
        if component.directory.starts_with(&self.root) {
            copies::make_folder(&component.directory)
                .map_err(|e| cannot(&format!("make {}", component.directory.display()), e))?;
        }
        let log = self.printed[&component.name].path();
        if component.exact {
            self.health.records_beside(log);
        }
        LocalProcess::start(component, run, greeting, log, self.network_guard.mark())
    }

    fn read_link(&mut self, name: &str) {
        let Some(Running { process, .. }) = self.running.get_mut(name) else {
            return;
        };
        let lines = process.read_link();
        let closed = process.link().is_none();
        self.forward_lines(name, lines);
        if closed {
            self.send(&AgentMessage::LinkClosed(name.to_owned()));
        }
    }

    fn forward_lines(&mut self, name: &str, lines: Vec<Line>) {
        for line in lines {
            let line = line.into_text();
            let name = name.to_owned();
            self.send(&AgentMessage::LinkLine { name, line });
        }
    }

    fn ended(&mut self, name: &str) {
        let Some(Running { mut process, run }) = self.running.remove(name) else {
            return;
        };
        let words = process.remaining_lines();
        self.forward_lines(name, words);
        let exit = process.reap();
        self.network_guard.ended(name, true);
        // Its last output belongs to the report of its end.
        self.send_output(name);
        // Its end is reported when it may restart.
        self.ended.insert(name.to_owned(), (exit, 0));
        self.sweeps.begin(name, self.network_guard.mark(), run);
    }

    /// Reports components that have ended, once their orphans are killed and the guard has cleaned
    /// up, or either takes too long.
    fn report_ends(&mut self) {
        for (name, left) in self.sweeps.done() {
            if let Some((_, killed)) = self.ended.get_mut(&name) {
                *killed += left;
            } else if left > 0 {
                let text = format!("killed {left} orphaned processes of {name}");
                self.send(&AgentMessage::Note(text));
            }
        }
        // While the services are created anew, starts wait here.
        let is_clean = |name: &str| self.renewal.ends() || self.network_guard.lets_start(name);
        let may_start = |name: &&String| !self.sweeps.hold_back(name) && is_clean(name);
        let names: Vec<String> = self.ended.keys().filter(may_start).cloned().collect();
        for name in names {
            if let Some((exit, left)) = self.ended.remove(&name) {
                self.send(&AgentMessage::Ended { name, exit, left });
            }
        }
    }

    fn read_logs(&mut self) {
        self.look = None;
        self.watch.drain();
        let names: Vec<String> = self.printed.keys().cloned().collect();
        for name in names {
            if self.send_output(&name) {
                self.look = Some(Instant::now() + LOOK);
            }
        }
    }

    /// Sends the output of a component as far as there is room. Returns whether there is more.
    fn send_output(&mut self, name: &str) -> bool {
        let start = self.out.len();
        while self.out.len() < start.max(ROOM) + ROOM && self.out.len() < WAITING / 2 {
            let piece = self.printed.get_mut(name).and_then(LogTail::next);
            let Some(text) = piece else { return false };
            let name = name.to_owned();
            self.send(&AgentMessage::Printed { name, text });
        }
        true
    }

    /// Sends the rest of the output of all components.
    fn send_all_output(&mut self) {
        while let Some(name) = self.printed.keys().next().cloned() {
            if !self.send_output(&name)
                && let Some(printed) = self.printed.remove(&name)
            {
                printed.remove();
            }
            if !self.write_all() {
                return;
            }
        }
    }

    /// Writes all output. Returns `false` if the supervisor does not read it.
    fn write_all(&mut self) -> bool {
        let Ok(output) = self.output.try_clone() else {
            return false;
        };
        self.out.write(TimedStream(output)).is_ok()
    }

    fn write(&mut self) -> Result<(), String> {
        let written = self.out.write(Stream(&self.output));
        written.map_err(|error| error.to_string())
    }

    /// Ends all components, cleans up, and reports it if the supervisor is still connected.
    fn end(mut self, ending: &Ending, cleanup: &dyn Fn()) {
        if let Ending::Alone(why) = ending {
            let names: Vec<&str> = self.running.keys().map(String::as_str).collect();
            print_error(format_args!(
                "rcdeploy agent of {}: the supervisor is gone ({why}); components left: {}",
                self.network,
                names.join(", ")
            ));
        }
        // A component that ignores the signal sees the end of its link.
        for Running { process, .. } in self.running.values() {
            process.terminate();
        }
        drop(std::mem::take(&mut self.running));
        let killed = self.network_guard.end_all();
        if matches!(ending, Ending::Farewell) {
            self.send_all_output();
        }
        let (left, removed, lock) = self.network_guard.finish(cleanup);
        if let Err(error) = removed {
            let path = lock.directory().path().display();
            let note = AgentMessage::Note(format!("cannot remove {path}: {error}"));
            self.out.push(&lines::encode(&note));
        }
        let left = left + killed;
        let finished = AgentMessage::Finished { left };
        self.out.push(&lines::encode(&finished));
        if matches!(ending, Ending::Farewell) {
            let _ = self.out.write(TimedStream(self.output));
        }
    }
}

/// A descriptor that does not block.
struct Stream<'f>(&'f OwnedFd);

impl io::Read for Stream<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        Ok(rustix::io::read(self.0, buffer)?)
    }
}

impl io::Write for Stream<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        Ok(rustix::io::write(self.0, bytes)?)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
