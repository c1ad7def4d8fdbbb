//! Files: what is written comes back, also of a file that was cut; a long recording has several.

use crate::types::{channel, interface, message, schema_of, values};
use rc_middleware::Encoding;
use rc_record::bag::{Decoder, Info, Selection, cut, each};
use rc_record::table::csv;
use rc_record::{Faults, Limits, Reader, Record, Stamp, Writer, definition};
use rc_values::Catalog;
use rc_values::description::Module;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The time between two messages, in nanoseconds.
const STEP: u64 = 1_000_000;

fn stamp(at: u64) -> Stamp {
    Stamp {
        log_time: 5_000_000_000 + at * STEP,
        publish_time: at,
        sequence: at as u32,
    }
}

/// Writes `count` messages, of two operations in turn.
fn write(path: &Path, count: u64, limits: Limits) -> Writer {
    let interface = interface();
    let mut writer = Writer::create(path, limits).expect("to create");
    writer
        .attach("net.ddsl", "text/plain", b"Deployment net {}".to_vec())
        .expect("to attach");
    let channels = ["newScan", "moved"].map(|name| channel(&mut writer, &interface, name));
    let messages = values().map(|(name, value, _)| message(&interface, name, &value));
    for at in 0..count {
        let which = (at % 2) as usize;
        writer
            .write(channels[which], stamp(at), &messages[which])
            .expect("to write");
    }
    writer
}

fn read(path: &Path) -> (Vec<u64>, Faults) {
    let mut reader = Reader::open(path).expect("a recording");
    let mut times = Vec::new();
    while let Some(record) = reader.next() {
        if let Record::Message(message) = record {
            assert_eq!(
                message.log_time,
                5_000_000_000 + message.publish_time * STEP
            );
            times.push(message.publish_time);
        }
    }
    (times, reader.faults().clone())
}

#[test]
fn what_is_written_comes_back_by_its_own_definition() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    write(&path, 2, Limits::default())
        .finish()
        .expect("to finish");
    let mut decoder = Decoder::default();
    let mut reader = Reader::open(&path).expect("a recording");
    let expected = values();
    let mut at = 0;
    while let Some(record) = reader.next() {
        match record {
            Record::Message(message) => {
                let value = decoder.value(&message).expect("a value");
                let json = serde_json::to_value(&value).expect("JSON");
                assert_eq!(json, expected[at].2);
                at += 1;
            }
            Record::Attachment(file) => assert_eq!(file.data, b"Deployment net {}"),
            Record::Metadata(..) => {}
        }
    }
    assert_eq!((at, reader.faults()), (2, &Faults::default()));
}

/// Types whose messages want one name each have their own definition.
#[test]
fn names_that_meet_hide_no_definition() {
    let point = |name: &str, member: &str, ty: &str| json!({"name": name, "struct": [{"name": member, "type": ty}]});
    let module: Module = serde_json::from_value(json!({
        "module": "RoboCompMeet",
        "types": [
            point("ScanRowsElement", "a", "uint8"),
            point("ScanNamesEntry", "b", "string"),
            point("MeetPubMoved", "c", "float64"),
            point("scan_data", "d", "uint16"),
            point("ScanData", "e", "bool"),
            {"name": "Scan", "struct": [
                {"name": "rows", "type": "sequence<sequence<int32>>"},
                {"name": "names", "type": "dictionary<string,int64>"},
                {"name": "one", "type": "RoboCompMeet::ScanRowsElement"},
                {"name": "two", "type": "RoboCompMeet::ScanNamesEntry"}
            ]}
        ],
        "interfaces": [{"name": "MeetPub", "operations": [
            {"name": "newScan", "id": 1, "hash": "00000000000000aa", "pattern": "publish",
             "inputs": [{"name": "scan", "type": "RoboCompMeet::Scan"}]},
            {"name": "moved", "id": 2, "hash": "00000000000000ab", "pattern": "publish",
             "inputs": [
                {"name": "to", "type": "RoboCompMeet::MeetPubMoved"},
                {"name": "low", "type": "RoboCompMeet::scan_data"},
                {"name": "high", "type": "RoboCompMeet::ScanData"}
             ]}
        ]}]
    }))
    .expect("a module");
    let catalog = Catalog::new(&[module]).expect("a catalog");
    let interface = catalog.interface("RoboCompMeet::MeetPub").expect("it");
    let scan =
        json!({"rows": [[1, 2], []], "names": {"k": -5}, "one": {"a": 7}, "two": {"b": "x"}});
    let moved = json!({"to": {"c": 0.5}, "low": {"d": 65535}, "high": {"e": true}});
    let mut scan_there = scan.clone();
    scan_there["rows"] = json!([{"data": [1, 2]}, {"data": []}]);
    scan_there["names"] = json!([{"key": "k", "value": -5}]);
    for (operation, sent, expected) in [
        ("newScan", json!({ "scan": scan }), scan_there),
        ("moved", moved.clone(), moved),
    ] {
        let schema = schema_of(interface, operation);
        let text = String::from_utf8(schema.text).expect("text");
        let mut headings: Vec<&str> = text.lines().filter(|l| l.starts_with("MSG: ")).collect();
        let count = headings.len();
        headings.sort_unstable();
        headings.dedup();
        assert_eq!(headings.len(), count, "{text}");
        let ty = definition::parse(&schema.name, &text).expect("a type");
        let data = message(interface, operation, &sent);
        let body = definition::body(&data).expect("a body");
        let value = rc_values::decode(&ty, Encoding::Cdr, body).expect("a value");
        assert_eq!(serde_json::to_value(&value).expect("JSON"), expected);
    }
}

