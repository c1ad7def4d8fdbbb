//! An axis and an angle.

use super::{Matrix, Quaternion};
use libm::{atan2, cos, sin, sqrt};

/// A turn about an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisAngle {
    /// Of length 1. It is x for a rotation that changes nothing.
    pub axis: [f64; 3],
    /// In radians, from 0 to π.
    pub angle: f64,
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    sqrt(x * x + y * y + z * z)
}

impl AxisAngle {
    /// The turn of a rotation.
    #[must_use]
    pub fn of_matrix(matrix: &Matrix) -> Self {
        let Quaternion { w, x, y, z } = Quaternion::of_matrix(matrix);
        let size = length([x, y, z]);
        if size == 0.0 {
            return Self {
                axis: [1.0, 0.0, 0.0],
                angle: 0.0,
            };
        }
        Self {
            axis: [x / size, y / size, z / size],
            angle: 2.0 * atan2(size, w),
        }
    }

    /// The rotation.
    #[must_use]
    pub fn matrix(&self) -> Matrix {
        let half = self.angle / 2.0;
        let [x, y, z] = self.axis.map(|part| part * sin(half));
        let w = cos(half);
        Quaternion { w, x, y, z }.matrix()
    }
}

/// The rotation of a rotation vector: its direction is the axis, its length the angle.
#[must_use]
pub fn from_rotation_vector(vector: [f64; 3]) -> Matrix {
    let angle = length(vector);
    let half = angle / 2.0;
    // sin(angle / 2) / angle, whose series is exact to the last bit below.
    let factor = if angle < 1e-4 {
        0.5 - angle * angle / 48.0
    } else {
        sin(half) / angle
    };
    let [x, y, z] = vector.map(|part| part * factor);
    let w = cos(half);
    Quaternion { w, x, y, z }.matrix()
}

/// The rotation vector of a rotation.
#[must_use]
pub fn to_rotation_vector(matrix: &Matrix) -> [f64; 3] {
    let turn = AxisAngle::of_matrix(matrix);
    turn.axis.map(|part| part * turn.angle)
}
