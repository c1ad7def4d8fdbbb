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
