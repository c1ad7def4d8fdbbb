//! The model of a robot.

use rc_quantity::Real;
use rc_quantity::Transform;
use rc_quantity::rotation::Matrix;

/// A robot, or several ones: bodies that joints connect to trees.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Robot {
    /// Its name.
    pub name: String,
    /// A body comes after the one that its joint is fixed to. The first one is a root.
    pub bodies: Vec<Body>,
    /// The joints that move on their own, in the order of the file. Each has a coordinate: a place in
    /// the positions, velocities and accelerations of a [`State`]. A joint of several coordinates is a
    /// chain of joints: `NAME.x` and others.
    pub coordinates: Vec<String>,
    /// The joints that the trees are without: each closes a loop.
    pub loops: Vec<LoopJoint>,
    /// The motors behind joints.
    pub transmissions: Vec<Transmission>,
}

/// A joint that closes a loop. It has no coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopJoint {
    /// Its name.
    pub name: String,
    /// The bodies whose frames it keeps together.
    pub frames: [usize; 2],
    /// What of them stays together.
    pub kept: Kept,
}

/// What of two frames stays together. Axes have length 1, and are those of both frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kept {
    /// Both are one.
    Whole,
    /// Their origins, as in a spherical joint.
    Point,
    /// Their origins and this axis, as in a joint that turns.
    Turning([f64; 3]),
    /// Their axes and this line through their origins, as in a joint that slides.
    Sliding([f64; 3]),
}

/// A motor behind a joint. The position of the joint is that of the motor divided by `reduction`, plus `offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission {
    /// Its name.
    pub name: String,
    /// The name of the motor.
    pub actuator: String,
    /// The place of the coordinate of the joint.
    pub coordinate: usize,
    /// Never 0. Of a joint that slides, in rad/m or as the motor counts.
    pub reduction: f64,
    /// In radians or metres.
    pub offset: f64,
}

/// A rigid body, with the joint that moves it.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// The name of the link. It is empty for a body inside a joint of several coordinates.
    pub name: String,
    /// Its mass, if the file says it.
    pub inertia: Option<Inertia>,
    /// The joint; a root has none.
    pub joint: Option<Joint>,
}

/// How mass is distributed in a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia {
    /// In kg.
    pub mass: f64,
    /// The centre of mass, in the frame of the body.
    pub centre: [f64; 3],
    /// About the centre of mass, along the axes of the frame of the body, in kg m².
    pub tensor: Matrix,
}

/// A joint, which moves a body in another one.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// The place of the body that it is fixed to.
    pub parent: usize,
    /// Where the frame of the moved body is in that of the parent while the joint is at 0.
    pub place: Transform,
    /// Its motion.
    pub motion: Motion,
    /// The axis in the frame of the moved body, of length 1.
    pub axis: [f64; 3],
    /// Its limits, if the file has them.
    pub limits: Option<Limits>,
}

/// The motion of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Not at all.
    Fixed,
    /// It turns about its axis by `ratio` times a coordinate and `offset`.
    Turns {
        /// The place of the coordinate.
        coordinate: usize,
        /// 1 for a joint that follows no other one.
        ratio: f64,
        /// In radians.
        offset: f64,
    },
    /// It slides along its axis by `ratio` times a coordinate and `offset`.
    Slides {
        /// The place of the coordinate.
        coordinate: usize,
        /// 1 for a joint that follows no other one.
        ratio: f64,
        /// In metres.
        offset: f64,
    },
}

/// The limits of a joint, in radians or metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The least position. It is infinite for a joint without an end.
    pub lower: f64,
    /// The greatest position.
    pub upper: f64,
    /// The greatest speed; 0 where the file says nothing.
    pub velocity: f64,
    /// The greatest torque in Nm or force in N; 0 where the file says nothing.
    pub effort: f64,
}

/// Positions, velocities and accelerations, one each for each coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct State<T = f64> {
    /// In radians or metres.
    pub positions: Vec<T>,
    /// A second.
    pub velocities: Vec<T>,
    /// A second, twice.
    pub accelerations: Vec<T>,
}

impl Robot {
    /// The place of a body.
    pub fn body(&self, name: &str) -> Option<usize> {
        self.links()
            .find(|(_, link)| *link == name)
            .map(|(at, _)| at)
    }

    /// The bodies that are links, by their places and names.
    pub fn links(&self) -> impl Iterator<Item = (usize, &str)> {
        let bodies = self.bodies.iter().map(|body| body.name.as_str());
        bodies.enumerate().filter(|(_, name)| !name.is_empty())
    }

    /// Whether a coordinate is a length.
    pub fn slides(&self, coordinate: usize) -> bool {
        let joints = self.bodies.iter().filter_map(|body| body.joint.as_ref());
        let name = self.coordinates.get(coordinate);
        let mut own = joints.filter(|joint| Some(&joint.name) == name);
        own.any(|joint| matches!(joint.motion, Motion::Slides { .. }))
    }

    /// The limits of each coordinate, of the joint that it moves directly.
    pub fn limits(&self) -> Vec<Option<Limits>> {
        let mut limits = vec![None; self.coordinates.len()];
        for joint in self.bodies.iter().filter_map(|body| body.joint.as_ref()) {
            let coordinate = joint.motion.driven().map(|(coordinate, _)| coordinate);
            let own = coordinate.filter(|at| self.coordinates.get(*at) == Some(&joint.name));
            if let Some(at) = own {
                limits[at] = joint.limits;
            }
        }
        limits
    }
}

impl<T: Real> State<T> {
    /// A robot that stands still in this position.
    pub fn still(positions: Vec<T>) -> Self {
        let zeros = vec![T::constant(0.0); positions.len()];
        Self {
            positions,
            velocities: zeros.clone(),
            accelerations: zeros,
        }
    }
}

impl Motion {
    /// The coordinate that moves the joint, and by which factor.
    pub fn driven(&self) -> Option<(usize, f64)> {
        match *self {
            Self::Turns {
                coordinate, ratio, ..
            }
            | Self::Slides {
                coordinate, ratio, ..
            } => Some((coordinate, ratio)),
            Self::Fixed => None,
        }
    }

    /// Position, velocity and acceleration of the joint; 0 for one that does not move.
    pub(crate) fn of<T: Real>(&self, state: &State<T>) -> [T; 3] {
        let zero = T::constant(0.0);
        let (coordinate, ratio, offset) = match *self {
            Self::Turns {
                coordinate,
                ratio,
                offset,
            }
            | Self::Slides {
                coordinate,
                ratio,
                offset,
            } => (coordinate, T::constant(ratio), T::constant(offset)),
            Self::Fixed => return [zero; 3],
        };
        let at = |all: &[T]| all.get(coordinate).copied().unwrap_or(zero) * ratio;
        [
            at(&state.positions) + offset,
            at(&state.velocities),
            at(&state.accelerations),
        ]
    }
}
