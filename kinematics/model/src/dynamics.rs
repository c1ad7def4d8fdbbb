//! The dynamics of a robot: the recursive Newton–Euler algorithm and the composite rigid body
//! algorithm (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5 and 6), with
//! vectors in the frames of the bodies.

use crate::robot::{Inertia, Motion, Robot, State};
use crate::vectors::{about, dot, matrix, scaled, sum, vector};
use rc_quantity::Real;
use rc_quantity::Transform;
use rc_quantity::rotation::{Matrix, cross, product, transposed, turned};

/// Where each body is in the frame of the body that its joint is fixed to.
fn places<T: Real>(robot: &Robot, state: &State<T>) -> Vec<Transform<T>> {
    let bodies = robot.bodies.iter();
    bodies
        .map(|body| {
            let Some(joint) = &body.joint else {
                return Transform::IDENTITY.constant();
            };
            let [position, ..] = joint.motion.of(state);
            let place = joint.place.constant();
            match joint.motion {
                Motion::Turns { .. } => Transform {
                    rotation: product(&place.rotation, &about(joint.axis, position)),
                    ..place
                },
                Motion::Slides { .. } => place.then(&Transform {
                    translation: scaled(vector(joint.axis), position),
                    ..Transform::IDENTITY.constant()
                }),
                Motion::Fixed => place,
            }
        })
        .collect()
}

/// A mass that is known only when the robot moves, such as a grasped part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load<T> {
    /// The place of the body that carries it.
    pub body: usize,
    /// In kg.
    pub mass: T,
    /// The centre of mass, in the frame of the body.
    pub centre: [T; 3],
    /// About the centre of mass, along the axes of the frame of the body, in kg m².
    pub tensor: Matrix<T>,
}

impl<T: Real> Load<T> {
    /// The mass of a body itself.
    fn own(body: usize, inertia: &Inertia) -> Self {
        Self {
            body,
            mass: T::constant(inertia.mass),
            centre: vector(inertia.centre),
            tensor: matrix(&inertia.tensor),
        }
    }
}

/// The efforts that the coordinates need for their accelerations: torques in Nm of those that turn,
/// forces in N of those that slide. `gravity` is in m/s², in the frame of each root, which stands still.
pub fn efforts<T: Real>(
    robot: &Robot,
    state: &State<T>,
    gravity: [f64; 3],
    loads: &[Load<T>],
) -> Vec<T> {
    struct Body<T> {
        spin: [T; 3],
        spin_rate: [T; 3],
        acceleration: [T; 3],
        force: [T; 3],
        torque: [T; 3],
    }
    let zero: [T; 3] = vector([0.0; 3]);
    let places = places(robot, state);
    let mut bodies: Vec<Body<T>> = Vec::with_capacity(places.len());
    for (body, place) in robot.bodies.iter().zip(&places) {
        let mut moved = Body {
            spin: zero,
            spin_rate: zero,
            // A body at rest under gravity needs the forces of one that is thrown up.
            acceleration: vector(gravity.map(|part| -part)),
            force: zero,
            torque: zero,
        };
        if let Some((joint, parent)) = body
            .joint
            .as_ref()
            .and_then(|joint| Some((joint, bodies.get(joint.parent)?)))
        {
            let inward = transposed(&place.rotation);
            let arm = place.translation;
            let swing = cross(parent.spin, cross(parent.spin, arm));
            let carried = sum(cross(parent.spin_rate, arm), swing);
            moved.spin = turned(&inward, parent.spin);
            moved.spin_rate = turned(&inward, parent.spin_rate);
            moved.acceleration = turned(&inward, sum(parent.acceleration, carried));
            let [_, speed, rate] = joint.motion.of(state);
            let axis = vector(joint.axis);
            let own = scaled(axis, speed);
            match joint.motion {
                Motion::Turns { .. } => {
                    let turning = cross(moved.spin, own);
                    moved.spin_rate = sum(moved.spin_rate, sum(turning, scaled(axis, rate)));
                    moved.spin = sum(moved.spin, own);
                }
                Motion::Slides { .. } => {
                    let turning = scaled(cross(moved.spin, own), T::constant(2.0));
                    let faster = sum(turning, scaled(axis, rate));
                    moved.acceleration = sum(moved.acceleration, faster);
                }
                Motion::Fixed => {}
            }
        }
        let at = bodies.len();
        let own = body.inertia.as_ref().map(|inertia| Load::own(at, inertia));
        let carried = loads.iter().filter(|load| load.body == at);
        for load in own.iter().chain(carried) {
            let centre = load.centre;
            let swing = cross(moved.spin, cross(moved.spin, centre));
            let carried = sum(cross(moved.spin_rate, centre), swing);
            let acceleration = sum(moved.acceleration, carried);
            let force = scaled(acceleration, load.mass);
            moved.force = sum(moved.force, force);
            let momentum = turned(&load.tensor, moved.spin);
            let own = sum(
                turned(&load.tensor, moved.spin_rate),
                cross(moved.spin, momentum),
            );
            moved.torque = sum(moved.torque, sum(own, cross(centre, force)));
        }
        bodies.push(moved);
    }
    let mut efforts = vec![T::constant(0.0); state.positions.len()];
    for (at, body) in robot.bodies.iter().enumerate().rev() {
        let Some(joint) = &body.joint else { continue };
        let (force, torque) = (bodies[at].force, bodies[at].torque);
        if let Some((coordinate, ratio)) = joint.motion.driven()
            && let Some(effort) = efforts.get_mut(coordinate)
        {
            let turns = matches!(joint.motion, Motion::Turns { .. });
            let along = if turns { torque } else { force };
            *effort = *effort + dot(vector(joint.axis), along) * T::constant(ratio);
        }
        let place = &places[at];
        let force = turned(&place.rotation, force);
        let torque = turned(&place.rotation, torque);
        if let Some(parent) = bodies.get_mut(joint.parent) {
            parent.force = sum(parent.force, force);
            let lever = cross(place.translation, force);
            parent.torque = sum(parent.torque, sum(torque, lever));
        }
    }
    efforts
}

