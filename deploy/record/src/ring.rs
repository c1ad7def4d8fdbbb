//! The last messages of a network, in memory, until something happens.

use crate::content::{AttachedFile, NewChannel, OVERHEAD};
use crate::error::RecordError;
use crate::writer::{ChannelId, Limits, Writer};
use rc_mcap::Stamp;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The last messages of a network.
pub struct Ring {
    time: Duration,
    bytes: usize,
    held: usize,
    channels: Vec<Arc<NewChannel>>,
    files: BTreeMap<String, Arc<AttachedFile>>,
    /// Each with the time of its arrival, which no change of the system's clock moves.
    messages: VecDeque<(Instant, usize, Stamp, Arc<[u8]>)>,
    /// The last document of each channel of states and parameters that is older than the messages:
    /// they are recorded only when they change.
    before: BTreeMap<usize, (Stamp, Arc<[u8]>)>,
    /// The arrival of the last message that made room before its time.
    short: Option<Instant>,
    writing: Option<JoinHandle<Result<Written, RecordError>>>,
}

/// A ring that was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Written {
    /// The file.
    pub path: PathBuf,
    /// Reason of the writing.
    pub reason: String,
    /// The number of its messages.
    pub messages: usize,
    /// The time that it holds, if there was no memory for all of the ring's time.
    pub shortened_to: Option<Duration>,
}

impl Ring {
    /// Keeps messages for `time`, at most `bytes`.
    pub fn new(time: Duration, bytes: usize) -> Self {
        Self {
            time,
            bytes,
            held: 0,
            channels: Vec::new(),
            files: BTreeMap::new(),
            messages: VecDeque::new(),
            before: BTreeMap::new(),
            short: None,
            writing: None,
        }
    }

    pub(crate) fn channel(&mut self, new: NewChannel) -> usize {
        self.channels.push(Arc::new(new));
        self.channels.len() - 1
    }

    pub(crate) fn attach(&mut self, new: AttachedFile) {
        self.files.insert(new.name.clone(), Arc::new(new));
    }

    pub(crate) fn push(&mut self, at: usize, stamp: Stamp, data: Vec<u8>) {
        self.push_at(Instant::now(), at, stamp, data);
    }

    fn push_at(&mut self, now: Instant, at: usize, stamp: Stamp, data: Vec<u8>) {
        self.held += data.len() + OVERHEAD;
        self.messages.push_back((now, at, stamp, data.into()));
        let is_over = |arrived: Instant| now.duration_since(arrived) > self.time;
        while let Some((arrived, at, stamp, data)) = self
            .messages
            .pop_front_if(|(arrived, ..)| self.held > self.bytes || is_over(*arrived))
        {
            if !is_over(arrived) {
                self.short = Some(arrived);
            }
            let replaced = if self.channels[at].is_latched() {
                self.before.insert(at, (stamp, data))
            } else {
                Some((stamp, data))
            };
            self.held -= replaced.map_or(0, |(_, data)| data.len() + OVERHEAD);
        }
    }

