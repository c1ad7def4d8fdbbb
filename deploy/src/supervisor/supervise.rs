//! The event loop of the supervisor: one thread, one `poll`. It starts, watches and stops the units
//! of a plan.

use crate::guard::guard_process::GuardCommand;
use crate::guard::lock::Lock;
use crate::guard::network_guard::{GuardChange, NetworkGuard};
use crate::log::reporter::Reporter;
use crate::process::memory::MemoryRounds;
use crate::process::signals::Signals;
use crate::remote::{HostSource, Hosts};
use crate::supervisor::chains::{ChainWatch, LateContext};
use crate::supervisor::commands::Commands;
use crate::supervisor::control::Control;
use crate::supervisor::detach::Launcher;
use crate::supervisor::flight_recorder::{FlightRecorder, RecorderChange};
use crate::supervisor::network_logs::NetworkLogs;
use crate::supervisor::network_troubles::NetworkTroubles;
use crate::supervisor::options::{Options, Outcome};
use crate::supervisor::proposals::Proposals;
use crate::supervisor::proxies;
use crate::supervisor::renewal::Renewal;
use crate::supervisor::start_order::{StartOrder, in_order_of_start};
use crate::supervisor::start_scheduler::StartScheduler;
use crate::supervisor::start_times::StartTimes;
use crate::supervisor::unit::{Overdue, Unit, until};
use rc_deploy_client::digest;
use rc_deploy_client::error::{Error, ErrorContext};
use rc_deploy_client::logs;
use rc_deploy_network::plan::Plan;
use rc_files::Disk;
use rc_management::event::{Event, Severity};
use rc_management::{ServerSource, supervisor};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::AsFd;
use std::path::Path;
use std::time::{Duration, Instant};

/// How often the supervisor reads the memory of the components.
const MEMORY_PAUSE: Duration = Duration::from_secs(30);
/// How often the supervisor checks whether its files still exist.
const LOOK: Duration = Duration::from_secs(1);
/// After this time, other replicas have received the announcement of a component's replica: each
/// one announces its state once a second.
const HEARD: Duration = Duration::from_secs(5);
/// How many processes that have ended one turn of the loop handles. Between two turns, clients are
/// served.
const ENDS: usize = 4;

/// Reason for which the network ends.
#[derive(Debug)]
pub(super) enum StopReason {
    Asked,
    Failed(String),
}

/// Source of an event of the loop.
#[derive(Clone, Copy, Debug)]
enum Source {
    Signals,
    Launcher,
    Relay,
    Rotation,
    Control(ServerSource),
    Guard,
    GuardLink,
    Chains,
    Host(usize, HostSource),
    Link(usize),
    Process(usize),
}

/// A network while it is up.
pub(crate) struct Supervisor<'p> {
    pub(super) plan: &'p Plan,
    /// Digest of the `.ddsl` at the start.
    pub(super) digest: Option<String>,
    pub(super) report: &'p Reporter,
    pub(super) units: Vec<Unit>,
    pub(super) order: StartOrder,
    pub(super) starts: StartScheduler,
    pub(super) start_times: StartTimes,
    pub(super) hosts: Hosts,
    pub(super) network_guard: NetworkGuard,
    /// The conditions of the network as a whole, and when its files are looked at.
    pub(super) troubles: NetworkTroubles<'p>,
    look: Instant,
    pub(super) renewal: Renewal,
    pub(super) control: Control,
    pub(super) commands: Commands,
    pub(super) proposals: Proposals,
    signals: Signals,
    pub(super) logs: NetworkLogs,
    pub(super) rounds: MemoryRounds,
    /// The process that waits until the network is up.
    launcher: Option<Launcher>,
    pub(super) is_up: bool,
    pub(super) recorder: Option<FlightRecorder>,
    /// The measured chains, if there are some.
    pub(super) chains: Option<ChainWatch>,
    /// Units that failed after they were ready.
    pub(super) failed: Vec<String>,
    pub(super) ending: Option<StopReason>,
}

