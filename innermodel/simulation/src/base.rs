//! Bases that drive.

use crate::error::Error;
use crate::planar::{Motion, Planar};
use crate::random::Random;
use crate::world::World;
use innermodel::kinds::{Drive, Robot};
use innermodel::{Kind, NodeId, NodeRef, Pose, Transform};
use innermodel_collision::Touching;
use std::collections::BTreeMap;

/// How often the last piece of a way to an obstacle is halved: the base stops within a micrometre.
const HALVINGS: u32 = 24;
/// How deep bodies are in each other before they stop a base, in millimetres. A wheel that stands
/// on a floor touches it by rounding errors.
const TOLERANCE: f64 = 0.01;
/// How much deeper than at the start of a step two bodies may get that were deeper in each other
/// than [`TOLERANCE`], in millimetres: more than the errors of rounding.
const ROUNDING: f64 = 1e-6;
/// The greatest speed of a base or of a motor whose own limit is greater or missing, in mm/s or
/// rad/s. No place gets infinite by it.
pub(crate) const FASTEST: f64 = 1e6;
/// The most pieces into which a motion of one step is cut.
const MOST_PIECES: f64 = 1000.0;

/// How a base moves, in its own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Speed {
    /// To the right, in mm/s. 0 for a differential base.
    pub side: f64,
    /// Forwards, in mm/s.
    pub advance: f64,
    /// Counter-clockwise seen from above, in rad/s.
    pub turn: f64,
}

impl Speed {
    fn scaled(&self, factor: f64) -> Self {
        Self {
            side: self.side * factor,
            advance: self.advance * factor,
            turn: self.turn * factor,
        }
    }

    /// The nearest speed that a robot can have.
    fn limited(&self, robot: &Robot) -> Self {
        let (fastest, turn) = (robot.max_speed.min(FASTEST), robot.max_turn.min(FASTEST));
        // The greatest numbers would make an infinite length.
        let greatest = self.side.abs().max(self.advance.abs());
        let unit = if greatest > fastest { greatest } else { 1.0 };
        let (side, advance) = (self.side / unit, self.advance / unit);
        let way = side.hypot(advance) * unit;
        let factor = if way > fastest {
            fastest / side.hypot(advance)
        } else {
            unit
        };
        Self {
            side: side * factor,
            advance: advance * factor,
            turn: self.turn.max(-turn).min(turn),
        }
    }
}

/// What a base knows of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BaseState {
    /// The commanded speed, within the limits.
    pub wanted: Speed,
    /// The speed of the last step.
    pub actual: Speed,
    /// The place by the wheels.
    pub odometer: Planar,
    /// The place by the wheels, since it was corrected.
    pub corrected: Planar,
    /// What stopped the base in the last step: a body of the robot, and the obstacle.
    pub stopped_by: Option<(NodeId, NodeId)>,
}

impl World {
    /// Commands a speed, which holds until the next command. Returns the speed that the base takes:
    /// one within its limits, and without `side` for a differential base.
    ///
    /// # Errors
    /// There is no such base, or a number is not finite: then the old speed holds.
    pub fn drive(&mut self, id: &str, speed: Speed) -> Result<Speed, Error> {
        let (node, robot) = self.robot(id)?;
        if [speed.side, speed.advance, speed.turn]
            .iter()
            .any(|n| !n.is_finite())
        {
            return Err(Error::not_finite("a speed", id));
        }
        let mut speed = speed;
        if robot.drive == Drive::Differential {
            speed.side = 0.0;
        }
        let speed = speed.limited(&robot);
        self.base_mut(node, id)?.wanted = speed;
        Ok(speed)
    }

    /// What a base knows of itself.
    pub fn base(&self, id: &str) -> Result<&BaseState, Error> {
        let (node, _) = self.robot(id)?;
        self.state
            .bases
            .get(&node)
            .ok_or_else(|| Error::unknown(id, "robot"))
    }

    /// Where a base is, whatever its odometry says.
    pub fn place(&self, id: &str) -> Result<Planar, Error> {
        let (node, _) = self.robot(id)?;
        let place = self.tree().between(NodeId::ROOT, node)?;
        Ok(Planar::of(&place))
    }

