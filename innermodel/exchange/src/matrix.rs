//! Rotations and places.

/// Three rows.
pub(crate) type Matrix = [[f64; 3]; 3];
/// Three coordinates.
pub(crate) type Vector = [f64; 3];

pub(crate) const IDENTITY: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// Takes directions of `InnerModel` to those of URDF: x right, y up, z front become z up, x front.
pub(crate) const TO_URDF: Matrix = [[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// Takes directions of `InnerModel` to those of glTF, where x points to the left.
pub(crate) const TO_GLTF: Matrix = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// A vertex of a mesh file, (x, y, z), is (x, y, −z) in `InnerModel`.
pub(crate) const OF_MESH: Matrix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];

pub(crate) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| (0..3).map(|n| a[row][n] * b[n][column]).sum()))
}

pub(crate) fn transposed(a: &Matrix) -> Matrix {
    [0, 1, 2].map(|row| [0, 1, 2].map(|column| a[column][row]))
}

pub(crate) fn apply(a: &Matrix, v: &Vector) -> Vector {
    [0, 1, 2].map(|row| (0..3).map(|n| a[row][n] * v[n]).sum())
}

pub(crate) fn cross(a: &Vector, b: &Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn dot(a: &Vector, b: &Vector) -> f64 {
    (0..3).map(|n| a[n] * b[n]).sum()
}

/// The vector with length 1. There is none for a vector of almost no length.
pub(crate) fn unit(v: &Vector) -> Option<Vector> {
    let length = dot(v, v).sqrt();
    (length > 1e-12).then(|| v.map(|part| part / length))
}

/// The matrix about an axis: 0 is x, 1 is y, 2 is z.
fn about(axis: usize, angle: f64) -> Matrix {
    let (sin, cos) = angle.sin_cos();
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut matrix = IDENTITY;
    (matrix[next][next], matrix[last][last]) = (cos, cos);
    (matrix[next][last], matrix[last][next]) = (-sin, sin);
    matrix
}

/// Rx·Ry·Rz: the angles of `InnerModel`.
pub(crate) fn of_angles([x, y, z]: Vector) -> Matrix {
    product(&product(&about(0, x), &about(1, y)), &about(2, z))
}

/// The angles of `InnerModel`.
pub(crate) fn angles(r: &Matrix) -> Vector {
    let flat = r[0][0].hypot(r[0][1]);
    let y = r[0][2].atan2(flat);
    if flat > 1e-12 {
        [(-r[1][2]).atan2(r[2][2]), y, (-r[0][1]).atan2(r[0][0])]
    } else {
        [0.0, y, r[1][0].atan2(r[1][1])]
    }
}

/// Rz·Ry·Rx: the angles `rpy` of URDF.
pub(crate) fn of_rpy([roll, pitch, yaw]: Vector) -> Matrix {
    product(&product(&about(2, yaw), &about(1, pitch)), &about(0, roll))
}

/// The angles `rpy` of URDF.
pub(crate) fn rpy(r: &Matrix) -> Vector {
    // The transposed matrix is Rx(−r)·Ry(−p)·Rz(−y).
    angles(&transposed(r)).map(|angle| -angle)
}

/// A rotation that takes `from` to `to`, both of length 1, by the shortest way. Half a turn, which
/// has no shortest way, is about y, or about x where `from` is ±y.
pub(crate) fn between(from: &Vector, to: &Vector) -> Matrix {
    let (axis, cos) = (cross(from, to), dot(from, to));
    if cos < -1.0 + 1e-12 {
        let axis = usize::from(from[1].abs() < 0.9);
        return about(axis, std::f64::consts::PI);
    }
    let [x, y, z] = axis;
    let skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let square = product(&skew, &skew);
    [0, 1, 2].map(|row| {
        [0, 1, 2].map(|n| IDENTITY[row][n] + skew[row][n] + square[row][n] / (1.0 + cos))
    })
}

/// The place of a frame in another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    pub(crate) rotation: Matrix,
    pub(crate) translation: Vector,
}

impl Placement {
    pub(crate) const HERE: Self = Self {
        rotation: IDENTITY,
        translation: [0.0; 3],
    };

    /// This one after `inner`.
    pub(crate) fn then_inner(&self, inner: &Self) -> Self {
        let moved = apply(&self.rotation, &inner.translation);
        Self {
            rotation: product(&self.rotation, &inner.rotation),
            translation: [0, 1, 2].map(|n| moved[n] + self.translation[n]),
        }
    }

    /// The place, with other axes and another unit of length.
    pub(crate) fn changed(&self, axes: &Matrix, scale: f64) -> Self {
        Self {
            rotation: product(&product(axes, &self.rotation), &transposed(axes)),
            translation: apply(axes, &self.translation).map(|length| length * scale),
        }
    }
}
