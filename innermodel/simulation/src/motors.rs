//! Motors of joints.

use crate::error::Error;
use crate::pose2d::FASTEST;
use crate::random::Random;
use crate::sensor_noise::SensorNoise;
use innermodel::kinds::{Encoder, Signal};
use innermodel::{Kind, NodeId, NodeRef, Snapshot};
use std::collections::BTreeMap;

/// Goal of a motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MotorGoal {
    /// It stays where it is.
    #[default]
    Hold,
    /// It goes to a position, in rad or mm.
    Position {
        /// Within the limits of the joint.
        target: f64,
        /// At most at this speed; 0: as fast as it can.
        speed: f64,
    },
    /// It moves at a speed until it is at a limit.
    Velocity {
        /// In rad/s or mm/s.
        velocity: f64,
        /// At most with this acceleration; 0: at once.
        acceleration: f64,
    },
    /// The motor is off: forces alone move the joint. Without forces, it stays where it is.
    Free,
}

/// State of a motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorState {
    /// Goal of the motor.
    pub goal: MotorGoal,
    /// In rad or mm.
    pub position: f64,
    /// In the last step, in rad/s or mm/s.
    pub velocity: f64,
}

/// The greatest position of a joint without a limit, in rad or mm.
const FARTHEST: f64 = 1e9;

/// Limits of a joint: least and greatest position, greatest speed.
pub(crate) fn limits(kind: &Kind) -> Option<(f64, f64, f64)> {
    let (min, max, speed) = match kind {
        Kind::Joint(joint) => (joint.min, joint.max, joint.max_speed),
        Kind::Prismatic(joint) => (joint.min, joint.max, joint.max_speed),
        _ => return None,
    };
    let speed = if speed > 0.0 { speed } else { FASTEST };
    Some((min.max(-FARTHEST), max.min(FARTHEST), speed.min(FASTEST)))
}

fn encoder(kind: &Kind) -> Option<Encoder> {
    match kind {
        Kind::Joint(joint) => Some(joint.encoder),
        Kind::Prismatic(joint) => Some(joint.encoder),
        _ => None,
    }
}

/// The motors of a world.
#[derive(Clone, Debug, Default)]
pub(crate) struct Motors(BTreeMap<NodeId, MotorState>);

impl Motors {
    /// Adds the motor of a node, if it is a joint, and is new.
    pub(crate) fn notice(&mut self, node: NodeRef<'_>) {
        if limits(node.kind()).is_some() {
            self.0.entry(node.node_id()).or_insert_with(|| MotorState {
                position: node.position().unwrap_or_default(),
                ..MotorState::default()
            });
        }
    }

    /// Drops those that the tree does not have any more.
    pub(crate) fn drop_removed(&mut self, tree: &Snapshot) {
        let there = |node| tree.node(node).is_ok_and(|n| limits(n.kind()).is_some());
        self.0.retain(|node, _| there(*node));
    }

    /// All motors, for the forces that move joints.
    pub(crate) fn states(&self) -> &BTreeMap<NodeId, MotorState> {
        &self.0
    }

    /// Sets the goals of motors: all of them, or none. Returns which values were limited.
    pub(crate) fn command(
        &mut self,
        tree: &Snapshot,
        goals: &[(&str, MotorGoal)],
    ) -> Result<Vec<bool>, Error> {
        let mut checked = Vec::new();
        for (id, goal) in goals {
            let node = tree.node(*id)?;
            let Some((min, max, fastest)) = limits(node.kind()) else {
                return Err(Error::other_kind(id, node.kind(), "joint"));
            };
            let numbers = match *goal {
                MotorGoal::Hold | MotorGoal::Free => [0.0; 2],
                MotorGoal::Position { target, speed } => [target, speed],
                MotorGoal::Velocity {
                    velocity,
                    acceleration,
                } => [velocity, acceleration],
            };
            if numbers.iter().any(|n| !n.is_finite()) {
                return Err(Error::not_finite("a goal", id));
            }
            let allowed = match *goal {
                MotorGoal::Hold | MotorGoal::Free => *goal,
                MotorGoal::Position { target, speed } => MotorGoal::Position {
                    target: target.max(min).min(max),
                    speed: speed.abs().min(fastest),
                },
                MotorGoal::Velocity {
                    velocity,
                    acceleration,
                } => MotorGoal::Velocity {
                    velocity: velocity.max(-fastest).min(fastest),
                    acceleration: acceleration.abs(),
                },
            };
            checked.push((node.node_id(), allowed, allowed != *goal));
        }
        for (node, goal, _) in &checked {
            if let Some(motor) = self.0.get_mut(node) {
                motor.goal = *goal;
            }
        }
        Ok(checked.into_iter().map(|(.., clamped)| clamped).collect())
    }

