//! The lock of a network: an abstract socket, and a locked file in its run directory.
//!
//! The environment chooses the run directory, and any process may remove it. So the supervisor
//! first takes the abstract socket, which is unique for a user and a network; clients reach it
//! there whatever their environment. Programs in another network namespace do not see it; the file
//! separates them.
//!
//! The guard inherits the file as standard output, which it does not need otherwise, and takes over
//! the abstract socket when its supervisor has ended. So the network is locked as long as either
//! lives. The run directory is first renamed and then removed: a lock on a moved file protects
//! nothing, and a new `up` never shares a folder with an old one.

use crate::process::identity::Identity;
use rc_deploy_client::error::{Error, ErrorContext, with_owner};
use rc_management::{Client, Listener, supervisor};
use rc_middleware::RunDirectory;
use rustix::fs::{FlockOperation, flock};
use rustix::net::{AddressFamily, SocketAddrUnix, SocketFlags, SocketType, bind, socket_with};
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::os::fd::{AsFd, OwnedFd};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::fs::{FileExt, MetadataExt, OpenOptionsExt};
use std::os::unix::net::{SocketAddr, UnixListener};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const NAME: &str = "rcdeploy.lock";

/// How long an `up` waits for the guard of an earlier one: the limits for the end of its components
/// (3 s), for their kill (2 s) and for the end of its own thread (10 s), and a margin.
const PATIENCE: Duration = Duration::from_secs(20);
/// How long it waits for a guard that is stopped.
const STOPPED_PATIENCE: Duration = Duration::from_secs(2);

/// How long the holder of the abstract socket may take to accept.
const ACCEPT_LIMIT: Duration = Duration::from_secs(1);

/// The pause between two looks.
const LOOK: Duration = Duration::from_millis(20);

/// The processes that hold the lock, as its file names them.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Holders {
    /// The pid namespace in which the numbers of the processes are valid.
    #[serde(default)]
    namespace: Option<String>,
    supervisor: Option<Identity>,
    guard: Option<Identity>,
}

/// A lock that this process holds.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
    directory: RunDirectory,
    path: PathBuf,
    /// The abstract socket, until the control socket of the supervisor takes it.
    socket: Option<Listener>,
    /// The reason why there is none.
    unseen: Option<String>,
    /// The name of the abstract socket, as a guard holds it.
    name: Option<OwnedFd>,
}

/// Owner of the abstract socket of a network.
enum Name {
    Acquired(Listener),
    Supervisor(i32),
    /// The guard of a supervisor that has ended.
    Guard,
    Stranger,
}

impl Lock {
    /// Takes the lock of a network for its supervisor. Waits for a guard that still cleans up.
    pub(crate) fn acquire(network: &str) -> Result<Self, Error> {
        let deadline = Instant::now() + PATIENCE;
        let (socket, unseen) = await_name(network, deadline)?;
        let lock = Self::acquire_file(network, deadline)?;
        Ok(Self {
            socket,
            unseen,
            ..lock
        })
    }

    /// Takes the lock of a network for the agent of a supervisor on another machine, which may be
    /// this one under another name.
    pub(crate) fn acquire_for_agent(network: &str) -> Result<Self, Error> {
        Self::acquire_file(network, Instant::now() + PATIENCE)
    }

