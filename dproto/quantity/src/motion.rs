//! Transforms between frames, and their effect on twists, wrenches and covariances.

use crate::Real;
use crate::rotation::{IDENTITY, Matrix, cross, product, transposed, turned};

/// Takes coordinates in one frame to those in another one: `R p + t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform<T = f64> {
    /// R: the axes of the first frame in the other one, as columns.
    pub rotation: Matrix<T>,
    /// t: the origin of the first frame in the other one.
    pub translation: [T; 3],
}

/// The order of the numbers of a homogeneous matrix.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// One row after the other, and the translation in the last column.
    RowMajor,
    /// One column after the other, and the translation in the last column.
    ColumnMajor,
}

/// An angular and a linear part: of a twist, the velocity of the frame's origin; of a wrench, torque
/// and force.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the names are those of the field")]
pub struct Spatial<T = f64> {
    pub angular: [T; 3],
    pub linear: [T; 3],
}

/// The inertia of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia<T = f64> {
    /// The mass.
    pub mass: T,
    /// The centre of mass, in the frame.
    pub centre: [T; 3],
    /// The tensor about the centre of mass, along the axes of the frame.
    pub tensor: Matrix<T>,
}

fn sum<T: Real>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

impl<T: Real> Transform<T> {
    /// This transform applied after an inner one: from the frame where that one begins.
    #[must_use]
    pub fn then(&self, inner: &Self) -> Self {
        Self {
            rotation: product(&self.rotation, &inner.rotation),
            translation: self.point(inner.translation),
        }
    }

    /// The transform back.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = transposed(&self.rotation);
        Self {
            rotation,
            translation: turned(&rotation, self.translation).map(|part| -part),
        }
    }

    /// The coordinates of a point in the other frame.
    #[must_use]
    pub fn point(&self, point: [T; 3]) -> [T; 3] {
        sum(turned(&self.rotation, point), self.translation)
    }

    /// The matrix of the vector product with the translation: `t × v`.
    #[must_use]
    pub fn lever(&self) -> Matrix<T> {
        let [x, y, z] = self.translation;
        let zero = T::constant(0.0);
        [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    }

    /// This twist, in the other frame and at its origin: the adjoint, `ω' = R ω` and
    /// `v' = R v + t × R ω` (Lynch and Park, Modern Robotics, 3.3.2).
    #[must_use]
    pub fn twist(&self, twist: &Spatial<T>) -> Spatial<T> {
        let angular = turned(&self.rotation, twist.angular);
        let linear = turned(&self.rotation, twist.linear);
        Spatial {
            angular,
            linear: sum(linear, cross(self.translation, angular)),
        }
    }

    /// This inertia, in the other frame: `c' = R c + t` and `I' = R I Rᵀ`, which is the congruence of the
    /// spatial inertia with the adjoint (Featherstone, Rigid Body Dynamics Algorithms, 2.13).
    #[must_use]
    pub fn inertia(&self, inertia: &Inertia<T>) -> Inertia<T> {
        let turned = product(&self.rotation, &inertia.tensor);
        Inertia {
            mass: inertia.mass,
            centre: self.point(inertia.centre),
            tensor: product(&turned, &transposed(&self.rotation)),
        }
    }

    /// This wrench, in the other frame and at its origin: `f' = R f` and `τ' = R τ + t × R f`.
    /// Its power with a twist is the same in both frames.
    #[must_use]
    pub fn wrench(&self, wrench: &Spatial<T>) -> Spatial<T> {
        let angular = turned(&self.rotation, wrench.angular);
        let linear = turned(&self.rotation, wrench.linear);
        Spatial {
            angular: sum(angular, cross(self.translation, linear)),
            linear,
        }
    }
}

impl Transform {
    /// From a frame to itself.
    pub const IDENTITY: Self = Self {
        rotation: IDENTITY,
        translation: [0.0; 3],
    };

    /// This transform, of numbers that are known.
    #[must_use]
    pub fn constant<T: Real>(&self) -> Transform<T> {
        Transform {
            rotation: self.rotation.map(|row| row.map(T::constant)),
            translation: self.translation.map(T::constant),
        }
    }

    /// The 16 numbers of the homogeneous matrix for column vectors. For row vectors, the matrix is
    /// transposed: take the other layout.
    #[must_use]
    pub fn homogeneous(&self, layout: Layout) -> [f64; 16] {
        let mut out = [0.0; 16];
        let mut put = |row: usize, column: usize, value: f64| {
            out[match layout {
                Layout::RowMajor => 4 * row + column,
                Layout::ColumnMajor => 4 * column + row,
            }] = value;
        };
        for row in 0..3 {
            for column in 0..3 {
                put(row, column, self.rotation[row][column]);
            }
            put(row, 3, self.translation[row]);
        }
        put(3, 3, 1.0);
        out
    }

    /// The transform with this homogeneous matrix, whose last row is not read.
    #[must_use]
    pub fn of_homogeneous(numbers: &[f64; 16], layout: Layout) -> Self {
        let get = |row: usize, column: usize| match layout {
            Layout::RowMajor => numbers[4 * row + column],
            Layout::ColumnMajor => numbers[4 * column + row],
        };
        let row = |row: usize| [get(row, 0), get(row, 1), get(row, 2)];
        Self {
            rotation: [row(0), row(1), row(2)],
            translation: [get(0, 3), get(1, 3), get(2, 3)],
        }
    }
}

/// The covariance of `f(x)` for the covariance of `x`, to the first order: `J C Jᵀ`. The Jacobian is
/// found by central differences, whose step is `step`.
pub fn covariance<const N: usize, const M: usize>(
    of: impl Fn(&[f64; N]) -> [f64; M],
    at: &[f64; N],
    covariance: &[[f64; N]; N],
    step: f64,
) -> [[f64; M]; M] {
    let mut jacobian = [[0.0; N]; M];
    for column in 0..N {
        let moved = |by: f64| {
            let mut moved = *at;
            moved[column] += by;
            of(&moved)
        };
        let (ahead, back) = (moved(step), moved(-step));
        for row in 0..M {
            jacobian[row][column] = (ahead[row] - back[row]) / (2.0 * step);
        }
    }
    let mut out = [[0.0; M]; M];
    for (row, values) in out.iter_mut().enumerate() {
        for (column, value) in values.iter_mut().enumerate() {
            for a in 0..N {
                for b in 0..N {
                    *value += jacobian[row][a] * covariance[a][b] * jacobian[column][b];
                }
            }
        }
    }
    out
}
