//! Files that a process was making when it was killed.
//!
//! iceoryx2 makes a file empty or with permissions of its own, fills it, and then sets its last permissions; who opens
//! it waits for that. Where the maker was killed in between, they wait in vain: until `creation_timeout`, and for ever
//! where a shared memory has no size yet (0.10.0). So every process of a network looks after such files, also while
//! it opens or receives itself: one that stays as it is for longer than the time limit of a creation, which takes
//! microseconds, is of a dead process, and is removed. Those who wait then find nothing there, and make it themselves.
//! One of them looks at a time: what a hundred processes look at while they start are thousands of files.

use crate::leader::LeaderLock;
use crate::names;
use crate::service_files::{self, MEMORY};
use rc_middleware::RunDirectory;
use rustix::fs::{FlockOperation, flock};
use std::collections::HashMap;
use std::fs::{File, Metadata};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

/// How long a file may be half made.
pub(crate) const CREATION: Duration = Duration::from_millis(500);
/// Between two looks. Where no file came or went since the last one, a look costs two system calls.
const INTERVAL: Duration = Duration::from_millis(250);
/// The permissions of a shared memory that is half made.
const MEMORY_MODE: u32 = 0o200;
/// The permissions of a service's file that is half made.
const SERVICE_MODE: u32 = 0o600;
/// Bits of a mode that are permissions.
const PERMISSIONS: u32 = 0o777;

/// Looks after half-made files, on a thread of its own, until it is dropped.
pub(crate) struct IncompleteFileRemover {
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl IncompleteFileRemover {
    /// Begins to look after the files of a network.
    pub(crate) fn start(directory: &RunDirectory) -> io::Result<Self> {
        let (stop, stopped) = channel();
        let mut files = Files::of(directory);
        let thread = std::thread::Builder::new().name("iceoryx2-files".to_owned());
        let thread = thread.spawn(move || {
            while stopped.recv_timeout(INTERVAL) == Err(RecvTimeoutError::Timeout) {
                files.sweep(Instant::now());
            }
        })?;
        Ok(Self {
            stop: Some(stop),
            thread: Some(thread),
        })
    }
}

impl Drop for IncompleteFileRemover {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The half-made files of a network, as they are now.
pub(crate) fn list(directory: &RunDirectory) -> Vec<PathBuf> {
    let files = Files::of(directory);
    files
        .incomplete()
        .into_iter()
        .map(|(path, _)| path)
        .collect()
}

/// One state of one file: no other file, and no other state of this one, has the same.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Identity {
    inode: u64,
    changed: (i64, i64),
}

impl Identity {
    fn of(metadata: &Metadata) -> Self {
        Self {
            inode: metadata.ino(),
            changed: (metadata.ctime(), metadata.ctime_nsec()),
        }
    }
}

/// When something came into or went from each of the two folders.
type Stamps = [Option<SystemTime>; 2];

struct Files {
    prefix: String,
    root: PathBuf,
    services: PathBuf,
    suspects: HashMap<PathBuf, (Identity, Instant)>,
    stamps: Stamps,
    leader: LeaderLock,
    /// Two looks have seen the same stamps, so that no change hides in the grain of the clock.
    settled: bool,
}

impl Files {
    fn of(directory: &RunDirectory) -> Self {
        let root = names::root(directory);
        Self {
            prefix: names::prefix(directory),
            services: root.join("services"),
            leader: LeaderLock::new(root.join("looking.lock")),
            root,
            suspects: HashMap::new(),
            stamps: Stamps::default(),
            settled: false,
        }
    }

    /// Removes what has been half made for too long.
    fn sweep(&mut self, now: Instant) {
        if !self.leader.is_leader() {
            return;
        }
        let stamps = [Path::new(MEMORY), &self.services]
            .map(|folder| std::fs::metadata(folder).and_then(|m| m.modified()).ok());
        let same = stamps == self.stamps;
        if same && self.settled && self.suspects.is_empty() {
            return;
        }
        (self.stamps, self.settled) = (stamps, same);
        let mut suspects = HashMap::new();
        for (path, identity) in self.incomplete() {
            let since = match self.suspects.get(&path) {
                Some((earlier, since)) if *earlier == identity => *since,
                _ => now,
            };
            if now.duration_since(since) < CREATION || !self.remove(&path, identity) {
                suspects.insert(path, (identity, since));
            }
        }
        self.suspects = suspects;
    }

    fn incomplete(&self) -> Vec<(PathBuf, Identity)> {
        let memory =
            service_files::with_prefix(Path::new(MEMORY), &self.prefix).filter(|(_, metadata)| {
                metadata.is_file()
                    && (metadata.len() == 0 || metadata.mode() & PERMISSIONS == MEMORY_MODE)
            });
        let services =
            service_files::with_prefix(&self.services, &self.prefix).filter(|(_, metadata)| {
                metadata.is_file() && metadata.mode() & PERMISSIONS == SERVICE_MODE
            });
        memory
            .chain(services)
            .map(|(path, metadata)| (path, Identity::of(&metadata)))
            .collect()
    }

    /// Whether it is gone. One at a time removes, so that none removes what was made in the place of what another one
    /// has just removed.
    fn remove(&self, path: &Path, identity: Identity) -> bool {
        let Ok(lock) = File::create(self.root.join("removing.lock")) else {
            return false;
        };
        if flock(&lock, FlockOperation::NonBlockingLockExclusive).is_err() {
            return false;
        }
        match std::fs::symlink_metadata(path) {
            Ok(metadata) if Identity::of(&metadata) == identity => {
                std::fs::remove_file(path).is_ok()
            }
            Ok(_) => true,
            Err(error) => error.kind() == io::ErrorKind::NotFound,
        }
    }
}
