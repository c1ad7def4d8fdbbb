//! The libraries `mcap`, `mcap-ros2-support` and `rosbags` of Python read a recording with the same
//! values, and we read theirs.

use crate::types::{channel, interface, message, values};
use rc_record::bag::{Decoder, Selection, each};
use rc_record::{Limits, Stamp, Writer};
use rc_test_support::python;
use serde_json::{Value as Json, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

const PACKAGES: &str = include_str!("packages.txt");

#[test]
fn libraries_of_others_read_and_write_recordings() {
    let test = "libraries_of_others_read_and_write_recordings";
    let Some(python) = python::packages("recordings", PACKAGES, test) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let (ours, theirs) = (
        folder.path().join("ours.mcap"),
        folder.path().join("theirs.mcap"),
    );
    let interface = interface();
    let mut writer = Writer::create(&ours, Limits::default()).expect("to create");
    writer
        .attach("net.ddsl", "text/plain", vec![1, 2])
        .expect("to attach");
    for (at, (operation, value, _)) in values().into_iter().enumerate() {
        let at = at as u64;
        let channel = channel(&mut writer, &interface, operation);
        let stamp = Stamp {
            log_time: 10 + at,
            publish_time: 20 + at,
            sequence: at as u32,
        };
        let data = message(&interface, operation, &value);
        writer.write(channel, stamp, &data).expect("to write");
    }
    writer
        .metadata("recording", &BTreeMap::new())
        .expect("to write");
    writer.finish().expect("to finish");

    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/all/strangers.py");
    let ran = Command::new(python)
        .arg(program)
        .args([&ours, &theirs])
        .output();
    let ran = ran.expect("to run");
    let said = String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success(), "{said}");
    let found: Json = serde_json::from_slice(&ran.stdout).expect("JSON");
    assert_eq!(found["messages"], 2);
    assert_eq!(found["attachments"], json!(["net.ddsl"]));
    assert_eq!(found["metadata"], json!(["recording"]));
    let names = [
        "robocomp_test_msgs/msg/Scan",
        "robocomp_test_msgs/msg/ScanPubMoved",
    ];
    for (at, (operation, _, value)) in values().into_iter().enumerate() {
        let topic = format!("/net/scanner/ScanPub/{operation}");
        assert_eq!(
            found["mcap"][at],
            json!([topic, names[at], 10 + at, 20 + at, value])
        );
        assert_eq!(
            found["rosbags"][at],
            json!([topic, names[at], 10 + at, value])
        );
    }

    let mut decoder = Decoder::default();
    let mut at = 0;
    let cut = each(&theirs, Selection::default(), &mut |message, _| {
        let value = decoder.value(&message)?;
        let value = serde_json::to_value(&value).expect("JSON");
        let steps: Vec<i32> = (0..at % 5).collect();
        let expected =
            json!({ "x": f64::from(at) / 4.0, "name": format!("pose {at}"), "steps": steps });
        assert_eq!(value, expected);
        at += 1;
        Ok(true)
    });
    assert!(cut.expect("to read").is_none());
    assert_eq!(at, 1000);
}
