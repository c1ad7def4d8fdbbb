//! Messages of a topic and of a recording, as other prototypes.

use super::*;
use crate::definition;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use rc_values::from_json;
use serde_json::{Value as Json, json};

const IDSL: &str = r"module RoboCompCloud
{
    struct Point { float X; float Y; float Z; int light; double spread[9]; };
    struct Metres { double x; double y; double z; };
    struct Turn { double q[4]; };
    struct Placed { double x; double y; double z; double sure[9]; };
    struct Pose { Placed place; Turn turn; };
    struct Sweep { double at[3]; Point origin; sequence<Point> points; int number; };
    sequence<Point> Points;
    struct Scan { string frame; Points points; };
};";

const PROTOTYPES: &str = r#"import "Cloud.idsl";
axes lidar :: right, ahead, up
axes ros :: ahead, left, up
algebraic named :: Scalar{x, y, z}
algebraic four :: Vector{4}
units millimetres :: qudt, named { x = mm, y = mm, z = mm }
dproto scan :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: IDSL{RoboCompCloud::Point} dr = { X = x, Y = y, Z = z } units = millimetres axes = lidar }
dproto point :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: IDSL{RoboCompCloud::Metres} dr = { x = x, y = y, z = z } axes = ros }
dproto ros_point :: geometry { semantic = Position coord = cartesian algebraic = named
    ddr = :: ROS{geometry_msgs/Point} dr = { position.x = x, position.y = y, position.z = z } axes = ros }
dproto turn :: geometry { semantic = Orientation coord = quaternion algebraic = four
    ddr = :: IDSL{RoboCompCloud::Turn} dr = { q.0 = 0, q.1 = 1, q.2 = 2, q.3 = 3 } }
dproto turned :: geometry { semantic = Orientation coord = quaternion_wxyz algebraic = four
    ddr = :: c99{double[4]} dr = { wxyz.0 = 0, wxyz.1 = 1, wxyz.2 = 2, wxyz.3 = 3 } }
"#;

fn library(text: &str) -> Library {
    let mut sources = SourceMap::new();
    let source = sources.add("a.dproto", text);
    let loader = MemoryLoader::new([("Cloud.idsl", IDSL)]);
    let (library, found) = rc_prototypes::load(&mut sources, &loader, &[source]);
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    library
}

/// A value of a definition of ROS 2, converted.
fn shown(definition: (&str, &str), name: &str, value: &Json) -> Result<Json, String> {
    let ty = definition::parse(definition.0, definition.1).expect("a type");
    let converter = Converter::new(&library(PROTOTYPES), name, None)?;
    assert!(converter.converts(&ty));
    let value = from_json(&ty, value).expect("a value");
    let value = converter.value(value).map_err(|e| e.to_string())?;
    Ok(serde_json::to_value(value).expect("JSON"))
}

/// The message of a recording, whose members have the names of ROS 2.
const SCAN: (&str, &str) = (
    "robocomp_cloud_msgs/msg/Scan",
    "string frame\nPoint[] points\n================\nMSG: robocomp_cloud_msgs/Point\nfloat32 x\nfloat32 y\nfloat32 z\nint32 light\n",
);

#[test]
fn elements_of_a_recording_become_another_prototype_and_keep_their_other_members() {
    let scan = json!({"frame": "laser", "points": [
        {"x": 1000.0, "y": 2000.0, "z": 500.0, "light": 7},
        {"x": 0.0, "y": -1.0, "z": 0.0, "light": 8},
    ]});
    let found = shown(SCAN, "point", &scan).expect("converted");
    let wanted = json!({"frame": "laser", "points": [
        {"x": 2.0, "y": -1.0, "z": 0.5, "light": 7},
        {"x": -0.001, "y": 0.0, "z": 0.0, "light": 8},
    ]});
    // -0 is 0.
    assert_eq!(
        found.to_string().replace("-0.0,", "0.0,"),
        wanted.to_string()
    );
}

