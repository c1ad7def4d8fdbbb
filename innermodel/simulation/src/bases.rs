//! Bases that drive.

use crate::error::Error;
use crate::free_path::FreePart;
use crate::pose2d::{Motion, Pose2D, Speed};
use crate::random::Random;
use innermodel::kinds::{Drive, Robot};
use innermodel::{Kind, NodeId, NodeRef, Pose, Snapshot, Transform};
use std::collections::BTreeMap;

/// State of a base.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BaseState {
    /// The commanded speed, within the limits.
    pub wanted: Speed,
    /// The speed of the last step.
    pub actual: Speed,
    /// The place by the wheels.
    pub odometer: Pose2D,
    /// The place by the wheels, since it was corrected.
    pub corrected: Pose2D,
    /// Bodies that stopped the base in the last step: one of the robot, and the obstacle.
    pub stopped_by: Option<(NodeId, NodeId)>,
}

/// The bases of a world.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bases(BTreeMap<NodeId, BaseState>);

impl Bases {
    /// Adds the base of a node, if it is one, and is new.
    pub(crate) fn notice(&mut self, node: NodeRef<'_>) {
        if let Kind::Robot(_) = node.kind() {
            let place = Pose2D::of(&node.to_root());
            self.0.entry(node.node_id()).or_insert_with(|| BaseState {
                odometer: place,
                corrected: place,
                ..BaseState::default()
            });
        }
    }

    /// Drops those that the tree does not have any more.
    pub(crate) fn drop_removed(&mut self, tree: &Snapshot) {
        let is_one = |kind: &Kind| matches!(kind, Kind::Robot(_));
        let there = |node| tree.node(node).is_ok_and(|node| is_one(node.kind()));
        self.0.retain(|node, _| there(*node));
    }

    pub(crate) fn nodes(&self) -> impl Iterator<Item = NodeId> {
        self.0.keys().copied()
    }

    pub(crate) fn state(&self, node: NodeId) -> Option<&BaseState> {
        self.0.get(&node)
    }

    /// Replaces the state of a base by that after a step.
    pub(crate) fn set(&mut self, node: NodeId, state: BaseState) {
        self.0.insert(node, state);
    }

    pub(crate) fn get(&self, tree: &Snapshot, id: &str) -> Result<&BaseState, Error> {
        let (node, _) = robot(tree, id)?;
        self.state(node).ok_or_else(|| Error::unknown(id, "robot"))
    }

    fn get_mut(&mut self, node: NodeId, id: &str) -> Result<&mut BaseState, Error> {
        let base = self.0.get_mut(&node);
        base.ok_or_else(|| Error::unknown(id, "robot"))
    }

    /// Commands a speed. Returns the one that the base takes.
    pub(crate) fn drive(
        &mut self,
        tree: &Snapshot,
        id: &str,
        mut speed: Speed,
    ) -> Result<Speed, Error> {
        let (node, robot) = robot(tree, id)?;
        if [speed.side, speed.advance, speed.turn]
            .iter()
            .any(|n| !n.is_finite())
        {
            return Err(Error::not_finite("a speed", id));
        }
        if robot.drive == Drive::Differential {
            speed.side = 0.0;
        }
        let speed = speed.limited(&robot);
        self.get_mut(node, id)?.wanted = speed;
        Ok(speed)
    }

    /// Sets the place by the wheels, the corrected one, or both.
    pub(crate) fn set_odometer(
        &mut self,
        tree: &Snapshot,
        id: &str,
        odometer: Option<Pose2D>,
        corrected: Option<Pose2D>,
    ) -> Result<(), Error> {
        let (node, _) = robot(tree, id)?;
        let mut both = odometer.iter().chain(&corrected);
        if both.any(|p| [p.x, p.z, p.alpha].iter().any(|n| !n.is_finite())) {
            return Err(Error::not_finite("a place", id));
        }
        let base = self.get_mut(node, id)?;
        base.odometer = odometer.unwrap_or(base.odometer);
        base.corrected = corrected.unwrap_or(base.corrected);
        Ok(())
    }
}

/// The node of a robot, and how it is built.
pub(crate) fn robot(tree: &Snapshot, id: &str) -> Result<(NodeId, Robot), Error> {
    let node = tree.node(id)?;
    match node.kind() {
        Kind::Robot(robot) => Ok((node.node_id(), robot.clone())),
        kind => Err(Error::other_kind(id, kind, "robot")),
    }
}

