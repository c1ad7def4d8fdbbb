//! One component: its process, its link, its limits. It knows nothing of the others.

use crate::events::{Event, Severity};
use crate::held::HeldComponent;
use crate::lines::{Line, Lines, Overlong};
use crate::link::{self, HEARTBEAT_LIMIT, Message};
use crate::logs;
use crate::plan::Component;
use crate::process::{self, COMPONENT, Identity, KILL_LIMIT, MARK, Mark, kill_group};
use crate::realtime;
use crate::report::Reporter;
use crate::restart::{Next, Restarts};
use crate::restore::Changes;
use crate::status::{ComponentStatus, State};
use crate::watch::{self, Watch};
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open};
use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// How long after its link a process may end before the closed link is an event of its own.
const CLOSED_LIMIT: Duration = Duration::from_secs(1);

/// How many reads of the link are made after the process has ended.
const LAST_READS: usize = 16;

/// A component of the plan, and what has become of it.
#[derive(Debug)]
pub(crate) struct Unit {
    pub(crate) component: Component,
    pub(crate) log: PathBuf,
    phase: Phase,
    /// Has it been ready since its last start? It stays so when it ends, and others that need it may start.
    ready: bool,
    reported: Option<State>,
    /// How many values its slots have lost, as it said last.
    lost: BTreeMap<String, u64>,
    hung: bool,
    /// When it was last heard of, or became ready.
    heard: Instant,
    garbage: bool,
    /// What goes wrong in this run.
    watch: Watch,
    restarts: Restarts,
    /// How often it was started, also by a command.
    runs: u32,
    /// When it may be started again.
    due: Option<Instant>,
    /// A command has stopped it: it stays so until it is released.
    stopped: bool,
    /// A command has started it: its failures are no longer those of the network's start.
    released: bool,
    /// What was changed in it and not saved.
    changes: Changes,
    /// What of that its present run could not be told.
    unkept: Option<String>,
}

#[derive(Debug)]
enum Phase {
    Waiting,
    Alive(Running),
    Ended(End),
}

#[derive(Debug)]
struct Running {
    child: Child,
    pid: Pid,
    pidfd: OwnedFd,
    identity: Identity,
    link: Option<UnixStream>,
    /// When it is told that its link is closed, unless it has ended by then: a process that is killed closes its files
    /// a moment before its end is known.
    closed: Option<Instant>,
    lines: Lines,
    started: Instant,
    stop: Stop,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stop {
    No,
    /// SIGTERM was sent; SIGKILL follows then.
    Asked(Instant),
    /// SIGKILL was sent; it is given up then.
    Killed(Instant),
}

/// How a component ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct End {
    /// It is as it should be.
    pub(crate) done: bool,
    /// `exit status: 1`, `signal 11 (SIGSEGV)`.
    pub(crate) text: String,
    /// How long it ran.
    pub(crate) ran: Duration,
    /// It did not end, and is given up.
    lost: bool,
}

/// What the passing of time did to a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Overdue {
    Nothing,
    /// It is not ready within its limit.
    NotReady,
    /// It did not even end by SIGKILL.
    NotKilled,
}

impl Unit {
    pub(crate) fn new(component: Component, log: PathBuf) -> Self {
        Self {
            restarts: Restarts::new(component.restart),
            runs: 0,
            due: None,
            stopped: false,
            released: false,
            changes: Changes::default(),
            unkept: None,
            component,
            log,
            phase: Phase::Waiting,
            ready: false,
            reported: None,
            lost: BTreeMap::new(),
            hung: false,
            heard: Instant::now(),
            garbage: false,
            watch: Watch::default(),
        }
    }

    pub(crate) fn name(&self) -> &str {
        &self.component.name
    }

    pub(crate) fn is_waiting(&self) -> bool {
        matches!(self.phase, Phase::Waiting)
    }

    /// Whether it may be started as far as its own clock says.
    pub(crate) fn is_due(&self) -> bool {
        self.is_waiting() && self.due.is_none() && !self.stopped
    }

    /// Whether it has run before, or was started by a command.
    pub(crate) fn is_restarted(&self) -> bool {
        self.restarts.count() > 0 || self.released
    }

    /// Whether a command has stopped it, or is about to.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Whether those that need it may start: it is ready, or will not be by itself.
    pub(crate) fn lets_others_start(&self) -> bool {
        self.ready || self.stopped || matches!(self.phase, Phase::Ended(_))
    }

