//! Reads a recording from its beginning, record by record, also one that was cut or is damaged.
//!
//! At most one record of the file and one chunk are in memory, each of at most [`LONGEST`] bytes,
//! and the definitions, whose sum has a bound, too.

mod definitions;
mod faults;
pub(crate) mod files;
mod input;

pub use faults::Faults;

use crate::error::RecordError;
use crate::qos;
use definitions::Definitions;
use input::{Input, check_length, damaged_zstd, decompress};
use rc_diagnostics::foreign::clean;
use rc_mcap::read::{LONGEST, PREFIX, Record as Raw, Summary, next, prefix};
use rc_mcap::{MAGIC, op};
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A channel of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Number in the recording. The parts of a recording may number it differently.
    pub id: u32,
    /// Topic of the messages.
    pub topic: String,
    /// The encoding of its messages.
    pub encoding: String,
    /// The name of its type; empty without a schema.
    pub type_name: String,
    /// The encoding of its schema: `ros2msg`, `jsonschema` …
    pub schema_encoding: String,
    /// The definition of its type, shared by all its channels.
    pub schema: Arc<[u8]>,
    /// Further facts, by key.
    pub metadata: BTreeMap<String, String>,
}

impl Channel {
    /// An entry of its metadata.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.metadata.get(key).map(String::as_str)
    }

    /// Whether its last message holds until the next one: a state, parameters, or a topic whose
    /// samples reach late subscribers.
    pub fn is_latched(&self) -> bool {
        qos::is_latched(&self.metadata)
    }
}

/// A message.
#[derive(Clone, Debug)]
pub struct Message {
    /// Channel of the message.
    pub channel: Arc<Channel>,
    /// Number at the sender.
    pub sequence: u32,
    /// When it was recorded, in nanoseconds.
    pub log_time: u64,
    /// When it was sent, in nanoseconds.
    pub publish_time: u64,
    /// Encoded message.
    pub data: Vec<u8>,
}

/// A file inside a recording.
#[derive(Clone, Debug)]
pub struct Attachment {
    /// File name.
    pub name: String,
    /// Media type, such as `text/plain`.
    pub media_type: String,
    /// Bytes of the file.
    pub data: Vec<u8>,
}

/// Contents of a recording.
#[derive(Clone, Debug)]
pub enum Record {
    /// A message.
    Message(Message),
    /// A file.
    Attachment(Attachment),
    /// A table of texts.
    Metadata(String, BTreeMap<String, String>),
}

/// The times of a recording, as the summaries of its files say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Times {
    /// The first time of recording; `None` without a summary.
    pub first: Option<u64>,
    /// The last one; `None` if a file has no summary.
    pub last: Option<u64>,
    /// Whether each chunk is later than those before it.
    pub is_ordered: bool,
}

/// Reads a recording.
pub struct Reader {
    files: Vec<PathBuf>,
    /// The index of the present file.
    present: usize,
    input: Input,
    /// Where the next record of the present file begins.
    at: u64,
    /// Where chunks and other records of the present file are: those that follow, the next one
    /// last.
    places: Vec<(u64, u64)>,
    definitions: Definitions,
    /// The rest of the present chunk.
    chunk: Vec<u8>,
    left: Range<usize>,
    waiting: Option<Record>,
    times: Times,
    /// The channels with messages, if all summaries list them.
    listed: Option<Vec<Arc<Channel>>>,
    /// How many messages and attachments repeat those of the part before.
    repeated: u64,
    repeated_files: u64,
    /// The time after which nothing is read.
    end: u64,
    faults: Faults,
    has_ended: bool,
}

/// The damage of a record.
enum Fault {
    /// It is skipped: the next record is known.
    Record(String),
    /// Nothing more can be read of its file.
    File(String),
    /// Nothing more is read of the recording.
    End(String),
}

/// Whether the summary lists the places of such records.
fn is_of_summary(code: u8) -> bool {
    matches!(code, op::CHUNK | op::ATTACHMENT | op::METADATA)
}

