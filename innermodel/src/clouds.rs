//! The points of point clouds. They are measured often, so they are not part of a version: the
//! history would keep them all.

use crate::link::NodeId;
use crate::snapshot::Snapshot;
use innermodel_language::model::Kind;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A point of a cloud.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColouredPoint {
    /// In the frame of the node, in millimetres.
    pub position: [f32; 3],
    /// Red, green and blue.
    pub colour: [u8; 3],
}

/// The points of all point clouds of a model at one moment. A clone shares them.
#[derive(Clone, Debug, Default)]
pub struct Clouds {
    by_node: Arc<ByNode>,
}

/// The points of each node.
pub(crate) type ByNode = BTreeMap<NodeId, Arc<[ColouredPoint]>>;

impl Clouds {
    /// How many points all clouds of a model may have.
    pub const MOST_POINTS: usize = 10_000_000;

    pub(crate) fn new(by_node: ByNode) -> Self {
        Self {
            by_node: Arc::new(by_node),
        }
    }

    /// The points of a node.
    pub fn of(&self, node: NodeId) -> &[ColouredPoint] {
        self.by_node.get(&node).map_or(&[], |points| points)
    }

    /// The nodes that have points, with these.
    pub fn iter(&self) -> impl Iterator<Item = (NodeId, &[ColouredPoint])> {
        self.by_node.iter().map(|(node, points)| (*node, &**points))
    }

    /// Whether nothing was set since the other one was returned.
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.by_node, &other.by_node)
    }

    /// These clouds without those of removed nodes.
    pub(crate) fn living(&self, tree: &Snapshot) -> ByNode {
        let all = self.by_node.iter();
        let lives = |node: NodeId| tree.node(node).is_ok_and(|n| *n.kind() == Kind::PointCloud);
        all.filter(|(node, _)| lives(**node))
            .map(|(node, points)| (*node, Arc::clone(points)))
            .collect()
    }
}
