//! Sets the points of the point clouds of a model.

use crate::clouds::{Clouds, ColouredPoint};
use crate::error::Error;
use crate::model::InnerModel;
use crate::snapshot::Key;
use innermodel_language::model::Kind;
use rc_diagnostics::foreign;
use std::sync::Arc;

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
        // Of two writers, the second one sees the changes of the first one.
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
            return Err(Error::TooManyPoints {
                count,
                most: Clouds::MOST_POINTS,
            });
        }
        if !points.is_empty() {
            by_node.insert(node.node_id(), points.into());
        }
        self.clouds.store(Arc::new(Clouds::new(by_node)));
        Ok(())
    }

    /// Drops the points of removed nodes, which the next `set_points` would do.
    pub fn forget_points(&self) {
        let _writers = self.history();
        let present = self.clouds.load();
        let living = present.living(&self.snapshot());
        if living.len() < present.iter().count() {
            self.clouds.store(Arc::new(Clouds::new(living)));
        }
    }
}
