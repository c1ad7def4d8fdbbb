//! Reads a recording from its beginning, record by record, also one that was cut.

use crate::error::RecordError;
use lz4_flex::frame::FrameDecoder;
use rc_diagnostics::foreign::clean;
use rc_mcap::read::{END, PREFIX, Record as Raw, Times, next, prefix, summary_start, times};
use rc_mcap::{MAGIC, op};
use std::collections::{BTreeMap, VecDeque};
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The longest record, and the longest chunk before compression, in bytes.
const LONGEST: u64 = 1 << 30;

/// A channel of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Number in the file.
    pub id: u16,
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

/// Reads a recording.
pub struct Reader {
    path: PathBuf,
    file: BufReader<File>,
    schemas: BTreeMap<u16, (String, String, Arc<[u8]>)>,
    channels: BTreeMap<u16, Arc<Channel>>,
    /// The messages of a chunk that were not handed out yet.
    waiting: VecDeque<Record>,
    /// As the summary says; nothing if there is none.
    times: Times,
    /// The time after which nothing is read.
    end: u64,
    cut: Option<String>,
    has_ended: bool,
}

impl Reader {
    /// Opens a file. Fails if it is no MCAP.
    pub fn open(path: &Path) -> Result<Self, RecordError> {
        let file = File::open(path).map_err(|e| RecordError::file(path, &e))?;
        let times = times_of(&file).unwrap_or_default();
        let mut file = BufReader::with_capacity(1 << 16, file);
        let mut begin = [0; MAGIC.len()];
        if file.read_exact(&mut begin).is_err() || begin != MAGIC {
            return Err(RecordError::NoRecording {
                path: path.to_owned(),
                reason: "it does not begin as an MCAP file does".to_owned(),
            });
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            waiting: VecDeque::new(),
            times,
            end: u64::MAX,
            cut: None,
            has_ended: false,
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The times of the file, as its summary says; nothing if it has none.
    pub fn times(&self) -> Times {
        self.times
    }

    /// Ends before the first chunk whose messages are all later, if the chunks of the file are in
    /// the order of time. Otherwise, an earlier message may follow, and all are read.
    pub fn end_after(&mut self, time: u64) {
        self.end = time;
    }

    /// The channels that were read so far.
    pub fn channels(&self) -> impl Iterator<Item = &Arc<Channel>> {
        self.channels.values()
    }

    /// Why the file ends before its end, if it does: it was cut, or is damaged.
    pub fn cut(&self) -> Option<&str> {
        self.cut.as_deref()
    }

    /// The next record; `None` at the end, or where the file is cut.
    #[allow(
        clippy::should_implement_trait,
        reason = "an iterator would hide the cut"
    )]
    pub fn next(&mut self) -> Option<Record> {
        while self.waiting.is_empty() && !self.has_ended {
            if let Err(reason) = self.step() {
                self.cut = Some(clean(&reason));
                self.has_ended = true;
            }
        }
        self.waiting.pop_front()
    }

    /// Reads a record of the file. The error describes the damage.
    fn step(&mut self) -> Result<(), String> {
        let ends = |_| "it ends in the middle of a record".to_owned();
        let mut begin = [0; PREFIX];
        self.file.read_exact(&mut begin).map_err(ends)?;
        let (code, length) = prefix(&begin).unwrap_or_default();
        if length > LONGEST {
            return Err(format!("a record has {length} bytes"));
        }
        if matches!(code, op::DATA_END | op::FOOTER) {
            // What follows repeats what was read.
            self.has_ended = true;
            return Ok(());
        }
        // A false length allocates no more than there is.
        let mut body = Vec::new();
        let read = (&mut self.file).take(length).read_to_end(&mut body);
        let read = read.map_err(|e| e.to_string())?;
        if (read as u64) < length {
            return Err("it ends in the middle of a record".to_owned());
        }
        if let Raw::Chunk {
            begin,
            size,
            crc,
            compression,
            records,
        } = Raw::parse(code, &body)?
        {
            if self.times.is_ordered && begin > self.end {
                self.has_ended = true;
                return Ok(());
            }
            let chunk = decompress(compression, records, size)?;
            if crc != 0 && crc != crc32fast::hash(&chunk) {
                return Err("a chunk is damaged".to_owned());
            }
            let mut rest = chunk.as_slice();
            while let Some((code, body)) = next(&mut rest)? {
                self.record(Raw::parse(code, body)?)?;
            }
            return Ok(());
        }
        self.record(Raw::parse(code, &body)?)
    }

