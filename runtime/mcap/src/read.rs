//! Parses records. Nothing is trusted: invalid data are an error.

use crate::{Stamp, op};
use std::collections::BTreeMap;

/// Size of the code and the length before each record.
pub const PREFIX: usize = 9;

/// A record.
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names are those of the specification")]
pub enum Record<'a> {
    Header {
        profile: &'a str,
        library: &'a str,
    },
    Schema {
        id: u16,
        name: &'a str,
        encoding: &'a str,
        data: &'a [u8],
    },
    Channel {
        id: u16,
        schema: u16,
        topic: &'a str,
        encoding: &'a str,
        metadata: BTreeMap<String, String>,
    },
    Message {
        channel: u16,
        stamp: Stamp,
        data: &'a [u8],
    },
    Chunk {
        begin: u64,
        size: u64,
        crc: u32,
        compression: &'a str,
        records: &'a [u8],
    },
    Attachment {
        log_time: u64,
        name: &'a str,
        media_type: &'a str,
        data: &'a [u8],
    },
    Metadata {
        name: &'a str,
        metadata: BTreeMap<String, String>,
    },
    DataEnd,
    /// A record that says where others are, or of another version.
    Other,
}

/// The next record of a chunk: its code and its body. `None` at the end.
pub fn next<'a>(rest: &mut &'a [u8]) -> Result<Option<(u8, &'a [u8])>, String> {
    if rest.is_empty() {
        return Ok(None);
    }
    let (code, length) = rest
        .split_at_checked(PREFIX)
        .and_then(|(prefix, _)| self::prefix(prefix))
        .ok_or("a record ends in its beginning")?;
    let body = rest[PREFIX..].get(..usize::try_from(length).unwrap_or(usize::MAX));
    let body = body.ok_or("a record is longer than its chunk")?;
    *rest = &rest[PREFIX + body.len()..];
    Ok(Some((code, body)))
}

/// The code and the length of a record, in its first nine bytes.
pub fn prefix(bytes: &[u8]) -> Option<(u8, u64)> {
    let (code, length) = bytes.split_first()?;
    Some((*code, u64::from_le_bytes(length.try_into().ok()?)))
}

/// Size of the footer and the magic bytes after it, which end a file.
pub const END: usize = PREFIX + 20 + crate::MAGIC.len();

/// Where the summary begins, in the last [`END`] bytes of a file. `None` without a summary.
pub fn summary_start(end: &[u8]) -> Option<u64> {
    let (footer, magic) = end.split_at_checked(END - crate::MAGIC.len())?;
    let (code, length) = prefix(footer.get(..PREFIX)?)?;
    let start = Fields::new(&footer[PREFIX..]).u64().ok()?;
    (magic == crate::MAGIC && (code, length) == (op::FOOTER, 20) && start > 0).then_some(start)
}

/// The longest record, and the longest chunk before compression, in bytes.
pub const LONGEST: u64 = 256 << 20;

/// The longest table of texts, in bytes. Each entry takes many times its bytes in memory.
const LONGEST_TABLE: usize = 1 << 20;

/// The contents of the summary of a file: its times, and where its records are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// The first and the last time of recording.
    pub times: Option<(u64, u64)>,
    /// Whether each chunk is later than those before it in the file.
    pub is_ordered: bool,
    /// Where chunks, attachments and tables are, in the order of the file: place and length.
    pub places: Vec<(u64, u64)>,
    /// The channels that have messages; empty if it does not say.
    pub channels: Vec<u16>,
}

