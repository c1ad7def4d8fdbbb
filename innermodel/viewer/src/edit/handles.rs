//! Handles at a node: lines and rings that move or turn it. Each one changes one attribute.

use crate::sight::Sight;
use innermodel::kinds::{Axis, Plane};
use innermodel::language::rewrite::{self, Value};
use innermodel::{Edit, Error, Kind, NodeRef, Point, Pose, Transform, Vector};
use innermodel_render::View;
use std::f64::consts::{PI, TAU};

/// The length of a line, and the radius of a ring, in pixels where the node is.
const LENGTH: f64 = 80.0;
/// How near to a handle the pointer has to be, in pixels.
const NEAR: f64 = 7.0;
/// The shortest handle that can be taken: a line that points to the user has no length.
const SHORTEST: f64 = 12.0;
/// The parts of a ring.
const PARTS: usize = 48;
/// The axes.
const AXES: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];
/// Coordinates are whole multiples of this many millimetres after a drag.
const GRID: f64 = 1.0;
/// A turn is a whole multiple of this angle: one degree.
const DEGREE: f64 = PI / 180.0;

/// The effects of handles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Mode {
    /// They move the node.
    #[default]
    Move,
    /// They turn it.
    Turn,
}

impl Mode {
    /// The unit of the numbers that a window shows.
    pub(crate) fn unit(self) -> &'static str {
        match self {
            Self::Move => " mm",
            Self::Turn => " rad",
        }
    }
}

/// A handle as it is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Handle {
    /// The number of its axis: x, y, z.
    pub axis: usize,
    /// The attribute that it changes.
    pub attribute: &'static str,
    /// Its points in the window, in pixels. A line begins at the node.
    pub points: Vec<(f64, f64)>,
}

impl Handle {
    /// The distance to a place in the window, in pixels. A handle that is too short has no place.
    fn distance(&self, place: (f64, f64)) -> f64 {
        let (mut nearest, mut length) = (f64::INFINITY, 0.0);
        for pair in self.points.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let (x, y) = (b.0 - a.0, b.1 - a.1);
            let square = x * x + y * y;
            let along = ((place.0 - a.0) * x + (place.1 - a.1) * y) / square;
            let along = if square > 0.0 {
                along.clamp(0.0, 1.0)
            } else {
                0.0
            };
            let apart = (place.0 - a.0 - along * x).hypot(place.1 - a.1 - along * y);
            nearest = nearest.min(apart);
            length += square.sqrt();
        }
        if length < SHORTEST {
            f64::INFINITY
        } else {
            nearest
        }
    }
}

/// The attributes that the handles of a node change, if it has any.
pub(crate) fn attributes(kind: &Kind, mode: Mode) -> Option<[&'static str; 3]> {
    let names = match (mode, kind) {
        (Mode::Move, Kind::Plane(_) | Kind::Display(_)) => ["px", "py", "pz"],
        (Mode::Move, _) => ["tx", "ty", "tz"],
        (Mode::Turn, _) => ["rx", "ry", "rz"],
    };
    rewrite::has_attribute(kind.tag(), names[0]).then_some(names)
}

/// The reason for which a node has no handles.
pub(crate) fn without(id: &str, kind: &Kind, mode: Mode) -> String {
    let tag = kind.tag();
    match (mode, kind) {
        (Mode::Turn, Kind::Plane(_) | Kind::Display(_)) => {
            format!("`{id}` is a {tag}: nx, ny and nz turn it, and so does the node above (p)")
        }
        (Mode::Turn, _) => {
            format!("`{id}` is a {tag}, which does not turn; select the node above (p)")
        }
        (Mode::Move, _) => {
            format!("`{id}` is a {tag}, which has no place of its own; select the node above (p)")
        }
    }
}

fn plane(kind: &Kind) -> Option<&Plane> {
    match kind {
        Kind::Plane(plane) => Some(plane),
        Kind::Display(display) => Some(&display.plane),
        _ => None,
    }
}

/// The numbers that the handles of a node change.
pub(crate) fn values(node: &NodeRef<'_>, mode: Mode) -> [f64; 3] {
    match (mode, plane(node.kind())) {
        (Mode::Move, Some(plane)) => plane.point,
        (Mode::Move, None) => node.pose().translation,
        (Mode::Turn, _) => node.pose().rotation,
    }
}

/// Sets one of these numbers in a tree.
pub(crate) fn set(
    edit: &mut Edit,
    id: &str,
    mode: Mode,
    axis: usize,
    value: f64,
) -> Result<(), Error> {
    let node = edit.snapshot().node(id)?;
    let (mut pose, mut kind) = (node.pose(), node.kind().clone());
    match (mode, &mut kind) {
        (Mode::Move, Kind::Plane(plane)) => plane.point[axis] = value,
        (Mode::Move, Kind::Display(display)) => display.plane.point[axis] = value,
        (Mode::Move, _) => pose.translation[axis] = value,
        (Mode::Turn, _) => pose.rotation[axis] = value,
    }
    if plane(&kind).is_some() {
        edit.set_kind(id, kind)
    } else {
        edit.set_pose(id, pose)
    }
}

/// One of these numbers as a value in a file.
pub(crate) fn written(mode: Mode, value: f64) -> Value {
    match mode {
        Mode::Move => Value::length(value),
        Mode::Turn => Value::Number(value),
    }
}

/// The line or the ring of a handle in the root.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Manipulator {
    mode: Mode,
    origin: Point,
    /// Along the line, or about which the ring turns.
    axis: Vector,
    /// A turn by a positive angle takes the first direction towards the second one.
    first: Vector,
    second: Vector,
}

