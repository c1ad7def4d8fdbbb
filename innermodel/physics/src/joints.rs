//! Joints between bodies, and their motors.

use crate::bodies::{METRE, pose};
use innermodel::kinds::Axis;
use innermodel::{Kind, NodeId, NodeRef, Transform};
use innermodel_collision::parry::math::{Pose, Vector};
use innermodel_simulation::{MotorGoal, MotorState};
use rapier3d_f64::prelude::{
    GenericJointBuilder, ImpulseJointHandle, JointAxesMask, JointAxis, MotorModel, PhysicsWorld,
    RigidBodyHandle,
};
use std::f64::consts::PI;

/// How stiffly a motor holds a position, in N·m/rad or N/m, and how much it is damped, in N·m·s/rad
/// or N·s/m. A motor is as strong as that of a large arm: 10 kg at 1 m bend it by a milliradian.
const STIFFNESS: f64 = 1.0e5;
const DAMPING: f64 = 2.0e3;
/// How strongly a motor pulls towards its speed, in N·m·s/rad or N·s/m.
const FACTOR: f64 = 1.0e4;

/// Stands for a limit that is missing, in m.
const FARTHEST: f64 = 1.0e6;

/// A joint between two bodies.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) node: NodeId,
    pub(crate) handle: ImpulseJointHandle,
    bodies: (RigidBodyHandle, RigidBodyHandle),
    /// The frame of the joint at its position 0 in both bodies.
    frames: (Pose, Pose),
    axis: Axis,
    is_prismatic: bool,
    /// Where it is held while its motor has no goal, in rad or m.
    held: f64,
}

/// The joint that connects a body to what is above it: the node right above the body.
pub(crate) fn above<'s>(body: &NodeRef<'s>) -> Option<NodeRef<'s>> {
    let parent = body.parent()?;
    matches!(parent.kind(), Kind::Joint(_) | Kind::Prismatic(_)).then_some(parent)
}

impl Joint {
    /// Connects a body to the one that carries its joint, which is at `base` in the root.
    pub(crate) fn add(
        world: &mut PhysicsWorld,
        joint: &NodeRef<'_>,
        body: &NodeRef<'_>,
        own: RigidBodyHandle,
        (other, base): (RigidBodyHandle, Transform),
    ) -> Option<Self> {
        let position = joint.position()?;
        let (axis, is_prismatic, min, max) = match joint.kind() {
            Kind::Joint(joint) => (joint.axis, false, joint.min, joint.max),
            Kind::Prismatic(joint) => (joint.axis, true, joint.min / METRE, joint.max / METRE),
            _ => return None,
        };
        // The frame of the joint at its position 0.
        let there = if is_prismatic {
            let mut back = innermodel::Vector::zeros();
            back[axis.index()] = -position;
            joint.to_root() * Transform::translation(back)
        } else {
            joint.to_root() * Transform::about(axis, -position)
        };
        let frames = (
            pose(&(base.inverse() * there)),
            pose(&(body.to_root().inverse() * joint.to_root())),
        );
        let free = free_axis(axis, is_prismatic);
        let mut locked = JointAxesMask::all();
        locked.remove(free.into());
        let mut built = GenericJointBuilder::new(locked)
            .local_frame1(frames.0)
            .local_frame2(frames.1)
            .contacts_enabled(false)
            // Else the lever of a body that hangs on the joint would not count.
            .motor_model(free, MotorModel::ForceBased);
        if min.is_finite() || max.is_finite() {
            // The solver takes no infinite number, and angles within half a turn.
            let farthest = if is_prismatic { FARTHEST } else { PI };
            built = built.limits(free, [min.max(-farthest), max.min(farthest)]);
        }
        let handle = world.insert_impulse_joint(other, own, built);
        Some(Self {
            node: joint.node_id(),
            handle,
            bodies: (other, own),
            frames,
            axis,
            is_prismatic,
            held: if is_prismatic {
                position / METRE
            } else {
                position
            },
        })
    }

    /// Tells the motor where to go.
    pub(crate) fn drive(&mut self, world: &mut PhysicsWorld, motor: Option<&MotorState>) {
        let scale = if self.is_prismatic { METRE } else { 1.0 };
        let goal = motor.map_or(MotorGoal::Hold, |motor| motor.goal);
        let axis = free_axis(self.axis, self.is_prismatic);
        let Some(joint) = world.impulse_joints.get_mut(self.handle, true) else {
            return;
        };
        match goal {
            MotorGoal::Hold => {
                joint
                    .data
                    .set_motor_position(axis, self.held, STIFFNESS, DAMPING);
            }
            MotorGoal::Position { target, .. } => {
                self.held = target / scale;
                joint
                    .data
                    .set_motor_position(axis, self.held, STIFFNESS, DAMPING);
            }
            MotorGoal::Velocity { velocity, .. } => {
                joint
                    .data
                    .set_motor_velocity(axis, velocity / scale, FACTOR);
            }
        }
    }

    /// The position between both bodies, in rad or mm. Contacts and errors of the solver move it.
    pub(crate) fn position(&self, world: &PhysicsWorld) -> Option<f64> {
        let one = world.bodies.get(self.bodies.0)?.position();
        let other = world.bodies.get(self.bodies.1)?.position();
        let between = (*one * self.frames.0).inverse() * (*other * self.frames.1);
        let at = self.axis.index();
        if self.is_prismatic {
            return Some(between.translation[at] * METRE);
        }
        let q = between.rotation;
        let part = Vector::new(q.x, q.y, q.z)[at];
        let angle = 2.0 * part.atan2(q.w);
        // Between −π and π.
        Some(angle - (angle / std::f64::consts::TAU).round() * std::f64::consts::TAU)
    }
}

fn free_axis(axis: Axis, is_prismatic: bool) -> JointAxis {
    match (axis, is_prismatic) {
        (Axis::X, true) => JointAxis::LinX,
        (Axis::Y, true) => JointAxis::LinY,
        (Axis::Z, true) => JointAxis::LinZ,
        (Axis::X, false) => JointAxis::AngX,
        (Axis::Y, false) => JointAxis::AngY,
        (Axis::Z, false) => JointAxis::AngZ,
    }
}
