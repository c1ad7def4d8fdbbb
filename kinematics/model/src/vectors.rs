//! Vectors of terms, and the rotation about an axis.

use rc_quantity::Real;
use rc_quantity::rotation::{IDENTITY, Matrix};

/// The sum of two vectors.
pub(crate) fn sum<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The scalar product.
pub(crate) fn dot<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn scaled<T: Real>(vector: [T; 3], by: T) -> [T; 3] {
    vector.map(|part| part * by)
}

pub(crate) fn vector<T: Real>(numbers: [f64; 3]) -> [T; 3] {
    numbers.map(T::constant)
}

pub(crate) fn matrix<T: Real>(numbers: &Matrix) -> Matrix<T> {
    numbers.map(vector)
}

/// The rotation about an axis of length 1 by an angle, by Rodrigues' formula. `AxisAngle::matrix` goes by
/// a quaternion, which leaves more operations if the axis is known.
pub(crate) fn about<T: Real>(axis: [f64; 3], angle: T) -> Matrix<T> {
    let (sine, cosine) = (angle.sine(), angle.cosine());
    let [x, y, z] = axis;
    let cross = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let mut out = [[T::constant(0.0); 3]; 3];
    for (row, parts) in out.iter_mut().enumerate() {
        for (column, part) in parts.iter_mut().enumerate() {
            let along = axis[row] * axis[column];
            let across = IDENTITY[row][column] - along;
            *part = T::constant(along)
                + cosine * T::constant(across)
                + sine * T::constant(cross[row][column]);
        }
    }
    out
}
