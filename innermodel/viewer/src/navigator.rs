//! The camera of the window: it moves around a point.

use innermodel::kinds::{Camera, Kind};
use innermodel::{InnerModel, NodeId, NodeRef, Point, Snapshot, Vector};
use innermodel_render::{Extent, Scene, View, look_at};
use std::collections::HashSet;
use std::f64::consts::{FRAC_PI_2, PI};

/// How far the camera may look down or up: not quite straight.
const STEEPEST: f64 = FRAC_PI_2 - 0.01;
/// How far the first camera looks down: the first angle from which it sees the robot.
const TILTS: [f64; 6] = [0.5, 0.7, 0.9, 1.1, 1.3, STEEPEST];
/// The distance of the first camera from the way of the robot.
const ASIDE: f64 = 0.6;
/// How much of the image is filled at first.
const FILLED: f64 = 0.92;
/// How many times larger than all others a floor is that the first camera need not see whole.
const GROUND: f64 = 5.0;

/// The centre of boxes, and the radius of a ball around them, in millimetres. Where nothing has a
/// size, the radius is a metre.
pub fn scene(extents: &[Extent]) -> (Point, f64) {
    let corners = extents.iter().flat_map(Extent::corners);
    let Some((least, most)) = corners
        .map(|corner| (corner, corner))
        .reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)))
    else {
        return (Point::origin(), 1000.0);
    };
    let radius = (most - least).norm() / 2.0;
    let centre = least + (most - least) / 2.0;
    (centre, if radius > 0.0 { radius } else { 1000.0 })
}

/// The boxes without floors that would make all others look small.
fn without_grounds(extents: &[Extent]) -> Vec<Extent> {
    let mut rest = extents.to_vec();
    rest.sort_by(|a, b| a.half.norm().total_cmp(&b.half.norm()));
    while let Some(largest) = rest.pop() {
        let (_, radius) = scene(&rest);
        let is_ground = largest.is_full && largest.half.norm() > GROUND * radius;
        if rest.is_empty() || !is_ground {
            rest.push(largest);
            break;
        }
    }
    rest
}

/// The first robot of a tree: its heading, and the middle of its body.
fn robot(tree: &Snapshot, extents: &[Extent]) -> Option<(f64, Point, HashSet<NodeId>)> {
    let robot = tree
        .nodes()
        .find(|node| matches!(node.kind(), Kind::Robot(_)))?;
    let is_own = |node: &NodeRef<'_>| {
        let mut above = std::iter::successors(Some(*node), NodeRef::parent);
        above.any(|above| above.node_id() == robot.node_id())
    };
    let own: HashSet<NodeId> = tree
        .nodes()
        .filter(is_own)
        .map(|node| node.node_id())
        .collect();
    let boxes = extents.iter().filter(|extent| own.contains(&extent.node));
    let boxes: Vec<Extent> = boxes.cloned().collect();
    let front = robot.to_root().vector(&Vector::z());
    (!boxes.is_empty()).then(|| (front.x.atan2(front.z), scene(&boxes).0, own))
}

/// Whether a box is between two points.
fn hides(extent: &Extent, from: &Point, to: &Point) -> bool {
    let to_box = extent.place.inverse();
    let (from, to) = (to_box.point(from), to_box.point(to));
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for axis in 0..3 {
        let (start, way, half) = (from[axis], to[axis] - from[axis], extent.half[axis]);
        if way == 0.0 {
            if start.abs() > half {
                return false;
            }
            continue;
        }
        let (a, b) = ((-half - start) / way, (half - start) / way);
        (first, last) = (first.max(a.min(b)), last.min(a.max(b)));
    }
    first <= last
}

/// The middle of the body of a node, or its origin, in the root.
pub(crate) fn middle(node: &NodeRef<'_>) -> Point {
    let point = match node.kind() {
        Kind::Plane(plane) => plane.point,
        Kind::Display(display) => display.plane.point,
        _ => [0.0; 3],
    };
    node.to_root().point(&point.into())
}

/// A camera that moves around a point.
#[derive(Clone, Debug, PartialEq)]
pub struct Navigator {
    /// The point in the middle of the image.
    pub centre: Point,
    /// From the camera to that point, in millimetres.
    pub distance: f64,
    /// About the axis y: at 0 the camera looks along z.
    pub turn: f64,
    /// How far the camera looks down.
    pub tilt: f64,
}

impl Navigator {
    /// A camera that sees the whole tree of a model, on an image of a size in pixels. It reads the
    /// meshes.
    pub fn of(model: &InnerModel, size: (usize, usize)) -> Self {
        let tree = model.snapshot();
        let mut scene = Scene::new();
        scene.set_clouds(model.clouds());
        Self::around(&tree, &scene.extents(&tree), size)
    }

