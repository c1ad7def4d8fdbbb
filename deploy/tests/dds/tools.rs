//! The commands that look at a running patrol, record it and play it, over the middleware of the
//! network.

use rc_record::bag::Info;
use rc_test_site::recordings::count;
use rc_test_site::site::{CommandOutput, Site};
use serde_json::Value;
use std::path::Path;

/// Runs rcdeploy where the network runs.
pub(crate) fn tool(site: &Site, args: &[&str]) -> CommandOutput {
    let mut command = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    command.args(args);
    site.run(command)
}

/// A command about the network of this site, which succeeds.
fn succeeds(site: &Site, command: &str, args: &[&str]) -> String {
    let ran = tool(site, &[&[command, site.network.as_str()], args].concat());
    assert_eq!(ran.code, 0, "{command}: {ran:?}");
    ran.stdout
}

/// Its first line as JSON.
fn json(site: &Site, command: &str, args: &[&str]) -> Value {
    let args = [args, &["--format", "json"]].concat();
    let printed = succeeds(site, command, &args);
    serde_json::from_str(printed.lines().next().unwrap_or_default()).expect("JSON")
}

fn handled(site: &Site) -> Option<u64> {
    site.ask("monitor", "status")["slots"][0]["handlers"]["count"].as_u64()
}

/// Measures the delay of poses that another host sends. Both hosts of the test have one clock.
pub(crate) fn delay(site: &Site, host: &str) {
    Site::until("a delay", || {
        let delay = json(site, "delay", &["newFullPose", "--lines", "1"]);
        let clock = &delay["clock"];
        assert_eq!(clock["host"], host, "{delay}");
        let number = |value: &Value| value.as_f64();
        let (Some(error), Some(ahead), Some(least)) = (
            number(&clock["uncertainty_ms"]),
            number(&clock["ahead_ms"]),
            number(&delay["delay_ms"]["min"]),
        ) else {
            return false;
        };
        assert!(error > 0.0, "{delay}");
        assert!(ahead.abs() <= error + 0.001, "{delay}");
        assert!(least >= -error - 0.001, "{delay}");
        true
    });
    let printed = succeeds(site, "delay", &["newFullPose", "--lines", "2"]);
    let said = format!("the clock of {host} is ");
    assert!(printed.contains(&said), "{printed}");
}

/// The latency of the poses by `bench`: `is_known` judges its connection.
fn latency(site: &Site, middleware: &str, is_known: impl Fn(&Value) -> bool) {
    Site::until("latencies", || {
        let run = json(site, "bench", &["--seconds", "1"]);
        let connections = run["connections"].as_array().expect("a list").clone();
        let to = "monitor.FullPoseEstimationPub.newFullPose";
        let one = connections.into_iter().find(|one| one["to"] == to);
        let one = one.unwrap_or_else(|| panic!("{run}"));
        assert_eq!(one["from"], "simulator.FullPoseEstimationPub", "{run}");
        assert_eq!(one["middleware"], middleware, "{run}");
        one["times"]["p50_ms"].as_f64().is_some() && is_known(&one)
    });
}

/// The latency over the cable, with the error of the clock of the other host.
pub(crate) fn bench(site: &Site) {
    // Until the first round trips, the clock is unknown.
    latency(site, "dds", |one| one["error_ms"].as_f64() > Some(0.0));
}

/// Looks at a running patrol.
pub(crate) fn look(site: &Site, middleware: &str) {
    let listed = json(site, "list", &[]);
    let topic = &listed["topics"][0];
    assert_eq!(topic["middleware"], middleware, "{listed}");
    assert_eq!(topic["publishers"][0]["component"], "simulator", "{listed}");
    let echoed = succeeds(site, "echo", &["newFullPose", "--once"]);
    assert!(
        echoed.starts_with("# ") && echoed.contains("\npose:\n"),
        "{echoed}"
    );
    let calls = succeeds(site, "echo", &["getLaserData", "--count", "2"]);
    assert!(calls.contains("# request getLaserData"), "{calls}");
    Site::until("a rate", || {
        let hz = json(site, "hz", &["newFullPose", "--lines", "1"]);
        hz["rate_hz"].as_f64() > Some(0.0)
    });
    Site::until("bytes", || {
        let bw = json(site, "bw", &["newFullPose", "--lines", "1"]);
        bw["bytes_per_s"].as_f64() > Some(0.0) && bw["mean_bytes"].as_u64() > Some(0)
    });
    latency(site, middleware, |one| {
        one["messages"].as_u64() > Some(0) && one["times"]["p50_ms"].as_f64() > Some(0.0)
    });
    let printed = succeeds(site, "bench", &["--seconds", "1"]);
    assert!(printed.contains("In parentheses: "), "{printed}");
    let called = json(site, "call", &["getLaserConfData"]);
    let measures = &called["result"]["return"]["maxMeasures"];
    assert!(measures.is_number(), "{called}");
    succeeds(site, "call", &["setSpeedBase", r#"{"adv": 1}"#]);
    let sent = tool(
        site,
        &[
            "send",
            &site.network,
            "newFullPose",
            r#"{"pose": {"confidence": 101}}"#,
        ],
    );
    assert!(sent.stderr.contains("0 to 100"), "{sent:?}");
    let before = handled(site);
    succeeds(site, "send", &["newFullPose", r#"{"pose": {"x": 1}}"#]);
    Site::until("the monitor handles poses", || handled(site) > before);
}

/// Records a running patrol, stops its simulator, and plays the recording, whose name is returned.
pub(crate) fn record_and_play(site: &Site) -> String {
    let mut number = 0;
    let mut file = String::new();
    Site::until("a recording of poses and calls", || {
        number += 1;
        let path = site.path(&format!("{number}.mcap"));
        file = path.display().to_string();
        succeeds(site, "record", &["-o", &file, "--length", "2s"]);
        let info = Info::read(&path).expect("a recording");
        count(&info, "/newFullPose") > 0 && count(&info, "/getLaserData/_reply") > 0
    });
    let stopped = tool(site, &["stop", &site.network, "simulator"]);
    assert_eq!(stopped.code, 0, "{stopped:?}");
    let before = handled(site);
    let answered = || {
        let ran = tool(site, &["play", &file, "--network", &site.network]);
        assert_eq!(ran.code, 0, "{ran:?}");
        assert!(!ran.stdout.starts_with("0 messages sent"), "{ran:?}");
        !ran.stdout.contains(", 0 calls answered")
    };
    // The clients find the new server after a while.
    Site::until("calls are answered", answered);
    assert!(handled(site) > before);
    file
}
