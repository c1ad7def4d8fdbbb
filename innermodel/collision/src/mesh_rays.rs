//! Where a ray meets a mesh first: a tree of boxes in which each node has four children, whose
//! boxes are compared at once in `f32`.
//!
//! Boxes only sort out triangles. They are larger than the errors of their computation, and each
//! triangle that is left is met in `f64`, as the library does. So the result is that of all
//! triangles in `f64`. The splits are those with the least costs by surface areas (binned SAH:
//! Wald, "On fast Construction of SAH-based Bounding Volume Hierarchies", 2007).

use parry3d_f64::glamx::Vec4;
use parry3d_f64::math::Vector;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::{TriMesh, Triangle};

/// How many boxes a node has.
const WIDTH: usize = 4;
/// By how much boxes are larger, where the mesh reaches from −1 to 1. The errors of [`Beam`] are
/// below five times 2⁻²³.
const MARGIN: f32 = 1.0 / (1 << 18) as f32;
/// How many triangles a leaf has at most: the number has two bits.
const LEAF: usize = 2;
/// In how many bins splits are looked for.
const BINS: usize = 16;
/// After so many splits above each other, the triangles are halved: this bounds the depth.
const FREE_SPLITS: u32 = 28;
/// The depth: free splits, and halves of fewer than 2²⁹ triangles.
const DEEPEST: usize = FREE_SPLITS as usize + 30;

/// The triangles of a mesh for rays.
#[derive(Debug)]
pub(crate) struct RayTree {
    nodes: Vec<Node>,
    /// The corners of triangles, in the order of the leaves.
    triangles: Vec<[u32; 3]>,
    /// The box around all: a point is its middle and a multiple of its reach.
    middle: Vector,
    reach: f64,
}

/// The boxes of four children: the coordinates x, y and z, each for all four.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Node {
    mins: [Vec4; 3],
    maxs: [Vec4; 3],
    children: [Child; WIDTH],
}

/// A node, or with the upper bit a leaf: two bits for its count less one, then its first triangle.
#[derive(Clone, Copy, Debug)]
struct Child(u32);

const IS_LEAF: u32 = 1 << 31;
const COUNT_AT: u32 = 29;

impl Child {
    fn leaf(first: usize, count: usize) -> Self {
        Self(IS_LEAF | (count as u32 - 1) << COUNT_AT | first as u32)
    }

    fn triangles(self) -> Option<std::ops::Range<usize>> {
        let first = self.0 & ((1 << COUNT_AT) - 1);
        let count = (self.0 >> COUNT_AT & 3) + 1;
        (self.0 & IS_LEAF != 0).then(|| first as usize..(first + count) as usize)
    }
}

/// A box, in parts of the reach.
#[derive(Clone, Copy)]
struct Bounds {
    mins: [f32; 3],
    maxs: [f32; 3],
}

impl Bounds {
    const EMPTY: Self = Self {
        mins: [f32::INFINITY; 3],
        maxs: [f32::NEG_INFINITY; 3],
    };

    fn join(&mut self, other: &Self) {
        for axis in 0..3 {
            self.mins[axis] = self.mins[axis].min(other.mins[axis]);
            self.maxs[axis] = self.maxs[axis].max(other.maxs[axis]);
        }
    }

    /// Twice the middle.
    fn middle(&self, axis: usize) -> f32 {
        self.mins[axis] + self.maxs[axis]
    }

    /// Half the surface.
    fn area(&self) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|axis| (self.maxs[axis] - self.mins[axis]).max(0.0));
        x * y + y * z + z * x
    }
}

/// A triangle that gets a place in the tree.
#[derive(Clone, Copy)]
struct Item {
    bounds: Bounds,
    triangle: u32,
}

fn around(items: &[Item]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    for item in items {
        bounds.join(&item.bounds);
    }
    bounds
}

impl RayTree {
    /// The tree of a mesh.
    pub(crate) fn new(mesh: &TriMesh) -> Self {
        let vertices = mesh.vertices().iter();
        let (least, most) = vertices.fold(
            (
                Vector::splat(f64::INFINITY),
                Vector::splat(f64::NEG_INFINITY),
            ),
            |(least, most), vertex| (least.min(*vertex), most.max(*vertex)),
        );
        // Differences of great numbers are infinite, those of their halves are not.
        let (middle, half) = (least * 0.5 + most * 0.5, most * 0.5 - least * 0.5);
        let reach = half.max_element().max(f64::MIN_POSITIVE.sqrt());
        let mut items: Vec<Item> = mesh
            .triangles()
            .zip(0..)
            .map(|(Triangle { a, b, c }, triangle)| {
                let part = |corner: Vector| ((corner - middle) / reach).as_vec3();
                let (a, b, c) = (part(a), part(b), part(c));
                let bounds = Bounds {
                    mins: (a.min(b).min(c) - MARGIN).to_array(),
                    maxs: (a.max(b).max(c) + MARGIN).to_array(),
                };
                Item { bounds, triangle }
            })
            .collect();
        let mut nodes = Vec::with_capacity(items.len() / 2);
        add_node(&mut nodes, &mut items, 0, 0);
        let order = items.iter();
        Self {
            nodes,
            triangles: order
                .map(|item| mesh.indices()[item.triangle as usize])
                .collect(),
            middle,
            reach,
        }
    }

