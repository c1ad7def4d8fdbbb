//! `rcgen` with data prototypes.

use crate::folders::rcgen;
use crate::rcgen::succeeds;
use expect_test::expect;

const POINTS: &str = "\
import \"Lidar.idsl\";
algebraic named :: Scalar{x, y, z}
axes robocomp :: right, ahead, up
dproto point :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = named
    ddr       = :: IDSL{Lidar::Point}
    dr        = { X = x, Y = y, Z = z }
    axes      = robocomp
}
";

const LIDAR: &str = "\
module Lidar
{
    struct Point { @unit(\"mm\") float X; @unit(\"mm\") float Y; @unit(\"mm\") float Z; };
};
";

#[test]
fn prototypes_are_checked_formatted_and_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).expect("a file");
    write("Lidar.idsl", LIDAR);
    write("points.dproto", POINTS);
    assert_eq!(succeeds(path, &["check", "points.dproto", "."]), "");

    let view = succeeds(path, &["view", "points.dproto"]);
    let view: serde_json::Value = serde_json::from_str(&view).expect("JSON");
    expect![[r#"
        {
          "axes": "robocomp",
          "content": {
            "values": {
              "algebraic": "named",
              "coordinate": "cartesian",
              "data": [
                {
                  "member": "X",
                  "number": "float32",
                  "role": "x",
                  "symbol": "x",
                  "unit": "mm"
                },
                {
                  "member": "Y",
                  "number": "float32",
                  "role": "y",
                  "symbol": "y",
                  "unit": "mm"
                },
                {
                  "member": "Z",
                  "number": "float32",
                  "role": "z",
                  "symbol": "z",
                  "unit": "mm"
                }
              ],
              "language": "IDSL",
              "ty": "Lidar::Point"
            }
          },
          "covariance": null,
          "domain": "geometry",
          "frames": [],
          "loss": null,
          "name": "point",
          "semantic": "Position",
          "sequence": null,
          "tolerance": null
        }"#]]
    .assert_eq(&serde_json::to_string_pretty(&view["prototypes"][0]).expect("JSON"));

    write(
        "points.dproto",
        &POINTS.replace("= cartesian", "=   cartesian"),
    );
    let (code, out, _) = rcgen(path, &["fmt", "--check", "points.dproto"]);
    assert_eq!((code, out.as_str()), (1, "not formatted: points.dproto\n"));
    succeeds(path, &["fmt", "points.dproto"]);
    let printed = std::fs::read_to_string(path.join("points.dproto"));
    assert_eq!(printed.expect("the file"), POINTS);

    write("points.dproto", &POINTS.replace("cartesian", "cartesien"));
    for command in ["check", "view"] {
        let (code, _, err) = rcgen(path, &[command, "points.dproto", "--format", "short"]);
        let expected = "points.dproto:7:17: error[unknown-coordinate]: Position has no coordinates `cartesien` (did you mean `cartesian`?)\n";
        assert_eq!((code, err.as_str()), (1, expected), "{command}");
    }
    let (code, _, err) = rcgen(path, &["view", "missing.dproto"]);
    assert_eq!(code, 3);
    assert!(err.contains("missing.dproto: No such file"), "{err}");
    assert!(succeeds(path, &["explain", "unknown-coordinate"]).contains("coordinates"));
    let list = succeeds(path, &["convert", "--list"]);
    assert!(list.starts_with("geometry\n    Position "), "{list}");
    assert!(list.contains("    quaternion_wxyz "), "{list}");
}

const ROS: &str = "\
algebraic named_too :: Scalar{x, y, z}
axes ros :: ahead, left, up
dproto ros_point :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = named_too
    ddr       = :: ROS{geometry_msgs/Point}
    dr        = { x = x, y = y, z = z }
    axes      = ros
    frames    = { with_respect_to = map }
}
dproto odom_point :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = named_too
    ddr       = :: ROS{geometry_msgs/Point}
    dr        = { x = x, y = y, z = z }
    frames    = { with_respect_to = odom }
}
";

