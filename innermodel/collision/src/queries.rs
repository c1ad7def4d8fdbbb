//! Questions about bodies.
//!
//! A body that is named itself always counts. Below a named node, those with `collide` count.

use crate::allowed::allowed;
use crate::bodies::{METRE, Solid, Space, pose, vector};
use crate::rays::{Slabs, distance as way, meet};
use innermodel::{Error, Key, NodeId, NodeRef, Point, Vector};
use parry3d_f64::math::Pose;
use parry3d_f64::math::Vector as Meters;
use parry3d_f64::query::{
    ClosestPoints, Ray, closest_points, contact, distance, intersection_test,
};

/// Two bodies that touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// One node.
    pub a: NodeId,
    /// The other one.
    pub b: NodeId,
    /// How deep they are in each other, in millimetres. Two meshes have no depth.
    pub depth: Option<f64>,
    /// A point of the contact, in the root.
    pub point: Option<Point>,
    /// From `a` to `b`, in the root.
    pub normal: Option<Vector>,
}

/// The two bodies that are nearest to each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Near {
    /// One node.
    pub a: NodeId,
    /// The other one.
    pub b: NodeId,
    /// In millimetres; 0 if they touch.
    pub distance: f64,
    /// The points of both that are nearest to each other, in the root, if they do not touch.
    pub points: Option<(Point, Point)>,
}

/// First hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// The node.
    pub node: NodeId,
    /// From the start of the ray, in millimetres.
    pub distance: f64,
    /// Where, in the frame of the ray.
    pub point: Point,
    /// The normal of the surface, in the frame of the ray.
    pub normal: Vector,
}

/// Casts rays from one frame.
#[derive(Clone, Copy, Debug)]
pub struct Caster<'s> {
    space: &'s Space,
    frame: Pose,
}

impl Caster<'_> {
    /// The first body that a ray from the origin of the frame meets within `range` millimetres, and
    /// its distance in millimetres. The direction has the length 1. Bodies that `counts` refuses
    /// are looked through.
    pub fn cast(
        &self,
        direction: &Vector,
        range: f64,
        counts: &dyn Fn(NodeId) -> bool,
    ) -> Option<(NodeId, f64)> {
        let ray = Ray::new(
            self.frame.translation,
            self.frame.rotation * vector(direction),
        );
        let slabs = Slabs::new(&ray);
        let first = self.space.bvh.find_best(
            range / METRE,
            |node, best| slabs.enter(node, best),
            |place, best| {
                let solid = self.space.near(place)?;
                if !counts(solid.node) {
                    return None;
                }
                way(solid, &ray, best)
            },
        );
        let (place, distance) = first?;
        let solid = self.space.near(place)?;
        Some((solid.node, distance * METRE))
    }
}

fn point(v: Meters) -> Point {
    Point::new(v.x, v.y, v.z) * METRE
}

impl Space {
    /// The bodies that count for a name.
    fn named(&self, key: impl Key) -> Result<Vec<&Solid>, Error> {
        let top = self.tree.node(key)?;
        if let Some(solid) = self.solid(top.node_id()) {
            return Ok(vec![solid]);
        }
        let below = top.subtree().filter(|node| node.kind().collides());
        Ok(below
            .filter_map(|node| self.solid(node.node_id()))
            .collect())
    }

    /// Whether a body of one node, with all below it, touches one of another node. `allowed` does
    /// not matter.
    pub fn collide(&self, a: impl Key, b: impl Key) -> Result<bool, Error> {
        let (a, b) = (self.named(a)?, self.named(b)?);
        let mut pairs = a.iter().flat_map(|a| b.iter().map(move |b| (*a, *b)));
        Ok(pairs.any(|(a, b)| a.node != b.node && touch(a, b)))
    }

