//! Frames, noise and bodies that all sensors share.

use crate::error::Error;
use crate::random::Random;
use crate::schedule::{Frame, Measured};
use crate::world::World;
use innermodel::{NodeId, Snapshot};
use innermodel_collision::Space;
use std::sync::Arc;

impl World {
    /// The frame of a sensor that can be read, and its values, if they are known.
    pub(crate) fn frame(&self, id: &str) -> Result<(NodeId, Frame, Option<Measured>), Error> {
        let tree = self.tree();
        let node = tree.node(id)?;
        let Some(sensor) = self.sensors.get(&node.node_id()) else {
            return Err(Error::other_kind(id, node.kind(), "sensor"));
        };
        let frame = sensor.shown().clone();
        Ok((node.node_id(), frame, sensor.measured.clone()))
    }

    /// Keeps the values of the frame that can be read.
    pub(crate) fn keep(&mut self, node: NodeId, measured: Measured) {
        if let Some(sensor) = self.sensors.get_mut(&node) {
            sensor.measured = Some(measured);
        }
    }

    /// The numbers by chance of a frame.
    pub(crate) fn random(&self, id: &str, frame: u64) -> Random {
        Random::new(self.seed, id, frame)
    }

    /// The bodies where they were in another version.
    pub(crate) fn space_at(&mut self, tree: &Snapshot) -> &Space {
        Arc::make_mut(&mut self.space).update(tree);
        self.is_space_present = false;
        self.report_bodies();
        &self.space
    }
}
