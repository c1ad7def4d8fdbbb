//! A simulator whose scene follows a shared world, as processes.

use crate::network::caller::Caller;
use crate::network::recorded::down;
use rc_test_site::site::Site;
use serde_json::{Value, json};

const SCENE: &str = include_str!("../../../../components/networks/scene.ddsl");

/// The place of a node in the root: x and z in mm. `None` if the scene has no such node.
fn place(world: &mut Caller, id: &str) -> Option<[f64; 2]> {
    let request = json!({ "world": "", "id": id, "base": "root" });
    let pose = world.try_call("getPose", &request).ok()?;
    let number = |name: &str| pose["return"][name].as_f64().expect("a number");
    Some([number("x"), number("z")])
}

fn await_place(world: &mut Caller, id: &str, wanted: Option<[f64; 2]>) {
    Site::until(&format!("`{id}` is at {wanted:?}"), || {
        match (place(world, id), wanted) {
            (None, None) => true,
            (Some(is), Some(wanted)) => is.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 0.01),
            _ => false,
        }
    });
}

/// The shortest range of the scanner in mm.
fn shortest(laser: &mut Caller) -> f64 {
    let scan = laser.call("getLaserData", &json!({}));
    let ranges = scan["return"].as_array().expect("a scan").iter();
    let ranges = ranges.map(|range| range["dist"].as_f64().expect("a number"));
    ranges.fold(f64::INFINITY, f64::min)
}

#[test]
fn the_scene_of_a_simulator_follows_the_world() {
    let site = Site::new("scene");
    let text = SCENE
        .replace("Deployment scene", "Deployment patrol")
        .replace(
            "time system;",
            "time system; restart on_failure backoff 10ms;",
        );
    site.write_ddsl(&text);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let set = |change: &str| {
        let ran = site.rcdeploy(&["world", "set", &site.network, change], false);
        assert_eq!(ran.code, 0, "{ran:?}");
    };
    let tree = |operation: &str, arguments: &Value| {
        let reply = site.call_tree(&format!("world.InnerModel.{operation}"), arguments);
        assert!(reply["result"]["exception"].is_null(), "{reply}");
    };
    let mut world = Caller::new(&site, "rcis", "Simulation");
    let mut laser = Caller::new(&site, "rcis", "lasers.front");

    // A component that knows nothing of InnerModel moves the bed.
    set("furniture/RT/bed.pose=[-3,0,1,0,0,0]");
    await_place(&mut world, "bed", Some([-3000.0, 1000.0]));

    // The robot drives on when something else changes, and so does it when something of it does.
    let there = json!({ "x": 2000.0, "y": 0.0, "z": 0.0, "rx": 0.0, "ry": 0.0, "rz": 0.0 });
    let teleport = json!({ "world": "", "id": "base", "base": "root", "pose": there });
    world.call("teleport", &teleport);
    let attribute = json!({ "name": "owner", "type": "string", "value": "Ana" });
    tree(
        "setAttribute",
        &json!({ "id": "base", "attribute": attribute }),
    );

    // What comes is seen, and what goes is not.
    assert!(shortest(&mut laser) > 700.0);
    let pillar = r#"<transform id="pillar" tx="2000" tz="600">
        <cylinder id="pillar_body" ty="500" radius="100" length="1000" collide="1"/></transform>"#;
    tree("add", &json!({ "parent": "furniture", "elements": pillar }));
    await_place(&mut world, "pillar", Some([2000.0, 600.0]));
    Site::until("the scanner sees the pillar", || {
        (450.0..550.0).contains(&shortest(&mut laser))
    });
    tree("remove", &json!({ "id": "bowl" }));
    await_place(&mut world, "bowl_body", None);
    await_place(&mut world, "base", Some([2000.0, 0.0]));

    // A joint of the world turns that of the scene.
    tree("setJoint", &json!({ "id": "pan", "position": 1.0 }));
    Site::until("the camera looks to the side", || {
        place(&mut world, "camera").is_some_and(|[x, _]| (x - 2084.147).abs() < 0.01)
    });

    // A simulator that was killed has the whole world again.
    let status = site.status();
    let components = status["components"].as_array().expect("a list");
    let killed = components.iter().find(|c| c["name"] == "rcis").expect("it");
    let pid = killed["pid"].as_i64().expect("a process");
    let pid = rustix::process::Pid::from_raw(pid as i32).expect("a process");
    rustix::process::kill_process(pid, rustix::process::Signal::KILL).expect("to kill it");
    site.await_component("rcis", |c| {
        c["state"] == "running" && c["pid"] != killed["pid"]
    });
    let mut world = Caller::new(&site, "rcis", "Simulation");
    await_place(&mut world, "pillar", Some([2000.0, 600.0]));
    await_place(&mut world, "bed", Some([-3000.0, 1000.0]));
    await_place(&mut world, "bowl", None);
    down(&site);
}
