use super::*;
use rc_record::definition;
use serde_json::{Value as Json, json};
use std::sync::Arc;

/// The request of an operation with the parameter `one`.
fn request(module: &str, types: &Json, parameter: &str) -> Arc<Struct> {
    let module = json!({"module": module, "types": types, "interfaces": [{
        "name": "Pub", "operations": [{"name": "push", "id": 0, "hash": "0000000000000001",
            "pattern": "publish", "inputs": [{"name": "one", "type": parameter}]}]
    }]});
    let module = serde_json::from_value(module).expect("a module");
    let catalog = rc_values::Catalog::new(&[module]).expect("a catalog");
    let interface = catalog.interfaces().next().expect("an interface");
    Arc::clone(&interface.operations[0].request)
}

fn members(names: &[&str], ty: &str) -> Vec<Json> {
    let all = names.iter();
    all.map(|name| json!({"name": name, "type": ty})).collect()
}

/// The value that a client reads by the schema alone.
fn shown_as(shape: Shape, ty: &Arc<Struct>, value: &Json) -> Option<Json> {
    let value = rc_values::from_json(ty, &json!({"one": value})).expect("a value");
    let (_, at) = shapes(ty).into_iter().find(|(found, _)| *found == shape)?;
    let context = Context {
        time: 5_000_000_007,
        frame: "robot",
        world: "world",
    };
    let data = shape.encode(shown(&value, at)?, &context)?;
    let schema = shape.schema();
    let text = String::from_utf8(schema.text).expect("a text");
    let read = definition::parse(&schema.name, &text).expect("a definition");
    let body = definition::body(&data).expect("a body");
    let value = rc_values::decode(&read, rc_middleware::Encoding::Cdr, body).expect("a value");
    Some(serde_json::to_value(&value).expect("JSON"))
}

fn pose_type() -> Arc<Struct> {
    let mut all = members(&["x", "y", "z", "rx", "ry", "rz"], "float32");
    all.push(json!({"name": "confidence", "type": "int32"}));
    let types = json!([{"name": "FullPoseEuler", "struct": all}]);
    let ty = "RoboCompFullPoseEstimation::FullPoseEuler";
    request("RoboCompFullPoseEstimation", &types, ty)
}

#[test]
fn poses_are_in_metres_with_quaternions() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let value = json!({"x": 1500, "z": -250, "rx": quarter, "rz": quarter});
    let pose = shown_as(Shape::Pose, &pose_type(), &value).expect("a pose");
    assert_eq!(pose["timestamp"], json!({"sec": 5, "nanosec": 7}));
    assert_eq!(pose["frame_id"], "world");
    assert_eq!(
        pose["pose"]["position"],
        json!({"x": 1.5, "y": 0.0, "z": -0.25})
    );
    // A quarter turn about z within a quarter turn about x takes x to z: all four are a half,
    // with y negative.
    for (name, wanted) in [("x", 0.5), ("y", -0.5), ("z", 0.5), ("w", 0.5)] {
        let found = pose["pose"]["orientation"][name]
            .as_f64()
            .expect("a number");
        assert!((found - wanted).abs() < 1e-6, "{name} {pose}");
    }
    let transform = shown_as(Shape::Transform, &pose_type(), &value).expect("a transform");
    assert_eq!(transform["parent_frame_id"], "world");
    assert_eq!(transform["child_frame_id"], "robot");
    assert_eq!(transform["rotation"], pose["pose"]["orientation"]);
}

#[test]
fn scans_have_equal_steps_whatever_their_order() {
    let types = json!([{"name": "TData", "struct": members(&["angle", "dist"], "float32")}]);
    let ty = request("RoboCompLaser", &types, "sequence<RoboCompLaser::TData>");
    let one = |angle: f64, dist: f64| json!({"angle": angle, "dist": dist});
    let value = json!([one(1.0, 3000.0), one(0.0, 2000.0), one(-1.0, 1000.0)]);
    let scan = shown_as(Shape::Scan, &ty, &value).expect("a scan");
    assert_eq!(scan["frame_id"], "robot");
    assert_eq!(
        (&scan["start_angle"], &scan["end_angle"]),
        (&json!(-1.0), &json!(1.0))
    );
    assert_eq!(scan["ranges"], json!([1.0, 2.0, 3.0]));
    assert_eq!(scan["pose"]["orientation"]["w"], 1.0);
    let gap = json!([one(0.0, 1000.0), one(0.1, 2000.0), one(1.0, 3000.0)]);
    let scan = shown_as(Shape::Scan, &ty, &gap).expect("a scan");
    assert_eq!(scan["ranges"], json!([1.0, "Infinity", 3.0]));
    let empty = shown_as(Shape::Scan, &ty, &json!([])).expect("a scan");
    assert_eq!(empty["ranges"], json!([]));
    let strange = json!([{"angle": "NaN", "dist": 1}]);
    assert_eq!(shown_as(Shape::Scan, &ty, &strange), None);
}

