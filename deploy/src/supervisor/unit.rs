//! One component: its process, its link, its limits. It knows nothing of the others.

mod deadlines;
mod status;

pub(super) use deadlines::HEARTBEAT_LIMIT;
pub(crate) use deadlines::Overdue;

use crate::guard::process_registry::RegisteredProcess;
use crate::log::reporter::Reporter;
use crate::process::identity::Mark;
use crate::process::launch::{LocalProcess, NewComponent};
use crate::process::memory::resident;
use crate::remote::{Outbox, RemoteProcess};
use crate::supervisor::followers::without_followers;
use crate::supervisor::health::HealthMonitor;
use crate::supervisor::lifecycle_control::LifecycleControl;
use crate::supervisor::parameter_changes::Changes;
use crate::supervisor::process_handle::ProcessHandle;
use crate::supervisor::proposal_answers::ProposalAnswers;
use crate::supervisor::restart::{Next, Restarts};
use rc_deploy_client::connection::KILL_LIMIT;
use rc_deploy_client::logs;
use rc_deploy_network::plan::Component;
use rc_management::agent::Exit;
use rc_management::component::{ConvertedStatus, ForwardedStatus, GroupStatus, State};
use rc_management::link::SupervisorMessage;
use rc_management::rpc;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::{Duration, Instant};

/// How long after its link a process may end. Later, the closed link is an event.
const CLOSED_LIMIT: Duration = Duration::from_secs(1);

/// How long a start counts for the number of starts at once. A start is work for the processor at
/// its beginning; a component that waits for a device afterwards keeps no other one from starting.
const START_SHARE: Duration = Duration::from_millis(250);

/// A component of the plan and its state.
#[derive(Debug)]
pub(crate) struct Unit {
    pub(crate) component: Component,
    pub(crate) log: PathBuf,
    /// The log of its process, if it is a thread of one: what its threads do not write themselves.
    pub(crate) process_log: Option<PathBuf>,
    /// The outbox of its host, and the component with the paths of that host, if it runs on another
    /// machine.
    pub(crate) outbox: Option<Outbox>,
    pub(crate) remote_component: Option<Component>,
    pub(super) phase: Phase,
    /// Whether it was ready since its last start. It stays so when it ends, so that dependents may
    /// start.
    pub(super) ready: bool,
    pub(super) reported: Option<State>,
    /// How many samples its slots have lost, from the last heartbeat.
    pub(super) lost: BTreeMap<String, u64>,
    /// The conversions of its slots, from the last heartbeat.
    pub(super) converted: BTreeMap<String, ConvertedStatus>,
    /// The forwarded messages of its slots, from the last heartbeat.
    pub(super) forwarded: BTreeMap<String, ForwardedStatus>,
    /// Since when its loop has not turned, or no heartbeat came, if it hangs.
    pub(super) hung: Option<Instant>,
    /// When the last heartbeat came, or it became ready.
    pub(super) heard: Instant,
    /// How many bytes of invalid lines it has sent.
    pub(super) garbage: usize,
    pub(super) health: HealthMonitor,
    pub(super) restarts: Restarts,
    /// How often it was started, including commands.
    pub(super) runs: u32,
    /// When it may be started again.
    pub(super) due: Option<Instant>,
    /// A command has stopped it. It stays stopped until a command starts it.
    pub(super) stopped: bool,
    /// A command has started it, so its failures do not stop the network.
    pub(super) released: bool,
    /// Unsaved parameter changes.
    pub(super) changes: Changes,
    /// The parameters that rules of the network read.
    pub(super) ruled: Vec<String>,
    pub(super) proposal: ProposalAnswers,
    /// Message about changes that could not be restored in this run.
    pub(super) unkept: Option<String>,
    /// Life cycle, if it is managed.
    pub(super) lifecycle: Option<LifecycleControl>,
    /// The state of its group that the process of a proxy knows.
    told: Option<GroupStatus>,
}

#[derive(Debug)]
pub(super) enum Phase {
    Waiting,
    Alive(Running),
    Ended(Termination),
}

#[derive(Debug)]
pub(super) struct Running {
    pub(super) handle: ProcessHandle,
    /// When the closed link is reported. A process that is killed closes its files a moment before
    /// its end is known.
    pub(super) closed: Option<Instant>,
    pub(super) started: Instant,
    stopping: Rc<Stopping>,
}

