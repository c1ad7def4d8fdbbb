//! Commands to the devices of a world.

use crate::devices;
use crate::dynamics::{Dynamics, PushError};
use crate::error::Error;
use crate::motors::MotorGoal;
use crate::pose2d::{FASTEST, Pose2D, Speed};
use crate::world::World;
use innermodel::kinds::Signal;
use innermodel::{Pose, Vector};

impl World {
    /// Commands a speed, which holds until the next command. Returns the speed that the base takes:
    /// one within its limits, and without `side` for a differential base.
    ///
    /// # Errors
    /// There is no such base, or a number is not finite: then the old speed holds.
    pub fn drive(&mut self, id: &str, speed: Speed) -> Result<Speed, Error> {
        let tree = self.tree();
        self.state.bases.drive(&tree, id, speed)
    }

    /// Sets the place by the wheels, the corrected one, or both.
    pub fn set_odometer(
        &mut self,
        id: &str,
        odometer: Option<Pose2D>,
        corrected: Option<Pose2D>,
    ) -> Result<(), Error> {
        let tree = self.tree();
        let bases = &mut self.state.bases;
        bases.set_odometer(&tree, id, odometer, corrected)
    }

    /// Sets the goals of motors: all of them, or none if one is refused. Returns for each one
    /// whether a value beyond its limits was replaced by the limit.
    ///
    /// # Errors
    /// There is no such joint, or a number is not finite.
    pub fn command(&mut self, goals: &[(&str, MotorGoal)]) -> Result<Vec<bool>, Error> {
        let tree = self.tree();
        self.state.motors.command(&tree, goals)
    }

    /// How a sensor measures from its next frame on.
    ///
    /// # Errors
    /// There is no such sensor, or a number is not finite, is negative, or is a probability above
    /// 1.
    pub fn set_signal(&mut self, id: &str, signal: Signal) -> Result<(), Error> {
        devices::check_signal(id, &signal)?;
        self.signal(id)?;
        let mut kind = self.tree().node(id)?.kind().clone();
        if let Some(known) = kind.signal_mut() {
            *known = signal;
        }
        self.edit(|edit| edit.set_kind(id, kind))
    }

    /// Puts a node to a place at once, whatever is in between. Odometry does not notice.
    pub fn teleport(&mut self, id: &str, base: &str, pose: Pose) -> Result<(), Error> {
        self.edit(|edit| edit.set_pose_in(id, base, pose))
    }

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
            Some(dynamics) => dynamics.push(self.bodies.space(), node, impulse, FASTEST / 1000.0),
            None => Err(PushError::Unmoved),
        };
        pushed.map_err(|reason| match reason {
            PushError::Unmoved => Error::unknown(id, "body that forces move"),
            PushError::TooFast => Error::TooFast(id.to_owned()),
        })
    }
}