#[test]
fn members_of_another_type_take_the_place_of_those_that_are_converted() {
    let scan =
        json!({"frame": "laser", "points": [{"x": 1000.0, "y": 2000.0, "z": 500.0, "light": 7}]});
    let found = shown(SCAN, "ros_point", &scan).expect("converted");
    let point = json!({"light": 7, "position": {"x": 2.0, "y": -1.0, "z": 0.5}});
    assert_eq!(found["points"], json!([point]));
}

/// A type with a prototype of its own, one of the elements of a member, and a member that has its own.
const SWEEP: (&str, &str) = (
    "robocomp_cloud_msgs/msg/Sweep",
    "float64[3] at\nPoint origin\nPoint[] points\nint32 number\n================\nMSG: robocomp_cloud_msgs/Point\nfloat32 x\nfloat32 y\nfloat32 z\n",
);

#[test]
fn a_whole_its_elements_and_its_members_are_converted_once_each() {
    let text = PROTOTYPES.replace("\nalgebraic named", "\naxes back :: back, right, up\nalgebraic named")
        + "dproto place :: geometry { semantic = Position coord = cartesian algebraic = named
           ddr = :: IDSL{RoboCompCloud::Sweep} dr = { at.0 = x, at.1 = y, at.2 = z } axes = back }
           dproto swept :: geometry { semantic = Position coord = cartesian algebraic = named sequence = member points
           ddr = :: IDSL{RoboCompCloud::Sweep} dr = { X = x, Y = y, Z = z } units = millimetres axes = ros }";
    let ty = definition::parse(SWEEP.0, SWEEP.1).expect("a type");
    let converter = Converter::new(&library(&text), "ros_point", None).expect("a converter");
    let point = json!({"x": 1000.0, "y": 2000.0, "z": 500.0});
    let sweep =
        json!({"at": [1.0, 2.0, 3.0], "origin": point, "points": [point, point], "number": 7});
    let value = from_json(&ty, &sweep).expect("a value");
    let value = converter.value(value).expect("converted");
    let found = serde_json::to_value(value).expect("JSON");
    let position = |x: f64, y: f64, z: f64| json!({"x": x, "y": y, "z": z});
    let element = json!({"position": position(1.0, 2.0, 0.5)});
    let wanted = json!({
        "origin": {"position": position(2.0, -1.0, 0.5)},
        "points": [element, element],
        "number": 7,
        "position": position(-1.0, -2.0, 3.0),
    });
    assert_eq!(found, wanted);
}

#[test]
fn losses_are_told() {
    let losses = |name: &str, of| {
        let converter = Converter::new(&library(PROTOTYPES), name, of).expect("a converter");
        converter.losses().collect::<Vec<_>>()
    };
    assert_eq!(losses("point", Some("scan")), Vec::<String>::new());
    assert_eq!(
        losses("scan", Some("point")),
        ["`point` as `scan`: float32, in the range of float32, bounded: 6.0e-8 of the value"]
    );
}

#[test]
fn values_without_meaning_are_refused() {
    let turn = ("robocomp_cloud_msgs/msg/Turn", "float64[4] q\n");
    let of = |w: f64| shown(turn, "turned", &json!({"q": [0.0, 0.0, 0.0, w]}));
    assert_eq!(of(1.0), Ok(json!({"wxyz": [1.0, 0.0, 0.0, 0.0]})));
    for wrong in [0.0, 1.2] {
        let refused = of(wrong).expect_err("no rotation");
        assert!(refused.contains("is refused"), "{refused}");
    }
}

