//! The real rcdeploy with real components on real shared memory.
//!
//! The components are those of this repository, built by `cargo xtask test` before the tests run.

use rc_test_site::site::{PATROL, Site};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

#[test]
fn patrol_runs_in_the_background_and_leaves_nothing() {
    let site = Site::new("up");
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let status = site.status();
    let components = status["components"].as_array().expect("a list");
    assert_eq!(components.len(), 3, "{status}");
    for component in components {
        assert_eq!(component["state"], "running", "{status}");
        assert!(
            component["pid"].as_i64().is_some_and(|pid| pid > 0),
            "{status}"
        );
    }
    site.await_in_log("monitor", "poses=");
    // Each component also replies on its own socket.
    let simulator = site.ask("simulator", "status");
    assert_eq!(simulator["state"], "running", "{simulator}");
    assert_eq!(simulator["middleware"], "iceoryx2");
    let slots = simulator["slots"].as_array().expect("a list");
    assert!(
        slots.iter().all(|s| s["address"]
            .as_str()
            .is_some_and(|a| a.starts_with(&site.network))),
        "{simulator}"
    );
    let parameters = &site.ask("avoider", "parameters")["parameters"];
    assert_eq!(parameters[0]["path"], "safe_distance");
    assert_eq!(parameters[0]["value"], 700.0);

    let again = site.rcdeploy(&["up", "--profile", "dev"], true);
    assert_eq!(again.code, 3);
    assert!(again.stderr.contains("is already up"), "{again:?}");

    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
    let gone = site.rcdeploy(&["status", &site.network], false);
    assert_eq!(gone.code, 3);
    assert!(gone.stderr.contains("is not up"), "{gone:?}");
}

