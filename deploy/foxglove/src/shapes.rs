//! Values of common types in Foxglove's own schemas, in metres, so that its panels show them.
//!
//! The schemas are those of `foxglove_msgs` for ROS 2, without their later fields (`uuid`,
//! `lineage`): <https://github.com/foxglove/foxglove-sdk/tree/main/schemas/ros2>.

use rc_middleware::{Writer, cdr};
use rc_record::{ENCAPSULATION, Schema};
use rc_values::{Numbers, Struct, Type, Value};
use std::fmt::Write as _;

/// A millimetre in metres.
const MM: f64 = 1e-3;

/// A value that a panel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Shape {
    /// The distances of a laser scanner.
    Scan,
    /// Where something is.
    Pose,
    /// The same as the place of a frame, which carries what the component measures.
    Transform,
    /// A picture.
    Image,
    /// A cloud of points.
    Points,
    /// A tree of frames.
    Transforms,
}

/// What a value does not say itself.
pub(crate) struct Context<'c> {
    /// In nanoseconds.
    pub(crate) time: u64,
    /// The frame of what the component measures, and of the component itself.
    pub(crate) frame: &'c str,
    /// The frame of poses.
    pub(crate) world: &'c str,
}

/// The shapes of a value with these members, each with the place of its member.
pub(crate) fn shapes(of: &Struct) -> Vec<(Shape, usize)> {
    let members = of.members.iter().enumerate();
    let members = members.filter(|(_, member)| !member.optional);
    let all = members.flat_map(|(at, member)| kinds(&member.ty).iter().map(move |k| (*k, at)));
    let mut found: Vec<(Shape, usize)> = Vec::new();
    for (shape, at) in all {
        // A second value of the same kind would need a name of its own.
        if found.iter().all(|(known, _)| *known != shape) {
            found.push((shape, at));
        }
    }
    found
}

fn kinds(ty: &Type) -> &'static [Shape] {
    match ty {
        Type::Struct(of) => match of.name.as_str() {
            "RoboCompFullPoseEstimation::FullPoseEuler" => &[Shape::Pose, Shape::Transform],
            "RoboCompCamera::Image" => &[Shape::Image],
            "RoboCompCamera::Cloud" => &[Shape::Points],
            _ => &[],
        },
        Type::Sequence { element, .. } => match element.as_ref() {
            Type::Struct(of) if of.name == "RoboCompLaser::TData" => &[Shape::Scan],
            Type::Struct(of) if of.name == "Transforms::TransformStamped" => &[Shape::Transforms],
            _ => &[],
        },
        _ => &[],
    }
}

impl Shape {
    /// The last part of the topic.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Scan => "_scan",
            Self::Pose => "_pose",
            Self::Transform => "_transform",
            Self::Image => "_image",
            Self::Points => "_points",
            Self::Transforms => "_transforms",
        }
    }

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

    /// A value as a message, with its encapsulation. `None` if the value cannot be shown: an image
    /// whose bytes are not those of its size, for example.
    pub(crate) fn encode(self, value: &Value, context: &Context<'_>) -> Option<Vec<u8>> {
        let mut writer = Writer::default();
        match self {
            Self::Scan => scan(value, context, &mut writer)?,
            Self::Pose => {
                header(context.time, context.world, &mut writer);
                let (place, rotation) = pose(value)?;
                floats(&place, &mut writer);
                floats(&rotation, &mut writer);
            }
            Self::Transform => {
                header(context.time, context.world, &mut writer);
                cdr::text(context.frame, &mut writer);
                let (place, rotation) = pose(value)?;
                floats(&place, &mut writer);
                floats(&rotation, &mut writer);
            }
            Self::Image => image(value, context, &mut writer)?,
            Self::Points => points(value, context, &mut writer)?,
            Self::Transforms => transforms(value, &mut writer)?,
        }
        writer.finish().ok()?;
        let body = writer.into_bytes();
        let mut data = Vec::with_capacity(ENCAPSULATION.len() + body.len());
        data.extend(ENCAPSULATION);
        data.extend(body);
        Some(data)
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
/// `PackedElementField.FLOAT32`.
const FLOAT32: u8 = 7;

/// A member of a structure.
fn member<'v>(of: &'v Value, name: &str) -> Option<&'v Value> {
    let Value::Struct(ty, values) = of else {
        return None;
    };
    values.get(ty.member(name)?.0)
}

fn number(of: &Value, name: &str) -> Option<f64> {
    member(of, name)?.number()
}

fn text<'v>(of: &'v Value, name: &str) -> Option<&'v str> {
    match member(of, name)? {
        Value::Text(text) => Some(text),
        _ => None,
    }
}

fn items(of: &Value) -> Option<&[Value]> {
    match of {
        Value::Sequence(items) => Some(items),
        _ => None,
    }
}

fn stamp(time: u64, writer: &mut Writer<'_>) {
    writer.put(&i32::try_from(time / 1_000_000_000).unwrap_or(i32::MAX));
    writer.put(&((time % 1_000_000_000) as u32));
}

fn header(time: u64, frame: &str, writer: &mut Writer<'_>) {
    stamp(time, writer);
    cdr::text(frame, writer);
}

fn floats(values: &[f64], writer: &mut Writer<'_>) {
    for value in values {
        writer.put(value);
    }
}

/// The rotation of the axes of a camera (right, down, ahead) in a frame with the axes ahead, left,
/// up.
const OPTICAL: [f64; 4] = [-0.5, 0.5, -0.5, 0.5];

