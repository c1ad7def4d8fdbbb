//! Tools and a process of several components, whose messages do not leave it: topics and calls are
//! seen, called and recorded, parameters set, machines fired, and commands for one thread refused.

use rc_test_site::site::{CommandOutput, Site};
use serde_json::Value;

/// The components of `programs/in_one.ddsl`, whose program `cargo xtask test` has built.
const NETWORK: &str = "Deployment patrol
{
    middleware auto;
    time simulated by clock;
    Process robot
    {
        Component simulator { cdsl \"../simulator/simulator.cdsl\"; };
        Component monitor { cdsl \"../pose_monitor/pose_monitor.cdsl\"; config \"monitor.toml\"; };
        Component avoider { cdsl \"../avoider/avoider.cdsl\"; };
        Component clock { cdsl \"../clock/clock.cdsl\"; config \"clock.toml\"; };
    };
    bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub;
};
";

fn tool(site: &Site, words: &[&str]) -> CommandOutput {
    let ran = site.rcdeploy(words, false);
    assert_eq!(ran.code, 0, "{words:?}: {ran:?}");
    ran
}

fn pids(site: &Site) -> Vec<Value> {
    let status = site.status();
    let components = status["components"].as_array().expect("a list").iter();
    components.map(|one| one["pid"].clone()).collect()
}

#[test]
fn tools_reach_what_stays_inside_a_process() {
    let mut site = Site::new("inside");
    // The program has the name of its network.
    site.network = "patrol_in_one".into();
    site.write_ddsl(NETWORK);
    site.monitor("trace", 0);
    site.write("clock.toml", "[parameters]\nstep = \"50ms\"\nrate = 1.0\n");
    let network = site.network.clone();
    let up = [
        "up",
        "--detach",
        "--profile",
        "dev",
        "--set",
        "simulator.seed=7",
    ];
    let up = site.rcdeploy(&up, true);
    assert_eq!(up.code, 0, "{up:?}");
    let before = pids(&site);
    assert!(before[0].is_number() && before.iter().all(|pid| *pid == before[0]));
    for (component, slot) in [("avoider", "Laser"), ("monitor", "FullPoseEstimationPub")] {
        let status = site.ask(component, "status");
        let slots = status["slots"].as_array().expect("slots");
        let slot = slots.iter().find(|one| one["name"] == slot);
        assert_eq!(slot.expect("a slot")["middleware"], "local", "{status}");
    }
    let tool = |words: &[&str]| tool(&site, words);
    // A topic and a call are tapped, an operation is called.
    let pose = tool(&["echo", &network, "newFullPose", "--once"]);
    assert!(pose.stdout.contains("pose"), "{pose:?}");
    let calls = tool(&[
        "echo",
        &network,
        "simulator.Laser.getLaserData",
        "--count",
        "2",
    ]);
    assert!(calls.stdout.contains("getLaserData"), "{calls:?}");
    tool(&["call", &network, "getBasePose"]);
    // The messages of each connection are counted.
    let counted = site.status();
    let components = counted["components"].as_array().expect("a list");
    let monitor = components.iter().find(|one| one["name"] == "monitor");
    let carried = &monitor.expect("it")["messages"]["FullPoseEstimationPub"];
    let poses = carried[0]["messages"].as_u64();
    assert!(
        poses > Some(0) && carried[0]["middleware"] == "local",
        "{counted}"
    );
    let table = tool(&["status", &network]);
    let text = "FullPoseEstimationPub over local (";
    assert!(table.stdout.contains(text), "{table:?}");
    // Parameters of one thread, and events of its machine.
    let seed = tool(&["params", "get", &network, "simulator", "seed"]);
    assert_eq!(seed.stdout, "seed = 7\n");
    tool(&["fire", &network, "avoider", "stop"]);
    // A recording has what stays inside.
    let bag = site.path("inside.mcap").display().to_string();
    tool(&["record", &network, "-o", &bag, "--length", "500ms"]);
    let info = tool(&["bag", "info", &bag]);
    assert!(info.stdout.contains("newFullPose"), "{info:?}");
    // One thread has no life of its own.
    let refused = site.rcdeploy(&["stop", &network, "avoider"], false);
    assert_ne!(refused.code, 0, "{refused:?}");
    assert!(refused.stderr.contains("`stop robot` means"), "{refused:?}");
    tool(&["restart", &network, "robot"]);
    let after = pids(&site);
    assert!(after[0] != before[0] && after.iter().all(|pid| *pid == after[0]));
    // The value of the start holds again.
    let seed = tool(&["params", "get", &network, "simulator", "seed"]);
    assert_eq!(seed.stdout, "seed = 7\n");
    tool(&["down", &network]);
    site.assert_nothing_left();
}
