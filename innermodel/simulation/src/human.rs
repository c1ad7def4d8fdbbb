//! People: their skeletons, and how they walk.

use crate::pose2d::{FASTEST, wrapped};
use innermodel::kinds::{Human, Shape, Solid};
use innermodel::{Edit, Kind, NewNode, Pose};
use std::f64::consts::TAU;

/// At this distance in mm a person sees a robot ahead and begins to walk around it.
const SEES: f64 = 2000.0;
/// A person keeps this distance in mm to the side.
const ROOM: f64 = 900.0;
/// A person does not walk towards a robot that is nearer, in mm.
const STOPS: f64 = 700.0;
/// How far a person swings arms and legs, in radians.
pub(crate) const SWING: f64 = 0.45;
/// The way of two steps, as a part of the height.
const STRIDE: f64 = 0.85;

/// How fast a person turns, in radians a second.
const TURN: f64 = 4.0;
/// A person does not walk in a direction that is farther from where it looks, in radians: round a
/// corner it walks on.
const TURNS_ROUND: f64 = 2.0;

/// The way in which a person walks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Walk {
    /// The way along the path in mm.
    pub(crate) way: f64,
    /// The distance to the path, in mm along x and z.
    pub(crate) aside: [f64; 2],
    /// The angle about y of the direction that the person faces. `None`: as the path.
    facing: Option<f64>,
    /// The swing of arms and legs, in radians.
    pub(crate) phase: f64,
}

/// A part of the skeleton: its name, what it is below, its place as parts of the height, and the
/// radius and the length of its body, which hangs down (length above 0) or stands up.
pub(crate) struct Part {
    pub(crate) name: &'static str,
    above: &'static str,
    place: [f64; 2],
    body: Option<(f64, f64)>,
}

const fn part(name: &'static str, above: &'static str, x: f64, y: f64) -> Part {
    Part {
        name,
        above,
        place: [x, y],
        body: None,
    }
}

const fn limb(mut of: Part, radius: f64, length: f64) -> Part {
    of.body = Some((radius, length));
    of
}

/// The joints of a person, those above before those below.
pub(crate) const SKELETON: [Part; 16] = [
    limb(part("hips", "", 0.0, 0.53), 0.085, -0.29),
    part("neck", "hips", 0.0, 0.32),
    part("head", "neck", 0.0, 0.08),
    limb(part("left_shoulder", "hips", -0.115, 0.29), 0.026, 0.18),
    limb(part("left_elbow", "left_shoulder", 0.0, -0.18), 0.022, 0.16),
    part("left_hand", "left_elbow", 0.0, -0.16),
    limb(part("right_shoulder", "hips", 0.115, 0.29), 0.026, 0.18),
    limb(
        part("right_elbow", "right_shoulder", 0.0, -0.18),
        0.022,
        0.16,
    ),
    part("right_hand", "right_elbow", 0.0, -0.16),
    limb(part("left_hip", "hips", -0.055, 0.0), 0.045, 0.25),
    limb(part("left_knee", "left_hip", 0.0, -0.25), 0.034, 0.25),
    part("left_foot", "left_knee", 0.0, -0.25),
    limb(part("right_hip", "hips", 0.055, 0.0), 0.045, 0.25),
    limb(part("right_knee", "right_hip", 0.0, -0.25), 0.034, 0.25),
    part("right_foot", "right_knee", 0.0, -0.25),
    part("face", "head", 0.0, 0.0),
];
/// The radius of a head, as a part of the height.
const HEAD: f64 = 0.062;

/// Adds the skeletons of the people who have none.
pub(crate) fn add_skeletons(edit: &mut Edit) -> Result<(), innermodel::Error> {
    let people = edit
        .snapshot()
        .nodes()
        .filter_map(|node| match node.kind() {
            Kind::Human(human) => Some((node.id().to_owned(), human.clone())),
            _ => None,
        });
    for (id, human) in people.collect::<Vec<_>>() {
        add_skeleton(edit, &id, &human)?;
    }
    Ok(())
}

