//! Measured chains of real components over shared memory: calls through three components, and
//! samples.

use rc_test_site::site::Site;
use serde_json::{Value, json};

/// Three components that call each other, and the poses of a simulator.
fn network(site: &Site) -> String {
    let neighbour = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/programs/neighbour/neighbour.cdsl"
    );
    let calls = |name: &str, does: &str| {
        let text = format!("cdsl \"{neighbour}\"; parameters {{ does \"{does}\"; }};");
        format!("    Component {name} {{ {text} }};\n")
    };
    format!(
        "Deployment {}\n{{\n{}{}{}    \
             Component simulator {{ cdsl \"../simulator/simulator.cdsl\"; }};\n    \
             Component monitor {{ cdsl \"../pose_monitor/pose_monitor.cdsl\"; }};\n    \
             bind a.other -> b.BatteryStatus;\n    bind b.other -> c.BatteryStatus;\n    \
             bind c.other -> simulator.BatteryStatus;\n    \
             bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;\n    \
             Chain power {{ from a.other.getBatteryState; to c.BatteryStatus.getBatteryState; \
                 within 150ms; late emergency c; }};\n    \
             Chain pose {{ from simulator.FullPoseEstimationPub.newFullPose; \
                 to monitor.FullPoseEstimationPub.newFullPose; within 10s; age 10s; }};\n}};\n",
        site.network,
        calls("a", "call"),
        calls("b", "call back"),
        calls("c", ""),
    )
}

pub(crate) fn chains(site: &Site) -> Vec<Value> {
    let shown = site.rcdeploy(&["chains", &site.network, "--format", "json"], false);
    assert_eq!(shown.code, 0, "{shown:?}");
    let document: Value = serde_json::from_str(&shown.stdout).expect("JSON");
    document["chains"].as_array().expect("chains").clone()
}

/// Records what runs, and looks at its chains afterwards.
fn a_recording_has_the_chains(site: &Site) {
    let path = |name: &str| site.path(name).display().to_string();
    let (file, events) = (path("chains.mcap"), path("chains.json"));
    let begun = |chain: &Value| chain["begun"].as_u64().expect("a count");
    let before: Vec<u64> = chains(site).iter().map(begun).collect();
    let record = ["record", &site.network, "-o", &file, "--length", "5s"];
    let recorded = site.rcdeploy(&record, false);
    assert_eq!(recorded.code, 0, "{recorded:?}");
    let after: Vec<u64> = chains(site).iter().map(begun).collect();
    let words = ["chains", "--from", &file, "--format", "json"];
    let shown = site.rcdeploy(&[&words[..], &["--perfetto", &events]].concat(), false);
    assert_eq!(shown.code, 0, "{shown:?}");
    let document: Value = serde_json::from_str(&shown.stdout).expect("JSON");
    assert_eq!(document["network"], site.network.as_str());
    let events: Value =
        serde_json::from_slice(&std::fs::read(events).expect("events")).expect("JSON");
    let events = events["traceEvents"].as_array().expect("events");
    for (at, chain) in document["chains"]
        .as_array()
        .expect("chains")
        .iter()
        .enumerate()
    {
        // What came to the end, not all that had before.
        assert!(begun(chain) > 0, "{chain}");
        assert!(begun(chain) <= after[at] - before[at], "{chain}");
        assert!(chain["times"]["p50_ms"].as_f64() > Some(0.0), "{chain}");
        assert_eq!(chain.get("traces"), None);
        let is_whole = |event: &&Value| event["ph"] == "b" && event["name"] == chain["name"];
        let messages = events.iter().filter(is_whole).count() as u64;
        assert!(messages > 0 && messages <= chain["complete"].as_u64().expect("a count"));
    }
    let works = |name: &str| events.iter().any(|e| e["ph"] == "X" && e["name"] == name);
    assert!(works("BatteryStatus.getBatteryState"), "{events:?}");
    let none = site.rcdeploy(&["chains", "--from", &path("none.mcap")], false);
    assert_eq!(none.code, 3, "{none:?}");
}

#[test]
fn chains_are_measured_and_a_slow_component_is_named() {
    let site = Site::new("chains");
    site.write_ddsl(&network(&site));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let followed = |chain: &Value| chain["complete"].as_u64() >= Some(20);
    Site::until("both chains to be measured", || {
        chains(&site).iter().all(followed)
    });
    for chain in chains(&site) {
        let hops = chain["hops"].as_array().expect("hops");
        assert_eq!(chain["missing"], json!([]), "{chain}");
        assert_eq!(chain["coverage"], 1.0, "{chain}");
        let p50 = |of: &Value| of["p50_ms"].as_f64().expect("a time");
        // A machine under load may lose nothing either: calls and samples wait in queues.
        assert!(hops.iter().all(|hop| hop["lost"] == 0), "{chain}");
        assert!(hops.iter().all(|hop| p50(&hop["times"]) > 0.0), "{chain}");
        assert!(p50(&chain["times"]) > 0.0, "{chain}");
    }
    a_recording_has_the_chains(&site);
    // Longer than a machine under load delays a message; unit tests find 50 ms.
    let slow = json!({"changes": {"delay": "200ms"}});
    site.tell("c", "parameters_set", &slow);
    Site::until("the chain to be late", || {
        let log = site.log("rcdeploy");
        let mut late = log.lines().filter(|line| line.contains("chain-late"));
        late.any(|line| line.contains("chain `power` took") && line.contains(" of them at c ("))
    });
    let work = &chains(&site)[0]["hops"][1]["work"];
    assert!(work["worst_ms"].as_f64() >= Some(200.0), "{work}");
    site.await_component("c", |status| status["state"] == "emergency");
    let text = site.rcdeploy(&["chains", &site.network], false).stdout;
    assert!(text.contains("\n    chain-late\n"), "{text}");
    assert!(
        text.contains("simulator.FullPoseEstimationPub.newFullPose → monitor."),
        "{text}"
    );
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
    let gone = site.rcdeploy(&["chains", &site.network], false);
    assert_eq!(gone.code, 3, "{gone:?}");
}
