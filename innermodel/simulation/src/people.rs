//! The people of a world.

use crate::bases::Bases;
use crate::error::Error;
use crate::human::{Part, SKELETON, SWING, Walk};
use innermodel::{Kind, NodeId, NodeRef, Point, Pose, Snapshot};
use std::collections::BTreeMap;

/// The people of a world, and how far they have walked.
#[derive(Clone, Debug, Default)]
pub(crate) struct People(BTreeMap<NodeId, Walk>);

impl People {
    /// Adds the person of a node, if it is one, and is new.
    pub(crate) fn notice(&mut self, node: NodeRef<'_>) {
        if let Kind::Human(_) = node.kind() {
            self.0.entry(node.node_id()).or_default();
        }
    }

    /// Drops those that the tree does not have any more.
    pub(crate) fn drop_removed(&mut self, tree: &Snapshot) {
        let is_one = |kind: &Kind| matches!(kind, Kind::Human(_));
        let there = |node| tree.node(node).is_ok_and(|node| is_one(node.kind()));
        self.0.retain(|node, _| there(*node));
    }

    /// Lets all people walk for `seconds`, around the bases. Returns the new poses of their nodes.
    pub(crate) fn step(
        &mut self,
        tree: &Snapshot,
        bases: &Bases,
        seconds: f64,
    ) -> Vec<(NodeId, Pose)> {
        let mut moves: Vec<(NodeId, Pose)> = Vec::new();
        for (person, walk) in &mut self.0 {
            let Ok(node) = tree.node(*person) else {
                continue;
            };
            let (Kind::Human(human), Some(parent)) = (node.kind(), node.parent()) else {
                continue;
            };
            if human.path.len() < 2 {
                continue;
            }
            let bases = bases.nodes();
            let places = bases.filter_map(|base| tree.between(parent, base).ok());
            let robots: Vec<_> = places.map(|p| [p.translation.x, p.translation.z]).collect();
            walk.step(human, &robots, seconds);
            moves.push((*person, walk.pose(human, node.pose().translation[1])));
            let swing = SWING * walk.phase.sin();
            let bend = |leg: f64| (SWING * (walk.phase.cos() * leg).max(0.0)) + 0.05;
            let angles = [
                ("left_shoulder", swing),
                ("right_shoulder", -swing),
                ("left_elbow", -0.3),
                ("right_elbow", -0.3),
                ("left_hip", -swing),
                ("right_hip", swing),
                ("left_knee", bend(1.0)),
                ("right_knee", bend(-1.0)),
            ];
            for (joint, angle) in angles {
                if let Ok(joint) = tree.node(&format!("{}_{joint}", node.id())) {
                    let mut pose = joint.pose();
                    pose.rotation = [angle, 0.0, 0.0];
                    moves.push((joint.node_id(), pose));
                }
            }
        }
        moves
    }
}

/// The joints of a person by their names, such as `head` and `left_knee`, in the root: the
/// ground truth for those who track people.
pub(crate) fn skeleton(tree: &Snapshot, id: &str) -> Result<Vec<(&'static str, Point)>, Error> {
    let node = tree.node(id)?;
    if !matches!(node.kind(), Kind::Human(_)) {
        return Err(Error::other_kind(id, node.kind(), "human"));
    }
    let joint = |part: &Part| {
        let name = format!("{id}_{}", part.name);
        let point = tree.transform("root", Point::origin(), &name)?;
        Ok((part.name, point))
    };
    SKELETON.iter().map(joint).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use innermodel::InnerModel;

    #[test]
    fn only_a_person_with_a_path_walks() {
        let scene = r#"<innerModel><human id="anna" path="0,0 4000,0"/><human id="ben"/>
            </innerModel>"#;
        let tree = InnerModel::parse(scene).expect("a scene").snapshot();
        let mut people = People::default();
        tree.nodes().for_each(|node| people.notice(node));
        let anna = tree.node("anna").expect("a person").node_id();
        let moves = people.step(&tree, &Bases::default(), 0.5);
        assert_eq!(moves[0].0, anna);
        assert!(moves[0].1.translation[0] > 0.0, "along x");
        let ben = tree.node("ben").expect("a person").node_id();
        assert!(moves.iter().all(|(node, _)| *node != ben));
        skeleton(&tree, "root").expect_err("no person");
    }
}