    /// State of a motor, with the position that its encoder measures.
    pub(crate) fn get(
        &self,
        tree: &Snapshot,
        id: &str,
        random: Random,
    ) -> Result<MotorState, Error> {
        let node = tree.node(id)?;
        let (Some(position), Some(encoder)) = (node.position(), encoder(node.kind())) else {
            return Err(Error::other_kind(id, node.kind(), "joint"));
        };
        let signal = Signal {
            noise: encoder.noise,
            quantum: encoder.quantum,
            ..Signal::default()
        };
        let mut errors = SensorNoise::new(&signal, random, 0.0);
        let state = self.0.get(&node.node_id()).copied();
        Ok(MotorState {
            position: errors.inexact(position),
            ..state.unwrap_or_default()
        })
    }

    /// Moves motors by a step, but for those whose joints forces move. Returns the new positions.
    pub(crate) fn step(
        &mut self,
        tree: &Snapshot,
        seconds: f64,
        is_forced: impl Fn(NodeId) -> bool,
    ) -> Vec<(NodeId, f64)> {
        let mut moves = Vec::new();
        for (node, motor) in &mut self.0 {
            if is_forced(*node) {
                continue;
            }
            let Ok(node) = tree.node(*node) else {
                continue;
            };
            if let Some(position) = motor.step(&node, seconds) {
                moves.push((node.node_id(), position));
            }
        }
        moves
    }

    /// Notes where forces have moved joints from the positions of `before`.
    pub(crate) fn forced(&mut self, before: &Snapshot, joints: &[(NodeId, f64)], seconds: f64) {
        for (joint, position) in joints {
            let was = before.node(*joint).ok().and_then(|joint| joint.position());
            if let (Some(motor), Some(was)) = (self.0.get_mut(joint), was) {
                motor.velocity = (position - was) / seconds;
                motor.position = *position;
            }
        }
    }
}

impl MotorState {
    /// The position after a step, if it is another one.
    fn step(&mut self, joint: &NodeRef<'_>, seconds: f64) -> Option<f64> {
        let (min, max, fastest) = limits(joint.kind())?;
        let position = joint.position()?;
        let next = match self.goal {
            MotorGoal::Hold | MotorGoal::Free => position,
            MotorGoal::Position { target, speed } => {
                let speed = if speed > 0.0 { speed } else { fastest };
                let way = speed * seconds;
                position + (target - position).clamp(-way, way)
            }
            MotorGoal::Velocity {
                velocity,
                acceleration,
            } => {
                let most = if acceleration > 0.0 {
                    acceleration * seconds
                } else {
                    f64::INFINITY
                };
                let now = self.velocity + (velocity - self.velocity).clamp(-most, most);
                (position + now * seconds).max(min).min(max)
            }
        };
        self.velocity = (next - position) / seconds;
        self.position = next;
        (next != position).then_some(next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel::InnerModel;

    #[test]
    fn goals_are_limited_and_all_or_none() {
        let scene = r#"<innerModel><joint id="hip" min="-1" max="1" maxspeed="2"/>
            <joint id="knee"/><transform id="foot"/></innerModel>"#;
        let tree = InnerModel::parse(scene).expect("a scene").snapshot();
        let mut motors = Motors::default();
        tree.nodes().for_each(|node| motors.notice(node));
        assert_eq!(motors.states().len(), 2);
        let far = MotorGoal::Position {
            target: 5.0,
            speed: 0.0,
        };
        let refused = motors.command(&tree, &[("hip", far), ("foot", far)]);
        refused.expect_err("a foot is not a joint");
        let hip = tree.node("hip").expect("a joint").node_id();
        assert_eq!(motors.states()[&hip].goal, MotorGoal::Hold);
        let clamped = motors.command(&tree, &[("hip", far), ("knee", MotorGoal::Hold)]);
        assert_eq!(clamped.expect("goals"), [true, false]);
        assert!(motors.step(&tree, 0.1, |_| true).is_empty());
        let moves = motors.step(&tree, 0.1, |_| false);
        assert_eq!(moves, [(hip, 0.2)], "the greatest speed");
        motors.forced(&tree, &[(hip, 0.5)], 0.1);
        assert_eq!(motors.states()[&hip].velocity, 5.0);
    }
}
