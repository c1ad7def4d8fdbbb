//! Pairs of nodes that may touch.

use innermodel::{NodeRef, Snapshot};

/// Whether a node or one above it allows the other one, or one above that.
pub(crate) fn may_touch(a: NodeRef<'_>, b: NodeRef<'_>) -> bool {
    one_way(a, b) || one_way(b, a)
}

fn above(node: NodeRef<'_>) -> impl Iterator<Item = NodeRef<'_>> {
    std::iter::successors(Some(node), NodeRef::parent)
}

fn one_way(a: NodeRef<'_>, b: NodeRef<'_>) -> bool {
    above(a).any(|here| {
        let mut allowed = here.allowed().iter();
        !here.allowed().is_empty() && allowed.any(|id| above(b).any(|there| there.id() == id))
    })
}

/// Whether a pair of nodes may touch.
pub(crate) fn allowed(tree: &Snapshot, a: innermodel::NodeId, b: innermodel::NodeId) -> bool {
    match (tree.node(a), tree.node(b)) {
        (Ok(a), Ok(b)) => may_touch(a, b),
        _ => true,
    }
}
