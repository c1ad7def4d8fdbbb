//! A component that answers about a robot, asked by tools, and that writes its frames into the world.

use rc_test_site::site::{Site, rcdeploy};
use serde_json::{Value, json};
use std::process::Stdio;

const NETWORK: &str = include_str!("../../../../components/networks/kinematics.ddsl");

#[test]
fn links_and_positions_of_a_robot_are_answers_of_a_component() {
    let site = Site::new("kinematics");
    site.write_ddsl(&NETWORK.replace("Deployment kinematics", "Deployment patrol"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let tool = |words: &[&str]| site.rcdeploy(words, false);
    let ask = |operation: &str, request: &Value| {
        let request = request.to_string();
        let words = ["call", &site.network, operation, &request];
        tool(&[&words[..], &["--format", "json"]].concat())
    };
    let answer = |operation: &str, request: &Value| -> Value {
        let ran = ask(operation, request);
        assert_eq!(ran.code, 0, "{operation}: {ran:?}");
        let reply: Value = serde_json::from_str(&ran.stdout).expect("one document");
        reply["result"]["return"].clone()
    };
    // The topic says where the joints are, and the links are published with the time of the message.
    let mut echo = site.command(&rcdeploy());
    echo.args([
        "echo",
        &site.network,
        "transforms",
        "--once",
        "--format",
        "json",
    ]);
    let mut echo = echo.stdout(Stdio::piped()).spawn().expect("it starts");
    let positions = [0.1, -1.0, 1.0, 0.3, 0.5, 0.2];
    let state = json!({ "state": {
        "header": { "stamp": { "sec": 77, "nanosec": 5 }, "frame_id": "" },
        "name": ["wrist_3", "of another robot", "shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2"],
        "position": [0.2, 9.0, 0.1, -1.0, 1.0, 0.3, 0.5],
        "velocity": [],
        "effort": [],
    } });
    Site::until("the links are published", || {
        let sent = tool(&["send", &site.network, "jointStates", &state.to_string()]);
        assert_eq!(sent.code, 0, "{sent:?}");
        echo.try_wait().expect("a child").is_some()
    });
    let echoed = echo.wait_with_output().expect("it ended");
    let echoed = String::from_utf8(echoed.stdout).expect("a text");
    assert!(
        echoed.contains("\"upper_arm\"") && echoed.contains("77"),
        "{echoed}"
    );
    assert_eq!(answer("getPositions", &json!({})), json!(positions));

    // Nobody says positions: those of now.
    let here = json!({ "tip": "tool", "base": "base", "positions": [] });
    let pose = answer("forward", &here);
    let question = json!({ "tip": "tool", "base": "base", "pose": pose, "seed": [] });
    let found = answer("inverse", &question);
    assert_eq!(found["reached"], json!(true), "{found}");
    let near = |found: &Value| {
        let found = found["positions"].as_array().expect("a list");
        found
            .iter()
            .zip(positions)
            .all(|(one, wanted)| (one.as_f64().expect("a number") - wanted).abs() < 1e-5)
    };
    assert!(near(&found), "{found}");
    // A path ends where the arm cannot follow.
    let mut far = pose.clone();
    far["translation"]["x"] = json!(5.0);
    let path =
        json!({ "tip": "tool", "base": "base", "poses": [pose, pose, far, pose], "seed": [] });
    let path = answer("path", &path);
    let reached: Vec<&Value> = path
        .as_array()
        .expect("a list")
        .iter()
        .map(|one| &one["reached"])
        .collect();
    assert_eq!(reached, [&json!(true), &json!(true), &json!(false)]);

    let moves = answer("manipulability", &here);
    assert!(moves["measure"].as_f64() > Some(1e-4), "{moves}");
    assert_eq!(moves["singularValues"].as_array().map(Vec::len), Some(6));
    // A straight arm does not move in all directions.
    let straight = json!({ "tip": "tool", "base": "base", "positions": [0, 0, 0, 0, 0, 0] });
    let straight = answer("manipulability", &straight);
    assert!(straight["measure"].as_f64() < Some(1e-9), "{straight}");
    for (request, what) in [
        (
            json!({ "tip": "tol", "base": "base", "positions": [] }),
            "did you mean `tool`?",
        ),
        (
            json!({ "tip": "tool", "base": "base", "positions": [1] }),
            "6 positions are expected, found 1",
        ),
    ] {
        let refused = ask("forward", &request);
        assert_eq!(refused.code, 1, "{refused:?}");
        assert!(format!("{refused:?}").contains(what), "{refused:?}");
    }
    let joints = answer("getJoints", &json!({}));
    assert_eq!(joints[2]["name"], "elbow", "{joints}");
    // It shares the world of any network, and this one has none.
    let world = tool(&["world", &site.network]);
    let told = format!("no component of `{}` has a world", site.network);
    assert_eq!(world.code, 1, "{world:?}");
    assert!(world.stderr.contains(&told), "{world:?}");
    assert_eq!(tool(&["down", &site.network]).code, 0);
    site.assert_nothing_left();
}

/// A world with the types of the network, in which the base of the arm stands in a room.
const SHARED: &str = "Deployment patrol
{
    middleware iceoryx2;
    World g
    {
        schema \"home.gdsl\";
        start \"kitchen.graph\";
    };
    Component keeper
    {
        cdsl \"../world_keeper/world_keeper.cdsl\";
    };
    Component kinematics
    {
        cdsl \"../kinematics/kinematics.cdsl\";
    };
};
";

const WATCHER: &str = "Component watcher
{
    Communications { };
    language rust;
    world \"home.gdsl\" as g
    {
        reads Frame;
    };
};
";

const KITCHEN: &str = r#"{
  "schema": "home.gdsl",
  "nodes": [
    {"id": "7:1", "type": "room", "attributes": {"name": "kitchen"}},
    {"id": "7:2", "type": "Frame", "attributes": {"name": "base"}}
  ],
  "edges": [
    {"id": "7:3", "type": "RT", "from": "7:1", "to": "7:2", "attributes": {"pose": [2.0, 1.0, 0.0, 0.0, 0.0, 0.0]}}
  ]
}
"#;

#[test]
fn frames_of_a_robot_are_in_the_world_of_its_network() {
    let site = Site::new("kinematics_world");
    site.write_ddsl(SHARED);
    site.write(
        "home.gdsl",
        include_str!("../../../../components/interfaces/home.gdsl"),
    );
    site.write("kitchen.graph", KITCHEN);
    // Whoever reads frames gets those of the robot.
    site.write("watcher.cdsl", WATCHER);
    let watched = SHARED.replacen(
        "    Component keeper",
        "    Component watcher { cdsl \"watcher.cdsl\"; };\n    Component keeper",
        1,
    );
    let alone = watched.replace("../kinematics/kinematics.cdsl", "../avoider/avoider.cdsl");
    for (text, is_found) in [(&watched, false), (&alone, true)] {
        site.write_ddsl(&text.replace("start \"kitchen.graph\";", ""));
        let checked = site.rcdeploy(&["check", "--profile", "dev"], true);
        let found = checked.stderr.contains("world-unwritten");
        assert_eq!(found, is_found, "{checked:?}");
    }
    site.write_ddsl(SHARED);
    let plan = site.rcdeploy(&["plan", "--profile", "dev"], true);
    for line in [
        "world g: home.gdsl, begins with kitchen.graph",
        "    keeper      writes nothing",
        "    kinematics  writes Frame shared, RT shared, RT.pose stream 20ms shared",
    ] {
        assert!(plan.stdout.contains(line), "{plan:?}");
    }
    // Without a schema, it leaves the world alone.
    let alone = ["plan", "--profile", "dev", "--set", "kinematics.schema="];
    let plan = site.rcdeploy(&alone, true);
    assert!(plan.stdout.contains("writes nothing"), "{plan:?}");
    assert!(!plan.stdout.contains("writes Frame"), "{plan:?}");
    // Another component that writes frames must say that it shares them.
    let own = "Component placer { Communications { }; language rust; world \"home.gdsl\" as g { writes RT; }; };";
    site.write("placer.cdsl", own);
    let placer = "    Component placer { cdsl \"placer.cdsl\"; };\n    Component keeper";
    site.write_ddsl(&SHARED.replacen("    Component keeper", placer, 1));
    let checked = site.rcdeploy(&["check", "--profile", "dev"], true);
    let found = "`kinematics` writes `RT`, and `placer` writes `RT`";
    assert!(checked.stderr.contains(found), "{checked:?}");
    site.write_ddsl(SHARED);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let tool = |words: &[&str]| site.rcdeploy(words, false);
    // The forward kinematics, as a question to the graph.
    let place = |base: &str, tip: &str| -> Option<Vec<f64>> {
        let query = format!(
            "MATCH (b:Frame {{name: '{base}'}}), (t:Frame {{name: '{tip}'}}) RETURN pose(b, t) AS p"
        );
        let ran = tool(&["world", "query", &site.network, &query]);
        let row = ran.stdout.lines().nth(1)?;
        serde_json::from_str(row.trim()).ok()
    };
    let near = |found: &[f64], wanted: &Value, offset: [f64; 3]| {
        let wanted = ["x", "y", "z"].map(|axis| wanted["translation"][axis].as_f64());
        let pairs = found.iter().zip(wanted).zip(offset);
        let is_near =
            |one: f64, other: Option<f64>| other.is_some_and(|other| (one - other).abs() < 1e-9);
        pairs
            .into_iter()
            .all(|((one, other), more)| is_near(*one - more, other))
    };
    let forward = || -> Value {
        let asked = json!({ "tip": "tool", "base": "base", "positions": [] }).to_string();
        let words = ["call", &site.network, "forward", &asked, "--format", "json"];
        let ran = tool(&words);
        assert_eq!(ran.code, 0, "{ran:?}");
        let reply: Value = serde_json::from_str(&ran.stdout).expect("one document");
        reply["result"]["return"].clone()
    };
    // All joints at 0 before the first message. The room was there, and stays.
    let start = forward();
    Site::until("the frames are in the world", || {
        place("kitchen", "tool").is_some_and(|found| near(&found, &start, [2.0, 1.0, 0.0]))
    });
    let state = json!({ "state": {
        "header": { "stamp": { "sec": 77, "nanosec": 5 }, "frame_id": "" },
        "name": ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"],
        "position": [0.1, -1.0, 1.0, 0.3, 0.5, 0.2],
        "velocity": [],
        "effort": [],
    } });
    Site::until("the frames follow the joints", || {
        let sent = tool(&["send", &site.network, "jointStates", &state.to_string()]);
        assert_eq!(sent.code, 0, "{sent:?}");
        let now = forward();
        now != start && place("base", "tool").is_some_and(|found| near(&found, &now, [0.0; 3]))
    });
    assert_eq!(tool(&["down", &site.network]).code, 0);
    site.assert_nothing_left();
}
