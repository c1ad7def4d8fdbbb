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
        schema(name, fields, inner)
    }
}

fn schema(name: &str, fields: &str, inner: &[(&str, &str)]) -> Schema {
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

/// The schema of entities in a scene.
pub(crate) fn scene_update() -> Schema {
    let fields =
        "foxglove_msgs/SceneEntityDeletion[] deletions\nfoxglove_msgs/SceneEntity[] entities\n";
    let inner = [SCENE, &[TIME, POSE, POINT, VECTOR, QUATERNION]].concat();
    schema("SceneUpdate", fields, &inner)
}

/// The parts of a scene.
const SCENE: &[(&str, &str)] = &[
    (
        "foxglove_msgs/SceneEntityDeletion",
        "builtin_interfaces/Time timestamp\nuint8 type\nstring id\n",
    ),
    (
        "foxglove_msgs/SceneEntity",
        "builtin_interfaces/Time timestamp\nstring frame_id\nstring id\nbuiltin_interfaces/Duration lifetime\n\
         bool frame_locked\nfoxglove_msgs/KeyValuePair[] metadata\nfoxglove_msgs/ArrowPrimitive[] arrows\n\
         foxglove_msgs/CubePrimitive[] cubes\nfoxglove_msgs/SpherePrimitive[] spheres\n\
         foxglove_msgs/CylinderPrimitive[] cylinders\nfoxglove_msgs/LinePrimitive[] lines\n\
         foxglove_msgs/TriangleListPrimitive[] triangles\nfoxglove_msgs/TextPrimitive[] texts\n\
         foxglove_msgs/ModelPrimitive[] models\n",
    ),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"),
    ("foxglove_msgs/KeyValuePair", "string key\nstring value\n"),
    (
        "foxglove_msgs/Color",
        "float64 r\nfloat64 g\nfloat64 b\nfloat64 a\n",
    ),
    (
        "foxglove_msgs/ArrowPrimitive",
        "geometry_msgs/Pose pose\nfloat64 shaft_length\nfloat64 shaft_diameter\nfloat64 head_length\n\
         float64 head_diameter\nfoxglove_msgs/Color color\n",
    ),
    (
        "foxglove_msgs/CubePrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n",
    ),
    (
        "foxglove_msgs/SpherePrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfoxglove_msgs/Color color\n",
    ),
    (
        "foxglove_msgs/CylinderPrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 size\nfloat64 bottom_scale\nfloat64 top_scale\n\
         foxglove_msgs/Color color\n",
    ),
    (
        "foxglove_msgs/LinePrimitive",
        "uint8 type\ngeometry_msgs/Pose pose\nfloat64 thickness\nbool scale_invariant\n\
         geometry_msgs/Point[] points\nfoxglove_msgs/Color color\nfoxglove_msgs/Color[] colors\nuint32[] indices\n",
    ),
    (
        "foxglove_msgs/TriangleListPrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Point[] points\nfoxglove_msgs/Color color\n\
         foxglove_msgs/Color[] colors\nuint32[] indices\n",
    ),
    (
        "foxglove_msgs/TextPrimitive",
        "geometry_msgs/Pose pose\nbool billboard\nfloat64 font_size\nbool scale_invariant\n\
         foxglove_msgs/Color color\nstring text\n",
    ),
    (
        "foxglove_msgs/ModelPrimitive",
        "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nfoxglove_msgs/Color color\nbool override_color\n\
         string url\nstring media_type\nuint8[] data\n",
    ),
];

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
