//! Removes files whose creator was killed before they were complete.
//!
//! iceoryx2 creates a file empty or with temporary permissions, fills it, and then sets its final
//! permissions; a process that opens the file waits for them. If the creator is killed in between,
//! that process waits until `creation_timeout`, and forever if a shared memory has no size yet
//! (0.10.0). A thread in every process of a network therefore removes a file that stays incomplete
//! for longer than [`CREATION`]; a creation takes microseconds. Waiting processes then find no file
//! and create it themselves. Only the leader searches, because a hundred processes that start have
//! thousands of files.

use crate::leader::LeaderLock;
use crate::names::Storage;
use crate::service_files::{self, MEMORY};
use rc_middleware::{WakeEvent, wait};
use rustix::fs::{FlockOperation, flock, inotify};
use std::collections::HashMap;
use std::fs::{File, Metadata};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

/// Time after which an incomplete file counts as abandoned.
pub(crate) const CREATION: Duration = Duration::from_millis(500);
/// Pause between two searches while files are created or removed.
const INTERVAL: Duration = Duration::from_millis(250);
/// The pause while nothing happens: the kernel announces a new file. It is shorter than the lease
/// of the leader, which a search renews.
const RENEWAL: Duration = Duration::from_millis(500);
/// Pause between two looks of a process that does not lead: longer than a renewal, which shows that
/// the leader is alive.
const CANDIDACY: Duration = Duration::from_millis(750);
/// Permissions of an incomplete shared memory.
const MEMORY_MODE: u32 = 0o200;
/// Permissions of an incomplete service file.
const SERVICE_MODE: u32 = 0o600;
/// The permission bits of a mode.
const PERMISSIONS: u32 = 0o777;

/// The thread that removes incomplete files. Ends when this value is dropped.
pub(crate) struct IncompleteFileRemover {
    stop: WakeEvent,
    thread: Option<JoinHandle<()>>,
}

impl IncompleteFileRemover {
    /// Starts the thread for one network.
    pub(crate) fn start(place: &Storage) -> io::Result<Self> {
        let stop = WakeEvent::new()?;
        let mut files = Files::of(place);
        let thread = std::thread::Builder::new().name("iceoryx2-files".to_owned());
        let stopped = stop.clone();
        let thread = thread.spawn(move || {
            let mut pause = INTERVAL;
            loop {
                let mut descriptors = vec![stopped.as_fd()];
                descriptors.extend(files.announcements.as_ref().map(AsFd::as_fd));
                let is_changed = wait(&descriptors, pause) & 2 != 0;
                if stopped.is_stopping() {
                    return;
                }
                if is_changed {
                    files.announcements = None;
                }
                pause = files.sweep(Instant::now());
            }
        })?;
        Ok(Self {
            stop,
            thread: Some(thread),
        })
    }
}

impl Drop for IncompleteFileRemover {
    fn drop(&mut self) {
        self.stop.stop();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The files of a network that are incomplete now.
pub(crate) fn list(place: &Storage) -> Vec<PathBuf> {
    let files = Files::of(place);
    files
        .incomplete()
        .into_iter()
        .map(|(path, _)| path)
        .collect()
}

/// Identifies one state of one file: it changes with every write and every new file at the same
/// path.
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

/// Modification times of the two folders.
type Stamps = [Option<SystemTime>; 2];

/// A descriptor that becomes readable when a file of iceoryx2 is created; `None` where the kernel
/// has none left for this user.
fn announcements(services: &Path) -> Option<OwnedFd> {
    let flags = inotify::CreateFlags::CLOEXEC | inotify::CreateFlags::NONBLOCK;
    let announced = inotify::init(flags).ok()?;
    for folder in [Path::new(MEMORY), services] {
        let flags = inotify::WatchFlags::CREATE
            | inotify::WatchFlags::MOVED_TO
            | inotify::WatchFlags::DELETE_SELF
            | inotify::WatchFlags::ONLYDIR;
        inotify::add_watch(&announced, folder, flags).ok()?;
    }
    Some(announced)
}

struct Files {
    prefix: String,
    root: PathBuf,
    services: PathBuf,
    suspects: HashMap<PathBuf, (Identity, Instant)>,
    stamps: Stamps,
    leader: LeaderLock,
    /// Two searches saw the same stamps, so the resolution of the clock hides no change.
    settled: bool,
    /// Readable when a file was created since nothing was left to do; the leader alone has it.
    announcements: Option<OwnedFd>,
}

impl Files {
    fn of(place: &Storage) -> Self {
        let root = place.root.clone();
        Self {
            prefix: place.prefix.clone(),
            services: root.join("services"),
            leader: LeaderLock::new(&root.join("looking.lock")),
            root,
            suspects: HashMap::new(),
            stamps: Stamps::default(),
            settled: false,
            announcements: None,
        }
    }

    /// Removes the files that have been incomplete for too long. Returns the pause until the next
    /// search.
    fn sweep(&mut self, now: Instant) -> Duration {
        if !self.leader.leads() && self.leader.was_renewed() {
            return CANDIDACY;
        }
        if !self.leader.is_leader() {
            self.announcements = None;
            return CANDIDACY;
        }
        if self.announcements.is_some() {
            return RENEWAL;
        }
        let stamps = self.stamps_now();
        let same = stamps == self.stamps;
        if same && self.settled && self.suspects.is_empty() {
            let announced = announcements(&self.services);
            // A file that was created meanwhile is not announced.
            if announced.is_none() || self.stamps_now() != stamps {
                return INTERVAL;
            }
            (self.announcements, self.settled) = (announced, false);
            return RENEWAL;
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
        INTERVAL
    }

    fn stamps_now(&self) -> Stamps {
        [Path::new(MEMORY), &self.services]
            .map(|folder| std::fs::metadata(folder).and_then(|m| m.modified()).ok())
    }

    fn incomplete(&self) -> Vec<(PathBuf, Identity)> {
        let own = rustix::process::getuid().as_raw();
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
            .filter(|(_, metadata)| metadata.uid() == own)
            .map(|(path, metadata)| (path, Identity::of(&metadata)))
            .collect()
    }

    /// Returns whether the file was removed. A lock serialises removals, so that no process removes
    /// a file that was created in place of one that another process has just removed.
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
