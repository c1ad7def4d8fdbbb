//! The tree beside all triangles, one after the other.

use super::*;
use crate::parry::shape::TriMeshBuilderError;

/// Numbers from −1 to 1 that are the same in each run.
fn part(number: u32, factor: f64) -> f64 {
    (f64::from(number) * factor).fract() * 2.0 - 1.0
}

fn direction(number: u32) -> Vector {
    let factors = [0.819_173, 0.671_044, 0.549_7];
    Vector::from_array(factors.map(|factor| part(number, factor)))
}

/// A ball with bumps, its middle at `middle`.
fn ball(middle: Vector, radius: f64) -> TriMesh {
    let (rings, sides) = (40_u32, 40_u32);
    let mut vertices = Vec::new();
    for (ring, side) in (0..=rings).flat_map(|ring| (0..sides).map(move |side| (ring, side))) {
        let (t, p) = (
            std::f64::consts::PI * f64::from(ring) / f64::from(rings),
            std::f64::consts::TAU * f64::from(side) / f64::from(sides),
        );
        let r = radius * (1.0 + 0.1 * (9.0 * t).sin() * (7.0 * p).cos());
        vertices.push(middle + Vector::new(t.sin() * p.cos(), t.cos(), t.sin() * p.sin()) * r);
    }
    let mut triangles = Vec::new();
    for (ring, side) in (0..rings).flat_map(|ring| (0..sides).map(move |side| (ring, side))) {
        let (a, b) = (ring * sides + side, ring * sides + (side + 1) % sides);
        triangles.extend([[a, b, a + sides], [b, b + sides, a + sides]]);
    }
    mesh(vertices, triangles).expect("a mesh")
}

fn mesh(vertices: Vec<Vector>, triangles: Vec<[u32; 3]>) -> Result<TriMesh, TriMeshBuilderError> {
    TriMesh::new(vertices, triangles)
}

/// The tree gives exactly what all triangles give, one after the other. Returns how many of the
/// rays meet the mesh.
fn compare(mesh: &TriMesh, rays: impl Iterator<Item = (Ray, f64)>) -> usize {
    let (tree, mut met) = (RayTree::new(mesh), 0);
    for (ray, most) in rays {
        let hits = mesh
            .triangles()
            .filter_map(|triangle| triangle.cast_local_ray_and_get_normal(&ray, most, true));
        let ways = hits.map(|hit| hit.time_of_impact);
        let expected = ways.reduce(f64::min);
        let found = tree.meet(mesh, &ray, most);
        assert_eq!(found.map(|(way, _)| way), expected, "{ray:?}");
        if let Some((_, normal)) = found {
            assert!(normal.dot(ray.dir) <= 0.0, "{ray:?}");
            met += 1;
        }
    }
    met
}

#[test]
fn rays_meet_what_all_triangles_meet() {
    for (middle, radius) in [
        (Vector::ZERO, 1.0),
        (Vector::new(500.0, -2000.0, 30.0), 0.01),
        (Vector::ZERO, 1e-9),
        (Vector::new(1e12, 0.0, 0.0), 1e9),
        (Vector::ZERO, 1e60),
    ] {
        let mesh = ball(middle, radius);
        let rays = (0..1500_u32).map(|number| {
            let factors = [0.618_034, 0.754_878, 0.569_84];
            let start = Vector::from_array(factors.map(|factor| part(number, factor)));
            // From inside, from near, and from far away; along an axis, and through vertices.
            let start = start * [0.5, 3.0, 1e5][number as usize % 3];
            let way = match number % 5 {
                0 => Vector::from_array([0, 1, 2].map(|axis| {
                    let is_axis = number as usize / 5 % 3 == axis;
                    if is_axis { -start[axis].signum() } else { 0.0 }
                })),
                1 => (mesh.vertices()[number as usize] - middle) / radius - start,
                _ => direction(number) * 0.9 - start,
            };
            let ray = Ray::new(middle + start * radius, way.normalize());
            let most = if number % 7 == 0 {
                2.5 * radius
            } else {
                f64::MAX
            };
            (ray, most)
        });
        let met = compare(&mesh, rays);
        assert!((500..1400).contains(&met), "{radius}: {met}");
    }
}

/// Bodies without a depth, triangles without an area, and many at one place.
#[test]
fn flat_and_degenerate_meshes_are_met() {
    let corner = |x: u32, y: u32| Vector::new(f64::from(x), f64::from(y), 0.0);
    let points = (0..12).flat_map(|x| (0..12).map(move |y| corner(x, y)));
    let mut flat = Vec::new();
    for (x, y) in (0..11).flat_map(|x| (0..11).map(move |y| (x, y))) {
        let at = x * 12 + y;
        flat.extend([[at, at + 1, at + 12], [at + 1, at + 13, at + 12]]);
    }
    flat.push([5, 5, 5]);
    let one = vec![corner(0, 0), corner(9, 0), corner(0, 9)];
    for mesh in [
        mesh(points.collect(), flat).expect("a mesh"),
        mesh(one.clone(), vec![[0, 1, 2]; 100]).expect("a mesh"),
        mesh(one, vec![[0, 1, 2]]).expect("a mesh"),
    ] {
        let rays = (0..600_u32).map(|number| {
            let start = Vector::new(part(number, 0.6), part(number, 0.3), 1.0) * 12.0;
            let way = match number % 3 {
                0 => -Vector::Z,
                1 => Vector::X,
                _ => (direction(number) + Vector::new(2.0, 2.0, 0.0)) * 2.0 - start,
            };
            (Ray::new(start, way.normalize()), 100.0)
        });
        let met = compare(&mesh, rays);
        assert!(met > 50, "{met}");
    }
}

/// Triangles of which each is half as large as the one before: free splits part one of them.
#[test]
fn the_depth_has_a_bound() {
    let mut vertices = Vec::new();
    for number in 0..1000 {
        let size = 0.97_f64.powi(number);
        let a = Vector::new(size, size * size, 0.0);
        vertices.extend([a, a + Vector::X * size * 0.01, a + Vector::Z * size * 0.01]);
    }
    let triangles: Vec<[u32; 3]> = (0..1000).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    let tree = RayTree::new(&mesh(vertices, triangles).expect("a mesh"));
    let (mut depths, mut deepest) = (vec![1; tree.nodes.len()], 0);
    let mut leaves = 0;
    for (at, node) in tree.nodes.iter().enumerate() {
        deepest = deepest.max(depths[at]);
        for (lane, child) in node.children.iter().enumerate() {
            match child.triangles() {
                _ if node.mins[0][lane] == f32::INFINITY => {}
                Some(places) => leaves += places.len(),
                None => depths[child.0 as usize] = depths[at] + 1,
            }
        }
    }
    assert_eq!(leaves, 1000);
    assert!(deepest < DEEPEST, "{deepest}");
}