    /// The time that it holds, if messages had to make room before their time.
    fn shortened_to(&self, now: Instant) -> Option<Duration> {
        self.short
            .map(|arrived| now.saturating_duration_since(arrived))
            .filter(|held| *held < self.time)
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

    /// Whether a thread writes an earlier content.
    pub fn is_writing(&self) -> bool {
        self.writing.is_some()
    }

    /// Begins to write all messages into a new file, on a thread of its own, and keeps them. Does
    /// nothing while an earlier content is written.
    pub fn write(&mut self, path: &Path, reason: &str) -> Result<(), RecordError> {
        if self.is_writing() {
            return Ok(());
        }
        let limits = Limits {
            keep_free: Limits::usual_floor(path),
            ..Limits::default()
        };
        let mut writer = Writer::create(path, limits)?;
        let written = Written {
            path: path.to_owned(),
            reason: reason.to_owned(),
            messages: self.before.len() + self.messages.len(),
            shortened_to: self.shortened_to(Instant::now()),
        };
        // They hold when the first message comes.
        let first = self.messages.front().map(|(_, _, stamp, _)| stamp.log_time);
        let before: Vec<_> = self
            .before
            .iter()
            .map(|(at, (stamp, data))| {
                let log_time = first.unwrap_or(stamp.log_time);
                (*at, Stamp { log_time, ..*stamp }, Arc::clone(data))
            })
            .collect();
        let files: Vec<_> = self.files.values().cloned().collect();
        // The messages are shared, not copied.
        let (channels, messages) = (self.channels.clone(), self.messages.clone());
        let thread = std::thread::Builder::new().name("ring".to_owned());
        let thread = thread.spawn(move || {
            let write = || {
                let mut table = BTreeMap::from([("reason".to_owned(), written.reason.clone())]);
                if let Some(time) = written.shortened_to {
                    table.insert(
                        "shortened_to_s".to_owned(),
                        format!("{:.1}", time.as_secs_f64()),
                    );
                }
                writer.metadata("ring", &table)?;
                for file in files {
                    writer.attach(&file.name, file.media_type, file.data.clone())?;
                }
                let channels: Vec<ChannelId> = channels.iter().map(|new| writer.add(new)).collect();
                let messages = messages.into_iter();
                let messages = messages.map(|(_, at, stamp, data)| (at, stamp, data));
                for (at, stamp, data) in before.into_iter().chain(messages) {
                    writer.write(channels[at], stamp, &data)?;
                }
                Ok::<(), RecordError>(())
            };
            let done = write().and_then(|()| writer.finish());
            if done.is_err() {
                // A part of a ring would take the room of the next one.
                let _ = std::fs::remove_file(&written.path);
            }
            done.map(|()| written)
        });
        self.writing = Some(thread.map_err(|e| RecordError::file(path, &e))?);
        Ok(())
    }

    /// The content that was written since the last call, or why it could not be.
    pub fn written(&mut self) -> Option<Result<Written, RecordError>> {
        let done = self.writing.take_if(|thread| thread.is_finished())?;
        Some(joined(done))
    }

    /// Waits until everything is written that was begun.
    pub fn finish(&mut self) -> Option<Result<Written, RecordError>> {
        self.writing.take().map(joined)
    }
}

fn joined(thread: JoinHandle<Result<Written, RecordError>>) -> Result<Written, RecordError> {
    thread.join().unwrap_or_else(|_| {
        let text = "the thread that writes the ring panicked";
        Err(RecordError::Value(text.to_owned()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys;
    use crate::reader::{Reader, Record};

    fn channel(kind: &str) -> NewChannel {
        NewChannel {
            topic: "/a".to_owned(),
            encoding: "json",
            schema: None,
            metadata: BTreeMap::from([(keys::KIND.to_owned(), kind.to_owned())]),
        }
    }

    fn stamp(seconds: u64) -> Stamp {
        Stamp {
            log_time: seconds * 1_000_000_000,
            publish_time: 0,
            sequence: 0,
        }
    }

    #[test]
    fn a_ring_keeps_the_last_messages_within_its_time_and_its_bytes() {
        let mut ring = Ring::new(Duration::from_secs(10), 1000);
        let at = ring.channel(channel("sample"));
        // The system's clock goes back by a minute in the middle.
        let begin = Instant::now();
        for second in 100..130 {
            let time = if second < 125 { second } else { second - 60 };
            let now = begin + Duration::from_secs(second);
            ring.push_at(now, at, stamp(time), vec![0; 10]);
        }
        assert_eq!(ring.len(), 11);
        assert_eq!(ring.shortened_to(begin + Duration::from_secs(129)), None);
        let now = begin + Duration::from_secs(130);
        ring.push_at(now, at, stamp(70), vec![0; 900]);
        assert_eq!((ring.len(), ring.held()), (1, 964));
        // The one of second 129 had to make room.
        assert_eq!(ring.shortened_to(now), Some(Duration::from_secs(1)));
        assert_eq!(ring.shortened_to(now + Duration::from_secs(10)), None);

        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.mcap");
        ring.write(&path, "asked").expect("to begin");
        ring.push_at(now, at, stamp(71), vec![0; 20]);
        let written = ring.finish();
        let written = written.expect("it was begun").expect("to write");
        assert_eq!(
            (written.messages, written.reason.as_str()),
            (1, "asked"),
            "{written:?}"
        );
        let mut reader = Reader::open(&path).expect("a recording");
        let mut lengths = Vec::new();
        while let Some(record) = reader.next() {
            if let Record::Message(message) = record {
                lengths.push(message.data.len());
            }
        }
        assert_eq!((lengths, reader.faults().is_none()), (vec![900], true));
    }

    #[test]
    fn a_ring_keeps_the_last_state_that_is_older_than_its_messages() {
        let mut ring = Ring::new(Duration::from_secs(10), 1000);
        let (state, sample) = (
            ring.channel(channel("state")),
            ring.channel(channel("sample")),
        );
        let begin = Instant::now();
        for second in 0..30 {
            let now = begin + Duration::from_secs(second);
            if second < 5 {
                ring.push_at(now, state, stamp(second), vec![second as u8]);
            }
            ring.push_at(now, sample, stamp(second), vec![0; 10]);
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.mcap");
        ring.write(&path, "asked").expect("to begin");
        ring.finish().expect("it was begun").expect("to write");
        let mut reader = Reader::open(&path).expect("a recording");
        let mut first = None;
        let mut count = 0;
        while let Some(record) = reader.next() {
            if let Record::Message(message) = record {
                first.get_or_insert((message.log_time / 1_000_000_000, message.data));
                count += 1;
            }
        }
        // It has the time of the first message that is left.
        assert_eq!((first, count), (Some((19, vec![4])), 12));
        assert_eq!(ring.held(), 11 * (10 + OVERHEAD) + 1 + OVERHEAD);
    }
}