    /// Whether it did not even end by SIGKILL.
    pub(crate) fn is_lost(&self) -> bool {
        matches!(&self.phase, Phase::Ended(end) if end.lost)
    }

    /// How it ended.
    pub(crate) fn end_text(&self) -> Option<&str> {
        match &self.phase {
            Phase::Ended(end) => Some(&end.text),
            _ => None,
        }
    }

    /// Ends it, or keeps it from being started, until it is released.
    pub(crate) fn hold(&mut self) {
        self.stopped = true;
        self.due = None;
        self.ask_to_stop();
    }

    /// Its next run begins with what its configuration says.
    pub(crate) fn forget_changes(&mut self) {
        self.changes = Changes::default();
    }

    /// What does not run is started as if for the first time, but on its own account.
    pub(crate) fn release(&mut self) {
        self.stopped = false;
        if !self.is_alive() {
            self.phase = Phase::Waiting;
            self.ready = false;
            self.due = None;
            self.released = true;
            self.restarts.begin_anew();
        }
    }

    pub(crate) fn is_alive(&self) -> bool {
        matches!(self.phase, Phase::Alive(_))
    }

    /// Whether it has reported ready since its last start.
    pub(crate) fn is_ready(&self) -> bool {
        self.ready
    }

    pub(crate) fn is_asked_to_stop(&self) -> bool {
        matches!(&self.phase, Phase::Alive(running) if running.stop != Stop::No)
    }

    /// The process, for those that keep account of it.
    pub(crate) fn held(&self) -> Option<HeldComponent> {
        let Phase::Alive(running) = &self.phase else {
            return None;
        };
        Some(HeldComponent {
            name: self.name().to_owned(),
            process: running.identity,
            stop_ms: self.component.stop.as_millis() as u64,
        })
    }

    /// Becomes readable when the process ends.
    pub(crate) fn process(&self) -> Option<&OwnedFd> {
        match &self.phase {
            Phase::Alive(running) => Some(&running.pidfd),
            _ => None,
        }
    }

    /// What the component speaks over.
    pub(crate) fn link(&self) -> Option<&UnixStream> {
        match &self.phase {
            Phase::Alive(running) => running.link.as_ref(),
            _ => None,
        }
    }

    /// Its name, and which of its runs this is.
    pub(crate) fn run(&self) -> String {
        format!("{}/{}", self.name(), self.runs)
    }

