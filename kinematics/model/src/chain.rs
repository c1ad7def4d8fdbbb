//! The motion of one frame in another one: the chain of joints between them.

use crate::robot::{Joint, Motion, Robot, State};
use crate::vectors::{about, dot, scaled, sum, vector};
use rc_quantity::Real;
use rc_quantity::Transform;
use rc_quantity::rotation::{cross, product, turned};

/// The steps from one frame to another one, over the joints between them.
#[derive(Clone, Debug)]
pub struct Chain<'r> {
    steps: Vec<Step<'r>>,
}

#[derive(Clone, Copy, Debug)]
struct Step<'r> {
    joint: &'r Joint,
    /// From the moved body to the one that the joint is fixed to.
    is_back: bool,
}

/// A frame that moves, seen from the frame where its chain begins. All vectors are in that frame.
#[derive(Clone, Debug)]
pub struct Moved<T> {
    /// Where it is.
    pub pose: Transform<T>,
    /// The angular velocity, in rad/s.
    pub angular_velocity: [T; 3],
    /// The velocity of its origin, in m/s.
    pub linear_velocity: [T; 3],
    /// The angular acceleration, in rad/s².
    pub angular_acceleration: [T; 3],
    /// The acceleration of its origin, in m/s².
    pub linear_acceleration: [T; 3],
    /// The geometric Jacobian, by coordinates.
    pub jacobian: Vec<Column<T>>,
}

/// The motion of the frame while one coordinate moves by one unit a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column<T> {
    /// The velocity of the origin.
    pub linear: [T; 3],
    /// The angular velocity.
    pub angular: [T; 3],
}

impl Robot {
    /// The chain from the body at place `base` to the one at place `tip`. `None` if no joint connects
    /// their trees.
    pub fn chain(&self, base: usize, tip: usize) -> Option<Chain<'_>> {
        if self.root(base) != self.root(tip) {
            return None;
        }
        let (up, down) = (self.ancestry(base), self.ancestry(tip));
        // The joints above the last common body are on both ways.
        let common = up.iter().rev().zip(down.iter().rev());
        let common = common
            .take_while(|(one, other)| std::ptr::eq(**one, **other))
            .count();
        let back = up.iter().take(up.len() - common).map(|joint| Step {
            joint,
            is_back: true,
        });
        let on = down
            .iter()
            .take(down.len() - common)
            .rev()
            .map(|joint| Step {
                joint,
                is_back: false,
            });
        Some(Chain {
            steps: back.chain(on).collect(),
        })
    }

    /// The root of the tree of a body.
    pub fn root(&self, body: usize) -> usize {
        let above = |at: &usize| Some(self.bodies.get(*at)?.joint.as_ref()?.parent);
        std::iter::successors(Some(body), above)
            .last()
            .unwrap_or(body)
    }

    /// The joints from a body up to its root.
    fn ancestry(&self, body: usize) -> Vec<&Joint> {
        let mut joints = Vec::new();
        let mut at = self.bodies.get(body);
        while let Some(joint) = at.and_then(|body| body.joint.as_ref()) {
            joints.push(joint);
            at = self.bodies.get(joint.parent);
        }
        joints
    }
}