    /// Sets the place by the wheels, the corrected one, or both.
    pub fn set_odometer(
        &mut self,
        id: &str,
        odometer: Option<Planar>,
        corrected: Option<Planar>,
    ) -> Result<(), Error> {
        let (node, _) = self.robot(id)?;
        let mut both = odometer.iter().chain(&corrected);
        if both.any(|p| [p.x, p.z, p.alpha].iter().any(|n| !n.is_finite())) {
            return Err(Error::not_finite("a place", id));
        }
        let base = self.base_mut(node, id)?;
        base.odometer = odometer.unwrap_or(base.odometer);
        base.corrected = corrected.unwrap_or(base.corrected);
        Ok(())
    }

    /// The node of a robot, and how it is built.
    pub fn robot(&self, id: &str) -> Result<(NodeId, Robot), Error> {
        let tree = self.tree();
        let node = tree.node(id)?;
        match node.kind() {
            Kind::Robot(robot) => Ok((node.node_id(), robot.clone())),
            kind => Err(Error::other_kind(id, kind, "robot")),
        }
    }

    fn base_mut(&mut self, node: NodeId, id: &str) -> Result<&mut BaseState, Error> {
        let base = self.state.bases.get_mut(&node);
        base.ok_or_else(|| Error::unknown(id, "robot"))
    }

    /// Moves all bases by one step.
    pub(crate) fn move_bases(&mut self) -> Result<(), Error> {
        let bases: Vec<NodeId> = self.state.bases.keys().copied().collect();
        for node in bases {
            self.move_base(node)?;
        }
        Ok(())
    }

    fn move_base(&mut self, node: NodeId) -> Result<(), Error> {
        let tree = self.tree();
        let here = tree.node(node)?;
        let Kind::Robot(robot) = here.kind() else {
            return Ok(());
        };
        let mut base = self.state.bases.get(&node).cloned().unwrap_or_default();
        let seconds = self.step.as_secs_f64();
        let wanted = if self.is_powered(node) {
            base.wanted
        } else {
            Speed::default()
        };
        base.stopped_by = None;
        base.actual = wanted;
        if wanted != Speed::default() {
            // Wheels that slip move the base less than themselves.
            let true_speed = wanted.scaled(1.0 - robot.slip);
            let (free, stopped_by) = if robot.collide {
                self.free_part(node, &here.to_root(), &true_speed)?
            } else {
                (1.0, None)
            };
            base.stopped_by = stopped_by;
            let mut motions = vec![Motion::arc(&true_speed.scaled(free), seconds)];
            let mut wheels = vec![Motion::arc(&wanted.scaled(free), seconds)];
            let mut turned = wanted.turn * free;
            // An obstacle that ends the way does not end the turn, if there is room for it.
            let rest = Speed {
                turn: true_speed.turn * (1.0 - free),
                ..Speed::default()
            };
            if free < 1.0 && rest.turn != 0.0 {
                let there = here.to_root() * motions[0].transform();
                let (part, _) = self.free_part_from(node, &here.to_root(), &there, &rest)?;
                motions.push(Motion::arc(&rest.scaled(part), seconds));
                let wheel_rest = Speed {
                    turn: wanted.turn * (1.0 - free) * part,
                    ..Speed::default()
                };
                wheels.push(Motion::arc(&wheel_rest, seconds));
                turned += wheel_rest.turn;
            }
            base.actual = Speed {
                turn: turned,
                ..wanted.scaled(free)
            };
            let mut random = Random::new(self.seed, here.id(), self.state.steps);
            for wheel in &wheels {
                let mut measured = |way: f64| way * (1.0 + robot.noise * random.normal());
                let wheel = if robot.noise > 0.0 {
                    Motion {
                        right: measured(wheel.right),
                        front: measured(wheel.front),
                        turn: measured(wheel.turn),
                    }
                } else {
                    *wheel
                };
                base.odometer = base.odometer.after(&wheel);
                base.corrected = base.corrected.after(&wheel);
            }
            let pose = moved(here.pose(), &motions);
            if let Err(error) = self.change(|edit| edit.set_pose(node, pose)) {
                // The base stays where it is, and the world goes on.
                self.tell(format!("`{}` cannot move: {error}", here.id()));
                return Ok(());
            }
            self.follow();
        }
        self.state.bases.insert(node, base);
        Ok(())
    }