/// Reads a summary: `statistics` have the times, and an index of each chunk its times and its
/// place.
pub fn summary(mut records: &[u8]) -> Result<Summary, String> {
    let mut found = Summary::default();
    let mut chunks = Vec::new();
    while let Some((code, body)) = next(&mut records)? {
        let mut fields = Fields::new(body);
        match code {
            op::STATISTICS => {
                // The counts of messages, schemas, channels, attachments, tables and chunks.
                let messages = fields.u64()?;
                fields.take(2 + 4 * 4)?;
                let times = (fields.u64()?, fields.u64()?);
                found.times = (messages > 0).then_some(times);
                let mut counts = Fields(fields.bytes()?);
                while !counts.0.is_empty() {
                    let (channel, count) = (counts.u16()?, counts.u64()?);
                    found.channels.extend((count > 0).then_some(channel));
                }
            }
            op::CHUNK_INDEX => {
                let (begin, end, place) = (fields.u64()?, fields.u64()?, fields.u64()?);
                found.places.push((place, fields.u64()?));
                chunks.push((place, begin, end));
            }
            op::ATTACHMENT_INDEX | op::METADATA_INDEX => {
                found.places.push((fields.u64()?, fields.u64()?));
            }
            _ => {}
        }
    }
    chunks.sort_unstable();
    let mut pairs = chunks.windows(2);
    // Without an index nothing is known.
    found.is_ordered = !chunks.is_empty() && pairs.all(|pair| pair[0].2 <= pair[1].1);
    found.places.sort_unstable();
    Ok(found)
}

/// The parts of a record.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    /// The parts of this body.
    pub fn new(body: &'a [u8]) -> Self {
        Self(body)
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let parts = self.0.split_at_checked(count);
        let (taken, rest) = parts.ok_or("a record is too short")?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let bytes = self.take(N)?;
        bytes
            .try_into()
            .map_err(|_| "a record is too short".to_owned())
    }

    fn u16(&mut self) -> Result<u16, String> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    fn u32(&mut self) -> Result<u32, String> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn u64(&mut self) -> Result<u64, String> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    fn bytes(&mut self) -> Result<&'a [u8], String> {
        let length = self.u32()? as usize;
        self.take(length)
    }

    fn long_bytes(&mut self) -> Result<&'a [u8], String> {
        let length = usize::try_from(self.u64()?).map_err(|_| "a record is too long")?;
        self.take(length)
    }

    fn text(&mut self) -> Result<&'a str, String> {
        std::str::from_utf8(self.bytes()?).map_err(|_| "a name is not UTF-8".to_owned())
    }

    /// A table of texts.
    pub fn table(&mut self) -> Result<BTreeMap<String, String>, String> {
        let mut entries = Self(self.bytes()?);
        if entries.0.len() > LONGEST_TABLE {
            let most = LONGEST_TABLE >> 20;
            return Err(format!("a table of texts has more than {most} MiB"));
        }
        let mut table = BTreeMap::new();
        while !entries.0.is_empty() {
            let (key, value) = (entries.text()?, entries.text()?);
            table.insert(key.to_owned(), value.to_owned());
        }
        Ok(table)
    }
}

impl<'a> Record<'a> {
    /// Reads a record.
    pub fn parse(code: u8, body: &'a [u8]) -> Result<Self, String> {
        let mut fields = Fields::new(body);
        let f = &mut fields;
        Ok(match code {
            op::HEADER => Self::Header {
                profile: f.text()?,
                library: f.text()?,
            },
            op::SCHEMA => Self::Schema {
                id: f.u16()?,
                name: f.text()?,
                encoding: f.text()?,
                data: f.bytes()?,
            },
            op::CHANNEL => Self::Channel {
                id: f.u16()?,
                schema: f.u16()?,
                topic: f.text()?,
                encoding: f.text()?,
                metadata: f.table()?,
            },
            op::MESSAGE => {
                let (channel, sequence) = (f.u16()?, f.u32()?);
                Self::Message {
                    channel,
                    stamp: Stamp {
                        log_time: f.u64()?,
                        publish_time: f.u64()?,
                        sequence,
                    },
                    data: f.0,
                }
            }
            op::CHUNK => {
                let (begin, _) = (f.u64()?, f.u64()?);
                Self::Chunk {
                    begin,
                    size: f.u64()?,
                    crc: f.u32()?,
                    compression: f.text()?,
                    records: f.long_bytes()?,
                }
            }
            op::ATTACHMENT => {
                let (log_time, _) = (f.u64()?, f.u64()?);
                Self::Attachment {
                    log_time,
                    name: f.text()?,
                    media_type: f.text()?,
                    data: f.long_bytes()?,
                }
            }
            op::METADATA => Self::Metadata {
                name: f.text()?,
                metadata: f.table()?,
            },
            op::DATA_END => Self::DataEnd,
            _ => Self::Other,
        })
    }
}
