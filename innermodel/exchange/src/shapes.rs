//! Where bodies are, and their triangles.

use crate::matrix::{Placement, between, of_angles, unit};
use innermodel_language::Pose;
use innermodel_language::model::{Plane, Shape};
use innermodel_mesh::TriangleMesh;
use std::f64::consts::PI;

/// How many sides a ball, a cylinder or a cone has around its axis.
const SIDES: u32 = 32;

pub(crate) fn place(pose: &Pose) -> Placement {
    Placement {
        rotation: of_angles(pose.rotation),
        translation: pose.translation,
    }
}

/// The place of the box of a plane: turned by the shortest way from −z to its normal, then moved.
pub(crate) fn board(plane: &Plane) -> Placement {
    let normal = unit(&plane.normal);
    Placement {
        rotation: normal.map_or(Placement::HERE.rotation, |to| {
            between(&[0.0, 0.0, -1.0], &to)
        }),
        translation: plane.point,
    }
}

/// A ball, a cylinder or a cone as a body of rotation about y.
pub(crate) fn solid(shape: Shape) -> TriangleMesh {
    // Radius and height of its rings, from below.
    let rings: Vec<(f64, f64)> = match shape {
        Shape::Sphere { radius } => (0..=SIDES / 2)
            .map(|ring| {
                let angle = PI * f64::from(ring) / f64::from(SIDES / 2);
                (radius * angle.sin(), -radius * angle.cos())
            })
            .collect(),
        Shape::Cylinder { radius, length } => {
            let half = length / 2.0;
            vec![(0.0, -half), (radius, -half), (radius, half), (0.0, half)]
        }
        Shape::Cone { radius, length } => {
            let half = length / 2.0;
            vec![(0.0, -half), (radius, -half), (0.0, half)]
        }
    };
    let mut mesh = TriangleMesh::default();
    for (radius, height) in &rings {
        mesh.vertices.extend((0..SIDES).map(|side| {
            let (sin, cos) = (2.0 * PI * f64::from(side) / f64::from(SIDES)).sin_cos();
            [radius * sin, *height, radius * cos]
        }));
    }
    for ring in 0..rings.len() as u32 - 1 {
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            let (a, b) = (ring * SIDES + side, ring * SIDES + next);
            let (c, d) = (a + SIDES, b + SIDES);
            // At a tip, two corners are one point.
            if rings[ring as usize].0 > 1e-12 {
                mesh.triangles.push([a, b, d]);
            }
            if rings[ring as usize + 1].0 > 1e-12 {
                mesh.triangles.push([a, d, c]);
            }
        }
    }
    mesh
}
