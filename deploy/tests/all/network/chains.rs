//! Measured chains of real components over shared memory: calls through three components, and
//! samples. One slow component makes several chains late, each with an action of its own.

use rc_test_site::site::Site;
use serde_json::{Value, json};

/// Three components that call each other, and the poses of a simulator.
fn network(site: &Site) -> String {
    let neighbour = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/programs/neighbour/neighbour.cdsl"
    );
    // Longer than a computer under load delays a message.
    let late = |name: &str, action: &str| {
        format!(
            "    Chain {name} {{ from a.other.getBatteryState; to c.BatteryStatus.getBatteryState; \
                 within 250ms; {action} }};\n"
        )
    };
    let calls = |name: &str, does: &str| {
        let text = format!("cdsl \"{neighbour}\"; parameters {{ does \"{does}\"; }};");
        format!("    Component {name} {{ {text} }};\n")
    };
    format!(
        "Deployment {}\n{{\n{}{}{}    \
             Component simulator {{ cdsl \"../simulator/simulator.cdsl\"; }};\n    \
             Component monitor {{ cdsl \"../pose_monitor/pose_monitor.cdsl\"; }};\n    \
             Component avoider {{ cdsl \"../avoider/avoider.cdsl\"; }};\n    \
             bind a.other -> b.BatteryStatus;\n    bind b.other -> c.BatteryStatus;\n    \
             bind c.other -> simulator.BatteryStatus;\n    \
             bind avoider.Laser -> simulator.Laser;\n    \
             bind avoider.DifferentialRobot -> simulator.DifferentialRobot;\n    \
             bind avoider.BatteryStatus -> simulator.BatteryStatus;\n    \
             bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;\n    \
             Chain pose {{ from simulator.FullPoseEstimationPub.newFullPose; \
                 to monitor.FullPoseEstimationPub.newFullPose; within 10s; age 10s; }};\n{}{}{}{}{}}};\n",
        site.network,
        calls("a", "call"),
        calls("b", "call back"),
        calls("c", ""),
        late("power", "late emergency c;"),
        late("halt", "late stop monitor;"),
        late("park", "late fire avoider stop;"),
        late("told", "late event;"),
        late("warned", ""),
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

/// All chains over `c` are late, and the supervisor does what each of them says.
fn each_late_chain_acts(site: &Site) {
    let severity = |chain: &str| {
        let begin = format!("chain `{chain}` took");
        let log = site.log("rcdeploy");
        let events = log
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        let mut late = events.filter(|event: &Value| {
            let text = event["message"].as_str().unwrap_or_default();
            event["code"] == "chain-late"
                && text.starts_with(&begin)
                && text.contains(" of them at c (")
        });
        late.next().map(|event| event["severity"].clone())
    };
    for (chain, expected) in [
        ("power", "warning"),
        ("halt", "warning"),
        ("park", "warning"),
        ("told", "info"),
        ("warned", "warning"),
    ] {
        Site::until("the chain to be late", || severity(chain).is_some());
        assert_eq!(severity(chain), Some(expected.into()), "{chain}");
    }
    site.await_component("c", |status| status["state"] == "emergency");
    site.await_component("monitor", |status| status["state"] == "stopped");
    site.await_component("avoider", |status| {
        status["machine"]["states"][0] == "on.motion.idle"
    });
    for (component, what) in [("c", "its emergency"), ("avoider", "the event `stop`")] {
        let done = (
            "late-action".to_owned(),
            format!("has taken {what}, because a chain is late"),
        );
        Site::until("the action to be reported", || {
            site.events(component).contains(&done)
        });
    }
}

/// A component notes messages for one listener, which is the supervisor.
fn the_bench_takes_connections_on_chains_from_the_supervisor(site: &Site) {
    let bench = ["bench", &site.network, "--seconds", "1", "--format", "json"];
    let bench = site.rcdeploy(&bench, false);
    assert_eq!(bench.code, 0, "{bench:?}");
    assert!(
        bench.stderr.contains("follows their messages for chains"),
        "{bench:?}"
    );
    let run: Value = serde_json::from_str(&bench.stdout).expect("JSON");
    let connections = run["connections"].as_array().expect("a list");
    for (from, to) in [
        ("a.other", "b.BatteryStatus.getBatteryState"),
        ("b", "c.BatteryStatus.getBatteryState"),
        (
            "simulator.FullPoseEstimationPub",
            "monitor.FullPoseEstimationPub.newFullPose",
        ),
    ] {
        let is = |one: &&Value| one["from"] == from && one["to"] == to;
        let one = connections.iter().find(is);
        let one = one.unwrap_or_else(|| panic!("{from} -> {to}: {run}"));
        assert_eq!(one["messages"], Value::Null, "{one}");
        assert!(one["times"]["p50_ms"].as_f64() > Some(0.0), "{one}");
    }
    // They are measured as before.
    let missing = |chain: &Value| chain["missing"] == json!([]);
    assert!(chains(site).iter().all(missing));
}

#[test]
fn chains_are_measured_and_a_slow_component_is_named() {
    let site = Site::new("chains");
    site.write_ddsl(&network(&site));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let followed = |chain: &Value| chain["complete"].as_u64() >= Some(20);
    Site::until("all chains to be measured", || {
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
    the_bench_takes_connections_on_chains_from_the_supervisor(&site);
    let is_driving = |status: &Value| {
        let state = status["machine"]["states"][0].as_str();
        state.is_some_and(|state| state.starts_with("on.motion.driving"))
    };
    site.await_component("avoider", is_driving);
    // Unit tests find 50 ms.
    let slow = json!({"changes": {"delay": "400ms"}});
    site.tell("c", "parameters_set", &slow);
    each_late_chain_acts(&site);
    let work = &chains(&site)[1]["hops"][1]["work"];
    assert!(work["worst_ms"].as_f64() >= Some(400.0), "{work}");
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
