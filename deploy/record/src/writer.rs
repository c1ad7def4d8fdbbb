//! Writes a recording.
//!
//! Messages are collected in chunks, which are compressed and written when they are full or old. A
//! file that ends anywhere holds all chunks before its end. A long recording continues in further
//! files: `x.mcap`, `x.1.mcap` …; each repeats the attachments, and the last values of states,
//! parameters and latched topics.

mod part;

use crate::content::{NewChannel, OVERHEAD};
use crate::error::RecordError;
use crate::qos;
use crate::reader::files::{NUMBER, PART, RECORDING, REPEATED, REPEATED_FILES};
use crate::schema::Schema;
use part::Part;
use rc_diagnostics::foreign::without_number;
use rc_files::Disk;
use rc_mcap::read::LONGEST;
use rc_mcap::{Stamp, system_time};
use rustix::fs::fstat;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The size of a chunk before compression, in bytes.
const CHUNK: usize = 1024 * 1024;
/// How long a message waits in memory, at most, while others follow.
const FLUSH: Duration = Duration::from_secs(1);
/// The longest message, in bytes. The rest of its record leaves room for its channel.
pub(crate) const LONGEST_MESSAGE: usize = LONGEST as usize - CHUNK;
/// The most bytes of values that each part repeats.
const MOST_REPEATED: usize = 64 << 20;
/// The table with the result of a recording: its counts, or why it ended early.
pub(crate) const TABLE: &str = "recording";
/// The name of the compression.
const COMPRESSION: &str = "lz4";

/// When a recording continues in another file.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// After this many bytes.
    pub bytes: Option<u64>,
    /// After this time.
    pub time: Option<Duration>,
    /// The bytes of the disk that stay free. If there are less, the oldest part is removed; without
    /// another part, the recording ends.
    pub keep_free: u64,
}

impl Limits {
    /// The bytes of the disk of a new file that stay free, unless others are named: a twentieth of
    /// the disk, at most 2 GiB.
    pub fn usual_floor(path: &Path) -> u64 {
        Disk::usual_floor(path)
    }

    fn splits(self) -> bool {
        self.bytes.is_some() || self.time.is_some()
    }
}

/// A further part of the recording at `path`, if there is any: `x.N.mcap` of `x.mcap`.
fn any_part(path: &Path) -> Option<PathBuf> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?;
    let stem = format!("{}.", path.file_stem()?.to_string_lossy());
    let mut paths = entries.flatten().map(|entry| entry.path());
    paths.find(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let number = name.strip_prefix(&stem);
        let number = number.and_then(|rest| rest.strip_suffix(".mcap"));
        number.is_some_and(|number| number.parse::<u32>().is_ok())
    })
}

/// A channel of a [`Writer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ChannelId(usize);

/// Writes a recording.
pub struct Writer {
    path: PathBuf,
    limits: Limits,
    /// Identifies the recording in its parts.
    id: String,
    /// The number of the oldest part that is there, and that of the present one.
    oldest: u32,
    number: u32,
    part: Option<Part>,
    channels: Vec<ChannelEntry>,
    /// Attachments of each part: name, media type, content.
    attachments: Vec<(String, String, Vec<u8>)>,
    /// The last messages of latched channels, which each part repeats, and their bytes.
    latched: BTreeMap<usize, (Stamp, Vec<u8>)>,
    held: usize,
    /// When the disk was looked at.
    looked: Instant,
    notes: Vec<String>,
}

struct ChannelEntry {
    is_latched: bool,
    topic: String,
    encoding: String,
    schema: Option<Schema>,
    metadata: BTreeMap<String, String>,
}

impl Writer {
    /// Begins a recording in a new file. Fails if the file exists, or a part of an earlier
    /// recording has a name that a part of this one would need.
    pub fn create(path: &Path, limits: Limits) -> Result<Self, RecordError> {
        if limits.splits()
            && let Some(part) = any_part(path)
        {
            let text = format!(
                "{} is a part of an earlier recording; remove it, or choose another name",
                part.display()
            );
            return Err(RecordError::Value(text));
        }
        let mut writer = Self {
            path: path.to_owned(),
            limits,
            id: format!("{}-{}", system_time(), std::process::id()),
            oldest: 0,
            number: 0,
            part: Some(Part::create(path)?),
            channels: Vec::new(),
            attachments: Vec::new(),
            latched: BTreeMap::new(),
            held: 0,
            looked: Instant::now(),
            notes: Vec::new(),
        };
        let begun = writer.look_at_disk().and_then(|()| writer.begin_part());
        if let Err(error) = begun {
            writer.part = None;
            let _ = std::fs::remove_file(path);
            return Err(error);
        }
        Ok(writer)
    }

