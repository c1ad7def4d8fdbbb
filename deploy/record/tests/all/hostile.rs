//! Files that ask for more than there may be: one for each bound, and some for their sums.

use lz4_flex::frame::FrameEncoder;
use rc_mcap::read::LONGEST;
use rc_mcap::{MAGIC, Stamp, op, write};
use rc_record::bag::Info;
use rc_record::{Faults, Reader, Record};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Names the file for [`a_hostile_file_under_a_limit`].
const FILE: &str = "RC_HOSTILE_FILE";
/// The address space of the process that reads it, in bytes.
const SPACE: &str = "RC_HOSTILE_SPACE";
const GIB: u64 = 1 << 30;

/// A file of these records behind the header, without a summary.
fn file(folder: &Path, records: impl FnOnce(&mut Vec<u8>)) -> PathBuf {
    let mut out = MAGIC.to_vec();
    write::header(&mut out, "", "hostile");
    records(&mut out);
    write::end(&mut out, 0);
    let path = folder.join("hostile.mcap");
    std::fs::write(&path, out).expect("to write");
    path
}

fn chunk(out: &mut Vec<u8>, compression: &str, size: u64, records: &[u8]) {
    write::record(out, op::CHUNK, |out| {
        write::numbers(out, &[1, 1, size]);
        out.extend(0_u32.to_le_bytes());
        write::text(out, compression);
        write::numbers(out, &[records.len() as u64]);
        out.extend(records);
    });
}

fn lz4(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = FrameEncoder::new(Vec::new());
    encoder.write_all(bytes).expect("to compress");
    encoder.finish().expect("to compress")
}

/// A channel, and messages of this length.
fn messages(count: usize, length: usize) -> Vec<u8> {
    let mut out = Vec::new();
    write::channel(&mut out, 1, 0, "/a", "json", []);
    let mut message = Vec::new();
    write::message(&mut message, 1, Stamp::default(), &[&vec![0; length]]);
    out.extend(message.repeat(count));
    out
}

/// The number of messages of a file, and what is wrong with it.
fn read(path: &Path) -> (u64, Faults) {
    let mut reader = Reader::open(path).expect("a recording");
    let mut count = 0;
    while let Some(record) = reader.next() {
        count += u64::from(matches!(record, Record::Message(_)));
    }
    (count, reader.faults().clone())
}

fn cut(text: &str) -> Faults {
    Faults {
        cut: Some(text.to_owned()),
        ..Faults::default()
    }
}

fn damaged(text: &str) -> Faults {
    Faults {
        damaged: 1,
        damage: Some(text.to_owned()),
        ..Faults::default()
    }
}

#[test]
fn missing_parts_are_counted_in_the_message() {
    let text = |missing: &[u32]| {
        let missing = missing.to_vec();
        let faults = Faults {
            missing,
            ..Faults::default()
        };
        faults.to_string()
    };
    assert_eq!(text(&[1]), "part 1 of it is missing");
    assert_eq!(text(&[1, 2]), "parts 1, 2 of it are missing");
    assert_eq!(
        text(&[1, 2, 3, 4, 5, 6, 7, 8]),
        "parts 1, 2, 3, 4, 5, 6, 7, 8 of it are missing"
    );
    assert_eq!(
        text(&[1, 2, 3, 4, 5, 6, 7, 8, 9]),
        "parts 1, 2, 3, 4, 5, 6, 7, 8 and more of it are missing"
    );
}

#[test]
fn messages_without_a_channel_are_counted_in_the_message() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(folder.path(), |out| {
        out.extend(messages(2, 1));
        for _ in 0..3 {
            write::message(out, 2, Stamp::default(), &[b"x"]);
        }
    });
    let (count, faults) = read(&path);
    assert_eq!((count, faults.without_channel), (2, 3));
    assert_eq!(faults.to_string(), "3 messages have no channel");
    assert_eq!(Faults::default().to_string(), "");
}

