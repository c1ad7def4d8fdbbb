//! Changes of nodes and edges of a type.

use crate::error::Error;
use crate::view::{End, single};
use property_graph::{EdgeId, Edit, NodeId};

/// The node of a type, or of one that inherits from it, with this name.
///
/// # Errors
/// No such node has the name, or several have it.
pub fn existing(edit: &Edit, kind: &'static str, name: &str) -> Result<NodeId, Error> {
    let now = edit.snapshot();
    let is_wanted = |node: &NodeId| {
        let node = now.node(*node);
        node.is_ok_and(|node| now.schema().is_a(node.type_name(), kind))
    };
    single(kind, name, now.named(name).filter(is_wanted))
}

/// Adds a node of a type with a name.
///
/// # Errors
/// The graph has no place, or the change is too large.
pub fn added(edit: &mut Edit, kind: &'static str, name: Option<&str>) -> Result<NodeId, Error> {
    let node = edit.add_node(kind)?;
    if let Some(name) = name {
        edit.set(node, "name", name)?;
    }
    Ok(node)
}

/// The edge of a type between two nodes, which is added if there is none. In a tree, the child loses
/// its parent then.
///
/// # Errors
/// A name does not denote exactly one node, or the schema does not allow the edge.
pub fn edge(
    edit: &mut Edit,
    kind: &'static str,
    from: impl End,
    to: impl End,
) -> Result<EdgeId, Error> {
    let now = edit.snapshot();
    let (from, to) = (from.node(now)?, to.node(now)?);
    if let Some(edge) = found(edit, kind, from, to) {
        return Ok(edge);
    }
    let now = edit.snapshot();
    let tree = now.schema().relation(kind).and_then(|r| r.tree.clone());
    if let (Some(tree), Some(relation)) = (tree, now.symbol(kind)) {
        let old: Vec<EdgeId> = if tree.child == 0 {
            let edges = now.out_edges(from, Some(relation));
            edges.map(|edge| edge.edge_id()).collect()
        } else {
            let edges = now.in_edges(to, Some(relation));
            edges.map(|edge| edge.edge_id()).collect()
        };
        for edge in old {
            edit.remove_edge(edge)?;
        }
    }
    Ok(edit.add_edge(kind, from, to)?)
}

/// The edge of a type between two nodes.
///
/// # Errors
/// A name does not denote exactly one node, or there is no such edge.
pub fn existing_edge(
    edit: &Edit,
    kind: &'static str,
    from: impl End,
    to: impl End,
) -> Result<EdgeId, Error> {
    let now = edit.snapshot();
    let (from, to) = (from.node(now)?, to.node(now)?);
    found(edit, kind, from, to).ok_or(Error::NoEdge(kind))
}

fn found(edit: &Edit, kind: &str, from: NodeId, to: NodeId) -> Option<EdgeId> {
    let now = edit.snapshot();
    let relation = now.symbol(kind)?;
    let mut edges = now.out_edges(from, Some(relation));
    let edge = edges.find(|edge| edge.to() == to)?;
    Some(edge.edge_id())
}
