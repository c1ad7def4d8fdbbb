//! Where messages of a running network go: into a file, on a thread of its own, or into a ring in
//! memory.

use crate::content::{AttachedFile, NewChannel, OVERHEAD};
use crate::error::RecordError;
use crate::ring::Ring;
use crate::writer::{LONGEST_MESSAGE, Limits, Writer};
use rc_mcap::Stamp;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// The most bytes that wait for the disk.
pub const QUEUE: usize = 256 * 1024 * 1024;
/// How often a file without new messages is flushed.
const IDLE: Duration = Duration::from_millis(500);

enum Job {
    Channel(NewChannel),
    Message(usize, Stamp, Vec<u8>),
    Attach(AttachedFile),
    Table(String, BTreeMap<String, String>),
}

impl Job {
    /// Approximate size in memory, in bytes.
    fn size(&self) -> usize {
        OVERHEAD
            + match self {
                Self::Message(_, _, data) => data.len(),
                Self::Attach(file) => file.data.len(),
                Self::Channel(new) => new.schema.as_ref().map_or(0, |schema| schema.text.len()),
                Self::Table(..) => 0,
            }
    }
}

/// A file that a thread writes.
pub struct FileSink {
    jobs: Option<Sender<Job>>,
    waiting: Arc<AtomicUsize>,
    notes: Arc<Mutex<Vec<String>>>,
    thread: Option<JoinHandle<Result<Vec<PathBuf>, RecordError>>>,
    channels: usize,
}

impl FileSink {
    /// Begins a file.
    pub fn create(path: &Path, limits: Limits) -> Result<Self, RecordError> {
        let mut writer = Writer::create(path, limits)?;
        let (jobs, received) = channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let left = Arc::clone(&waiting);
        let notes = Arc::new(Mutex::new(Vec::new()));
        let noted = Arc::clone(&notes);
        let thread = std::thread::Builder::new().name("recording".to_owned());
        let thread = thread
            .spawn(move || {
                run(&mut writer, &received, &left, &noted)?;
                let files = writer.files();
                writer.finish()?;
                Ok(files)
            })
            .map_err(|e| RecordError::file(path, &e))?;
        Ok(Self {
            jobs: Some(jobs),
            waiting,
            notes,
            thread: Some(thread),
            channels: 0,
        })
    }

    /// The bytes that wait for the disk.
    pub fn waiting(&self) -> usize {
        self.waiting.load(Ordering::Relaxed)
    }

    /// Takes the notes since the last call: which parts were removed.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = self.notes.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut notes)
    }

    /// Whether the thread has ended: the disk refuses.
    pub fn has_failed(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Passes a job on. `false`: there is no room for it.
    fn push(&self, job: Job) -> bool {
        let size = job.size();
        let must = matches!(job, Job::Channel(_) | Job::Table(..));
        if !must && self.waiting() + size > QUEUE {
            return false;
        }
        self.waiting.fetch_add(size, Ordering::Relaxed);
        // After a failure, the thread takes no more.
        self.jobs
            .as_ref()
            .is_some_and(|jobs| jobs.send(job).is_ok())
    }

    /// Ends the file. Returns its parts.
    pub fn finish(mut self) -> Result<Vec<PathBuf>, RecordError> {
        self.jobs = None;
        let ended = self.thread.take().map(JoinHandle::join);
        let panicked =
            || RecordError::Value("the thread that writes the recording panicked".to_owned());
        ended
            .and_then(Result::ok)
            .unwrap_or_else(|| Err(panicked()))
    }
}

fn run(
    writer: &mut Writer,
    jobs: &Receiver<Job>,
    waiting: &AtomicUsize,
    notes: &Mutex<Vec<String>>,
) -> Result<(), RecordError> {
    let mut channels = Vec::new();
    loop {
        let new = writer.notes();
        if !new.is_empty() {
            let mut notes = notes.lock().unwrap_or_else(PoisonError::into_inner);
            notes.extend(new);
        }
        let job = match jobs.recv_timeout(IDLE) {
            Ok(job) => job,
            Err(RecvTimeoutError::Timeout) => {
                writer.flush_if_due()?;
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        };
        let size = job.size();
        match job {
            Job::Channel(new) => channels.push(writer.add(&new)),
            Job::Message(at, stamp, data) => writer.write(channels[at], stamp, &data)?,
            Job::Attach(file) => writer.attach(&file.name, file.media_type, file.data)?,
            Job::Table(name, table) => writer.metadata(&name, &table)?,
        }
        waiting.fetch_sub(size, Ordering::Relaxed);
    }
}

/// A file or a ring.
pub enum Sink {
    /// A file.
    File(FileSink),
    /// A ring.
    Ring(Ring),
}

impl Sink {
    /// Adds a channel and returns its number.
    pub(crate) fn channel(&mut self, new: NewChannel) -> usize {
        match self {
            Self::File(file) => {
                file.push(Job::Channel(new));
                file.channels += 1;
                file.channels - 1
            }
            Self::Ring(ring) => ring.channel(new),
        }
    }

    /// Adds a message. `false`: there is no room for it.
    pub(crate) fn message(&mut self, at: usize, stamp: Stamp, data: Vec<u8>) -> bool {
        if data.len() > LONGEST_MESSAGE {
            return false;
        }
        match self {
            Self::File(file) => file.push(Job::Message(at, stamp, data)),
            Self::Ring(ring) => {
                ring.push(at, stamp, data);
                true
            }
        }
    }

    /// Adds a file that belongs to the recording. `false`: there is no room for it.
    pub(crate) fn attach(&mut self, new: AttachedFile) -> bool {
        match self {
            Self::File(file) => file.push(Job::Attach(new)),
            Self::Ring(ring) => {
                ring.attach(new);
                true
            }
        }
    }

    /// Adds a table of texts to a file. A ring has none before it is written.
    pub(crate) fn table(&mut self, name: &str, table: BTreeMap<String, String>) {
        if let Self::File(file) = self {
            file.push(Job::Table(name.to_owned(), table));
        }
    }
}
