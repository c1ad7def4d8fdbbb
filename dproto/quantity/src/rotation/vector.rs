//! An axis and an angle.

use super::{Matrix, Quaternion};
use crate::Real;

/// A turn about an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisAngle<T = f64> {
    /// Of length 1. It is x for the identity.
    pub axis: [T; 3],
    /// In radians, from 0 to π.
    pub angle: T,
}

fn length<T: Real>([x, y, z]: [T; 3]) -> T {
    (x * x + y * y + z * z).root()
}

impl<T: Real> AxisAngle<T> {
    /// The turn of a rotation.
    #[must_use]
    pub fn of_matrix(matrix: &Matrix<T>) -> Self {
        let Quaternion { w, x, y, z } = Quaternion::of_matrix(matrix);
        let size = length([x, y, z]);
        let (zero, one) = (T::constant(0.0), T::constant(1.0));
        let part = |part: T, otherwise: T| zero.if_below(size, part / size, otherwise);
        Self {
            axis: [part(x, one), part(y, zero), part(z, zero)],
            angle: T::constant(2.0) * size.angle_over(w),
        }
    }

    /// The rotation.
    #[must_use]
    pub fn matrix(&self) -> Matrix<T> {
        let half = self.angle / T::constant(2.0);
        let [x, y, z] = self.axis.map(|part| part * half.sine());
        let w = half.cosine();
        Quaternion { w, x, y, z }.matrix()
    }
}

/// The rotation of a rotation vector: its direction is the axis, its length the angle.
#[must_use]
pub fn from_rotation_vector<T: Real>(vector: [T; 3]) -> Matrix<T> {
    let angle = length(vector);
    let half = angle / T::constant(2.0);
    // sin(angle / 2) / angle, whose series is exact to the last bit below.
    let series = T::constant(0.5) - angle * angle / T::constant(48.0);
    let factor = angle.if_below(T::constant(1e-4), series, half.sine() / angle);
    let [x, y, z] = vector.map(|part| part * factor);
    let w = half.cosine();
    Quaternion { w, x, y, z }.matrix()
}

/// The rotation vector of a rotation.
#[must_use]
pub fn to_rotation_vector<T: Real>(matrix: &Matrix<T>) -> [T; 3] {
    let turn = AxisAngle::of_matrix(matrix);
    turn.axis.map(|part| part * turn.angle)
}