#[test]
fn an_empty_sample_is_one_byte() {
    let interface = interface();
    let schema = schema_of(&interface, "tick");
    assert_eq!(schema.name, "robocomp_test_msgs/msg/ScanPubTick");
    let text = String::from_utf8(schema.text).expect("text");
    let ty = definition::parse(&schema.name, &text).expect("a type");
    assert_eq!(ty.members.len(), 1);
}

#[test]
fn a_file_that_was_cut_holds_all_chunks_before_its_end() {
    let folder = tempfile::tempdir().expect("a folder");
    let (whole, part) = (folder.path().join("x.mcap"), folder.path().join("y.mcap"));
    let count = 40_000;
    write(&whole, count, Limits::default())
        .finish()
        .expect("to finish");
    let all = read(&whole);
    assert_eq!((all.0.len() as u64, &all.1), (count, &Faults::default()));
    let bytes = std::fs::read(&whole).expect("bytes");
    let mut before = 0;
    for step in 0..=20 {
        let end = 8 + (bytes.len() - 9) * step / 20;
        std::fs::write(&part, &bytes[..end]).expect("to write");
        let (times, faults) = read(&part);
        // The order is kept, and a longer part holds no less.
        assert!(times.iter().copied().eq(0..times.len() as u64));
        assert!(times.len() >= before, "{step}");
        before = times.len();
        if faults.is_none() {
            assert_eq!(times.len() as u64, count, "{step}");
        }
    }
    assert_eq!(before as u64, count);
    // Several chunks: half of the file holds more than a third of the messages.
    std::fs::write(&part, &bytes[..bytes.len() / 2]).expect("to write");
    assert!(read(&part).0.len() as u64 > count / 3);
    // No MCAP at all.
    for text in ["hello", "hello, all"] {
        std::fs::write(&part, text).expect("to write");
        let error = Reader::open(&part).map(drop).expect_err("no recording");
        let expected = "it does not begin as an MCAP file does";
        assert!(error.to_string().ends_with(expected), "{error}");
    }
}