#[test]
fn a_record_is_as_long_as_the_longest_at_most() {
    let folder = tempfile::tempdir().expect("a folder");
    for (length, expected) in [
        (LONGEST, "it ends in the middle of a record".to_owned()),
        (LONGEST + 1, format!("a record has {} bytes", LONGEST + 1)),
        (u64::MAX, format!("a record has {} bytes", u64::MAX)),
    ] {
        let path = file(folder.path(), |out| {
            out.extend(messages(2, 1));
            out.push(op::METADATA);
            out.extend(length.to_le_bytes());
        });
        assert_eq!(read(&path), (2, cut(&expected)));
    }
}

#[test]
fn a_chunk_has_the_length_that_it_states() {
    let folder = tempfile::tempdir().expect("a folder");
    let content = messages(3, 10);
    let length = content.len() as u64;
    let zstd = compress_to_vec(content.as_slice(), CompressionLevel::Fastest);
    let shorter = damaged("a chunk is shorter than it says");
    let longer = damaged("a chunk is longer than it says");
    for (compression, compressed) in [
        ("", content.clone()),
        ("lz4", lz4(&content)),
        ("zstd", zstd),
    ] {
        for (size, expected) in [
            (length, (4, Faults::default())),
            (length - 1, (1, longer.clone())),
            (0, (1, longer.clone())),
            (length + 1, (1, shorter.clone())),
        ] {
            let path = file(folder.path(), |out| {
                chunk(out, compression, size, &compressed);
                // What follows is read.
                out.extend(messages(1, 1));
            });
            assert_eq!(read(&path), expected, "{compression} {size}");
        }
    }
}

#[test]
fn a_chunk_is_as_long_as_the_longest_at_most() {
    let folder = tempfile::tempdir().expect("a folder");
    let compressed = lz4(&messages(3, 10));
    for (size, expected) in [
        (LONGEST, "a chunk is shorter than it says".to_owned()),
        (LONGEST + 1, format!("a chunk has {} bytes", LONGEST + 1)),
    ] {
        let path = file(folder.path(), |out| chunk(out, "lz4", size, &compressed));
        assert_eq!(read(&path), (0, damaged(&expected)));
    }
}

#[test]
fn an_unknown_compression_is_named_without_its_control_characters() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = file(folder.path(), |out| chunk(out, "\u{1b}[2J", 1, b"x"));
    let expected = "its chunks are compressed with `\\u{1b}[2J`, which is not known";
    assert_eq!(read(&path), (0, damaged(expected)));
}

#[test]
fn names_of_a_file_are_cleaned() {
    let folder = tempfile::tempdir().expect("a folder");
    let name = "/a\u{1b}[2J\nb";
    let path = file(folder.path(), |out| {
        write::schema(out, 1, name, name, b"");
        write::channel(out, 1, 1, name, name, []);
        write::message(out, 1, Stamp::default(), &[b"x"]);
        write::attachment(out, 1, 1, name, name, b"");
        write::metadata(out, name, []);
    });
    let clean = "/a\\u{1b}[2J\\nb";
    let mut reader = Reader::open(&path).expect("a recording");
    let mut seen = 0;
    while let Some(record) = reader.next() {
        seen += 1;
        match record {
            Record::Message(message) => {
                let channel = &message.channel;
                assert_eq!(
                    (channel.topic.as_str(), channel.encoding.as_str()),
                    (clean, clean)
                );
                assert_eq!(channel.type_name, clean);
                assert_eq!(channel.schema_encoding, clean);
            }
            Record::Attachment(file) => {
                assert_eq!(
                    (file.name.as_str(), file.media_type.as_str()),
                    (clean, clean)
                );
            }
            Record::Metadata(name, _) => assert_eq!(name, clean),
        }
    }
    assert_eq!((seen, reader.faults()), (3, &Faults::default()));
}

