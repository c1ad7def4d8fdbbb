//! Contacts that a part of the tree would have if it moved.

use crate::allowed::allowed;
use crate::bodies::{METRE, Solid, Space, pose};
use innermodel::{Error, Key, NodeId, Transform};
use parry3d_f64::math::Pose;
use parry3d_f64::query::{contact, intersection_test};
use parry3d_f64::shape::{Shape, TriMesh};
use std::collections::BTreeSet;

/// Two bodies that touch after a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touching {
    /// The body that was moved.
    pub body: NodeId,
    /// The other one, which was not.
    pub other: NodeId,
    /// How deep they are in each other, in millimetres; of two meshes, how deep the deepest of
    /// their triangles are. `None` where the computation of the depth has failed.
    pub depth: Option<f64>,
}

impl Space {
    /// The pairs of bodies that touch if all below `top` is moved by `motion`, a transform of the
    /// root. Both have `collide`, and are not allowed to touch. Pairs that `counts` refuses do not
    /// count: first the body below `top`, then the other one.
    pub fn touching(
        &self,
        top: impl Key,
        motion: &Transform,
        counts: &dyn Fn(NodeId, NodeId) -> bool,
    ) -> Result<Vec<Touching>, Error> {
        let top = self.tree.node(top)?;
        let inside: BTreeSet<NodeId> = top.subtree().map(|node| node.node_id()).collect();
        let motion = pose(motion);
        let mut found = Vec::new();
        let colliding = top.subtree().filter(|node| node.kind().collides());
        for solid in colliding.filter_map(|node| self.solid(node.node_id())) {
            let there = motion * solid.pose;
            for other in self.bvh.intersect_aabb(&solid.bounds(&there)) {
                let Some(other) = self
                    .near(other)
                    .filter(|other| !inside.contains(&other.node))
                else {
                    continue;
                };
                if counts(solid.node, other.node)
                    && self.collides(other)
                    && !allowed(&self.tree, solid.node, other.node)
                {
                    found.extend(touch(solid, &there, other));
                }
            }
        }
        found.sort_unstable_by_key(|touching| (touching.body, touching.other));
        Ok(found)
    }
}

/// Whether two bodies touch, the first one at another pose.
fn touch(a: &Solid, at: &Pose, b: &Solid) -> Option<Touching> {
    let found = intersection_test(at, &*a.shape, &b.pose, &*b.shape);
    if !found.is_ok_and(|found| found.intersecting) {
        return None;
    }
    let depth = match contact(at, &*a.shape, &b.pose, &*b.shape, 0.0) {
        Ok(found) => found.map(|found| -found.dist),
        Err(_) => match (a.shape.as_trimesh(), b.shape.as_trimesh()) {
            (Some(one), Some(other)) if one.num_triangles() <= other.num_triangles() => {
                mesh_depth(one, at, &*b.shape, &b.pose)
            }
            (Some(_), Some(other)) => mesh_depth(other, &b.pose, &*a.shape, at),
            _ => None,
        },
    };
    Some(Touching {
        body: a.node,
        other: b.node,
        depth: depth.map(|depth| depth * METRE),
    })
}

/// The greatest depth of a triangle of a mesh in a shape, in metres.
fn mesh_depth(mesh: &TriMesh, at: &Pose, shape: &dyn Shape, place: &Pose) -> Option<f64> {
    let bounds = shape.compute_aabb(&(at.inverse() * *place));
    let near = mesh.bvh().intersect_aabb(&bounds);
    let depths = near.filter_map(|triangle| {
        let triangle = mesh.triangle(triangle);
        let found = contact(at, &triangle, place, shape, 0.0).ok().flatten()?;
        Some(-found.dist)
    });
    depths.reduce(f64::max)
}
