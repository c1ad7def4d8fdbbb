//! `rcdeploy foxglove`: clients see and touch a network, and hostile ones stop nothing.

use rc_test_site::foxglove::{Tool, client, look, rcdeploy, serve};
use rc_test_site::site::{PATROL, Site};
use serde_json::{Value, json};

fn patrol(name: &str) -> Site {
    let site = Site::new(name);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site
}

#[test]
fn foxglove_sees_and_touches_a_patrol() {
    let site = patrol("foxglove");
    look(&site, "foxglove_sees_and_touches_a_patrol");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// A camera, and who looks at it, beside the patrol. Its pictures are in grey.
const CAMERA: &str = r#"
    Component camera
    {
        cdsl "../camera/camera.cdsl";
        config "camera.toml";
    };

    Component viewer
    {
        cdsl "../image_monitor/image_monitor.cdsl";
    };

    bind avoider.Laser"#;
const SMALL: &str = "[parameters]\nwidth = 8\nheight = 4\npoints = 103\n";

/// Numbers by their names, in this order.
fn numbers<const N: usize>(of: &Value, names: [&str; N]) -> [f64; N] {
    names.map(|name| {
        let number = of[name].as_f64();
        number.unwrap_or_else(|| panic!("no number `{name}` in {of}"))
    })
}

fn list(of: &Value) -> &[Value] {
    of.as_array().expect("a list")
}

/// The components publish, and a client compares what is shown with what was sent.
#[test]
fn foxglove_shows_pictures_clouds_scans_and_poses() {
    let site = Site::new("shapes");
    site.write_ddsl(&PATROL.replacen("\n    bind avoider.Laser", CAMERA, 1));
    site.write("camera.toml", SMALL);
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let (tool, port) = serve(&site, &[]);
    let picture = r#"{"image": {"width": 2, "height": 1, "format": "Rgb", "frame": "sent", "data": [9, 8, 7, 6, 5, 4]}}"#;
    let send = ["send", &site.network, "newImage", picture, "--rate", "20"];
    let sender = Tool(rcdeploy(&site, &send).spawn().expect("rcdeploy"));
    let test = "foxglove_shows_pictures_clouds_scans_and_poses";
    if let Some(found) = client(&site, port, "shapes", test) {
        picture_is_right(&found);
        cloud_is_right(&found["cloud"]);
        scan_is_right(&found["scan"]);
        pose_is_right(&found);
    }
    drop(sender);
    drop(tool);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The frames of a world, in the axes of ROS, and its nodes with their names.
#[test]
fn foxglove_shows_a_world() {
    let home = include_str!("../../../../components/networks/home.ddsl");
    let site = Site::new("foxglove_world");
    site.write_ddsl(&home.replace("Deployment home", "Deployment patrol"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_in_log("room_keeper", "door front of 0.8 m");
    Site::executable("rcdeploy");
    let (tool, port) = serve(&site, &["--read-only"]);
    if let Some(found) = client(&site, port, "world", "foxglove_shows_a_world") {
        let transforms = list(&found["_transforms"]["transforms"]);
        let front = transforms
            .iter()
            .find(|one| one["child_frame_id"] == "front");
        let front = front.unwrap_or_else(|| panic!("no door in {found}"));
        assert_eq!(front["parent_frame_id"], "kitchen");
        let at = numbers(&front["translation"], ["x", "y", "z"]);
        assert!(
            (at[0] - 1.2).abs() < 1e-9 && at[1] == 0.0 && at[2] == 0.0,
            "{at:?}"
        );
        let entities = list(&found["_entities"]["entities"]);
        let names: Vec<&Value> = entities
            .iter()
            .map(|one| &one["texts"][0]["text"])
            .collect();
        assert_eq!(names, [&json!("kitchen"), &json!("front")]);
        assert_eq!(found["foxglove_msgs/msg/SceneUpdate"], true);
    }
    drop(tool);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// The schema is Foxglove's, and the message says when it was sent.
fn assert_shown(found: &Value, schema: &str, shown: &Value) {
    assert_eq!(found["schema"], format!("foxglove_msgs/msg/{schema}"));
    let [seconds, nanoseconds] = numbers(&shown["timestamp"], ["sec", "nanosec"]);
    let age = found["stamp"].as_f64().expect("a time") / 1e9 - seconds - nanoseconds / 1e9;
    // Floats keep the times of today to less than a microsecond.
    assert!((-1e-3..60.0).contains(&age), "{age} s, {found}");
}

/// The camera's pictures are in grey, those of the sender in colours.
fn picture_is_right(found: &Value) {
    for picture in ["image", "sent"] {
        let (whole, shown) = (&found[picture]["value"], &found[picture]["shown"]);
        assert_shown(&found[picture], "RawImage", shown);
        assert_eq!(shown["data"], whole["data"]);
    }
    let shown = |picture: &str| {
        let mut shown = found[picture]["shown"].clone();
        shown
            .as_object_mut()
            .expect("a picture")
            .remove("timestamp");
        shown
    };
    let number = found["image"]["value"]["number"].as_u64();
    let number = number.expect("a number");
    let pixels = (0..4).flat_map(|row| (0..8).map(move |column| row + column));
    let pixels: Vec<u8> = pixels.map(|place| (number + place) as u8).collect();
    let camera = json!({
        "frame_id": "camera", "width": 8, "height": 4, "encoding": "mono8", "step": 8,
        "data": pixels,
    });
    assert_eq!(shown("image"), camera);
    let sent = json!({
        "frame_id": "sent", "width": 2, "height": 1, "encoding": "rgb8", "step": 6,
        "data": [9, 8, 7, 6, 5, 4],
    });
    assert_eq!(shown("sent"), sent);
}

fn cloud_is_right(found: &Value) {
    let (whole, shown) = (&found["value"], &found["shown"]);
    assert_shown(found, "PointCloud", shown);
    assert_eq!(
        (&shown["frame_id"], &shown["point_stride"]),
        (&json!("camera"), &json!(12))
    );
    let field = |name: &str, offset: u32| json!({"name": name, "offset": offset, "type": 7});
    let fields = json!([field("x", 0), field("y", 4), field("z", 8)]);
    assert_eq!(shown["fields"], fields);
    let bytes: Vec<u8> = serde_json::from_value(shown["data"].clone()).expect("bytes");
    let points: Vec<f64> = bytes
        .as_chunks()
        .0
        .iter()
        .map(|four| f64::from(f32::from_le_bytes(*four)))
        .collect();
    let sent = list(&whole["points"]).iter();
    let sent: Vec<f64> = sent
        .flat_map(|point| numbers(point, ["x", "y", "z"]))
        .collect();
    assert_eq!((points.len(), sent.len()), (309, 309));
    for (point, sent) in points.iter().zip(&sent) {
        assert!((point - sent / 1000.0).abs() < 1e-6, "{point} for {sent}");
    }
    // The wall that the camera writes, two metres ahead: the last point is the third of row two.
    assert!((points[306] + 0.48).abs() < 1e-6 && (points[307] + 0.49).abs() < 1e-6);
    assert!((1.95 - 1e-6..=2.05 + 1e-6).contains(&points[308]));
    let turn = numbers(&shown["pose"]["orientation"], ["x", "y", "z", "w"]);
    assert_eq!(turn, [-0.5, 0.5, -0.5, 0.5]);
}

fn scan_is_right(found: &Value) {
    let (measures, shown) = (list(&found["value"]["result"]), &found["shown"]);
    assert_shown(found, "LaserScan", shown);
    assert_eq!(shown["frame_id"], "simulator");
    let measures: Vec<[f64; 2]> = measures
        .iter()
        .map(|one| numbers(one, ["angle", "dist"]))
        .collect();
    let angles = numbers(shown, ["start_angle", "end_angle"]);
    assert!(measures.len() > 10, "{found}");
    assert_eq!(angles, [measures[0][0], measures[measures.len() - 1][0]]);
    let ranges = list(&shown["ranges"]);
    assert_eq!(ranges.len(), measures.len());
    for (range, [_, distance]) in ranges.iter().zip(&measures) {
        let range = range.as_f64().expect("a distance");
        assert!((range - distance / 1000.0).abs() < 1e-6, "{found}");
    }
}

fn pose_is_right(found: &Value) {
    let (pose, transform) = (&found["pose"], &found["transform"]);
    assert_shown(pose, "PoseInFrame", &pose["shown"]);
    assert_shown(transform, "FrameTransform", &transform["shown"]);
    assert_eq!(pose["shown"]["frame_id"], "world");
    let frames = (
        &transform["shown"]["parent_frame_id"],
        &transform["shown"]["child_frame_id"],
    );
    assert_eq!(frames, (&json!("world"), &json!("simulator")));
    let shown = &pose["shown"]["pose"];
    let transform_of = &transform["shown"];
    for (value, place, turn) in [
        (&pose["value"], &shown["position"], &shown["orientation"]),
        (
            &transform["value"],
            &transform_of["translation"],
            &transform_of["rotation"],
        ),
    ] {
        let [x, y, z, rz] = numbers(value, ["x", "y", "z", "rz"]);
        let place = numbers(place, ["x", "y", "z"]);
        for (at, sent) in place.iter().zip([x, y, z]) {
            assert!((at - sent / 1000.0).abs() < 1e-9, "{found}");
        }
        // The robot turns about the vertical only.
        let (sin, cos) = (rz / 2.0).sin_cos();
        let turn = numbers(turn, ["x", "y", "z", "w"]);
        for (at, wanted) in turn.iter().zip([0.0, 0.0, sin, cos]) {
            assert!((at - wanted).abs() < 1e-9, "{found}");
        }
        assert!(place[0] != 0.0 || place[1] != 0.0, "{found}");
    }
}

#[test]
fn hostile_clients_of_foxglove_stop_nothing() {
    let site = patrol("hostile");
    let args = [
        "--origin",
        "https://viewer.example",
        "--frame",
        "newFullPose=base",
    ];
    let (mut tool, port) = serve(&site, &args);
    let test = "hostile_clients_of_foxglove_stop_nothing";
    if let Some(found) = client(&site, port, "attack", test) {
        let wanted = json!({
            "origin": 403, "protocol": 400, "allowed": null, "foxglove": null,
            "frames": ["world", "base"], "lives": true, "long": true, "served": true,
            "twice": 1, "ids": [1],
        });
        assert_eq!(found, wanted);
        assert!(
            tool.0.try_wait().expect("a child").is_none(),
            "it has ended"
        );
    }
    for (args, code, reason) in [
        (&["--frame", "newFullPos=base"][..], 1, "did you mean"),
        (&["--port", &port.to_string()], 3, "port"),
    ] {
        let all = [&["foxglove", site.network.as_str()], args].concat();
        let ran = site.run(rcdeploy(&site, &all));
        assert_eq!(ran.code, code, "{ran:?}");
        assert!(ran.stderr.contains(reason), "{ran:?}");
    }
    let ran = site.run(rcdeploy(&site, &["foxglove", "no_such_network"]));
    assert_eq!(ran.code, 3, "{ran:?}");
    drop(tool);
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
}