#[test]
fn names_and_ambiguities_are_told() {
    let converter = |text: &str, name, of| Converter::new(&library(text), name, of).map(|_| ());
    let two = PROTOTYPES.to_owned()
        + "dproto other :: geometry { semantic = Position coord = cartesian algebraic = named
           ddr = :: IDSL{RoboCompCloud::Point} dr = { X = x, Y = y, Z = z } axes = lidar }";
    let error = |text: &str, name, of| converter(text, name, of).expect_err("an error");
    assert_eq!(
        error(&two, "point", None),
        "`scan` and `other` are about one type; choose one with --of"
    );
    assert_eq!(converter(&two, "point", Some("other")), Ok(()));
    assert_eq!(
        error(PROTOTYPES, "poimt", None),
        "the files have no prototype `poimt`; did you mean `point`?"
    );
    assert_eq!(
        error(PROTOTYPES, "point", Some("turn")),
        "`turn` does not convert into `point`: the meanings differ: Orientation and Position"
    );
}

/// Channels of one recording may have types of one name with other orders of members.
#[test]
fn types_of_one_name_are_told_apart() {
    let converter = Converter::new(&library(PROTOTYPES), "point", None).expect("a converter");
    let name = "robocomp_cloud_msgs/msg/Point";
    for order in ["xyz", "zxy", "yzx"] {
        let lines: String = order.chars().map(|of| format!("float32 {of}\n")).collect();
        let ty = definition::parse(name, &(lines + "int32 light\n")).expect("a type");
        let value = json!({"x": 1000.0, "y": 2000.0, "z": 500.0, "light": 7});
        let value = from_json(&ty, &value).expect("a value");
        let value = converter.value(value).expect("converted");
        let found = serde_json::to_value(value).expect("JSON");
        let numbers = ["x", "y", "z"].map(|of| found[of].as_f64());
        assert_eq!(numbers, [Some(2.0), Some(-1.0), Some(0.5)], "{order}");
    }
}

/// The elements of an array are at the places that their names say, whatever their order is.
#[test]
fn elements_of_an_array_have_their_places() {
    let text = PROTOTYPES.replace(
        "{ wxyz.0 = 0, wxyz.1 = 1, wxyz.2 = 2, wxyz.3 = 3 }",
        "{ wxyz.1 = 0, wxyz.2 = 1, wxyz.3 = 2, wxyz.0 = 3 }",
    );
    let ty = definition::parse("robocomp_cloud_msgs/msg/Turn", "float64[4] q\n").expect("a type");
    let converter = Converter::new(&library(&text), "turned", None).expect("a converter");
    let value = from_json(&ty, &json!({"q": [0.0, 0.0, 1.0, 0.0]})).expect("a value");
    let value = converter.value(value).expect("converted");
    let found = serde_json::to_value(value).expect("JSON");
    // w, x, y, z are the elements 1, 2, 3, 0.
    assert_eq!(found, json!({"wxyz": [1.0, 0.0, 0.0, 0.0]}));
}

/// A covariance is removed if its numbers are not converted with the value.
#[test]
fn a_covariance_that_is_not_converted_is_left_out() {
    let spread = PROTOTYPES.replace(
        "units = millimetres axes = lidar }",
        "units = millimetres axes = lidar covariance = { member spread } }",
    );
    let spread = library(&spread);
    let converter = Converter::new(&spread, "point", None).expect("a converter");
    let text = "float32 x\nfloat32 y\nfloat32 z\nfloat64[9] spread\nint32 light\n";
    let ty = definition::parse("robocomp_cloud_msgs/msg/Point", text).expect("a type");
    let value = json!({"x": 1.0, "y": 2.0, "z": 3.0, "spread": vec![1.0; 9], "light": 7});
    let value = from_json(&ty, &value).expect("a value");
    let value = converter.value(value).expect("converted");
    let found = serde_json::to_value(value).expect("JSON");
    assert_eq!(found["light"], 7);
    assert!(found.get("spread").is_none(), "{found}");
}

