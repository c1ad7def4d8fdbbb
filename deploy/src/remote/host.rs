//! Another machine, as the supervisor sees it: connection, loss of the connection, reconnection.

use super::SupervisorMessage;
use super::complaint;
use super::connection::{AgentProgram, AgentReady, Setup, SetupThread, described};
use super::copies::mirrored;
use super::remote_process::Outbox;
use super::socket_proxy::{Accepted, Received, SocketProxy};
use super::{BEAT, HOST_LIMIT, SET_UP_LIMIT, ssh};
use crate::process::identity::{Mark, first_readable, kill_group};
use crate::process::own_program::OWN;
use rc_deploy_network::plan::Restart;
use rc_deploy_network::plan::{self, Component};
use rc_management::agent::{AgentMessage, LONGEST};
use rc_management::lines::{Line, Lines, Overlong};
use rustix::event::PollFlags;
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use std::fs;
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

/// The pause before the first reconnection. It doubles up to [`Restart::LONGEST_PAUSE`].
const FIRST_PAUSE: Duration = Duration::from_secs(1);
/// How long an agent may take to clean up.
const FAREWELL_LIMIT: Duration = Duration::from_secs(10);
/// How many reads one machine gets in one iteration of the event loop.
const READS: usize = 16;
/// How long ssh may take to report why the connection has ended.
const SETTLE_LIMIT: Duration = Duration::from_millis(300);
/// How much of the error output of ssh is shown.
const COMPLAINT: usize = 2000;

/// Event of a host.
#[derive(Debug)]
pub(crate) enum HostEvent {
    /// Its agent is ready.
    Connected(AgentReady),
    /// The attempt to connect failed.
    Unreachable(String),
    /// The connection has ended.
    Lost(String),
    /// A message of the agent.
    Message(AgentMessage),
}

/// A descriptor of a host.
#[derive(Clone, Copy, Debug)]
pub(crate) enum HostSource {
    /// The connection.
    Link,
    /// A socket of a remote component, or a caller of it.
    Socket(u64),
}

#[derive(Debug)]
enum Link {
    /// Not connected. The next attempt is at this time.
    None(Instant),
    SettingUp(Ssh, SetupThread),
    There(Ssh, Lines),
    /// Disconnected for good.
    Over,
}

#[derive(Debug)]
struct Ssh {
    child: Child,
    stream: UnixStream,
}

impl Ssh {
    /// Waits until ssh has reported why the connection ended.
    fn settle(&self) {
        if let Ok(process) = pidfd_open(Pid::from_child(&self.child), PidfdFlags::empty()) {
            first_readable([&process], SETTLE_LIMIT);
        }
    }
}

/// Kills ssh if it still runs, and reaps it.
impl Drop for Ssh {
    fn drop(&mut self) {
        kill_group(Pid::from_child(&self.child));
        let _ = self.child.wait();
    }
}

/// A machine of the network.
#[derive(Debug)]
pub(crate) struct Host {
    pub(crate) plan: plan::Host,
    pub(crate) outbox: Outbox,
    setup: Setup,
    /// Standard error of ssh and of the agent.
    pub(crate) log: PathBuf,
    /// The position in the log where the errors of this attempt begin.
    complaints: u64,
    link: Link,
    /// When the present attempt began.
    began: Instant,
    sockets: SocketProxy,
    /// When its last message came.
    heard: Instant,
    next_beat: Instant,
    pause: Duration,
    /// The deadline of its farewell.
    leaves: Option<Instant>,
    /// The folder of the copies there.
    root: PathBuf,
    was_connected: bool,
}

impl Host {
    /// A machine that is connected at the next check.
    pub(crate) fn new(host: plan::Host, setup: Setup, log: PathBuf) -> Self {
        let now = Instant::now();
        Self {
            plan: host,
            outbox: Outbox::new(),
            setup,
            log,
            complaints: 0,
            link: Link::None(now),
            began: now,
            sockets: SocketProxy::default(),
            heard: now,
            next_beat: now,
            pause: FIRST_PAUSE,
            leaves: None,
            root: PathBuf::new(),
            was_connected: false,
        }
    }

