//! Groups with a proxy: one component for everybody outside.

use crate::network::chains::chains;
use crate::network::dds::{Domain, Over};
use crate::network::recorded::{Tool, down, info, play, text, up};
use rc_codegen::FileLoader;
use rc_deploy_network::plan::Plan;
use rc_deploy_network::{self as network, Overrides, Profile};
use rc_diagnostics::{Format, SourceMap, render};
use rc_test_site::site::{Site, rcdeploy};
use rc_test_support::python;
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// The patrol, whose robot is one component for the others.
const PATROL: &str = r#"
Deployment patrol
{
    Group robot
    {
        Component simulator { cdsl "../simulator/simulator.cdsl"; };
        export Laser, DifferentialRobot, BatteryStatus, FullPoseEstimationPub;
        proxy;
    };
    Component monitor { cdsl "../pose_monitor/pose_monitor.cdsl"; after robot; };
    Component avoider { cdsl "../avoider/avoider.cdsl"; after monitor; };
    bind avoider.Laser -> robot.Laser;
};
"#;

fn component<'s>(status: &'s Value, name: &str) -> &'s Value {
    let mut components = status["components"].as_array().into_iter().flatten();
    let found = components.find(|component| component["name"] == name);
    found.unwrap_or_else(|| panic!("no `{name}` in {status}"))
}

fn call(site: &Site) -> (i32, String) {
    let operation = "robot.DifferentialRobot.getBasePose";
    let called = site.rcdeploy(&["call", &site.network, operation], false);
    (called.code, called.stdout + &called.stderr)
}

