//! Bodies that forces move, by a library that is linked only where it is wanted.

use crate::base::FASTEST;
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

/// Why a body was not pushed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NotPushed {
    /// Forces do not move the node.
    Unmoved,
    /// The body would be faster than the bound, in m/s.
    TooFast,
}

/// Moves bodies by forces. For each step, a world calls [`Dynamics::place`], moves bases and
/// people, and calls [`Dynamics::step`] and [`Dynamics::applied`].
pub trait Dynamics: Debug + Send {
    /// Takes over what was set in the tree since the last step: bodies and obstacles that are
    /// elsewhere are put there at once, whatever is in between. Bodies lose their speed by it.
    fn place(&mut self, space: &Space);

    /// Lets the time of one step pass. Obstacles go during the step to where the tree has them now,
    /// and push what is in their way. Motors say where joints shall go.
    fn step(
        &mut self,
        space: &Space,
        motors: &BTreeMap<NodeId, MotorState>,
        step: Duration,
    ) -> Moved;

    /// The tree has what the last step has returned.
    fn applied(&mut self, space: &Space);

    /// Whether the motion of a joint follows from forces.
    fn moves_joint(&self, joint: NodeId) -> bool;

    /// Pushes a body at its centre of mass: an impulse in N·s, in the root.
    ///
    /// # Errors
    /// There is no such body, or it would be faster than `fastest`, in m/s. It then keeps its
    /// speed.
    fn push(
        &mut self,
        space: &Space,
        node: NodeId,
        impulse: Vector,
        fastest: f64,
    ) -> Result<(), NotPushed>;

    /// A number that differs, but for chance, where speeds differ.
    fn digest(&self) -> u64;

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
    /// The impulse is not finite or would make the body faster than 1 km/s, or forces do not move
    /// the node.
    pub fn push(&mut self, id: &str, impulse: Vector) -> Result<(), Error> {
        if impulse.iter().any(|n| !n.is_finite()) {
            return Err(Error::not_finite("an impulse", id));
        }
        let node = self.tree().node(id)?.node_id();
        self.follow();
        let pushed = match &mut self.dynamics {
            Some(dynamics) => dynamics.push(&self.space, node, impulse, FASTEST / 1000.0),
            None => Err(NotPushed::Unmoved),
        };
        pushed.map_err(|reason| match reason {
            NotPushed::Unmoved => Error::unknown(id, "body that forces move"),
            NotPushed::TooFast => Error::TooFast(id.to_owned()),
        })
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
        })?;
        self.follow();
        if let Some(dynamics) = &mut self.dynamics {
            dynamics.applied(&self.space);
        }
        Ok(())
    }
}
