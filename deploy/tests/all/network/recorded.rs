//! Recordings of networks: what is recorded, also by a recorder that is killed or has no disk, and
//! components that run against yesterday.

use rc_record::bag::Info;
use rc_record::{Limits, Schema, Stamp, Writer, keys};
use rc_test_site::recordings::count;
use rc_test_site::site::{CommandOutput, Running, Site};
use rc_test_support::python;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Child, Command, Stdio};

const PACKAGES: &str = include_str!("../../../record/tests/all/packages.txt");

/// A running command. Dropping it kills it.
pub(crate) struct Tool(pub(crate) Child);

impl Tool {
    pub(crate) fn start(site: &Site, args: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
        command.args(args);
        site.place(&mut command);
        let output = std::fs::File::create(site.path("tool.log")).expect("a log");
        command.stdout(Stdio::null()).stderr(output);
        Self(command.spawn().expect("rcdeploy"))
    }

    pub(crate) fn record(site: &Site, args: &[&str]) -> Self {
        Self::start(site, &[&["record", &site.network], args].concat())
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.0), signal).expect("to signal");
    }

    /// Sends a signal, waits for the end, and returns the exit code.
    pub(crate) fn end(mut self, signal: Signal) -> Option<i32> {
        self.signal(signal);
        self.0.wait().expect("a child").code()
    }
}