#[test]
fn killing_rcdeploy_stops_its_network() {
    let site = Site::new("killed");
    assert_eq!(
        site.rcdeploy(&["up", "--detach", "--profile", "dev"], true)
            .code,
        0
    );
    let status = site.status();
    let pid = |value: &Value| Pid::from_raw(value.as_i64().expect("a pid") as i32).expect("a pid");
    let supervisor = pid(&status["pid"]);
    kill_process(supervisor, Signal::KILL).expect("to kill it");
    site.await_nothing_left();
    for component in status["components"].as_array().expect("a list") {
        // A zombie process has no program any more.
        let program = format!("/proc/{}/exe", component["pid"]);
        assert!(
            std::fs::read_link(program).is_err(),
            "{component} is still there"
        );
    }
    // The network can be started again at once.
    assert_eq!(
        site.rcdeploy(&["up", "--detach", "--profile", "dev"], true)
            .code,
        0
    );
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn a_second_server_is_rejected_with_the_name_of_the_first() {
    let site = Site::new("second");
    assert_eq!(
        site.rcdeploy(&["up", "--detach", "--profile", "dev"], true)
            .code,
        0
    );
    let pid = site.status()["components"][0]["pid"].to_string();
    let address = format!("Laser={}/simulator/Laser", site.network);
    let second = site.component(
        "simulator",
        &[
            "--network",
            &site.network,
            "--name",
            "second",
            "--bind",
            &address,
        ],
    );
    assert_eq!(second.code, 3, "{second:?}");
    assert!(
        second.stderr.contains("already has a server") && second.stderr.contains(&pid),
        "{second:?}"
    );
    let same = site.component(
        "simulator",
        &["--network", &site.network, "--name", "simulator"],
    );
    assert_eq!(same.code, 3, "{same:?}");
    assert!(same.stderr.contains("runs in network"), "{same:?}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn errors_are_reported_before_the_start() {
    let site = Site::new("wrong");
    let bad = site.write(
        "bad.toml",
        "[bindings]\nLaser = \"no address\"\n[parameters]\nsaef_distance = 700\nspeed = \"fast\"\nturn_speed = 30\n",
    );
    let wrong = PATROL
        .replace(
            "cdsl \"../avoider/avoider.cdsl\";",
            "cdsl \"../avoider/avoider.cdsl\"; config \"bad.toml\";",
        )
        .replace("avoider.Laser ->", "avoider.Lasr ->");
    site.write_ddsl(&wrong);
    let check = site.rcdeploy(&["check", "--profile", "dev", "--format", "short"], true);
    assert_eq!(check.code, 1);
    for expected in [
        "bad.toml:4:1: error[unknown-parameter]",
        "bad.toml:5:9: error[wrong-type]",
        "bad.toml:6:14: error[out-of-range]",
        "error[bad-address]",
        "error[unknown-slot]",
        "did you mean `Laser`?",
        "did you mean `safe_distance`?",
    ] {
        assert!(
            check.stderr.contains(expected),
            "{expected} is missing in {}",
            check.stderr
        );
    }
    // The component reports the same.
    let own = site.component(
        "avoider",
        &["--check", "--config", bad.to_str().expect("a path")],
    );
    assert_eq!(own.code, 1);
    assert!(
        own.stderr.contains("unknown-parameter") && own.stderr.contains("out-of-range"),
        "{own:?}"
    );
    site.assert_nothing_left();
}

#[test]
fn executables_are_checked_by_the_note_in_them() {
    let site = Site::new("notes");
    let other = Site::executable("speech_server");
    let missing = PATROL.replace(
        "cdsl \"../avoider/avoider.cdsl\";",
        "cdsl \"../avoider/avoider.cdsl\"; executable \"nowhere/avoider\";",
    );
    site.write_ddsl(&missing);
    let check = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_eq!(check.code, 1);
    assert!(
        check.stderr.contains("missing-executable") && check.stderr.contains("--build"),
        "{check:?}"
    );

    let wrong = missing.replace("nowhere/avoider", other.to_str().expect("a path"));
    site.write_ddsl(&wrong);
    let up = site.rcdeploy(&["up", "--profile", "dev"], true);
    assert_eq!(up.code, 1);
    assert!(up.stderr.contains("other-component"), "{up:?}");

    let none = missing.replace("nowhere/avoider", "/bin/sh");
    site.write_ddsl(&none);
    let up = site.rcdeploy(&["up", "--profile", "dev"], true);
    assert_eq!(up.code, 1);
    assert!(up.stderr.contains("not-a-component"), "{up:?}");

    // Another model: the same component with an additional word in its .cdsl.
    site.copy_component("avoider");
    site.edit("avoider/avoider.cdsl", |text| {
        text.replace("period 50ms", "period 51ms")
    });
    let stale = missing
        .replace("../avoider/avoider.cdsl", "avoider/avoider.cdsl")
        .replace(
            "nowhere/avoider",
            Site::executable("avoider").to_str().expect("a path"),
        );
    site.write_ddsl(&stale);
    let up = site.rcdeploy(&["up", "--profile", "dev"], true);
    assert_eq!(up.code, 1);
    assert!(up.stderr.contains("stale-executable"), "{up:?}");
    site.assert_nothing_left();
}

#[test]
fn a_binary_describes_itself() {
    let site = Site::new("tells");
    let help = site.component("avoider", &["--help"]);
    assert_eq!(help.code, 0);
    assert!(
        help.stdout
            .contains("requires RoboCompLaser::Laser (iceoryx2)"),
        "{help:?}"
    );
    let version = site.component("avoider", &["--version"]);
    assert!(
        version.stdout.starts_with("avoider (model ") && version.stdout.contains("iceoryx2"),
        "{version:?}"
    );
    let wrong = site.component("avoider", &["--bind", "Lasr=default/Laser"]);
    assert_eq!(wrong.code, 2);
    assert!(wrong.stderr.contains("did you mean `Laser`?"), "{wrong:?}");
}

fn pid_of(status: &Value, name: &str) -> Pid {
    let components = status["components"].as_array().expect("a list");
    let found = components.iter().find(|c| c["name"] == name);
    let pid = found.and_then(|c| c["pid"].as_i64()).expect("a pid");
    Pid::from_raw(pid as i32).expect("a pid")
}

/// Calls to a stopped component end at their deadline. When it continues, calls succeed.
#[test]
fn calls_to_a_stopped_component_fail_until_it_continues() {
    let site = Site::new("stopped");
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let avoider = || site.ask("avoider", "status");
    let done = |status: &Value| status["compute"]["count"].as_u64().expect("a count");
    let failed = |status: &Value| status["compute"]["errors"].as_u64().expect("a count");
    Site::until("it computes", || done(&avoider()) > 3);
    let simulator = pid_of(&site.status(), "simulator");
    kill_process(simulator, Signal::STOP).expect("to stop it");
    Site::until("a call has ended", || failed(&avoider()) > 0);
    let status = avoider();
    let error = status["last_error"].as_str().unwrap_or_default();
    assert!(error.contains("no reply from"), "{status}");
    assert_eq!(status["state"], "running", "{status}");
    kill_process(simulator, Signal::CONT).expect("to let it go on");
    // Five computes in a row without an error.
    let since = std::cell::Cell::new((0, 0));
    Site::until("it computes again", || {
        let status = avoider();
        if failed(&status) != since.get().1 {
            since.set((done(&status), failed(&status)));
        }
        done(&status) >= since.get().0 + 5
    });
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The stopped subscriber reads nothing while the simulator sends. Afterwards it gets the newest
/// samples, and the status shows the losses.
#[test]
fn the_status_shows_samples_lost_by_a_slow_subscriber() {
    let site = Site::new("slow");
    let monitor = PATROL.replace(
        "cdsl \"../pose_monitor/pose_monitor.cdsl\";",
        "cdsl \"../pose_monitor/pose_monitor.cdsl\"; config \"monitor.toml\";",
    );
    let quick = monitor.replace(
        "cdsl \"../simulator/simulator.cdsl\";",
        "cdsl \"../simulator/simulator.cdsl\"; config \"simulator.toml\";",
    );
    site.write_ddsl(&quick);
    site.write("monitor.toml", "[parameters]\nsvg = \"\"\n");
    site.write("simulator.toml", "[component]\nperiod = \"2ms\"\n");
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let slot = |component: &str| site.ask(component, "status")["slots"][0].clone();
    Site::until("poses come", || slot("monitor")["handlers"]["count"] != 0);
    let before = slot("monitor");
    assert_eq!(before["lost"], 0, "{before}");
    let monitor = pid_of(&site.status(), "monitor");
    let computed = || site.ask("simulator", "status")["compute"]["count"].as_u64();
    kill_process(monitor, Signal::STOP).expect("to stop it");
    // More than the hundred poses that its queue holds.
    let then = computed().expect("a count") + 300;
    Site::until("the simulator goes on", || computed() >= Some(then));
    kill_process(monitor, Signal::CONT).expect("to let it go on");
    Site::until("the loss is seen", || {
        slot("monitor")["lost"].as_u64() >= Some(200)
    });
    site.await_component("monitor", |c| {
        c["lost"]["FullPoseEstimationPub"].as_u64() >= Some(200)
    });
    let shown = site.rcdeploy(&["status", &site.network], false);
    let line = shown
        .stdout
        .lines()
        .find(|line| line.starts_with("monitor"));
    assert!(
        line.is_some_and(|line| line.contains("FullPoseEstimationPub lost ")),
        "{shown:?}"
    );
    let others = site.status();
    let others = others["components"].as_array().expect("a list");
    let others = others.iter().filter(|c| c["name"] != "monitor");
    assert!(
        others
            .into_iter()
            .all(|c| c["lost"] == serde_json::json!({}))
    );
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
