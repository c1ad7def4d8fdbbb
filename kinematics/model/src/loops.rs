//! Loops: frames of two links that stay together, though no joint of the tree holds them.
//!
//! The rows of a loop are the way from the first frame to the second one along the axes of the first one, in m,
//! then the turn. A loop that a joint closes has no row along or about its axis, and rows for two directions across it. The forces that keep it closed solve the equation of motion with these rows as
//! constraints (R. Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 8).

use crate::chain::{Chain, Moved};
use crate::dynamics::{self, Load, Motions, equation};
use crate::mount;
use crate::robot::{Kept, Robot, State};
use crate::vectors::{self, scaled, sum, vector};
use rc_quantity::Real;
use rc_quantity::rotation::{Matrix, Quaternion, cross, turned};

/// How often closed positions are corrected.
const STEPS: usize = 4;

/// The share of the greatest stiffness that each direction has in addition: rows that depend on each other
/// have a solution.
const SOFT: f64 = 1e-13;

/// Two frames that stay together.
#[derive(Clone, Debug)]
pub struct Loop<'r> {
    /// From the first frame to the second one.
    pub chain: Chain<'r>,
    /// What of the frames stays together.
    pub kept: Kept,
}

/// How far the axis of the second frame leans from that of the first one: the normal of both times twice the sine of
/// half the angle, which is not 0 after half a turn.
fn lean<T: Real>(axis: [f64; 3], rotation: &Matrix<T>) -> [T; 3] {
    let axis = vector(axis);
    let other = turned(rotation, axis);
    let both = sum(axis, other);
    // Twice the cosine of half the angle. The constant keeps 0 from 0 / 0, and is small beside the rounding of half a turn.
    let size = (vectors::dot(both, both) + T::constant(1e-60)).root();
    scaled(cross(axis, other), T::constant(2.0) / size)
}

impl Loop<'_> {
    /// How many rows it has.
    pub fn rows(&self) -> usize {
        match self.kept {
            Kept::Whole => 6,
            Kept::Point => 3,
            Kept::Turning(_) | Kept::Sliding(_) => 5,
        }
    }

    fn of<T: Real>(&self, linear: [T; 3], angular: [T; 3]) -> Vec<T> {
        let over =
            |axis, all: [T; 3]| mount::across(axis).map(|own| vectors::dot(vector(own), all));
        match self.kept {
            Kept::Whole => [linear, angular].concat(),
            Kept::Point => linear.to_vec(),
            Kept::Turning(axis) => [&linear[..], &over(axis, angular)].concat(),
            Kept::Sliding(axis) => [&over(axis, linear)[..], &angular].concat(),
        }
    }

    fn error<T: Real>(&self, moved: &Moved<T>) -> Vec<T> {
        let rotation = &moved.pose.rotation;
        let turn = match self.kept {
            Kept::Turning(axis) => lean(axis, rotation),
            Kept::Point => [T::constant(0.0); 3],
            Kept::Whole | Kept::Sliding(_) => {
                // The axis times twice the sine of half the angle: it is not 0 after half a turn.
                let Quaternion { x, y, z, .. } = Quaternion::of_matrix(rotation);
                scaled([x, y, z], T::constant(2.0))
            }
        };
        self.of(moved.pose.translation, turn)
    }

    /// Its rows of the Jacobian.
    fn jacobian<T: Real>(&self, moved: &Moved<T>) -> Vec<Vec<T>> {
        let columns = moved.jacobian.iter();
        let columns: Vec<Vec<T>> = columns
            .map(|column| self.of(column.linear, column.angular))
            .collect();
        let rows = 0..self.rows();
        rows.map(|row| columns.iter().map(|column| column[row]).collect())
            .collect()
    }
}