#[test]
fn a_table_of_texts_has_a_limit() {
    let folder = tempfile::tempdir().expect("a folder");
    let key = "k".repeat((1 << 20) - 8);
    for (value, expected) in [
        ("", Faults::default()),
        ("v", damaged("a table of texts has more than 1 MiB")),
    ] {
        let path = file(folder.path(), |out| {
            write::metadata(out, "m", [(key.as_str(), value)]);
        });
        assert_eq!(read(&path), (0, expected));
    }
}

/// Runs in a process of its own, which the tests below start.
#[test]
fn a_hostile_file_under_a_limit() {
    let Some(path) = std::env::var_os(FILE) else {
        return;
    };
    let space = std::env::var(SPACE).expect("a limit");
    let limit = Rlimit {
        current: space.parse().ok(),
        ..getrlimit(Resource::As)
    };
    setrlimit(Resource::As, limit).expect("to set the limit");
    let info = Info::read(Path::new(&path)).expect("a recording");
    println!("{} messages; {}", info.messages(), info.faults);
}

/// What [`Info::read`] says about a file in a process with so much address space.
fn under(space: u64, path: &Path) -> String {
    let out = Command::new(std::env::current_exe().expect("this program"))
        .args([
            "hostile::a_hostile_file_under_a_limit",
            "--exact",
            "--nocapture",
        ])
        .env(FILE, path)
        // Address space that threads reserve and do not use.
        .env("MALLOC_ARENA_MAX", "1")
        .env(SPACE, space.to_string())
        .output()
        .expect("to run");
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    let errors = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{text}{errors}");
    let line = text
        .lines()
        .find_map(|line| Some(line.split_once(" messages; ")?.1));
    let line = line.unwrap_or_else(|| panic!("{text}"));
    let cut = line.strip_prefix("it ends before its end (");
    cut.and_then(|cut| cut.strip_suffix(')'))
        .unwrap_or(line)
        .to_owned()
}

/// Two million empty messages of which each took a hundred bytes in memory.
#[test]
fn messages_of_a_chunk_are_not_all_in_memory() {
    let folder = tempfile::tempdir().expect("a folder");
    let content = messages(2_000_000, 0);
    let path = file(folder.path(), |out| {
        chunk(out, "lz4", content.len() as u64, &lz4(&content));
    });
    drop(content);
    assert_eq!(under(GIB / 4, &path), "");
}

#[test]
fn definitions_tables_and_names_have_a_total() {
    const EACH: usize = 8 << 20;
    let folder = tempfile::tempdir().expect("a folder");
    let expected = "its definitions and tables have more than 64 MiB";
    let path = file(folder.path(), |out| {
        for first in (1..=72_u16).step_by(4) {
            let mut content = Vec::new();
            for id in first..first + 4 {
                write::schema(&mut content, id, &id.to_string(), "ros2msg", &vec![0; EACH]);
            }
            chunk(out, "lz4", content.len() as u64, &lz4(&content));
        }
    });
    assert_eq!(under(GIB / 2, &path), expected);
    // A definition that is repeated is one.
    let path = file(folder.path(), |out| {
        let mut content = Vec::new();
        write::schema(&mut content, 1, "a", "ros2msg", &vec![0; EACH]);
        let compressed = lz4(&content);
        for _ in 0..20 {
            chunk(out, "lz4", content.len() as u64, &compressed);
        }
    });
    assert_eq!(under(GIB / 2, &path), "");
    // Each entry of a table takes many times its bytes.
    let path = file(folder.path(), |out| {
        for table in 0..20_u32 {
            let keys: Vec<String> = (0..50_000).map(|key| format!("{table}{key}")).collect();
            write::metadata(out, "m", keys.iter().map(|key| (key.as_str(), "")));
        }
    });
    assert_eq!(under(GIB / 2, &path), expected);
    let path = file(folder.path(), |out| {
        for _ in 0..140_000 {
            write::attachment(out, 1, 1, "", "", b"");
        }
    });
    assert_eq!(under(GIB / 2, &path), expected);
}
