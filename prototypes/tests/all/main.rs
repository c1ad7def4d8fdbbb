//! Tests of data prototypes.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

mod faults;
mod library;
mod printing;
mod random;
mod real;

use rc_diagnostics::{Format, SourceMap, render};
use rc_prototypes::load;
use rc_prototypes::model::Library;
use rc_syntax::MemoryLoader;

const LIDAR: &str = r#"
module RoboCompLidar
{
    sequence<float> Floats;
    struct Header { string frame; long stamp; };
    struct Point { @unit("mm") float X; @unit("mm") float Y; @unit("mm") float Z; float intensity; };
    sequence<Point> Points;
    struct Scan { Header header; Points points; float covariance[9]; float wide[36]; };
};
"#;

/// The abstract types and the prototypes that most tests use.
const COMMON: &str = r"
algebraic position3 :: Vector{3}
algebraic position_named :: Scalar{X, Y, Z}
algebraic quat :: Vector{4}
algebraic quat_named :: Scalar{x, y, z, w}
algebraic orient_rot_mx :: Matrix{3, 3}
algebraic ht_matrix :: Matrix{4, 4}
ddr point :: ROS{geometry_msgs/Point}

dproto ros_position :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = position_named
    ddr       = point
    dr        = { x = X, y = Y, z = Z }
}
dproto plain_position :: geometry
{
    semantic  = Position
    coord     = cartesian
    algebraic = position3
    ddr       = :: c99{double[3]}
    dr        = { 0 = 0, 1 = 1, 2 = 2 }
}
dproto ros_quaternion :: geometry
{
    semantic  = Orientation
    coord     = quaternion
    algebraic = quat_named
    ddr       = :: ROS{geometry_msgs/Quaternion}
    dr        = { x = x, y = y, z = z, w = w }
}
dproto ros_pose :: geometry
{
    semantic = Pose
    composes = { Position = ros_position, Orientation = ros_quaternion }
    dr       = { position = Position, orientation = Orientation }
}
";

/// The library of a file, which may import `Lidar.idsl` and `common.dproto`.
fn loaded(text: &str) -> (Library, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("a.dproto", text);
    let loader = MemoryLoader::new([("Lidar.idsl", LIDAR), ("common.dproto", COMMON)]);
    let (library, found) = load(&mut sources, &loader, &[source]);
    (library, render(&sources, &found, Format::Short))
}