/// The pose of what stands at the origin of its frame.
fn at_origin(writer: &mut Writer<'_>) {
    floats(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], writer);
}

/// Measures at the nearest of as many equal steps from the least angle to the greatest: Foxglove
/// has no angle for each measure. A step without a measure has no distance.
fn scan(value: &Value, context: &Context<'_>, writer: &mut Writer<'_>) -> Option<()> {
    let measures = items(value)?.iter();
    let measures = measures.map(|m| Some((number(m, "angle")?, number(m, "dist")? * MM)));
    let measures = measures.collect::<Option<Vec<(f64, f64)>>>()?;
    let angles = || measures.iter().map(|(angle, _)| *angle);
    if !angles().all(f64::is_finite) {
        return None;
    }
    let start = angles().reduce(f64::min).unwrap_or(0.0);
    let end = angles().reduce(f64::max).unwrap_or(0.0);
    let last = measures.len().saturating_sub(1);
    let step = if end > start {
        (end - start) / last as f64
    } else {
        1.0
    };
    let mut ranges = vec![f64::INFINITY; measures.len()];
    for (angle, distance) in &measures {
        let at = (((angle - start) / step).round() as usize).min(last);
        ranges[at] = ranges[at].min(*distance);
    }
    header(context.time, context.frame, writer);
    at_origin(writer);
    floats(&[start, end], writer);
    cdr::sequence(&ranges, writer);
    cdr::sequence::<f64>(&[], writer);
    Some(())
}

/// The place in metres, and the rotation Rx·Ry·Rz as a quaternion x, y, z, w.
fn pose(value: &Value) -> Option<([f64; 3], [f64; 4])> {
    let mut place = [0.0; 3];
    for (at, name) in place.iter_mut().zip(["x", "y", "z"]) {
        *at = number(value, name)? * MM;
    }
    let half = |name| Some((number(value, name)? / 2.0).sin_cos());
    let ((sx, cx), (sy, cy), (sz, cz)) = (half("rx")?, half("ry")?, half("rz")?);
    let rotation = [
        sx * cy * cz + cx * sy * sz,
        cx * sy * cz - sx * cy * sz,
        cx * cy * sz + sx * sy * cz,
        cx * cy * cz - sx * sy * sz,
    ];
    Some((place, rotation))
}

fn image(value: &Value, context: &Context<'_>, writer: &mut Writer<'_>) -> Option<()> {
    // A negative size is none.
    let size = |name| number(value, name).map(|pixels| pixels as u32);
    let (width, height) = (size("width")?, size("height")?);
    let Value::Enum(format, of) = member(value, "format")? else {
        return None;
    };
    let (encoding, pixel) = match format.name_of(*of)? {
        "Grey" => ("mono8", 1),
        "Rgb" => ("rgb8", 3),
        _ => return None,
    };
    let Value::Numbers(Numbers::U8(data)) = member(value, "data")? else {
        return None;
    };
    let step = width.checked_mul(pixel)?;
    let length = usize::try_from(step.checked_mul(height)?).ok()?;
    let frame = text(value, "frame").filter(|frame| !frame.is_empty());
    header(context.time, frame.unwrap_or(context.frame), writer);
    writer.put(&width);
    writer.put(&height);
    cdr::text(encoding, writer);
    writer.put(&step);
    cdr::sequence(data.get(..length)?, writer);
    Some(())
}

fn points(value: &Value, context: &Context<'_>, writer: &mut Writer<'_>) -> Option<()> {
    const COORDINATES: [&str; 3] = ["x", "y", "z"];
    let points = items(member(value, "points")?)?;
    let mut data = Vec::with_capacity(points.len() * 12);
    for point in points {
        for name in COORDINATES {
            data.extend(((number(point, name)? * MM) as f32).to_le_bytes());
        }
    }
    header(context.time, context.frame, writer);
    floats(&[0.0, 0.0, 0.0], writer);
    floats(&OPTICAL, writer);
    writer.put(&12_u32);
    writer.length(COORDINATES.len());
    for (name, offset) in COORDINATES.iter().zip([0_u32, 4, 8]) {
        cdr::text(name, writer);
        writer.put(&offset);
        writer.put(&FLOAT32);
    }
    cdr::sequence(&data, writer);
    Some(())
}

/// Transforms with their own stamps and frames, which are in metres already.
fn transforms(value: &Value, writer: &mut Writer<'_>) -> Option<()> {
    let all = items(value)?;
    writer.length(all.len());
    for one in all {
        let head = member(one, "header")?;
        let time = member(head, "stamp")?;
        writer.put(&(number(time, "sec")? as i32));
        writer.put(&(number(time, "nanosec")? as u32));
        cdr::text(text(head, "frame_id")?, writer);
        cdr::text(text(one, "child_frame_id")?, writer);
        let transform = member(one, "transform")?;
        let translation = member(transform, "translation")?;
        for name in ["x", "y", "z"] {
            writer.put(&number(translation, name)?);
        }
        let rotation = member(transform, "rotation")?;
        for name in ["x", "y", "z", "w"] {
            writer.put(&number(rotation, name)?);
        }
    }
    Some(())
}

/// The member that is shown.
pub(crate) fn shown(of: &Value, at: usize) -> Option<&Value> {
    match of {
        Value::Struct(_, values) => values.get(at),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
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

    /// What a client reads by the schema alone.
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
}