    /// A camera that sees the whole tree, with the boxes of its bodies, on an image of a size in
    /// pixels: from above and behind. It looks down so steeply that no wall hides the robot.
    pub fn around(tree: &Snapshot, extents: &[Extent], size: (usize, usize)) -> Self {
        let seen = without_grounds(extents);
        let from = |turn: f64, tilt: f64| Self::fitted(&seen, turn, tilt, size);
        let first = from(ASIDE, TILTS[0]);
        let Some((heading, middle, own)) = robot(tree, extents) else {
            return first;
        };
        let is_free = |navigator: &Self| {
            let eye = navigator.eye();
            let mut others = extents.iter().filter(|extent| !own.contains(&extent.node));
            !others.any(|extent| hides(extent, &eye, &middle))
        };
        let turns = [heading + ASIDE, heading - ASIDE, heading];
        let mut all = TILTS
            .iter()
            .flat_map(|tilt| turns.iter().map(move |turn| (*turn, *tilt)));
        let free = all.find_map(|(turn, tilt)| Some(from(turn, tilt)).filter(is_free));
        free.unwrap_or(first)
    }

    /// A camera with these angles that is just so far away that it sees all boxes.
    fn fitted(seen: &[Extent], turn: f64, tilt: f64, (width, height): (usize, usize)) -> Self {
        let (centre, radius) = scene(seen);
        let mut fitted = Self {
            centre,
            distance: radius * 1.5,
            turn,
            tilt,
        };
        if seen.is_empty() {
            return fitted;
        }
        let place = fitted.view(1, 1).place.rotation;
        let (right, above, front) = (place.column(0), place.column(1), place.column(2));
        let focal = width.max(height).max(1) as f64;
        let slope = |length: usize| FILLED * length.max(1) as f64 / 2.0 / focal;
        let (wide, high) = (slope(width), slope(height));
        // How far corners reach beyond the sides of a view from the centre.
        let mut reach = [f64::NEG_INFINITY; 4];
        for corner in seen.iter().flat_map(Extent::corners) {
            let way = corner - centre;
            let (x, y, z) = (right.dot(&way), above.dot(&way), front.dot(&way));
            let beyond = [x - wide * z, -x - wide * z, y - high * z, -y - high * z];
            for (most, beyond) in reach.iter_mut().zip(beyond) {
                *most = most.max(beyond);
            }
        }
        let [east, west, north, south] = reach;
        let distance = ((east + west) / (2.0 * wide)).max((north + south) / (2.0 * high));
        let aside = right * ((east - west) / 2.0) + above * ((north - south) / 2.0);
        fitted.centre += aside;
        // The camera is nowhere inside.
        fitted.distance = distance.max(0.1 * radius).clamp(10.0, 1e9);
        fitted
    }

    /// Where the camera is.
    fn eye(&self) -> Point {
        self.centre - self.front() * self.distance
    }

    /// A camera that begins where another one is, and moves around the point at `distance` in front
    /// of it.
    pub fn at(view: &View, distance: f64) -> Self {
        let front = view.place.vector(&Vector::z());
        Self {
            centre: view.place.point(&Point::new(0.0, 0.0, distance)),
            distance,
            turn: front.x.atan2(front.z),
            tilt: (-front.y).clamp(-1.0, 1.0).asin(),
        }
    }

    fn front(&self) -> Vector {
        let (sin, cos) = self.turn.sin_cos();
        let (down, flat) = self.tilt.sin_cos();
        Vector::new(sin * flat, -down, cos * flat)
    }

    /// View of the camera on an image of this size, in pixels.
    pub fn view(&self, width: usize, height: usize) -> View {
        let camera = Camera {
            width: width as f64,
            height: height as f64,
            focal: width.max(height) as f64,
        };
        look_at(self.eye(), self.centre, camera)
    }

    /// Turns by a movement of the pointer, in parts of the image.
    pub fn orbit(&mut self, right: f64, down: f64) {
        self.turn = (self.turn + right * PI) % (2.0 * PI);
        self.tilt = (self.tilt + down * PI).clamp(-STEEPEST, STEEPEST);
    }

    /// Moves the point in the middle by a movement of the pointer, in parts of the image.
    pub fn pan(&mut self, right: f64, down: f64) {
        let place = self.view(1, 1).place;
        let way = Vector::new(-right, down, 0.0) * self.distance;
        self.centre += place.vector(&way);
    }

    /// Goes nearer by a tenth for each step; a negative number of steps goes away.
    pub fn zoom(&mut self, steps: i32) {
        let distance = self.distance * 0.9_f64.powi(steps);
        self.distance = distance.clamp(1.0, 1e9);
    }
}
