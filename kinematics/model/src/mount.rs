//! Joints of several coordinates, and robots that are connected to each other or to the world.

use crate::robot::{Body, Joint, LoopJoint, Motion, Robot, Transmission};
use rc_quantity::Transform;

/// How a body is held in another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Held {
    /// It does not move.
    Fixed,
    /// It moves in a plane, and turns about its normal.
    Planar,
    /// It moves in all six ways.
    Floating,
    /// It turns about each axis through its origin.
    Spherical,
}

/// A root that is connected to another tree, or to a frame that is new.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mount<'a> {
    /// The link at the root of its tree.
    pub link: &'a str,
    /// The link that holds it, or a name of a new one.
    pub base: &'a str,
    /// Where the link is in it while all coordinates between them are 0.
    pub place: Transform,
    /// How the link moves there.
    pub held: Held,
}

/// A robot that cannot be connected so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// There is no link of this name.
    Unknown,
    /// The link has a joint above it.
    NoRoot,
    /// The base is in the tree of the link.
    Circle,
    /// A joint or a coordinate has the name of the link.
    Taken,
}

/// One of the joints that move one after the other: its name after that of all, whether it turns, its axis,
/// and its place among their coordinates.
type Part = (&'static str, bool, [f64; 3], usize);

impl Held {
    /// The joints from the base to the body. A plane has this normal.
    fn parts(self, normal: [f64; 3]) -> Vec<Part> {
        match self {
            Self::Fixed => Vec::new(),
            Self::Planar => {
                let [x, y] = across(normal);
                vec![
                    ("x", false, x, 0),
                    ("y", false, y, 1),
                    ("yaw", true, normal, 2),
                ]
            }
            // The angles of URDF: roll, pitch and yaw about axes that stand still, in this order.
            Self::Spherical => vec![
                ("yaw", true, [0.0, 0.0, 1.0], 2),
                ("pitch", true, [0.0, 1.0, 0.0], 1),
                ("roll", true, [1.0, 0.0, 0.0], 0),
            ],
            Self::Floating => vec![
                ("x", false, [1.0, 0.0, 0.0], 0),
                ("y", false, [0.0, 1.0, 0.0], 1),
                ("z", false, [0.0, 0.0, 1.0], 2),
                ("yaw", true, [0.0, 0.0, 1.0], 5),
                ("pitch", true, [0.0, 1.0, 0.0], 4),
                ("roll", true, [1.0, 0.0, 0.0], 3),
            ],
        }
    }

    /// The names of the coordinates of a joint with this name.
    pub fn coordinates(self, name: &str) -> Vec<String> {
        let mut parts = self.parts([0.0, 0.0, 1.0]);
        parts.sort_unstable_by_key(|part| part.3);
        let names = parts.iter();
        names.map(|(part, ..)| format!("{name}.{part}")).collect()
    }
}

/// The axes x and y after the shortest turn that brings z to this axis of length 1.
pub(crate) fn across([x, y, z]: [f64; 3]) -> [[f64; 3]; 2] {
    // 1 + z has few digits near -1.
    let flat = x * x + y * y;
    let by = if z > 0.0 {
        1.0 / (1.0 + z)
    } else if flat > 1e-200 {
        (1.0 - z) / flat
    } else {
        return [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    };
    [
        [1.0 - x * x * by, -x * y * by, -x],
        [-x * y * by, 1.0 - y * y * by, -y],
    ]
}

impl Robot {
    /// The joint that holds the next body in `parent`. Bodies for its coordinates but the last come before
    /// it. `first` is the place of its first coordinate; `place` has the normal of the plane.
    pub(crate) fn hold(
        &mut self,
        held: Held,
        name: &str,
        parent: usize,
        place: (Transform, [f64; 3]),
        first: usize,
    ) -> Joint {
        let (place, normal) = place;
        let mut joint = Joint {
            name: name.to_owned(),
            parent,
            place,
            motion: Motion::Fixed,
            axis: normal,
            limits: None,
        };
        for (at, (part, turns, axis, coordinate)) in held.parts(normal).into_iter().enumerate() {
            if at > 0 {
                self.bodies.push(Body {
                    name: String::new(),
                    inertia: None,
                    joint: Some(joint.clone()),
                });
                joint.parent = self.bodies.len() - 1;
                joint.place = Transform::IDENTITY;
            }
            let (coordinate, ratio, offset) = (first + coordinate, 1.0, 0.0);
            joint.name = format!("{name}.{part}");
            joint.axis = axis;
            joint.motion = if turns {
                Motion::Turns {
                    coordinate,
                    ratio,
                    offset,
                }
            } else {
                Motion::Slides {
                    coordinate,
                    ratio,
                    offset,
                }
            };
        }
        joint
    }

    /// Takes another robot in, as a tree of its own. With a name, those of its links and joints become
    /// `NAME.LINK`.
    pub fn add(&mut self, name: Option<&str>, other: Self) {
        let (bodies, coordinates) = (self.bodies.len(), self.coordinates.len());
        let named = |own: &str| match name {
            Some(name) if !own.is_empty() => format!("{name}.{own}"),
            _ => own.to_owned(),
        };
        for mut body in other.bodies {
            body.name = named(&body.name);
            if let Some(joint) = &mut body.joint {
                joint.name = named(&joint.name);
                joint.parent += bodies;
                match &mut joint.motion {
                    Motion::Turns { coordinate, .. } | Motion::Slides { coordinate, .. } => {
                        *coordinate += coordinates;
                    }
                    Motion::Fixed => {}
                }
            }
            self.bodies.push(body);
        }
        let own = other.coordinates.iter();
        self.coordinates.extend(own.map(|own| named(own)));
        self.loops
            .extend(other.loops.into_iter().map(|own| LoopJoint {
                name: named(&own.name),
                frames: own.frames.map(|at| at + bodies),
                ..own
            }));
        let motors = other.transmissions.into_iter().map(|own| Transmission {
            name: named(&own.name),
            actuator: named(&own.actuator),
            coordinate: own.coordinate + coordinates,
            ..own
        });
        self.transmissions.extend(motors);
    }

    /// Connects the root of a tree to a link of another one, or to a new link. Its coordinates come after
    /// those of the robot: `LINK.x` and others.
    ///
    /// # Errors
    /// The link is not the root of another tree, or its name is taken.
    pub fn mount(&mut self, mount: &Mount<'_>) -> Result<(), Refused> {
        let link = self.body(mount.link).ok_or(Refused::Unknown)?;
        if self.bodies[link].joint.is_some() {
            return Err(Refused::NoRoot);
        }
        let base = self.body(mount.base);
        if base.is_some_and(|base| self.root(base) == link) {
            return Err(Refused::Circle);
        }
        let names = mount.held.coordinates(mount.link);
        let mut joints = self.bodies.iter().filter_map(|body| body.joint.as_ref());
        if joints.any(|joint| joint.name == mount.link || names.contains(&joint.name)) {
            return Err(Refused::Taken);
        }
        let base = base.unwrap_or_else(|| {
            self.bodies.push(Body {
                name: mount.base.to_owned(),
                inertia: None,
                joint: None,
            });
            self.bodies.len() - 1
        });
        let first = self.coordinates.len();
        let place = (mount.place, [0.0, 0.0, 1.0]);
        let joint = self.hold(mount.held, mount.link, base, place, first);
        self.bodies[link].joint = Some(joint);
        self.coordinates.extend(names);
        self.sort();
        Ok(())
    }

    /// Brings each body after the one that its joint is fixed to.
    fn sort(&mut self) {
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); self.bodies.len()];
        let mut rest = Vec::new();
        for (at, body) in self.bodies.iter().enumerate().rev() {
            match &body.joint {
                Some(joint) => below[joint.parent].push(at),
                None => rest.push(at),
            }
        }
        let mut order = Vec::with_capacity(self.bodies.len());
        let mut places = vec![0; self.bodies.len()];
        while let Some(at) = rest.pop() {
            places[at] = order.len();
            order.push(at);
            rest.append(&mut below[at]);
        }
        let mut sorted: Vec<Body> = order.iter().map(|at| self.bodies[*at].clone()).collect();
        for joint in sorted.iter_mut().filter_map(|body| body.joint.as_mut()) {
            joint.parent = places[joint.parent];
        }
        for own in &mut self.loops {
            own.frames = own.frames.map(|at| places[at]);
        }
        self.bodies = sorted;
    }
}

#[cfg(test)]
mod tests {
    use super::across;

    /// Also where almost half a turn brings z there.
    #[test]
    fn axes_across_have_length_1_and_right_angles() {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        for lean in [
            0.0, 1e-120, 1e-9, 3e-7, 1e-5, 1e-3, 0.5, 1.2, 1.57, 1.6, 3.0,
        ] {
            for around in [0.0_f64, 0.7, 3.0, 4.5] {
                for sense in [1.0, -1.0] {
                    let (sine, cosine) = f64::sin_cos(lean);
                    let axis = [sine * around.cos(), sine * around.sin(), sense * cosine];
                    let [x, y] = across(axis);
                    let all = [
                        (axis, x, 0.0),
                        (axis, y, 0.0),
                        (x, y, 0.0),
                        (x, x, 1.0),
                        (y, y, 1.0),
                    ];
                    for (one, other, wanted) in all {
                        let found = dot(one, other);
                        assert!(
                            (found - wanted).abs() < 2e-15,
                            "{axis:?} {x:?} {y:?}: {found}"
                        );
                    }
                }
            }
        }
    }
}
