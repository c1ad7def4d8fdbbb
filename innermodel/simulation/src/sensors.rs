//! The sensors of a world.

use crate::error::Error;
use crate::imu_integrator::ImuIntegrator;
use crate::problems::Problems;
use crate::schedule::{Frame, Measured, Sensor};
use innermodel::{Kind, NodeId, Snapshot, Vector};
use std::collections::BTreeMap;
use std::hash::{Hash, Hasher};
use std::sync::Arc;
use std::time::Duration;

/// The sensors of a world: their frames, and their measurements.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sensors(BTreeMap<NodeId, Sensor>);

impl Sensors {
    /// Adds new sensors, and drops removed ones. At the start of the world, everything stands
    /// still.
    pub(crate) fn find(
        &mut self,
        tree: &Arc<Snapshot>,
        (time, step): (Duration, Duration),
        is_start: bool,
        problems: &mut Problems,
    ) {
        for node in tree.nodes() {
            let Some(signal) = node.kind().signal() else {
                continue;
            };
            let speed = is_start.then(Vector::zeros);
            let track = || ImuIntegrator::new(node.to_root(), speed);
            let track = matches!(node.kind(), Kind::Imu(_)).then(track);
            let sensor = self.0.entry(node.node_id());
            let sensor =
                sensor.or_insert_with(|| Sensor::new(signal, time, Arc::clone(tree), track));
            for text in sensor.check(signal, step) {
                problems.add(format!("`{}`: {text}", node.id()));
            }
        }
        let is_one = |kind: &Kind| kind.signal().is_some();
        let there = |node| tree.node(node).is_ok_and(|node| is_one(node.kind()));
        self.0.retain(|node, _| there(*node));
    }

    /// Drops all of them: a world without sensors costs less.
    pub(crate) fn clear(&mut self) {
        self.0.clear();
    }

    /// Lets sensors measure after a step that ends at `time`.
    pub(crate) fn step(
        &mut self,
        tree: &Arc<Snapshot>,
        (time, step): (Duration, Duration),
        seed: u64,
    ) {
        for (node, sensor) in &mut self.0 {
            let Ok(node) = tree.node(*node) else {
                continue;
            };
            let Some(signal) = node.kind().signal() else {
                continue;
            };
            if matches!(node.kind(), Kind::Imu(_)) {
                sensor.move_to(&node.to_root(), step);
            }
            sensor.step(signal, (seed, node.id()), time, step, tree);
        }
    }

    /// Notes for inertial sensors that a change has moved them: a jump is not an acceleration.
    pub(crate) fn jump(&mut self, before: &Snapshot, after: &Snapshot) {
        for (node, sensor) in &mut self.0 {
            let there = after.node(*node).map(|node| node.to_root());
            let was = before.node(*node).map(|node| node.to_root());
            if let (Ok(there), Ok(was)) = (there, was)
                && there != was
            {
                sensor.jump_to(&there);
            }
        }
    }

    /// The frame of a sensor that can be read, and its values, if they are known.
    pub(crate) fn frame(
        &self,
        tree: &Snapshot,
        id: &str,
    ) -> Result<(NodeId, Frame, Option<Measured>), Error> {
        let node = tree.node(id)?;
        let Some(sensor) = self.0.get(&node.node_id()) else {
            return Err(Error::other_kind(id, node.kind(), "sensor"));
        };
        let frame = sensor.shown().clone();
        Ok((node.node_id(), frame, sensor.measured.clone()))
    }

    /// Keeps the values of the frame that can be read.
    pub(crate) fn keep(&mut self, node: NodeId, measured: Measured) {
        if let Some(sensor) = self.0.get_mut(&node) {
            sensor.measured = Some(measured);
        }
    }

    /// Hashes the state that decides about later values.
    pub(crate) fn hash_state(&self, hasher: &mut impl Hasher) {
        for (node, sensor) in &self.0 {
            (node, sensor.digest()).hash(hasher);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel::InnerModel;

    #[test]
    fn a_frame_has_values_until_the_next_one() {
        let scene = r#"<innerModel><touchsensor id="bumper" rate="10"/><transform id="other"/>
            </innerModel>"#;
        let tree = InnerModel::parse(scene).expect("a scene").snapshot();
        let (mut sensors, mut problems) = (Sensors::default(), Problems::default());
        let step = Duration::from_millis(50);
        sensors.find(&tree, (Duration::ZERO, step), true, &mut problems);
        sensors.frame(&tree, "other").expect_err("no sensor");
        let (node, frame, values) = sensors.frame(&tree, "bumper").expect("a sensor");
        assert!(frame.number == 0 && values.is_none());
        sensors.keep(
            node,
            Measured::Touch(crate::Touch {
                number: 0,
                time: Duration::ZERO,
                node: None,
            }),
        );
        sensors.step(&tree, (step, step), 1);
        let (_, frame, values) = sensors.frame(&tree, "bumper").expect("a sensor");
        assert!(frame.number == 0 && values.is_some());
        sensors.step(&tree, (2 * step, step), 1);
        let (_, frame, values) = sensors.frame(&tree, "bumper").expect("a sensor");
        assert!(frame.number == 1 && values.is_none());
        let without = InnerModel::parse("<innerModel/>")
            .expect("a scene")
            .snapshot();
        sensors.find(&without, (2 * step, step), false, &mut problems);
        assert!(sensors.0.is_empty() && problems.take().is_empty());
    }
}
