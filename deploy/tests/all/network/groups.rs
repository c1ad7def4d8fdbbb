//! A network with groups, and restarts.

use rc_test_site::site::Site;
use rustix::process::{Pid, Signal, kill_process};

/// The patrol, in groups.
const GROUPED: &str = r#"
Deployment patrol
{
    Group world
    {
        Component simulator { cdsl "../simulator/simulator.cdsl"; };
        export Laser, DifferentialRobot, FullPoseEstimationPub;
    };

    Group robot
    {
        Group base
        {
            Component avoider { cdsl "../avoider/avoider.cdsl"; after monitor; };
            bind avoider.Laser -> world.Laser;
        };
    };

    Component monitor { cdsl "../pose_monitor/pose_monitor.cdsl"; after world; };
    bind monitor.FullPoseEstimationPub -> world.FullPoseEstimationPub;
};
"#;

fn names(status: &serde_json::Value) -> Vec<&str> {
    let components = status["components"].as_array().expect("a list");
    components
        .iter()
        .filter_map(|c| c["name"].as_str())
        .collect()
}

#[test]
fn components_of_groups_run_under_their_full_names() {
    let site = Site::new("groups");
    site.write_ddsl(GROUPED);
    let check = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_eq!(check.code, 0, "{check:?}");
    assert!(
        check.stdout.contains("3 components, 3 connections"),
        "{check:?}"
    );

    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let status = site.status();
    assert_eq!(
        names(&status),
        ["world.simulator", "robot.base.avoider", "monitor"]
    );
    assert!(up.stdout.contains("robot.base.avoider  running"), "{up:?}");
    site.await_in_log("monitor", "poses=");
    // Each component has a socket with a valid name, and calls cross groups.
    let avoider = site.ask("robot-base-avoider", "status");
    assert_eq!(avoider["state"], "running", "{avoider}");
    let slots = avoider["slots"].as_array().expect("a list");
    let addresses: Vec<&str> = slots.iter().filter_map(|s| s["address"].as_str()).collect();
    let address = |slot: &str| format!("{}/world/simulator/{slot}", site.network);
    assert!(addresses.contains(&address("Laser").as_str()), "{avoider}");
    assert!(
        addresses.contains(&address("DifferentialRobot").as_str()),
        "{avoider}"
    );

    let logs = site.rcdeploy(&["logs", &site.network, "world.simulator"], false);
    assert_eq!(logs.code, 0, "{logs:?}");
    assert!(!logs.stdout.is_empty(), "{logs:?}");
    let all = site.rcdeploy(&["logs", &site.network], false);
    assert!(all.stdout.contains("world.simulator"), "{all:?}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn users_of_a_restarted_group_reconnect() {
    let site = Site::new("regroup");
    site.write_ddsl(GROUPED);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let network = &site.network;
    let pids = || {
        let status = site.status();
        let components = status["components"].as_array().expect("a list");
        components
            .iter()
            .map(|c| c["pid"].as_i64())
            .collect::<Vec<_>>()
    };
    let before = pids();
    let restart = site.rcdeploy(&["restart", network, "world"], false);
    assert_eq!(restart.code, 0, "{restart:?}");
    assert_eq!(restart.stdout, "world.simulator: ready again\n");
    let after = pids();
    assert_ne!(before[0], after[0]);
    assert_eq!(before[1..], after[1..]);

    // The file also identifies the network.
    let ddsl = site.ddsl().display().to_string();
    let stop = site.rcdeploy(&["stop", &ddsl, "world", "--format", "json"], false);
    assert_eq!(
        stop.stdout.trim(),
        r#"{"done":["world.simulator"],"failed":[]}"#
    );
    // Components that need it keep running and reconnect.
    site.await_component("robot.base.avoider", |c| c["state"] == "running");
    let calls = || site.ask("robot-base-avoider", "status")["compute"]["errors"].as_u64();
    let failed = calls();
    Site::until("calls that fail", || calls() > failed);
    assert_eq!(site.rcdeploy(&["start", network, "world"], false).code, 0);
    let poses = site.count_in_log("monitor", "poses=");
    Site::until("poses of the new simulator", || {
        site.count_in_log("monitor", "poses=") > poses
    });

    let wrong = site.rcdeploy(&["restart", network, "wrold"], false);
    assert_eq!(wrong.code, 1, "{wrong:?}");
    assert!(wrong.stderr.contains("did you mean `world`?"), "{wrong:?}");
    assert_eq!(site.rcdeploy(&["stop", network], false).code, 2);

    let on = site.rcdeploy(&["emergency", network, "robot.base.avoider", "on"], false);
    assert_eq!(on.code, 0, "{on:?}");
    site.await_component("robot.base.avoider", |c| c["state"] == "emergency");
    let off = site.rcdeploy(&["emergency", network, "robot.base.avoider", "off"], false);
    assert_eq!(off.code, 0, "{off:?}");
    site.await_component("robot.base.avoider", |c| c["state"] == "running");
    let nobody = site.rcdeploy(&["emergency", network, "avoider", "on"], false);
    assert_eq!(nobody.code, 3, "{nobody:?}");
    assert_eq!(site.rcdeploy(&["down", network], false).code, 0);
    site.assert_nothing_left();
}

#[test]
fn private_and_unknown_members_are_rejected_at_their_location() {
    let site = Site::new("private");
    site.write_ddsl(&GROUPED.replace("export Laser, ", "export "));
    let check = site.rcdeploy(&["check", "--profile", "dev", "--format", "short"], true);
    assert_eq!(check.code, 1);
    assert!(
        check
            .stderr
            .contains(":15:41: error[not-exported]: group `world` does not export `Laser`"),
        "{check:?}"
    );

    let remote = GROUPED
        .replace(
            "Group robot\n    {",
            "middleware iceoryx2;\n    Group robot\n    {\n        Host pi { address \"10.0.0.2\"; };",
        )
        .replace(
            "after monitor;",
            "after monitor; host pi; cpu 1; priority 5; endpoint \"10.0.0.2:7000\";",
        );
    site.write_ddsl(&remote);
    let check = |more: &[&str]| {
        let args = ["check", "--profile", "dev", "--format", "short"];
        site.rcdeploy(&[&args, more].concat(), true)
    };
    let apart = check(&[]);
    assert_eq!(apart.code, 1, "{apart:?}");
    assert!(
        apart.stderr.contains("error[shared-memory-across-hosts]")
            && apart.stderr.contains("`pi` and `localhost`"),
        "{apart:?}"
    );
    let dds = check(&["--middleware", "dds"]);
    assert_eq!(
        dds.stderr.matches("warning[not-supported-yet]").count(),
        1,
        "{dds:?}"
    );
    assert!(!dds.stderr.contains("across-hosts"), "{dds:?}");
    site.assert_nothing_left();
}

#[test]
fn an_imported_component_finds_its_files_beside_its_own_description() {
    let site = Site::new("imported");
    std::fs::create_dir_all(site.path("networks/lib")).expect("a folder");
    site.copy_component("simulator");
    // Its map.
    site.copy_component("maps");
    let world = r#"
Deployment world
{
    Group world
    {
        Component simulator { cdsl "../simulator/simulator.cdsl"; };
        export Laser, DifferentialRobot, FullPoseEstimationPub;
    };
};
"#;
    site.write("lib/world.ddsl", world);
    let (_, rest) = GROUPED.split_once("    Group robot").expect("a group");
    site.write_ddsl(&format!(
        "import \"lib/world\";\nDeployment patrol\n{{\n    Group robot{rest}"
    ));
    let check = site.rcdeploy(&["check", "--profile", "dev", "--format", "short"], true);
    assert_eq!(check.code, 1);
    // The copy has neither generated code nor a workspace; all its other files were found.
    let errors = check.stderr.lines().filter(|l| l.contains("error["));
    let errors: Vec<&str> = errors.filter_map(|l| l.split(':').nth(3)).collect();
    let expected = [" error[missing-generated]", " error[missing-executable]"];
    assert_eq!(errors, expected, "{check:?}");
}

#[test]
fn publishers_with_a_common_subscriber_share_all_subscribers() {
    let site = Site::new("mixed");
    let text = r#"
Deployment patrol
{
    Group one
    {
        Component simulator { cdsl "../simulator/simulator.cdsl"; };
        Component own { cdsl "../pose_monitor/pose_monitor.cdsl"; };
        export FullPoseEstimationPub;
    };
    Group two
    {
        Component simulator { cdsl "../simulator/simulator.cdsl"; };
        export FullPoseEstimationPub;
    };
    Component monitor { cdsl "../pose_monitor/pose_monitor.cdsl"; };
};
"#;
    // Without other subscribers, each subscriber receives all its publishers.
    site.write_ddsl(text);
    let check = site.rcdeploy(&["check", "--profile", "dev"], true);
    assert_eq!(check.code, 0, "{check:?}");
    let bind = "bind own.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;\n        export";
    site.write_ddsl(&text.replacen("export", bind, 1));
    let check = site.rcdeploy(&["check", "--profile", "dev", "--format", "short"], true);
    assert_eq!(check.code, 1);
    let expected = ":7:19: error[mixed-topics]: `one.own.FullPoseEstimationPub` would hear `two.simulator.FullPoseEstimationPub` as well";
    assert!(check.stderr.contains(expected), "{check:?}");
}

#[test]
fn the_patrol_continues_after_a_restart_of_the_simulator() {
    let site = Site::new("again");
    site.write_ddsl(&GROUPED.replace(
        "cdsl \"../simulator/simulator.cdsl\";",
        "cdsl \"../simulator/simulator.cdsl\"; restart on_failure max 3 within 1min backoff 100ms;",
    ));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let before = site.status()["components"][0].clone();
    let pid = Pid::from_raw(before["pid"].as_i64().expect("a pid") as i32).expect("a pid");
    kill_process(pid, Signal::KILL).expect("to kill it");
    site.await_component("world.simulator", |c| {
        c["restarts"] == 1 && c["ready"] == true && c["state"] == "running"
    });
    // Its users reconnect.
    let poses = || site.count_in_log("monitor", "poses=");
    let so_far = poses();
    Site::until("further poses", || poses() > so_far);
    let status = site.status();
    assert_eq!(status["components"][1]["restarts"], 0, "{status}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
