//! Where a ray meets a body.

use crate::bodies::{METRE, Solid};
use innermodel::kinds::Shape;
use innermodel::{Kind, Vector, shapes};
use parry3d_f64::math::Vector as Meters;
use parry3d_f64::partitioning::BvhNode;
use parry3d_f64::query::Ray;

/// The greatest factor of [`Slabs`]: a product with a coordinate is finite, and 0 times it is 0.
const STEEPEST: f64 = 1e290;
/// By how much boxes are larger for a ray, in m: rounding loses none, nor does a ray in a side.
const MARGIN: f64 = 1e-12;

/// A ray as boxes meet it: by the planes of their sides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    /// The origin, for the lower and the upper sides of boxes.
    origins: [Meters; 2],
    /// One divided by each coordinate of the direction.
    inverse: Meters,
}

impl Slabs {
    pub(crate) fn new(ray: &Ray) -> Self {
        let inverse = |n: f64| (1.0 / n).clamp(-STEEPEST, STEEPEST);
        Self {
            origins: [
                ray.origin + Meters::splat(MARGIN),
                ray.origin - Meters::splat(MARGIN),
            ],
            inverse: Meters::new(inverse(ray.dir.x), inverse(ray.dir.y), inverse(ray.dir.z)),
        }
    }

    /// The way to a box, `f64::MAX` if it is longer than `most` or there is none.
    #[inline]
    pub(crate) fn enter(&self, node: &BvhNode, most: f64) -> f64 {
        let one = (node.mins() - self.origins[0]) * self.inverse;
        let other = (node.maxs() - self.origins[1]) * self.inverse;
        let enter = one.min(other).max_element().max(0.0);
        let leave = one.max(other).min_element();
        if enter <= leave && enter <= most {
            enter
        } else {
            f64::MAX
        }
    }
}

/// The way along a ray to a body in metres, at most `most`. A ray that starts in a body with a
/// volume meets it at 0. The direction has the length 1.
pub(crate) fn distance(solid: &Solid, ray: &Ray, most: f64) -> Option<f64> {
    if let Kind::Solid(round) = solid.kind() {
        return Some(closed_form(round.shape, solid, ray, most)?.0);
    }
    let Some((tree, mesh)) = solid.triangles() else {
        return solid.shape.cast_ray(&solid.pose, ray, most, true);
    };
    let local = ray.inverse_transform_by(&solid.pose);
    Some(tree.meet(mesh, &local, most)?.0)
}

/// The distance, and the normal of the surface in the root, of any length. The normal is 0 if the
/// ray starts in the body.
pub(crate) fn meet(solid: &Solid, ray: &Ray, most: f64) -> Option<(f64, Meters)> {
    if let Kind::Solid(round) = solid.kind() {
        return closed_form(round.shape, solid, ray, most);
    }
    let Some((tree, mesh)) = solid.triangles() else {
        let hit = solid
            .shape
            .cast_ray_and_get_normal(&solid.pose, ray, most, true)?;
        return Some((hit.time_of_impact, hit.normal));
    };
    let local = ray.inverse_transform_by(&solid.pose);
    let (way, normal) = tree.meet(mesh, &local, most)?;
    Some((way, solid.pose.rotation * normal))
}

