//! Where a frame stands in another one.

use rc_quantity::Real;
use rc_quantity::rotation::{IDENTITY, Matrix, product, transposed, turned};

/// A frame in another one: a point of the frame is at `rotation p + translation` there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<T = f64> {
    /// The axes of the frame, as columns.
    pub rotation: Matrix<T>,
    /// Its origin, in metres.
    pub translation: [T; 3],
}

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

impl Frame {
    /// The same frame.
    pub const HERE: Self = Self {
        rotation: IDENTITY,
        translation: [0.0; 3],
    };

    /// The frame with terms that are known.
    #[must_use]
    pub fn constant<T: Real>(&self) -> Frame<T> {
        Frame {
            rotation: matrix(&self.rotation),
            translation: vector(self.translation),
        }
    }
}

impl<T: Real> Frame<T> {
    /// A frame of this one, where this one stands.
    #[must_use]
    pub fn then(&self, inner: &Self) -> Self {
        Self {
            rotation: product(&self.rotation, &inner.rotation),
            translation: sum(self.translation, turned(&self.rotation, inner.translation)),
        }
    }

    /// The other frame in this one.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = transposed(&self.rotation);
        Self {
            rotation,
            translation: turned(&rotation, self.translation).map(|part| -part),
        }
    }
}

/// The rotation about an axis of length 1 by an angle, by Rodrigues' formula. Terms of an axis of the
/// frame are known, so they leave no operations.
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
