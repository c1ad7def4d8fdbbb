//! Components that declare a part of the schema of their network's world.

use rc_test_site::site::Site;
use serde_json::Value;

/// What `home.gdsl` declares, and more.
const HOUSE: &str = r#"import "geometry.gdsl";
Domain house
{
    entity room : Frame { length float unit "m" 0: optional; floor int optional; };
    entity door : Frame { width float unit "m" 0:; opened float 0:1 optional; colour string optional; };
    entity window : Frame { height float unit "m" 0:; picture topic "Camera::Image" optional; mask bytes optional; tags string[] optional; };
    relation beside { one Frame; other Frame; };
    query doors_of(room room) "MATCH (r:room)-[:RT]->(d:door) WHERE r = $room RETURN d.name AS name, d.width AS width";
};
"#;

const START: &str = r#"{"nodes": [{"id": "1:1", "type": "window", "attributes": {"name": "north", "height": 1.5}}]}"#;

const DDSL: &str = r#"Deployment patrol
{
    World g { schema "house.gdsl"; start "start.graph"; keep "kept.graph" 100ms; };
    Component keeper { cdsl "../world_keeper/world_keeper.cdsl"; };
    Component room_keeper { cdsl "../room_keeper/room_keeper.cdsl"; };
    Component door_finder { cdsl "../door_finder/door_finder.cdsl"; record { exact; }; };
};
"#;

/// `door_finder` and `room_keeper` were generated from `home.gdsl`; the keeper reads the whole schema.
#[test]
fn components_with_a_part_of_the_schema_share_the_whole_world() {
    let site = Site::new("world_part");
    site.write_ddsl(DDSL);
    // Its text is longer than one argument of a program may be.
    let remark = "// Häuser haben Räume.\n".repeat(8_000);
    site.write("house.gdsl", &format!("{remark}{HOUSE}"));
    site.write("start.graph", START);
    let plan = ["plan", "--format", "json", "--profile", "dev"];
    let plan = site.rcdeploy(&plan, true);
    let planned: Value = serde_json::from_str(&plan.stdout).expect("a plan");
    let options = planned.to_string().matches("\"--schema\"").count();
    assert_eq!(options, 4, "two parts for each of two components");

    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    // What the others add is in the whole graph, and their streams go on.
    site.await_in_log("room_keeper", "door front of 0.8 m at 1.2 0");
    site.await_in_log("room_keeper", "door front is open by");
    let kept = || std::fs::read_to_string(site.path("networks/kept.graph")).unwrap_or_default();
    Site::until("the world is kept", || {
        kept().contains("\"front\"") && kept().contains("\"north\"")
    });

    // What they do not declare reaches them, and stays, also after a restart.
    let network = site.network.as_str();
    let run = |args: &[&str]| {
        let ran = site.rcdeploy(&[&["world"], args].concat(), false);
        assert_eq!(ran.code, 0, "{ran:?}");
        ran.stdout
    };
    let set = ["set", network, "front.colour=red", "north.height=1.2"];
    run(&set);
    let restarted = site.rcdeploy(&["restart", network, "room_keeper"], false);
    assert_eq!(restarted.code, 0, "{restarted:?}");
    Site::until("the replicas are equal", || {
        let state = run(&[network, "--format", "json"]);
        let state: Value = serde_json::from_str(&state).expect("JSON");
        let replicas = state["replicas"].as_array().expect("a list");
        let digests: Vec<&Value> = replicas.iter().map(|one| &one["digest"]).collect();
        digests.len() == 3 && digests.iter().all(|own| *own == digests[0])
    });
    for replica in ["door_finder", "room_keeper", "keeper"] {
        let of = format!("{network}@{replica}");
        let difference = site.rcdeploy(&["world", "diff", &of, network, "--format", "json"], false);
        let found: Value = serde_json::from_str(&difference.stdout).expect("JSON");
        let changed = found["changed"].as_array().expect("a list");
        // The stream goes on between the two looks.
        let is_stream = changed.iter().all(|one| one["attribute"] == "opened");
        assert!(is_stream, "{difference:?}");
        for only in ["only_first", "only_second"] {
            assert_eq!(found[only].as_array().map(Vec::len), Some(0), "{found}");
        }
    }
    let read = run(&["get", network, "front.colour", "north.height"]);
    assert_eq!(read, "front.colour = \"red\"\nnorth.height = 1.2\n");

    // Values of all types are set as they are printed.
    for (attribute, value) in [
        (
            "north.picture",
            r#"{"topic": "camera.image", "type": "Camera::Image", "sequence": 18446744073709551615}"#,
        ),
        ("north.mask", r#"{"bytes": "AQID"}"#),
        ("north.tags", r#"{"strings": []}"#),
        ("front.colour", r#""dark \"red\"""#),
        ("north.tags", r#"["a", "b"]"#),
    ] {
        run(&["set", network, &format!("{attribute}={value}")]);
        let read = run(&["get", network, attribute]);
        assert_eq!(read, format!("{attribute} = {value}\n"));
    }
    for (change, text) in [
        (
            "north.picture=camera.image",
            r#"`picture` of `window` is a sample of a topic like `{"topic": "camera.image", "type": "Camera::Image", "sequence": 42}`, found `camera.image`"#,
        ),
        (
            r#"north.picture={"topic": "camera.image", "type": "Lidar::Scan", "sequence": 1}"#,
            "Lidar::Scan",
        ),
        (
            "north.mask=AQID",
            r#"`mask` of `window` is bytes in Base64 like `{"bytes": "AQID"}`, found `AQID`"#,
        ),
    ] {
        let wrong = site.rcdeploy(&["world", "set", network, change], false);
        assert_eq!(wrong.code, 2, "{wrong:?}");
        assert!(wrong.stderr.contains(text), "{wrong:?}");
    }

    let down = site.rcdeploy(&["down", network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
    // The recording has the schema.
    let args = [
        "replay",
        "--check",
        "--format",
        "json",
        network,
        "door_finder",
    ];
    let ran = site.rcdeploy(&args, false);
    let report: Value = serde_json::from_str(&ran.stdout).expect("a report");
    assert_eq!(report["equal"], true, "{ran:?}");
}

/// A component by itself has its own schema, so it does not take that of a wrong network.
#[test]
fn a_component_checks_the_schema_that_it_gets() {
    let site = Site::new("world_other");
    let other = HOUSE.replace("width float unit \"m\"", "width float unit \"mm\"");
    let files = serde_json::json!([["house.gdsl", other]]).to_string();
    let ran = site.component("door_finder", &["--schema", &files]);
    assert_eq!(ran.code, 1, "{ran:?}");
    let text = "the component declares `door.width` as `float unit \"m\" 0:`, and the network as `float unit \"mm\" 0:`";
    assert!(ran.stderr.contains(text), "{ran:?}");
    let ran = site.component("door_finder", &["--schema", "house.gdsl"]);
    assert_eq!(ran.code, 2, "{ran:?}");
    assert!(ran.stderr.contains("--schema takes FILES"), "{ran:?}");
    let ran = site.component("simulator", &["--schema", &files]);
    assert_eq!(ran.code, 2, "{ran:?}");
    assert!(ran.stderr.contains("shares no world"), "{ran:?}");
    site.write_ddsl(DDSL);
    site.write("house.gdsl", &other);
    let check = site.rcdeploy(&["check", "--format", "short", "--profile", "dev"], true);
    assert_eq!(check.code, 1, "{check:?}");
    let text = "home.gdsl:15:9: error[world-schema]";
    assert!(
        check.stderr.contains(text) || check.stdout.contains(text),
        "{check:?}"
    );
}
