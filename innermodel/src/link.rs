//! A node's place in the tree, and all of it that changes often.

use crate::Time;
use crate::transform::Transform;
use innermodel_language::model::{Kind, Pose};
use std::collections::BTreeMap;
use std::sync::Arc;

/// No node.
pub(crate) const NONE: u32 = u32::MAX;
/// The place of the root.
pub(crate) const TOP: u32 = 0;

/// A node, for as long as it is in the model. After the node was removed, the id names no node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeId {
    pub(crate) index: u32,
    pub(crate) generation: u32,
}

impl NodeId {
    /// The node above all others.
    pub const ROOT: Self = Self {
        index: TOP,
        generation: 0,
    };
}

#[derive(Clone, Debug)]
pub(crate) struct Link {
    /// Takes coordinates in this node to those in its parent.
    pub(crate) local: Transform,
    /// Where the node is before its joint moves.
    pub(crate) pose: Pose,
    /// The angle or the position of a joint.
    pub(crate) position: f64,
    /// The version that set `local` or `parent`, and its time.
    pub(crate) version: u64,
    pub(crate) time: Time,
    /// How often a node came to this place or left it: odd while the place is free, so the id of a
    /// node never fits a free place.
    pub(crate) generation: u32,
    /// In a free place, the next free one.
    pub(crate) parent: u32,
    pub(crate) first: u32,
    pub(crate) last: u32,
    pub(crate) next: u32,
    pub(crate) previous: u32,
}

impl Link {
    pub(crate) fn new(kind: &Kind, pose: Pose, position: f64) -> Self {
        Self {
            local: local(kind, &pose, position),
            pose,
            position,
            version: 1,
            time: Time::ZERO,
            generation: 0,
            parent: NONE,
            first: NONE,
            last: NONE,
            next: NONE,
            previous: NONE,
        }
    }
}

/// The motion that a joint adds to its pose.
pub(crate) fn motion(kind: &Kind, position: f64) -> Transform {
    match kind {
        Kind::Joint(joint) if position != 0.0 => Transform::about(joint.axis, position),
        Kind::Prismatic(joint) => {
            let mut by = [0.0; 3];
            by[joint.axis.index()] = position + joint.offset;
            Transform::translation(by.into())
        }
        _ => Transform::identity(),
    }
}

/// Takes coordinates in a node to those in its parent.
pub(crate) fn local(kind: &Kind, pose: &Pose, position: f64) -> Transform {
    match kind {
        Kind::Joint(_) if position != 0.0 => Transform::of(pose) * motion(kind, position),
        Kind::Prismatic(_) => motion(kind, position),
        _ => Transform::of(pose),
    }
}

/// The rest of a node.
#[derive(Clone, Debug)]
pub(crate) struct Data {
    pub(crate) id: Arc<str>,
    pub(crate) kind: Arc<Kind>,
    pub(crate) allowed: Arc<[String]>,
    pub(crate) attributes: BTreeMap<String, (String, String)>,
}