impl<'p> Supervisor<'p> {
    /// Makes everything that the loop needs. Starts the guard, but no unit.
    pub(crate) fn new(
        plan: &'p Plan,
        options: &Options,
        mut lock: Lock,
        report: &'p Reporter,
    ) -> Result<Self, Error> {
        let by_name = lock.take_socket();
        let mut troubles = NetworkTroubles::new(report);
        if let Some(text) = lock.take_unseen() {
            troubles.begin(Severity::Warning, "unseen", &text);
        }
        let log_directory = logs::open_directory(&plan.network)?;
        let guard_log = logs::file(&log_directory, logs::GUARD);
        let supervisor_log = logs::file(&log_directory, logs::SUPERVISOR);
        let mut units: Vec<Unit> = plan
            .components
            .iter()
            .map(|c| Unit::new(c.clone(), logs::file(&log_directory, &c.name)))
            .collect();
        let memory_pause = options.memory_pause.unwrap_or(MEMORY_PAUSE);
        let hosts = Hosts::new(plan, &options.services, memory_pause, &log_directory);
        for (i, unit) in units.iter_mut().enumerate() {
            unit.outbox = hosts.outbox_of(i);
            unit.ruled = options.rules.ruled(unit.name());
        }
        let logs: BTreeMap<&str, &Path> = units.iter().flat_map(Unit::logs).collect();
        let written = logs.values().copied();
        let written = written.chain([&*guard_log, &*supervisor_log]);
        for path in written.chain(hosts.logs()) {
            logs::clear(path).context(format!("write {}", path.display()))?;
        }
        let records = plan.ring.is_some() || plan.components.iter().any(|c| c.exact);
        let recordings = records.then(|| Disk::new(Disk::usual_floor(&guard_log)));
        let ring_log = logs::file(&log_directory, logs::RING);
        let others = [guard_log.clone(), supervisor_log, ring_log];
        let logs = NetworkLogs::new(&log_directory, &logs, others, recordings, options)?;
        let signals = Signals::new().context("listen to signals")?;
        let guard_command = match &options.guard {
            Some(command) => command.clone(),
            None => GuardCommand::own().context("find out which program this is")?,
        };
        let order = StartOrder::new(plan, &units);
        let services = in_order_of_start(options.hold.clone(), plan, order.all_needs());
        let mut network_guard =
            NetworkGuard::new(&plan.network, lock, guard_command, guard_log, services)?;
        let socket = network_guard.directory().socket(supervisor::SOCKET);
        let control =
            Control::listen(&socket, by_name).context(format!("listen at {}", socket.display()))?;
        network_guard.start_guard()?;
        let chains = ChainWatch::start(plan, network_guard.directory());
        let chains = chains.context("measure the chains")?;
        Ok(Self {
            plan,
            digest: digest(&plan.ddsl),
            report,
            units,
            commands: Commands::new(order.all_needs(), order.all_mates()),
            proposals: Proposals::new(options.rules.clone()),
            order,
            starts: StartScheduler::new(),
            start_times: StartTimes::new(plan.components.len(), &log_directory),
            hosts,
            network_guard,
            troubles,
            look: Instant::now() + LOOK,
            renewal: Renewal::default(),
            control,
            signals,
            logs,
            rounds: MemoryRounds::new(memory_pause),
            launcher: None,
            is_up: false,
            recorder: plan
                .ring
                .map(|ring| FlightRecorder::new(&plan.network, ring, &log_directory)),
            chains,
            failed: Vec::new(),
            ending: None,
        })
    }

    /// Sets the process that waits until the network is up.
    pub(crate) fn with(self, launcher: Option<Launcher>) -> Self {
        Self { launcher, ..self }
    }

    /// Starts the units and supervises them until the network ends.
    pub(crate) fn run(mut self, cleanup: &dyn Fn()) -> Outcome {
        self.announce_hosts();
        loop {
            self.renew(cleanup);
            self.advance_commands();
            self.advance_proposals();
            self.start_ready_units();
            self.advance_lifecycles();
            self.advance_commands();
            self.stop_ready_units();
            self.note_up();
            self.note_renewed();
            if self.ending.is_none() {
                proxies::watch(&mut self.units, self.report);
            }
            let alive = self.units.iter().any(Unit::is_alive);
            // A component that a command stopped can be started by another one.
            let may_come = |unit: &Unit| unit.is_waiting() || unit.is_stopped();
            let to_come = self.ending.is_none() && self.units.iter().any(may_come);
            if !alive && !to_come && self.leave_hosts() {
                return self.finish(cleanup);
            }
            self.troubles.save(&mut self.network_guard);
            self.control.send_events(&self.report.journal());
            for (source, events) in self.wait() {
                self.dispatch(source, events);
            }
            self.serve();
            self.check_deadlines();
        }
    }

    pub(super) fn network_event(
        &self,
        severity: Severity,
        code: &'static str,
        message: impl Into<String>,
    ) {
        self.report.event(Event::network(severity, code, message));
    }