impl BaseState {
    /// The state after a step of `seconds`, and the new pose in the frame of the parent. `free`
    /// says which part of a motion from a place is possible.
    pub(crate) fn after_step(
        &self,
        (here, robot): (NodeRef<'_>, &Robot),
        is_powered: bool,
        seconds: f64,
        random: &mut Random,
        mut free: impl FnMut(&Transform, &Speed) -> Result<FreePart, Error>,
    ) -> Result<(Self, Pose), Error> {
        let wanted = if is_powered {
            self.wanted
        } else {
            Speed::default()
        };
        let mut base = Self {
            stopped_by: None,
            actual: wanted,
            ..self.clone()
        };
        if wanted == Speed::default() {
            return Ok((base, here.pose()));
        }
        // Wheels that slip move the base less than themselves.
        let true_speed = wanted.scaled(1.0 - robot.slip);
        let place = here.to_root();
        let (part, stopped_by) = if robot.collide {
            free(&place, &true_speed)?
        } else {
            (1.0, None)
        };
        base.stopped_by = stopped_by;
        let mut motions = vec![Motion::arc(&true_speed.scaled(part), seconds)];
        let mut wheels = vec![Motion::arc(&wanted.scaled(part), seconds)];
        let mut turned = wanted.turn * part;
        // An obstacle that ends the way does not end the turn, if there is room for it.
        let rest = Speed {
            turn: true_speed.turn * (1.0 - part),
            ..Speed::default()
        };
        if part < 1.0 && rest.turn != 0.0 {
            let (turn_part, _) = free(&(place * motions[0].transform()), &rest)?;
            motions.push(Motion::arc(&rest.scaled(turn_part), seconds));
            let wheel_rest = Speed {
                turn: wanted.turn * (1.0 - part) * turn_part,
                ..Speed::default()
            };
            wheels.push(Motion::arc(&wheel_rest, seconds));
            turned += wheel_rest.turn;
        }
        base.actual = Speed {
            turn: turned,
            ..wanted.scaled(part)
        };
        for wheel in &wheels {
            let wheel = counted(wheel, robot.noise, random);
            base.odometer = base.odometer.after(&wheel);
            base.corrected = base.corrected.after(&wheel);
        }
        Ok((base, moved(here.pose(), &motions)))
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

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel::InnerModel;

    const SCENE: &str = r#"<innerModel>
        <differentialrobot id="base" collide="1"/><transform id="other"/></innerModel>"#;

    fn ahead(advance: f64, turn: f64) -> Speed {
        Speed {
            advance,
            turn,
            ..Speed::default()
        }
    }

    #[test]
    fn a_command_that_is_refused_changes_nothing() {
        let tree = InnerModel::parse(SCENE).expect("a scene").snapshot();
        let mut bases = Bases::default();
        tree.nodes().for_each(|node| bases.notice(node));
        let sideways = Speed {
            side: 70.0,
            ..ahead(50.0, 0.1)
        };
        let taken = bases.drive(&tree, "base", sideways).expect("a speed");
        assert_eq!(taken, ahead(50.0, 0.1), "a differential base");
        for refused in [ahead(f64::NAN, 0.0), ahead(0.0, f64::INFINITY)] {
            bases.drive(&tree, "base", refused).expect_err("no number");
        }
        bases.drive(&tree, "other", taken).expect_err("no base");
        assert_eq!(bases.get(&tree, "base").expect("a base").wanted, taken);
        assert_eq!(bases.nodes().count(), 1);
    }

    #[test]
    fn an_obstacle_ends_the_way_and_not_the_turn() {
        let tree = InnerModel::parse(SCENE).expect("a scene").snapshot();
        let here = tree.node("base").expect("a base");
        let Kind::Robot(robot) = here.kind() else {
            panic!("a robot");
        };
        let base = BaseState {
            wanted: ahead(100.0, 0.2),
            ..BaseState::default()
        };
        let obstacle = (here.node_id(), NodeId::ROOT);
        let step = |is_powered, free: f64| {
            let mut random = Random::new(1, "base", 1);
            let mut asked = Vec::new();
            let after = base.after_step((here, robot), is_powered, 1.0, &mut random, |_, speed| {
                asked.push(*speed);
                Ok(if speed.advance == 0.0 {
                    (1.0, None)
                } else {
                    (free, (free < 1.0).then_some(obstacle))
                })
            });
            let (base, pose) = after.expect("a step");
            (base, pose, asked)
        };
        let (stopped, pose, asked) = step(true, 0.0);
        assert_eq!(asked, [ahead(100.0, 0.2), ahead(0.0, 0.2)]);
        assert_eq!(stopped.stopped_by, Some(obstacle));
        assert_eq!(stopped.actual, ahead(0.0, 0.2));
        assert_eq!(pose.translation, [0.0; 3]);
        assert!((stopped.odometer.alpha.abs() - 0.2).abs() < 1e-9);
        let (free, _, asked) = step(true, 1.0);
        assert_eq!((free.actual, asked.len()), (ahead(100.0, 0.2), 1));
        let (idle, pose, asked) = step(false, 1.0);
        assert_eq!((idle.actual, asked.len()), (Speed::default(), 0));
        assert_eq!(pose, here.pose());
    }
}
