//! Unit quaternions.

use super::Matrix;
use core::fmt;
use libm::sqrt;

/// A unit quaternion: `w + x i + y j + z k`. It and its negative are one rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the names of the parts are those of the field")]
pub struct Quaternion {
    pub w: f64,
    pub x: f64,
    pub y: f64,
    pub z: f64,
}

/// Numbers are no unit quaternion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoRotation {
    /// Their norm.
    pub norm: f64,
}

impl fmt::Display for NoRotation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a quaternion of norm {} is no rotation", self.norm)
    }
}

impl core::error::Error for NoRotation {}

impl Quaternion {
    /// The quaternion with the real part first, as in Eigen's constructor and transforms3d.
    #[must_use]
    pub const fn wxyz([w, x, y, z]: [f64; 4]) -> Self {
        Self { w, x, y, z }
    }

    /// The quaternion with the real part last, as in messages of ROS and in scipy.
    #[must_use]
    pub const fn xyzw([x, y, z, w]: [f64; 4]) -> Self {
        Self { w, x, y, z }
    }

    /// The numbers with the real part first.
    #[must_use]
    pub const fn to_wxyz(self) -> [f64; 4] {
        [self.w, self.x, self.y, self.z]
    }

    /// The numbers with the real part last.
    #[must_use]
    pub const fn to_xyzw(self) -> [f64; 4] {
        [self.x, self.y, self.z, self.w]
    }

    /// The norm.
    #[must_use]
    pub fn norm(self) -> f64 {
        let Self { w, x, y, z } = self;
        sqrt(w * w + x * x + y * y + z * z)
    }

    /// The quaternion of norm 1 in the same direction.
    ///
    /// # Errors
    /// The norm is NaN, or differs from 1 by more than `tolerance`.
    pub fn unit(self, tolerance: f64) -> Result<Self, NoRotation> {
        let norm = self.norm();
        let fits = norm > 0.0 && (norm - 1.0).abs() <= tolerance;
        let Self { w, x, y, z } = self;
        fits.then(|| Self {
            w: w / norm,
            x: x / norm,
            y: y / norm,
            z: z / norm,
        })
        .ok_or(NoRotation { norm })
    }

    /// The rotation of a unit quaternion.
    #[must_use]
    pub fn matrix(self) -> Matrix {
        let Self { w, x, y, z } = self;
        [
            [
                1.0 - 2.0 * (y * y + z * z),
                2.0 * (x * y - w * z),
                2.0 * (x * z + w * y),
            ],
            [
                2.0 * (x * y + w * z),
                1.0 - 2.0 * (x * x + z * z),
                2.0 * (y * z - w * x),
            ],
            [
                2.0 * (x * z - w * y),
                2.0 * (y * z + w * x),
                1.0 - 2.0 * (x * x + y * y),
            ],
        ]
    }

    /// The unit quaternion of a rotation, whose real part is not negative. It divides by the
    /// greatest of its parts (Shepperd, 1978).
    #[must_use]
    pub fn of_matrix(r: &Matrix) -> Self {
        let trace = r[0][0] + r[1][1] + r[2][2];
        let mut greatest = 3;
        let mut most = trace;
        for (axis, row) in r.iter().enumerate() {
            if row[axis] > most {
                most = row[axis];
                greatest = axis;
            }
        }
        let mut parts = [0.0; 4];
        if greatest == 3 {
            parts[3] = 1.0 + trace;
            parts[0] = r[2][1] - r[1][2];
            parts[1] = r[0][2] - r[2][0];
            parts[2] = r[1][0] - r[0][1];
        } else {
            let (i, j, k) = (greatest, (greatest + 1) % 3, (greatest + 2) % 3);
            parts[i] = 1.0 - trace + 2.0 * r[i][i];
            parts[j] = r[j][i] + r[i][j];
            parts[k] = r[k][i] + r[i][k];
            parts[3] = r[k][j] - r[j][k];
        }
        let norm = Self::xyzw(parts).norm();
        let norm = if parts[3] < 0.0 { -norm } else { norm };
        Self::xyzw(parts.map(|part| part / norm))
    }
}
