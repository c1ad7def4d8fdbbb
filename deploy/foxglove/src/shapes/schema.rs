//! Foxglove's schemas, as definitions of ROS 2.

use super::Shape;
use rc_record::Schema;
use std::fmt::Write as _;

impl Shape {
    /// The schema of the messages.
    pub(crate) fn schema(self) -> Schema {
        let (name, fields, inner): (_, _, &[(&str, &str)]) = match self {
            Self::Scan => ("LaserScan", SCAN, &[TIME, POSE, POINT, QUATERNION]),
            Self::Pose => (
                "PoseInFrame",
                "builtin_interfaces/Time timestamp\nstring frame_id\ngeometry_msgs/Pose pose\n",
                &[TIME, POSE, POINT, QUATERNION],
            ),
            Self::Transform => ("FrameTransform", TRANSFORM, &[TIME, VECTOR, QUATERNION]),
            Self::Image => ("RawImage", IMAGE, &[TIME]),
            Self::Points => (
                "PointCloud",
                POINTS,
                &[TIME, POSE, POINT, QUATERNION, FIELD],
            ),
            Self::Transforms => (
                "FrameTransforms",
                "foxglove_msgs/FrameTransform[] transforms\n",
                &[
                    ("foxglove_msgs/FrameTransform", TRANSFORM),
                    TIME,
                    VECTOR,
                    QUATERNION,
                ],
            ),
        };
        let mut text = fields.to_owned();
        for (name, fields) in inner {
            let _ = write!(text, "{}\nMSG: {name}\n{fields}", "=".repeat(80));
        }
        Schema {
            name: format!("foxglove_msgs/msg/{name}"),
            encoding: "ros2msg".to_owned(),
            text: text.into_bytes(),
        }
    }
}

const TIME: (&str, &str) = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n");
const POINT: (&str, &str) = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n");
const VECTOR: (&str, &str) = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n");
const QUATERNION: (&str, &str) = (
    "geometry_msgs/Quaternion",
    "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
);
const POSE: (&str, &str) = (
    "geometry_msgs/Pose",
    "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n",
);
const FIELD: (&str, &str) = (
    "foxglove_msgs/PackedElementField",
    "string name\nuint32 offset\nuint8 type\n",
);
const SCAN: &str = "builtin_interfaces/Time timestamp\nstring frame_id\ngeometry_msgs/Pose pose\n\
    float64 start_angle\nfloat64 end_angle\nfloat64[] ranges\nfloat64[] intensities\n";
const TRANSFORM: &str = "builtin_interfaces/Time timestamp\nstring parent_frame_id\n\
    string child_frame_id\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n";
const IMAGE: &str = "builtin_interfaces/Time timestamp\nstring frame_id\nuint32 width\n\
    uint32 height\nstring encoding\nuint32 step\nuint8[] data\n";
const POINTS: &str = "builtin_interfaces/Time timestamp\nstring frame_id\ngeometry_msgs/Pose pose\n\
    uint32 point_stride\nfoxglove_msgs/PackedElementField[] fields\nuint8[] data\n";
