//! Where messages of a running network go: to a file, on a thread of its own, or into a ring in memory.

use crate::error::RecordError;
use crate::schema::Schema;
use crate::writer::{ChannelId, Limits, Writer};
use rc_mcap::Stamp;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// The most bytes that wait for the disk.
pub const QUEUE: usize = 256 * 1024 * 1024;
/// How often a file without new messages is flushed.
const IDLE: Duration = Duration::from_secs(1);
/// What a message takes in memory beside its bytes.
const OVERHEAD: usize = 64;

/// A channel.
#[derive(Clone, Debug)]
pub struct NewChannel {
    /// Its topic.
    pub topic: String,
    /// The encoding of its messages.
    pub encoding: &'static str,
    /// Its type.
    pub schema: Option<Schema>,
    /// What else is known of it.
    pub metadata: BTreeMap<String, String>,
}

/// A file that belongs to a recording.
#[derive(Clone, Debug)]
pub struct File {
    /// Its name.
    pub name: String,
    /// What it is.
    pub media_type: &'static str,
    /// Its content.
    pub data: Vec<u8>,
}

enum Job {
    Channel(NewChannel),
    Message(usize, Stamp, Vec<u8>),
    Attach(File),
    Table(String, BTreeMap<String, String>),
}

fn add(writer: &mut Writer, new: NewChannel) -> ChannelId {
    writer.channel(&new.topic, new.encoding, new.schema, new.metadata)
}

/// A file that a thread writes.
pub struct FileSink {
    jobs: Option<Sender<Job>>,
    waiting: Arc<AtomicUsize>,
    written: Arc<AtomicU64>,
    thread: Option<JoinHandle<Result<Vec<PathBuf>, RecordError>>>,
    channels: usize,
}

impl FileSink {
    /// Begins a file.
    pub fn create(path: &Path, limits: Limits) -> Result<Self, RecordError> {
        let mut writer = Writer::create(path, limits)?;
        let (jobs, received) = channel();
        let (waiting, written) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicU64::new(0)));
        let (left, done) = (Arc::clone(&waiting), Arc::clone(&written));
        let thread = std::thread::Builder::new().name("recording".to_owned());
        let thread = thread
            .spawn(move || {
                run(&mut writer, &received, &left, &done)?;
                let files = writer.files();
                writer.finish()?;
                Ok(files)
            })
            .map_err(|e| RecordError::file(path, &e))?;
        Ok(Self {
            jobs: Some(jobs),
            waiting,
            written,
            thread: Some(thread),
            channels: 0,
        })
    }

    /// The bytes that wait for the disk.
    pub fn waiting(&self) -> usize {
        self.waiting.load(Ordering::Relaxed)
    }

    /// The bytes of messages that were written.
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Whether the thread has ended: the disk refuses.
    pub fn has_failed(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    fn push(&self, job: Job) {
        if let Some(jobs) = &self.jobs {
            // After a failure, the thread takes no more.
            let _ = jobs.send(job);
        }
    }

    /// Ends the file. Returns its parts.
    pub fn finish(mut self) -> Result<Vec<PathBuf>, RecordError> {
        self.jobs = None;
        let thread = self.thread.take();
        let ended = thread.map(JoinHandle::join);
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
    written: &AtomicU64,
) -> Result<(), RecordError> {
    let mut channels = Vec::new();
    loop {
        match jobs.recv_timeout(IDLE) {
            Ok(Job::Channel(new)) => channels.push(add(writer, new)),
            Ok(Job::Message(at, stamp, data)) => {
                writer.write(channels[at], stamp, &data)?;
                waiting.fetch_sub(data.len() + OVERHEAD, Ordering::Relaxed);
                written.fetch_add(data.len() as u64, Ordering::Relaxed);
            }
            Ok(Job::Attach(file)) => writer.attach(&file.name, file.media_type, file.data)?,
            Ok(Job::Table(name, table)) => writer.metadata(&name, &table)?,
            Err(RecvTimeoutError::Timeout) => writer.flush_if_due()?,
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
}

/// The last messages, in memory.
pub struct Ring {
    time: Duration,
    bytes: usize,
    held: usize,
    channels: Vec<NewChannel>,
    files: Vec<File>,
    messages: VecDeque<(usize, Stamp, Vec<u8>)>,
}

impl Ring {
    /// Keeps messages for `time`, at most `bytes`.
    pub fn new(time: Duration, bytes: usize) -> Self {
        Self {
            time,
            bytes,
            held: 0,
            channels: Vec::new(),
            files: Vec::new(),
            messages: VecDeque::new(),
        }
    }

    fn push(&mut self, at: usize, stamp: Stamp, data: Vec<u8>) {
        self.held += data.len() + OVERHEAD;
        self.messages.push_back((at, stamp, data));
        let oldest = stamp.log_time.saturating_sub(self.time.as_nanos() as u64);
        while let Some((_, first, data)) = self.messages.front()
            && (first.log_time < oldest || self.held > self.bytes)
        {
            self.held -= data.len() + OVERHEAD;
            self.messages.pop_front();
        }
    }

    /// The number of messages.
    pub fn len(&self) -> usize {
        self.messages.len()
    }

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        self.messages.is_empty()
    }

    /// The bytes that it holds.
    pub fn held(&self) -> usize {
        self.held
    }

    /// Writes all messages into a new file, and keeps them. `reason` says why.
    pub fn write(&self, path: &Path, reason: &str) -> Result<(), RecordError> {
        let mut writer = Writer::create(path, Limits::default())?;
        for file in &self.files {
            writer.attach(&file.name, file.media_type, file.data.clone())?;
        }
        let table = BTreeMap::from([("reason".to_owned(), reason.to_owned())]);
        writer.metadata("ring", &table)?;
        let channels = self.channels.iter().cloned();
        let channels: Vec<ChannelId> = channels.map(|new| add(&mut writer, new)).collect();
        for (at, stamp, data) in &self.messages {
            writer.write(channels[*at], *stamp, data)?;
        }
        writer.finish()
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
    pub fn channel(&mut self, new: NewChannel) -> usize {
        match self {
            Self::File(file) => {
                file.push(Job::Channel(new));
                file.channels += 1;
                file.channels - 1
            }
            Self::Ring(ring) => {
                ring.channels.push(new);
                ring.channels.len() - 1
            }
        }
    }

    /// Adds a message. `false`: there is no room for it.
    pub fn message(&mut self, at: usize, stamp: Stamp, data: Vec<u8>) -> bool {
        match self {
            Self::File(file) => {
                let size = data.len() + OVERHEAD;
                if file.waiting() + size > QUEUE {
                    return false;
                }
                file.waiting.fetch_add(size, Ordering::Relaxed);
                file.push(Job::Message(at, stamp, data));
            }
            Self::Ring(ring) => ring.push(at, stamp, data),
        }
        true
    }

    /// Adds a file that belongs to the recording.
    pub fn attach(&mut self, new: File) {
        match self {
            Self::File(file) => file.push(Job::Attach(new)),
            Self::Ring(ring) => {
                ring.files.retain(|file| file.name != new.name);
                ring.files.push(new);
            }
        }
    }

    /// Adds a table of texts to a file.
    pub fn table(&mut self, name: &str, table: BTreeMap<String, String>) {
        if let Self::File(file) = self {
            file.push(Job::Table(name.to_owned(), table));
        }
    }
}
