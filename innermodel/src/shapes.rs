//! The bodies of nodes.

use crate::transform::Transform;
use crate::{Pose, Vector};
use innermodel_language::model::{Kind, Mesh, Plane, Shape};
use nalgebra::Rotation3;

/// A body, in a frame of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Body<'k> {
    /// A box with these lengths along x, y and z, its centre at the origin.
    Box([f64; 3]),
    /// A ball, a cylinder or a cone. The axis is y, the tip of a cone is at +y.
    Solid(Shape),
    /// A mesh of a file.
    Mesh(&'k Mesh),
}

/// The body of a node, and the transform from the frame of the body to that of the node.
pub fn body(kind: &Kind) -> Option<(Body<'_>, Transform)> {
    match kind {
        Kind::Plane(plane) => Some(board(plane)),
        Kind::Display(display) => Some(board(&display.plane)),
        Kind::Mesh(mesh) => Some((Body::Mesh(mesh), Transform::identity())),
        Kind::Solid(solid) => Some((Body::Solid(solid.shape), Transform::identity())),
        _ => None,
    }
}

fn board(plane: &Plane) -> (Body<'_>, Transform) {
    (Body::Box(plane.size.map(f64::abs)), board_transform(plane))
}

/// Where the box of a plane is: turned by the shortest way from −z to its normal, then moved.
pub fn board_transform(plane: &Plane) -> Transform {
    let back = Vector::new(0.0, 0.0, -1.0);
    let normal = Vector::from(plane.normal);
    let rotation = if normal.norm() < 1e-12 {
        Rotation3::identity()
    } else {
        // Half a turn has no shortest way: it is about y.
        Rotation3::rotation_between(&back, &normal)
            .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector::y_axis(), std::f64::consts::PI))
    };
    Transform {
        rotation: rotation.into_inner(),
        translation: plane.point.into(),
    }
}

/// The three bars of `axes`, each with its colour, and where they are: along x in red, y in green
/// and z in blue.
pub fn bars(lengths: [f64; 3], widths: [f64; 3]) -> [([f64; 3], Transform, [u8; 3]); 3] {
    [0, 1, 2].map(|axis| {
        let mut size = [widths[axis]; 3];
        size[axis] = lengths[axis];
        let mut pose = Pose::default();
        pose.translation[axis] = lengths[axis] / 2.0;
        let mut colour = [0; 3];
        colour[axis] = 255;
        (size, Transform::of(&pose), colour)
    })
}

/// Whether a point in the frame of a body is in it.
pub fn contains(shape: Shape, point: &Vector) -> bool {
    let from_axis = point.x.hypot(point.z);
    match shape {
        Shape::Sphere { radius } => point.norm() <= radius,
        Shape::Cylinder { radius, length } => from_axis <= radius && point.y.abs() <= length / 2.0,
        Shape::Cone { radius, length } => {
            let below_tip = length / 2.0 - point.y;
            (0.0..=length).contains(&below_tip) && from_axis * length <= radius * below_tip
        }
    }
}

/// Where a ray meets the surface of a body first: a multiple of the direction `way`, and the
/// normal there, of any length. Start and direction are in the frame of the body. Only multiples of
/// at least `least` count.
pub fn meet(shape: Shape, start: &Vector, way: &Vector, least: f64) -> Option<(f64, Vector)> {
    let mut best: Option<(f64, Vector)> = None;
    let mut take = |t: f64, normal: Vector| {
        if t >= least && best.is_none_or(|(before, _)| t < before) {
            best = Some((t, normal));
        }
    };
    let (start, way) = (*start, *way);
    let at = |t: f64| start + way * t;
    match shape {
        Shape::Sphere { radius } => {
            let (b, c) = (start.dot(&way), start.norm_squared() - radius * radius);
            roots(way.norm_squared(), b, c, &mut |t| take(t, at(t)));
        }
        Shape::Cylinder { radius, length } => {
            let half = length / 2.0;
            let flat = |a: Vector, b: Vector| a.x * b.x + a.z * b.z;
            let c = flat(start, start) - radius * radius;
            roots(flat(way, way), flat(start, way), c, &mut |t| {
                let p = at(t);
                if p.y.abs() <= half {
                    take(t, Vector::new(p.x, 0.0, p.z));
                }
            });
            for end in [-half, half] {
                let t = (end - start.y) / way.y;
                if t.is_finite() && flat(at(t), at(t)) <= radius * radius {
                    take(t, Vector::new(0.0, end, 0.0));
                }
            }
        }
        Shape::Cone { radius, length } => {
            // x² + z² = (slope·(tip − y))²
            let (half, slope) = (length / 2.0, radius / length);
            let down = half - start.y;
            let flat = |a: Vector, b: Vector| a.x * b.x + a.z * b.z;
            let square = flat(way, way) - slope * slope * way.y * way.y;
            let linear = flat(start, way) + slope * slope * down * way.y;
            let constant = flat(start, start) - slope * slope * down * down;
            roots(square, linear, constant, &mut |t| {
                let p = at(t);
                if p.y.abs() <= half {
                    take(t, Vector::new(p.x, slope * slope * (half - p.y), p.z));
                }
            });
            let end = (-half - start.y) / way.y;
            if end.is_finite() && flat(at(end), at(end)) <= radius * radius {
                take(end, -Vector::y());
            }
        }
    }
    best
}

/// The solutions of a·t² + 2·b·t + c = 0.
fn roots(a: f64, b: f64, c: f64, take: &mut dyn FnMut(f64)) {
    if a.abs() < 1e-15 {
        if b != 0.0 {
            take(-c / (2.0 * b));
        }
        return;
    }
    let square = b * b - a * c;
    if square >= 0.0 {
        // The larger one first: the other one of their product loses no digits.
        let q = -(b + square.sqrt().copysign(b));
        take(q / a);
        if q != 0.0 {
            take(c / q);
        }
    }
}
