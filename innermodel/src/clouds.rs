//! The points of point clouds. They are measured often, so they are no part of a version: the
//! history would keep them all.

use crate::error::Error;
use crate::link::NodeId;
use crate::model::InnerModel;
use crate::snapshot::{Key, Snapshot};
use innermodel_language::model::Kind;
use rc_diagnostics::foreign;
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
    by_node: Arc<BTreeMap<NodeId, Arc<[ColouredPoint]>>>,
}

impl Clouds {
    /// How many points all clouds of a model may have.
    pub const MOST_POINTS: usize = 10_000_000;

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

    /// These clouds without those of nodes that are no more.
    fn living(&self, tree: &Snapshot) -> BTreeMap<NodeId, Arc<[ColouredPoint]>> {
        let all = self.by_node.iter();
        let lives = |node: NodeId| tree.node(node).is_ok_and(|n| *n.kind() == Kind::PointCloud);
        all.filter(|(node, _)| lives(**node))
            .map(|(node, points)| (*node, Arc::clone(points)))
            .collect()
    }
}

impl InnerModel {
    /// The points of all point clouds.
    pub fn clouds(&self) -> Clouds {
        Clouds::clone(&self.clouds.load())
    }

    /// Replaces the points of a node of the kind `pointcloud`, in its frame. They make no new
    /// version.
    ///
    /// # Errors
    /// There is no such node, it is of another kind, or all clouds would have more than
    /// [`Clouds::MOST_POINTS`] points.
    pub fn set_points(&self, key: impl Key, points: Vec<ColouredPoint>) -> Result<(), Error> {
        // Of two writers, the second one sees what the first one did.
        let _writers = self.history();
        let tree = self.snapshot();
        let node = tree.node(key)?;
        if *node.kind() != Kind::PointCloud {
            return Err(Error::NotACloud {
                id: foreign::clean(node.id()),
                tag: node.kind().tag(),
            });
        }
        let mut by_node = self.clouds.load().living(&tree);
        by_node.remove(&node.node_id());
        let others: usize = by_node.values().map(|points| points.len()).sum();
        let count = others.saturating_add(points.len());
        if count > Clouds::MOST_POINTS {
            return Err(Error::TooManyPoints(count));
        }
        if !points.is_empty() {
            by_node.insert(node.node_id(), points.into());
        }
        self.clouds.store(Arc::new(Clouds {
            by_node: Arc::new(by_node),
        }));
        Ok(())
    }

    /// Drops the points of nodes that are no more, which the next `set_points` would do.
    pub fn forget_points(&self) {
        let _writers = self.history();
        let by_node = self.clouds.load().living(&self.snapshot());
        if by_node.len() < self.clouds.load().by_node.len() {
            let by_node = Arc::new(by_node);
            self.clouds.store(Arc::new(Clouds { by_node }));
        }
    }
}
