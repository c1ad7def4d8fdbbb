//! The people of a world.

use crate::error::Error;
use crate::human::{Part, SKELETON, SWING};
use crate::world::World;
use innermodel::{Kind, NodeId, Point, Pose};

impl World {
    /// The joints of a person by their names, such as `head` and `left_knee`, in the root: the
    /// ground truth for those who track people.
    pub fn skeleton(&self, id: &str) -> Result<Vec<(&'static str, Point)>, Error> {
        let tree = self.tree();
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

    /// Moves all people by one step.
    pub(crate) fn walk(&mut self) {
        if self.state.people.is_empty() {
            return;
        }
        let tree = self.tree();
        let seconds = self.step.as_secs_f64();
        let mut moves: Vec<(NodeId, Pose)> = Vec::new();
        for (person, walk) in &mut self.state.people {
            let Ok(node) = tree.node(*person) else {
                continue;
            };
            let (Kind::Human(human), Some(parent)) = (node.kind(), node.parent()) else {
                continue;
            };
            if human.path.len() < 2 {
                continue;
            }
            let bases = self.state.bases.keys();
            let places = bases.filter_map(|base| tree.between(parent, *base).ok());
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
        self.change_each(&moves, |edit, (node, pose)| edit.set_pose(*node, *pose));
    }
}