#[test]
fn a_conversion_is_told_printed_or_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).expect("a file");
    write("Lidar.idsl", LIDAR);
    write("points.dproto", POINTS);
    write("ros.dproto", ROS);
    let files = ["points.dproto", "ros.dproto"];
    let convert = |from: &str, to: &str, more: &[&str]| {
        rcgen(path, &[&["convert", from, to], &files[..], more].concat())
    };
    let out = |more: &[&str]| {
        let (code, out, err) = convert("point", "ros_point", more);
        assert_eq!((code, err.as_str()), (0, ""), "{out}");
        out
    };
    expect![[r"
        point -> ros_point
        type      axes
        distance  1
        steps     ros_point (alias, unit, axes)
        cost      5: 4 operations, 0 transcendental functions
        lost      rounding of float64 only
    "]]
    .assert_eq(&out(&[]));
    expect![[r#"
        /// Converts `point` into `ros_point`.
        ///
        /// - from[0]: X in mm, float32
        /// - from[1]: Y in mm, float32
        /// - from[2]: Z in mm, float32
        /// - to[0]: x in m, float64
        /// - to[1]: y in m, float64
        /// - to[2]: z in m, float64
        #[allow(clippy::all, clippy::pedantic, reason = "generated")]
        pub fn point_to_ros_point(from: &[f64; 3]) -> Option<[f64; 3]> {
            let v0: f64 = from[1] / 1000.0;
            let v1: f64 = -from[0] / 1000.0;
            let v2: f64 = from[2] / 1000.0;
            Some([v0, v1, v2])
        }
    "#]]
    .assert_eq(&out(&["--to", "rust"]));
    expect![[r"
        #include <math.h>

        /* Converts point into ros_point.
         * from[0]: X in mm, float32
         * from[1]: Y in mm, float32
         * from[2]: Z in mm, float32
         * to[0]: x in m, float64
         * to[1]: y in m, float64
         * to[2]: z in m, float64
         * Returns 0, or 1 for numbers that are refused. */
        int point_to_ros_point(const double from[3], double to[3])
        {
            const double v0 = from[1]/1000.0, v1 = -from[0]/1000.0, v2 = from[2]/1000.0;
            to[0] = v0;
            to[1] = v1;
            to[2] = v2;
            return 0;
        }
    "]]
    .assert_eq(&out(&["--to", "c"]));
    expect![[r#"
        import math


        def point_to_ros_point(values):
            """Converts point into ros_point.

            values[0]: X in mm, float32
            values[1]: Y in mm, float32
            values[2]: Z in mm, float32
            result[0]: x in m, float64
            result[1]: y in m, float64
            result[2]: z in m, float64
            """
            if len(values) != 3:
                raise ValueError("3 values are expected")
            v0 = float(values[1]) / 1000.0
            v1 = -float(values[0]) / 1000.0
            v2 = float(values[2]) / 1000.0
            return [v0, v1, v2]
    "#]]
    .assert_eq(&out(&["--to", "python"]));

    let (code, _, err) = convert("ros_point", "odom_point", &["--format", "short"]);
    let expected = "ros.dproto:13:8: error[frame-mismatch]: `ros_point` does not convert into `odom_point`: the frames differ: `with_respect_to` is `map` and `odom`, and no transform between them is known; converted from this one at ros.dproto:3:8\n";
    assert_eq!((code, err.as_str()), (1, expected));
    let (code, _, err) = convert("point", "ros_pont", &[]);
    assert_eq!(code, 2);
    assert!(
        err.contains("there is no prototype `ros_pont`; there are `point`, "),
        "{err}"
    );
    let (code, _, err) = rcgen(path, &["convert", "point", "ros_point", "none.dproto"]);
    assert_eq!(code, 3);
    assert!(err.contains("none.dproto: No such file"), "{err}");
    assert_eq!(rcgen(path, &["convert", "point"]).0, 2);
}

const CLOUD: &str = "\
dproto cloud :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = named_too
    ddr       = :: ROS{sensor_msgs/PointCloud}
    dr        = { x = x, y = y, z = z }
    axes      = ros
    sequence  = member points
}
";

#[test]
fn elements_of_a_sequence_are_converted_as_values() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).expect("a file");
    write("Lidar.idsl", LIDAR);
    write("points.dproto", POINTS);
    write("ros.dproto", &format!("{ROS}{CLOUD}"));
    let convert = |from: &str, to: &str| {
        succeeds(path, &["convert", from, to, "points.dproto", "ros.dproto"])
    };
    expect![[r"
        point -> cloud
        type      axes
        distance  1
        steps     cloud (alias, unit, axes)
        cost      5: 4 operations, 0 transcendental functions
        note      an element of `points` of `cloud` is one `point`
        lost      rounding of float64 only
    "]]
    .assert_eq(&convert("point", "cloud"));
    expect![[r"
        cloud -> ros_point
        type      plain
        distance  1
        steps     ros_point (plain)
        cost      1: 0 operations, 0 transcendental functions
        note      an element of `points` of `cloud` is one `ros_point`
        lost      nothing: the plan is exact
    "]]
    .assert_eq(&convert("cloud", "ros_point"));
}
