//! Keeps lock, process registry and guard of a network on one machine together.

use crate::guard::guard_link::Guard;
use crate::guard::guard_process::GuardCommand;
use crate::guard::lock::Lock;
use crate::guard::process_registry::{ProcessRegistry, RegisteredProcess};
use crate::process::identity::{Identity, Mark, first_readable};
use rc_deploy_client::connection::KILL_LIMIT;
use rc_deploy_client::error::{Error, ErrorContext};
use rc_deploy_network::services::Service;
use rc_middleware::RunDirectory;
use rustix::event::PollFlags;
use std::collections::HashMap;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// How many guards may fail in a row.
const GUARD_STARTS: u32 = 5;
/// A guard that lived this long does not count as a failure.
const GUARD_STEADY: Duration = Duration::from_secs(5);

/// A network on this machine, held by its lock and watched by its guard.
pub(crate) struct NetworkGuard {
    network: String,
    /// The processes that run.
    registry: ProcessRegistry,
    /// Whether the file in the run directory differs from the registry.
    unwritten: bool,
    /// The services that the guard holds, in the order of their creation.
    services: Vec<Service>,
    /// For each component, how many of the services must have been created before it starts.
    needs: HashMap<String, usize>,
    /// How many have been created, by this guard or an earlier one; `None` until a guard guards.
    held: Option<usize>,
    /// How many processes have ended, and which was the last one of each component whose clean-up
    /// is open.
    deaths: u64,
    ended: HashMap<String, u64>,
    lock: Lock,
    command: GuardCommand,
    log: PathBuf,
    guard: Option<Guard>,
    starts: u32,
    /// The components end, and the services are created again.
    is_renewed: bool,
}

/// Result of the end of a guard.
pub(crate) enum GuardChange {
    /// The first guard has never guarded. The text says why.
    NotStarted(String),
    /// A new guard runs. The text describes the end of the old one.
    Restarted(String),
    /// There is no guard any more. The text says why.
    Lost(String),
}

impl NetworkGuard {
    /// Registers a network whose lock is held. From now on, a later `up` can recover it. The guard
    /// prints to `log`, and creates the services in this order.
    pub(crate) fn new(
        network: &str,
        lock: Lock,
        command: GuardCommand,
        log: PathBuf,
        services: Vec<Service>,
    ) -> Result<Self, Error> {
        let own = Identity::own().ok_or_else(|| io::Error::from(io::ErrorKind::Unsupported));
        let own = own.context("read /proc/self/stat")?;
        let registry = ProcessRegistry::new(Mark::new(network, own));
        registry
            .write(lock.directory())
            .context("write to the run directory")?;
        let mut needs = HashMap::new();
        for (at, service) in services.iter().enumerate() {
            needs.extend(service.users.iter().map(|user| (user.clone(), at + 1)));
        }
        Ok(Self {
            network: network.to_owned(),
            registry,
            unwritten: false,
            services,
            needs,
            held: None,
            deaths: 0,
            ended: HashMap::new(),
            lock,
            command,
            log,
            guard: None,
            starts: 0,
            is_renewed: false,
        })
    }

    /// Starts the guard.
    pub(crate) fn start_guard(&mut self) -> Result<(), Error> {
        self.starts += 1;
        let mut guard = Guard::start(
            &self.command,
            &self.network,
            &self.lock,
            &self.log,
            &self.registry,
            &self.services,
        )?;
        if self.deaths > 0 {
            guard.clean_up(self.deaths);
        }
        // For the message of an `up` that finds the lock taken; without it, the message says less.
        let _ = self.lock.sign(Identity::of(guard.pid()));
        self.guard = Some(guard);
        Ok(())
    }

    /// Whether a component may start: a guard runs, has created the component's services, and has
    /// cleaned up after its last process.
    pub(crate) fn lets_start(&self, component: &str) -> bool {
        let needed = self.needs.get(component).copied().unwrap_or(0);
        let ended = self.ended.get(component).copied().unwrap_or(0);
        let is_clean = |guard: &Guard| guard.cleaned() >= ended;
        self.held.is_some_and(|held| held >= needed) && self.guard.as_ref().is_none_or(is_clean)
    }

    /// Whether the guard has created all services.
    pub(crate) fn holds_all(&self) -> bool {
        self.held.is_some_and(|held| held >= self.services.len())
    }

