//! A running guard, as its supervisor sees it: its process, and their messages.
//!
//! Nothing here waits: reports queue until the guard reads them. A guard that does not read, or
//! makes no progress with the services, is killed, and replaced like one that has crashed.

use crate::guard::guard_process::{Answer, GuardCommand, Report};
use crate::guard::lock::Lock;
use crate::guard::process_registry::{ProcessRegistry, RegisteredProcess};
use crate::process::identity::first_readable;
use rc_deploy_client::connection::KILL_LIMIT;
use rc_deploy_client::error::{Error, ErrorContext};
use rc_deploy_network::services::Service;
use rc_diagnostics::foreign::clean;
use rc_management::Output;
use rc_management::lines::{self, Lines, Overlong};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, Signal, pidfd_open};
use std::fs::File;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// How long a guard may take for one step: its start, the creation of one service, reading. The
/// creation of a service fails by itself after eight seconds.
const STEP_LIMIT: Duration = Duration::from_secs(12);

/// How long a component waits to start for a guard that cleans up and says nothing.
const CLEAN_PATIENCE: Duration = Duration::from_secs(2);

/// How many bytes of reports may wait, besides the services. A report has about a hundred.
const MAX_REPORTS: usize = 4 << 20;

/// A running guard.
#[derive(Debug)]
pub(crate) struct Guard {
    started: Instant,
    child: Child,
    pidfd: OwnedFd,
    link: UnixStream,
    output: Output,
    lines: Lines,
    /// How many services it was asked to hold.
    services: usize,
    progress: Progress,
    /// After how many deaths it should clean up, and after how many it has.
    deaths: u64,
    cleaned: u64,
    /// The components after whose last process it has cleaned up, until the supervisor or agent
    /// takes them.
    removed: Vec<String>,
    /// Some files of its services that were removed, until the supervisor or agent takes them.
    missing: Vec<String>,
    /// Whether it was asked to look for them, and whether it has.
    looks: bool,
    has_looked: bool,
    /// When it last made progress, or had nothing to do.
    moved: Instant,
    /// Why it was killed.
    failure: Option<String>,
}

/// The progress of a guard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Progress {
    Starting,
    /// It guards, and has created so many services.
    Guarding(usize),
    Released,
}

impl Guard {
    /// Starts a guard, which shares the lock and prints to `log`.
    pub(crate) fn start(
        command: &GuardCommand,
        network: &str,
        lock: &Lock,
        log: &Path,
        registry: &ProcessRegistry,
        services: &[Service],
    ) -> Result<Self, Error> {
        let (link, theirs) = UnixStream::pair().context("make a socket for the guard")?;
        link.set_nonblocking(true)
            .context("set up the socket for the guard")?;
        let log = File::options()
            .create(true)
            .append(true)
            .open(log)
            .context(format!("open {}", log.display()))?;
        let child = Command::new(&command.program)
            .args(&command.args)
            .args(["--network", network])
            .stdin(Stdio::from(OwnedFd::from(theirs)))
            .stdout(Stdio::from(lock.share().context("share the lock")?))
            .stderr(Stdio::from(log))
            .spawn()
            .map_err(|error| Error::Guard(format!("{}: {error}", command.program.display())))?;
        let services_text = services.iter().flat_map(|service| {
            let hold = Report::Hold(service.clone());
            lines::encode(&hold)
        });
        let services_text: Vec<u8> = services_text.collect();
        let limit = services_text.len() + MAX_REPORTS;
        let mut guard = Self::of(child, link, services.len(), limit)?;
        let mark = registry.mark.clone();
        guard.tell(&Report::Network { mark });
        for component in &registry.components {
            guard.started(component);
        }
        guard.output.push(&services_text);
        guard.write();
        Ok(guard)
    }

