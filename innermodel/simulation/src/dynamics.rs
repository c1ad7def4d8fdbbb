//! Bodies that forces move, by a library that is linked only where it is wanted.

use crate::error::Error;
use crate::motor::MotorState;
use crate::world::World;
use innermodel::{NodeId, Transform, Vector};
use innermodel_collision::Space;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::time::Duration;

/// What forces have changed in a step.
#[derive(Clone, Debug, Default)]
pub struct Moved {
    /// Places in the root.
    pub places: Vec<(NodeId, Transform)>,
    /// Positions of joints, in rad or mm.
    pub joints: Vec<(NodeId, f64)>,
}

/// Moves bodies by forces.
pub trait Dynamics: Debug + Send {
    /// Lets the time of one step pass. What others have moved in the tree since the last step is
    /// moved here first. Motors say where joints shall go.
    fn step(
        &mut self,
        space: &Space,
        motors: &BTreeMap<NodeId, MotorState>,
        step: Duration,
    ) -> Moved;

    /// Whether the motion of a joint follows from forces.
    fn moves_joint(&self, joint: NodeId) -> bool;

    /// Pushes a body at its centre of mass: an impulse in N·s, in the root. Whether there is such a
    /// body.
    fn push(&mut self, node: NodeId, impulse: Vector) -> bool;

    /// The same for a world that is cloned. Speeds are kept; contacts begin anew.
    fn duplicate(&self) -> Box<dyn Dynamics>;
}

impl World {
    /// Switches forces on, or off with `None`. Without them, only commands and people move things.
    pub fn set_dynamics(&mut self, dynamics: Option<Box<dyn Dynamics>>) {
        self.dynamics = dynamics;
    }

    /// Whether forces move bodies.
    pub fn has_dynamics(&self) -> bool {
        self.dynamics.is_some()
    }

    /// Pushes a body that forces move: an impulse in N·s, in the root.
    ///
    /// # Errors
    /// The impulse is not finite, or forces do not move the node.
    pub fn push(&mut self, id: &str, impulse: Vector) -> Result<(), Error> {
        if impulse.iter().any(|n| !n.is_finite()) {
            return Err(Error::not_finite("an impulse", id));
        }
        let node = self.tree().node(id)?.node_id();
        let pushed = self
            .dynamics
            .as_mut()
            .is_some_and(|d| d.push(node, impulse));
        if pushed {
            return Ok(());
        }
        Err(Error::unknown(id, "body that forces move"))
    }

    /// Lets forces move bodies for one step.
    pub(crate) fn apply_forces(&mut self) -> Result<(), Error> {
        let Some(mut dynamics) = self.dynamics.take() else {
            return Ok(());
        };
        self.follow();
        let moved = dynamics.step(&self.space, &self.state.motors, self.step);
        self.dynamics = Some(dynamics);
        if moved.places.is_empty() && moved.joints.is_empty() {
            return Ok(());
        }
        let seconds = self.step.as_secs_f64();
        let tree = self.tree();
        for (joint, position) in &moved.joints {
            let before = tree.node(*joint).ok().and_then(|joint| joint.position());
            if let (Some(motor), Some(before)) = (self.state.motors.get_mut(joint), before) {
                motor.velocity = (position - before) / seconds;
                motor.position = *position;
            }
        }
        self.change(|edit| {
            for (node, place) in &moved.places {
                edit.set_pose_in(*node, NodeId::ROOT, place.pose())?;
            }
            for (joint, position) in &moved.joints {
                edit.set_joint(*joint, *position)?;
            }
            Ok(())
        })
    }
}