fn moved<T: Real>(loops: &[Loop<'_>], state: &State<T>) -> Vec<Moved<T>> {
    let moved = loops.iter().map(|closed| closed.chain.moved(state));
    moved.collect()
}

/// How far the frames of all loops are from each other.
pub fn errors<T: Real>(loops: &[Loop<'_>], state: &State<T>) -> Vec<T> {
    let all = moved(loops, state);
    let errors = loops.iter().zip(&all);
    errors
        .flat_map(|(closed, moved)| closed.error(moved))
        .collect()
}

/// How the second frames of all loops move in the first ones with each coordinate, by rows. Where the loops are
/// closed, it is the change of their errors.
pub fn jacobian<T: Real>(loops: &[Loop<'_>], state: &State<T>) -> Vec<Vec<T>> {
    let all = moved(loops, state);
    let rows = loops.iter().zip(&all);
    rows.flat_map(|(closed, moved)| closed.jacobian(moved))
        .collect()
}

fn dot<T: Real>(one: &[T], other: &[T]) -> T {
    let zero = T::constant(0.0);
    one.iter()
        .zip(other)
        .fold(zero, |sum, (a, b)| sum + *a * *b)
}

/// Solves a symmetric system whose matrix has no negative eigenvalue, in place, by Cholesky's method without
/// roots.
fn solve<T: Real>(matrix: &mut [Vec<T>], vector: &mut [T]) {
    let size = vector.len();
    let zero = T::constant(0.0);
    let trace = (0..size).fold(zero, |sum, at| sum + matrix[at][at]);
    let soft = trace * T::constant(SOFT) + T::constant(1e-200);
    for (at, row) in matrix.iter_mut().enumerate() {
        row[at] = row[at] + soft;
    }
    for step in 0..size {
        let pivot = matrix[step].clone();
        for row in step + 1..size {
            let factor = pivot[row] / pivot[step];
            for (part, known) in matrix[row].iter_mut().zip(&pivot).skip(row) {
                *part = *part - factor * *known;
            }
            vector[row] = vector[row] - factor * vector[step];
        }
    }
    for row in (0..size).rev() {
        let known = (row + 1..size).fold(zero, |sum, at| sum + matrix[row][at] * vector[at]);
        vector[row] = (vector[row] - known) / matrix[row][row];
    }
}

/// The shortest change of the coordinates for a change of the rows.
fn shortest<T: Real>(jacobian: &[Vec<T>], mut change: Vec<T>) -> Vec<T> {
    let square = jacobian.iter();
    let mut square: Vec<Vec<T>> = square
        .map(|row| jacobian.iter().map(|other| dot(row, other)).collect())
        .collect();
    solve(&mut square, &mut change);
    across(jacobian, &change)
}

/// The product of the transposed Jacobian with a vector of its rows.
fn across<T: Real>(jacobian: &[Vec<T>], vector: &[T]) -> Vec<T> {
    let count = jacobian.first().map_or(0, Vec::len);
    let of = |at: usize| -> Vec<T> { jacobian.iter().map(|row| row[at]).collect() };
    (0..count).map(|at| dot(&of(at), vector)).collect()
}

/// The Jacobian without the columns of coordinates that are held.
fn free<T: Real>(mut jacobian: Vec<Vec<T>>, held: &[usize]) -> Vec<Vec<T>> {
    for row in &mut jacobian {
        for at in held {
            row[*at] = T::constant(0.0);
        }
    }
    jacobian
}

/// The positions near these ones that close all loops: each of a few steps goes the shortest way that does to
/// first order. Coordinates that are held stay.
pub fn closed_positions<T: Real>(loops: &[Loop<'_>], state: &State<T>, held: &[usize]) -> Vec<T> {
    let mut state = State::still(state.positions.clone());
    for _ in 0..STEPS {
        let jacobian = free(jacobian(loops, &state), held);
        let way = shortest(&jacobian, errors(loops, &state));
        let positions = state.positions.iter().zip(way);
        state.positions = positions.map(|(position, by)| *position - by).collect();
    }
    state.positions
}

/// The velocities nearest to these ones that keep all loops closed. Coordinates that are held keep theirs.
pub fn closed_velocities<T: Real>(loops: &[Loop<'_>], state: &State<T>, held: &[usize]) -> Vec<T> {
    let jacobian = jacobian(loops, state);
    let rates = jacobian.iter().map(|row| dot(row, &state.velocities));
    let rates = rates.collect();
    let way = shortest(&free(jacobian, held), rates);
    let velocities = state.velocities.iter().zip(way);
    velocities.map(|(velocity, by)| *velocity - by).collect()
}

/// The accelerations of the coordinates under these efforts while all loops stay closed, and the forces that keep
/// them so: what each second frame feels, along the rows.
pub fn accelerations<T: Real>(
    robot: &Robot,
    loops: &[Loop<'_>],
    motions: &Motions<'_, T>,
    loads: &[Load<T>],
) -> (Vec<T>, Vec<T>) {
    let (equation, free) = equation(robot, motions, loads);
    let still = State {
        accelerations: vec![T::constant(0.0); motions.efforts.len()],
        ..motions.state.clone()
    };
    let moved = moved(loops, &still);
    let (mut rows, mut forces) = (Vec::new(), Vec::new());
    for (closed, moved) in loops.iter().zip(&moved) {
        rows.extend(closed.jacobian(moved));
        forces.extend(closed.of(moved.linear_acceleration, moved.angular_acceleration));
    }
    let mut accelerations = equation.solved(free);
    let responses: Vec<Vec<T>> = rows
        .iter()
        .map(|row| equation.solved(row.clone()))
        .collect();
    let mut square: Vec<Vec<T>> = rows
        .iter()
        .map(|row| responses.iter().map(|other| dot(row, other)).collect())
        .collect();
    for (force, row) in forces.iter_mut().zip(&rows) {
        *force = -(*force + dot(row, &accelerations));
    }
    solve(&mut square, &mut forces);
    for (response, force) in responses.iter().zip(&forces) {
        for (acceleration, by) in accelerations.iter_mut().zip(response) {
            *acceleration = *acceleration + *by * *force;
        }
    }
    (accelerations, forces)
}

/// The least efforts, by the sum of their squares, that give these accelerations while all loops stay closed. Those of
/// `passive` coordinates are 0. Accelerations that open a loop have the efforts of the nearest ones that do not.
///
/// Loops carry what does no work, so that only the parts of the efforts along motions that keep the loops closed count.
pub fn efforts<T: Real>(
    robot: &Robot,
    loops: &[Loop<'_>],
    (state, gravity): (&State<T>, [f64; 3]),
    loads: &[Load<T>],
    passive: &[usize],
) -> Vec<T> {
    let (zero, one) = (T::constant(0.0), T::constant(1.0));
    let jacobian = jacobian(loops, state);
    let along = |vector: Vec<T>| -> Vec<T> {
        let rates = jacobian.iter().map(|row| dot(row, &vector)).collect();
        let across = shortest(&jacobian, rates);
        let parts = vector.iter().zip(across);
        parts.map(|(part, by)| *part - by).collect()
    };
    let count = robot.coordinates.len();
    // What one effort does along these motions.
    let motors: Vec<(usize, Vec<T>)> = (0..count)
        .filter(|at| !passive.contains(at))
        .map(|at| {
            let mut unit = vec![zero; count];
            unit[at] = one;
            (at, along(unit))
        })
        .collect();
    let mut square: Vec<Vec<T>> = (0..count)
        .map(|row| {
            let of = |column| {
                let motors = motors.iter();
                motors.fold(zero, |sum, (_, motor)| sum + motor[row] * motor[column])
            };
            (0..count).map(of).collect()
        })
        .collect();
    // The second time removes what rounding left, which the small stiffness across would magnify.
    let mut wanted = along(along(dynamics::efforts(robot, state, gravity, loads)));
    solve(&mut square, &mut wanted);
    let mut efforts = vec![zero; count];
    for (at, motor) in &motors {
        efforts[*at] = dot(motor, &wanted);
    }
    efforts
}

/// How many of these coordinates move as the others do, because of the loops: at most, as it is at positions that
/// no file favours.
pub fn moved_by_others(robot: &Robot, loops: &[Loop<'_>], passive: &[usize]) -> usize {
    let rows = jacobian(loops, &State::still(dynamics::unfavoured(robot)));
    let mut columns: Vec<Vec<f64>> = passive
        .iter()
        .map(|at| rows.iter().map(|row| row[*at]).collect())
        .collect();
    let mut moved = 0;
    for row in 0..rows.len() {
        let greatest = (moved..columns.len()).max_by(|a, b| {
            let (one, other) = (columns[*a][row], columns[*b][row]);
            one.abs().total_cmp(&other.abs())
        });
        let Some(greatest) = greatest else { break };
        columns.swap(moved, greatest);
        let pivot = columns[moved].clone();
        if pivot[row].abs() < 1e-9 {
            continue;
        }
        moved += 1;
        for column in &mut columns[moved..] {
            let factor = column[row] / pivot[row];
            for (part, by) in column.iter_mut().zip(&pivot) {
                *part -= factor * by;
            }
        }
    }
    moved
}
