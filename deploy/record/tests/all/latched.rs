//! Values that are sent once are in every part, and in every cut. Folders and compressed files.

use rc_record::bag::{Info, Selection, cut};
use rc_record::{Faults, Limits, Reader, Record, Stamp, Writer, keys};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

const SECOND: u64 = 1_000_000_000;

/// Writes a map and a state once, and then twenty samples, one a second.
fn write(path: &Path, limits: Limits) -> Vec<PathBuf> {
    let mut writer = Writer::create(path, limits).expect("to create");
    writer
        .attach("net.ddsl", "text/plain", b"net".to_vec())
        .expect("to attach");
    let latched = "- history: 1\n  durability: 1\n";
    let mut channel = |topic: &str, key: &str, value: &str| {
        let metadata = BTreeMap::from([(key.to_owned(), value.to_owned())]);
        writer.channel(topic, "json", None, metadata)
    };
    let map = channel("/map", keys::QOS, latched);
    let state = channel("/a/state", keys::KIND, "state");
    let sample = channel("/scan", keys::KIND, "sample");
    let mut write = |channel, second: u64, data: &[u8]| {
        let stamp = Stamp {
            log_time: second * SECOND,
            publish_time: second,
            sequence: 0,
        };
        writer.write(channel, stamp, data).expect("to write");
    };
    write(map, 1, b"old");
    write(map, 2, b"map");
    write(state, 3, b"state");
    for second in 4..24 {
        write(sample, second, &[0; 500]);
    }
    let files = writer.files();
    writer.finish().expect("to finish");
    files
}

/// Topic, second of recording, and time of sending of each message.
fn read(path: &Path) -> Vec<(String, u64, u64)> {
    let mut reader = Reader::open(path).expect("a recording");
    let mut found = Vec::new();
    while let Some(record) = reader.next() {
        if let Record::Message(message) = record {
            let second = message.log_time / SECOND;
            found.push((message.channel.topic.clone(), second, message.publish_time));
        }
    }
    assert_eq!(reader.faults(), &Faults::default());
    found
}

fn message(topic: &str, second: u64, sent: u64) -> (String, u64, u64) {
    (topic.to_owned(), second, sent)
}

#[test]
fn each_part_and_each_cut_begins_with_the_values_that_hold() {
    let folder = tempfile::tempdir().expect("a folder");
    let whole = folder.path().join("whole.mcap");
    write(&whole, Limits::default());
    let all = read(&whole);
    assert_eq!(all.len(), 23);

    let path = folder.path().join("x.mcap");
    let limits = Limits {
        bytes: Some(4000),
        ..Limits::default()
    };
    let files = write(&path, limits);
    assert!(files.len() >= 3, "{files:?}");
    // Together, the parts hold everything once.
    assert_eq!(read(&path), all);
    let alone = read(&files[1]);
    let begin = alone[0].1;
    assert_eq!(
        alone[..3],
        [
            message("/map", begin, 2),
            message("/a/state", begin, 3),
            message("/scan", begin, begin)
        ]
    );

    // A cut of the parts.
    let part = folder.path().join("part.mcap");
    let selection = Selection {
        from: Some(Duration::from_secs(19)),
        ..Selection::default()
    };
    let (count, faults) = cut(&path, selection.clone(), &part).expect("a part");
    assert_eq!((count, faults), (6, Faults::default()));
    let found = read(&part);
    let first = [message("/map", 20, 2), message("/a/state", 20, 3)];
    assert_eq!(found[..2], first);
    assert!(found[2..].iter().map(|m| m.1).eq(20..24), "{found:?}");
    let info = Info::read(&part).expect("info");
    assert_eq!((info.messages(), info.attachments.len()), (6, 1));
    assert!(!info.metadata.contains_key("part"), "{info:?}");
    // Topics that are not selected are not kept.
    std::fs::remove_file(&part).expect("to remove");
    let selection = Selection {
        topics: vec!["scan".to_owned()],
        ..selection
    };
    assert_eq!(cut(&path, selection, &part).expect("a part").0, 4);
}