    /// The contacts between the bodies of two nodes, with all below them.
    pub fn contacts(&self, a: impl Key, b: impl Key) -> Result<Vec<Contact>, Error> {
        let (a, b) = (self.named(a)?, self.named(b)?);
        let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (*a, *b)));
        let apart = pairs.filter(|(a, b)| a.node != b.node);
        Ok(apart.filter_map(|(a, b)| touching(a, b)).collect())
    }

    /// All contacts of bodies with `collide` that are not allowed to touch.
    pub fn collisions(&self) -> Vec<Contact> {
        let mut found = Vec::new();
        for place in 0..self.solids.len() as u32 {
            let Some(a) = self.near(place).filter(|solid| self.collides(solid)) else {
                continue;
            };
            let bounds = a.bounds(&a.pose);
            for other in self.bvh.intersect_aabb(&bounds) {
                let b = self
                    .near(other)
                    .filter(|b| other > place && self.collides(b));
                if let Some(b) = b
                    && !allowed(&self.tree, a.node, b.node)
                    && let Some(contact) = touching(a, b)
                {
                    found.push(contact);
                }
            }
        }
        found.sort_by_key(|contact| (contact.a, contact.b));
        found
    }

    pub(crate) fn collides(&self, solid: &Solid) -> bool {
        self.tree
            .node(solid.node)
            .is_ok_and(|node| node.kind().collides())
    }

    /// The least distance between the bodies of two nodes, with all below them. `None` if one has
    /// no body.
    pub fn distance(&self, a: impl Key, b: impl Key) -> Result<Option<Near>, Error> {
        let (a, b) = (self.named(a)?, self.named(b)?);
        let mut pairs: Vec<(f64, &Solid, &Solid)> = Vec::new();
        for a in &a {
            let bounds = a.bounds(&a.pose);
            for b in b.iter().filter(|b| b.node != a.node) {
                let other = b.bounds(&b.pose);
                let apart = (bounds.mins - other.maxs).max(other.mins - bounds.maxs);
                pairs.push((apart.max(Meters::ZERO).length(), a, b));
            }
        }
        // No pair is nearer than its boxes.
        pairs.sort_by(|x, y| x.0.total_cmp(&y.0));
        let mut best: Option<(f64, &Solid, &Solid)> = None;
        for (least, a, b) in pairs {
            if best.is_some_and(|(nearest, ..)| nearest <= least) {
                break;
            }
            let apart = distance(&a.pose, &*a.shape, &b.pose, &*b.shape);
            let apart = apart.map_or(f64::INFINITY, |found| found.distance);
            if best.is_none_or(|(nearest, ..)| apart < nearest) {
                best = Some((apart, a, b));
            }
        }
        Ok(best.map(|(apart, a, b)| {
            let points = closest_points(&a.pose, &*a.shape, &b.pose, &*b.shape, f64::MAX);
            let points = match points {
                Ok(ClosestPoints::WithinMargin(one, other, ..)) => Some((point(one), point(other))),
                _ => None,
            };
            Near {
                a: a.node,
                b: b.node,
                distance: apart * METRE,
                points,
            }
        }))
    }

    /// Casts many rays from one frame.
    pub fn caster(&self, from: impl Key) -> Result<Caster<'_>, Error> {
        let frame = pose(&self.tree.between(NodeId::ROOT, from)?);
        Ok(Caster { space: self, frame })
    }

    /// The least of half the lengths of the boxes around the bodies below a node that collide, in
    /// millimetres. 0 without such bodies. A motion in shorter pieces jumps over no other body.
    pub fn half_thickness(&self, top: impl Key) -> Result<f64, Error> {
        let top = self.tree.node(top)?;
        let halves = self.colliding(top).map(|solid| {
            let half = solid.shape.compute_local_aabb().half_extents();
            half.x.min(half.y).min(half.z)
        });
        Ok(halves.reduce(f64::min).unwrap_or(0.0) * METRE)
    }

    /// How far the bodies below a node that collide are from its y axis at most, in millimetres. 0
    /// without such bodies.
    pub fn reach(&self, top: impl Key) -> Result<f64, Error> {
        let top = self.tree.node(top)?;
        let back = pose(&top.to_root()).inverse();
        let reaches = self.colliding(top).map(|solid| {
            let bounds = solid.shape.compute_local_aabb();
            let centre = back * (solid.pose * bounds.center());
            centre.x.hypot(centre.z) + bounds.half_extents().length()
        });
        Ok(reaches.fold(0.0, f64::max) * METRE)
    }

    /// The bodies below a node that collide.
    fn colliding(&self, top: NodeRef<'_>) -> impl Iterator<Item = &Solid> {
        let colliding = top.subtree().filter(|node| node.kind().collides());
        let ids: Vec<NodeId> = colliding.map(|node| node.node_id()).collect();
        ids.into_iter().filter_map(|id| self.solid(id))
    }

    /// The first hit of a ray within `range` millimetres. Start and direction are in the frame of
    /// `from`; the direction may have any length. Bodies that `counts` refuses are looked through.
    pub fn ray(
        &self,
        from: impl Key,
        start: Point,
        direction: Vector,
        range: f64,
        counts: &dyn Fn(NodeId) -> bool,
    ) -> Result<Option<Hit>, Error> {
        let frame = self.tree.between(NodeId::ROOT, from)?;
        let length = direction.norm();
        if !(length > 0.0 && length.is_finite() && start.coords.iter().all(|n| n.is_finite())) {
            return Ok(None);
        }
        let to_root = pose(&frame);
        let ray = Ray::new(
            to_root * (vector(&start.coords) / METRE),
            to_root.rotation * (vector(&direction) / length),
        );
        let solid = |place: u32| {
            let solid = self.near(place)?;
            counts(solid.node).then_some(solid)
        };
        let slabs = Slabs::new(&ray);
        let nearest = self.bvh.find_best(
            range / METRE,
            |node, best| slabs.enter(node, best),
            |place, best| {
                let solid = solid(place)?;
                let (distance, normal) = meet(solid, &ray, best)?;
                Some((distance, (normal, solid.node)))
            },
        );
        Ok(nearest.map(|(_, (distance, (normal, node)))| {
            let normal = to_root.rotation.inverse() * normal;
            Hit {
                node,
                distance: distance * METRE,
                point: start + direction / length * distance * METRE,
                normal: Vector::new(normal.x, normal.y, normal.z),
            }
        }))
    }
}

fn touch(a: &Solid, b: &Solid) -> bool {
    let bounds = (a.bounds(&a.pose), b.bounds(&b.pose));
    if bounds.0.mins.cmpgt(bounds.1.maxs).any() || bounds.1.mins.cmpgt(bounds.0.maxs).any() {
        return false;
    }
    let found = intersection_test(&a.pose, &*a.shape, &b.pose, &*b.shape);
    found.is_ok_and(|found| found.intersecting)
}

fn touching(a: &Solid, b: &Solid) -> Option<Contact> {
    if !touch(a, b) {
        return None;
    }
    let found = contact(&a.pose, &*a.shape, &b.pose, &*b.shape, 0.0);
    let found = found.ok().flatten();
    Some(Contact {
        a: a.node,
        b: b.node,
        depth: found.map(|c| -c.dist * METRE),
        point: found.map(|c| point((c.point1 + c.point2) / 2.0)),
        normal: found.map(|c| Vector::new(c.normal1.x, c.normal1.y, c.normal1.z)),
    })
}