/// How far a process has been stopped. Its threads share it while they run.
#[derive(Debug)]
struct Stopping {
    stop: Cell<Stop>,
    /// The limit for its end after SIGTERM.
    limit: Duration,
}

impl Running {
    pub(super) fn stop(&self) -> Stop {
        self.stopping.stop.get()
    }

    /// Whether other threads of its process run.
    fn has_mates(&self) -> bool {
        Rc::strong_count(&self.stopping) > 1
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    No,
    /// SIGTERM was sent. SIGKILL follows at this time.
    Asked(Instant),
    /// SIGKILL was sent. The process is given up at this time.
    Killed(Instant),
}

/// How a component ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Termination {
    /// Whether the end counts as success.
    pub(crate) done: bool,
    /// `exit status: 1`, `signal 11 (SIGSEGV)`.
    pub(crate) text: String,
    /// How long it ran.
    pub(crate) ran: Duration,
    /// Whether the process did not end and was given up.
    lost: bool,
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
            ruled: Vec::new(),
            proposal: ProposalAnswers::default(),
            unkept: None,
            lifecycle: component.managed.then(LifecycleControl::new),
            told: None,
            process_log: component.thread.as_ref().map(|thread| {
                let folder = log.parent().unwrap_or(Path::new(""));
                logs::file(folder, &thread.process)
            }),
            component,
            log,
            outbox: None,
            remote_component: None,
            phase: Phase::Waiting,
            ready: false,
            reported: None,
            lost: BTreeMap::new(),
            converted: BTreeMap::new(),
            forwarded: BTreeMap::new(),
            hung: None,
            heard: Instant::now(),
            garbage: 0,
            health: HealthMonitor::default(),
        }
    }

    pub(crate) fn name(&self) -> &str {
        &self.component.name
    }

    /// Name of its process, which is its own unless it is a thread of one.
    pub(crate) fn process_name(&self) -> &str {
        self.component.process()
    }

    /// Its log and that of its process, with names.
    pub(crate) fn logs(&self) -> impl Iterator<Item = (&str, &Path)> {
        let process = self.process_log.as_deref();
        let process = process.map(|log| (self.process_name(), log));
        std::iter::once((self.name(), &*self.log)).chain(process)
    }

    pub(crate) fn is_waiting(&self) -> bool {
        matches!(self.phase, Phase::Waiting)
    }

    /// Whether no pause and no command holds its start back.
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

    /// Whether its dependents may start: it is ready, or will not become ready by itself.
    pub(crate) fn lets_others_start(&self) -> bool {
        self.ready || self.is_gone()
    }

    /// Whether it has ended for good, or a command has stopped it.
    pub(crate) fn is_gone(&self) -> bool {
        self.stopped || matches!(self.phase, Phase::Ended(_))
    }

    /// Whether it did not end after SIGKILL.
    pub(crate) fn is_lost(&self) -> bool {
        matches!(&self.phase, Phase::Ended(end) if end.lost)
    }

    /// How it ended.
    pub(crate) fn end_text(&self) -> Option<&str> {
        match &self.phase {
            Phase::Ended(end) => Some(&end.text),
            Phase::Waiting | Phase::Alive(_) => None,
        }
    }

    /// Stops it, and keeps it stopped until it is released.
    pub(crate) fn hold(&mut self) {
        self.stopped = true;
        self.due = None;
        self.ask_to_stop();
    }

    /// Drops unsaved parameter changes: the next run uses the configuration. Parameters that rules
    /// of the network read stay as they are, because other components may depend on them.
    pub(crate) fn forget_changes(&mut self) {
        self.changes.keep_only(&self.ruled);
    }

    /// Starts it again, as if for the first time. Its failures do not stop the network.
    pub(crate) fn release(&mut self) {
        self.stopped = false;
        if !self.is_alive() {
            self.phase = Phase::Waiting;
            self.ready = false;
            self.due = None;
            self.released = true;
            self.restarts.reset();
        }
    }

    pub(crate) fn is_alive(&self) -> bool {
        matches!(self.phase, Phase::Alive(_))
    }

    /// If it starts: until when it counts for the number of starts at once.
    pub(crate) fn starting(&self) -> Option<Instant> {
        match &self.phase {
            Phase::Alive(running) if !self.ready && running.stop() == Stop::No => {
                Some(running.started + START_SHARE)
            }
            Phase::Waiting | Phase::Alive(_) | Phase::Ended(_) => None,
        }
    }

    /// When its process started, while it runs.
    pub(crate) fn started(&self) -> Option<Instant> {
        match &self.phase {
            Phase::Alive(running) => Some(running.started),
            Phase::Waiting | Phase::Ended(_) => None,
        }
    }

    /// Whether it has reported ready since its last start.
    pub(crate) fn is_ready(&self) -> bool {
        self.ready
    }

    pub(crate) fn is_asked_to_stop(&self) -> bool {
        matches!(&self.phase, Phase::Alive(running) if running.stop() != Stop::No)
    }

    /// Entry for the process registry of this machine.
    pub(crate) fn registered(&self) -> Option<RegisteredProcess> {
        match &self.phase {
            Phase::Alive(Running {
                handle: ProcessHandle::Local(process),
                stopping,
                ..
            }) => Some(process.registered(&self.component, stopping.limit)),
            Phase::Waiting | Phase::Alive(_) | Phase::Ended(_) => None,
        }
    }

    /// Becomes readable when the process ends.
    pub(crate) fn process(&self) -> Option<&OwnedFd> {
        self.handle().and_then(ProcessHandle::descriptor)
    }

    /// The socket of its link.
    pub(crate) fn link(&self) -> Option<&UnixStream> {
        self.handle().and_then(ProcessHandle::link)
    }

    pub(super) fn handle(&self) -> Option<&ProcessHandle> {
        match &self.phase {
            Phase::Alive(running) => Some(&running.handle),
            Phase::Waiting | Phase::Ended(_) => None,
        }
    }

    /// Process on another machine.
    pub(crate) fn remote_process(&mut self) -> Option<&mut RemoteProcess> {
        match &mut self.phase {
            Phase::Alive(Running {
                handle: ProcessHandle::Remote(process),
                ..
            }) => Some(process),
            Phase::Waiting | Phase::Alive(_) | Phase::Ended(_) => None,
        }
    }

    /// Name of its process and the number of its run.
    pub(crate) fn run(&self) -> String {
        format!("{}/{}", self.process_name(), self.runs)
    }

    /// Starts a process with its units, each with those of them that must be ready before it.
    /// `gone`: processes that a source of time does not wait for.
    pub(crate) fn start(
        units: &mut [(&mut Self, Vec<String>)],
        mark: &Mark,
        gone: &BTreeSet<String>,
    ) -> Result<(), String> {
        for (unit, _) in &mut *units {
            unit.runs += 1;
        }
        let Some((first, _)) = units.first() else {
            return Ok(());
        };
        let there = |unit: &'_ Self| -> Component {
            let component = unit.remote_component.as_ref().unwrap_or(&unit.component);
            without_followers(component, gone).into_owned()
        };
        let components: Vec<Component> = units.iter().map(|(unit, _)| there(unit)).collect();
        let new = units.iter().zip(&components);
        let new = new.map(|((unit, after), component)| NewComponent {
            component,
            greeting: unit.changes.line(&unit.ruled),
            log: &unit.log,
            after: after.clone(),
        });
        let new: Vec<NewComponent<'_>> = new.collect();
        let run = first.run();
        let handles: Vec<ProcessHandle> = match &first.outbox {
            None => {
                let log = first.process_log.as_deref().unwrap_or(&first.log);
                let started = LocalProcess::start(&new, &run, log, mark)?;
                started.into_iter().map(ProcessHandle::Local).collect()
            }
            Some(outbox) => {
                let started = RemoteProcess::start(&new, &run, outbox);
                started.map(ProcessHandle::Remote).collect()
            }
        };
        let limits = units.iter().map(|(unit, _)| unit.component.stop);
        let stopping = Rc::new(Stopping {
            stop: Cell::new(Stop::No),
            limit: limits.max().unwrap_or_default(),
        });
        for ((unit, _), handle) in units.iter_mut().zip(handles) {
            unit.begin(handle, Rc::clone(&stopping));
        }
        Ok(())
    }

    /// Notes that its process has started.
    fn begin(&mut self, handle: ProcessHandle, stopping: Rc<Stopping>) {
        let now = Instant::now();
        self.heard = now;
        self.reported = None;
        self.lost.clear();
        self.converted.clear();
        self.forwarded.clear();
        self.told = None;
        self.unkept = self.changes.lost();
        self.hung = None;
        self.garbage = 0;
        self.health = HealthMonitor::new(&self.component);
        if let Some(control) = &mut self.lifecycle {
            control.begin_run();
        }
        self.phase = Phase::Alive(Running {
            handle,
            closed: None,
            started: now,
            stopping,
        });
    }

    /// Sends a proxy the state of its group, unless it knows it.
    pub(super) fn tell_group(&mut self, group: GroupStatus) {
        if let Phase::Alive(running) = &self.phase
            && self.told.as_ref() != Some(&group)
        {
            let line = rpc::notification(&SupervisorMessage::Group(group.clone()));
            running.handle.send_line(&String::from_utf8_lossy(&line));
            self.told = Some(group);
        }
    }

    /// Its host could not start it.
    pub(crate) fn not_started(&mut self) {
        self.phase = Phase::Waiting;
    }

    /// Reads once from the link.
    pub(crate) fn read_link(&mut self, report: &Reporter) {
        let Phase::Alive(running) = &mut self.phase else {
            return;
        };
        let lines = running.handle.read_link();
        if !running.handle.is_linked() {
            self.link_closed();
        }
        for line in lines {
            self.handle_line(line, report);
        }
    }

    /// Notes that the link is closed. The process may have ended, which is not known yet.
    pub(crate) fn link_closed(&mut self) {
        if let Phase::Alive(running) = &mut self.phase {
            running.closed = Some(Instant::now() + CLOSED_LIMIT);
        }
    }

    /// Stops reporting conditions, because the network stops.
    pub(crate) fn be_quiet(&mut self) {
        self.health.be_quiet();
    }

    /// Reads the memory of the process, `pause` after the last reading.
    pub(crate) fn measure(&mut self, pause: Duration, report: &Reporter) {
        // The agent of another machine reports the memory there.
        let Some(ProcessHandle::Local(process)) = self.handle() else {
            return;
        };
        if let Some(bytes) = resident(process.pid()) {
            self.note_memory(bytes, pause, report);
        }
    }

    /// Takes the resident memory of the process in bytes, `pause` after the last reading.
    pub(crate) fn note_memory(&mut self, bytes: u64, pause: Duration, report: &Reporter) {
        if self.ready
            && let Some((severity, code, text)) = self.health.memory(bytes, pause)
        {
            self.event(report, severity, code, text);
        }
    }

    /// Asks the process to end.
    pub(crate) fn ask_to_stop(&mut self) {
        if let Phase::Alive(running) = &mut self.phase
            && running.stop() == Stop::No
        {
            running.handle.terminate();
            let stopping = &running.stopping;
            let limit = Instant::now() + stopping.limit;
            stopping.stop.set(Stop::Asked(limit));
        }
    }

    /// Ends the process and its group.
    pub(crate) fn kill(&mut self) {
        if let Phase::Alive(running) = &mut self.phase
            && !matches!(running.stop(), Stop::Killed(_))
        {
            running.handle.kill();
            let limit = Instant::now() + KILL_LIMIT;
            running.stopping.stop.set(Stop::Killed(limit));
        }
    }

    /// Handles the end of the process: reads its last messages, kills the rest of its group, and
    /// reaps it.
    pub(crate) fn end(&mut self, report: &Reporter) -> Option<Termination> {
        let Phase::Alive(running) = &mut self.phase else {
            return None;
        };
        for line in running.handle.remaining_lines() {
            self.handle_line(line, report);
        }
        let Phase::Alive(running) = &mut self.phase else {
            return None;
        };
        let exit: Exit = running.handle.reap();
        let end = Termination {
            done: exit.is_done(running.stop() != Stop::No),
            text: exit.text,
            ran: running.started.elapsed(),
            lost: false,
        };
        self.phase = Phase::Ended(end.clone());
        Some(end)
    }

    /// Decides what follows an unexpected end after a run of length `ran`. If the unit restarts, it
    /// waits for its start.
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
                self.phase = Phase::Ended(Termination {
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
}

/// The time until `deadline`, for a `poll`.
pub(crate) fn until(deadline: Option<Instant>) -> Option<Duration> {
    deadline.map(|at| at.saturating_duration_since(Instant::now()))
}