    pub(super) fn stop(&mut self, ending: StopReason, why: &str) {
        if self.ending.is_none() {
            self.save_start();
            self.ending = Some(ending);
            self.units.iter_mut().for_each(Unit::be_quiet);
            self.network_event(Severity::Info, "stopping", format!("stopping: {why}"));
        }
    }

    /// Asks units to end, dependents first.
    pub(super) fn stop_ready_units(&mut self) {
        if self.ending.is_none() {
            return;
        }
        let alive = (0..self.units.len()).filter(|&i| self.units[i].is_alive());
        for i in self.order.unneeded(alive) {
            self.units[i].ask_to_stop();
        }
    }

    pub(super) fn note_up(&mut self) {
        if !self.is_up && self.ending.is_none() {
            self.start_times.look(&self.units);
        }
        if !self.is_up && self.ending.is_none() && self.units.iter().all(Unit::lets_others_work) {
            self.save_start();
            self.is_up = true;
            let text = format!("network {} is up", self.plan.network);
            self.network_event(Severity::Info, "up", text);
            if let Some(launcher) = self.launcher.take() {
                launcher.up();
            }
            if let Some(recorder) = &mut self.recorder {
                recorder.begin();
            }
        }
    }

    /// Waits for events and returns their sources. Links come before processes, so that the last
    /// messages of a component count.
    fn wait(&self) -> Vec<(Source, PollFlags)> {
        let mut polled: Vec<PollFd<'_>> = Vec::new();
        let mut sources = Vec::new();
        let mut add = |source, descriptor, flags| {
            polled.push(PollFd::from_borrowed_fd(descriptor, flags));
            sources.push(source);
        };
        add(Source::Signals, self.signals.descriptor(), PollFlags::IN);
        if let Some(launcher) = &self.launcher {
            add(
                Source::Launcher,
                launcher.descriptor().as_fd(),
                PollFlags::IN,
            );
        }
        if let Some(watch) = self.logs.shown() {
            add(Source::Relay, watch.as_fd(), PollFlags::IN);
        }
        if let Some(watch) = self.logs.grown() {
            add(Source::Rotation, watch.as_fd(), PollFlags::IN);
        }
        if let Some(guard) = self.network_guard.descriptor() {
            add(Source::Guard, guard.as_fd(), PollFlags::IN);
        }
        if let Some((link, flags)) = self.network_guard.link() {
            add(Source::GuardLink, link.as_fd(), flags);
        }
        if let Some(chains) = &self.chains {
            add(Source::Chains, chains.descriptor(), PollFlags::IN);
        }
        for (h, part, descriptor, flags) in self.hosts.descriptors() {
            add(Source::Host(h, part), descriptor, flags);
        }
        for (i, unit) in self.units.iter().enumerate() {
            if let Some(link) = unit.link() {
                add(Source::Link(i), link.as_fd(), PollFlags::IN);
            }
        }
        for (i, unit) in self.units.iter().enumerate() {
            if let Some(process) = unit.process() {
                add(Source::Process(i), process.as_fd(), PollFlags::IN);
            }
        }
        // Clients come last.
        for (source, descriptor, flags) in self.control.descriptors() {
            add(Source::Control(source), descriptor, flags);
        }
        let units = self.units.iter().filter_map(Unit::deadline);
        let commands = self.commands.deadline();
        let proposals = self.proposals.deadline();
        let hosts = self.hosts.deadline();
        let deadline = units.chain(hosts).chain(commands).chain(proposals);
        let deadline = deadline.chain(self.control.deadline());
        let deadline = deadline
            .chain(self.network_guard.deadline())
            .chain(self.starts.deadline());
        let deadline = deadline.chain(self.logs.deadline());
        let recorder = self.recorder.as_ref();
        let deadline = deadline.chain(recorder.and_then(FlightRecorder::deadline));
        let deadline = deadline.chain([self.rounds.deadline(), self.look]).min();
        // A limit that no Timespec can hold is none.
        let timeout = until(deadline).and_then(|left| Timespec::try_from(left).ok());
        match poll(&mut polled, timeout.as_ref()) {
            Ok(_) => {
                let events = polled.iter().map(PollFd::revents);
                in_one_turn(sources.into_iter().zip(events))
            }
            // Interrupted, or short of memory for a moment.
            Err(error) => {
                if error != rustix::io::Errno::INTR {
                    std::thread::sleep(Duration::from_millis(10));
                }
                Vec::new()
            }
        }
    }

