//! Keeps lock, process registry and guard of a network on one machine together.

use crate::guard::guard_process::{Guard, GuardCommand};
use crate::guard::lock::Lock;
use crate::guard::process_registry::{ProcessRegistry, RegisteredProcess};
use crate::process::identity::{Identity, Mark};
use rc_deploy_client::error::{Error, ErrorContext};
use rc_middleware::RunDirectory;
use std::io;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Duration;

/// How many guards may fail in a row.
const GUARD_STARTS: u32 = 5;
/// A guard that lived this long does not count as a failure.
const GUARD_STEADY: Duration = Duration::from_secs(5);

/// The custody of a network on this machine.
pub(crate) struct Custody {
    network: String,
    /// The processes that run, as written to the run directory.
    registry: ProcessRegistry,
    lock: Lock,
    command: GuardCommand,
    log: PathBuf,
    guard: Option<Guard>,
    starts: u32,
}

/// What followed the end of a guard.
pub(crate) enum GuardChange {
    /// A new guard runs. The text describes the end of the old one.
    Restarted(String),
    /// There is no guard any more. The text says why.
    Lost(String),
}

impl Custody {
    /// Takes custody of a network whose lock is held. From now on, a later `up` can recover it. The
    /// guard prints to `log`.
    pub(crate) fn new(
        network: &str,
        lock: Lock,
        command: GuardCommand,
        log: PathBuf,
    ) -> Result<Self, Error> {
        let own = Identity::own().ok_or_else(|| io::Error::from(io::ErrorKind::Unsupported));
        let own = own.context("read /proc/self/stat")?;
        let registry = ProcessRegistry::new(Mark::new(network, own));
        registry
            .write(lock.directory())
            .context("write to the run directory")?;
        Ok(Self {
            network: network.to_owned(),
            registry,
            lock,
            command,
            log,
            guard: None,
            starts: 0,
        })
    }

    /// Starts the guard, and waits until it is ready.
    pub(crate) fn start_guard(&mut self) -> Result<(), Error> {
        self.new_guard()?.await_ready()
    }

    fn new_guard(&mut self) -> Result<&mut Guard, Error> {
        self.starts += 1;
        let guard = Guard::start(
            &self.command,
            &self.network,
            &self.lock,
            &self.log,
            &self.registry,
        )?;
        Ok(self.guard.insert(guard))
    }

    /// The run directory.
    pub(crate) fn directory(&self) -> &RunDirectory {
        self.lock.directory()
    }

    /// The mark of the processes of this network.
    pub(crate) fn mark(&self) -> &Mark {
        &self.registry.mark
    }

    /// The pid of the guard.
    pub(crate) fn guard(&self) -> Option<i32> {
        self.guard.as_ref().map(Guard::pid)
    }

    /// Becomes readable when the guard ends.
    pub(crate) fn descriptor(&self) -> Option<&OwnedFd> {
        self.guard.as_ref().map(Guard::descriptor)
    }

    /// Registers a process. The next `up` needs the file only if supervisor and guard are both
    /// killed.
    pub(crate) fn started(&mut self, component: RegisteredProcess) -> io::Result<()> {
        if let Some(guard) = &mut self.guard {
            guard.started(&component);
        }
        self.registry.components.push(component);
        self.registry.write(self.lock.directory())
    }

    /// Removes the process of a component from the registry.
    pub(crate) fn ended(&mut self, name: &str) -> io::Result<()> {
        let found = self.registry.components.iter().position(|c| c.name == name);
        let Some(index) = found else { return Ok(()) };
        let registry = self.registry.components.remove(index);
        if let Some(guard) = &mut self.guard {
            guard.ended(registry.process.pid);
        }
        self.registry.write(self.lock.directory())
    }

    /// Starts a new guard after one has ended, unless too many have failed.
    pub(crate) fn guard_ended(&mut self) -> Option<GuardChange> {
        let guard = self.guard.take()?;
        if guard.age() >= GUARD_STEADY {
            self.starts = 0;
        }
        let how = guard.reap();
        if self.starts >= GUARD_STARTS {
            return Some(GuardChange::Lost(format!(
                "the guard process ended again ({how}) and is not started any more; see {}",
                self.log.display()
            )));
        }
        Some(match self.new_guard() {
            Ok(_) => GuardChange::Restarted(format!(
                "the guard process ended ({how}); a new one is started"
            )),
            Err(error) => GuardChange::Lost(format!("the guard process ended ({how}): {error}")),
        })
    }

    /// Waits for the remaining processes, with a limit, and kills the rest.
    pub(crate) fn end_all(&mut self) -> usize {
        let killed = self.registry.end_all();
        self.registry.components.clear();
        killed
    }

    /// Kills orphans and removes all traces after the components have ended. Returns the number of
    /// killed processes, and the lock, which the caller releases last.
    pub(crate) fn finish(mut self, cleanup: &dyn Fn()) -> (usize, io::Result<()>, Lock) {
        let left = self.registry.mark.sweep();
        cleanup();
        let removed = self.lock.remove_directory();
        if let Some(guard) = self.guard.take() {
            guard.dismiss();
        }
        (left, removed, self.lock)
    }
}