    /// The guard behind this link, which does not block. At most `limit` bytes wait for it.
    fn of(child: Child, link: UnixStream, services: usize, limit: usize) -> Result<Self, Error> {
        let pidfd = pidfd_open(Pid::from_child(&child), PidfdFlags::empty())
            .context("watch the guard process")?;
        let now = Instant::now();
        Ok(Self {
            started: now,
            child,
            pidfd,
            link,
            output: Output::up_to(limit),
            lines: Lines::new(Overlong::Skip),
            services,
            progress: Progress::Starting,
            deaths: 0,
            cleaned: 0,
            removed: Vec::new(),
            missing: Vec::new(),
            looks: false,
            has_looked: false,
            moved: now,
            failure: None,
        })
    }

    pub(crate) fn pid(&self) -> i32 {
        Pid::from_child(&self.child).as_raw_nonzero().get()
    }

    /// Becomes readable when the guard ends.
    pub(crate) fn descriptor(&self) -> &OwnedFd {
        &self.pidfd
    }

    /// The socket, and what to wait for there.
    pub(crate) fn link(&self) -> (&UnixStream, PollFlags) {
        let flags = if self.output.is_empty() {
            PollFlags::IN
        } else {
            PollFlags::IN | PollFlags::OUT
        };
        (&self.link, flags)
    }

    /// Reads its answers and writes what waits.
    pub(crate) fn turn(&mut self) {
        let (lines, _) = self.lines.read(&self.link);
        for line in lines {
            let answer = line
                .bytes()
                .and_then(|text| serde_json::from_slice(text).ok());
            let progress = match answer {
                Some(Answer::Guarding) => Progress::Guarding(0),
                Some(Answer::Held { count }) => Progress::Guarding(count),
                Some(Answer::Released) => Progress::Released,
                Some(Answer::Cleaning) => self.progress,
                Some(Answer::Removed { component }) => {
                    self.removed.push(component);
                    self.progress
                }
                Some(Answer::Missing { files }) => {
                    self.missing = files.iter().map(|file| clean(file)).collect();
                    self.progress
                }
                Some(Answer::Looked) => {
                    self.looks = false;
                    self.has_looked = true;
                    self.progress
                }
                Some(Answer::Cleaned { deaths }) => {
                    self.cleaned = deaths.max(self.cleaned);
                    self.progress
                }
                None => {
                    self.fail("it is another program; does it know the argument `guard`?");
                    return;
                }
            };
            self.progress = progress.max(self.progress);
            self.moved = Instant::now();
        }
        self.write();
    }

    /// How many services it has created; `None` until it guards.
    pub(crate) fn held(&self) -> Option<usize> {
        match self.progress {
            Progress::Starting => None,
            Progress::Guarding(count) => Some(count),
            Progress::Released => Some(self.services),
        }
    }

    /// After how many deaths it has cleaned up. A guard that does not get on with it counts as if
    /// it had: components clean up for themselves then, only more slowly.
    pub(crate) fn cleaned(&self) -> u64 {
        let patience = self.patience();
        if patience.is_some_and(|end| Instant::now() >= end) {
            self.deaths
        } else {
            self.cleaned
        }
    }

    /// The components after whose last process it has cleaned up since the last call.
    pub(crate) fn take_removed(&mut self) -> Vec<String> {
        std::mem::take(&mut self.removed)
    }

    /// Some files of its services that were removed.
    pub(crate) fn take_missing(&mut self) -> Vec<String> {
        std::mem::take(&mut self.missing)
    }

    /// Makes it look whether files of its services were removed.
    pub(crate) fn look(&mut self) {
        self.tell(&Report::Look);
        self.looks = true;
    }

    /// Whether it has looked since [`Self::look`].
    pub(crate) fn has_looked(&self) -> bool {
        self.has_looked
    }

    /// Until when components wait for a clean-up that is due.
    pub(crate) fn patience(&self) -> Option<Instant> {
        (self.cleaned < self.deaths).then(|| self.moved + CLEAN_PATIENCE)
    }

    /// Whether it is still busy with a request.
    fn is_busy(&self) -> bool {
        self.held().is_none_or(|held| held < self.services)
            || self.cleaned < self.deaths
            || self.looks
            || !self.output.is_empty()
    }

