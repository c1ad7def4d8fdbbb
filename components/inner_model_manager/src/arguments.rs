//! Between the tree and the types of the interface.

use crate::refusal::Refusal;
use innermodel::kinds::{Axis, Encoder, Joint, Kind};
use innermodel::{NodeRef, Snapshot};
use interfaces::robo_comp_inner_model_manager::{
    AttributeType, JointType, NodeInformation, NodeType, Pose3D,
};
use rc_diagnostics::foreign::clean;

pub(crate) fn finite(numbers: &[f32]) -> Result<(), Refusal> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(());
    }
    Err(Refusal::Value("a number is not finite".to_owned()))
}

/// A node that transforms: RoboComp asks for nothing else in poses.
pub(crate) fn frame<'t>(tree: &'t Snapshot, id: &str) -> Result<NodeRef<'t>, Refusal> {
    let node = tree.node(id)?;
    if node.kind().may_have_children() {
        return Ok(node);
    }
    Err(wrong_kind(&node, "a transform"))
}

/// The pose of `item` in `base`.
pub(crate) fn pose_in_base(
    tree: &Snapshot,
    base: &str,
    item: &str,
) -> Result<innermodel::Transform, Refusal> {
    let (base, item) = (frame(tree, base)?, frame(tree, item)?);
    Ok(tree.between(base.node_id(), item.node_id())?)
}

pub(crate) fn joint_kind(joint: &JointType) -> Result<Kind, Refusal> {
    finite(&[
        joint.lx, joint.ly, joint.lz, joint.hx, joint.hy, joint.hz, joint.mass,
    ])?;
    let axis = match joint.axis.as_str() {
        "x" => Axis::X,
        "y" => Axis::Y,
        "z" | "" => Axis::Z,
        _ => return Err(Refusal::Value("expected the axis x, y or z".to_owned())),
    };
    let (min, max) = (f64::from(joint.min), f64::from(joint.max));
    // Infinity is not a limit.
    let is_range = min <= max && min < f64::INFINITY && max > f64::NEG_INFINITY;
    if !is_range {
        let text = format!("there is no angle from {min} to {max}");
        return Err(Refusal::Value(text));
    }
    Ok(Kind::Joint(Joint {
        axis,
        min,
        max,
        home: 0.0,
        max_speed: 0.0,
        encoder: Encoder::default(),
        port: port(joint.port)?,
        low: [joint.lx, joint.ly, joint.lz].map(f64::from),
        high: [joint.hx, joint.hy, joint.hz].map(f64::from),
    }))
}

pub(crate) fn port(port: i32) -> Result<u32, Refusal> {
    u32::try_from(port).map_err(|_| Refusal::Value(format!("{port} is not a port")))
}

pub(crate) fn scale(numbers: [f32; 3]) -> Result<[f64; 3], Refusal> {
    finite(&numbers)?;
    if numbers.iter().any(|number| *number < 0.0) {
        let [x, y, z] = numbers;
        let text = format!("the scale ({x}, {y}, {z}) has a negative number");
        return Err(Refusal::Value(text));
    }
    Ok(numbers.map(f64::from))
}

pub(crate) fn node_type(kind: &Kind) -> NodeType {
    use innermodel::kinds::Drive;
    match kind {
        Kind::Transform(_) | Kind::Axes(_) | Kind::Battery(_) | Kind::Human(_) => {
            NodeType::Transform
        }
        Kind::Joint(_) | Kind::Prismatic(_) => NodeType::Joint,
        Kind::TouchSensor(_) => NodeType::TouchSensor,
        Kind::Robot(robot) => match robot.drive {
            Drive::Differential => NodeType::DifferentialRobot,
            Drive::Omni => NodeType::OmniRobot,
        },
        Kind::Camera(_) => NodeType::Camera,
        Kind::Rgbd(_) => NodeType::Rgbd,
        Kind::Laser(_) | Kind::Lidar(_) | Kind::Ultrasound(_) => NodeType::Laser,
        Kind::Imu(_) => NodeType::Imu,
        Kind::Plane(_) => NodeType::Plane,
        Kind::Display(_) => NodeType::DisplayII,
        Kind::Mesh(_) | Kind::Solid(_) => NodeType::Mesh,
        Kind::PointCloud => NodeType::PointCloud,
    }
}

pub(crate) fn information(node: &NodeRef<'_>) -> NodeInformation {
    let attributes = node.attributes();
    NodeInformation {
        id: node.id().to_owned(),
        parent_id: node
            .parent()
            .map_or_else(String::new, |parent| parent.id().to_owned()),
        n_type: node_type(node.kind()),
        attributes: attributes
            .map(|(name, form, value)| {
                let attribute = AttributeType {
                    type_: form.to_owned(),
                    value: value.to_owned(),
                };
                (name.to_owned(), attribute)
            })
            .collect(),
    }
}

/// The pose of RoboComp's interface.
pub(crate) fn pose3d_in(pose: &Pose3D) -> innermodel::Pose {
    let wide = f64::from;
    innermodel::Pose::new(
        wide(pose.x),
        wide(pose.y),
        wide(pose.z),
        wide(pose.rx),
        wide(pose.ry),
        wide(pose.rz),
    )
}

/// The pose of RoboComp's interface.
pub(crate) fn pose3d_out(pose: &innermodel::Pose) -> Result<Pose3D, Refusal> {
    let [x, y, z] = narrow(pose.translation)?;
    let [rx, ry, rz] = narrow(pose.rotation)?;
    Ok(Pose3D {
        x,
        y,
        z,
        rx,
        ry,
        rz,
    })
}

/// Numbers of a result. The tree holds greater ones than the interface.
pub(crate) fn narrow<const N: usize>(numbers: [f64; N]) -> Result<[f32; N], Refusal> {
    let narrow = numbers.map(|number| number as f32);
    if narrow.iter().all(|number| number.is_finite()) {
        return Ok(narrow);
    }
    let text = "the result has a number that is not a finite float".to_owned();
    Err(Refusal::Result(text))
}

/// A node has another kind than an operation needs.
pub(crate) fn wrong_kind(node: &NodeRef<'_>, expected: &str) -> Refusal {
    let (id, tag) = (clean(node.id()), node.kind().tag());
    let text = format!("`{id}` is a {tag}, not {expected}");
    Refusal::Kind(text)
}

/// A normal of 0 is that of a plane without one.
pub(crate) fn direction(normal: [f32; 3]) -> [f64; 3] {
    if normal == [0.0; 3] {
        return [0.0, 0.0, -1.0];
    }
    normal.map(f64::from)
}