    fn dispatch(&mut self, source: Source, events: PollFlags) {
        match source {
            Source::Signals => self.signalled(),
            Source::Launcher => {
                self.launcher = None;
                self.stop(StopReason::Asked, "the process that started it has ended");
            }
            Source::Relay => self.logs.wake_shown(),
            Source::Rotation => self.logs.wake_grown(),
            Source::Control(source) => self.control.turn(source, events),
            Source::Guard => self.guard_ended(),
            Source::GuardLink => {
                self.network_guard.turn();
                self.check_memory();
            }
            Source::Chains => self.take_changes_of_chains(),
            Source::Host(h, HostSource::Link) => self.read_host(h),
            Source::Host(h, HostSource::Socket(number)) => self.hosts.turn_socket(h, number),
            Source::Link(i) => self.units[i].read_link(self.report),
            Source::Process(i) => self.unit_ended(i),
        }
    }

    pub(super) fn take_changes_of_chains(&mut self) {
        while let Some(chains) = &self.chains {
            let late = chains.take_changes(LateContext {
                plan: self.plan,
                report: self.report,
                troubles: &mut self.troubles,
                directory: self.network_guard.directory(),
                is_ending: self.ending.is_some(),
            });
            let Some(name) = late else { return };
            self.stop_late(&name);
        }
    }

    pub(super) fn signalled(&mut self) {
        for _ in 0..self.signals.take() {
            if self.ending.is_none() {
                self.stop(
                    StopReason::Asked,
                    "interrupted; a second interrupt kills at once",
                );
            } else {
                self.network_event(Severity::Warning, "stopping", "interrupted again: killing");
                self.units.iter_mut().for_each(Unit::kill);
            }
        }
    }

    fn guard_ended(&mut self) {
        match self.network_guard.guard_ended() {
            Some(GuardChange::NotStarted(text)) => {
                let message = Error::Guard(text).to_string();
                self.network_event(Severity::Error, "refused", message.clone());
                self.stop(StopReason::Failed(message), "it has no guard");
            }
            Some(GuardChange::Restarted(text)) => {
                self.network_event(Severity::Warning, "guard-ended", text);
            }
            Some(GuardChange::Lost(text)) => {
                self.troubles.begin(Severity::Error, "guard-lost", &text);
            }
            None => {}
        }
    }

    /// Reports components whose replicas of the shared world hear nothing of others that run.
    fn look_for_splits(&mut self) {
        // Others may not have heard one that has just started again.
        let is_there = |unit: &&Unit| unit.is_alive() && unit.health.has_world_for(HEARD);
        let running = self.units.iter().filter(is_there);
        let running: Vec<String> = running.map(|unit| unit.name().to_owned()).collect();
        let running: BTreeSet<&str> = running.iter().map(String::as_str).collect();
        for unit in self.units.iter_mut().filter(|unit| unit.is_alive()) {
            let happened = unit.health.look_for_split(&running);
            for (severity, code, text) in happened {
                unit.event(self.report, severity, code, text);
            }
        }
    }

