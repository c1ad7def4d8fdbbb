//! Forces in a world.

use crate::dynamics::{Dynamics, NotPushed};
use crate::error::Error;
use crate::pose2d::FASTEST;
use crate::world::World;
use innermodel::{NodeId, Vector};

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
    pub(crate) fn apply_forces(&mut self) {
        let Some(mut dynamics) = self.dynamics.take() else {
            return;
        };
        self.follow();
        let moved = dynamics.step(&self.space, &self.state.motors, self.step);
        self.dynamics = Some(dynamics);
        if moved.places.is_empty() && moved.joints.is_empty() {
            return;
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
        self.change_each(&moved.places, |edit, (node, place)| {
            edit.set_pose_in(*node, NodeId::ROOT, place.pose())
        });
        self.change_each(&moved.joints, |edit, (joint, position)| {
            edit.set_joint(*joint, *position).map(drop)
        });
        self.follow();
        if let Some(dynamics) = &mut self.dynamics {
            dynamics.applied(&self.space);
        }
    }
}
