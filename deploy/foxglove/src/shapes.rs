//! Values of common types in Foxglove's own schemas, in metres, so that its panels show them.
//!
//! The schemas are those of `foxglove_msgs` for ROS 2, without their later fields (`uuid`,
//! `lineage`): <https://github.com/foxglove/foxglove-sdk/tree/main/schemas/ros2>.

mod schema;
mod values;

use rc_values::{Named, Struct, Type, Value};
pub(crate) use schema::scene_update;

/// A value that a panel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Shape {
    /// The distances of a laser scanner.
    Scan,
    /// Where something is.
    Pose,
    /// The place of the frame of a measured value.
    Transform,
    /// A picture.
    Image,
    /// A cloud of points.
    Points,
    /// A tree of frames.
    Transforms,
}

/// Facts that a value does not say itself.
pub(crate) struct Context<'c> {
    /// In nanoseconds.
    pub(crate) time: u64,
    /// The frame of a measured value, and of the component itself.
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
        Type::Named(Named::Struct(of)) => match of.name.as_str() {
            "RoboCompFullPoseEstimation::FullPoseEuler" => &[Shape::Pose, Shape::Transform],
            "RoboCompCamera::Image" => &[Shape::Image],
            "RoboCompCamera::Cloud" => &[Shape::Points],
            _ => &[],
        },
        Type::Sequence { element, .. } => match element.as_ref() {
            Type::Named(Named::Struct(of)) if of.name == "RoboCompLaser::TData" => &[Shape::Scan],
            Type::Named(Named::Struct(of)) if of.name == "Transforms::TransformStamped" => {
                &[Shape::Transforms]
            }
            Type::Primitive(_)
            | Type::Text { .. }
            | Type::Sequence { .. }
            | Type::Array { .. }
            | Type::Dictionary { .. }
            | Type::Named(_) => &[],
        },
        Type::Primitive(_)
        | Type::Text { .. }
        | Type::Array { .. }
        | Type::Dictionary { .. }
        | Type::Named(_) => &[],
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
}

/// The member that is shown.
pub(crate) fn shown(of: &Value, at: usize) -> Option<&Value> {
    of.members()?.get(at)
}

#[cfg(test)]
mod tests;