impl Drop for Tool {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(crate) fn info(file: &Path) -> Info {
    Info::read(file).unwrap_or_default()
}

pub(crate) fn text(path: &Path) -> String {
    path.display().to_string()
}

pub(crate) fn up(site: &Site) {
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
}

pub(crate) fn down(site: &Site) {
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

fn slot(site: &Site, component: &str, slot: usize) -> Value {
    site.ask(component, "status")["slots"][slot].clone()
}

/// The samples that a slot has handled, and those that it has lost.
pub(crate) fn received(site: &Site, component: &str) -> u64 {
    let slot = slot(site, component, 0);
    let number = |value: &Value| value.as_u64().unwrap_or_default();
    number(&slot["handlers"]["count"]) + number(&slot["lost"])
}

pub(crate) fn play(site: &Site, file: &Path, args: &[&str]) -> CommandOutput {
    let file = text(file);
    let all = [&["play", &file, "--network", &site.network], args].concat();
    let ran = site.rcdeploy(&all, false);
    assert_eq!(ran.code, 0, "{ran:?}");
    ran
}

#[test]
fn a_patrol_is_recorded_and_played_back() {
    let site = Site::new("recorded");
    site.monitor("trace", 0);
    site.edit("patrol.ddsl", |text| {
        let monitor = "pose_monitor.cdsl\";";
        text.replace(monitor, &format!("{monitor} config \"monitor.toml\";"))
    });
    up(&site);
    let file = site.path("x.mcap");
    let recorder = Tool::record(&site, &["-o", &text(&file)]);
    Site::until("messages in the file", || {
        let info = info(&file);
        count(&info, "/newFullPose") > 20 && count(&info, "/getLaserData/_reply") > 5
    });
    // A recorder that stands still misses what its queue does not hold, and counts it.
    site.tell("simulator", "period", &json!({ "ms": 5 }));
    recorder.signal(Signal::STOP);
    let before = received(&site, "monitor");
    // 100 poses wait for each subscriber.
    Site::until("more poses than wait", || {
        received(&site, "monitor") > before + 120
    });
    recorder.signal(Signal::CONT);
    site.tell("simulator", "period", &json!({ "ms": 50 }));
    let resumed = count(&info(&file), "/newFullPose");
    Site::until("poses behind the gap", || {
        count(&info(&file), "/newFullPose") > resumed + 5
    });
    assert_eq!(recorder.end(Signal::INT), Some(0));
    let whole = info(&file);
    assert!(whole.faults.is_none(), "{whole:?}");
    let table = &whole.metadata["recording"];
    let lost: u64 = table["lost"].parse().expect("a number");
    let of_poses = table
        .iter()
        .find(|(name, _)| name.ends_with("/newFullPose"));
    assert!(lost > 0 && of_poses.is_some(), "{table:?}");
    assert!(count(&whole, "/loss") > 0, "{:?}", whole.topics.keys());
    let asked = count(&whole, "/getLaserData/_request");
    let answered = count(&whole, "/getLaserData/_reply");
    assert!(asked.abs_diff(answered) <= 1, "{asked} {answered}");
    assert!(count(&whole, "/setSpeedBase/_request") > 5);
    assert_eq!(count(&whole, "/parameters"), 3);
    assert!(count(&whole, "/state") >= 3);
    let attached: Vec<&str> = whole.attachments.iter().map(|(n, _)| n.as_str()).collect();
    for file in ["patrol.ddsl", "simulator.described.json", "monitor.toml"] {
        assert!(attached.contains(&file), "{attached:?}");
    }
    let poses = count(&whole, "/newFullPose");
    let (_, topic) = whole
        .topics
        .iter()
        .find(|(name, _)| name.ends_with("/newFullPose"))
        .expect("poses");
    assert_eq!(
        topic.channel.get(keys::ENDS),
        Some("simulator.FullPoseEstimationPub")
    );
    let name = text(&file);
    let table = ["bag", "export", "csv", &name, "--topics", "newFullPose"];
    let table = site.rcdeploy(&table, false);
    assert_eq!(table.stdout.lines().count() as u64, poses + 1, "{table:?}");

    refused(&site, &name);
    killed(&site);
    down(&site);
    plays(&site, &file, poses);
    plays_elsewhere(&site, &file, poses);
    strangers(&site, &file, poses);
}

/// Names and files that cannot be.
fn refused(site: &Site, file: &str) {
    let record = |args: &[&str]| site.rcdeploy(&[&["record", &site.network], args].concat(), false);
    let ran = record(&["newFullPos", "-o", "y.mcap"]);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(ran.stderr.contains("did you mean"), "{ran:?}");
    assert!(!site.path("y.mcap").exists(), "{ran:?}");
    // A file is not overwritten.
    let ran = record(&["-o", file]);
    assert_eq!(ran.code, 3, "{ran:?}");
    let expected = "this file exists already; remove it, or name another one\n";
    assert!(ran.stderr.ends_with(expected), "{ran:?}");
    // The name of the only network may be left out, so this is a topic.
    let ran = site.rcdeploy(&["record", "no_such_network"], false);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(
        ran.stderr
            .contains("no topic or operation `no_such_network`"),
        "{ran:?}"
    );
    let ran = record(&["--now"]);
    assert!(ran.stderr.contains("keeps no ring"), "{ran:?}");
    // A full disk: the shell limits the size of a file, and the signal that goes with it is
    // ignored.
    let program = env!("CARGO_BIN_EXE_rcdeploy");
    let full = site.path("full.mcap");
    let script = format!(
        "trap '' XFSZ; ulimit -f 64; exec {program} record {} -o {}",
        site.network,
        full.display()
    );
    let mut command = Command::new("sh");
    command.args(["-c", &script]);
    let ran = site.run(command);
    assert_eq!(ran.code, 3, "{ran:?}");
    assert!(ran.stderr.contains("the recording has stopped"), "{ran:?}");
    assert!(ran.stderr.contains("the network runs on"), "{ran:?}");
    assert!(info(&full).messages() > 0);
    assert_eq!(site.ask("simulator", "status")["state"], "running");
}

/// A recorder that is killed leaves all but the last moment.
fn killed(site: &Site) {
    let file = site.path("killed.mcap");
    let recorder = Tool::record(site, &["newFullPose", "-o", &text(&file)]);
    Site::until("chunks", || count(&info(&file), "/newFullPose") > 0);
    recorder.end(Signal::KILL);
    let cut = info(&file);
    assert!(cut.faults.cut.is_some(), "{cut:?}");
    assert!(count(&cut, "/newFullPose") > 0, "{cut:?}");
    // Only what was named, with what is recorded of the network itself.
    assert_eq!(count(&cut, "_request"), 0, "{cut:?}");
    let ran = play(site, &file, &["--rate", "20"]);
    assert!(ran.stderr.contains("ends before its end"), "{ran:?}");
    assert!(!ran.stdout.starts_with("0 messages sent"), "{ran:?}");
    let part = text(&site.path("part.mcap"));
    let ran = site.rcdeploy(&["bag", "cut", &text(&file), "-o", &part], false);
    assert_eq!(ran.code, 1, "{ran:?}");
    assert!(ran.stderr.contains("ends before its end"), "{ran:?}");
}

/// A monitor and an avoider, started by hand, run against the recording.
fn plays(site: &Site, file: &Path, poses: u64) {
    let monitor = site.start_monitor("second", 0);
    let avoider: Running = site.start("avoider", &[]);
    let ran = play(site, file, &["--rate", "2"]);
    assert!(
        ran.stdout.contains(&format!("{poses} messages sent")),
        "{ran:?}"
    );
    // The last ones may be on their way when the player ends on a busy machine.
    Site::until("most poses", || 2 * received(site, "pose_monitor") > poses);
    // The calls of the avoider get the replies of the recorded scanner.
    assert!(!ran.stdout.contains(" 0 calls answered"), "{ran:?}");
    drop(avoider);

    // Again and again: more than the recording has.
    let before = received(site, "pose_monitor");
    let name = text(file);
    let args = [
        "--network",
        &site.network,
        "--topics",
        "newFullPose",
        "--rate",
        "20",
        "--loop",
    ];
    let again = Tool::start(site, &[&["play", &name], &args[..]].concat());
    Site::until("the third time", || {
        received(site, "pose_monitor") > before + 2 * poses
    });
    assert_eq!(again.end(Signal::INT), Some(0));

    // Another type: it is told, and converted only on request.
    let other = site.path("other.mcap");
    another_type(&other);
    let before = received(site, "pose_monitor");
    let pose = format!("/old={}/FullPoseEstimationPub/newFullPose", site.network);
    let ran = play(site, &other, &["--remap", &pose]);
    assert!(ran.stderr.contains("--convert"), "{ran:?}");
    assert!(ran.stdout.contains("0 messages sent"), "{ran:?}");
    let ran = play(site, &other, &["--remap", &pose, "--convert"]);
    // Gaps of years are not waited for.
    assert!(ran.stdout.contains("4 messages sent"), "{ran:?}");
    for note in [
        "146 years 85 days without messages are skipped",
        "goes back by 146 years",
    ] {
        assert!(ran.stderr.contains(note), "{ran:?}");
    }
    Site::until("the converted poses", || {
        received(site, "pose_monitor") > before
    });
    // What cannot be remapped is said before anything is sent.
    for (wrong, reason) in [
        (
            pose.replace("/old", "/odd"),
            "no messages of a topic `/odd`",
        ),
        ("/old=newFullPos".to_owned(), "did you mean"),
    ] {
        let file = text(&other);
        let ran = ["play", &file, "--network", &site.network, "--remap", &wrong];
        let ran = site.rcdeploy(&ran, false);
        assert_ne!(ran.code, 0, "{ran:?}");
        assert!(ran.stderr.contains(reason), "{ran:?}");
    }
    assert_eq!(received(site, "pose_monitor"), before + 4);
    drop(monitor);

    // A component that follows a time gets the recorded one.
    let config = site.monitor("fourth", 0);
    let args = ["--clock", "simulated", "--config", &config];
    let follower = site.start("pose_monitor", &args);
    play(site, file, &["--clock", "--rate", "4"]);
    let clock = site.ask("pose_monitor", "status")["clock"].clone();
    let (first, last) = info(file).times.expect("times");
    let time = clock["time_s"].as_f64().unwrap_or_default();
    let recorded = (first as f64 / 1e9 - 1.0)..(last as f64 / 1e9 + 1.0);
    assert!(recorded.contains(&time), "{clock} {recorded:?}");
    drop(follower);
}

/// A network of another name gets the recording, and the command says whose it is.
fn plays_elsewhere(site: &Site, file: &Path, poses: u64) {
    let other = Site::new("elsewhere");
    assert_ne!(other.network, site.network);
    let config = other.monitor("trace", 0);
    let slot = "FullPoseEstimationPub";
    let address = format!("{slot}={}/simulator/{slot}", other.network);
    let monitor = other.start("pose_monitor", &["--config", &config, "--bind", &address]);
    let ran = play(&other, file, &["--topics", "newFullPose", "--rate", "4"]);
    let note = format!(
        "the recording is of the network `{}`; it is played into `{}`",
        site.network, other.network
    );
    assert_eq!(ran.stderr.matches(&note).count(), 1, "{ran:?}");
    let sent = format!("{poses} messages sent");
    assert!(ran.stdout.contains(&sent), "{ran:?}");
    Site::until("most poses", || {
        2 * received(&other, "pose_monitor") > poses
    });
    kill_process(monitor.pid(), Signal::TERM).expect("to stop it");
    assert_eq!(monitor.end(), Some(0));
    other.assert_nothing_left();
}

/// A recording of an older type, which has other members, while a clock was set.
fn another_type(file: &Path) {
    let mut writer = Writer::create(file, Limits::default()).expect("to create");
    let schema = Schema {
        name: "old_msgs/msg/Pose".to_owned(),
        encoding: "ros2msg".to_owned(),
        text: b"float64 x\nfloat64 y\nint32 removed\n".to_vec(),
    };
    let channel = writer.channel("/old", "cdr", Some(schema), BTreeMap::new());
    for (at, time) in (0_u32..).zip([0, 1_000_000, 1 << 62, 2_000_000]) {
        let mut data = vec![0, 1, 0, 0];
        data.extend(f64::from(at).to_le_bytes());
        data.extend(2.0_f64.to_le_bytes());
        data.extend(7_i32.to_le_bytes());
        let stamp = Stamp {
            log_time: time,
            publish_time: 0,
            sequence: at,
        };
        writer.write(channel, stamp, &data).expect("to write");
    }
    writer.finish().expect("to finish");
}

/// The libraries of others read the recording, and what they write is played.
fn strangers(site: &Site, file: &Path, poses: u64) {
    let test = "a_patrol_is_recorded_and_played_back";
    let Some(python) = python::packages("recordings", PACKAGES, test) else {
        return;
    };
    let theirs = site.path("theirs.mcap");
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/all/network/recorded.py");
    let mut command = Command::new(python);
    command
        .arg(program)
        .args([file, Path::new("newFullPose"), &theirs]);
    let ran = site.run(command);
    assert_eq!(ran.code, 0, "{ran:?}");
    let found: Value = serde_json::from_str(&ran.stdout).expect("JSON");
    let whole = info(file);
    for library in ["mcap", "rosbags"] {
        let counts = found[library].as_object().expect("counts");
        let ours = whole.topics.iter().filter(|(_, topic)| topic.count > 0);
        let ours: BTreeMap<&String, u64> = ours.map(|(name, t)| (name, t.count)).collect();
        let theirs = counts
            .iter()
            .filter_map(|(name, n)| Some((name, n.as_u64()?)));
        assert_eq!(theirs.collect::<BTreeMap<_, _>>(), ours, "{library}");
    }
    assert_eq!(found["qos"], true);
    let table = ["bag", "list", &text(file), "--topics", "newFullPose"];
    let table = site.rcdeploy(&[&table[..], &["--format", "json"]].concat(), false);
    let ours = table.stdout.lines().map(|line| {
        let line: Value = serde_json::from_str(line).expect("JSON");
        [line["value"]["x"].clone(), line["value"]["y"].clone()]
    });
    let values = found["values"].as_array().expect("values").iter();
    let read = values.map(|value| [value[1].clone(), value[2].clone()]);
    assert_eq!(ours.collect::<Vec<_>>(), read.collect::<Vec<_>>());

    // A file of theirs, under another name, goes to the only topic of its type.
    let monitor = site.start_monitor("third", 0);
    let ran = play(site, &theirs, &["--rate", "4"]);
    assert!(ran.stderr.contains("the only topic of its type"), "{ran:?}");
    Site::until("most poses", || 2 * received(site, "pose_monitor") > poses);
    drop(monitor);
}

#[test]
fn a_recording_that_is_split_goes_on_in_whole_files() {
    let site = Site::new("split");
    up(&site);
    let file = |part: &str| site.path(&format!("x{part}.mcap"));
    let args = ["newFullPose", "-o", &text(&file("")), "--split", "1s"];
    let recorder = Tool::record(&site, &args);
    Site::until("a third file", || {
        file(".2").exists() && count(&info(&file(".1")), "/newFullPose") > 0
    });
    assert_eq!(recorder.end(Signal::INT), Some(0));
    let mut end = 0;
    let (mut repeated, mut poses) = (0, 0);
    for part in [".1", ".2"] {
        let part = info(&file(part));
        assert!(part.faults.is_none(), "{part:?}");
        assert!(
            part.attachments
                .iter()
                .any(|(name, _)| name == "patrol.ddsl")
        );
        // The last one may have ended before its first message.
        if let Some((first, last)) = part.times {
            assert!(first >= end, "{part:?}");
            end = last;
            // The last pose before is repeated: late subscribers get it.
            poses += count(&part, "/newFullPose");
            repeated += 1;
            assert_eq!(count(&part, "/parameters"), 3, "{part:?}");
        }
    }
    // The first file means all of them, without what is repeated.
    let whole = info(&file(""));
    assert!(
        whole.faults.is_none() && whole.files.len() >= 3,
        "{whole:?}"
    );
    assert_eq!(count(&whole, "/parameters"), 3, "{whole:?}");
    assert!(
        count(&whole, "/newFullPose") > poses - repeated,
        "{whole:?}"
    );
    down(&site);
}
