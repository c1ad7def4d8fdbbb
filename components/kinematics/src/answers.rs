//! Answers for pairs of links, which are computed once and kept.

use rc_formula::Interpreter;
use rc_kinematics::{Cell, Inverse, Settings};
use rc_quantity::Transform;
use rc_quantity::rotation::{Matrix, Quaternion};
use std::collections::HashMap;
use std::sync::Arc;

/// The most pairs of links that are kept.
const MOST_PAIRS: usize = 64;

/// How far the norm of a quaternion of a request may be from 1.
const NORM: f64 = 1e-3;

/// The robot, and its answers so far.
pub(crate) struct Answers {
    pub(crate) cell: Cell,
    pairs: HashMap<[String; 2], Pair>,
}

/// How one link moves in another one.
struct Pair {
    inverse: Arc<Inverse>,
    motion: Interpreter,
}

/// The greatest length in m and position of a request: more has no digits left for millimetres.
const MOST: f64 = 1e9;

/// Positions for a pose.
pub(crate) struct Reached {
    pub(crate) positions: Vec<f64>,
    pub(crate) reached: bool,
    pub(crate) distance: f64,
    pub(crate) angle: f64,
    /// How often the motion was computed.
    pub(crate) iterations: usize,
}

/// The homogeneous matrix for columns.
pub(crate) fn rows(translation: [f64; 3], xyzw: [f64; 4]) -> Result<[[f64; 4]; 4], String> {
    let quaternion = Quaternion::xyzw(xyzw).unit(NORM);
    let turn = quaternion.map_err(|_| "the rotation is not a quaternion of norm 1".to_owned())?;
    if translation.iter().any(|part| !part.is_finite()) {
        return Err("the translation is not finite".to_owned());
    }
    if translation.iter().any(|part| part.abs() > MOST) {
        return Err(format!("the translation is greater than {MOST:e} m"));
    }
    let mut rows = [[0.0, 0.0, 0.0, 1.0]; 4];
    for ((row, turn), place) in rows.iter_mut().zip(turn.matrix()).zip(translation) {
        row[..3].copy_from_slice(&turn);
        row[3] = place;
    }
    Ok(rows)
}

impl Answers {
    pub(crate) fn new(cell: Cell) -> Self {
        let pairs = HashMap::new();
        Self { cell, pairs }
    }

    /// Positions of a request: those of now if it has none.
    pub(crate) fn checked(&self, given: Vec<f64>, now: &[f64]) -> Result<Vec<f64>, String> {
        let count = self.cell.robot.coordinates.len();
        if given.is_empty() {
            return Ok(now.to_vec());
        }
        if given.len() != count {
            return Err(format!(
                "{count} positions are expected, found {}",
                given.len()
            ));
        }
        if given.iter().any(|position| !position.is_finite()) {
            return Err("a position is not finite".to_owned());
        }
        if given.iter().any(|position| position.abs() > MOST) {
            return Err(format!("a position is greater than {MOST:e}"));
        }
        Ok(given)
    }

    fn pair(&mut self, tip: &str, base: &str) -> Result<&mut Pair, String> {
        let names = [tip.to_owned(), base.to_owned()];
        if !self.pairs.contains_key(&names) {
            let settings = Settings {
                keeps_limits: true,
                ..Settings::default()
            };
            let inverse = self.cell.inverse_of(tip, base, settings);
            let inverse = inverse.map_err(|error| error.to_string())?;
            let motion = Interpreter::new(&inverse.motion).map_err(|error| error.to_string())?;
            if self.pairs.len() >= MOST_PAIRS {
                self.pairs.clear();
            }
            let inverse = Arc::new(inverse);
            self.pairs.insert(names.clone(), Pair { inverse, motion });
        }
        self.pairs.get_mut(&names).ok_or_else(String::new)
    }

    /// The pose in rows, then the rows of the Jacobian, and how many columns these have.
    fn moved(
        &mut self,
        tip: &str,
        base: &str,
        positions: &[f64],
    ) -> Result<(Vec<f64>, usize), String> {
        let pair = self.pair(tip, base)?;
        let joints = &pair.inverse.joints;
        let at: Vec<f64> = joints.iter().map(|joint| positions[*joint]).collect();
        let mut numbers = vec![0.0; pair.motion.outputs()];
        let run = pair.motion.run(&at, &mut numbers);
        run.map_err(|error| error.to_string())?;
        Ok((numbers, joints.len()))
    }

    /// Where `tip` is in `base`.
    pub(crate) fn forward(
        &mut self,
        tip: &str,
        base: &str,
        positions: &[f64],
    ) -> Result<Transform, String> {
        let (numbers, _) = self.moved(tip, base, positions)?;
        let at = |row: usize, column: usize| numbers[4 * row + column];
        let rotation: Matrix =
            std::array::from_fn(|row| std::array::from_fn(|column| at(row, column)));
        let translation = std::array::from_fn(|row| at(row, 3));
        Ok(Transform {
            rotation,
            translation,
        })
    }

    /// Positions within the limits that bring `tip` to a pose in `base`.
    pub(crate) fn inverse(
        &mut self,
        tip: &str,
        base: &str,
        target: &[[f64; 4]; 4],
        seed: &[f64],
    ) -> Result<Reached, String> {
        let inverse = Arc::clone(&self.pair(tip, base)?.inverse);
        let answer = inverse.positions(target, seed);
        let (positions, found) = answer.ok_or("the question has no answer")?;
        Ok(Reached {
            positions,
            reached: found.reached,
            distance: found.distance,
            angle: found.angle,
            iterations: found.iterations,
        })
    }

    /// The singular values of the Jacobian, the greatest one first.
    pub(crate) fn singular_values(
        &mut self,
        tip: &str,
        base: &str,
        positions: &[f64],
    ) -> Result<Vec<f64>, String> {
        let (numbers, joints) = self.moved(tip, base, positions)?;
        let jacobian: Vec<&[f64]> = numbers[12..].chunks(joints.max(1)).collect();
        let mut square = [[0.0; 6]; 6];
        for (row, one) in jacobian.iter().enumerate() {
            for (column, other) in jacobian.iter().enumerate() {
                square[row][column] = one.iter().zip(*other).map(|(a, b)| a * b).sum();
            }
        }
        let mut values = eigenvalues(square).map(|value| value.max(0.0).sqrt());
        values.sort_by(|a, b| b.total_cmp(a));
        Ok(values[..joints.min(6)].to_vec())
    }
}

/// The eigenvalues of a symmetric matrix, by Jacobi's method.
fn eigenvalues(mut matrix: [[f64; 6]; 6]) -> [f64; 6] {
    // It converges quadratically: five sweeps are enough for rounding.
    for _ in 0..12 {
        for p in 0..6 {
            for q in p + 1..6 {
                if matrix[p][q] == 0.0 {
                    continue;
                }
                let slope = (matrix[q][q] - matrix[p][p]) / (2.0 * matrix[p][q]);
                let tangent = slope.signum() / (slope.abs() + (1.0 + slope * slope).sqrt());
                let cosine = 1.0 / (1.0 + tangent * tangent).sqrt();
                let sine = tangent * cosine;
                for row in &mut matrix {
                    let (one, other) = (row[p], row[q]);
                    row[p] = cosine * one - sine * other;
                    row[q] = sine * one + cosine * other;
                }
                let (one, other) = (matrix[p], matrix[q]);
                matrix[p] = std::array::from_fn(|at| cosine * one[at] - sine * other[at]);
                matrix[q] = std::array::from_fn(|at| sine * one[at] + cosine * other[at]);
            }
        }
    }
    std::array::from_fn(|at| matrix[at][at])
}