/// The covariance of a part is converted with the part, or left out if the other one has none.
#[test]
fn covariances_of_parts_are_converted() {
    let shown = |sure: &str| {
        let part = |name: &str, more: &str| {
            format!(
                "dproto {name} :: geometry {{ semantic = Position coord = cartesian algebraic = named
                    ddr = :: IDSL{{RoboCompCloud::Placed}} dr = {{ x = x, y = y, z = z }} {more} }}\n"
            )
        };
        let whole = |name: &str, place: &str, axes: &str| {
            format!(
                "dproto {name} :: geometry {{ semantic = Pose composes = {{ Position = {place}, Orientation = turn }}
                    ddr = :: IDSL{{RoboCompCloud::Pose}} dr = {{ place = Position, turn = Orientation }} axes = {axes} }}\n"
            )
        };
        let text = [
            PROTOTYPES,
            &part("small", "units = millimetres covariance = { member sure }"),
            &part("large", sure),
            &whole("pose", "small", "lidar"),
            &whole("ros_pose", "large", "ros"),
        ];
        let library = library(&text.concat());
        let converter = Converter::new(&library, "ros_pose", Some("pose")).expect("a converter");
        let definition = "Placed place\nTurn turn\n================\nMSG: robocomp_cloud_msgs/Placed\n\
            float64 x\nfloat64 y\nfloat64 z\nfloat64[9] sure\n================\n\
            MSG: robocomp_cloud_msgs/Turn\nfloat64[4] q\n";
        let ty = definition::parse("robocomp_cloud_msgs/msg/Pose", definition).expect("a type");
        let spread = [4.0, 1.0, 0.0, 1.0, 9.0, 0.0, 0.0, 0.0, 16.0];
        let value = json!({
            "place": {"x": 1000.0, "y": 2000.0, "z": 500.0, "sure": spread},
            "turn": {"q": [0.0, 0.0, 0.0, 1.0]},
        });
        let value = from_json(&ty, &value).expect("a value");
        let value = converter.value(value).expect("converted");
        let losses: Vec<String> = converter.losses().collect();
        (serde_json::to_value(value).expect("JSON"), losses)
    };
    let (found, losses) = shown("covariance = { member sure }");
    assert_eq!(losses, Vec::<String>::new());
    let place = &found["place"];
    assert_eq!((&place["x"], &place["y"]), (&json!(2.0), &json!(-1.0)));
    // Ahead, left, up are y, -x, z, in metres.
    let expected = [9e-6, -1e-6, 0.0, -1e-6, 4e-6, 0.0, 0.0, 0.0, 16e-6];
    for (at, wanted) in expected.into_iter().enumerate() {
        let number = place["sure"][at].as_f64().expect("a number");
        assert!((number - wanted).abs() < 1e-15, "{place}");
    }
    let (found, losses) = shown("");
    assert!(found["place"].get("sure").is_none(), "{found}");
    let told = "`pose` as `ros_pose`: the covariance of `Position` is not converted, not bounded";
    assert_eq!(losses, [told]);
}

/// A recording has its own definitions: that a type is gone from the files, or a member from a type, is
/// told by name.
#[test]
fn types_and_members_that_are_gone_are_told() {
    let converter = Converter::new(&library(PROTOTYPES), "point", None).expect("a converter");
    let gone = definition::parse(
        "robocomp_cloud_msgs/msg/OldScan",
        "string frame\nOldPoint[] points\n================\nMSG: robocomp_cloud_msgs/OldPoint\nfloat32 x\nfloat32 y\nfloat32 z\n",
    )
    .expect("a type");
    assert!(!converter.converts(&gone));
    let told = converter.no_conversion_error(&gone).to_string();
    for part in ["OldScan", "`scan`", "convert into `point`"] {
        assert!(told.contains(part), "{told}");
    }
    let shorter = SCAN.1.replace("float32 z\n", "");
    let shorter = definition::parse(SCAN.0, &shorter).expect("a type");
    let value = json!({"frame": "", "points": [{"x": 1.0, "y": 2.0, "light": 1}]});
    let value = from_json(&shorter, &value).expect("a value");
    let refused = converter.value(value).expect_err("a member is missing");
    assert!(refused.to_string().contains("no number `z`"), "{refused}");
}