    /// When it will have been stuck for too long.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        (self.is_busy() && self.failure.is_none()).then(|| self.moved + STEP_LIMIT)
    }

    /// Kills a guard that is stuck.
    pub(crate) fn check(&mut self, now: Instant) {
        if self.deadline().is_some_and(|deadline| now >= deadline) {
            let at = match self.held() {
                None => "did not start".to_owned(),
                Some(held) if held < self.services => {
                    format!("has created {held} of {} services", self.services)
                }
                Some(_) if !self.output.is_empty() => "does not read".to_owned(),
                Some(_) if self.cleaned < self.deaths => "does not clean up".to_owned(),
                Some(_) => "does not look for its services".to_owned(),
            };
            self.fail(&format!("it {at}, and came no further for {STEP_LIMIT:?}"));
        }
    }

    /// How long it has lived.
    pub(crate) fn age(&self) -> Duration {
        self.started.elapsed()
    }

    /// How it ended. Call it after the descriptor is readable.
    pub(crate) fn reap(mut self) -> String {
        let status = self.child.wait();
        match (self.failure, status) {
            (Some(failure), _) => failure,
            (None, Ok(status)) => status.to_string(),
            (None, Err(error)) => error.to_string(),
        }
    }

    pub(crate) fn started(&mut self, component: &RegisteredProcess) {
        self.tell(&Report::Started(component.clone()));
    }

    pub(crate) fn ended(&mut self, pid: i32) {
        self.tell(&Report::Ended { pid });
    }

    /// Makes it clean up after so many deaths.
    pub(crate) fn clean_up(&mut self, deaths: u64) {
        self.tell(&Report::CleanUp { deaths });
        self.deaths = deaths;
    }

    /// Makes it close all services, and waits until it has, so that it creates none any more. A
    /// guard that does not guard yet is killed.
    pub(crate) fn release(&mut self) {
        if self.progress != Progress::Starting {
            self.tell(&Report::Release);
        }
        let end = Instant::now() + STEP_LIMIT;
        while self.progress != Progress::Released {
            let left = end.saturating_duration_since(Instant::now());
            let asked = self.progress != Progress::Starting;
            if !asked || left.is_zero() || !self.await_turn(left) {
                self.fail("it does not release its services");
                first_readable([&self.pidfd], KILL_LIMIT);
                return;
            }
        }
    }

    /// Waits for the link, and takes a turn. Returns whether the guard still lives.
    pub(crate) fn await_turn(&mut self, limit: Duration) -> bool {
        let (link, flags) = self.link();
        let mut polled = [
            PollFd::new(link, flags),
            PollFd::new(&self.pidfd, PollFlags::IN),
        ];
        let timeout = Timespec::try_from(limit).ok();
        // An error is an interruption; the caller looks at the time.
        let _ = poll(&mut polled, timeout.as_ref());
        let lives = polled[1].revents().is_empty();
        self.turn();
        lives
    }

    /// Dismisses the guard, and waits for its end.
    pub(crate) fn dismiss(mut self) {
        self.tell(&Report::Farewell);
        if first_readable([&self.pidfd], KILL_LIMIT).is_none() {
            self.kill();
        }
        if first_readable([&self.pidfd], KILL_LIMIT).is_some() {
            let _ = self.child.wait();
        }
    }

    fn tell(&mut self, report: &Report) {
        if !self.is_busy() {
            self.moved = Instant::now();
        }
        self.output.push(&lines::encode(report));
        self.write();
    }

    fn write(&mut self) {
        let before = self.output.len();
        if self.output.write(&self.link).is_err() {
            // It has ended, which the supervisor notices, or it has closed its standard input.
            self.output.clear();
            self.kill();
        }
        if self.output.len() < before {
            self.moved = Instant::now();
        }
    }

    /// Kills it for this reason.
    pub(crate) fn fail(&mut self, why: &str) {
        self.failure.get_or_insert_with(|| why.to_owned());
        self.kill();
    }

    fn kill(&self) {
        crate::process::identity::signal(&self.pidfd, Signal::KILL);
    }
}

#[cfg(test)]
mod tests;