#[test]
fn a_group_with_a_proxy_is_one_component() {
    let site = Site::new("proxied");
    site.write_ddsl(PATROL);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_in_log("monitor", "poses=");
    let avoider = site.ask("avoider", "status");
    let slots = avoider["slots"].as_array().expect("a list");
    let address = format!("{}/robot/Laser", site.network);
    assert!(
        slots.iter().any(|slot| slot["address"] == address),
        "{avoider}"
    );
    let status = site.status();
    assert_eq!(component(&status, "robot")["state"], "running", "{status}");
    assert_eq!(
        component(&status, "robot")["behind"],
        serde_json::json!(["robot.simulator"])
    );
    let (code, pose) = call(&site);
    assert!(code == 0 && pose.contains("alpha"), "{pose}");
    // The tools of an operator look behind the proxy.
    let inside = "robot-simulator.DifferentialRobot.getBasePose";
    for asks in [
        ["call", &site.network, inside],
        ["params", &site.network, "robot.simulator"],
    ] {
        let asked = site.rcdeploy(&asks, false);
        assert_eq!(asked.code, 0, "{asked:?}");
    }
    let group = |state: &str| {
        serde_json::json!({
            "state": state, "ready": state == "running", "components": {"robot.simulator": state},
        })
    };
    Site::until("its own answer", || {
        site.ask("robot", "status")["group"] == group("running")
    });

    // The caller of a killed component learns why there is no reply.
    let pid = component(&status, "robot.simulator")["pid"].as_i64();
    let pid = pid
        .and_then(|pid| Pid::from_raw(pid as i32))
        .expect("a process");
    kill_process(pid, Signal::KILL).expect("to kill it");
    site.await_component("robot", |robot| robot["state"] == "failed");
    Site::until("its own answer", || {
        site.ask("robot", "status")["group"] == group("failed")
    });
    let (code, refused) = call(&site);
    assert_ne!(code, 0, "{refused}");
    let inside = format!("no server at `{}/robot/simulator/", site.network);
    assert!(refused.contains(&inside), "{refused}");
    let codes = |site: &Site| -> Vec<String> {
        let events = site.events("robot").into_iter();
        events.map(|(code, _)| code).collect()
    };
    Site::until("an event", || {
        codes(&site).contains(&"group-incomplete".to_owned())
    });

    // One name is the group with its proxy.
    let start = site.rcdeploy(&["start", &site.network, "robot"], false);
    assert_eq!(
        start.stdout, "robot: ready\nrobot.simulator: ready\n",
        "{start:?}"
    );
    site.await_component("robot", |robot| robot["state"] == "running");
    Site::until("an event", || {
        codes(&site).contains(&"group-complete".to_owned())
    });
    assert_eq!(call(&site).0, 0);
    let poses = site.count_in_log("monitor", "poses=");
    Site::until("poses of the new simulator", || {
        site.count_in_log("monitor", "poses=") > poses
    });
    let stop = site.rcdeploy(&["stop", &site.network, "robot"], false);
    assert_eq!(
        stop.stdout, "robot: stopped\nrobot.simulator: stopped\n",
        "{stop:?}"
    );
    let status = site.status();
    assert_eq!(component(&status, "robot")["state"], "stopped", "{status}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// Chains from the inside of the group to a component outside, and back.
const CHAINS: &str = "
    Chain pose { from robot.simulator.FullPoseEstimationPub.newFullPose;
        to monitor.FullPoseEstimationPub.newFullPose; within 10s; };
    Chain drive { from avoider.DifferentialRobot.setSpeedBase;
        to robot.simulator.DifferentialRobot.setSpeedBase; within 10s; };
    bind avoider";

/// A recording has both sides of a proxy, and one side of it plays for the other. Chains are measured
/// through it.
#[test]
fn recordings_and_chains_pass_a_proxy() {
    let site = Site::new("proxied_tools");
    site.write_ddsl(&PATROL.replacen("\n    bind avoider", CHAINS, 1));
    up(&site);
    let file = site.path("x.mcap");
    let recorder = Tool::record(&site, &["-o", &text(&file)]);
    let sides = ["robot", "robot/simulator"];
    let messages = [
        "FullPoseEstimationPub/newFullPose",
        "Laser/getLaserData/_request",
        "Laser/getLaserData/_reply",
        "DifferentialRobot/setSpeedBase/_request",
    ];
    Site::until("messages of both sides", || {
        let info = info(&file);
        let mut all = sides
            .iter()
            .flat_map(|side| messages.map(|message| format!("/{}/{side}/{message}", site.network)));
        all.all(|topic| {
            info.topics
                .get(&topic)
                .is_some_and(|topic| topic.count > 20)
        })
    });
    Site::until("both chains to be measured", || {
        let mut all = chains(&site).into_iter();
        all.all(|chain| chain["complete"].as_u64() >= Some(20))
    });
    for (chain, through) in chains(&site).iter().zip([
        [
            "robot.inside_FullPoseEstimationPub.newFullPose",
            "monitor.FullPoseEstimationPub.newFullPose",
        ],
        [
            "robot.DifferentialRobot.setSpeedBase",
            "robot.simulator.DifferentialRobot.setSpeedBase",
        ],
    ]) {
        let hops = chain["hops"].as_array().expect("hops");
        let part = |hop: &Value, key: &str| hop[key].as_str().expect("a name").to_owned();
        let names = hops
            .iter()
            .map(|hop| [part(hop, "component"), part(hop, "receives")].join("."));
        let names: Vec<_> = names.collect();
        assert_eq!(names, through, "{chain}");
        assert!(hops.iter().all(|hop| hop["lost"] == 0), "{chain}");
    }
    assert_eq!(recorder.end(Signal::INT), Some(0));
    // The group is gone, and its recording takes its place for those outside.
    let stop = site.rcdeploy(&["stop", &site.network, "robot"], false);
    assert_eq!(stop.code, 0, "{stop:?}");
    let poses = site.count_in_log("monitor", "poses=");
    let played = play(&site, &file, &["--rate", "4"]);
    assert!(played.stdout.contains("calls answered"), "{played:?}");
    Site::until("poses of the recording", || {
        site.count_in_log("monitor", "poses=") > poses
    });
    down(&site);
}

/// Components over shared memory and over DDS, which ROS 2 sees as one node.
const NODE: &str = r#"
Deployment patrol
{
    Group robot
    {
        middleware iceoryx2;
        middleware dds { domain 12; interfaces "lo"; };
        Component simulator { cdsl "../simulator/simulator.cdsl"; };
        Component interop { cdsl "../interop/interop.cdsl"; middleware dds; };
        external interop.Oracle, interop.CameraDriver, interop.Reports, interop.Orders;
        export Laser, FullPoseEstimationPub, Camera, Talk, Gossip;
        proxy ros2 { domain 52; };
    };
    external robot.Talk;
};
"#;

#[test]
fn rclpy_sees_a_group_as_one_node_and_calls_it() {
    let Some(python) = python::ros("rclpy_sees_a_group_as_one_node_and_calls_it") else {
        return;
    };
    let domain = Domain::over(Over::Ros2, "rclpy_proxy", 52);
    let site = &domain.site;
    site.write_ddsl(NODE);
    let mut up = site.command(&rcdeploy());
    up.args(["up", "--detach", "--profile", "dev"])
        .arg(site.ddsl())
        .env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    let said = domain.rclpy(python, "node.py", &["robot"]).end();
    assert_eq!(
        said,
        [
            "node robot",
            "topic robot/FullPoseEstimationPub/newFullPose robocomp_full_pose_estimation_msgs/msg/FullPoseEuler",
            "topic robot/Gossip/chatter std_msgs/msg/String",
        ]
    );
    let sizes = ["64", "0", "1025", "1048576"];
    let args = [&["robot/Camera/setCameraInfo"], &sizes[..]].concat();
    let said = domain.rclpy(python, "ask.py", &args).end();
    assert_eq!(said, ["answered 4"], "{}", site.log("robot"));
    let status = site.status();
    let forwarded = &component(&status, "robot")["forwarded"]["Camera"];
    assert_eq!(forwarded["messages"], 4, "{status}");
    assert!(forwarded["mean_us"].as_f64() > Some(0.0), "{status}");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// A proxy in a proxy, over two middlewares, with a slot array.
const NESTED: &str = r#"
Deployment patrol
{
    Group outer
    {
        middleware auto;
        Group inner
        {
            Component rack { cdsl "../../deploy/tests/programs/rack/rack.cdsl"; slots { lasers "front", "back"; }; };
            export lasers;
            proxy;
        };
        export lasers;
        proxy dds { domain 13; interfaces "lo"; };
    };
};
"#;

#[test]
fn a_proxy_stands_for_arrays_and_for_another_proxy() {
    let site = Site::new("nested");
    site.write_ddsl(NESTED);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let operation = "outer.lasers.back.getLaserConfData";
    let called = site.rcdeploy(&["call", &site.network, operation], false);
    assert_eq!(called.code, 0, "{called:?}");
    for part in ["outer-inner-rack", "back"] {
        assert!(called.stdout.contains(part), "{called:?}");
    }
    let status = site.status();
    assert_eq!(component(&status, "outer")["middleware"], "dds");
    let forwarded =
        |name: &str| component(&status, name)["forwarded"]["lasers.back"]["messages"].clone();
    assert_eq!(
        (forwarded("outer"), forwarded("outer.inner")),
        (1.into(), 1.into()),
        "{status}"
    );
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The plan of a network of these components, and what `rcdeploy check` says of it.
fn planned(body: &str) -> (Option<Plan>, String) {
    planned_in(&tempfile::tempdir().expect("a folder"), body)
}

fn planned_in(folder: &tempfile::TempDir, body: &str) -> (Option<Plan>, String) {
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("to write");
    };
    for (name, communications) in [
        ("server", "implements Laser"),
        ("client", "requires Laser { timeout 7s; }"),
        ("hasty", "requires Laser { timeout 3s; }"),
        ("lasers", "implements Laser[] as all"),
        ("batteries", "implements BatteryStatus[] as all"),
    ] {
        let imports = "import \"Laser.idsl\"; import \"BatteryStatus.idsl\";";
        let component = format!(
            "{imports} Component {name} {{ Communications {{ {communications}; }}; language rust; parameters \"gain.pdsl\"; }};"
        );
        write(&format!("{name}.cdsl"), &component);
    }
    write(
        "gain.pdsl",
        "ComponentParams gain { gain int 2 T; mode string fast {slow, fast} T; };",
    );
    write("n.ddsl", &format!("Deployment n {{ {body} }};"));
    let mut sources = SourceMap::new();
    let (path, loader) = (folder.path().join("n.ddsl"), FileLoader::default());
    let loaded = network::load(&path, &Overrides::default(), &mut sources, &loader);
    let (network, found) = loaded.expect("the files");
    let said = render(&sources, &found, Format::Short);
    let network = network.filter(|_| !found.has_errors());
    let plan = network.map(|network| network.plan(Profile::Dev).expect("a plan"));
    (plan, said)
}

/// The slots of a proxy with their timeouts, in nanoseconds.
fn timeouts(plan: &Plan, name: &str) -> Vec<(String, Value)> {
    let mut components = plan.components.iter();
    let proxy = components.find(|component| component.name == name);
    let described = &proxy.expect("a proxy").args[0];
    let described: Value = serde_json::from_str(described).expect("a description");
    let slots = described["slots"].as_array().expect("slots").iter();
    let each = slots.map(|slot| {
        let name = slot["name"].as_str().expect("a name");
        (name.to_owned(), slot["qos"]["timeout_ns"].clone())
    });
    each.collect()
}

#[test]
fn a_proxy_waits_as_long_as_its_callers() {
    let (plan, said) = planned(
        "Group outer { Group inner { Component server { cdsl \"server.cdsl\"; executable \"x\"; };
             export Laser; proxy; }; export Laser; proxy; };
         Component client { cdsl \"client.cdsl\"; executable \"x\"; };
         Component hasty { cdsl \"hasty.cdsl\"; executable \"x\"; };",
    );
    let plan = plan.unwrap_or_else(|| panic!("{said}"));
    let expected = [
        ("Laser", Value::Null),
        ("inside_Laser", 7_000_000_000_u64.into()),
    ];
    let expected = expected.map(|(name, time)| (name.to_owned(), time));
    assert_eq!(timeouts(&plan, "outer"), expected);
    assert_eq!(timeouts(&plan, "outer.inner"), expected);
}

#[test]
fn rules_name_the_components_behind_a_proxy() {
    let body = "Group robot { Component server { cdsl \"server.cdsl\"; executable \"x\"; }; export Laser; proxy;
            require server.gain < 3 \"inside\"; };
         require robot.server.gain == 2 \"outside\";";
    let (plan, said) = planned(body);
    assert!(plan.is_some(), "{said}");
    let (_, said) = planned(&body.replace("== 2", "== 3"));
    assert!(said.contains("error[rule-broken]: outside"), "{said}");
}

#[test]
fn members_of_an_exported_array_are_alike() {
    let with = |second: &str| {
        format!(
            "Group robot {{ Component one {{ cdsl \"lasers.cdsl\"; executable \"x\"; slots {{ all \"left\"; }}; }};
             Component two {{ cdsl \"{second}.cdsl\"; executable \"x\"; slots {{ all \"right\"; }}; }}; export all; proxy; }};"
        )
    };
    let (plan, said) = planned(&with("lasers"));
    assert!(plan.is_some(), "{said}");
    let (_, said) = planned(&with("batteries"));
    let error = "error[proxy-interfaces]: `robot.one.all.left` and `robot.two.all.right` have different interfaces";
    assert!(said.contains(error), "{said}");
}

#[test]
fn a_group_may_have_a_name_that_is_no_name_of_a_component() {
    let (plan, said) = planned(
        "Group import { Component server { cdsl \"server.cdsl\"; executable \"x\"; }; export Laser; proxy; };",
    );
    assert!(plan.is_some(), "{said}");
}

#[test]
fn a_component_may_have_the_name_of_a_choice_that_a_rule_names() {
    let rule = |choice: &str| {
        format!(
            "Component server {{ cdsl \"server.cdsl\"; executable \"x\"; }};
             Component {choice} {{ cdsl \"server.cdsl\"; executable \"x\"; }};
             require server.mode == {choice} \"the pace\";"
        )
    };
    let (plan, said) = planned(&rule("fast"));
    assert!(plan.is_some(), "{said}");
    let (_, said) = planned(&rule("slow"));
    assert!(said.contains("error[rule-broken]: the pace"), "{said}");
}

#[test]
fn a_folder_may_have_any_name() {
    let folder = tempfile::Builder::new()
        .prefix("a \"quoted\" \\ folder")
        .tempdir()
        .expect("a folder");
    std::fs::write(folder.path().join("Own.idsl"), OWN).expect("to write");
    let server = "import \"Own.idsl\"; Component own { Communications { implements Own; }; language rust; };";
    std::fs::write(folder.path().join("own.cdsl"), server).expect("to write");
    let (plan, said) = planned_in(
        &folder,
        "Group robot { Component own { cdsl \"own.cdsl\"; executable \"x\"; }; export Own; proxy; };",
    );
    assert!(plan.is_some(), "{said}");
}

/// An interface that stands beside the component.
const OWN: &str = "module Owned { interface Own { void go(); }; };";