impl Reader {
    /// Opens a recording: a file, also one that is compressed with zstd, the first of the parts of
    /// a long recording, or a folder of rosbag2. Fails if it is not MCAP.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let (files, missing) = files::files(path)?;
        let faults = Faults {
            missing,
            ..Faults::default()
        };
        let first = files.first().map_or(path, PathBuf::as_path);
        let input = Input::open(first).map_err(|e| RecordError::file(first, &e))?;
        let mut reader = Self {
            input,
            present: 0,
            at: 0,
            places: Vec::new(),
            definitions: Definitions::default(),
            chunk: Vec::new(),
            left: 0..0,
            waiting: None,
            times: Times::default(),
            listed: None,
            repeated: 0,
            repeated_files: 0,
            end: u64::MAX,
            faults,
            has_ended: false,
            files,
        };
        reader.read_summaries()?;
        if reader.present > 0 {
            reader.begin(0)?;
        }
        Ok(reader)
    }

    /// Reads the summaries of all files.
    fn read_summaries(&mut self) -> Result<(), RecordError> {
        let mut times = Times {
            is_ordered: true,
            ..Times::default()
        };
        let mut last = 0;
        let mut listed = Some(Vec::new());
        for at in 0..self.files.len() {
            let Some(summary) = self.begin(at)? else {
                self.listed = None;
                // A part without a summary may hold anything; the first time of others is true.
                self.times.first = times.first;
                return Ok(());
            };
            if let Some((first, end)) = summary.times {
                times.first = Some(times.first.map_or(first, |before: u64| before.min(first)));
                times.is_ordered &= summary.is_ordered && first >= last;
                last = end;
                times.last = times.last.max(Some(end));
                let channels = summary.channels.iter();
                let channels = channels.map(|id| self.definitions.channel(*id).cloned());
                let channels: Option<Vec<_>> = channels.collect();
                let channels = channels.filter(|channels| !channels.is_empty());
                listed = listed.zip(channels).map(|(mut all, more)| {
                    all.extend(more);
                    all
                });
            }
        }
        times.is_ordered &= times.first.is_some();
        self.times = times;
        self.listed = listed.map(|mut all| {
            all.sort_unstable_by_key(|channel| channel.id);
            all.dedup_by_key(|channel| channel.id);
            all
        });
        Ok(())
    }

    /// Begins to read a file. Returns its summary.
    fn begin(&mut self, at: usize) -> Result<Option<Summary>, RecordError> {
        let path = &self.files[at];
        let file_error = |e: std::io::Error| RecordError::file(path, &e);
        if at != self.present {
            self.input = Input::open(path).map_err(file_error)?;
        }
        let summary = self.input.summary();
        let mut begin = [0; MAGIC.len()];
        let read = self.input.read_exact(&mut begin);
        if read.is_err() || begin != MAGIC {
            let reason = match read {
                Err(error) if self.input.length().is_none() => damaged_zstd(&error),
                _ => "it does not begin as an MCAP file does".to_owned(),
            };
            let path = path.clone();
            return Err(RecordError::NoRecording { path, reason });
        }
        (self.present, self.at) = (at, MAGIC.len() as u64);
        (self.repeated, self.repeated_files) = (0, 0);
        self.definitions.next_file();
        self.places.clear();
        let Some((records, mut summary)) = summary else {
            return Ok(None);
        };
        self.places = std::mem::take(&mut summary.places);
        self.places.reverse();
        // A chunk that is damaged may hold definitions; the summary repeats them.
        let mut rest = records.as_slice();
        while let Ok(Some((code, body))) = next(&mut rest) {
            if matches!(code, op::SCHEMA | op::CHANNEL)
                && let Ok(raw) = Raw::parse(code, body)
                && let Err(Fault::End(reason)) = self.record(raw)
            {
                let path = self.files[at].clone();
                return Err(RecordError::NoRecording { path, reason });
            }
        }
        Ok(Some(summary))
    }

    /// The files of the recording, in their order.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// The times of the recording.
    pub fn times(&self) -> Times {
        self.times
    }

    /// The channels that have messages, if the summaries say so.
    pub fn listed(&self) -> Option<&[Arc<Channel>]> {
        self.listed.as_deref()
    }

    /// Ends before the first chunk whose messages are all later, if the chunks of the file are in
    /// the order of time. Otherwise, an earlier message may follow, and all are read.
    pub fn end_after(&mut self, time: u64) {
        self.end = time;
    }

    /// The channels that were read so far.
    pub fn channels(&self) -> impl Iterator<Item = &Arc<Channel>> {
        self.definitions.all().iter()
    }

    /// Why less was read so far than was recorded.
    pub fn faults(&self) -> &Faults {
        &self.faults
    }

    /// The next record; `None` at the end, or if nothing more can be read.
    #[allow(
        clippy::should_implement_trait,
        reason = "an iterator would hide the faults"
    )]
    pub fn next(&mut self) -> Option<Record> {
        while self.waiting.is_none() && !self.has_ended {
            let fault = if self.left.is_empty() {
                self.step()
            } else {
                self.step_in_chunk()
            };
            if let Err(fault) = fault {
                self.skip(fault);
            }
        }
        self.waiting.take()
    }

    /// Continues after the damage, if something follows.
    fn skip(&mut self, fault: Fault) {
        match fault {
            Fault::Record(reason) => {
                self.faults.damaged += 1;
                self.faults.damage.get_or_insert_with(|| clean(&reason));
            }
            Fault::File(reason) => {
                self.cut(&reason);
                self.end_file();
            }
            Fault::End(reason) => {
                self.cut(&reason);
                self.has_ended = true;
            }
        }
    }

    fn cut(&mut self, reason: &str) {
        self.faults.cut.get_or_insert_with(|| clean(reason));
    }

    /// Goes on with the next file.
    fn end_file(&mut self) {
        (self.chunk, self.left) = (Vec::new(), 0..0);
        let following = self.present + 1;
        if following == self.files.len() {
            self.has_ended = true;
        } else if let Err(error) = self.begin(following) {
            self.cut(&error.to_string());
            self.has_ended = true;
        }
    }

    /// Reads a record of the file.
    fn step(&mut self) -> Result<(), Fault> {
        let ends = || "it ends in the middle of a record".to_owned();
        let mut is_listed = false;
        while let Some((place, _)) = self.places.pop_if(|(place, _)| *place <= self.at) {
            is_listed |= place == self.at;
        }
        let mut begin = [0; PREFIX];
        if self.input.read_exact(&mut begin).is_err() {
            return Err(self.go_on(ends()));
        }
        let (code, length) = prefix(&begin).unwrap_or_default();
        let end = self.at.saturating_add(PREFIX as u64).saturating_add(length);
        let is_end = matches!(code, op::DATA_END | op::FOOTER);
        // A record that reaches into the next one is damaged, unless it is in the summary.
        while let Some((place, size)) = self.places.last().copied()
            && (end > place || is_end)
        {
            if self.goes_to(place, size) {
                return Err(Fault::Record("a record is damaged".to_owned()));
            }
            self.places.pop();
            let back = self.input.seek(self.at + PREFIX as u64);
            back.map_err(|e| Fault::File(e.to_string()))?;
        }
        if is_end {
            // The following records repeat earlier ones.
            self.end_file();
            return Ok(());
        }
        if length > LONGEST {
            return Err(self.go_on(format!("a record has {length} bytes")));
        }
        // A false length allocates no more than the file has.
        let most = self
            .input
            .length()
            .map_or(0, |all| all.saturating_sub(self.at));
        let mut body = Vec::new();
        let reserved = body.try_reserve_exact(length.min(most) as usize);
        reserved.map_err(|e| Fault::End(e.to_string()))?;
        let read = (&mut self.input).take(length).read_to_end(&mut body);
        match read {
            Ok(read) if (read as u64) < length => return Err(self.go_on(ends())),
            Ok(_) => {}
            Err(error) => return Err(self.go_on(error.to_string())),
        }
        self.at = end;
        if is_listed && !is_of_summary(code) {
            // Its first byte is damaged: records of an unknown kind are left out.
            return Err(Fault::Record("a record is damaged".to_owned()));
        }
        let raw = Raw::parse(code, &body).map_err(Fault::Record)?;
        let Raw::Chunk {
            begin,
            size,
            crc,
            compression,
            records,
        } = raw
        else {
            return self.record(raw);
        };
        if self.times.is_ordered && begin > self.end {
            self.has_ended = true;
            return Ok(());
        }
        let (chunk, left) = if compression.is_empty() {
            check_length(records.len(), size).map_err(Fault::Record)?;
            // The records are the last field.
            let left = body.len() - records.len()..body.len();
            (body, left)
        } else {
            let chunk = decompress(compression, records, size).map_err(Fault::Record)?;
            let left = 0..chunk.len();
            (chunk, left)
        };
        if crc != 0 && crc != crc32fast::hash(&chunk[left.clone()]) {
            return Err(Fault::Record("a chunk is damaged".to_owned()));
        }
        (self.chunk, self.left) = (chunk, left);
        Ok(())
    }

    /// Goes to the next place that the summary knows, if there is one.
    fn go_on(&mut self, reason: String) -> Fault {
        while let Some((place, size)) = self.places.pop() {
            if self.goes_to(place, size) {
                return Fault::Record(reason);
            }
        }
        Fault::File(reason)
    }

    /// Goes to a place of the summary. Says whether the record of this length is there.
    fn goes_to(&mut self, place: u64, size: u64) -> bool {
        let mut begin = [0; PREFIX];
        let is_there = self.input.seek(place).is_ok()
            && self.input.read_exact(&mut begin).is_ok()
            && prefix(&begin).is_some_and(|(code, length)| {
                is_of_summary(code) && length.checked_add(PREFIX as u64) == Some(size)
            });
        if is_there && self.input.seek(place).is_ok() {
            self.at = place;
            return true;
        }
        false
    }

    /// Reads a record of the present chunk.
    fn step_in_chunk(&mut self) -> Result<(), Fault> {
        let chunk = std::mem::take(&mut self.chunk);
        let mut rest = &chunk[self.left.clone()];
        let read = next(&mut rest).and_then(|read| {
            let read = read.map(|(code, body)| Raw::parse(code, body));
            read.transpose()
        });
        let length = rest.len();
        let done = match read {
            Ok(Some(raw @ (Raw::Schema { .. } | Raw::Channel { .. } | Raw::Message { .. }))) => {
                self.record(raw)
            }
            // A chunk has no other records.
            Ok(_) => Ok(()),
            Err(reason) => {
                self.left = 0..0;
                return Err(Fault::Record(reason));
            }
        };
        self.left.start = self.left.end - length;
        if !self.left.is_empty() {
            self.chunk = chunk;
        }
        done
    }

    fn record(&mut self, raw: Raw<'_>) -> Result<(), Fault> {
        match raw {
            Raw::Schema {
                id,
                name,
                encoding,
                data,
            } => {
                let added = self.definitions.add_schema(id, name, encoding, data);
                added.map_err(Fault::End)?;
            }
            Raw::Channel {
                id,
                schema,
                topic,
                encoding,
                metadata,
            } => {
                let definitions = &mut self.definitions;
                let added = definitions.add_channel(id, schema, topic, encoding, metadata);
                added.map_err(Fault::End)?;
            }
            Raw::Message {
                channel,
                stamp,
                data,
            } => {
                let Some(channel) = self.definitions.channel(channel) else {
                    self.faults.without_channel += 1;
                    return Ok(());
                };
                if self.repeated > 0 {
                    self.repeated -= 1;
                    return Ok(());
                }
                self.waiting = Some(Record::Message(Message {
                    channel: Arc::clone(channel),
                    sequence: stamp.sequence,
                    log_time: stamp.log_time,
                    publish_time: stamp.publish_time,
                    data: data.to_vec(),
                }));
            }
            Raw::Attachment {
                name,
                media_type,
                data,
                ..
            } => {
                if self.repeated_files > 0 {
                    self.repeated_files -= 1;
                    return Ok(());
                }
                self.definitions.hold(0, 0).map_err(Fault::End)?;
                self.waiting = Some(Record::Attachment(Attachment {
                    name: clean(name),
                    media_type: clean(media_type),
                    data: data.to_vec(),
                }));
            }
            Raw::Metadata { name, metadata } => {
                let table = metadata.iter();
                let bytes = table.map(|(key, value)| key.len() + value.len()).sum();
                let held = self.definitions.hold(bytes, metadata.len());
                held.map_err(Fault::End)?;
                if name == files::PART && self.present > 0 {
                    let number = |key: &str| metadata.get(key)?.parse().ok();
                    self.repeated = number(files::REPEATED).unwrap_or(0);
                    self.repeated_files = number(files::REPEATED_FILES).unwrap_or(0);
                }
                self.waiting = Some(Record::Metadata(clean(name), metadata));
            }
            Raw::Header { .. } | Raw::Chunk { .. } | Raw::DataEnd | Raw::Other => {}
        }
        Ok(())
    }
}
