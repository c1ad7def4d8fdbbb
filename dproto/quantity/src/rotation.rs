//! Rotations in three dimensions, in all representations that messages have.
//!
//! Each representation converts through [`Matrix`]. A rotation takes the coordinates of a vector in
//! the turned frame to those in the fixed frame: `v' = R v`. Angles are in radians.

mod euler;
mod quaternion;
mod vector;

pub use euler::{Euler, EulerOrder, Turns};
pub use quaternion::{NoRotation, Quaternion};
pub use vector::{AxisAngle, from_rotation_vector, to_rotation_vector};

use libm::{cos, sin};

/// A matrix of 3 rows.
pub type Matrix = [[f64; 3]; 3];

/// The matrix that changes nothing.
pub const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The product `a b`.
#[must_use]
pub fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let mut out = [[0.0; 3]; 3];
    for (row, of_a) in out.iter_mut().zip(a) {
        for (column, value) in row.iter_mut().enumerate() {
            *value = of_a[0] * b[0][column] + of_a[1] * b[1][column] + of_a[2] * b[2][column];
        }
    }
    out
}

/// The transposed matrix, the inverse of a rotation.
#[must_use]
pub fn transposed(matrix: &Matrix) -> Matrix {
    let mut out = [[0.0; 3]; 3];
    for (at, row) in out.iter_mut().enumerate() {
        *row = [matrix[0][at], matrix[1][at], matrix[2][at]];
    }
    out
}

/// The product with a vector.
#[must_use]
pub fn turned(matrix: &Matrix, vector: [f64; 3]) -> [f64; 3] {
    let row = |row: &[f64; 3]| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2];
    [row(&matrix[0]), row(&matrix[1]), row(&matrix[2])]
}

/// The vector product.
#[must_use]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// 1 for a right-handed matrix, -1 for a left-handed one, if it is orthogonal.
#[must_use]
pub fn determinant(matrix: &Matrix) -> f64 {
    let [a, b, c] = *matrix;
    let normal = cross(b, c);
    a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2]
}

/// The rotation about the axis with this number: 0 for x, 1 for y, 2 for z.
pub(crate) fn about(axis: usize, angle: f64) -> Matrix {
    let (s, c) = (sin(angle), cos(angle));
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut out = IDENTITY;
    out[next][next] = c;
    out[last][last] = c;
    out[next][last] = -s;
    out[last][next] = s;
    out
}