#[test]
fn a_folder_of_rosbag2_and_compressed_files_are_recordings() {
    let folder = tempfile::tempdir().expect("a folder");
    let bag = folder.path().join("bag");
    std::fs::create_dir(&bag).expect("a folder");
    write(&bag.join("bag_0.mcap"), Limits::default());
    let bytes = std::fs::read(bag.join("bag_0.mcap")).expect("to read");
    let mut zstd = compress_to_vec(&bytes[..300], CompressionLevel::Fastest);
    // In two frames.
    zstd.extend(compress_to_vec(&bytes[300..], CompressionLevel::Fastest));
    std::fs::write(bag.join("bag_1.mcap.zstd"), &zstd).expect("to write");
    assert_eq!(read(&bag.join("bag_1.mcap.zstd")).len(), 23);
    // One that ends in its first block has no byte.
    let first = folder.path().join("first.mcap.zstd");
    std::fs::write(&first, &zstd[..20]).expect("to write");
    let error = Reader::open(&first).map(drop).expect_err("no recording");
    assert!(
        error
            .to_string()
            .contains("its compression with zstd is damaged: "),
        "{error}"
    );
    zstd.truncate(zstd.len() - 20);
    std::fs::write(folder.path().join("short.mcap.zstd"), zstd).expect("to write");
    let short = Info::read(&folder.path().join("short.mcap.zstd")).expect("a recording");
    assert!(short.faults.cut.is_some(), "{short:?}");

    let list = |text: &str| std::fs::write(bag.join("metadata.yaml"), text).expect("to write");
    let refused = |expected: &str| {
        let error = Reader::open(&bag).map(drop).expect_err("no recording");
        assert!(error.to_string().contains(expected), "{error}");
    };
    refused("its metadata.yaml cannot be read");
    list("rosbag2_bagfile_information:\n  storage_identifier: sqlite3\n");
    refused("its storage is `sqlite3`, not `mcap`");
    list("rosbag2_bagfile_information:\n  storage_identifier: mcap\n");
    refused("lists no files");
    list(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  \
         relative_file_paths:\n    - bag_0.mcap\n    - bag_1.mcap.zstd\n  duration:\n    \
         nanoseconds: 1\n  compression_format: zstd\n  compression_mode: FILE\n",
    );
    let found = read(&bag);
    assert_eq!(
        (found.len(), &found[0], &found[23]),
        (46, &found[23], &found[0])
    );
    // Both files have the same channels.
    let info = Info::read(&bag).expect("info");
    let channels: Vec<usize> = info.topics.values().map(|topic| topic.channels).collect();
    assert_eq!(channels, [1, 1, 1]);
}

#[test]
fn what_is_no_file_is_refused_at_once() {
    for path in ["/dev/null", "/dev/zero"] {
        let error = Reader::open(Path::new(path))
            .map(drop)
            .expect_err("a device");
        assert!(error.to_string().contains("not a regular file"), "{error}");
    }
}

#[test]
fn a_file_that_is_removed_while_it_is_written_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    let mut writer = Writer::create(&path, Limits::default()).expect("to create");
    let channel = writer.channel("/a", "json", None, BTreeMap::new());
    writer
        .write(channel, Stamp::default(), b"x")
        .expect("to write");
    std::fs::remove_file(&path).expect("to remove");
    let error = writer.finish().expect_err("it is gone").to_string();
    assert!(error.contains("removed while it was recorded"), "{error}");
}

#[test]
fn a_disk_without_room_refuses_a_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    let limits = Limits {
        keep_free: u64::MAX,
        ..Limits::default()
    };
    let error = Writer::create(&path, limits)
        .map(drop)
        .expect_err("no room");
    assert!(
        error.to_string().contains("free, which are kept"),
        "{error}"
    );
    assert!(!path.exists());
}
