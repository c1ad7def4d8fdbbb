//! Values in Foxglove's schemas.

use super::{Context, Shape};
use rc_middleware::{Writer, cdr};
use rc_quantity::Axes;
use rc_quantity::rotation::{EulerOrder, Quaternion};
use rc_record::ENCAPSULATION;
use rc_values::{Numbers, Value};

/// A millimetre in metres.
const MM: f64 = 1e-3;
/// `PackedElementField.FLOAT32`.
const FLOAT32: u8 = 7;

impl Shape {
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
    let Value::Text(text) = member(of, name)? else {
        return None;
    };
    Some(text)
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

/// The rotation of the axes of a camera in a frame with the axes of ROS.
fn optical() -> [f64; 4] {
    Quaternion::of_matrix(&Axes::ROS_OPTICAL.matrix_to(Axes::ROS)).to_xyzw()
}

/// The pose of an object at the origin of its frame.
fn at_origin(writer: &mut Writer<'_>) {
    floats(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], writer);
}

/// Measures at the nearest of as many equal steps from the least angle to the greatest: Foxglove
/// has no angle for each measure. A step without a measure has no distance.
fn scan(value: &Value, context: &Context<'_>, writer: &mut Writer<'_>) -> Option<()> {
    let measures = value.items()?.iter();
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
    let angles = [
        number(value, "rx")?,
        number(value, "ry")?,
        number(value, "rz")?,
    ];
    let rotation = EulerOrder::XYZ_MOVING.matrix(angles);
    Some((place, Quaternion::of_matrix(&rotation).to_xyzw()))
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
    let points = member(value, "points")?.items()?;
    let mut data = Vec::with_capacity(points.len() * 12);
    for point in points {
        for name in COORDINATES {
            data.extend(((number(point, name)? * MM) as f32).to_le_bytes());
        }
    }
    header(context.time, context.frame, writer);
    floats(&[0.0, 0.0, 0.0], writer);
    floats(&optical(), writer);
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
    let all = value.items()?;
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
