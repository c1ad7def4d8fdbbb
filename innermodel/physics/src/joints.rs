//! Joints between bodies, and their motors.

use crate::bodies::{METRE, near, pose};
use crate::motors::{Limits, Motor, Pull};
use innermodel::kinds::Axis;
use innermodel::{Kind, NodeId, NodeRef, Snapshot, Transform};
use innermodel_collision::parry::math::{Pose, Vector};
use rapier3d_f64::prelude::{
    GenericJointBuilder, ImpulseJointHandle, JointAxesMask, JointAxis, MotorModel, PhysicsWorld,
    RigidBodyHandle,
};
use std::f64::consts::TAU;

/// How stiffly a motor holds a position, in N·m/rad or N/m, and how much it is damped, in N·m·s/rad
/// or N·s/m. A motor is as strong as that of a large arm: 10 kg at 1 m bend it by a milliradian.
const STIFFNESS: f64 = 1.0e5;
const DAMPING: f64 = 2.0e3;
/// How strongly a motor pulls towards its speed, in N·m·s/rad or N·s/m.
const FACTOR: f64 = 1.0e4;

/// Represents a missing limit, in m.
const FARTHEST: f64 = 1.0e6;

/// A joint between two bodies.
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub(crate) node: NodeId,
    /// The node of the body that it moves, and the one that carries it.
    pub(crate) own: NodeId,
    pub(crate) other: NodeId,
    handle: ImpulseJointHandle,
    bodies: (RigidBodyHandle, RigidBodyHandle),
    /// The frame of the joint at its position 0 in both bodies.
    frames: (Pose, Pose),
    axis: Axis,
    is_prismatic: bool,
    limits: Limits,
}

/// The joint that connects a body to its carrier: the node right above the body.
pub(crate) fn above<'s>(body: &NodeRef<'s>) -> Option<NodeRef<'s>> {
    let parent = body.parent()?;
    matches!(parent.kind(), Kind::Joint(_) | Kind::Prismatic(_)).then_some(parent)
}

/// The frame of a joint at its position 0, in what carries it and in the body that it moves.
fn frames(joint: &NodeRef<'_>, body: &NodeRef<'_>, carrier: &NodeRef<'_>) -> Option<(Pose, Pose)> {
    let position = joint.position()?;
    let back = match joint.kind() {
        Kind::Prismatic(joint) => {
            let mut back = innermodel::Vector::zeros();
            back[joint.axis.index()] = -position;
            Transform::translation(back)
        }
        Kind::Joint(joint) => Transform::about(joint.axis, -position),
        _ => return None,
    };
    let there = joint.to_root();
    Some((
        pose(&(carrier.to_root().inverse() * there * back)),
        pose(&(body.to_root().inverse() * there)),
    ))
}

