//! The camera of the window: it moves around a point.

use innermodel::kinds::{Camera, Kind, Shape};
use innermodel::{Clouds, NodeRef, Point, Snapshot, Vector};
use innermodel_render::{View, look_at};
use std::f64::consts::{FRAC_PI_2, PI};

/// How far the camera may look down or up: not quite straight.
const STEEPEST: f64 = FRAC_PI_2 - 0.01;

/// The centre of the bodies and point clouds of a tree, and the radius of a ball around them, in
/// millimetres. Where nothing has a size, the radius is a metre.
pub fn scene(tree: &Snapshot, clouds: &Clouds) -> (Point, f64) {
    let mut corners: Option<(Point, Point)> = None;
    let mut add = |least: Point, most: Point| {
        corners = Some(corners.map_or((least, most), |(a, b)| (a.inf(&least), b.sup(&most))));
    };
    for node in tree.nodes() {
        if *node.kind() == Kind::PointCloud {
            let to_root = node.to_root();
            for point in clouds.of(node.node_id()) {
                let place = to_root.point(&Point::from(point.position.map(f64::from)));
                if place.iter().all(|n| n.is_finite()) {
                    add(place, place);
                }
            }
            continue;
        }
        let reach = match node.kind() {
            Kind::Plane(plane) => Vector::from(plane.size).norm() / 2.0,
            Kind::Display(display) => Vector::from(display.plane.size).norm() / 2.0,
            Kind::Solid(solid) => match solid.shape {
                Shape::Sphere { radius } => radius,
                Shape::Cylinder { radius, length } | Shape::Cone { radius, length } => {
                    radius.hypot(length / 2.0)
                }
            },
            Kind::Mesh(_) | Kind::Axes(_) => 0.0,
            _ => continue,
        };
        let place = middle(&node);
        add(
            place - Vector::repeat(reach.abs()),
            place + Vector::repeat(reach.abs()),
        );
    }
    let Some((least, most)) = corners else {
        return (Point::origin(), 1000.0);
    };
    let radius = (most - least).norm() / 2.0;
    let centre = least + (most - least) / 2.0;
    (centre, if radius > 0.0 { radius } else { 1000.0 })
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
    /// A camera that sees the whole tree.
    pub fn around(tree: &Snapshot, clouds: &Clouds) -> Self {
        let (centre, radius) = scene(tree, clouds);
        Self {
            centre,
            distance: radius * 1.5,
            turn: 0.6,
            tilt: 0.5,
        }
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
        let from = self.centre - self.front() * self.distance;
        look_at(from, self.centre, camera)
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