impl Manipulator {
    pub(crate) fn new(node: &NodeRef<'_>, mode: Mode, axis: usize) -> Self {
        let above = node.parent().map(|parent| parent.to_root());
        let above = above.unwrap_or_default();
        let origin = above.point(&Point::from(values(node, Mode::Move)));
        // R = Rx·Ry·Rz: the axis y turns with rx, the axis z with rx and ry.
        let frame = match mode {
            Mode::Move => above,
            Mode::Turn => {
                let angles = node.pose().rotation;
                let outer = AXES.into_iter().zip(angles).take(axis);
                outer.fold(above, |frame, (axis, angle)| {
                    frame * Transform::about(axis, angle)
                })
            }
        };
        let direction = |axis: usize| frame.rotation.column(axis % 3).into_owned();
        Self {
            mode,
            origin,
            axis: direction(axis),
            first: direction(axis + 1),
            second: direction(axis + 2),
        }
    }

    /// The points of the handle in the root, `length` millimetres from the node.
    fn points(&self, length: f64) -> Vec<Point> {
        match self.mode {
            Mode::Move => vec![self.origin, self.origin + self.axis * length],
            Mode::Turn => (0..=PARTS)
                .map(|part| {
                    let (sin, cos) = (TAU * part as f64 / PARTS as f64).sin_cos();
                    self.origin + (self.first * cos + self.second * sin) * length
                })
                .collect(),
        }
    }

    /// Where a line of sight meets the handle: millimetres along its line, or an angle of its ring.
    /// `None` where it meets it nowhere in front of the user.
    fn meet(&self, sight: &Sight) -> Option<f64> {
        if self.mode == Mode::Move {
            return sight.along(&self.origin, &self.axis);
        }
        let place = sight.on_plane(&self.origin, &self.axis)? - self.origin;
        Some(place.dot(&self.second).atan2(place.dot(&self.first)))
    }
}

/// The handles of a node as a view shows them; none if the node is not in front of it.
pub(crate) fn handles(node: &NodeRef<'_>, mode: Mode, view: &View) -> Vec<Handle> {
    let Some(names) = attributes(node.kind(), mode) else {
        return Vec::new();
    };
    let seen = |manipulator: &Manipulator| {
        let depth = view.place.inverse().point(&manipulator.origin).z;
        let length = LENGTH * depth / view.camera.focal;
        let points = manipulator.points(length);
        let points = points.iter().map(|point| view.pixel(point));
        points.collect::<Option<Vec<_>>>()
    };
    let all = (0..3).filter_map(|axis| {
        Some(Handle {
            axis,
            attribute: names[axis],
            points: seen(&Manipulator::new(node, mode, axis))?,
        })
    });
    all.collect()
}

/// The handle at a place in the window.
pub(crate) fn at(handles: &[Handle], place: (f64, f64)) -> Option<&Handle> {
    let all = handles
        .iter()
        .map(|handle| (handle.distance(place), handle));
    let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0));
    nearest
        .filter(|(distance, _)| *distance <= NEAR)
        .map(|(_, handle)| handle)
}

/// A handle that is being dragged.
#[derive(Clone, Debug)]
pub(crate) struct Drag {
    pub(crate) id: String,
    pub(crate) mode: Mode,
    pub(crate) axis: usize,
    pub(crate) attribute: &'static str,
    manipulator: Manipulator,
    /// Where the handle was met last.
    last: f64,
    /// How far it was dragged.
    offset: f64,
    /// The number before.
    old: f64,
}

impl Drag {
    /// Takes a handle where a line of sight meets it.
    pub(crate) fn new(
        node: &NodeRef<'_>,
        mode: Mode,
        handle: &Handle,
        sight: &Sight,
    ) -> Option<Self> {
        let manipulator = Manipulator::new(node, mode, handle.axis);
        Some(Self {
            id: node.id().to_owned(),
            mode,
            axis: handle.axis,
            attribute: handle.attribute,
            last: manipulator.meet(sight)?,
            manipulator,
            offset: 0.0,
            old: values(node, mode)[handle.axis],
        })
    }

    /// Follows a line of sight.
    pub(crate) fn follow(&mut self, sight: &Sight) {
        let Some(now) = self.manipulator.meet(sight) else {
            return;
        };
        let mut by = now - self.last;
        if self.mode == Mode::Turn {
            // The shorter way round.
            by -= TAU * (by / TAU).round();
        }
        self.offset += by;
        self.last = now;
    }

    /// The number before.
    pub(crate) fn old_value(&self) -> f64 {
        self.old
    }

    /// The number now. A handle that is back has the number before.
    pub(crate) fn value(&self) -> f64 {
        let new = match self.mode {
            Mode::Move => ((self.old + self.offset) / GRID).round() * GRID,
            Mode::Turn => self.old + (self.offset / DEGREE).round() * DEGREE,
        };
        let is_back = match self.mode {
            Mode::Move => self.offset.abs() < GRID / 2.0,
            Mode::Turn => self.offset.abs() < DEGREE / 2.0,
        };
        if is_back { self.old } else { new }
    }
}

/// The pose of a node at a point of the root, without a rotation of its own.
pub(crate) fn pose_at(parent: &NodeRef<'_>, point: &Point) -> Pose {
    let place = parent.to_root().inverse().point(point);
    Pose {
        translation: [place.x, place.y, place.z].map(|c| (c / GRID).round() * GRID),
        rotation: [0.0; 3],
    }
}
