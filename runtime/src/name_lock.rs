//! The name of a component in its network: `NAME.lock` in the run directory, locked as long as the component lives.
//! Its management socket lies beside it, `NAME.sock`.

use crate::error::StartError;
use rc_middleware::{Environment, RunDirectory};
use rustix::fs::{FlockOperation, flock};
use std::fs::File;
use std::io::{self, ErrorKind};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// The lock of a deployer. Where there is one, it is the deployer that removes what the dead leave.
const SUPERVISOR_LOCK: &str = "rcdeploy.lock";

/// A name that is taken, and given back when this is dropped.
pub(crate) struct NameLock {
    socket: PathBuf,
    _lock: File,
}

impl NameLock {
    /// Takes the name of this component, if no other one has it.
    pub(crate) fn acquire(environment: &Environment) -> Result<Self, StartError> {
        let Environment {
            network, instance, ..
        } = environment;
        let socket = environment.directory.socket(instance);
        let path = socket.with_extension("lock");
        let lock = lock(&path, || match File::create(&path) {
            // The last one out has removed the folder since it was made.
            Err(error) if error.kind() == ErrorKind::NotFound => {
                RunDirectory::open(network)?;
                File::create(&path)
            }
            file => file,
        });
        let lock = lock.map_err(|e| {
            StartError::System(format!("the lock of this name cannot be made: {e}"))
        })?;
        match lock {
            Some(lock) => Ok(Self {
                socket,
                _lock: lock,
            }),
            None => Err(StartError::System(format!(
                "a component named `{instance}` runs in network `{network}` already; stop it, or choose another --name or --network"
            ))),
        }
    }

    /// Where the management socket has its place.
    pub(crate) fn socket(&self) -> &Path {
        &self.socket
    }
}

/// Gives the name back, and those of components that were killed and not started again.
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
        // The last one of a network that nobody supervises leaves an empty folder behind otherwise.
        let _ = std::fs::remove_dir(folder);
    }
}

/// Locks the file that `open` opens at `path`; `None` where somebody else has locked it.
fn lock(path: &Path, open: impl Fn() -> io::Result<File>) -> io::Result<Option<File>> {
    loop {
        let file = open()?;
        if flock(&file, FlockOperation::NonBlockingLockExclusive).is_err() {
            return Ok(None);
        }
        // The one who had it before may have removed it since it was opened.
        let ours = file.metadata()?;
        match std::fs::metadata(path) {
            Ok(there) if (there.dev(), there.ino()) == (ours.dev(), ours.ino()) => {
                return Ok(Some(file));
            }
            _ => {}
        }
    }
}

/// Removes a socket and its lock, in the order in which a new owner expects them.
fn remove(socket: &Path) {
    let _ = std::fs::remove_file(socket);
    let _ = std::fs::remove_file(socket.with_extension("lock"));
}
