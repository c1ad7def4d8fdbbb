//! Batteries of robots.

use crate::bases::Bases;
use crate::error::Error;
use crate::pose2d::Speed;
use innermodel::{Kind, NodeId, NodeRef, Snapshot};
use std::collections::{BTreeMap, BTreeSet};

/// A battery.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryState {
    /// From 0 to 1.
    pub level: f64,
    /// Whether its robot stands still, which connects it to the charger.
    pub is_connected: bool,
}

/// The robot that a node is below.
pub(crate) fn robot_of(node: NodeRef<'_>) -> Option<NodeId> {
    let mut above = std::iter::successors(Some(node), NodeRef::parent);
    let robot = above.find(|node| matches!(node.kind(), Kind::Robot(_)))?;
    Some(robot.node_id())
}

/// The batteries of a world.
#[derive(Clone, Debug, Default)]
pub(crate) struct Batteries(BTreeMap<NodeId, BatteryState>);

impl Batteries {
    /// Adds the battery of a node, if it is one, and is new.
    pub(crate) fn notice(&mut self, node: NodeRef<'_>) {
        if let Kind::Battery(battery) = node.kind() {
            let full = BatteryState {
                level: battery.level,
                is_connected: true,
            };
            self.0.entry(node.node_id()).or_insert(full);
        }
    }

    /// Drops those that the tree does not have any more.
    pub(crate) fn drop_removed(&mut self, tree: &Snapshot) {
        let is_one = |kind: &Kind| matches!(kind, Kind::Battery(_));
        let there = |node| tree.node(node).is_ok_and(|node| is_one(node.kind()));
        self.0.retain(|node, _| there(*node));
    }

    pub(crate) fn get(&self, tree: &Snapshot, id: &str) -> Result<BatteryState, Error> {
        let node = tree.node(id)?;
        let Kind::Battery(_) = node.kind() else {
            return Err(Error::other_kind(id, node.kind(), "battery"));
        };
        let battery = self.0.get(&node.node_id());
        battery
            .copied()
            .ok_or_else(|| Error::unknown(id, "battery"))
    }

    /// The robots with an empty battery.
    pub(crate) fn robots_without_power(&self, tree: &Snapshot) -> BTreeSet<NodeId> {
        let empty = self.0.iter().filter(|(_, battery)| battery.level <= 0.0);
        empty
            .filter_map(|(node, _)| robot_of(tree.node(*node).ok()?))
            .collect()
    }

    /// Lets the batteries of robots that move discharge, and those of others charge.
    pub(crate) fn step(&mut self, tree: &Snapshot, bases: &Bases, seconds: f64) {
        for (node, state) in &mut self.0 {
            let Ok(node) = tree.node(*node) else {
                continue;
            };
            let Kind::Battery(battery) = node.kind() else {
                continue;
            };
            let base = robot_of(node).and_then(|robot| bases.state(robot));
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

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel::InnerModel;

    #[test]
    fn a_battery_discharges_while_its_robot_is_to_move() {
        let scene = r#"<innerModel><differentialrobot id="base">
            <battery id="cell" level="0.5" endurance="100" charging="50"/>
            </differentialrobot></innerModel>"#;
        let tree = InnerModel::parse(scene).expect("a scene").snapshot();
        let (mut bases, mut batteries) = (Bases::default(), Batteries::default());
        for node in tree.nodes() {
            bases.notice(node);
            batteries.notice(node);
        }
        let level = |batteries: &Batteries| batteries.get(&tree, "cell").expect("one").level;
        let ahead = Speed {
            advance: 100.0,
            ..Speed::default()
        };
        bases.drive(&tree, "base", ahead).expect("a base");
        batteries.step(&tree, &bases, 10.0);
        assert!((level(&batteries) - 0.4).abs() < 1e-9);
        assert!(batteries.robots_without_power(&tree).is_empty());
        batteries.step(&tree, &bases, 1000.0);
        let base = tree.node("base").expect("a base").node_id();
        assert!(batteries.robots_without_power(&tree).contains(&base));
        bases
            .drive(&tree, "base", Speed::default())
            .expect("a base");
        batteries.step(&tree, &bases, 25.0);
        assert!((level(&batteries) - 0.5).abs() < 1e-9);
        let other = batteries.get(&tree, "base").expect_err("no battery");
        assert!(other.to_string().contains("battery"), "{other}");
        let without = InnerModel::parse("<innerModel/>")
            .expect("a scene")
            .snapshot();
        batteries.drop_removed(&without);
        assert!(batteries.0.is_empty());
    }
}