    /// Starts the process.
    pub(crate) fn start(&mut self, mark: &Mark) -> Result<(), String> {
        self.runs += 1;
        let component = &self.component;
        let refused = |what: String, error: io::Error| format!("cannot {what}: {error}");
        let log = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&self.log)
            .map_err(|e| refused(format!("open {}", self.log.display()), e))?;
        let also_log = log
            .try_clone()
            .map_err(|e| refused("share its log".to_owned(), e))?;
        let (link, theirs) =
            UnixStream::pair().map_err(|e| refused("make its link".to_owned(), e))?;
        link.set_nonblocking(true)
            .map_err(|e| refused("set up its link".to_owned(), e))?;
        if let Some(line) = self.changes.line() {
            (&link)
                .write_all(line.as_bytes())
                .map_err(|e| refused("hand over its changed parameters".to_owned(), e))?;
        }
        // A wrong folder and a wrong program are the same error to the system.
        if !component.directory.is_dir() {
            return Err(format!(
                "its working directory {} does not exist",
                component.directory.display()
            ));
        }
        let mut command = Command::new(&component.executable);
        command
            .args(&component.args)
            .envs(&component.env)
            .env("RC_SUPERVISED", "1")
            .env(MARK, mark.value())
            .env(COMPONENT, self.run())
            .current_dir(&component.directory)
            .process_group(0)
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(Stdio::from(log))
            .stderr(Stdio::from(also_log));
        let mut child = realtime::spawn(&mut command, &component.cpu, component.priority)?;
        // It still holds the component's end of the link.
        drop(command);
        let pid = Pid::from_child(&child);
        let pidfd = match pidfd_open(pid, PidfdFlags::empty()) {
            Ok(pidfd) => pidfd,
            Err(error) => {
                kill_group(pid);
                let _ = child.wait();
                return Err(refused("watch its process".to_owned(), error.into()));
            }
        };
        let raw = pid.as_raw_nonzero().get();
        // It may have ended already: then its time of start does not matter any more.
        let identity = Identity::of(raw).unwrap_or(Identity {
            pid: raw,
            starttime: 0,
        });
        let now = Instant::now();
        self.heard = now;
        self.reported = None;
        self.lost.clear();
        self.unkept = self.changes.lost();
        self.hung = false;
        self.garbage = false;
        self.watch = Watch::default();
        self.phase = Phase::Alive(Running {
            child,
            pid,
            pidfd,
            identity,
            link: Some(link),
            closed: None,
            lines: Lines::new(Overlong::Skip),
            started: now,
            stop: Stop::No,
        });
        Ok(())
    }

    /// Takes one read from the link.
    pub(crate) fn read_link(&mut self, report: &Reporter) {
        let Phase::Alive(running) = &mut self.phase else {
            return;
        };
        let Some(link) = &running.link else { return };
        let (lines, closed) = running.lines.read(link);
        if closed {
            running.link = None;
            running.closed = Some(Instant::now() + CLOSED_LIMIT);
        }
        for line in lines {
            let message = match line {
                Line::Text(text) => link::parse(&text),
                Line::TooLong => Err("a line of more than 64 KiB".to_owned()),
            };
            match message {
                Ok(message) => self.take(message, report),
                Err(fault) => self.reject(&fault, report),
            }
        }
    }

    /// A component that closes its link while it runs cannot be watched.
    fn report_closed_link(&self, report: &Reporter) {
        if self.is_alive() && self.link().is_none() && !self.is_asked_to_stop() {
            self.event(
                report,
                Severity::Warning,
                "link-closed",
                "closed its standard input, which is the link to its supervisor; it is no longer watched",
            );
        }
    }

    fn take(&mut self, message: Message, report: &Reporter) {
        let Phase::Alive(running) = &self.phase else {
            return;
        };
        match message {
            Message::State(state) => {
                if self.reported == Some(state) {
                    return;
                }
                self.reported = Some(state);
                let severity = match state {
                    State::Emergency => Severity::Warning,
                    _ => Severity::Info,
                };
                self.event(report, severity, "state", state.to_string());
            }
            Message::Ready => {
                self.heard = Instant::now();
                if !self.ready {
                    self.ready = true;
                    let seconds = running.started.elapsed().as_secs_f64();
                    let text = format!("ready after {seconds:.2} s");
                    self.event(report, Severity::Info, "ready", text);
                    if let Some(text) = self.unkept.take() {
                        self.event(report, Severity::Warning, "not-restored", text);
                    }
                }
            }
            Message::Parameters { changed, unkept } => {
                self.changes = Changes::new(changed, unkept);
            }
            Message::Restored(Ok(())) => {
                let text = self.changes.restored();
                self.event(report, Severity::Info, "restored", text);
            }
            Message::Restored(Err(why)) => {
                let text = format!(
                    "runs with its configuration; changed parameters were not restored: {why}"
                );
                self.event(report, Severity::Warning, "not-restored", text);
                self.forget_changes();
            }
            Message::Heartbeat(mut beat) => {
                self.heard = Instant::now();
                self.lost = std::mem::take(&mut beat.lost);
                let age = beat.age;
                if !self.is_asked_to_stop() {
                    for (severity, code, text) in self.watch.beat(beat) {
                        self.event(report, severity, code, text);
                    }
                }
                if age <= HEARTBEAT_LIMIT {
                    if std::mem::take(&mut self.hung) {
                        self.event(
                            report,
                            Severity::Info,
                            "answers-again",
                            "its loop turns again",
                        );
                    }
                } else if self.ready {
                    self.hang(
                        report,
                        &format!("its loop has not turned for {} ms", age.as_millis()),
                    );
                }
            }
        }
    }

    /// The network ends: what goes wrong from now on is no news.
    pub(crate) fn be_quiet(&mut self) {
        self.watch.be_quiet();
    }

    /// Looks how much memory the process has, `pause` after the last time.
    pub(crate) fn measure(&mut self, pause: Duration, report: &Reporter) {
        let Phase::Alive(running) = &self.phase else {
            return;
        };
        if self.ready
            && let Some(bytes) = watch::resident(running.identity.pid)
            && let Some((severity, code, text)) = self.watch.memory(bytes, pause)
        {
            self.event(report, severity, code, text);
        }
    }

    fn reject(&mut self, fault: &str, report: &Reporter) {
        if !std::mem::replace(&mut self.garbage, true) {
            let text = format!("sent {fault} to its supervisor; further faults are not reported");
            self.event(report, Severity::Warning, "garbage", text);
        }
    }

    fn hang(&mut self, report: &Reporter, why: &str) {
        if !self.hung && !self.is_asked_to_stop() {
            self.hung = true;
            self.event(report, Severity::Warning, "hung", why);
        }
    }

    /// Asks the process to end.
    pub(crate) fn ask_to_stop(&mut self) {
        if let Phase::Alive(running) = &mut self.phase
            && running.stop == Stop::No
        {
            process::signal(&running.pidfd, Signal::TERM);
            running.stop = Stop::Asked(Instant::now() + self.component.stop);
        }
    }

    /// Ends the process and its group.
    pub(crate) fn kill(&mut self) {
        if let Phase::Alive(running) = &mut self.phase
            && !matches!(running.stop, Stop::Killed(_))
        {
            // The process is not reaped yet, so the number is still its own.
            kill_group(running.pid);
            process::signal(&running.pidfd, Signal::KILL);
            running.stop = Stop::Killed(Instant::now() + KILL_LIMIT);
        }
    }

    /// The process has ended: takes its last words, kills what is left of its group, and reaps it.
    pub(crate) fn end(&mut self, report: &Reporter) -> Option<End> {
        for _ in 0..LAST_READS {
            if self.link().is_none() {
                break;
            }
            self.read_link(report);
        }
        let Phase::Alive(running) = &mut self.phase else {
            return None;
        };
        // Before it is reaped: until then nobody else can get its pid as the number of a group.
        kill_group(running.pid);
        let asked = running.stop != Stop::No;
        let ran = running.started.elapsed();
        let end = match running.child.wait() {
            Ok(status) => End {
                done: status.success() || (asked && status.signal() == Some(Signal::TERM.as_raw())),
                text: describe(status),
                ran,
                lost: false,
            },
            Err(error) => End {
                done: false,
                text: error.to_string(),
                ran,
                lost: false,
            },
        };
        self.phase = Phase::Ended(end.clone());
        Some(end)
    }

    /// What follows an end that was not asked for, after a run of this length. It waits for its start, where there is
    /// to be one.
    pub(crate) fn follow(&mut self, ran: Duration, failed: bool) -> Next {
        let now = Instant::now();
        let next = self.restarts.after(failed, ran, now);
        match next {
            Next::Again(pause) => {
                self.phase = Phase::Waiting;
                self.ready = false;
                self.due = Some(now + pause);
            }
            Next::Nothing | Next::GiveUp(_) if self.is_waiting() => {
                self.phase = Phase::Ended(End {
                    done: false,
                    text: "could not be started".to_owned(),
                    ran,
                    lost: false,
                });
            }
            Next::Nothing | Next::GiveUp(_) => {
                // One that was asked to end because it did not get ready may have ended well.
                if let Phase::Ended(end) = &mut self.phase {
                    end.done &= !failed;
                }
            }
        }
        next
    }

    /// When the passing of time next matters.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let Phase::Alive(running) = &self.phase else {
            return self.due;
        };
        let limit = match running.stop {
            Stop::Asked(at) | Stop::Killed(at) => Some(at),
            Stop::No if !self.ready => Some(running.started + self.component.ready),
            Stop::No => self.silence(),
        };
        limit.into_iter().chain(running.closed).min()
    }

    /// When it will have been silent for too long.
    fn silence(&self) -> Option<Instant> {
        (!self.hung && self.link().is_some()).then(|| self.heard + HEARTBEAT_LIMIT)
    }

    /// Looks at the clock.
    pub(crate) fn check(&mut self, now: Instant, report: &Reporter) -> Overdue {
        if self.deadline().is_none_or(|deadline| now < deadline) {
            return Overdue::Nothing;
        }
        if let Phase::Alive(running) = &mut self.phase
            && running.closed.take_if(|at| now >= *at).is_some()
        {
            self.report_closed_link(report);
            return Overdue::Nothing;
        }
        let Phase::Alive(running) = &self.phase else {
            self.due = None;
            return Overdue::Nothing;
        };
        match running.stop {
            Stop::Asked(_) => {
                let limit = self.component.stop;
                let text = format!("did not end within {limit:?} and is killed");
                self.event(report, Severity::Warning, "killed", text);
                self.kill();
                Overdue::Nothing
            }
            Stop::Killed(_) => {
                let text = format!("process {} does not even end by SIGKILL", self.pid_text());
                self.event(report, Severity::Error, "not-killed", text.clone());
                let ran = running.started.elapsed();
                self.phase = Phase::Ended(End {
                    done: false,
                    text,
                    ran,
                    lost: true,
                });
                Overdue::NotKilled
            }
            Stop::No if !self.ready => Overdue::NotReady,
            Stop::No => {
                let text = format!("has not sent a heartbeat for {HEARTBEAT_LIMIT:?}");
                self.hang(report, &text);
                Overdue::Nothing
            }
        }
    }

    fn pid_text(&self) -> String {
        self.held()
            .map_or_else(String::new, |held| held.process.pid.to_string())
    }

    /// Reports something about this component.
    pub(crate) fn event(
        &self,
        report: &Reporter,
        severity: Severity,
        code: &'static str,
        message: impl Into<String>,
    ) {
        report.event(Event::component(self.name(), severity, code, message));
    }

    /// A failure with what the component printed last.
    pub(crate) fn failure(&self, reason: &str) -> String {
        format!("{reason}; {}", logs::quote(&self.log))
    }

    pub(crate) fn status(&self) -> ComponentStatus {
        let running = match &self.phase {
            Phase::Alive(running) => Some(running),
            _ => None,
        };
        ComponentStatus {
            name: self.name().to_owned(),
            state: self.state(),
            pid: running.map(|r| r.identity.pid),
            uptime_s: running.map(|r| (r.started.elapsed().as_secs_f64() * 1e3).round() / 1e3),
            ready: self.ready && running.is_some(),
            middleware: self.component.middleware.clone(),
            cpu: self.component.cpu.clone(),
            priority: self.component.priority,
            executable: self.component.executable.clone(),
            log: self.log.clone(),
            restarts: self.restarts.count(),
            ready_ms: self.component.ready.as_millis() as u64,
            stop_ms: self.component.stop.as_millis() as u64,
            lost: self.lost.clone(),
            troubles: running.map_or_else(Vec::new, |_| self.watch.troubles()),
            exit: match &self.phase {
                Phase::Ended(end) => Some(end.text.clone()),
                _ => None,
            },
        }
    }

    fn state(&self) -> State {
        match &self.phase {
            Phase::Waiting | Phase::Ended(_) if self.stopped => State::Stopped,
            Phase::Waiting => State::Waiting,
            Phase::Ended(end) if end.done => State::Done,
            Phase::Ended(_) => State::Failed,
            Phase::Alive(running) if running.stop != Stop::No => State::Stopping,
            Phase::Alive(_) if self.hung => State::Hung,
            Phase::Alive(_) if self.ready => self.reported.unwrap_or(State::Running),
            Phase::Alive(_) => State::Starting,
        }
    }
}