    /// Connects it without an agent, whose part the test takes.
    #[cfg(test)]
    pub(crate) fn pretend(&mut self) {
        let (stream, _) = UnixStream::pair().expect("a pair");
        let child = std::process::Command::new("true").spawn().expect("it runs");
        let lines = Lines::up_to(LONGEST, Overlong::Skip);
        self.link = Link::There(Ssh { child, stream }, lines);
        self.was_connected = true;
    }

    /// Destination as in `ssh DESTINATION`.
    pub(crate) fn destination(&self) -> String {
        ssh::destination(&self.plan)
    }

    /// Whether it is connected.
    pub(crate) fn is_there(&self) -> bool {
        matches!(self.link, Link::There(..)) && self.leaves.is_none()
    }

    /// Whether it was connected before.
    pub(crate) fn was_connected(&self) -> bool {
        self.was_connected
    }

    /// The component with the paths of that machine.
    pub(crate) fn component(&self, component: &Component) -> Component {
        let there = |path: &Path| mirrored(&self.root, path);
        let argument = |text: &String| {
            let path = Path::new(text);
            if component.files.iter().any(|file| file == path) {
                there(path).to_string_lossy().into_owned()
            } else {
                text.clone()
            }
        };
        Component {
            executable: there(&component.executable),
            directory: match &self.plan.workspace {
                Some(workspace) => workspace.clone(),
                None => there(&component.directory),
            },
            args: component.args.iter().map(argument).collect(),
            // The agent does not need these.
            files: Vec::new(),
            venv: None,
            after: Vec::new(),
            ..component.clone()
        }
    }

    /// The descriptors to wait for: the connection, sockets of components and their callers.
    pub(crate) fn descriptors(
        &self,
    ) -> impl Iterator<Item = (HostSource, BorrowedFd<'_>, PollFlags)> {
        let link = self.descriptor();
        let link = link.map(|(descriptor, flags)| (HostSource::Link, descriptor, flags));
        let sockets = self.sockets.descriptors(self.outbox.has_room());
        let sockets = sockets
            .map(|(number, descriptor, flags)| (HostSource::Socket(number), descriptor, flags));
        link.into_iter().chain(sockets)
    }

    fn descriptor(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        match &self.link {
            Link::SettingUp(_, setup) => Some((setup.over.as_fd(), PollFlags::IN)),
            Link::There(ssh, _) => {
                let flags = if self.outbox.0.borrow().is_empty() {
                    PollFlags::IN
                } else {
                    PollFlags::IN | PollFlags::OUT
                };
                Some((ssh.stream.as_fd(), flags))
            }
            Link::None(_) | Link::Over => None,
        }
    }

