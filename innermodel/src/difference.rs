//! Differences between two versions.

use crate::link::NodeId;
use crate::snapshot::Snapshot;
use std::collections::BTreeSet;
use std::sync::Arc;

/// One difference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// A node was removed.
    Removed {
        /// It was this node.
        node: NodeId,
        /// Id of the node.
        id: String,
    },
    /// A node is new. Its parent comes before it.
    Added(NodeId),
    /// A node has another parent.
    Parent(NodeId),
    /// A node is at another place in its parent: its pose or its joint.
    Moved(NodeId),
    /// Kind, attributes or allowed contacts of a node are others.
    Data(NodeId),
}

/// Differences between two versions of a model.
pub type Difference = Vec<Change>;

impl Snapshot {
    /// The differences from an older version of the same model. The time it takes depends on the
    /// changes, not on the size of the tree.
    pub fn since(&self, older: &Self) -> Difference {
        let mut places = BTreeSet::new();
        self.links.differences(&older.links, &mut |at| {
            places.insert(at as u32);
        });
        self.data.differences(&older.data, &mut |at| {
            places.insert(at as u32);
        });
        let (mut removed, mut added, mut rest) = (Vec::new(), Vec::new(), Vec::new());
        for place in places {
            let (new, old) = (self.at(place), older.at(place));
            let stays = match (&new, &old) {
                (Some(new), Some(old)) => new.node_id() == old.node_id(),
                _ => false,
            };
            if let (Some(old), false) = (&old, stays) {
                removed.push(Change::Removed {
                    node: old.node_id(),
                    id: old.id().to_owned(),
                });
            }
            if let (Some(new), false) = (&new, stays) {
                added.push((new.depth(), new.node_id()));
            }
            let (Some(new), Some(old), true) = (new, old, stays) else {
                continue;
            };
            let (links, data) = (
                (self.link(place), older.link(place)),
                (self.data(place), older.data(place)),
            );
            if let (Some(a), Some(b)) = links {
                if a.parent != b.parent {
                    rest.push(Change::Parent(new.node_id()));
                }
                if a.pose != b.pose || a.position != b.position {
                    rest.push(Change::Moved(new.node_id()));
                }
            }
            if let (Some(a), Some(b)) = data
                && !Arc::ptr_eq(a, b)
                && (a.kind != b.kind || a.allowed != b.allowed || a.attributes != b.attributes)
            {
                rest.push(Change::Data(old.node_id()));
            }
        }
        added.sort_unstable();
        removed.extend(added.into_iter().map(|(_, node)| Change::Added(node)));
        removed.extend(rest);
        removed
    }
}
