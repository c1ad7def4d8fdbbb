//! Unit quaternions.

use super::Matrix;
use crate::Real;
use core::fmt;

/// A unit quaternion: `w + x i + y j + z k`. It and its negative are one rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the names of the parts are those of the field")]
pub struct Quaternion<T = f64> {
    pub w: T,
    pub x: T,
    pub y: T,
    pub z: T,
}

/// Numbers are not a unit quaternion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoRotation {
    /// Their norm.
    pub norm: f64,
}

impl fmt::Display for NoRotation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a quaternion of norm {} is not a rotation", self.norm)
    }
}

impl core::error::Error for NoRotation {}

impl<T: Real> Quaternion<T> {
    /// The quaternion with the real part first, as in Eigen's constructor and transforms3d.
    #[must_use]
    pub const fn wxyz([w, x, y, z]: [T; 4]) -> Self {
        Self { w, x, y, z }
    }

    /// The quaternion with the real part last, as in messages of ROS and in scipy.
    #[must_use]
    pub const fn xyzw([x, y, z, w]: [T; 4]) -> Self {
        Self { w, x, y, z }
    }

    /// The numbers with the real part first.
    #[must_use]
    pub const fn to_wxyz(self) -> [T; 4] {
        [self.w, self.x, self.y, self.z]
    }

    /// The numbers with the real part last.
    #[must_use]
    pub const fn to_xyzw(self) -> [T; 4] {
        [self.x, self.y, self.z, self.w]
    }

    /// The norm.
    #[must_use]
    pub fn norm(self) -> T {
        let Self { w, x, y, z } = self;
        (w * w + x * x + y * y + z * z).root()
    }

    /// The rotation of a unit quaternion.
    #[must_use]
    pub fn matrix(self) -> Matrix<T> {
        let Self { w, x, y, z } = self;
        let (one, two) = (T::constant(1.0), T::constant(2.0));
        [
            [
                one - two * (y * y + z * z),
                two * (x * y - w * z),
                two * (x * z + w * y),
            ],
            [
                two * (x * y + w * z),
                one - two * (x * x + z * z),
                two * (y * z - w * x),
            ],
            [
                two * (x * z - w * y),
                two * (y * z + w * x),
                one - two * (x * x + y * y),
            ],
        ]
    }

    /// The unit quaternion of a rotation, whose real part is not negative. It divides by the
    /// greatest of its parts (Shepperd, 1978).
    #[must_use]
    pub fn of_matrix(r: &Matrix<T>) -> Self {
        let (one, two) = (T::constant(1.0), T::constant(2.0));
        let trace = r[0][0] + r[1][1] + r[2][2];
        let mut most = trace;
        let mut parts = [
            r[2][1] - r[1][2],
            r[0][2] - r[2][0],
            r[1][0] - r[0][1],
            one + trace,
        ];
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let mut of_axis = parts;
            of_axis[i] = one - trace + two * r[i][i];
            of_axis[j] = r[j][i] + r[i][j];
            of_axis[k] = r[k][i] + r[i][k];
            of_axis[3] = r[k][j] - r[j][k];
            for (part, other) in parts.iter_mut().zip(of_axis) {
                *part = most.if_below(r[i][i], other, *part);
            }
            most = most.if_below(r[i][i], r[i][i], most);
        }
        let norm = Self::xyzw(parts).norm();
        let norm = parts[3].if_below(T::constant(0.0), -norm, norm);
        Self::xyzw(parts.map(|part| part / norm))
    }
}

impl Quaternion {
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
}
