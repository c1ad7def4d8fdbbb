//! Rotations in three dimensions, in all representations that messages have.
//!
//! Each representation converts through [`Matrix`]. A rotation takes the coordinates of a vector in
//! the turned frame to those in the fixed frame: `v' = R v`. Angles are in radians.

mod euler;
mod quaternion;
mod vector;

pub use euler::{Euler, EulerOrder, LOCKED, Turns};
pub use quaternion::{NoRotation, Quaternion};
pub use vector::{AxisAngle, from_rotation_vector, to_rotation_vector};

use crate::Real;

/// A matrix of 3 rows.
pub type Matrix<T = f64> = [[T; 3]; 3];

/// The matrix that changes nothing.
pub const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// The product `a b`.
#[must_use]
pub fn product<T: Real>(a: &Matrix<T>, b: &Matrix<T>) -> Matrix<T> {
    let mut out = [[T::constant(0.0); 3]; 3];
    for (row, of_a) in out.iter_mut().zip(a) {
        for (column, value) in row.iter_mut().enumerate() {
            *value = of_a[0] * b[0][column] + of_a[1] * b[1][column] + of_a[2] * b[2][column];
        }
    }
    out
}

/// The transposed matrix, the inverse of a rotation.
#[must_use]
pub fn transposed<T: Real>(matrix: &Matrix<T>) -> Matrix<T> {
    let mut out = *matrix;
    for (at, row) in out.iter_mut().enumerate() {
        *row = [matrix[0][at], matrix[1][at], matrix[2][at]];
    }
    out
}

/// The product with a vector.
#[must_use]
pub fn turned<T: Real>(matrix: &Matrix<T>, vector: [T; 3]) -> [T; 3] {
    let row = |row: &[T; 3]| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2];
    [row(&matrix[0]), row(&matrix[1]), row(&matrix[2])]
}

/// The vector product.
#[must_use]
pub fn cross<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// 1 for a right-handed matrix, -1 for a left-handed one, if it is orthogonal.
#[must_use]
pub fn determinant<T: Real>(matrix: &Matrix<T>) -> T {
    let [a, b, c] = *matrix;
    let normal = cross(b, c);
    a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2]
}

/// The rotation about the axis with this number: 0 for x, 1 for y, 2 for z.
pub(crate) fn about<T: Real>(axis: usize, angle: T) -> Matrix<T> {
    let (s, c) = (angle.sine(), angle.cosine());
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut out = IDENTITY.map(|row| row.map(T::constant));
    out[next][next] = c;
    out[last][last] = c;
    out[next][last] = -s;
    out[last][next] = s;
    out
}
