//! Hashes of files that have not changed since they were read. A component in Python has thousands of
//! packages' files, and nearly all of them stay from one start to the next.

use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::fs;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

/// A file that was changed within this time may be changed again without a new time of its change:
/// file systems count time in steps, some in those of two seconds.
const UNSETTLED: Duration = Duration::from_secs(3);

/// The most bytes of a list.
const LONGEST: u64 = 256 << 20;

/// The data that differ after a change of a file. Nobody can set the time `changed` (`ctime`), so a
/// copy with the old size and the old time of modification differs, too.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Stamp {
    device: u64,
    inode: u64,
    size: u64,
    /// Seconds and nanoseconds since 1970.
    modified: (i64, i64),
    changed: (i64, i64),
}

impl Stamp {
    pub(super) fn of(file: &fs::Metadata) -> Self {
        Self {
            device: file.dev(),
            inode: file.ino(),
            size: file.size(),
            modified: (file.mtime(), file.mtime_nsec()),
            changed: (file.ctime(), file.ctime_nsec()),
        }
    }

    /// Whether a later change has another time, at `now`.
    fn is_settled(&self, now: SystemTime) -> bool {
        let (seconds, nanoseconds) = self.changed;
        let (Ok(seconds), Ok(nanoseconds)) = (seconds.try_into(), nanoseconds.try_into()) else {
            return false;
        };
        let changed = SystemTime::UNIX_EPOCH.checked_add(Duration::new(seconds, nanoseconds));
        changed.is_some_and(|changed| {
            now.duration_since(changed)
                .is_ok_and(|age| age >= UNSETTLED)
        })
    }
}

/// The hashes of files, by their paths. They are kept in a file.
#[derive(Debug)]
pub(crate) struct KnownHashes {
    place: PathBuf,
    before: HashMap<PathBuf, (Stamp, String)>,
    /// Hashes that were requested in this run.
    now: HashMap<PathBuf, (Stamp, String)>,
    begun: SystemTime,
}

impl KnownHashes {
    /// Reads the list at `place`. A list that is missing or damaged is empty.
    pub(crate) fn read(place: PathBuf) -> Self {
        Self::read_at(place, SystemTime::now())
    }

    pub(super) fn read_at(place: PathBuf, begun: SystemTime) -> Self {
        let read = |place: &Path| -> io::Result<HashMap<_, _>> {
            let file = BufReader::new(rc_files::open_regular(place)?);
            Ok(serde_json::from_reader(file.take(LONGEST))?)
        };
        let before = read(&place).unwrap_or_default();
        Self {
            place,
            before,
            now: HashMap::new(),
            begun,
        }
    }

    /// The hash of the file at `path`, if it is as it was.
    pub(super) fn get(&mut self, path: &Path, stamp: &Stamp) -> Option<String> {
        let (path, known) = self.before.remove_entry(path)?;
        if known.0 != *stamp {
            return None;
        }
        let hash = known.1.clone();
        self.now.insert(path, known);
        Some(hash)
    }

    /// Keeps the hash of a file that had this stamp before and after it was read.
    pub(super) fn keep(&mut self, path: &Path, stamp: Stamp, hash: &str) {
        if stamp.is_settled(self.begun) {
            let known = (stamp, hash.to_owned());
            self.now.insert(path.to_path_buf(), known);
        }
    }

    /// Keeps the hash of the file at `path`, which this process has just written. No program of the
    /// network runs yet.
    pub(super) fn keep_own(&mut self, path: &Path, hash: &str) {
        if let Ok(file) = fs::symlink_metadata(path) {
            let known = (Stamp::of(&file), hash.to_owned());
            self.now.insert(path.to_path_buf(), known);
        }
    }

    /// Forgets the files that were not asked for, and replaces the list.
    pub(crate) fn finish(mut self) {
        self.before.clear();
    }
}

/// Replaces the list, atomically, also after an error: files that were read are not read again.
/// Without a list, all files are read again.
impl Drop for KnownHashes {
    fn drop(&mut self) {
        // Another start of the same network may write its list now.
        static LISTS: AtomicU64 = AtomicU64::new(0);
        let (process, list) = (std::process::id(), LISTS.fetch_add(1, Ordering::Relaxed));
        let new = self.place.with_extension(format!("{process}-{list}.new"));
        let mut all = std::mem::take(&mut self.before);
        all.extend(self.now.drain());
        let write = || -> io::Result<()> {
            let mut out = BufWriter::new(fs::File::create(&new)?);
            serde_json::to_writer(&mut out, &all)?;
            out.flush()?;
            fs::rename(&new, &self.place)
        };
        if write().is_err() {
            let _ = fs::remove_file(&new);
        }
    }
}