    /// The files of the recording that are there.
    pub fn files(&self) -> Vec<PathBuf> {
        let numbers = self.oldest..=self.number;
        numbers.map(|number| self.file(number)).collect()
    }

    /// Takes the notes since the last call: which parts were removed.
    pub fn notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }

    /// The file of a part: `x.mcap`, `x.1.mcap`.
    fn file(&self, number: u32) -> PathBuf {
        match number {
            0 => self.path.clone(),
            number => self.path.with_extension(format!("{number}.mcap")),
        }
    }

    /// Does something with the present part. After an error nothing more is written.
    fn with<T>(
        &mut self,
        act: impl FnOnce(&mut Part, &[ChannelEntry]) -> std::io::Result<T>,
    ) -> Result<T, RecordError> {
        let path = self.file(self.number);
        let Some(part) = &mut self.part else {
            return Err(RecordError::file(&path, &"the recording has ended"));
        };
        act(part, &self.channels).map_err(|error| {
            self.end_early(&error);
            RecordError::file(&path, &error)
        })
    }

    /// Ends the present part where it is whole, because nothing more can be written.
    fn end_early(&mut self, reason: &impl Display) {
        if let Some(mut part) = self.part.take() {
            // A disk that cannot reserve room may have none for the summary. The file opens without
            // it.
            let _ = part.end_early(&without_number(&reason.to_string()));
        }
    }

    pub(crate) fn add(&mut self, new: &NewChannel) -> ChannelId {
        let (schema, metadata) = (new.schema.clone(), new.metadata.clone());
        self.channel(&new.topic, new.encoding, schema, metadata)
    }

    /// Adds a channel: its topic, its encoding (`cdr`, `json`), its schema and what else is known
    /// of it.
    pub fn channel(
        &mut self,
        topic: &str,
        encoding: &str,
        schema: Option<Schema>,
        metadata: BTreeMap<String, String>,
    ) -> ChannelId {
        self.channels.push(ChannelEntry {
            is_latched: self.limits.splits() && qos::is_latched(&metadata),
            topic: topic.to_owned(),
            encoding: encoding.to_owned(),
            schema,
            metadata,
        });
        ChannelId(self.channels.len() - 1)
    }

    /// Writes a message: `data` is everything, the encapsulation of CDR included.
    pub fn write(
        &mut self,
        channel: ChannelId,
        stamp: Stamp,
        data: &[u8],
    ) -> Result<(), RecordError> {
        if data.len() > LONGEST_MESSAGE {
            return Err(RecordError::Value(format!(
                "a message has {} bytes; a recording has room for {LONGEST_MESSAGE}",
                data.len()
            )));
        }
        self.split_if_due(stamp.log_time)?;
        self.look_if_due()?;
        self.with(|part, channels| part.message(channel.0, &channels[channel.0], stamp, data))?;
        if self.channels[channel.0].is_latched {
            self.latch(channel.0, stamp, data);
        }
        Ok(())
    }

    /// Keeps a value for the next parts.
    fn latch(&mut self, channel: usize, stamp: Stamp, data: &[u8]) {
        let before = self.latched.remove(&channel);
        self.held -= before.map_or(0, |(_, data)| data.len() + OVERHEAD);
        if self.held + data.len() + OVERHEAD <= MOST_REPEATED {
            self.held += data.len() + OVERHEAD;
            self.latched.insert(channel, (stamp, data.to_vec()));
        }
    }

    /// Writes what has waited for a second, so that a kill loses no more. Call it now and then.
    pub fn flush_if_due(&mut self) -> Result<(), RecordError> {
        self.look_if_due()?;
        self.with(|part, _| part.flush_if_due())
    }

    fn look_if_due(&mut self) -> Result<(), RecordError> {
        if self.looked.elapsed() < FLUSH {
            return Ok(());
        }
        self.looked = Instant::now();
        self.look_at_disk()
    }

    /// Fails if the file was removed, or if the disk has less room than is kept free and no older
    /// part can make room.
    fn look_at_disk(&mut self) -> Result<(), RecordError> {
        self.check_file()?;
        while let Some(part) = &self.part
            && Disk::free_of(&part.file) < self.limits.keep_free
        {
            if self.oldest == self.number {
                let kib = self.limits.keep_free >> 10;
                let reason = format!("the disk has less than {kib} KiB free, which are kept");
                self.end_early(&reason);
                return Err(RecordError::file(&self.file(self.number), &reason));
            }
            let oldest = self.file(self.oldest);
            self.oldest += 1;
            let removed = std::fs::remove_file(&oldest);
            self.notes.push(match removed {
                Ok(()) => format!("{} was removed to keep the disk free", oldest.display()),
                Err(error) => format!("{} cannot be removed: {error}", oldest.display()),
            });
        }
        Ok(())
    }

    /// Fails if the present file was removed.
    fn check_file(&mut self) -> Result<(), RecordError> {
        if let Some(part) = &self.part
            && fstat(&part.file).is_ok_and(|file| file.st_nlink == 0)
        {
            self.part = None;
            let path = self.file(self.number);
            return Err(RecordError::file(
                &path,
                &"it was removed while it was recorded",
            ));
        }
        Ok(())
    }

    /// Continues in another part if the present one is full. `time` is that of the next message.
    fn split_if_due(&mut self, time: u64) -> Result<(), RecordError> {
        let Some(part) = &self.part else {
            return Ok(());
        };
        let long = self
            .limits
            .time
            .is_some_and(|time| part.began.elapsed() >= time);
        let large = self
            .limits
            .bytes
            .is_some_and(|bytes| part.at + part.chunk.len() as u64 >= bytes);
        if (long || large) && part.has_own_messages {
            self.close()?;
            self.number += 1;
            self.part = Some(Part::create(&self.file(self.number))?);
            self.begin_part()?;
            let attachments = std::mem::take(&mut self.attachments);
            for (name, media_type, data) in &attachments {
                self.with(|part, _| part.attach(name, media_type, data))?;
            }
            self.attachments = attachments;
            let latched = std::mem::take(&mut self.latched);
            for (channel, (stamp, data)) in &latched {
                // The time of sending stays.
                let stamp = Stamp {
                    log_time: time,
                    ..*stamp
                };
                self.with(|part, all| part.message(*channel, &all[*channel], stamp, data))?;
            }
            self.latched = latched;
            self.with(|part, _| {
                part.has_own_messages = false;
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Writes into a part to which recording it belongs, and what it repeats.
    fn begin_part(&mut self) -> Result<(), RecordError> {
        if !self.limits.splits() {
            return Ok(());
        }
        let entries = [
            (RECORDING, self.id.clone()),
            (NUMBER, self.number.to_string()),
            (REPEATED, self.latched.len().to_string()),
            (REPEATED_FILES, self.attachments.len().to_string()),
        ];
        let entries = entries.map(|(key, value)| (key.to_owned(), value));
        self.metadata(PART, &entries.into())
    }

    /// Adds a file that belongs to the recording. Each part holds it.
    pub fn attach(
        &mut self,
        name: &str,
        media_type: &str,
        data: Vec<u8>,
    ) -> Result<(), RecordError> {
        self.with(|part, _| part.attach(name, media_type, &data))?;
        if !self.limits.splits() {
            return Ok(());
        }
        // A further part holds the last one of each name.
        self.attachments.retain(|(known, ..)| known != name);
        self.attachments
            .push((name.to_owned(), media_type.to_owned(), data));
        Ok(())
    }

    /// Adds a table of texts.
    pub fn metadata(
        &mut self,
        name: &str,
        table: &BTreeMap<String, String>,
    ) -> Result<(), RecordError> {
        self.with(|part, _| part.metadata(name, table))
    }

    fn close(&mut self) -> Result<(), RecordError> {
        self.check_file()?;
        self.with(|part, _| part.finish())?;
        self.part = None;
        Ok(())
    }

    /// Ends the recording.
    pub fn finish(mut self) -> Result<(), RecordError> {
        self.close()
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        if self.part.is_some() {
            let _ = self.close();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_parts_make_room_and_the_last_one_is_complete() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.mcap");
        let limits = Limits {
            bytes: Some(1000),
            ..Limits::default()
        };
        let mut writer = Writer::create(&path, limits).expect("to create");
        let channel = writer.channel("/a", "json", None, BTreeMap::new());
        for _ in 0..3 {
            let written = writer.write(channel, Stamp::default(), &[0; 2000]);
            written.expect("to write");
        }
        let files = writer.files();
        assert_eq!(files.len(), 3);
        writer.limits.keep_free = u64::MAX;
        let error = writer.look_at_disk().expect_err("no room").to_string();
        assert!(error.contains("free, which are kept"), "{error}");
        assert_eq!(writer.files(), files[2..]);
        assert_eq!(writer.notes().len(), 2);
        let left: Vec<bool> = files.iter().map(|file| file.exists()).collect();
        assert_eq!(left, [false, false, true]);
        let info = crate::bag::Info::read(&files[2]).expect("a recording");
        assert_eq!((info.messages(), info.faults.is_none()), (1, true));
        let ended = &info.metadata[TABLE]["ended"];
        assert!(ended.contains("free, which are kept"), "{ended}");
    }
}