    /// The length of a ray to the first triangle of the tree's mesh, at most `most`, and the normal
    /// of the side that it meets. The direction has the length 1.
    pub(crate) fn meet(&self, mesh: &TriMesh, ray: &Ray, most: f64) -> Option<(f64, Vector)> {
        let (start, end) = self.enter(ray, most)?;
        let mut beam = Beam::new(self, ray, start);
        beam.shorten(end);
        let (mut best, mut found) = (most, None);
        let mut stack = [(0.0_f32, Child(0)); DEEPEST * (WIDTH - 1) + 1];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let (enter, child) = stack[height];
            if enter > beam.length {
                continue;
            }
            if let Some(places) = child.triangles() {
                for corners in &self.triangles[places] {
                    let [a, b, c] = corners.map(|at| mesh.vertices()[at as usize]);
                    let triangle = Triangle::new(a, b, c);
                    let hit = triangle.cast_local_ray_and_get_normal(ray, best, true);
                    if let Some(hit) =
                        hit.filter(|hit| found.is_none() || hit.time_of_impact < best)
                    {
                        best = hit.time_of_impact;
                        found = Some((best, hit.normal));
                        beam.shorten(best);
                    }
                }
                continue;
            }
            let node = &self.nodes[child.0 as usize];
            let (enters, leaves) = beam.cross(node);
            let mut crossed = enters.cmple(leaves).bitmask();
            let enters = enters.to_array();
            // The nearest child is on top.
            let bottom = height;
            while crossed != 0 {
                let lane = crossed.trailing_zeros() as usize;
                crossed &= crossed - 1;
                let new = (enters[lane], node.children[lane]);
                let mut at = height;
                while at > bottom && stack[at - 1].0 < new.0 {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = new;
                height += 1;
            }
        }
        found
    }

    /// From where to where a ray is in the box around all, if it is there within `most`. Both are a
    /// little outside.
    fn enter(&self, ray: &Ray, most: f64) -> Option<(f64, f64)> {
        let half = Vector::splat(self.reach * (1.0 + 1e-9));
        let from = ray.origin - self.middle;
        let (mut enter, mut leave) = (0.0_f64, most);
        for axis in 0..3 {
            let (from, way, half) = (from[axis], ray.dir[axis], half[axis]);
            if way == 0.0 {
                if from.abs() > half {
                    return None;
                }
                continue;
            }
            let (one, other) = ((-half - from) / way, (half - from) / way);
            enter = enter.max(one.min(other));
            leave = leave.min(one.max(other));
        }
        (enter <= leave).then_some((enter, leave))
    }
}

/// A ray in `f32`, from where it enters the box around all. Lengths are parts of the reach.
struct Beam {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// Whether it goes down along an axis.
    is_back: [bool; 3],
    /// The part of the way that counts, or a little more.
    length: f32,
    start: f64,
    reach: f64,
}

impl Beam {
    fn new(tree: &RayTree, ray: &Ray, start: f64) -> Self {
        let origin = (ray.origin + ray.dir * start - tree.middle) / tree.reach;
        // A product with the greatest difference of coordinates is finite.
        let inverse = |n: f64| (1.0 / n as f32).clamp(-1e30, 1e30);
        let inverse = ray.dir.to_array().map(inverse);
        Self {
            origin: origin.as_vec3().to_array().map(Vec4::splat),
            inverse: inverse.map(Vec4::splat),
            is_back: inverse.map(|n| n < 0.0),
            length: f32::INFINITY,
            start,
            reach: tree.reach,
        }
    }

    /// Leaves out everything beyond `end`, a length of the ray.
    fn shorten(&mut self, end: f64) {
        self.length = ((end - self.start) / self.reach) as f32 * (1.0 + 1e-5) + MARGIN;
    }