/// `exit status 1`, `signal 11 (SIGSEGV)`.
fn describe(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit status {code}"),
        (None, Some(signal)) if signal == Signal::BUS.as_raw() => {
            format!("signal {signal} (SIGBUS){}", shared_memory())
        }
        (None, Some(signal)) => match signal_hook::low_level::signal_name(signal) {
            Some(name) => format!("signal {signal} ({name})"),
            None => format!("signal {signal}"),
        },
        (None, None) => status.to_string(),
    }
}

/// What to do about a process that has met the end of the shared memory: the system has no other way to say so.
fn shared_memory() -> String {
    const PLACE: &str = "/dev/shm";
    let Ok(disk) = rustix::fs::statvfs(PLACE) else {
        return String::new();
    };
    let [all, free] = [disk.f_blocks, disk.f_bavail].map(|n| n * disk.f_frsize / 1000);
    format!(
        ", which is what happens where the shared memory is full: {PLACE} has {all} kB, of which {free} kB are free now; \
         `mount -o remount,size=1G {PLACE}` makes it larger, `--shm-size=1g` that of a container"
    )
}

/// The time until `deadline`, for a `poll`.
pub(crate) fn until(deadline: Option<Instant>) -> Option<Duration> {
    deadline.map(|at| at.saturating_duration_since(Instant::now()))
}
