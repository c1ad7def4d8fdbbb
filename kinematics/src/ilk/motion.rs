//! The values of models in ILK: poses, velocities and Jacobians.

use rc_quantity::rotation::{cross, turned};
use rc_quantity::{Real, Transform};
use std::collections::BTreeMap;

/// A joint, with the place of its number.
#[derive(Clone, Copy)]
pub(super) enum Joint {
    /// It turns about z.
    Turns(usize),
    /// It slides along z.
    Slides(usize),
    /// It moves nothing.
    Fixed,
}

impl Joint {
    /// The place of its number.
    pub(super) fn coordinate(self) -> Option<usize> {
        match self {
            Self::Turns(at) | Self::Slides(at) => Some(at),
            Self::Fixed => None,
        }
    }

    /// What it gives the frame that it moves, for the rates of all joints.
    pub(super) fn twist<T: Real>(self, rates: &[T], sign: f64) -> Twist<T> {
        let mut twist = [[T::constant(0.0); 3]; 2];
        match self {
            Self::Turns(at) => twist[0][2] = rates[at] * T::constant(sign),
            Self::Slides(at) => twist[1][2] = rates[at] * T::constant(sign),
            Self::Fixed => {}
        }
        twist
    }
}

/// An angular and a linear velocity of a frame, along its own axes; or the rate of one.
pub(super) type Twist<T> = [[T; 3]; 2];

/// The rate of a velocity seen from the base, and that velocity. It is a spatial acceleration (R. Featherstone, Rigid Body
/// Dynamics Algorithms, 2008, 2.11): the linear part is the acceleration of the origin less ω × v.
#[derive(Clone, Copy)]
pub(super) struct Acceleration<T> {
    pub(super) rate: Twist<T>,
    pub(super) velocity: Twist<T>,
}

/// The values that are known so far, by their names.
pub(super) struct Known<T> {
    pub(super) poses: BTreeMap<String, Transform<T>>,
    pub(super) twists: BTreeMap<String, Twist<T>>,
    pub(super) accelerations: BTreeMap<String, Acceleration<T>>,
    /// The origin of the frame, and six numbers for each column.
    pub(super) jacobians: BTreeMap<String, ([T; 3], Vec<[T; 6]>)>,
}

/// The frame that a joint moves, in that of the joint: about or along z.
pub(super) fn moved<T: Real>(joint: Joint, positions: &[T]) -> Transform<T> {
    let mut pose: Transform<T> = Transform::IDENTITY.constant();
    match joint {
        Joint::Turns(at) => {
            let (sine, cosine) = (positions[at].sine(), positions[at].cosine());
            pose.rotation[0][0] = cosine;
            pose.rotation[0][1] = -sine;
            pose.rotation[1][0] = sine;
            pose.rotation[1][1] = cosine;
        }
        Joint::Slides(at) => pose.translation[2] = positions[at],
        Joint::Fixed => {}
    }
    pose
}

/// The sum of two vectors of motion.
pub(super) fn added<T: Real>(one: Twist<T>, other: Twist<T>) -> Twist<T> {
    std::array::from_fn(|part| std::array::from_fn(|axis| one[part][axis] + other[part][axis]))
}

/// The rate of a vector that stands still in a frame with this velocity (the same book, 2.9).
pub(super) fn crossed<T: Real>([spin, speed]: Twist<T>, [angular, linear]: Twist<T>) -> Twist<T> {
    let (turning, sliding) = (cross(spin, linear), cross(speed, angular));
    let linear = std::array::from_fn(|axis| turning[axis] + sliding[axis]);
    [cross(spin, angular), linear]
}

/// A velocity along the axes of another frame, of the point at its origin. `frame` is where the own one is in it.
pub(super) fn seen<T: Real>(frame: &Transform<T>, [angular, linear]: Twist<T>) -> Twist<T> {
    let angular = turned(&frame.rotation, angular);
    let linear = turned(&frame.rotation, linear);
    let swing = cross(frame.translation, angular);
    let linear = std::array::from_fn(|part| linear[part] + swing[part]);
    [angular, linear]
}