    /// Which part of a motion, from 0 to 1, is possible before the robot touches an obstacle, or
    /// gets deeper into one that it touches now, and what stops it.
    fn free_part(
        &self,
        node: NodeId,
        here: &Transform,
        speed: &Speed,
    ) -> Result<(f64, Option<(NodeId, NodeId)>), Error> {
        self.free_part_from(node, here, here, speed)
    }

    /// The same for a robot that is at `here` and starts at `from`.
    fn free_part_from(
        &self,
        node: NodeId,
        here: &Transform,
        from: &Transform,
        speed: &Speed,
    ) -> Result<(f64, Option<(NodeId, NodeId)>), Error> {
        let space = self.space();
        let seconds = self.step.as_secs_f64();
        let back = here.inverse();
        let tree = self.tree();
        // A bumper gives way.
        let counts = |body: NodeId, _| {
            let body = tree.node(body).ok();
            let mut above = std::iter::successors(body, NodeRef::parent);
            !above.any(|node| matches!(node.kind(), Kind::TouchSensor(_)))
        };
        let touching = |motion: &Transform| space.touching(node, motion, &counts);
        let touched = |part: f64| {
            let motion = Motion::arc(&speed.scaled(part), seconds);
            touching(&(*from * motion.transform() * back))
        };
        // How deep a pair may get. A depth that cannot be computed stops nothing at the start, and
        // everything on the way.
        let known: BTreeMap<(NodeId, NodeId), f64> = touching(&(*from * back))?
            .into_iter()
            .map(|t| {
                let most = t
                    .depth
                    .map_or(f64::INFINITY, |d| TOLERANCE.max(d + ROUNDING));
                ((t.body, t.other), most)
            })
            .collect();
        let new = |part: f64| -> Result<Option<(NodeId, NodeId)>, Error> {
            let stops = |t: &Touching| {
                let most = known.get(&(t.body, t.other)).unwrap_or(&TOLERANCE);
                t.depth.unwrap_or(f64::MAX) > *most
            };
            let stopping = touched(part)?.into_iter().find(stops);
            Ok(stopping.map(|t| (t.body, t.other)))
        };
        let way = speed.side.hypot(speed.advance) * seconds;
        let thickness = space.half_thickness(node)?;
        let pieces = if thickness > 0.0 {
            let straight = (way / thickness).ceil();
            // Of a turn, a piece is at most a tenth of a radian.
            let turning = (speed.turn.abs() * seconds * 10.0).ceil();
            straight.max(turning).clamp(1.0, MOST_PIECES)
        } else {
            1.0
        };
        let mut reached = 0.0;
        for piece in 1..=pieces as u32 {
            let next = f64::from(piece) / pieces;
            if let Some(mut pair) = new(next)? {
                let (mut free, mut blocked) = (reached, next);
                for _ in 0..HALVINGS {
                    let middle = f64::midpoint(free, blocked);
                    match new(middle)? {
                        Some(nearer) => (blocked, pair) = (middle, nearer),
                        None => free = middle,
                    }
                }
                return Ok((free, Some(pair)));
            }
            reached = next;
        }
        Ok((1.0, None))
    }
}

/// A pose after motions in its own frame.
fn moved(pose: Pose, motions: &[Motion]) -> Pose {
    let mut pose = pose;
    for motion in motions {
        let there = Transform::of(&pose) * motion.transform();
        pose = if pose.rotation[0] == 0.0 && pose.rotation[2] == 0.0 {
            // The angle of a base that stands upright has no rounding errors of matrices.
            Pose {
                translation: there.translation.into(),
                rotation: [
                    0.0,
                    crate::planar::wrapped(pose.rotation[1] - motion.turn),
                    0.0,
                ],
            }
        } else {
            there.pose()
        };
    }
    pose
}
