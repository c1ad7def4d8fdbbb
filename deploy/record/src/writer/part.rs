//! One file of a recording.

use super::{CHUNK, COMPRESSION, ChannelEntry, FLUSH, LONGEST_MESSAGE};
use crate::error::RecordError;
use crate::schema::Schema;
use lz4_flex::frame::FrameEncoder;
use rc_mcap::{Stamp, op, system_time, write};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::time::Instant;

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
    /// The numbers of channels in this file, with those of their schemas.
    numbers: BTreeMap<usize, (u16, u16)>,
    /// The records of the summary, which repeats what and where everything is.
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
        part.put(&begin).map_err(|error| {
            let _ = std::fs::remove_file(path);
            wrong(error)
        })?;
        Ok(part)
    }

    fn put(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.file.write_all(bytes)?;
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
        *self.counts.entry(number).or_default() += 1;
        self.flush_if_due()
    }

    /// The number of a channel in this file.
    fn number(&mut self, channel: usize, entry: &ChannelEntry) -> std::io::Result<u16> {
        if let Some((number, _)) = self.numbers.get(&channel) {
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
                    write_schema(&mut self.chunk, schema, number);
                    number
                }
            }
        };
        let number = u16::try_from(self.numbers.len()).map_err(full)?;
        self.numbers.insert(channel, (number, schema));
        write_channel(&mut self.chunk, entry, number, schema);
        Ok(number)
    }

    pub(super) fn flush_if_due(&mut self) -> std::io::Result<()> {
        if self.flushed.elapsed() >= FLUSH {
            self.flush()?;
        }
        Ok(())
    }

    /// Compresses and writes the chunk.
    fn flush(&mut self) -> std::io::Result<()> {
        self.flushed = Instant::now();
        let Some((first, last)) = self.times.take() else {
            return Ok(());
        };
        self.all_times = Some(spread(Some(spread(self.all_times, first)), last));
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
        self.put(&out)?;
        self.chunks += 1;
        write::record(&mut self.chunk_indexes, op::CHUNK_INDEX, |index| {
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
        write::record(&mut self.other_indexes, op::ATTACHMENT_INDEX, |index| {
            write::numbers(index, &[begin, length, now, now, data.len() as u64]);
            write::text(index, name);
            write::text(index, media_type);
        });
        self.attachments += 1;
        self.put(&out)
    }

    pub(super) fn metadata(
        &mut self,
        name: &str,
        table: &BTreeMap<String, String>,
    ) -> std::io::Result<()> {
        self.flush()?;
        let mut out = Vec::new();
        let entries = table
            .iter()
            .map(|(key, value)| (key.as_str(), value.as_str()));
        write::metadata(&mut out, name, entries);
        let (begin, length) = (self.at, out.len() as u64);
        write::record(&mut self.other_indexes, op::METADATA_INDEX, |index| {
            write::numbers(index, &[begin, length]);
            write::text(index, name);
        });
        self.tables += 1;
        self.put(&out)
    }

    /// Writes the last chunk, the summary and the end.
    pub(super) fn finish(&mut self, channels: &[ChannelEntry]) -> std::io::Result<()> {
        self.flush()?;
        let mut out = Vec::new();
        write::data_end(&mut out);
        let summary = self.at + out.len() as u64;
        for (schema, number) in &self.schemas {
            write_schema(&mut out, schema, *number);
        }
        for (at, (number, schema)) in &self.numbers {
            write_channel(&mut out, &channels[*at], *number, *schema);
        }
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
        self.put(&out)
    }
}

fn write_schema(out: &mut Vec<u8>, schema: &Schema, number: u16) {
    write::schema(out, number, &schema.name, &schema.encoding, &schema.text);
}

fn write_channel(out: &mut Vec<u8>, entry: &ChannelEntry, number: u16, schema: u16) {
    let metadata = entry.metadata.iter();
    let metadata = metadata.map(|(key, value)| (key.as_str(), value.as_str()));
    write::channel(out, number, schema, &entry.topic, &entry.encoding, metadata);
}