impl Chain<'_> {
    /// How many joints it leads over.
    #[expect(clippy::len_without_is_empty, reason = "an empty chain is one")]
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Its joints, from its base on.
    pub(crate) fn joints(&self) -> impl Iterator<Item = &Joint> {
        self.steps.iter().map(|step| step.joint)
    }

    /// The coordinates of its joints, in their order in the robot.
    pub fn coordinates(&self) -> Vec<usize> {
        let driven = |step: &Step<'_>| Some(step.joint.motion.driven()?.0);
        let mut all: Vec<usize> = self.steps.iter().filter_map(driven).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// How far its end is from its base at most. `far` says how far a coordinate goes from 0.
    pub fn reach(&self, far: impl Fn(usize) -> f64) -> f64 {
        let of = |step: &Step<'_>| {
            let Joint { place, motion, .. } = step.joint;
            let slide = match *motion {
                Motion::Slides {
                    coordinate,
                    ratio,
                    offset,
                } => (ratio * far(coordinate)).abs() + offset.abs(),
                Motion::Turns { .. } | Motion::Fixed => 0.0,
            };
            dot(place.translation, place.translation).sqrt() + slide
        };
        self.steps.iter().map(of).sum()
    }

    /// The motion of the frame at its end.
    pub fn moved<T: Real>(&self, state: &State<T>) -> Moved<T> {
        let zero = vector([0.0; 3]);
        let mut at = Moved {
            pose: Transform::IDENTITY.constant(),
            angular_velocity: zero,
            linear_velocity: zero,
            angular_acceleration: zero,
            linear_acceleration: zero,
            jacobian: Vec::new(),
        };
        // For each moving joint: the coordinate and factor, the axis, a point of it, whether it
        // turns.
        let mut axes = Vec::new();
        for step in &self.steps {
            let joint = step.joint;
            let sense = if step.is_back { -1.0 } else { 1.0 };
            if !step.is_back {
                at.shift(&joint.place);
            }
            if let Some((coordinate, ratio)) = joint.motion.driven() {
                let rates = joint.motion.of(state).map(|rate| rate * T::constant(sense));
                let axis = turned(&at.pose.rotation, vector(joint.axis));
                let turns = matches!(joint.motion, Motion::Turns { .. });
                axes.push((coordinate, ratio * sense, axis, at.pose.translation, turns));
                if turns {
                    at.turn(joint.axis, axis, rates);
                } else {
                    at.slide(axis, rates);
                }
            }
            if step.is_back {
                at.shift(&joint.place.inverse());
            }
        }
        let nothing = Column {
            linear: zero,
            angular: zero,
        };
        at.jacobian = vec![nothing; state.positions.len()];
        for (coordinate, factor, axis, point, turns) in axes {
            let Some(column) = at.jacobian.get_mut(coordinate) else {
                continue;
            };
            let axis = scaled(axis, T::constant(factor));
            if turns {
                let arm = sum(at.pose.translation, point.map(|part| -part));
                column.linear = sum(column.linear, cross(axis, arm));
                column.angular = sum(column.angular, axis);
            } else {
                column.linear = sum(column.linear, axis);
            }
        }
        at
    }
}

impl<T: Real> Moved<T> {
    /// Goes on to a frame that is fixed in this one.
    fn shift(&mut self, place: &Transform) {
        let place = place.constant();
        let arm = turned(&self.pose.rotation, place.translation);
        self.carry(arm);
        self.pose = self.pose.then(&place);
    }

    /// The velocity and acceleration of a point at the end of an arm that turns with the frame.
    fn carry(&mut self, arm: [T; 3]) {
        let swing = cross(self.angular_velocity, arm);
        self.linear_velocity = sum(self.linear_velocity, swing);
        let towards = cross(self.angular_velocity, swing);
        let along = cross(self.angular_acceleration, arm);
        self.linear_acceleration = sum(self.linear_acceleration, sum(along, towards));
    }

    fn turn(&mut self, own: [f64; 3], axis: [T; 3], [angle, speed, acceleration]: [T; 3]) {
        let spin = scaled(axis, speed);
        let turning = cross(self.angular_velocity, spin);
        let faster = sum(scaled(axis, acceleration), turning);
        self.angular_acceleration = sum(self.angular_acceleration, faster);
        self.angular_velocity = sum(self.angular_velocity, spin);
        self.pose.rotation = product(&self.pose.rotation, &about(own, angle));
    }

    fn slide(&mut self, axis: [T; 3], [way, speed, acceleration]: [T; 3]) {
        let arm = scaled(axis, way);
        self.carry(arm);
        self.pose.translation = sum(self.pose.translation, arm);
        let spin = scaled(axis, speed);
        self.linear_velocity = sum(self.linear_velocity, spin);
        // The Coriolis acceleration: 2 ω × v.
        let turning = scaled(cross(self.angular_velocity, spin), T::constant(2.0));
        let faster = sum(scaled(axis, acceleration), turning);
        self.linear_acceleration = sum(self.linear_acceleration, faster);
    }
}
