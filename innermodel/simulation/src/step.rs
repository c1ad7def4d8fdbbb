//! One step of the world.

use crate::error::Error;
use crate::world::World;
use innermodel::{Kind, NodeId};

impl World {
    /// The most steps of one call of [`World::run`].
    pub const MOST_STEPS: u64 = 10_000_000;

    /// Makes steps.
    ///
    /// # Errors
    /// More than [`World::MOST_STEPS`] are asked for.
    pub fn run(&mut self, steps: u64) -> Result<(), Error> {
        if steps > Self::MOST_STEPS {
            return Err(Error::TooManySteps(steps));
        }
        for _ in 0..steps {
            self.step()?;
        }
        Ok(())
    }

    /// Lets the time of one step pass: bases, joints and batteries change, then sensors measure.
    pub fn step(&mut self) -> Result<(), Error> {
        self.state.steps += 1;
        self.state.time += self.step;
        self.follow();
        if let Some(dynamics) = &mut self.dynamics {
            dynamics.place(&self.space);
        }
        self.move_bases()?;
        self.move_joints();
        self.walk();
        self.apply_forces();
        self.charge();
        self.follow();
        self.sense();
        Ok(())
    }

    fn sense(&mut self) {
        let tree = self.tree();
        let (seed, time, step) = (self.seed, self.state.time, self.step);
        for (node, sensor) in &mut self.sensors {
            let Ok(node) = tree.node(*node) else {
                continue;
            };
            let Some(signal) = node.kind().signal() else {
                continue;
            };
            if matches!(node.kind(), Kind::Imu(_)) {
                sensor.move_to(&node.to_root(), step);
            }
            sensor.step(signal, (seed, node.id()), time, step, &tree);
        }
    }

    /// Whether a body below one node touches one below another node.
    pub fn collide(&mut self, a: &str, b: &str) -> Result<bool, Error> {
        self.follow();
        Ok(self.space.collide(a, b)?)
    }

    /// The id of a node that is there.
    pub fn id_of(&self, node: NodeId) -> Option<String> {
        Some(self.tree().node(node).ok()?.id().to_owned())
    }
}
