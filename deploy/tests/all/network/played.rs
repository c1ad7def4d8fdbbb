//! A recording is played while it is read.

use crate::network::recorded::{Tool, received, text};
use rc_record::{Limits, Schema, Stamp, Writer};
use rc_test_site::site::Site;
use rustix::process::{Pid, Signal};
use std::collections::BTreeMap;
use std::path::Path;

/// How many messages of a MiB follow the first one, half a minute later.
const REST: u32 = 48;

/// A recording with a message at its beginning, and much behind it.
fn long(file: &Path) {
    let mut writer = Writer::create(file, Limits::default()).expect("to create");
    let schema = |name: &str, text: &str| Schema {
        name: format!("old_msgs/msg/{name}"),
        encoding: "ros2msg".to_owned(),
        text: text.as_bytes().to_vec(),
    };
    let pose = Some(schema("Pose", "float64 x\n"));
    let pose = writer.channel("/old", "cdr", pose, BTreeMap::new());
    let rest = Some(schema("Bytes", "uint8[] bytes\n"));
    let rest = writer.channel("/rest", "cdr", rest, BTreeMap::new());
    let stamp = |seconds: u64, sequence| Stamp {
        log_time: seconds * 1_000_000_000,
        publish_time: 0,
        sequence,
    };
    let first = [&[0, 1, 0, 0][..], &2.0_f64.to_le_bytes()].concat();
    let written = writer.write(pose, stamp(0, 0), &first);
    written.expect("to write");
    // Bytes that no compression makes fewer (xorshift).
    let mut state = 88_172_645_463_325_252_u64;
    let mut byte = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state as u8
    };
    for at in 0..REST {
        let bytes: Vec<u8> = (0..1 << 20).map(|_| byte()).collect();
        let length = (bytes.len() as u32).to_le_bytes();
        let data = [&[0, 1, 0, 0][..], &length, &bytes].concat();
        writer.write(rest, stamp(30, at), &data).expect("to write");
    }
    writer.finish().expect("to finish");
}

/// How many bytes a process has read.
fn read_by(process: Pid) -> u64 {
    let path = format!("/proc/{}/io", process.as_raw_nonzero());
    let text = std::fs::read_to_string(path).expect("it runs");
    let count = text.lines().find_map(|line| line.strip_prefix("rchar: "));
    count.and_then(|count| count.parse().ok()).expect("a count")
}

#[test]
fn the_first_message_is_sent_before_the_others_are_read() {
    let site = Site::new("played");
    let file = site.path("long.mcap");
    long(&file);
    let monitor = site.start_monitor("trace", 0);
    let remap = format!("/old={}/FullPoseEstimationPub/newFullPose", site.network);
    let args = ["play", &text(&file), "--network", &site.network];
    let args = [&args[..], &["--remap", &remap, "--convert"]].concat();
    let player = Tool::start(&site, &args);
    Site::until("the first message", || received(&site, "pose_monitor") > 0);
    let read = read_by(Pid::from_child(&player.0));
    let length = std::fs::metadata(&file).expect("a file").len();
    assert!(length > u64::from(REST) << 20, "{length}");
    assert!(read < length / 2, "{read} of {length} bytes were read");
    assert_eq!(player.end(Signal::INT), Some(0));
    drop(monitor);
}
