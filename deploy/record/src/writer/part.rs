//! One file of a recording.

use super::{CHUNK, COMPRESSION, ChannelEntry, FLUSH, LONGEST_MESSAGE, TABLE};
use crate::error::RecordError;
use crate::schema::Schema;
use lz4_flex::frame::FrameEncoder;
use rc_files::Disk;
use rc_mcap::{Stamp, op, system_time, write};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::time::Instant;

/// The entry of [`TABLE`] that says why the recording ended early.
const ENDED: &str = "ended";
/// The longest reason in that entry, in characters.
const LONGEST_REASON: usize = 200;
/// Bytes at the end of a file besides the records that a [`Part`] collects for its summary: the
/// table of its early end with its index, the statistics and the footer.
const END: u64 = 2048;
/// Bytes of a channel in the statistics.
const COUNT: u64 = 10;

/// The channels of a chunk: times and places of their messages.
type Index = BTreeMap<u16, Vec<(u64, u64)>>;

/// One file of a recording.
pub(super) struct Part {
    pub(super) file: File,
    /// Where the next record begins.
    pub(super) at: u64,
    pub(super) chunk: Vec<u8>,
    index: Index,
    times: Option<(u64, u64)>,
    pub(super) began: Instant,
    flushed: Instant,
    schemas: Vec<(Schema, u16)>,
    /// The numbers of channels in this file.
    numbers: BTreeMap<usize, u16>,
    /// The records of the summary, which repeats what and where everything is.
    schema_records: Vec<u8>,
    channel_records: Vec<u8>,
    chunk_indexes: Vec<u8>,
    other_indexes: Vec<u8>,
    counts: BTreeMap<u16, u64>,
    all_times: Option<(u64, u64)>,
    chunks: u32,
    attachments: u32,
    tables: u32,
    /// Whether it holds more messages than it repeats.
    pub(super) has_own_messages: bool,
}

fn spread(times: Option<(u64, u64)>, time: u64) -> (u64, u64) {
    let (first, last) = times.unwrap_or((time, time));
    (first.min(time), last.max(time))
}

impl Part {
    pub(super) fn create(path: &Path) -> Result<Self, RecordError> {
        let wrong = |e: std::io::Error| match e.kind() {
            ErrorKind::AlreadyExists => {
                let reason = "this file exists already; remove it, or name another one";
                RecordError::file(path, &reason)
            }
            _ => RecordError::file(path, &e),
        };
        let file = File::create_new(path).map_err(wrong)?;
        let now = Instant::now();
        let mut part = Self {
            file,
            at: 0,
            chunk: Vec::with_capacity(CHUNK + CHUNK / 4),
            index: Index::new(),
            times: None,
            began: now,
            flushed: now,
            schemas: Vec::new(),
            numbers: BTreeMap::new(),
            schema_records: Vec::new(),
            channel_records: Vec::new(),
            chunk_indexes: Vec::new(),
            other_indexes: Vec::new(),
            counts: BTreeMap::new(),
            all_times: None,
            chunks: 0,
            attachments: 0,
            tables: 0,
            has_own_messages: false,
        };
        let mut begin = rc_mcap::MAGIC.to_vec();
        let library = concat!("robocomp ", env!("CARGO_PKG_VERSION"));
        write::header(&mut begin, "ros2", library);
        part.put(&begin, 0).map_err(|error| {
            let _ = std::fs::remove_file(path);
            wrong(error)
        })?;
        Ok(part)
    }

    /// Writes records, whose index in the summary has `index` bytes, if there is room for them and
    /// for the end of the file. Without room, the file stays as it was.
    fn put(&mut self, bytes: &[u8], index: usize) -> std::io::Result<()> {
        let summary = [
            &self.schema_records,
            &self.channel_records,
            &self.chunk_indexes,
            &self.other_indexes,
        ];
        let summary: usize = summary.iter().map(|records| records.len()).sum();
        let end = END + COUNT * self.numbers.len() as u64 + (summary + index) as u64;
        Disk::reserve(&self.file, self.at, bytes.len() as u64 + end)?;
        self.write(bytes)
    }