/// The mass of several bodies that hold together, seen from the origin of a frame.
#[derive(Clone, Copy)]
struct Composite<T> {
    mass: T,
    /// The mass times the centre of mass.
    moment: [T; 3],
    /// About the origin.
    tensor: Matrix<T>,
}

/// `mass (|d|² 1 - d dᵀ)`, the contribution of a mass at `d` to the tensor about the origin, times
/// the mass.
fn of_points<T: Real>(a: [T; 3], b: [T; 3]) -> Matrix<T> {
    let along = dot(a, b);
    let mut out = [[T::constant(0.0); 3]; 3];
    for (row, parts) in out.iter_mut().enumerate() {
        for (column, part) in parts.iter_mut().enumerate() {
            let diagonal = if row == column {
                along
            } else {
                T::constant(0.0)
            };
            *part = diagonal - a[column] * b[row];
        }
    }
    out
}

fn added<T: Real>(a: &Matrix<T>, b: &Matrix<T>) -> Matrix<T> {
    [sum(a[0], b[0]), sum(a[1], b[1]), sum(a[2], b[2])]
}

impl<T: Real> Composite<T> {
    const fn nothing(zero: T) -> Self {
        Self {
            mass: zero,
            moment: [zero; 3],
            tensor: [[zero; 3]; 3],
        }
    }

    fn of(load: &Load<T>) -> Self {
        let moment = scaled(load.centre, load.mass);
        let steiner = of_points(load.centre, moment);
        Self {
            mass: load.mass,
            moment,
            tensor: added(&load.tensor, &steiner),
        }
    }

    /// This mass, seen from the frame in which its own one is at `place`.
    fn seen(&self, place: &Transform<T>) -> Self {
        let turn = &place.rotation;
        let moment = turned(turn, self.moment);
        let arm = place.translation;
        let shifted = scaled(arm, self.mass);
        let tensor = product(&product(turn, &self.tensor), &transposed(turn));
        // (c + d)² = c² + c d + d c + d²
        let mixed = added(&of_points(arm, moment), &of_points(moment, arm));
        let tensor = added(&tensor, &added(&mixed, &of_points(arm, shifted)));
        Self {
            mass: self.mass,
            moment: sum(moment, shifted),
            tensor,
        }
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            moment: sum(self.moment, other.moment),
            tensor: added(&self.tensor, &other.tensor),
        }
    }
}

/// The mass matrix by rows: the efforts for an acceleration of 1 of each coordinate alone, at rest and
/// without gravity. It is symmetric.
pub fn mass_matrix<T: Real>(robot: &Robot, state: &State<T>, loads: &[Load<T>]) -> Vec<Vec<T>> {
    let places = places(robot, state);
    let nothing = Composite::nothing(T::constant(0.0));
    let mut composites = vec![nothing; robot.bodies.len()];
    for (at, body) in robot.bodies.iter().enumerate() {
        if let Some(inertia) = &body.inertia {
            composites[at] = Composite::of(&Load::own(at, inertia));
        }
    }
    for load in loads {
        if let Some(body) = composites.get_mut(load.body) {
            *body = body.with(&Composite::of(load));
        }
    }
    let size = state.positions.len();
    let mut rows = vec![vec![T::constant(0.0); size]; size];
    for at in (0..robot.bodies.len()).rev() {
        let Some(joint) = &robot.bodies[at].joint else {
            continue;
        };
        let held = composites[at];
        let below = held.seen(&places[at]);
        if let Some(parent) = composites.get_mut(joint.parent) {
            *parent = parent.with(&below);
        }
        let Some((own, factor)) = joint.motion.driven() else {
            continue;
        };
        let axis = vector(joint.axis);
        // Force and torque that move all that the joint carries, in the frame of its body.
        let (mut force, mut torque) = match joint.motion {
            Motion::Turns { .. } => (cross(axis, held.moment), turned(&held.tensor, axis)),
            Motion::Slides { .. } | Motion::Fixed => {
                (scaled(axis, held.mass), cross(held.moment, axis))
            }
        };
        let mut body = at;
        while let Some(above) = &robot.bodies[body].joint {
            if let Some((other, ratio)) = above.motion.driven() {
                let turns = matches!(above.motion, Motion::Turns { .. });
                let along = if turns { torque } else { force };
                let value = dot(vector(above.axis), along) * T::constant(ratio * factor);
                let cell = &mut rows[own][other];
                *cell = *cell + value;
                // A pair of joints is in both halves of the matrix, and twice in the cell of one
                // coordinate; a joint with itself is there once.
                if body != at {
                    let cell = &mut rows[other][own];
                    *cell = *cell + value;
                }
            }
            let place = &places[body];
            force = turned(&place.rotation, force);
            torque = sum(
                turned(&place.rotation, torque),
                cross(place.translation, force),
            );
            body = above.parent;
        }
    }
    rows
}

