//! The worst cases of chains beside a simulation in Python, which shares nothing with the analysis.
//! `cargo xtask soak chains` runs it with 10^6 schedules.

use rc_test_site::site::Site;
use rc_test_support::python;
use serde_json::Value;
use std::process::Command;

#[test]
fn no_simulated_schedule_exceeds_the_worst_case() {
    let test = "no_simulated_schedule_exceeds_the_worst_case";
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/network/bounds.py");
    let schedules = std::env::var("RC_SCHEDULES").unwrap_or_else(|_| "2000".to_owned());
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = Command::new("python3");
    command.args([script, env!("CARGO_BIN_EXE_rcdeploy")]);
    command.arg(folder.path()).arg(schedules);
    // The simulation has the assumed transport, not the one that this machine's user has measured.
    command.env("XDG_STATE_HOME", folder.path());
    let Ok(run) = command.output() else {
        return python::skipped(test, "`python3` is not installed");
    };
    let said = String::from_utf8_lossy(&run.stdout);
    let errors = String::from_utf8_lossy(&run.stderr);
    println!("{said}");
    assert!(run.status.success(), "{said}{errors}");
    assert!(said.lines().count() >= 10, "{said}{errors}");
}

const PARTS: &str = "module Parts { interface Tick { void tick(int number); }; };\n";
const SOURCE: &str = "import \"Parts.idsl\";\nComponent source { Communications { publishes Tick; }; language rust; reactions { compute -> tick budget 1ms; }; };\n";
const SINK: &str = "import \"Parts.idsl\";\nComponent sink { Communications { subscribesTo Tick; }; language rust; reactions { tick budget 1ms; compute budget 1ms; }; };\n";
const NETWORK: &str = "Deployment patrol\n{\n    middleware iceoryx2;\n    Component source { cdsl \"source.cdsl\"; };\n    \
    Component sink { cdsl \"sink.cdsl\"; };\n    Chain line { from source.Tick.tick; to sink.Tick.tick; };\n};\n";

/// Measured transport takes the place of the assumed one, and the plan says which one it has.
#[test]
fn the_transport_of_this_machine_is_measured() {
    let site = Site::new("transport");
    for (name, text) in [
        ("Parts.idsl", PARTS),
        ("source.cdsl", SOURCE),
        ("sink.cdsl", SINK),
    ] {
        std::fs::write(site.path("networks").join(name), text).expect("to write");
    }
    site.write_ddsl(NETWORK);
    let chain = || {
        let plan = site.rcdeploy(&["plan", "--unbuilt", "--format", "json"], true);
        assert_eq!(plan.code, 0, "{plan:?}");
        let plan: Value = serde_json::from_str(&plan.stdout).expect("JSON");
        let chain = &plan["chains"][0];
        let transport = chain["hops"][0]["transport_ms"].as_f64();
        (transport.expect("a time"), chain["notes"].to_string())
    };
    assert_eq!(chain(), (0.2, "[\"transport is assumed\"]".to_owned()));
    let measure = [
        "transport",
        "--middleware",
        "iceoryx2",
        "--messages",
        "200",
        "--format",
        "json",
    ];
    let measured = site.rcdeploy(&measure, false);
    assert_eq!(measured.code, 0, "{measured:?}");
    let table: Value = serde_json::from_str(&measured.stdout).expect("JSON");
    let times = &table["middlewares"]["iceoryx2"];
    let (p50, worst) = (times["p50_ms"].as_f64(), times["worst_ms"].as_f64());
    assert!(p50 > Some(0.0) && p50 <= worst, "{table}");
    let (transport, notes) = chain();
    assert!((transport - worst.expect("a time")).abs() < 1e-6, "{table}");
    assert_eq!(notes, "[\"transport is measured on this machine\"]");
    // Another machine with the same home folder has measured.
    let file = site.path("state").join("robocomp/transport.json");
    let mut other = table.clone();
    other["machine"] = "another".into();
    std::fs::write(&file, other.to_string()).expect("to write");
    assert_eq!(chain(), (0.2, "[\"transport is assumed\"]".to_owned()));
    // The check names a damaged file, and says what to do.
    std::fs::write(&file, "{\"middlewares\": 7}").expect("to write");
    let damaged = site.rcdeploy(&["plan", "--unbuilt"], true);
    assert_eq!(damaged.code, 3, "{damaged:?}");
    assert!(
        damaged.stderr.contains("transport.json is damaged: "),
        "{damaged:?}"
    );
}