    /// Writes records into room that is reserved. A disk that cannot reserve may refuse: then the
    /// file stays as it was.
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        let written = self.file.write_all_at(bytes, self.at);
        if let Err(error) = written {
            let _ = self.file.set_len(self.at);
            return Err(error);
        }
        self.at += bytes.len() as u64;
        Ok(())
    }

    pub(super) fn message(
        &mut self,
        channel: usize,
        entry: &ChannelEntry,
        stamp: Stamp,
        data: &[u8],
    ) -> std::io::Result<()> {
        if self.chunk.len() >= CHUNK || self.chunk.len() + data.len() > LONGEST_MESSAGE {
            self.flush()?;
        }
        self.has_own_messages = true;
        let number = self.number(channel, entry)?;
        let at = self.chunk.len() as u64;
        write::message(&mut self.chunk, number, stamp, &[data]);
        let time = stamp.log_time;
        self.index.entry(number).or_default().push((time, at));
        self.times = Some(spread(self.times, time));
        self.flush_if_due()
    }

    /// The number of a channel in this file.
    fn number(&mut self, channel: usize, entry: &ChannelEntry) -> std::io::Result<u16> {
        if let Some(number) = self.numbers.get(&channel) {
            return Ok(*number);
        }
        let full = |_| std::io::Error::other("a recording has at most 65535 channels and types");
        let schema = match &entry.schema {
            None => 0,
            Some(schema) => {
                let known = self.schemas.iter().find(|(known, _)| known == schema);
                if let Some((_, number)) = known {
                    *number
                } else {
                    let number = u16::try_from(self.schemas.len() + 1).map_err(full)?;
                    self.schemas.push((schema.clone(), number));
                    let at = self.schema_records.len();
                    let Schema {
                        name,
                        encoding,
                        text,
                    } = schema;
                    write::schema(&mut self.schema_records, number, name, encoding, text);
                    self.chunk.extend(&self.schema_records[at..]);
                    number
                }
            }
        };
        let number = u16::try_from(self.numbers.len()).map_err(full)?;
        self.numbers.insert(channel, number);
        let at = self.channel_records.len();
        let metadata = entry.metadata.iter();
        let metadata = metadata.map(|(key, value)| (key.as_str(), value.as_str()));
        let (topic, encoding) = (&entry.topic, &entry.encoding);
        let records = &mut self.channel_records;
        write::channel(records, number, schema, topic, encoding, metadata);
        self.chunk.extend(&self.channel_records[at..]);
        Ok(number)
    }

    pub(super) fn flush_if_due(&mut self) -> std::io::Result<()> {
        if self.flushed.elapsed() >= FLUSH {
            self.flush()?;
        }
        Ok(())
    }

    /// Compresses and writes the chunk. After an error, its messages are lost.
    fn flush(&mut self) -> std::io::Result<()> {
        self.flushed = Instant::now();
        let Some((first, last)) = self.times.take() else {
            return Ok(());
        };
        let chunk = std::mem::take(&mut self.chunk);
        let index = std::mem::take(&mut self.index);
        let mut encoder = FrameEncoder::new(Vec::with_capacity(chunk.len() / 2));
        encoder.write_all(&chunk)?;
        let compressed = encoder.finish().map_err(std::io::Error::other)?;
        let mut out = Vec::with_capacity(compressed.len() + 1024);
        write::record(&mut out, op::CHUNK, |out| {
            write::numbers(out, &[first, last, chunk.len() as u64]);
            out.extend(crc32fast::hash(&chunk).to_le_bytes());
            write::text(out, COMPRESSION);
            write::numbers(out, &[compressed.len() as u64]);
            out.extend(&compressed);
        });
        let (begin, length) = (self.at, out.len() as u64);
        let mut offsets = Vec::new();
        for (channel, places) in &index {
            offsets.push((*channel, begin + out.len() as u64));
            write::record(&mut out, op::MESSAGE_INDEX, |out| {
                out.extend(channel.to_le_bytes());
                write::counted(out, |out| {
                    places
                        .iter()
                        .for_each(|(time, at)| write::numbers(out, &[*time, *at]));
                });
            });
        }
        let mut entry = Vec::new();
        write::record(&mut entry, op::CHUNK_INDEX, |index| {
            write::numbers(index, &[first, last, begin, length]);
            write::counted(index, |index| {
                for (channel, offset) in &offsets {
                    index.extend(channel.to_le_bytes());
                    write::numbers(index, &[*offset]);
                }
            });
            write::numbers(index, &[out.len() as u64 - length]);
            write::text(index, COMPRESSION);
            write::numbers(index, &[compressed.len() as u64, chunk.len() as u64]);
        });
        self.put(&out, entry.len())?;
        self.chunk_indexes.extend(entry);
        self.chunks += 1;
        self.all_times = Some(spread(Some(spread(self.all_times, first)), last));
        for (channel, places) in &index {
            *self.counts.entry(*channel).or_default() += places.len() as u64;
        }
        self.chunk = chunk;
        self.chunk.clear();
        Ok(())
    }

    pub(super) fn attach(
        &mut self,
        name: &str,
        media_type: &str,
        data: &[u8],
    ) -> std::io::Result<()> {
        self.flush()?;
        let now = system_time();
        let mut out = Vec::new();
        write::attachment(&mut out, now, now, name, media_type, data);
        let (begin, length) = (self.at, out.len() as u64);
        let mut entry = Vec::new();
        write::record(&mut entry, op::ATTACHMENT_INDEX, |index| {
            write::numbers(index, &[begin, length, now, now, data.len() as u64]);
            write::text(index, name);
            write::text(index, media_type);
        });
        self.put(&out, entry.len())?;
        self.other_indexes.extend(entry);
        self.attachments += 1;
        Ok(())
    }

    pub(super) fn metadata(
        &mut self,
        name: &str,
        table: &BTreeMap<String, String>,
    ) -> std::io::Result<()> {
        self.flush()?;
        let (out, entry) = self.table(name, table);
        self.put(&out, entry.len())?;
        self.other_indexes.extend(entry);
        self.tables += 1;
        Ok(())
    }

    /// The records of a table, and of its index.
    fn table(&self, name: &str, table: &BTreeMap<String, String>) -> (Vec<u8>, Vec<u8>) {
        let mut out = Vec::new();
        let entries = table
            .iter()
            .map(|(key, value)| (key.as_str(), value.as_str()));
        write::metadata(&mut out, name, entries);
        let mut entry = Vec::new();
        write::record(&mut entry, op::METADATA_INDEX, |index| {
            write::numbers(index, &[self.at, out.len() as u64]);
            write::text(index, name);
        });
        (out, entry)
    }

    /// Ends a file that cannot go on, so that it opens as one that was ended: all chunks that were
    /// written, why it ended, and the summary.
    pub(super) fn end_early(&mut self, reason: &str) -> std::io::Result<()> {
        // Records without room are lost.
        let _ = self.flush();
        let reason = reason.chars().take(LONGEST_REASON).collect();
        let table = BTreeMap::from([(ENDED.to_owned(), reason)]);
        let (out, entry) = self.table(TABLE, &table);
        // Its room is reserved with that of the summary.
        if self.write(&out).is_ok() {
            self.other_indexes.extend(entry);
            self.tables += 1;
        }
        self.finish()
    }

    /// Writes the last chunk, the summary and the end.
    pub(super) fn finish(&mut self) -> std::io::Result<()> {
        self.flush()?;
        let mut out = Vec::new();
        write::data_end(&mut out);
        let summary = self.at + out.len() as u64;
        out.extend(&self.schema_records);
        out.extend(&self.channel_records);
        let (first, last) = self.all_times.unwrap_or_default();
        write::record(&mut out, op::STATISTICS, |out| {
            write::numbers(out, &[self.counts.values().sum()]);
            out.extend((self.schemas.len() as u16).to_le_bytes());
            for count in [
                self.numbers.len() as u32,
                self.attachments,
                self.tables,
                self.chunks,
            ] {
                out.extend(count.to_le_bytes());
            }
            write::numbers(out, &[first, last]);
            write::counted(out, |out| {
                for (channel, count) in &self.counts {
                    out.extend(channel.to_le_bytes());
                    write::numbers(out, &[*count]);
                }
            });
        });
        out.extend(&self.chunk_indexes);
        out.extend(&self.other_indexes);
        write::end(&mut out, summary);
        self.write(&out)?;
        // The room that was reserved and is not needed.
        let _ = self.file.set_len(self.at);
        Ok(())
    }
}
