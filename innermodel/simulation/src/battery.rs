//! Batteries of robots.

use crate::error::Error;
use crate::pose2d::Speed;
use crate::state::BatteryState;
use crate::world::World;
use innermodel::{Kind, NodeId, NodeRef};
use std::collections::BTreeSet;

/// The robot that a node is below.
pub(crate) fn robot_of(node: NodeRef<'_>) -> Option<NodeId> {
    let mut above = std::iter::successors(Some(node), NodeRef::parent);
    let robot = above.find(|node| matches!(node.kind(), Kind::Robot(_)))?;
    Some(robot.node_id())
}

impl World {
    /// The state of a battery.
    pub fn battery(&self, id: &str) -> Result<BatteryState, Error> {
        let tree = self.tree();
        let node = tree.node(id)?;
        let Kind::Battery(_) = node.kind() else {
            return Err(Error::other_kind(id, node.kind(), "battery"));
        };
        let battery = self.state.batteries.get(&node.node_id());
        battery
            .copied()
            .ok_or_else(|| Error::unknown(id, "battery"))
    }

    /// The robots with an empty battery.
    pub(crate) fn without_power(&self) -> BTreeSet<NodeId> {
        let tree = self.tree();
        let empty = self.state.batteries.iter();
        let empty = empty.filter(|(_, battery)| battery.level <= 0.0);
        empty
            .filter_map(|(node, _)| robot_of(tree.node(*node).ok()?))
            .collect()
    }

    /// Lets the batteries of robots that move discharge, and those of others charge.
    pub(crate) fn charge(&mut self) {
        let tree = self.tree();
        let seconds = self.step.as_secs_f64();
        for (node, state) in &mut self.state.batteries {
            let Ok(node) = tree.node(*node) else {
                continue;
            };
            let Kind::Battery(battery) = node.kind() else {
                continue;
            };
            let base = robot_of(node).and_then(|robot| self.state.bases.get(&robot));
            state.is_connected = base.is_none_or(|base| base.wanted == Speed::default());
            let change = if state.is_connected {
                seconds / battery.charging
            } else {
                -seconds / battery.endurance
            };
            state.level = (state.level + change).clamp(0.0, 1.0);
        }
    }
}