/// A robot that moves under efforts.
#[derive(Clone, Copy, Debug)]
pub struct Motions<'a, T> {
    /// Its positions and velocities. The accelerations are not used.
    pub state: &'a State<T>,
    /// The effort of each coordinate.
    pub efforts: &'a [T],
    /// In m/s², in the frame of each root.
    pub gravity: [f64; 3],
}

/// The factors of a mass matrix, which keep the zeros of the tree (Featherstone, chapter 6.5).
pub(crate) struct Equation<T> {
    rows: Vec<Vec<T>>,
    /// The coordinates from the leaves to the roots.
    order: Vec<usize>,
}

/// The equation of motion, and the efforts that are left for accelerations.
pub(crate) fn equation<T: Real>(
    robot: &Robot,
    motions: &Motions<'_, T>,
    loads: &[Load<T>],
) -> (Equation<T>, Vec<T>) {
    let still = State {
        accelerations: vec![T::constant(0.0); motions.efforts.len()],
        ..motions.state.clone()
    };
    let bias = self::efforts(robot, &still, motions.gravity, loads);
    let mut rows = mass_matrix(robot, &still, loads);
    let left = motions.efforts.iter().zip(&bias).map(|(a, b)| *a - *b);
    let left = left.collect();
    let order = from_leaves(robot);
    // Rows of leaves first: what is left is the matrix of the others.
    for (step, at) in order.iter().enumerate() {
        let rest = &order[step + 1..];
        for (first, other) in rest.iter().enumerate() {
            let factor = rows[*at][*other] / rows[*at][*at];
            for column in &rest[first..] {
                let part = rows[*other][*column] - factor * rows[*at][*column];
                rows[*other][*column] = part;
                rows[*column][*other] = part;
            }
        }
    }
    (Equation { rows, order }, left)
}

impl<T: Real> Equation<T> {
    /// The accelerations for these efforts.
    pub(crate) fn solved(&self, mut right: Vec<T>) -> Vec<T> {
        let Self { rows, order } = self;
        for (step, at) in order.iter().enumerate() {
            for other in &order[step + 1..] {
                let factor = rows[*at][*other] / rows[*at][*at];
                right[*other] = right[*other] - factor * right[*at];
            }
        }
        for (step, at) in order.iter().enumerate().rev() {
            for other in &order[step + 1..] {
                right[*at] = right[*at] - rows[*at][*other] * right[*other];
            }
            right[*at] = right[*at] / rows[*at][*at];
        }
        right
    }
}

/// The accelerations of the coordinates.
pub fn accelerations<T: Real>(
    robot: &Robot,
    motions: &Motions<'_, T>,
    loads: &[Load<T>],
) -> Vec<T> {
    let (equation, left) = equation(robot, motions, loads);
    equation.solved(left)
}

/// The coordinates, those of the last bodies first.
fn from_leaves(robot: &Robot) -> Vec<usize> {
    let mut order = Vec::with_capacity(robot.coordinates.len());
    for body in &robot.bodies {
        let driven = body.joint.as_ref().and_then(|joint| joint.motion.driven());
        if let Some((coordinate, _)) = driven
            && !order.contains(&coordinate)
        {
            order.push(coordinate);
        }
    }
    order.reverse();
    order
}

/// Positions that no file favours.
pub(crate) fn unfavoured(robot: &Robot) -> Vec<f64> {
    let mut position = 0.3;
    let positions = robot.coordinates.iter().map(|_| {
        position = (position * 7.3 + 0.61) % 1.7;
        position
    });
    positions.collect()
}

/// The first coordinate that moves no mass: no acceleration follows from its effort.
pub fn weightless(robot: &Robot) -> Option<usize> {
    let state = State::still(unfavoured(robot));
    let mut rows = mass_matrix(robot, &state, &[]);
    let own: Vec<f64> = rows.iter().enumerate().map(|(at, row)| row[at]).collect();
    let order = from_leaves(robot);
    for (step, at) in order.iter().enumerate() {
        let pivot = rows[*at][*at];
        if pivot <= 1e-12 * own[*at] || pivot <= 1e-300 {
            return Some(*at);
        }
        for other in &order[step + 1..] {
            let factor = rows[*at][*other] / pivot;
            for column in &order[step + 1..] {
                rows[*other][*column] -= factor * rows[*at][*column];
            }
        }
    }
    None
}