#[test]
fn a_long_recording_continues_in_other_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    let limits = Limits {
        bytes: Some(1 << 20),
        ..Limits::default()
    };
    let count = 30_000;
    let writer = write(&path, count, limits);
    let files = writer.files();
    writer.finish().expect("to finish");
    assert!(
        files.len() > 2 && files[1].ends_with("x.1.mcap"),
        "{files:?}"
    );
    // The first file stands for all, and each other one for itself.
    let (times, faults) = read(&path);
    assert!(
        faults.is_none() && times.into_iter().eq(0..count),
        "{faults}"
    );
    let info = Info::read(&path).expect("info");
    assert_eq!((info.attachments.len(), info.files.len()), (1, files.len()));
    let mut all = 0;
    for file in &files[1..] {
        let (times, faults) = read(file);
        assert!(faults.is_none());
        all += times.len() as u64;
        assert_eq!(Info::read(file).expect("info").attachments.len(), 1);
    }
    assert!(all > 0 && all < count);
    // A part that is not there is a fault.
    let aside = folder.path().join("aside");
    std::fs::rename(&files[1], &aside).expect("to rename");
    let (times, faults) = read(&path);
    assert!((times.len() as u64) < count);
    assert_eq!(
        (faults.to_string().as_str(), faults.is_none()),
        ("part 1 of it is missing", false)
    );
    std::fs::rename(&aside, &files[1]).expect("to rename");
    // A part that was cut has no summary, so its order is not known. The first time is.
    let last = files.last().expect("a part");
    let bytes = std::fs::read(last).expect("to read");
    std::fs::write(last, &bytes[..bytes.len() - 9]).expect("to write");
    let reader = Reader::open(&path).expect("a recording");
    let own = reader.times();
    assert_eq!(
        (own.first, own.last, own.is_ordered),
        (Some(stamp(0).log_time), None, false)
    );
    assert_eq!(reader.listed(), None);
    std::fs::write(last, &bytes).expect("to write");
    // The parts that are left when the oldest one was removed.
    std::fs::remove_file(&path).expect("to remove");
    assert_eq!(read(&files[1]).0.len() as u64, all);
}

#[test]
fn a_further_part_holds_the_last_file_of_each_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let limits = Limits {
        bytes: Some(1000),
        ..Limits::default()
    };
    let mut writer = Writer::create(&folder.path().join("x.mcap"), limits).expect("to create");
    for text in ["first", "second one"] {
        let data = text.as_bytes().to_vec();
        writer
            .attach("a.json", "application/json", data)
            .expect("to attach");
    }
    let channel = writer.channel("/a", "json", None, BTreeMap::new());
    for time in 0..2 {
        let stamp = Stamp {
            log_time: time,
            publish_time: time,
            sequence: 0,
        };
        writer.write(channel, stamp, &[0; 2000]).expect("to write");
    }
    let files = writer.files();
    writer.finish().expect("to finish");
    let attached = |file: &PathBuf| Info::read(file).expect("info").attachments;
    let expected = |length| ("a.json".to_owned(), length);
    // Messages that the second file repeats count once.
    assert_eq!(attached(&files[0]), [expected(5), expected(10)]);
    assert_eq!(attached(&files[1]), [expected(10)]);
}

#[test]
fn parts_and_tables_of_a_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let (path, part) = (folder.path().join("x.mcap"), folder.path().join("y.mcap"));
    let mut writer = write(&path, 100, Limits::default());
    let text = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    let table = BTreeMap::from([text("messages", "100"), text("network", "net")]);
    writer.metadata("recording", &table).expect("to write");
    writer.finish().expect("to finish");
    let selection = Selection {
        topics: vec!["moved".to_owned()],
        from: Some(Duration::from_millis(10)),
        to: Some(Duration::from_millis(19)),
    };
    let info = Info::read(&path).expect("info");
    assert_eq!(info.messages(), 100);
    assert_eq!(info.metadata["recording"], table);
    selection.check(&path).expect("it has the topic");
    let count = cut(&path, selection.clone(), &part).expect("to cut");
    assert_eq!(count, (5, Faults::default()));
    let cut = Info::read(&part).expect("info");
    assert_eq!(
        (cut.messages(), cut.attachments.len(), cut.topics.len()),
        (5, 1, 1)
    );
    // The counts are those of the part.
    let table = BTreeMap::from([text("messages", "5"), text("network", "net")]);
    assert_eq!(cut.metadata["recording"], table);
    let nothing = Selection {
        from: Some(Duration::from_secs(1000)),
        ..Selection::default()
    };
    let empty = folder.path().join("empty.mcap");
    let refused = rc_record::bag::cut(&path, nothing, &empty).map(drop);
    let refused = refused.expect_err("nothing is selected").to_string();
    assert!(refused.contains("no messages"), "{refused}");
    assert!(!empty.exists());

    let mut text = Vec::new();
    csv(&path, selection, None, None, &mut text).expect("a table");
    let text = String::from_utf8(text).expect("text");
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("log_time_s,publish_time_s,to.x,to.from_y,count")
    );
    assert_eq!(
        lines.next(),
        Some("5.011000000,0.000000011,2.5,0.125,18446744073709551615")
    );
    assert_eq!(lines.count(), 4);
    // Nothing is printed of several topics.
    let mut text = Vec::new();
    let refused = csv(&path, Selection::default(), None, None, &mut text).expect_err("two topics");
    assert!(refused.to_string().contains("several topics"), "{refused}");
    assert!(text.is_empty(), "{text:?}");

    let unknown = Selection {
        topics: vec!["movd".to_owned()],
        ..Selection::default()
    };
    let error = unknown.check(&path).expect_err("unknown").to_string();
    assert!(error.contains("did you mean `moved`?"), "{error}");
}