    fn record(&mut self, raw: Raw<'_>) -> Result<(), String> {
        match raw {
            Raw::Schema {
                id,
                name,
                encoding,
                data,
            } => {
                let schema = (clean(name), clean(encoding), data.into());
                self.schemas.insert(id, schema);
            }
            Raw::Channel {
                id,
                schema,
                topic,
                encoding,
                metadata,
            } => {
                let none = || (String::new(), String::new(), Arc::from([]));
                let schema = self.schemas.get(&schema).cloned();
                let (type_name, schema_encoding, schema) = schema.unwrap_or_else(none);
                let channel = Channel {
                    id,
                    topic: clean(topic),
                    encoding: clean(encoding),
                    type_name,
                    schema_encoding,
                    schema,
                    metadata,
                };
                self.channels.insert(id, Arc::new(channel));
            }
            Raw::Message {
                channel,
                stamp,
                data,
            } => {
                let channel = self.channels.get(&channel);
                let channel = channel.ok_or("a message has no channel")?;
                self.waiting.push_back(Record::Message(Message {
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
            } => self.waiting.push_back(Record::Attachment(Attachment {
                name: clean(name),
                media_type: clean(media_type),
                data: data.to_vec(),
            })),
            Raw::Metadata { name, metadata } => {
                self.waiting
                    .push_back(Record::Metadata(clean(name), metadata));
            }
            Raw::Header { .. } | Raw::Chunk { .. } | Raw::DataEnd | Raw::Other => {}
        }
        Ok(())
    }
}

/// Reads the summary at the end of a file, and goes back to the beginning.
fn times_of(mut file: &File) -> Option<Times> {
    let mut summary = || {
        let length = file.seek(SeekFrom::End(0)).ok()?;
        let end = length.checked_sub(END as u64)?;
        let mut footer = [0; END];
        file.seek(SeekFrom::Start(end)).ok()?;
        file.read_exact(&mut footer).ok()?;
        let start = summary_start(&footer).filter(|start| *start < end)?;
        // A false start allocates no more than there is, and no more than a record may have.
        let mut summary = Vec::new();
        file.seek(SeekFrom::Start(start)).ok()?;
        let length = (end - start).min(LONGEST);
        file.take(length).read_to_end(&mut summary).ok()?;
        times(&summary).ok()
    };
    let found = summary();
    file.seek(SeekFrom::Start(0)).ok()?;
    found
}

/// The records of a chunk.
fn decompress(compression: &str, records: &[u8], size: u64) -> Result<Vec<u8>, String> {
    if size > LONGEST {
        return Err(format!("a chunk has {size} bytes"));
    }
    let mut chunk = Vec::new();
    let read = match compression {
        "" => return Ok(records.to_vec()),
        "lz4" => FrameDecoder::new(records)
            .take(size)
            .read_to_end(&mut chunk),
        "zstd" => ruzstd::decoding::StreamingDecoder::new(records)
            .map_err(|e| format!("a chunk is damaged: {e}"))?
            .take(size)
            .read_to_end(&mut chunk),
        other => {
            return Err(format!(
                "its chunks are compressed with `{}`, which is not known",
                clean(other)
            ));
        }
    };
    read.map_err(|e| format!("a chunk is damaged: {e}"))?;
    if chunk.len() as u64 == size {
        Ok(chunk)
    } else {
        Err("a chunk is shorter than it says".to_owned())
    }
}
