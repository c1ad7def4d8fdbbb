//! The records of an MCAP file as bytes, written and read. `https://mcap.dev/spec` describes them.
//!
//! A component writes its exact recording itself, and `rc-record` reads, cuts and converts
//! recordings. This crate does no compression and opens no file: it makes records and parses them.
//!
#![doc = include_str!("example.md")]

pub mod read;
pub mod write;

/// The first and the last bytes of a file.
pub const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];

/// The kinds of records.
#[allow(missing_docs, reason = "the names are those of the specification")]
pub mod op {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const ATTACHMENT: u8 = 0x09;
    pub const ATTACHMENT_INDEX: u8 = 0x0a;
    pub const STATISTICS: u8 = 0x0b;
    pub const METADATA: u8 = 0x0c;
    pub const METADATA_INDEX: u8 = 0x0d;
    pub const DATA_END: u8 = 0x0f;
}

/// The times and the number of a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stamp {
    /// The time of the system when it was recorded, in nanoseconds since 1970.
    pub log_time: u64,
    /// The time of the network when it was sent: simulated, or that of the system.
    pub publish_time: u64,
    /// Number at its sender.
    pub sequence: u32,
}

/// Nanoseconds since 1970 by the clock of the system.
pub fn system_time() -> u64 {
    let since = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
    since.map_or(0, |since| since.as_nanos() as u64)
}

#[cfg(test)]
mod tests {
    use super::read::{Fields, Record, next};
    use super::*;

    #[test]
    fn records_come_back() {
        let mut out = Vec::new();
        write::header(&mut out, "ros2", "test");
        write::schema(&mut out, 1, "a/msg/B", "ros2msg", b"int32 x");
        let metadata = [("k", "v"), ("l", "")];
        write::channel(&mut out, 2, 1, "/b", "cdr", metadata);
        let stamp = Stamp {
            log_time: 5,
            publish_time: 6,
            sequence: 7,
        };
        write::message(&mut out, 2, stamp, &[b"ab", b"cd"]);
        write::metadata(&mut out, "m", metadata);
        write::attachment(&mut out, 1, 2, "file", "text/plain", b"content");

        let mut rest = out.as_slice();
        let mut records = Vec::new();
        while let Some((code, body)) = next(&mut rest).expect("records") {
            records.push(Record::parse(code, body).expect("a record"));
        }
        assert_eq!(records.len(), 6);
        assert!(matches!(
            records[0],
            Record::Header {
                profile: "ros2",
                ..
            }
        ));
        assert!(matches!(
            records[1],
            Record::Schema {
                id: 1,
                name: "a/msg/B",
                data: b"int32 x",
                ..
            }
        ));
        let Record::Channel {
            id: 2,
            schema: 1,
            topic: "/b",
            metadata: ref table,
            ..
        } = records[2]
        else {
            panic!("{:?}", records[2]);
        };
        assert_eq!(table.get("k").map(String::as_str), Some("v"));
        assert_eq!(
            records[3],
            Record::Message {
                channel: 2,
                stamp,
                data: b"abcd"
            }
        );
        assert!(matches!(records[4], Record::Metadata { name: "m", .. }));
        assert!(matches!(
            records[5],
            Record::Attachment {
                name: "file",
                data: b"content",
                ..
            }
        ));
    }

    #[test]
    fn damaged_records_are_errors() {
        let mut out = Vec::new();
        write::channel(&mut out, 2, 1, "/b", "cdr", [("k", "v")]);
        for end in 0..out.len() {
            let mut rest = &out[..end];
            let read = next(&mut rest);
            assert!(!matches!(read, Ok(Some(_))), "{end}");
        }
        for at in 9..out.len() {
            let mut bytes = out.clone();
            bytes[at] = 0xff;
            let mut rest = bytes.as_slice();
            if let Ok(Some((code, body))) = next(&mut rest) {
                // An error, or other names; never a panic.
                let _ = Record::parse(code, body);
            }
        }
        let mut fields = Fields::new(&[0xff, 0xff, 0xff, 0xff]);
        assert!(fields.table().is_err());
    }
}