    fn acquire_file(network: &str, deadline: Instant) -> Result<Self, Error> {
        let mut wait = GuardWait::until(deadline);
        loop {
            let directory =
                RunDirectory::open(network).context("make the run directory of the network")?;
            let path = directory.path().join(NAME);
            let file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .mode(0o600)
                .open(&path);
            let mut file = match file {
                // The directory was removed in between.
                Err(error)
                    if error.kind() == io::ErrorKind::NotFound && Instant::now() < deadline =>
                {
                    continue;
                }
                file => file
                    .map_err(|error| with_owner(&path, error))
                    .context(format!("open {}", path.display()))?,
            };
            let mut guard = None;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) => {
                    let lock = Self {
                        file,
                        directory,
                        path,
                        socket: None,
                        unseen: None,
                        name: None,
                    };
                    if lock.is_current() {
                        lock.sign(None)
                            .context(format!("write {}", lock.path.display()))?;
                        lock.remove_moved();
                        return Ok(lock);
                    }
                }
                Err(rustix::io::Errno::WOULDBLOCK) => {
                    let holders = holders(&mut file);
                    if holders.namespace.is_some() && holders.namespace != namespace() {
                        return Err(Error::OtherNamespace {
                            network: network.to_owned(),
                            directory: directory.path().to_owned(),
                            pid: holders.supervisor.map(|supervisor| supervisor.pid),
                        });
                    }
                    if let Some(holder) = holders.supervisor {
                        return Err(Error::AlreadyUp {
                            network: network.to_owned(),
                            pid: holder.pid,
                        });
                    }
                    guard = holders.guard;
                }
                Err(error) => {
                    return Err(error).context(format!("lock {}", path.display()));
                }
            }
            wait.pause(network, guard)?;
        }
    }

    /// The abstract socket, for the supervisor's control socket.
    pub(crate) fn take_socket(&mut self) -> Option<Listener> {
        self.socket.take()
    }

    /// Why an `up` in another environment does not see this network, if it does not.
    pub(crate) fn take_unseen(&mut self) -> Option<String> {
        self.unseen.take()
    }

    /// Takes the abstract socket of a supervisor that has ended, without listening there.
    pub(crate) fn inherit_name(&mut self, network: &str) -> io::Result<()> {
        let name = socket_with(
            AddressFamily::UNIX,
            SocketType::STREAM,
            SocketFlags::CLOEXEC,
            None,
        )?;
        let address = SocketAddrUnix::new_abstract_name(&supervisor::abstract_name(network))?;
        bind(&name, &address)?;
        self.name = Some(name);
        Ok(())
    }

    /// Makes the run directory and the locked file again if they are not there any more. Returns
    /// whether they were not. A guard shares the lock only from its start on.
    pub(crate) fn restore(&mut self, network: &str) -> io::Result<bool> {
        if self.is_current() {
            return Ok(false);
        }
        self.directory = RunDirectory::open(network)?;
        self.path = self.directory.path().join(NAME);
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(&self.path)?;
        flock(&file, FlockOperation::NonBlockingLockExclusive)?;
        self.file = file;
        self.sign(None)?;
        Ok(true)
    }

    /// Takes over the lock that the supervisor passed as standard output.
    pub(crate) fn inherited(network: &str) -> io::Result<Self> {
        let descriptor = io::stdout().as_fd().try_clone_to_owned()?;
        let directory = RunDirectory::of(network);
        Ok(Self {
            file: File::from(descriptor),
            path: directory.path().join(NAME),
            directory,
            socket: None,
            unseen: None,
            name: None,
        })
    }

    /// A copy of the descriptor for a process that shares the lock.
    pub(crate) fn share(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// Whether the locked file is still in the run directory of the network.
    pub(crate) fn is_current(&self) -> bool {
        let same =
            |a: std::fs::Metadata, b: std::fs::Metadata| a.ino() == b.ino() && a.dev() == b.dev();
        match (self.file.metadata(), std::fs::metadata(&self.path)) {
            (Ok(held), Ok(found)) => same(held, found),
            _ => false,
        }
    }

    pub(crate) fn directory(&self) -> &RunDirectory {
        &self.directory
    }

    /// Whether the run directory contains nothing but the lock.
    pub(crate) fn is_alone(&self) -> bool {
        std::fs::read_dir(self.directory.path()).is_ok_and(|entries| entries.count() <= 1)
    }

    /// Removes the run directory with the lock in it, unless it belongs to a new network.
    pub(crate) fn remove_directory(&self) -> io::Result<()> {
        if !self.is_current() {
            return Ok(());
        }
        let away = moved(self.directory.path());
        match std::fs::rename(self.directory.path(), &away) {
            Ok(()) => remove(&away),
            // An interrupted removal has left this folder.
            Err(_) => self.directory.remove(),
        }
    }

    /// Removes everything but the lock from the run directory.
    pub(crate) fn empty_directory(&self) -> io::Result<()> {
        for entry in std::fs::read_dir(self.directory.path())? {
            let entry = entry?;
            if entry.file_name() == NAME {
                continue;
            }
            if entry.file_type()?.is_dir() {
                std::fs::remove_dir_all(entry.path())?;
            } else {
                std::fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    }

    /// Removes folders that a process moved away before it was killed in
    /// [`Self::remove_directory`].
    fn remove_moved(&self) {
        let path = self.directory.path();
        let Some((base, name)) = path.parent().zip(path.file_name()) else {
            return;
        };
        let start = format!(".{}.", name.to_string_lossy());
        for entry in std::fs::read_dir(base).into_iter().flatten().flatten() {
            let name = entry.file_name();
            let rest = name.to_str().and_then(|name| name.strip_prefix(&start));
            let pid = rest.and_then(|rest| rest.strip_suffix(MOVED));
            if pid.is_some_and(|pid| pid.parse::<u32>().is_ok()) {
                // Nothing needs it. The next `up` tries again.
                let _ = remove(&entry.path());
            }
        }
    }

    /// Names this supervisor and its guard in the file, for an `up` that finds the lock taken.
    pub(crate) fn sign(&self, guard: Option<Identity>) -> io::Result<()> {
        let holders = Holders {
            namespace: namespace(),
            supervisor: Identity::own(),
            guard,
        };
        let text = serde_json::to_string(&holders)?;
        self.file.set_len(0)?;
        self.file.write_all_at(text.as_bytes(), 0)
    }
}

/// The suffix of a run directory that is being removed.
const MOVED: &str = ".removed";

fn moved(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}{MOVED}", std::process::id()))
}

/// Removes a folder. If another process has removed it, that is not an error.
fn remove(path: &Path) -> io::Result<()> {
    match std::fs::remove_dir_all(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// The wait for a guard that cleans up.
struct GuardWait {
    deadline: Instant,
    /// When the guard was first seen to be stopped.
    stopped: Option<Instant>,
}

impl GuardWait {
    fn until(deadline: Instant) -> Self {
        Self {
            deadline,
            stopped: None,
        }
    }

    /// Waits until the next look. Fails after the deadline, or if the guard stays stopped.
    fn pause(&mut self, network: &str, guard: Option<Identity>) -> Result<(), Error> {
        let now = Instant::now();
        let is_stopped = guard.is_some_and(|guard| guard.is_stopped());
        let since = *self.stopped.get_or_insert(now);
        if !is_stopped {
            self.stopped = None;
        }
        if now >= self.deadline || (is_stopped && now >= since + STOPPED_PATIENCE) {
            return Err(Error::CleaningUp {
                network: network.to_owned(),
                guard: guard.map(|guard| guard.pid),
                is_stopped,
            });
        }
        std::thread::sleep(LOOK);
        Ok(())
    }
}

/// Takes the abstract socket of a network, or returns why another `up` does not see the network.
/// Waits for a guard that still cleans up.
fn await_name(
    network: &str,
    deadline: Instant,
) -> Result<(Option<Listener>, Option<String>), Error> {
    let mut wait = GuardWait::until(deadline);
    loop {
        match take_name(network).context("take the abstract socket of the network")? {
            Name::Acquired(socket) => return Ok((Some(socket), None)),
            Name::Supervisor(pid) => {
                let network = network.to_owned();
                return Err(Error::AlreadyUp { network, pid });
            }
            Name::Stranger => {
                let text = "a process of another user, or of another pid namespace, has the abstract socket of this network; \
                            an `up` with another XDG_RUNTIME_DIR does not see that it runs";
                return Ok((None, Some(text.to_owned())));
            }
            Name::Guard => {}
        }
        wait.pause(network, guard_of(network))?;
    }
}

/// Listens at the abstract socket of a network if no other process does.
pub(crate) fn free_name(network: &str) -> Option<Listener> {
    let address = SocketAddr::from_abstract_name(supervisor::abstract_name(network)).ok()?;
    Listener::of(UnixListener::bind_addr(&address).ok()?).ok()
}

/// Listens at the abstract socket of a network, or finds out who does.
fn take_name(network: &str) -> io::Result<Name> {
    let address = SocketAddr::from_abstract_name(supervisor::abstract_name(network))?;
    match UnixListener::bind_addr(&address) {
        Ok(socket) => return Ok(Name::Acquired(Listener::of(socket)?)),
        Err(error) if error.kind() == ErrorKind::AddrInUse => {}
        Err(error) => return Err(error),
    }
    Ok(match Client::connect_supervisor(network, ACCEPT_LIMIT) {
        Ok(client) => match client.peer() {
            None => Name::Stranger,
            Some(pid) if Identity::of(pid).is_some() => Name::Supervisor(pid),
            // It was killed, and a child that it had just forked has the socket until it executes
            // its program.
            Some(_) => Name::Guard,
        },
        // It is bound, but no process listens.
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => Name::Guard,
        Err(_) => Name::Stranger,
    })
}

/// The guard that the file of a network names, if it runs.
fn guard_of(network: &str) -> Option<Identity> {
    let path = RunDirectory::of(network).path().join(NAME);
    let mut file = File::open(path).ok()?;
    holders(&mut file).guard
}

/// The pid namespace of this process.
fn namespace() -> Option<String> {
    let link = std::fs::read_link("/proc/self/ns/pid").ok()?;
    Some(link.to_string_lossy().into_owned())
}

/// The processes in the file that still run.
fn holders(file: &mut File) -> Holders {
    let mut text = String::new();
    let read = file.take(4096).read_to_string(&mut text);
    let named = read.ok().and_then(|_| serde_json::from_str(&text).ok());
    let named: Holders = named.unwrap_or_default();
    if named.namespace.is_some() && named.namespace != namespace() {
        return named;
    }
    Holders {
        namespace: named.namespace,
        supervisor: named.supervisor.filter(Identity::is_alive),
        guard: named.guard.filter(Identity::is_alive),
    }
}

#[cfg(test)]
mod tests;