    pub(super) fn check_deadlines(&mut self) {
        let now = Instant::now();
        self.logs.show(now, self.report);
        self.control.check(now);
        self.check_hosts(now);
        self.network_guard.check(now);
        if now >= self.look {
            self.look = now + LOOK;
            let (guard, control) = (&mut self.network_guard, &mut self.control);
            self.troubles.restore_files(guard, control);
            self.troubles.restore_logs(&mut self.logs);
            self.troubles.look_at_recordings(&mut self.logs);
            self.troubles.look_for_name(&self.plan.network, control);
            self.look_for_splits();
        }
        let disk = self.logs.check(now, self.report);
        self.troubles.disk_changed(&self.logs, disk);
        let mark = self.network_guard.mark();
        let recorder = self.recorder.as_mut();
        match recorder.and_then(|recorder| recorder.check(now, mark)) {
            Some(RecorderChange::Ended(text)) => {
                self.troubles
                    .begin(Severity::Warning, "recorder-ended", &text);
            }
            Some(RecorderChange::Back) => {
                let text = "the recorder of the ring runs again";
                self.troubles.end("recorder-ended", "recorder-back", text);
            }
            None => {}
        }
        if self.rounds.is_due(now) {
            let disk = self.logs.check_disk();
            self.troubles.disk_changed(&self.logs, disk);
            let pause = self.rounds.pause;
            for (i, unit) in self.units.iter_mut().enumerate() {
                // The memory of a process is reported once.
                if self.order.leads(i) {
                    unit.measure(pause, self.report);
                }
            }
        }
        for (name, left) in self.starts.swept() {
            self.left_over(&name, left);
        }
        for i in 0..self.units.len() {
            match self.units[i].check(now, self.report) {
                Overdue::Nothing => {}
                Overdue::NotReady if self.ending.is_none() => {
                    let unit = &self.units[i];
                    let text = format!("was not ready within {:?}", unit.component.ready);
                    if unit.is_restarted() {
                        self.commands.failed(i, &text);
                        unit.event(self.report, Severity::Warning, "not-ready", text);
                        self.units[i].ask_to_stop();
                    } else {
                        self.fail(i, &text);
                    }
                }
                // It is stopped when it is its turn; until then its limit is not news.
                Overdue::NotReady => self.units[i].ask_to_stop(),
                Overdue::HungTooLong => {
                    let unit = &self.units[i];
                    let limit = unit.component.restart.hung.unwrap_or_default();
                    let text = format!("has been hung for {limit:?} and is stopped");
                    unit.event(self.report, Severity::Warning, "hung-too-long", text);
                    self.units[i].ask_to_stop();
                }
                Overdue::NotKilled => {
                    self.failed.push(self.units[i].name().to_owned());
                    // Dependents would wait forever.
                    if self.ending.is_none() && !self.units[i].is_stopped() {
                        self.fail(i, "does not end, so it cannot restart");
                    }
                }
            }
        }
    }

    /// Cleans up after all processes have ended.
    fn finish(mut self, cleanup: &dyn Fn()) -> Outcome {
        if let Some(recorder) = &mut self.recorder {
            self.control.send_events(&self.report.journal());
            recorder.end();
        }
        self.logs.finish(self.report);
        let (left, removed, lock) = self.network_guard.finish(cleanup);
        let event = |severity, code, text| self.report.event(Event::network(severity, code, text));
        if left > 0 {
            let text = format!("killed {left} orphaned processes of components");
            event(Severity::Warning, "left-over", text);
        }
        if let Err(error) = removed {
            let path = lock.directory().path().display();
            let text = format!("cannot remove {path}: {error}");
            event(Severity::Warning, "not-cleaned", text);
        }
        let text = format!("network {} is down", self.plan.network);
        event(Severity::Info, "down", text);
        self.control.send_events(&self.report.journal());
        self.report.flush();
        let outcome = match (self.ending.take(), &self.failed[..]) {
            (Some(StopReason::Failed(message)), _) => Outcome::Failed(message),
            (Some(StopReason::Asked), []) => Outcome::Stopped,
            (None, []) => Outcome::Done,
            (_, failed) => Outcome::Failed(format!("failed: {}", failed.join(", "))),
        };
        if let Some(launcher) = self.launcher.take() {
            match outcome.message() {
                Some(message) => launcher.failed(&message),
                None => launcher.failed("it was stopped while it started"),
            }
        }
        // A client that waits for the end may start the network again, so the lock is released
        // before the connections close.
        drop(lock);
        drop(self.control);
        outcome
    }
}

/// The sources with events, of which one turn handles a few ends of processes.
fn in_one_turn(all: impl Iterator<Item = (Source, PollFlags)>) -> Vec<(Source, PollFlags)> {
    let mut ends = 0;
    all.filter(|(_, events)| !events.is_empty())
        .filter(|(source, _)| {
            let is_end = matches!(source, Source::Process(_));
            ends += usize::from(is_end);
            !is_end || ends <= ENDS
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_handles_some_ends_and_all_other_events() {
        let other = [Source::Signals, Source::Guard, Source::Link(1)];
        let ends = (0..ENDS + 2).map(Source::Process);
        let silent = (Source::Relay, PollFlags::empty());
        let all = other.into_iter().chain(ends).chain([Source::Launcher]);
        let all = all.map(|source| (source, PollFlags::IN)).chain([silent]);
        let handled = in_one_turn(all);
        let names: Vec<String> = handled
            .iter()
            .map(|(source, _)| format!("{source:?}"))
            .collect();
        let first = ["Signals", "Guard", "Link(1)"].map(str::to_owned);
        let ends = (0..ENDS).map(|at| format!("Process({at})"));
        let wanted = first.into_iter().chain(ends).chain(["Launcher".to_owned()]);
        assert!(wanted.eq(names));
    }
}