    /// Where it enters and leaves the boxes of a node.
    #[inline]
    fn cross(&self, node: &Node) -> (Vec4, Vec4) {
        let (mut enters, mut leaves) = (Vec4::ZERO, Vec4::splat(self.length));
        for axis in 0..3 {
            let (near, far) = if self.is_back[axis] {
                (node.maxs[axis], node.mins[axis])
            } else {
                (node.mins[axis], node.maxs[axis])
            };
            enters = enters.max((near - self.origin[axis]) * self.inverse[axis]);
            leaves = leaves.min((far - self.origin[axis]) * self.inverse[axis]);
        }
        (enters, leaves)
    }
}

/// Adds a node for items, of which the first one has the place `first`, and returns the number.
fn add_node(nodes: &mut Vec<Node>, items: &mut [Item], first: usize, splits: u32) -> u32 {
    let mut parts = [(0, items.len(), around(items), splits); WIDTH];
    let mut count = 1;
    while count < WIDTH {
        // The largest box that more than a leaf is in.
        let large = parts[..count].iter().enumerate();
        let large = large.filter(|(_, (from, to, ..))| to - from > LEAF);
        let large = large.max_by(|a, b| a.1.2.area().total_cmp(&b.1.2.area()));
        let Some((at, &(from, to, _, splits))) = large else {
            break;
        };
        let middle = from + split(&mut items[from..to], splits);
        let part = |from: usize, to: usize| (from, to, around(&items[from..to]), splits + 1);
        parts[count] = part(middle, to);
        parts[at] = part(from, middle);
        count += 1;
    }
    let number = nodes.len();
    let mut node = Node {
        mins: [Vec4::INFINITY; 3],
        maxs: [Vec4::NEG_INFINITY; 3],
        children: [Child(0); WIDTH],
    };
    for (lane, (.., bounds, _)) in parts[..count].iter().enumerate() {
        for axis in 0..3 {
            node.mins[axis][lane] = bounds.mins[axis];
            node.maxs[axis][lane] = bounds.maxs[axis];
        }
    }
    nodes.push(node);
    for (lane, (from, to, _, splits)) in parts[..count].iter().enumerate() {
        let child = if to - from <= LEAF {
            Child::leaf(first + from, to - from)
        } else {
            Child(add_node(
                nodes,
                &mut items[*from..*to],
                first + from,
                *splits,
            ))
        };
        nodes[number].children[lane] = child;
    }
    number as u32
}

/// Sorts items into two parts, and returns where the second one begins. None of them is empty.
fn split(items: &mut [Item], splits: u32) -> usize {
    let half = items.len() / 2;
    let (mut least, mut most) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for item in items.iter() {
        for axis in 0..3 {
            let middle = item.bounds.middle(axis);
            (least[axis], most[axis]) = (least[axis].min(middle), most[axis].max(middle));
        }
    }
    let mut best = (f32::INFINITY, 0, 0);
    for axis in 0..3 {
        let scale = BINS as f32 / (most[axis] - least[axis]);
        if splits >= FREE_SPLITS || !scale.is_finite() {
            continue;
        }
        let mut bins = [(0_usize, Bounds::EMPTY); BINS];
        for item in items.iter() {
            let bin = &mut bins[bin(item, axis, least[axis], scale)];
            bin.0 += 1;
            bin.1.join(&item.bounds);
        }
        // The costs of the parts on the right, then of both.
        let mut right = [0.0; BINS];
        let mut part = (0, Bounds::EMPTY);
        for at in (1..BINS).rev() {
            part.0 += bins[at].0;
            part.1.join(&bins[at].1);
            right[at] = part.0 as f32 * part.1.area();
        }
        let mut part = (0, Bounds::EMPTY);
        for at in 1..BINS {
            part.0 += bins[at - 1].0;
            part.1.join(&bins[at - 1].1);
            let cost = part.0 as f32 * part.1.area() + right[at];
            if part.0 > 0 && part.0 < items.len() && cost < best.0 {
                best = (cost, axis, at);
            }
        }
    }
    let (cost, axis, at) = best;
    if cost.is_infinite() {
        // Many splits, or all at one place: halves.
        let widest =
            (0..3).max_by(|a, b| (most[*a] - least[*a]).total_cmp(&(most[*b] - least[*b])));
        let axis = widest.unwrap_or(0);
        items.select_nth_unstable_by(half, |a, b| {
            a.bounds.middle(axis).total_cmp(&b.bounds.middle(axis))
        });
        return half;
    }
    let scale = BINS as f32 / (most[axis] - least[axis]);
    let mut middle = 0;
    for number in 0..items.len() {
        if bin(&items[number], axis, least[axis], scale) < at {
            items.swap(number, middle);
            middle += 1;
        }
    }
    middle
}

fn bin(item: &Item, axis: usize, least: f32, scale: f32) -> usize {
    (((item.bounds.middle(axis) - least) * scale) as usize).min(BINS - 1)
}

#[cfg(test)]
mod tests;
