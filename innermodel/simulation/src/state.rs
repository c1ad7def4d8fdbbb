//! State that changes with time, besides the tree.

use crate::human::Walk;
use crate::pose2d::{Pose2D, Speed};
use innermodel::NodeId;
use std::collections::BTreeMap;
use std::time::Duration;

/// State that changes with time, besides the tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    pub(crate) time: Duration,
    pub(crate) steps: u64,
    pub(crate) bases: BTreeMap<NodeId, BaseState>,
    pub(crate) motors: BTreeMap<NodeId, MotorState>,
    pub(crate) batteries: BTreeMap<NodeId, BatteryState>,
    pub(crate) people: BTreeMap<NodeId, Walk>,
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
    /// Whether its robot stands, which connects it to the charger.
    pub is_connected: bool,
}
