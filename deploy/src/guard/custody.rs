//! What keeps a network on one machine: its lock, the account of its processes, and the guard that outlives both.

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

/// How many guards may be started of which none lives long.
const GUARD_STARTS: u32 = 5;
/// A guard that has lived so long was no part of a series.
const GUARD_STEADY: Duration = Duration::from_secs(5);

/// The custody of a network on this machine.
pub(crate) struct Custody {
    network: String,
    /// What runs, as it is written to the run directory.
    registry: ProcessRegistry,
    lock: Lock,
    command: GuardCommand,
    log: PathBuf,
    guard: Option<Guard>,
    starts: u32,
}

/// What has become of a guard that ended.
pub(crate) enum GuardChange {
    /// There is a new one.
    Restarted(String),
    /// There is none any more.
    Lost(String),
}

impl Custody {
    /// Keeps a network whose lock is held: from now on an `up` that comes later knows that it was there. What the
    /// guard prints goes to `log`.
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

    /// Starts the guard, and waits until it guards.
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

    /// The folder of the sockets and of the account.
    pub(crate) fn directory(&self) -> &RunDirectory {
        self.lock.directory()
    }

    /// What every process of the network carries.
    pub(crate) fn mark(&self) -> &Mark {
        &self.registry.mark
    }

    /// The guard's process, while there is one.
    pub(crate) fn guard(&self) -> Option<i32> {
        self.guard.as_ref().map(Guard::pid)
    }

    /// Becomes readable when the guard ends.
    pub(crate) fn descriptor(&self) -> Option<&OwnedFd> {
        self.guard.as_ref().map(Guard::descriptor)
    }

    /// A component was started. The file is needed by the next `up` only if all of these processes are killed.
    pub(crate) fn started(&mut self, component: RegisteredProcess) -> io::Result<()> {
        if let Some(guard) = &mut self.guard {
            guard.started(&component);
        }
        self.registry.components.push(component);
        self.registry.write(self.lock.directory())
    }

    /// A component has ended.
    pub(crate) fn ended(&mut self, name: &str) -> io::Result<()> {
        let found = self.registry.components.iter().position(|c| c.name == name);
        let Some(index) = found else { return Ok(()) };
        let registry = self.registry.components.remove(index);
        if let Some(guard) = &mut self.guard {
            guard.ended(registry.process.pid);
        }
        self.registry.write(self.lock.directory())
    }

    /// The guard has ended.
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

    /// Waits for the processes that are left to end, boundedly, and kills the rest.
    pub(crate) fn end_all(&mut self) -> usize {
        let killed = self.registry.end_all();
        self.registry.components.clear();
        killed
    }

    /// All components have ended: kills what they left behind, wipes all traces. Gives how many processes were killed,
    /// and the lock, which goes last.
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
