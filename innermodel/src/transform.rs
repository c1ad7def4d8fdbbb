//! A rotation and a translation.

use crate::{Point, Pose, Vector};
use innermodel_language::model::Axis;
use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion};

/// Takes the coordinates of a point in one frame to those in another one: R·p + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// R.
    pub rotation: Matrix3<f64>,
    /// t, in millimetres.
    pub translation: Vector,
}

impl Default for Transform {
    fn default() -> Self {
        Self::identity()
    }
}

impl Transform {
    /// The transform that changes nothing.
    pub fn identity() -> Self {
        Self {
            rotation: Matrix3::identity(),
            translation: Vector::zeros(),
        }
    }

    /// A translation in millimetres.
    pub fn translation(by: Vector) -> Self {
        Self {
            rotation: Matrix3::identity(),
            translation: by,
        }
    }

    /// A rotation about an axis, in radians.
    pub fn about(axis: Axis, angle: f64) -> Self {
        let (s, c) = angle.sin_cos();
        let rotation = match axis {
            Axis::X => Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c),
            Axis::Y => Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c),
            Axis::Z => Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0),
        };
        Self {
            rotation,
            translation: Vector::zeros(),
        }
    }

    /// The transform that takes the coordinates in a frame with this pose to those in its parent:
    /// R = Rx·Ry·Rz.
    pub fn of(pose: &Pose) -> Self {
        let [x, y, z] = pose.rotation;
        let rotation = if x == 0.0 && y == 0.0 && z == 0.0 {
            Matrix3::identity()
        } else {
            let (sx, cx) = x.sin_cos();
            let (sy, cy) = y.sin_cos();
            let (sz, cz) = z.sin_cos();
            Matrix3::new(
                cy * cz,
                -cy * sz,
                sy,
                cx * sz + sx * sy * cz,
                cx * cz - sx * sy * sz,
                -sx * cy,
                sx * sz - cx * sy * cz,
                sx * cz + cx * sy * sz,
                cx * cy,
            )
        };
        Self {
            rotation,
            translation: pose.translation.into(),
        }
    }

    /// The pose with this transform. The angle about y is between −π/2 and π/2; at these ends the
    /// angle about x is 0.
    pub fn pose(&self) -> Pose {
        let r = &self.rotation;
        let sy = r[(0, 2)];
        let cy = r[(0, 0)].hypot(r[(0, 1)]);
        let y = sy.atan2(cy);
        let (x, z) = if cy > 1e-12 {
            ((-r[(1, 2)]).atan2(r[(2, 2)]), (-r[(0, 1)]).atan2(r[(0, 0)]))
        } else {
            (0.0, r[(1, 0)].atan2(r[(1, 1)]))
        };
        Pose {
            translation: self.translation.into(),
            rotation: [x, y, z],
        }
    }

    /// This one after `inner`.
    #[must_use]
    #[inline]
    pub fn then_inner(&self, inner: &Self) -> Self {
        Self {
            rotation: self.rotation * inner.rotation,
            translation: self.rotation * inner.translation + self.translation,
        }
    }

    /// The transform back.
    #[must_use]
    #[inline]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            translation: -(rotation * self.translation),
        }
    }

    /// The coordinates of a point in the outer frame.
    #[inline]
    pub fn point(&self, point: &Point) -> Point {
        Point::from(self.rotation * point.coords + self.translation)
    }

    /// The coordinates of a direction in the outer frame.
    #[inline]
    pub fn vector(&self, vector: &Vector) -> Vector {
        self.rotation * vector
    }

    /// As a homogeneous matrix of 4 rows and columns.
    pub fn matrix(&self) -> Matrix4<f64> {
        let mut matrix = self.rotation.to_homogeneous();
        matrix
            .fixed_view_mut::<3, 1>(0, 3)
            .copy_from(&self.translation);
        matrix
    }

    /// As nalgebra's isometry.
    pub fn isometry(&self) -> Isometry3<f64> {
        let rotation = Rotation3::from_matrix_unchecked(self.rotation);
        Isometry3::from_parts(
            Translation3::from(self.translation),
            UnitQuaternion::from_rotation_matrix(&rotation),
        )
    }

    /// From nalgebra's isometry.
    pub fn from_isometry(isometry: &Isometry3<f64>) -> Self {
        Self {
            rotation: isometry.rotation.to_rotation_matrix().into_inner(),
            translation: isometry.translation.vector,
        }
    }

    /// Between this one (`t` = 0) and `other` (`t` = 1): the translation in a straight line, the
    /// rotation about one axis at a constant speed.
    #[must_use]
    pub fn between(&self, other: &Self, t: f64) -> Self {
        if self == other {
            return *self;
        }
        let (a, b) = (self.isometry(), other.isometry());
        let rotation = a.rotation.try_slerp(&b.rotation, t, 1e-12);
        // Half a turn has no shortest way: the nearer end holds.
        let rotation = rotation.unwrap_or(if t < 0.5 { a.rotation } else { b.rotation });
        Self {
            rotation: rotation.to_rotation_matrix().into_inner(),
            translation: self.translation.lerp(&other.translation, t),
        }
    }
}

impl std::ops::Mul for Transform {
    type Output = Self;

    fn mul(self, inner: Self) -> Self {
        self.then_inner(&inner)
    }
}
