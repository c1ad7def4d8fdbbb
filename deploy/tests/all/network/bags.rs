//! `rcdeploy bag` and its kin, without a network.

use crate::network::recorded::text;
use rc_record::{Limits, Schema, Stamp, Writer};
use rc_test_site::site::{CommandOutput, Site};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::collections::BTreeMap;
use std::path::Path;

/// The beginning of the recording: 2026-11-26 12:00:00 UTC.
const BEGIN: u64 = 1_795_694_400_000_000_000;

/// A message of [`write`].
fn sample(joints: &[f64], text: &str) -> Vec<u8> {
    let mut writer = rc_middleware::Writer::default();
    writer.length(joints.len());
    joints.iter().for_each(|joint| writer.put(joint));
    rc_middleware::cdr::text(text, &mut writer);
    // Places in the body count from behind the encapsulation.
    [&rc_record::ENCAPSULATION[..], &writer.into_bytes()].concat()
}

/// Eleven messages in 125 seconds, of which the last one is in a chunk of its own.
fn write(path: &Path) {
    let mut writer = Writer::create(path, Limits::default()).expect("to create");
    let schema = Schema {
        name: "test_msgs/msg/Arm".to_owned(),
        encoding: "ros2msg".to_owned(),
        text: b"float64[] joints\nstring text\n".to_vec(),
    };
    let channel = writer.channel("/arm", "cdr", Some(schema), BTreeMap::new());
    for at in 0..11 {
        let time = BEGIN + at * 12_500_000_007;
        let stamp = Stamp {
            log_time: time,
            publish_time: time,
            sequence: 0,
        };
        let joints: &[f64] = if at == 10 { &[1.0, 2.0, 3.0] } else { &[0.5] };
        let text = "a\u{1b}[31mb\u{7}";
        writer
            .write(channel, stamp, &sample(joints, text))
            .expect("to write");
        if at == 9 {
            let table = BTreeMap::from([("k".to_owned(), "v".to_owned())]);
            writer.metadata("m", &table).expect("to write");
        }
    }
    writer.finish().expect("to finish");
}

#[test]
fn a_recording_is_shown_to_people() {
    let site = Site::new("bags");
    let path = site.path("x.mcap");
    write(&path);
    let file = text(&path);
    let bag = |args: &[&str]| -> CommandOutput { site.rcdeploy(&[&["bag"], args].concat(), false) };
    let info = bag(&["info", &file]);
    assert_eq!(info.code, 0, "{info:?}");
    for line in [
        "begin        2026-11-26 12:00:00.000 UTC",
        "length       2 min 5 s",
        "messages     11",
    ] {
        assert!(info.stdout.lines().any(|l| l == line), "{line}: {info:?}");
    }
    assert!(info.stdout.contains("0.1 Hz"), "{info:?}");
    // Nothing of a text vanishes, and short sequences have columns.
    let csv = bag(&["export", "csv", &file]);
    let mut lines = csv.stdout.lines();
    let head = "log_time_s,publish_time_s,joints[0],joints[1],joints[2],text";
    assert_eq!(lines.next(), Some(head), "{csv:?}");
    let row = lines.next().unwrap_or_default();
    assert!(row.ends_with(",0.5,,,a\\u{1b}[31mb\\u{7}"), "{row}");
    // A reader that has seen enough is not a failure.
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let mut left = std::process::Command::new(Site::executable("rcdeploy"));
    left.args(["bag", "export", "csv", &file]).stdout(writer);
    let left = left.output().expect("it runs");
    assert_eq!(left.status.code(), Some(0), "{left:?}");
    assert!(left.stderr.is_empty(), "{left:?}");
    assert!(
        csv.stdout
            .lines()
            .last()
            .is_some_and(|row| row.contains(",1,2,3,a"))
    );
    let list = bag(&["list", &file, "-n", "1"]);
    assert!(list.stdout.contains("\"a\\u{1b}[31mb\\u{7}\""), "{list:?}");
    // The time after the beginning is one for `--from`.
    let later = bag(&["list", &file, "--from", "12.500000007s", "-n", "1"]);
    let wanted = "2026-11-26 12:00:12.500 UTC +12.500000007s /arm\n";
    assert!(later.stdout.starts_with(wanted), "{later:?}");
    let json = bag(&["list", &file, "-n", "1", "--format", "json"]);
    let wanted = "\"log_time\":\"1795694400.000000000\"";
    assert!(json.stdout.contains(wanted), "{json:?}");

    // A part without messages is not written.
    let part = text(&site.path("part.mcap"));
    let empty = bag(&["cut", &file, "--from", "10min", "-o", &part]);
    assert_eq!(
        (empty.code, site.path("part.mcap").exists()),
        (1, false),
        "{empty:?}"
    );
    assert!(
        empty.stderr.contains("the selection has no messages"),
        "{empty:?}"
    );
    // Damage is told by the exit code.
    let mut bytes = std::fs::read(&path).expect("to read");
    for byte in &mut bytes[150..153] {
        *byte ^= 0x55;
    }
    std::fs::write(&path, bytes).expect("to write");
    for args in [
        &["cut", &file, "-o", &part][..],
        &["list", &file],
        &["export", "csv", &file],
    ] {
        let ran = bag(args);
        assert_eq!(ran.code, 1, "{ran:?}");
        let note = "the recording is incomplete: 1 damaged chunk or record was skipped";
        assert!(ran.stderr.contains(note), "{ran:?}");
    }
    assert!(
        bag(&["cut", &file, "-o", &part])
            .stderr
            .contains("exists already")
    );
    let info = bag(&["info", &part]);
    assert!(info.stdout.contains("messages     1\n"), "{info:?}");
}

#[test]
fn a_pipe_is_no_recording_and_no_time_is_no_part() {
    let site = Site::new("pipe");
    let pipe = site.path("x.mcap");
    mknodat(CWD, &pipe, FileType::Fifo, Mode::from_raw_mode(0o600), 0).expect("a pipe");
    let file = text(&pipe);
    for args in [
        &["bag", "info", &file][..],
        &["bag", "list", &file],
        &["bag", "export", "csv", &file],
        &["replay", &file],
    ] {
        let ran = site.rcdeploy(args, false);
        assert_eq!(ran.code, 3, "{ran:?}");
        assert!(ran.stderr.contains("not a regular file"), "{ran:?}");
    }
    for option in ["--split", "--ring"] {
        let ran = site.rcdeploy(&["record", &site.network, option, "0s"], false);
        assert_eq!(ran.code, 2, "{ran:?}");
        assert!(ran.stderr.contains("a time above 0 is expected"), "{ran:?}");
    }
}