#[test]
fn images_need_the_bytes_of_their_size() {
    let types = json!([
        {"name": "PixelFormat", "enum": [["Grey", 0], ["Rgb", 1]]},
        {"name": "Image", "struct": [
            {"name": "width", "type": "int32"}, {"name": "height", "type": "int32"},
            {"name": "format", "type": "RoboCompCamera::PixelFormat"},
            {"name": "frame", "type": "string<32>"}, {"name": "data", "type": "sequence<uint8>"}
        ]}
    ]);
    let ty = request("RoboCompCamera", &types, "RoboCompCamera::Image");
    let mut value = json!({"width": 1, "height": 2, "format": "Rgb", "frame": "eye",
        "data": [1, 2, 3, 4, 5, 6]});
    let image = shown_as(Shape::Image, &ty, &value).expect("an image");
    assert_eq!(
        (&image["frame_id"], &image["step"]),
        (&json!("eye"), &json!(3))
    );
    assert_eq!(
        (&image["encoding"], &image["data"]),
        (&json!("rgb8"), &value["data"])
    );
    value["height"] = json!(3);
    assert_eq!(shown_as(Shape::Image, &ty, &value), None);
    value["height"] = json!(-1);
    assert_eq!(
        shown_as(Shape::Image, &ty, &value).expect("none")["data"],
        json!([])
    );
}

/// A vector turned by a unit quaternion: `v + 2 q × (q × v + w v)`.
fn turned([x, y, z, w]: [f64; 4], point: [f64; 3]) -> [f64; 3] {
    let cross = |with: [f64; 3]| {
        [
            y * with[2] - z * with[1],
            z * with[0] - x * with[2],
            x * with[1] - y * with[0],
        ]
    };
    let inner = cross(point);
    let outer = cross([0, 1, 2].map(|at| inner[at] + w * point[at]));
    [0, 1, 2].map(|at| point[at] + 2.0 * outer[at])
}

#[test]
fn clouds_are_packed_and_transforms_keep_their_frames() {
    let types = json!([
        {"name": "CloudPoint", "struct": members(&["x", "y", "z"], "float32")},
        {"name": "Cloud", "struct": [
            {"name": "points", "type": "sequence<RoboCompCamera::CloudPoint>"}
        ]}
    ]);
    let ty = request("RoboCompCamera", &types, "RoboCompCamera::Cloud");
    let value = json!({"points": [{"x": 1000, "y": 2000, "z": 3000}]});
    let cloud = shown_as(Shape::Points, &ty, &value).expect("a cloud");
    assert_eq!(cloud["point_stride"], 12);
    assert_eq!(
        cloud["fields"][2],
        json!({"name": "z", "offset": 8, "type": 7})
    );
    let one = [1.0_f32, 2.0, 3.0];
    let bytes: Vec<u8> = one.iter().flat_map(|number| number.to_le_bytes()).collect();
    assert_eq!(cloud["data"], json!(bytes));
    // To the right, down, ahead; the pose of the cloud turns it to ahead, left, up.
    let orientation = &cloud["pose"]["orientation"];
    let turn = ["x", "y", "z", "w"].map(|name| orientation[name].as_f64().expect("a number"));
    assert_eq!(turned(turn, [1.0, 2.0, 3.0]), [3.0, -1.0, -2.0]);

    let types = json!([
        {"name": "Time", "struct": [
            {"name": "sec", "type": "int32"}, {"name": "nanosec", "type": "uint32"}]},
        {"name": "Header", "struct": [
            {"name": "stamp", "type": "Transforms::Time"}, {"name": "frame_id", "type": "string"}]},
        {"name": "Vector3", "struct": members(&["x", "y", "z"], "float64")},
        {"name": "Quaternion", "struct": members(&["x", "y", "z", "w"], "float64")},
        {"name": "Transform", "struct": [
            {"name": "translation", "type": "Transforms::Vector3"},
            {"name": "rotation", "type": "Transforms::Quaternion"}]},
        {"name": "TransformStamped", "struct": [
            {"name": "header", "type": "Transforms::Header"},
            {"name": "child_frame_id", "type": "string"},
            {"name": "transform", "type": "Transforms::Transform"}]}
    ]);
    let ty = request(
        "Transforms",
        &types,
        "sequence<Transforms::TransformStamped>",
    );
    let value = json!([{
        "header": {"stamp": {"sec": 3, "nanosec": 4}, "frame_id": "base"},
        "child_frame_id": "laser",
        "transform": {"translation": {"x": 0.5}, "rotation": {"w": 1.0}},
    }]);
    let all = shown_as(Shape::Transforms, &ty, &value).expect("transforms");
    let one = &all["transforms"][0];
    assert_eq!(one["timestamp"], json!({"sec": 3, "nanosec": 4}));
    assert_eq!(
        (&one["parent_frame_id"], &one["child_frame_id"]),
        (&json!("base"), &json!("laser"))
    );
    assert_eq!(
        (&one["translation"]["x"], &one["rotation"]["w"]),
        (&json!(0.5), &json!(1.0))
    );
}

#[test]
fn other_types_are_shown_as_they_are() {
    let ty = request("Other", &json!([]), "sequence<float64>");
    assert_eq!(shapes(&ty), []);
}
