//! Bases that drive.

use crate::error::Error;
use crate::pose2d::{Motion, Pose2D, Speed};
use crate::random::Random;
use crate::state::BaseState;
use crate::world::World;
use innermodel::kinds::{Drive, Robot};
use innermodel::{Kind, NodeId, Pose, Transform};

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

    /// State of a base.
    pub fn base(&self, id: &str) -> Result<&BaseState, Error> {
        let (node, _) = self.robot(id)?;
        self.state
            .bases
            .get(&node)
            .ok_or_else(|| Error::unknown(id, "robot"))
    }

    /// Where a base is, whatever its odometry says.
    pub fn place(&self, id: &str) -> Result<Pose2D, Error> {
        let (node, _) = self.robot(id)?;
        let place = self.tree().between(NodeId::ROOT, node)?;
        Ok(Pose2D::of(&place))
    }

    /// Sets the place by the wheels, the corrected one, or both.
    pub fn set_odometer(
        &mut self,
        id: &str,
        odometer: Option<Pose2D>,
        corrected: Option<Pose2D>,
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
        let without_power = self.without_power();
        for node in bases {
            self.move_base(node, !without_power.contains(&node))?;
        }
        Ok(())
    }

    fn move_base(&mut self, node: NodeId, is_powered: bool) -> Result<(), Error> {
        let tree = self.tree();
        let here = tree.node(node)?;
        let Kind::Robot(robot) = here.kind() else {
            return Ok(());
        };
        let mut base = self.state.bases.get(&node).cloned().unwrap_or_default();
        let seconds = self.step.as_secs_f64();
        let wanted = if is_powered {
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
                let here = here.to_root();
                self.free_fraction(node, &here, &here, &true_speed)?
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
                let (part, _) = self.free_fraction(node, &here.to_root(), &there, &rest)?;
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
                let wheel = counted(wheel, robot.noise, &mut random);
                base.odometer = base.odometer.after(&wheel);
                base.corrected = base.corrected.after(&wheel);
            }
            let pose = moved(here.pose(), &motions);
            if pose == here.pose() {
                self.state.bases.insert(node, base);
                return Ok(());
            }
            if let Err(error) = self.change(|edit| edit.set_pose(node, pose)) {
                // The base stays where it is, and the world goes on.
                self.report(format!("`{}` cannot move: {error}", here.id()));
                return Ok(());
            }
            self.follow();
        }
        self.state.bases.insert(node, base);
        Ok(())
    }
}

/// The motion that wheels count. The variance grows with the way, so that the length of a step
/// does not matter: after 1 m or 1 rad, the standard deviation is `noise` m or rad.
fn counted(wheel: &Motion, noise: f64, random: &mut Random) -> Motion {
    if noise <= 0.0 {
        return *wheel;
    }
    let mut factor = |way: f64, unit: f64| {
        let error = noise * random.normal();
        if way > 0.0 {
            1.0 + error * (unit / way).sqrt()
        } else {
            1.0
        }
    };
    let along = factor(wheel.right.hypot(wheel.front), 1000.0);
    let about = factor(wheel.turn.abs(), 1.0);
    Motion {
        right: wheel.right * along,
        front: wheel.front * along,
        turn: wheel.turn * about,
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
                    crate::pose2d::wrapped(pose.rotation[1] - motion.turn),
                    0.0,
                ],
            }
        } else {
            there.pose()
        };
    }
    pose
}
