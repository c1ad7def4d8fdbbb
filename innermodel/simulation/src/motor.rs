//! Motors of joints.

use crate::error::Error;
use crate::pose2d::FASTEST;
use crate::sensor_noise::SensorNoise;
use crate::state::{MotorGoal, MotorState};
use crate::world::World;
use innermodel::kinds::{Encoder, Signal};
use innermodel::{Kind, NodeId, NodeRef};

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

impl World {
    /// Sets the goals of motors: all of them, or none if one is refused. Returns for each one
    /// whether a value beyond its limits was replaced by the limit.
    ///
    /// # Errors
    /// There is no such joint, or a number is not finite.
    pub fn command(&mut self, goals: &[(&str, MotorGoal)]) -> Result<Vec<bool>, Error> {
        let tree = self.tree();
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
            if let Some(motor) = self.state.motors.get_mut(node) {
                motor.goal = *goal;
            }
        }
        Ok(checked.into_iter().map(|(.., clamped)| clamped).collect())
    }

    /// State of the motor of a joint. The position is that of the encoder, the same as long as no
    /// step is made. The tree has the exact one.
    pub fn motor(&self, id: &str) -> Result<MotorState, Error> {
        let tree = self.tree();
        let node = tree.node(id)?;
        let (Some(position), Some(encoder)) = (node.position(), encoder(node.kind())) else {
            return Err(Error::other_kind(id, node.kind(), "joint"));
        };
        let signal = Signal {
            noise: encoder.noise,
            quantum: encoder.quantum,
            ..Signal::default()
        };
        let mut errors = SensorNoise::new(&signal, self.random(id, self.state.steps), 0.0);
        let state = self.state.motors.get(&node.node_id()).copied();
        Ok(MotorState {
            position: errors.inexact(position),
            ..state.unwrap_or_default()
        })
    }

    /// Moves all joints by one step.
    pub(crate) fn move_joints(&mut self) {
        let tree = self.tree();
        let seconds = self.step.as_secs_f64();
        let mut moves: Vec<(NodeId, f64)> = Vec::new();
        for (node, motor) in &mut self.state.motors {
            if self.dynamics.as_ref().is_some_and(|d| d.moves_joint(*node)) {
                continue;
            }
            let Ok(node) = tree.node(*node) else {
                continue;
            };
            if let Some(position) = motor.step(&node, seconds) {
                moves.push((node.node_id(), position));
            }
        }
        if moves.is_empty() {
            return;
        }
        self.change_each(&moves, |edit, (node, position)| {
            edit.set_joint(*node, *position).map(drop)
        });
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
