//! Generated components and programs of the Python package `iceoryx2`, which follow
//! `docs/shared-memory-wire.md`. The programs are in `middleware/iceoryx2/tests/stranger`, as
//! examples for users.

use rc_test_site::site::{CommandOutput, Site};
use rc_test_support::python;
use serde_json::Value;
use std::path::Path;
use std::time::Instant;

/// Runs one of the programs in the network of a test.
pub(super) fn external(site: &Site, python: &Path, program: &str, args: &[&str]) -> CommandOutput {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../middleware/iceoryx2/tests/stranger"
    );
    let mut command = std::process::Command::new("timeout");
    // Without compiled files in the repository.
    command.arg("60").arg(python).arg("-B");
    command.arg(format!("{folder}/{program}"));
    command.arg(&site.network).args(args);
    let ran = site.run(command);
    assert_eq!(ran.code, 0, "{program}: {ran:?}");
    ran
}

pub(super) const PACKAGE: &str = "iceoryx2==0.10.0";

/// The status of the first slot of a component.
fn slot(site: &Site, component: &str) -> Value {
    site.ask(component, "status")["slots"][0].clone()
}

#[test]
fn a_python_client_calls_a_component() {
    let Some(python) = python::interpreter(PACKAGE, "a_python_client_calls_a_component") else {
        return;
    };
    let site = Site::new("ask");
    let _speech = site.start("speech_server", &[]);
    let asked = external(&site, python, "ask.py", &["hello, robot"]);
    assert_eq!(asked.stdout, "say True \nisBusy True \n", "{asked:?}");
    let slot = slot(&site, "speech_server");
    assert_eq!(slot["handlers"]["count"], 2, "{slot}");
    assert_eq!(slot["handlers"]["errors"], 0, "{slot}");
}

#[test]
fn a_python_subscriber_receives_from_a_component() {
    let Some(python) =
        python::interpreter(PACKAGE, "a_python_subscriber_receives_from_a_component")
    else {
        return;
    };
    let site = Site::new("hear");
    let _simulator = site.start("simulator", &[]);
    // The first poses are published before the program starts; it gets them as a late joiner.
    Site::until("some poses were sent", || {
        site.ask("simulator", "status")["compute"]["count"].as_u64() > Some(5)
    });
    let heard = external(&site, python, "hear.py", &["8"]);
    let mut lines = heard.stdout.lines();
    assert_eq!(lines.next(), Some("ready"));
    let poses: Vec<Value> = lines
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let first = poses[0][0].as_u64().expect("a number");
    for (pose, sequence) in poses.iter().zip(first..) {
        assert_eq!(pose[0], sequence, "{heard:?}");
        assert_eq!(pose[2], "simulator", "{heard:?}");
        let (x, y) = (pose[3][0].as_f64(), pose[3][1].as_f64());
        assert!(
            x.is_some_and(|x| x > 0.0) && y.is_some_and(|y| y > 0.0),
            "{heard:?}"
        );
        assert_eq!(pose[4], 100, "{heard:?}");
    }
    assert_eq!(poses.len(), 8);
}

#[test]
fn a_component_receives_from_a_python_publisher_and_counts_losses() {
    let Some(python) = python::interpreter(
        PACKAGE,
        "a_component_receives_from_a_python_publisher_and_counts_losses",
    ) else {
        return;
    };
    let site = Site::new("tell");
    let monitor = site.start_monitor("trace", 41);
    external(&site, python, "tell.py", &["40"]);
    Site::until("forty poses were received", || {
        slot(&site, "pose_monitor")["handlers"]["count"] == 40
    });
    let slot = slot(&site, "pose_monitor");
    assert_eq!(
        (&slot["lost"], &slot["handlers"]["errors"]),
        (&1.into(), &0.into()),
        "{slot}"
    );
    // The first number of another publisher is not a gap. Its first pose is the last that the
    // monitor waits for.
    external(&site, python, "tell.py", &["5"]);
    assert_eq!(monitor.end(), Some(0));
    let trace = std::fs::read_to_string(site.path("trace")).expect("a trace");
    let lines: Vec<&str> = trace.lines().collect();
    assert_eq!((lines.len(), lines[0]), (41, "1,1000,0,0"), "{trace}");
    let (x, y) = (1000.0 * 3.9_f64.cos(), 1000.0 * 3.9_f64.sin());
    assert_eq!(lines[39], format!("40,{},{},0", x as f32, y as f32));
}

/// Invalid requests and samples are counted, logged at most once a second, and change nothing.
#[test]
fn invalid_requests_and_samples_change_nothing() {
    let Some(python) = python::interpreter(PACKAGE, "invalid_requests_and_samples_change_nothing")
    else {
        return;
    };
    let site = Site::new("misuse");
    let start = Instant::now();
    let speech = site.start("speech_server", &[]);
    let monitor = site.start_monitor("trace", 10);

    let wrong = external(&site, python, "wrong.py", &["calls"]);
    let mut answers: Vec<&str> = wrong.stdout.lines().collect();
    assert_eq!(answers.pop(), Some("done"));
    assert!(
        answers[0].starts_with("unknown operation: there is no operation with the hash")
            && answers[1]
                .starts_with("invalid argument: `say` has types 000000000000004d there and")
            && answers[2].starts_with("invalid argument: `say`: the message ends too early"),
        "{wrong:?}"
    );
    assert!(
        answers.iter().all(|answer| !answer.starts_with("answered")),
        "{wrong:?}"
    );
    let of_speech = slot(&site, "speech_server");
    assert_eq!(
        of_speech["handlers"]["errors"],
        answers.len(),
        "{of_speech}"
    );
    assert_eq!(of_speech["handlers"]["count"], answers.len(), "{of_speech}");
    let busy = external(&site, python, "ask.py", &["still there"]);
    assert_eq!(busy.stdout, "say True \nisBusy True \n");

    external(&site, python, "wrong.py", &["values"]);
    Site::until("all samples were received", || {
        slot(&site, "pose_monitor")["handlers"]["errors"] == 88
    });
    let of_monitor = slot(&site, "pose_monitor");
    assert_eq!(of_monitor["handlers"]["count"], 88, "{of_monitor}");
    assert_eq!(of_monitor["lost"], 0, "{of_monitor}");
    external(&site, python, "tell.py", &["10"]);
    assert_eq!(monitor.end(), Some(0));

    let log = speech.log();
    let seconds = start.elapsed().as_secs() as usize;
    let complaints = log.lines().filter(|line| line.contains("WARN")).count();
    assert!(
        complaints >= 1 && complaints <= seconds + 1,
        "{seconds} s: {log}"
    );
    assert_eq!(log.matches("says: still there").count(), 1, "{log}");
    assert!(!log.contains("never said"), "{log}");
}
