//! The name of a component in its network: `NAME.lock` in the run directory, locked as long as the
//! component lives. Its management socket is next to it, `NAME.sock`.

use crate::error::StartError;
use rc_middleware::{Environment, RunDirectory};
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io::{self, ErrorKind};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The lock of a supervisor. If it exists, the supervisor cleans up after components that were
/// killed.
const SUPERVISOR_LOCK: &str = "rcdeploy.lock";

/// The lock of a component's name, released on drop.
pub(crate) struct NameLock {
    socket: PathBuf,
    lock: Mutex<File>,
}

impl NameLock {
    /// Locks the name of this component. An error says that another component has it.
    pub(crate) fn acquire(environment: &Environment) -> Result<Self, StartError> {
        let Environment {
            network, instance, ..
        } = environment;
        let socket = environment.directory.socket(instance);
        let path = socket.with_extension("lock");
        let lock = lock(&path, || match File::create(&path) {
            // The last component of the network has removed the folder since it was created.
            Err(error) if error.kind() == ErrorKind::NotFound => {
                RunDirectory::open(network)?;
                File::create(&path)
            }
            file => file,
        });
        let lock = lock.map_err(|e| StartError::System(format!("cannot lock the name: {e}")))?;
        match lock {
            Some(lock) => Ok(Self {
                socket,
                lock: Mutex::new(lock),
            }),
            None => Err(StartError::System(format!(
                "a component named `{instance}` runs in network `{network}` already; stop it, or choose another --name or --network"
            ))),
        }
    }

    /// Makes the run directory and the lock again if they are not there any more. An error says
    /// that this is not possible, or that another component has the name now.
    pub(crate) fn restore(&self, network: &str) -> io::Result<()> {
        let mut held = self.lock.lock().unwrap_or_else(PoisonError::into_inner);
        let path = self.socket.with_extension("lock");
        if is_at(&held, &path)? {
            return Ok(());
        }
        RunDirectory::open(network)?;
        match lock(&path, || File::create(&path))? {
            Some(file) => *held = file,
            None => return Err(ErrorKind::AlreadyExists.into()),
        }
        Ok(())
    }

    /// The path of the management socket.
    pub(crate) fn socket(&self) -> &Path {
        &self.socket
    }
}

/// Releases the name, and removes the sockets of components that were killed and not restarted.
impl Drop for NameLock {
    fn drop(&mut self) {
        remove(&self.socket);
        let Some(folder) = self.socket.parent() else {
            return;
        };
        if !folder.join(SUPERVISOR_LOCK).exists() {
            let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
            for path in entries.map(|entry| entry.path()) {
                if path
                    .extension()
                    .is_some_and(|extension| extension == "lock")
                    && let Ok(Some(_lock)) = lock(&path, || File::open(&path))
                {
                    remove(&path.with_extension("sock"));
                }
            }
        }
        // Without a supervisor, the last component of a network removes the folder.
        let _ = std::fs::remove_dir(folder);
    }
}

/// Locks the file that `open` opens at `path`. The result is none if another process has locked it.
fn lock(path: &Path, open: impl Fn() -> io::Result<File>) -> io::Result<Option<File>> {
    loop {
        let file = open()?;
        if flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
            return Ok(None);
        }
        // The previous owner may have removed it since it was opened.
        if is_at(&file, path)? {
            return Ok(Some(file));
        }
    }
}

/// Whether `path` leads to this open file.
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    let ours = file.metadata()?;
    let there = std::fs::metadata(path);
    Ok(there.is_ok_and(|there| (there.dev(), there.ino()) == (ours.dev(), ours.ino())))
}

/// Removes a socket, then its lock: a new owner first locks, then listens.
fn remove(socket: &Path) {
    let _ = std::fs::remove_file(socket);
    let _ = std::fs::remove_file(socket.with_extension("lock"));
}