impl Joint {
    /// Connects a body to the one that carries its joint.
    pub(crate) fn add(
        world: &mut PhysicsWorld,
        joint: &NodeRef<'_>,
        (body, own): (&NodeRef<'_>, RigidBodyHandle),
        (carrier, other): (&NodeRef<'_>, RigidBodyHandle),
    ) -> Option<Self> {
        let (axis, is_prismatic, scale) = match joint.kind() {
            Kind::Joint(joint) => (joint.axis, false, 1.0),
            Kind::Prismatic(joint) => (joint.axis, true, METRE),
            _ => return None,
        };
        let (min, max, fastest) = match joint.kind() {
            Kind::Joint(joint) => (joint.min, joint.max, joint.max_speed),
            Kind::Prismatic(joint) => (joint.min, joint.max, joint.max_speed),
            _ => return None,
        };
        let frames = frames(joint, body, carrier)?;
        let free = free_axis(axis, is_prismatic);
        let mut locked = JointAxesMask::all();
        locked.remove(free.into());
        let built = GenericJointBuilder::new(locked)
            .local_frame1(frames.0)
            .local_frame2(frames.1)
            .contacts_enabled(false)
            // Else the lever of a body that hangs on the joint would not count.
            .motor_model(free, MotorModel::ForceBased);
        let handle = world.insert_impulse_joint(other, own, built);
        Some(Self {
            node: joint.node_id(),
            own: body.node_id(),
            other: carrier.node_id(),
            handle,
            bodies: (other, own),
            frames,
            axis,
            is_prismatic,
            limits: Limits {
                min: min / scale,
                max: max / scale,
                fastest: if fastest > 0.0 {
                    fastest / scale
                } else {
                    f64::INFINITY
                },
            },
        })
    }

    /// The unit of positions in the tree, in m or rad.
    pub(crate) fn scale(&self) -> f64 {
        if self.is_prismatic { METRE } else { 1.0 }
    }

    /// Takes over changed places of the joint in its carrier, and of the body in the joint.
    pub(crate) fn place(&mut self, world: &mut PhysicsWorld, tree: &Snapshot) {
        let nodes = (
            tree.node(self.node),
            tree.node(self.own),
            tree.node(self.other),
        );
        let (Ok(joint), Ok(own), Ok(other)) = nodes else {
            return;
        };
        let Some(there) = frames(&joint, &own, &other) else {
            return;
        };
        if near(&there.0, &self.frames.0) && near(&there.1, &self.frames.1) {
            return;
        }
        self.frames = there;
        if let Some(joint) = world.impulse_joints.get_mut(self.handle, true) {
            joint.data.set_local_frame1(there.0);
            joint.data.set_local_frame2(there.1);
        }
    }

    /// Lets the motor pull for a step of the solver.
    pub(crate) fn drive(&self, world: &mut PhysicsWorld, motor: &mut Motor, seconds: f64) {
        let axis = free_axis(self.axis, self.is_prismatic);
        let pull = motor.pull(&self.limits, seconds);
        let Some(joint) = world.impulse_joints.get_mut(self.handle, true) else {
            return;
        };
        // The solver measures an angle best near 0, and between half a turn to each side: the frame
        // turns with the motor.
        let zero = match pull {
            _ if self.is_prismatic => 0.0,
            Pull::To(place, _) => place,
            Pull::At(_) | Pull::Off => motor.position,
        };
        if !self.is_prismatic {
            let turned = pose(&Transform::about(self.axis, zero));
            joint.data.set_local_frame1(self.frames.0 * turned);
        }
        match pull {
            Pull::To(place, speed) => {
                joint
                    .data
                    .set_motor(axis, place - zero, speed, STIFFNESS, DAMPING);
            }
            Pull::At(speed) => {
                joint.data.set_motor_velocity(axis, speed, FACTOR);
            }
            Pull::Off => joint.data.motor_axes.remove(axis.into()),
        }
        // The solver accepts no infinite number, and no range of a whole turn: then the motor
        // stops.
        let (min, max) = (self.limits.min - zero, self.limits.max - zero);
        if self.is_prismatic && (min.is_finite() || max.is_finite()) {
            let limits = [min.max(-FARTHEST), max.min(FARTHEST)];
            joint.data.set_limits(axis, limits);
        } else if max - min < TAU {
            joint.data.set_limits(axis, [min, max]);
        }
    }

    /// The position between both bodies, in rad or m, that is nearest to the one before. Contacts
    /// and errors of the solver move it.
    pub(crate) fn position(&self, world: &PhysicsWorld, before: f64) -> Option<f64> {
        let one = world.bodies.get(self.bodies.0)?.position();
        let other = world.bodies.get(self.bodies.1)?.position();
        let between = (*one * self.frames.0).inverse() * (*other * self.frames.1);
        let at = self.axis.index();
        if self.is_prismatic {
            return Some(between.translation[at]);
        }
        let q = between.rotation;
        let part = Vector::new(q.x, q.y, q.z)[at];
        let angle = 2.0 * part.atan2(q.w);
        Some(angle + ((before - angle) / TAU).round() * TAU)
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