#[test]
fn a_recording_replaces_no_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    std::fs::write(&path, "mine").expect("to write");
    let refused = Writer::create(&path, Limits::default()).map(drop);
    let refused = refused.expect_err("it exists").to_string();
    assert!(refused.ends_with("this file exists already; remove it, or name another one"));
    assert_eq!(std::fs::read_to_string(&path).expect("to read"), "mine");
}

#[test]
fn a_part_of_an_earlier_recording_is_found_before_the_new_one_begins() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.mcap");
    let old = folder.path().join("x.3.mcap");
    std::fs::write(&old, b"").expect("to write");
    let limits = Limits {
        time: Some(Duration::from_mins(10)),
        ..Limits::default()
    };
    let refused = Writer::create(&path, limits).map(drop);
    let error = refused.expect_err("the fourth file exists").to_string();
    assert!(error.contains("x.3.mcap is a part"), "{error}");
    assert!(!path.exists());
    // Without a limit there are no parts.
    drop(Writer::create(&path, Limits::default()).expect("to create"));
    let other = folder.path().join("y.mcap");
    drop(Writer::create(&other, limits).expect("another name"));
}

#[test]
fn a_time_is_found_in_a_file_that_is_not_in_the_order_of_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, order: &[u64]| {
        let path = folder.path().join(name);
        let mut writer = Writer::create(&path, Limits::default()).expect("to create");
        let channel = channel(&mut writer, &interface(), "moved");
        for second in order {
            let mut stamp = stamp(0);
            stamp.log_time = second * 1_000_000_000;
            writer
                .write(channel, stamp, &[0, 1, 0, 0])
                .expect("to write");
            // It ends the chunk.
            let table = BTreeMap::from([(second.to_string(), String::new())]);
            writer.metadata("second", &table).expect("to write");
        }
        writer.finish().expect("to finish");
        path
    };
    let times = |path: &Path, to: u64| {
        let selection = Selection {
            from: Some(Duration::from_secs(1)),
            to: Some(Duration::from_secs(to)),
            ..Selection::default()
        };
        let mut found = Vec::new();
        let cut = each(path, selection, &mut |message, _| {
            found.push(message.log_time / 1_000_000_000);
            Ok(true)
        });
        assert_eq!(cut.expect("to read"), Faults::default());
        found
    };
    let merged = write("merged.mcap", &[30, 31, 39, 20, 21, 32]);
    assert_eq!(times(&merged, 11), [30, 31, 21], "times begin at 20 s");
    let ordered = write("ordered.mcap", &[20, 21, 30, 31, 32]);
    assert_eq!(times(&ordered, 11), [21, 30, 31]);
    // A cut recording keeps the tables behind it.
    let part = folder.path().join("part.mcap");
    let selection = Selection {
        to: Some(Duration::from_secs(1)),
        ..Selection::default()
    };
    let count = cut(&ordered, selection, &part).expect("a part");
    assert_eq!(count, (2, Faults::default()));
    let info = Info::read(&part).expect("a recording");
    assert!(info.metadata["second"].contains_key("32"), "{info:?}");
    let summary = Reader::open(&ordered).expect("a recording").times();
    assert_eq!(
        (summary.first, summary.is_ordered),
        (Some(20_000_000_000), true)
    );
    let summary = Reader::open(&merged).expect("a recording").times();
    assert_eq!(
        (summary.first, summary.is_ordered),
        (Some(20_000_000_000), false)
    );
    // A file that was cut has no summary, and is read to its end.
    let mut bytes = std::fs::read(&ordered).expect("to read");
    bytes.truncate(bytes.len() - 9);
    let short = folder.path().join("short.mcap");
    std::fs::write(&short, &bytes).expect("to write");
    assert_eq!(times(&short, 11), [21, 30, 31]);
}