/// Adds the skeleton of a person, if the tree has none. If it has a part only, a part is missing,
/// or another node has its id: then the person would silently have no body.
fn add_skeleton(edit: &mut Edit, id: &str, human: &Human) -> Result<(), innermodel::Error> {
    let name = |part: &str| format!("{id}_{part}");
    let tree = edit.snapshot();
    let has = |part: &Part| tree.node(&name(part.name)).is_ok();
    if SKELETON.iter().all(has) {
        return Ok(());
    }
    if let Some(part) = SKELETON.iter().find(|part| has(part)) {
        return Err(innermodel::Error::DuplicateId(name(part.name)));
    }
    let height = human.height;
    for part in &SKELETON {
        let above = if part.above.is_empty() {
            id.to_owned()
        } else {
            name(part.above)
        };
        let [x, y] = part.place.map(|place| place * height);
        let pose = Pose::new(x, y, 0.0, 0.0, 0.0, 0.0);
        edit.add(&above, NewNode::transform(name(part.name), pose))?;
        let body = match part.body {
            Some((radius, length)) => {
                let shape = Shape::Cylinder {
                    radius: radius * height,
                    length: length.abs() * height,
                };
                Some((shape, -length * height / 2.0))
            }
            None if part.name == "head" => {
                let radius = HEAD * height;
                Some((Shape::Sphere { radius }, 0.0))
            }
            None => None,
        };
        if let Some((shape, y)) = body {
            let texture = if part.name == "head" {
                "#e0b090"
            } else {
                "#405070"
            };
            let solid = Kind::Solid(Solid {
                shape,
                texture: texture.to_owned(),
                collide: true,
            });
            let pose = Pose::new(0.0, y, 0.0, 0.0, 0.0, 0.0);
            let mut node = NewNode::new(format!("{}_body", name(part.name)), solid, pose);
            node.allowed = vec![id.to_owned()];
            edit.add(&name(part.name), node)?;
        }
    }
    Ok(())
}

/// The place on a closed path after a way, and the direction there as (x, z).
fn on_path(path: &[[f64; 2]], way: f64) -> ([f64; 2], [f64; 2]) {
    let sides = || {
        let next = path.iter().cycle().skip(1);
        path.iter()
            .zip(next)
            .map(|(a, b)| (*a, *b, (b[0] - a[0]).hypot(b[1] - a[1])))
    };
    let length: f64 = sides().map(|(.., length)| length).sum();
    let mut rest = if length > 0.0 {
        way.rem_euclid(length)
    } else {
        0.0
    };
    for (a, b, side) in sides().filter(|(.., side)| *side > 0.0) {
        if rest <= side {
            let t = rest / side;
            let to = [(b[0] - a[0]) / side, (b[1] - a[1]) / side];
            return ([a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t], to);
        }
        rest -= side;
    }
    (path.first().copied().unwrap_or_default(), [0.0, 1.0])
}

impl Walk {
    /// One step of a person. `robots` are places in the frame of the path.
    pub(crate) fn step(&mut self, human: &Human, robots: &[[f64; 2]], seconds: f64) {
        let (at, to) = on_path(&human.path, self.way);
        let right = [to[1], -to[0]];
        let along =
            |way: [f64; 2], direction: [f64; 2]| way[0] * direction[0] + way[1] * direction[1];
        let here = [at[0] + self.aside[0], at[1] + self.aside[1]];
        let aside = along(self.aside, right);
        let (mut wanted, mut nearest) = (0.0, f64::INFINITY);
        for robot in robots {
            let ahead = along([robot[0] - here[0], robot[1] - here[1]], to);
            // To the right of the path.
            let across = along([robot[0] - at[0], robot[1] - at[1]], right);
            if ahead > -STOPS && ahead < SEES && across.abs() < ROOM {
                let side = if across > 0.0 { -1.0 } else { 1.0 };
                wanted = across + side * ROOM;
            }
            let apart = (robot[0] - here[0]).hypot(robot[1] - here[1]);
            if ahead > 0.0 && (across - aside).abs() < STOPS {
                nearest = f64::min(nearest, apart);
            }
        }
        let way = human.speed.min(FASTEST) * seconds;
        // At a corner, the path goes on elsewhere; the person gets beside it step by step.
        let rest = [
            right[0] * wanted - self.aside[0],
            right[1] * wanted - self.aside[1],
        ];
        let far = rest[0].hypot(rest[1]);
        let part = if far > way { way / far } else { 1.0 };
        self.aside = [
            self.aside[0] + rest[0] * part,
            self.aside[1] + rest[1] * part,
        ];
        let path = to[0].atan2(to[1]);
        let turn = wrapped(path - self.facing.unwrap_or(path));
        let most = TURN * seconds;
        let facing = path - turn + turn.clamp(-most, most);
        self.facing = Some(wrapped(facing));
        // A person who turns round does not walk meanwhile.
        let turns_round = wrapped(path - facing).abs() > TURNS_ROUND;
        let stands = nearest < STOPS || turns_round;
        let advance = if stands { 0.0 } else { way };
        self.way += advance;
        let stride = (STRIDE * human.height).max(1.0);
        self.phase = wrapped(self.phase + TAU * advance.max(far.min(way)) / stride);
    }

    /// Where the person is in its parent, at the height `y`.
    pub(crate) fn pose(&self, human: &Human, y: f64) -> Pose {
        let (at, to) = on_path(&human.path, self.way);
        let facing = self.facing.unwrap_or_else(|| to[0].atan2(to[1]));
        let (x, z) = (at[0] + self.aside[0], at[1] + self.aside[1]);
        Pose::new(x, y, z, 0.0, facing, 0.0)
    }
}
