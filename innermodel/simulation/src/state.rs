//! State that changes with time, besides the tree.

use crate::bases::Bases;
use crate::batteries::Batteries;
use crate::motors::Motors;
use crate::people::People;
use crate::pose2d::{Pose2D, Speed};
use innermodel::{NodeId, Snapshot};
use std::time::Duration;

/// State that changes with time, besides the tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    pub(crate) time: Duration,
    pub(crate) steps: u64,
    pub(crate) bases: Bases,
    pub(crate) motors: Motors,
    pub(crate) batteries: Batteries,
    pub(crate) people: People,
}

impl State {
    /// Makes the state of new devices, and drops that of removed ones.
    pub(crate) fn find_devices(&mut self, tree: &Snapshot) {
        for node in tree.nodes() {
            self.bases.notice(node);
            self.motors.notice(node);
            self.batteries.notice(node);
            self.people.notice(node);
        }
        self.bases.drop_removed(tree);
        self.motors.drop_removed(tree);
        self.batteries.drop_removed(tree);
        self.people.drop_removed(tree);
    }
}

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

/// A battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryState {
    /// From 0 to 1.
    pub level: f64,
    /// Whether its robot stands still, which connects it to the charger.
    pub is_connected: bool,
}