    /// Waits until the guard has created all services. Calls `beat` at least once in a `pause`.
    pub(crate) fn await_services(
        &mut self,
        pause: Duration,
        mut beat: impl FnMut() -> Result<(), Error>,
    ) -> Result<(), Error> {
        while !self.holds_all() {
            let Some(guard) = &mut self.guard else { break };
            let lives = guard.await_turn(pause);
            guard.check(Instant::now());
            self.held = self.held.max(guard.held());
            if !lives
                && let Some(GuardChange::NotStarted(why) | GuardChange::Lost(why)) =
                    self.guard_ended()
            {
                return Err(Error::Guard(why));
            }
            beat()?;
        }
        Ok(())
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

    /// The socket of the guard, and what to wait for there.
    pub(crate) fn link(&self) -> Option<(&UnixStream, PollFlags)> {
        self.guard.as_ref().map(Guard::link)
    }

    /// Reads the messages of the guard, and writes those that it has not read yet.
    pub(crate) fn turn(&mut self) {
        if let Some(guard) = &mut self.guard {
            guard.turn();
            if !self.is_renewed {
                self.held = self.held.max(guard.held());
            }
            for component in guard.take_removed() {
                self.ended.remove(&component);
            }
            // Components that restart because memory is missing keep it until they have ended.
            if guard.has_looked() && !self.is_renewed {
                guard.fail("it shares the lock in a folder that was removed");
            }
        }
    }

    /// Some files of the held services that were removed.
    pub(crate) fn take_missing(&mut self) -> Vec<String> {
        let guard = self.guard.as_mut();
        guard.map(Guard::take_missing).unwrap_or_default()
    }

    /// Lets no component start until [`Self::restart`].
    pub(crate) fn hold_starts(&mut self) {
        self.held = None;
        self.is_renewed = true;
    }

    /// Removes the remains of the services after all components have ended, and lets a new guard
    /// create them.
    pub(crate) fn restart(&mut self, cleanup: &dyn Fn()) -> Result<(), Error> {
        if let Some(mut guard) = self.guard.take() {
            guard.fail("its services are created again");
            if first_readable([guard.descriptor()], KILL_LIMIT).is_some() {
                guard.reap();
            }
        }
        cleanup();
        self.is_renewed = false;
        self.held = None;
        self.starts = 0;
        self.start_guard()
    }

    /// When to look whether the guard is stuck.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        let guard = self.guard.as_ref()?;
        let now = Instant::now();
        let patience = guard.patience().filter(|end| now < *end);
        guard.deadline().into_iter().chain(patience).min()
    }

    /// Kills a guard that is stuck.
    pub(crate) fn check(&mut self, now: Instant) {
        if let Some(guard) = &mut self.guard {
            guard.check(now);
        }
    }

    /// Registers a process, see [`Self::save`].
    pub(crate) fn started(&mut self, component: RegisteredProcess) {
        if let Some(guard) = &mut self.guard {
            guard.started(&component);
        }
        self.registry.components.push(component);
        self.unwritten = true;
    }

    /// Removes the process of a component from the registry, see [`Self::save`]. At the end of the
    /// network, all shared memory is removed at once, and the guard cleans up after no single
    /// process.
    pub(crate) fn ended(&mut self, name: &str, network_goes_on: bool) {
        let found = self.registry.components.iter().position(|c| c.name == name);
        let Some(index) = found else { return };
        let component = self.registry.components.remove(index);
        self.unwritten = true;
        if let Some(guard) = &mut self.guard {
            guard.ended(component.process.pid);
        }
        if network_goes_on {
            self.deaths += 1;
            self.ended.insert(component.name, self.deaths);
            if let Some(guard) = &mut self.guard {
                guard.clean_up(self.deaths);
            }
        }
    }

    /// Writes the registry if it has changed. The next `up` needs the file only if supervisor and
    /// guard are both killed, so one turn of the loop writes it once.
    /// Returns whether it had.
    pub(crate) fn save(&mut self) -> io::Result<bool> {
        if self.unwritten {
            self.registry.write(self.lock.directory())?;
        }
        Ok(std::mem::take(&mut self.unwritten))
    }

    /// Makes the run directory, the lock and the registry again where they are missing. Returns
    /// whether they were. The guard then ends, so that a new one shares the new lock. Before, it looks
    /// for its services: what removed the directory may have removed their memory, which a new guard
    /// would create again, and the components that run would stay alone with the old one.
    pub(crate) fn restore(&mut self) -> io::Result<bool> {
        let is_new = self.lock.restore(&self.network)?;
        if is_new {
            if let Some(guard) = &mut self.guard {
                guard.look();
            }
            self.registry.write(self.lock.directory())?;
        }
        Ok(is_new)
    }

    /// Starts a new guard after one has ended, unless too many have failed.
    pub(crate) fn guard_ended(&mut self) -> Option<GuardChange> {
        let guard = self.guard.take()?;
        if guard.age() >= GUARD_STEADY {
            self.starts = 0;
        }
        let how = guard.reap();
        // The next one comes when all components have ended.
        if self.is_renewed {
            return None;
        }
        if self.held.is_none() {
            return Some(GuardChange::NotStarted(format!(
                "{how}; see {}, and try again when the machine is less busy",
                self.log.display()
            )));
        }
        // Without a guard, components create their services themselves.
        if self.starts >= GUARD_STARTS {
            self.held = Some(self.services.len());
            return Some(GuardChange::Lost(format!(
                "the guard process ended again ({how}) and is not started any more; see {}",
                self.log.display()
            )));
        }
        Some(match self.start_guard() {
            Ok(()) => GuardChange::Restarted(format!(
                "the guard process ended ({how}); a new one is started"
            )),
            Err(error) => {
                self.held = Some(self.services.len());
                GuardChange::Lost(format!("the guard process ended ({how}): {error}"))
            }
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
        if let Some(guard) = &mut self.guard {
            guard.release();
        }
        cleanup();
        let removed = self.lock.remove_directory();
        if let Some(guard) = self.guard.take() {
            guard.dismiss();
        }
        (left, removed, self.lock)
    }
}

#[cfg(test)]
mod tests;