/// For balls, cylinders and cones: the general algorithm for convex bodies takes many times as
/// long.
fn closed_form(shape: Shape, solid: &Solid, ray: &Ray, most: f64) -> Option<(f64, Meters)> {
    let local = ray.inverse_transform_by(&solid.pose);
    let number = |v: Meters| Vector::new(v.x, v.y, v.z);
    let (start, way) = (number(local.origin) * METRE, number(local.dir));
    if shapes::contains(shape, &start) {
        return Some((0.0, Meters::ZERO));
    }
    let (distance, normal) = shapes::meet(shape, &start, &way, 0.0)?;
    let normal = solid.pose.rotation * Meters::new(normal.x, normal.y, normal.z);
    (distance <= most * METRE).then_some((distance / METRE, normal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Space;
    use innermodel::{InnerModel, Pose, Time};
    use parry3d_f64::bounding_volume::Aabb;
    use parry3d_f64::query::RayCast;

    /// The closed forms agree with the general algorithm.
    #[test]
    fn closed_forms_equal_the_general_algorithm() {
        let shapes = [
            r#"<sphere id="body" radius="300" tx="100" ty="-50" tz="20" rx="0.3"/>"#,
            r#"<cylinder id="body" radius="200" length="700" tx="100" ty="-50" tz="20" rx="0.3" rz="1"/>"#,
            r#"<cone id="body" radius="250" length="600" tx="100" ty="-50" tz="20" rx="0.3" rz="1"/>"#,
        ];
        for shape in shapes {
            let text = format!("<innerModel>{shape}</innerModel>");
            let model = InnerModel::parse(&text).expect("a model");
            let space = Space::new(&model.snapshot());
            let solid = space.solids[0].as_ref().expect("a body");
            let (mut met, mut missed) = (0, 0);
            for number in 0..4000_u32 {
                let part = |factor: f64| (f64::from(number) * factor).fract() * 2.0 - 1.0;
                let start = Meters::new(part(0.618_034), part(0.754_878), part(0.569_84));
                let to = Meters::new(part(0.819_173), part(0.671_044), part(0.549_7)) * 0.4;
                let ray = Ray::new(start, (to - start).normalize());
                let ours = distance(solid, &ray, 3.0);
                let general = solid.shape.cast_ray(&solid.pose, &ray, 3.0, true);
                match (ours, general) {
                    (Some(ours), Some(general)) => {
                        assert!((ours - general).abs() < 1e-4, "{shape} {ray:?}");
                        met += 1;
                    }
                    (None, None) => missed += 1,
                    // The general algorithm is not exact where a ray only grazes a body.
                    (ours, _) => {
                        let near = ray.point_at(
                            ours.unwrap_or_else(|| general.expect("one of them meets the body")),
                        );
                        let along = ray.point_at(1e-3) - ray.origin;
                        let local = solid.pose.inverse() * (near + along * 5.0);
                        let deep = Vector::new(local.x, local.y, local.z) * METRE * 0.98;
                        let Kind::Solid(round) = solid.kind() else {
                            panic!("a solid");
                        };
                        assert!(!shapes::contains(round.shape, &deep), "{shape} {ray:?}");
                    }
                }
            }
            assert!(met > 500 && missed > 500, "{shape}: {met} {missed}");
        }
    }

    /// Numbers from −1 to 1 that are equal in each run.
    fn part(number: u32, factor: f64) -> f64 {
        (f64::from(number) * factor).fract() * 2.0 - 1.0
    }

    #[test]
    fn boxes_are_met_as_the_library_meets_them() {
        let bounds = Aabb::new(Meters::new(-0.5, -0.25, 0.0), Meters::new(0.5, 0.25, 0.75));
        let node = BvhNode::leaf(bounds, 0);
        let (mut met, mut missed) = (0, 0);
        for number in 0..3000_u32 {
            let mut start = Meters::new(
                part(number, 0.618_034),
                part(number, 0.754_878),
                part(number, 0.569_84),
            );
            let mut way = Meters::new(
                part(number, 0.819_173),
                part(number, 0.671_044),
                part(number, 0.549_7),
            );
            match number % 3 {
                // Along an axis, and along a side of the box.
                0 => way = Meters::new(0.0, 0.0, if number % 2 == 0 { 1.0 } else { -1.0 }),
                1 => (start.x, way.x) = (0.5, 0.0),
                _ => {}
            }
            let ray = Ray::new(start, way.normalize());
            let expected = bounds.cast_local_ray(&ray, 2.0, true);
            let found = Slabs::new(&ray).enter(&node, 2.0);
            if let Some(expected) = expected {
                assert!((found - expected).abs() < 1e-9, "{ray:?} {found}");
                met += 1;
            } else {
                assert_eq!(found, f64::MAX, "{ray:?}");
                missed += 1;
            }
        }
        assert!(met > 100 && missed > 100, "{met} {missed}");
    }

    #[test]
    fn boxes_around_cylinders_are_those_of_the_library() {
        for number in 0..200_u32 {
            let [rx, ry, rz] = [0.618_034, 0.754_878, 0.569_84].map(|f| 3.0 * part(number, f));
            let text = format!(
                r#"<innerModel><cylinder id="body" radius="200" length="700" tx="100" ty="-50" rx="{rx}" ry="{ry}" rz="{rz}"/></innerModel>"#
            );
            let space = Space::new(&InnerModel::parse(&text).expect("a model").snapshot());
            let solid = space.solids[0].as_ref().expect("a body");
            let (own, general) = (
                solid.bounds(&solid.pose),
                solid.shape.compute_aabb(&solid.pose),
            );
            let apart = (own.mins - general.mins).length() + (own.maxs - general.maxs).length();
            assert!(apart < 1e-6, "{own:?} {general:?}");
        }
    }

    /// How many boxes a ray visits in the tree of boxes.
    fn boxes(space: &Space, ray: &Ray) -> usize {
        let mut visited = 0;
        space.bvh.traverse(|node| {
            visited += 1;
            if node.cast_ray(ray, 100.0) < f64::MAX {
                parry3d_f64::partitioning::TraversalAction::Continue
            } else {
                parry3d_f64::partitioning::TraversalAction::Prune
            }
        });
        visited
    }

    /// Bodies that have driven across the hall leave no large boxes, and the boxes that a ray
    /// visits hardly grow with the bodies.
    #[test]
    fn boxes_follow_what_moves() {
        let mut visited = Vec::new();
        for side in [8_u32, 16, 32] {
            let mut text = String::new();
            for ball in 0..side * side {
                let (x, z) = (ball % side * 1000, ball / side * 1000);
                text += &format!(
                    r#"<transform id="t{ball}" tx="{x}" tz="{z}"><sphere id="s{ball}" radius="200"/></transform>"#
                );
            }
            let model = InnerModel::parse(&format!("<innerModel>{text}</innerModel>"));
            let model = model.expect("a model");
            let mut space = Space::new(&model.snapshot());
            // Each ball goes to a place elsewhere in the hall, four times.
            for round in 1..=4 {
                for ball in 0..side * side {
                    let there = (ball * (2 * round + 1) * 7 + 13 * round) % (side * side);
                    let (x, z) = (there % side * 1000, there / side * 1000);
                    let pose = Pose::new(f64::from(x), 0.0, f64::from(z), 0.0, 0.0, 0.0);
                    let id = format!("t{ball}");
                    model
                        .change(Time::ZERO, |edit| edit.set_pose(&id, pose))
                        .expect("a change");
                    assert_eq!(space.update(&model.snapshot()), 1);
                }
            }
            // Upwards between the balls: only the boxes around many of them are in the way.
            let rays = (0..100_u32).map(|number| {
                let at = |step: u32| f64::from(number * step % (side - 1)) + 0.5;
                let start = Meters::new(at(7), -5.0, at(11));
                Ray::new(start, Meters::new(0.0, 1.0, 0.0))
            });
            let all: usize = rays.map(|ray| boxes(&space, &ray)).sum();
            visited.push(all / 100);
        }
        // Sixteen times as many balls: a tree that is four levels deeper.
        assert!(
            visited[0] < 40 && visited[2] < 3 * visited[0],
            "{visited:?}"
        );
    }
}
