//! The values of models in ILK: poses, velocities and Jacobians.

use rc_quantity::rotation::{cross, turned};
use rc_quantity::{Real, Transform};
use std::collections::BTreeMap;

/// A number of the joint that moves, and whether it turns.
#[derive(Clone, Copy)]
pub(super) struct Joint {
    pub(super) coordinate: usize,
    pub(super) turns: bool,
}

/// An angular and a linear velocity of a frame, along its own axes.
pub(super) type Twist<T> = [[T; 3]; 2];

/// The values that are known so far, by their names.
pub(super) struct Known<T> {
    pub(super) poses: BTreeMap<String, Transform<T>>,
    pub(super) twists: BTreeMap<String, Twist<T>>,
    /// The origin of the frame, and six numbers for each column.
    pub(super) jacobians: BTreeMap<String, ([T; 3], Vec<[T; 6]>)>,
}

/// The frame that a joint moves, in that of the joint: about or along z.
pub(super) fn moved<T: Real>(joint: Joint, position: T) -> Transform<T> {
    let mut pose: Transform<T> = Transform::IDENTITY.constant();
    if joint.turns {
        let (sine, cosine) = (position.sine(), position.cosine());
        pose.rotation[0][0] = cosine;
        pose.rotation[0][1] = -sine;
        pose.rotation[1][0] = sine;
        pose.rotation[1][1] = cosine;
    } else {
        pose.translation[2] = position;
    }
    pose
}

/// A velocity along the axes of another frame, of the point at its origin. `frame` is where the own one is in it.
pub(super) fn seen<T: Real>(frame: &Transform<T>, [angular, linear]: Twist<T>) -> Twist<T> {
    let angular = turned(&frame.rotation, angular);
    let linear = turned(&frame.rotation, linear);
    let swing = cross(frame.translation, angular);
    let linear = std::array::from_fn(|part| linear[part] + swing[part]);
    [angular, linear]
}
