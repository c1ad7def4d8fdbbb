//! `rcdeploy agent`: runs components of this machine for a supervisor on another one, over ssh. Its
//! standard streams are the connection. When the connection ends, the agent ends all components.

use super::SupervisorMessage;
use super::agent_health::Health;
use super::agent_process::{Running, Start, Starting};
use super::agent_renewal::Renewal;
use super::log_tail::LogTail;
use super::socket_proxy::{ProxyConnections, ROOM as CALLER_ROOM, Received};
use super::timed_stream::TimedStream;
use super::{BEAT, HOST_LIMIT};
use crate::guard::guard_process::GuardCommand;
use crate::guard::lock::Lock;
use crate::guard::network_guard::{GuardChange, NetworkGuard};
use crate::process::descriptors;
use crate::process::launch::{LocalProcess, MOST_THREADS};
use crate::process::orphans::OrphanSweeps;
use crate::process::signals::Signals;
use rc_deploy_client::error::{Error, ErrorContext, print_error};
use rc_deploy_client::{DirectoryWatch, logs};
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
    /// The link of a component: its process and its name.
    Link(String, String),
    Process(String),
}

/// Why the agent ends.
enum Ending {
    Farewell,
    Alone(String),
}

pub(super) struct Agent {
    network: String,
    /// The folder of the copies.
    pub(super) root: PathBuf,
    pub(super) network_guard: NetworkGuard,
    signals: Signals,
    pub(super) logs: PathBuf,
    watch: DirectoryWatch,
    /// When to read the logs after a write.
    look: Option<Instant>,
    /// The logs of components and processes by their names.
    pub(super) printed: BTreeMap<String, LogTail>,
    /// The components of the process that starts next, as far as they were named.
    coming: Vec<Starting>,
    /// The processes by their names.
    pub(super) running: BTreeMap<String, Running>,
    /// The processes that have ended and how many orphans were killed, until they may start again.
    ended: BTreeMap<String, (Exit, usize)>,
    sweeps: OrphanSweeps,
    pub(super) health: Health,
    pub(super) renewal: Renewal,
    connections: ProxyConnections,
    input: OwnedFd,
    lines: Lines,
    output: OwnedFd,
    pub(super) out: Output,
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
            coming: Vec::new(),
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
                let (guard, out) = (&mut self.network_guard, &mut self.out);
                self.health.look_around(guard, &self.logs, out);
            }
            self.health.measure(now, &self.running, &mut self.out);
            if self.look.is_some_and(|at| now >= at) {
                self.read_logs();
            }
            self.report_ends();
            if let Err(error) = self.renew(cleanup) {
                break Ending::Alone(error.to_string());
            }
            self.network_guard.check(now);
            self.health.save(&mut self.network_guard, &mut self.out);
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
        for (process, running) in &self.running {
            for (name, component) in &running.components {
                if let Some(link) = component.link() {
                    let source = Source::Link(process.clone(), name.clone());
                    add(source, link.as_fd(), PollFlags::IN);
                }
            }
        }
        for (name, running) in &self.running {
            if let Some(process) = running.process() {
                let descriptor = process.descriptor().as_fd();
                add(Source::Process(name.clone()), descriptor, PollFlags::IN);
            }
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
                Some(GuardChange::Lost(text)) => {
                    self.health.begin(&mut self.out, "guard-lost", text);
                }
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
            Source::Link(process, name) => self.read_link(process, name),
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
                    after,
                    more,
                }) => {
                    // With one too many, the start is refused.
                    if self.coming.len() <= MOST_THREADS {
                        self.coming.push(Starting {
                            component,
                            greeting,
                            after,
                        });
                    }
                    if !more {
                        let components = std::mem::take(&mut self.coming);
                        self.start(Start { run, components });
                    }
                }
                Some(SupervisorMessage::LinkLine { name, line }) => {
                    let mut running = self.running.values();
                    let component = running.find_map(|running| running.components.get(&name));
                    component.inspect(|component| component.send_line(&line));
                }
                Some(SupervisorMessage::Stop(name)) => match self.process(&name) {
                    Some(process) => process.terminate(),
                    None => self.cancel(&name),
                },
                Some(SupervisorMessage::Kill(name)) => match self.process(&name) {
                    Some(process) => process.kill(),
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

    fn process(&self, name: &str) -> Option<&LocalProcess> {
        self.running.get(name).and_then(Running::process)
    }

    fn read_link(&mut self, process: &str, name: &str) {
        let running = self.running.get_mut(process);
        let Some(component) = running.and_then(|running| running.components.get_mut(name)) else {
            return;
        };
        let lines = component.read_link();
        let closed = component.link().is_none();
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
        let Some(mut running) = self.running.remove(name) else {
            return;
        };
        let mut exit = Exit::without_status("unknown".to_owned());
        for (component, process) in &mut running.components {
            let words = process.remaining_lines();
            self.forward_lines(component, words);
            exit = process.reap();
            // Its last output belongs to the report of its end.
            self.send_output(component);
        }
        self.send_output(name);
        self.network_guard.ended(name, true);
        let run = running.run;
        // Its end is reported when it may restart.
        self.ended.insert(name.to_owned(), (exit, 0));
        self.sweeps.begin(name, self.network_guard.mark(), run);
    }

    /// Reports processes that have ended, once their orphans are killed and the guard has cleaned
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
        // While the services are created again, starts wait here.
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
                "rcdeploy agent of {}: the supervisor has ended ({why}); components left: {}",
                self.network,
                names.join(", ")
            ));
        }
        // A component that ignores the signal sees the end of its link.
        for process in self.running.values().filter_map(Running::process) {
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