    /// The next deadline.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        match &self.link {
            Link::None(at) => Some(*at),
            Link::There(..) => {
                let limit = self.heard + HOST_LIMIT;
                let pause = self.sockets.deadline().unwrap_or(limit);
                let leaves = self.leaves.unwrap_or(limit);
                Some(limit.min(leaves).min(self.next_beat).min(pause))
            }
            Link::SettingUp(..) => Some(self.began + SET_UP_LIMIT),
            Link::Over => None,
        }
    }

    /// Handles deadlines: connects, sends heartbeats, and detects a lost connection.
    pub(crate) fn check(&mut self, now: Instant, mark: &Mark) -> Option<HostEvent> {
        self.sockets.resume(now);
        match &self.link {
            Link::None(at) if now >= *at => {
                let connected = self.connect(mark);
                connected.err().map(|why| self.failed(now, &why))
            }
            Link::SettingUp(..) if now >= self.began + SET_UP_LIMIT => {
                self.link = Link::Over;
                let why = format!("it did not connect within {SET_UP_LIMIT:?}");
                Some(self.failed(now, &why))
            }
            Link::There(..) => {
                if self.leaves.is_some_and(|limit| now >= limit) {
                    return Some(self.lose(now, "its agent does not end"));
                }
                if now >= self.heard + HOST_LIMIT {
                    let why = format!("no message came from it for {HOST_LIMIT:?}");
                    return Some(self.lose(now, &why));
                }
                if now >= self.next_beat {
                    self.outbox.push(&SupervisorMessage::Heartbeat);
                    self.next_beat = now + BEAT;
                }
                self.write(now)
            }
            Link::None(_) | Link::SettingUp(..) | Link::Over => None,
        }
    }

    fn connect(&mut self, mark: &Mark) -> Result<(), String> {
        let system = |error: io::Error| error.to_string();
        let log = fs::File::options()
            .create(true)
            .append(true)
            .open(&self.log);
        let log = log.map_err(|e| format!("cannot open {}: {e}", self.log.display()))?;
        self.complaints = log.metadata().map_err(system)?.len();
        let elsewhere = self.plan.elsewhere.as_ref();
        let from = elsewhere.and_then(|elsewhere| elsewhere.program.clone());
        let from = from.unwrap_or_else(|| PathBuf::from(OWN));
        let program = described(&from);
        let program = program.map_err(|e| format!("cannot read {}: {e}", from.display()))?;
        let script = ssh::script(&program.hash, program.size, elsewhere.is_some());
        let (child, stream) = ssh::start(&self.plan, &script, log, mark)?;
        let ssh = Ssh { child, stream };
        ssh.stream.set_nonblocking(true).map_err(system)?;
        let stream = OwnedFd::from(ssh.stream.try_clone().map_err(system)?);
        let agent = AgentProgram {
            from,
            program,
            elsewhere: elsewhere.cloned(),
        };
        let setup = SetupThread::start(stream, agent, self.setup.clone());
        self.link = Link::SettingUp(ssh, setup.map_err(system)?);
        self.began = Instant::now();
        Ok(())
    }

    /// Makes the management socket of a component available at `path`.
    pub(crate) fn listen(&mut self, component: &str, path: &Path) -> io::Result<()> {
        self.sockets.listen(component, path)
    }

    /// Closes the management socket of a component that has ended.
    pub(crate) fn close(&mut self, component: &str) {
        self.sockets.close(component);
    }

    /// Forwards what callers of components send.
    pub(crate) fn turn_socket(&mut self, number: u64) {
        if let Some(accepted) = self.sockets.accept(number) {
            let Accepted {
                wire,
                component: name,
                dropped,
            } = accepted;
            if let Some(dropped) = dropped {
                self.outbox.push(&SupervisorMessage::Close(dropped));
            }
            self.outbox.push(&SupervisorMessage::Connect { wire, name });
            return;
        }
        let room = self.outbox.has_room();
        if let Some(Received { text, there }) = self.sockets.connections.turn(number, room) {
            let wire = number;
            if !text.is_empty() {
                self.outbox.push(&SupervisorMessage::Data { wire, text });
            }
            if !there {
                self.outbox.push(&SupervisorMessage::Close(wire));
            }
        }
    }

    /// Reads and writes.
    pub(crate) fn turn(&mut self, now: Instant) -> Vec<HostEvent> {
        match std::mem::replace(&mut self.link, Link::Over) {
            Link::SettingUp(ssh, setup) => vec![match setup.result() {
                Ok(began) => {
                    self.outbox.0.borrow_mut().clear();
                    self.link = Link::There(ssh, Lines::up_to(LONGEST, Overlong::Skip));
                    self.heard = now;
                    self.next_beat = now;
                    self.pause = FIRST_PAUSE;
                    let again = std::mem::replace(&mut self.was_connected, true);
                    self.root.clone_from(&began.root);
                    HostEvent::Connected(AgentReady { again, ..began })
                }
                Err(why) => {
                    ssh.settle();
                    let why = self.explain(ssh, &why);
                    self.failed(now, &why)
                }
            }],
            Link::There(ssh, lines) => {
                self.link = Link::There(ssh, lines);
                let mut events = self.read(now);
                events.extend(self.write(now));
                events
            }
            other @ (Link::None(_) | Link::Over) => {
                self.link = other;
                Vec::new()
            }
        }
    }

    fn read(&mut self, now: Instant) -> Vec<HostEvent> {
        let mut events = Vec::new();
        for _ in 0..READS {
            let Link::There(ssh, lines) = &mut self.link else {
                return events;
            };
            let (complete, ended) = lines.read(&ssh.stream);
            let none = complete.is_empty();
            for line in complete {
                let message = match &line {
                    Line::Complete(line) => serde_json::from_slice(line).ok(),
                    Line::TooLong => None,
                };
                self.heard = now;
                match message {
                    Some(AgentMessage::Heartbeat) => {}
                    Some(AgentMessage::Data { wire, text }) => {
                        if !self.sockets.connections.send(wire, &text) {
                            self.outbox.push(&SupervisorMessage::Close(wire));
                        }
                    }
                    Some(AgentMessage::Close(wire)) => self.sockets.connections.shut(wire),
                    Some(AgentMessage::Finished { left }) => {
                        self.link = Link::Over;
                        events.push(HostEvent::Message(AgentMessage::Finished { left }));
                        return events;
                    }
                    Some(message) => events.push(HostEvent::Message(message)),
                    None => {
                        events.push(self.lose(now, "its agent sent an unknown message"));
                        return events;
                    }
                }
            }
            if ended {
                ssh.settle();
                events.push(self.lose(now, "the connection has ended"));
                return events;
            }
            if none {
                break;
            }
        }
        events
    }

    /// Writes as much as the connection takes.
    pub(crate) fn write(&mut self, now: Instant) -> Option<HostEvent> {
        let Link::There(ssh, _) = &self.link else {
            return None;
        };
        let mut out = self.outbox.0.borrow_mut();
        let written = out.write(&ssh.stream);
        match written {
            Ok(()) => None,
            Err(error) if error.kind() == io::ErrorKind::OutOfMemory => {
                drop(out);
                Some(self.lose(now, &error.to_string()))
            }
            // The end of the connection is noticed when it is read.
            Err(_) => {
                out.clear();
                None
            }
        }
    }

    /// Disconnects: asks the agent to end, or stops connecting.
    pub(crate) fn leave(&mut self, now: Instant) {
        match &self.link {
            Link::There(..) if self.leaves.is_none() => {
                self.outbox.push(&SupervisorMessage::Farewell);
                self.leaves = Some(now + FAREWELL_LIMIT);
            }
            Link::There(..) => {}
            Link::None(_) | Link::SettingUp(..) | Link::Over => self.link = Link::Over,
        }
    }

    /// Whether it is disconnected for good.
    pub(crate) fn is_over(&self) -> bool {
        matches!(self.link, Link::Over)
    }

    fn failed(&mut self, now: Instant, why: &str) -> HostEvent {
        self.link = Link::None(now + self.pause);
        self.pause = (self.pause * 2).min(Restart::LONGEST_PAUSE);
        HostEvent::Unreachable(why.to_owned())
    }

    fn lose(&mut self, now: Instant, why: &str) -> HostEvent {
        let next = if self.leaves.is_some() {
            Link::Over
        } else {
            Link::None(now + self.pause)
        };
        let why = match std::mem::replace(&mut self.link, next) {
            Link::There(ssh, _) | Link::SettingUp(ssh, _) => self.explain(ssh, why),
            Link::None(_) | Link::Over => why.to_owned(),
        };
        self.outbox.0.borrow_mut().clear();
        self.sockets.clear();
        HostEvent::Lost(why)
    }

    /// An explanation of a failure, with the errors of ssh and of the other machine.
    fn explain(&self, ssh: Ssh, noticed: &str) -> String {
        drop(ssh);
        let log = fs::read(&self.log).unwrap_or_default();
        let start = usize::try_from(self.complaints).unwrap_or(0).min(log.len());
        let start = start.max(log.len().saturating_sub(COMPLAINT));
        let complaint = complaint::shown(&log[start..], COMPLAINT);
        ssh::explain(&self.plan, noticed, &complaint)
    }

    /// The time until the next attempt.
    pub(crate) fn next_attempt(&self, now: Instant) -> Duration {
        match self.link {
            Link::None(at) => at.saturating_duration_since(now),
            Link::SettingUp(..) | Link::There(..) | Link::Over => Duration::ZERO,
        }
    }
}
