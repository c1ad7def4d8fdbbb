//! Takes records apart. Nothing is trusted: what does not fit is an error.

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
                f.take(16)?;
                Self::Chunk {
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
