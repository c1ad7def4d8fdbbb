//! The initial contents of a world, as changes that are equal in every replica.

use crate::error::Error;
use graph_merge::Replica;
use property_graph::{EdgeRef, Element, Id, NodeRef, Snapshot, Value, in_order};
use std::collections::{BTreeMap, HashMap};

/// Makes the elements of a graph, in the order of their ids.
pub(crate) fn record(replica: &mut Replica, start: &Snapshot) -> Result<(), Error> {
    let mut made: HashMap<Id, Id> = HashMap::new();
    let mut nodes: Vec<_> = start.nodes().collect();
    nodes.sort_by_key(NodeRef::id);
    for node in nodes {
        let id = replica.add_node(node.type_name())?;
        made.insert(node.id(), id);
        set(replica, start, id, node.node_id().into())?;
    }
    let mut edges: Vec<_> = start.edges().collect();
    edges.sort_by_key(EdgeRef::id);
    let end = |node| start.node(node).map(|node| node.id());
    let mut ends = Vec::with_capacity(edges.len());
    for edge in &edges {
        ends.push((Some(edge.id()), [end(edge.from())?, end(edge.to())?]));
    }
    // An edge may start or end at another one.
    let (order, _) = in_order(&ends, |id| made.contains_key(&id));
    for at in order {
        let (edge, [from, to]) = (&edges[at], ends[at].1);
        let (Some(from), Some(to)) = (made.get(&from), made.get(&to)) else {
            continue;
        };
        let id = replica.add_edge(edge.type_name(), *from, *to)?;
        made.insert(edge.id(), id);
        set(replica, start, id, edge.edge_id().into())?;
    }
    Ok(())
}

fn set(replica: &mut Replica, start: &Snapshot, id: Id, element: Element) -> Result<(), Error> {
    let all: BTreeMap<&str, &Value> = attributes(start, element)?.collect();
    for (name, value) in all {
        replica.set(id, name, Some(value.clone()))?;
    }
    Ok(())
}

/// The attributes of an element that were set, as they were set.
pub(crate) fn attributes(
    of: &Snapshot,
    element: Element,
) -> Result<impl Iterator<Item = (&str, &Value)>, property_graph::Error> {
    let (node, edge) = match element {
        Element::Node(node) => (Some(of.node(node)?.attributes()), None),
        Element::Edge(edge) => (None, Some(of.edge(edge)?.attributes())),
    };
    let edge = edge.into_iter().flatten();
    Ok(node.into_iter().flatten().chain(edge))
}
