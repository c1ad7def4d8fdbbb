//! What has changed, one after the other.

use property_graph::{Change, EdgeId, Element, NodeId, Snapshot};
use rc_world::{Reader, World};
use rc_world_member::Member;

/// One change of a node or an edge, named as DSR's signals are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Signal {
    /// `update_node_signal`: a node is new.
    UpdateNode {
        /// The node.
        id: NodeId,
        /// Its type.
        kind: String,
    },
    /// `update_node_attr_signal`: a node has other attributes.
    UpdateNodeAttr {
        /// The node.
        id: NodeId,
        /// Their names.
        names: Vec<String>,
    },
    /// `update_edge_signal`: an edge is new.
    UpdateEdge {
        /// Where it starts.
        from: NodeId,
        /// Where it ends.
        to: NodeId,
        /// Its type.
        kind: String,
    },
    /// `update_edge_attr_signal`: an edge has other attributes.
    UpdateEdgeAttr {
        /// Where it starts.
        from: NodeId,
        /// Where it ends.
        to: NodeId,
        /// Its type.
        kind: String,
        /// Their names.
        names: Vec<String>,
    },
    /// `del_node_signal`: a node is gone.
    DeleteNode {
        /// The node, which is in no version any more.
        id: NodeId,
    },
    /// `del_edge_signal`: an edge is gone.
    DeleteEdge {
        /// Where it started.
        from: NodeId,
        /// Where it ended.
        to: NodeId,
        /// Its type.
        kind: String,
    },
}

/// What changes from its making on. A worker keeps it, and takes what is new when it likes: in `compute`, for example.
#[derive(Clone, Debug)]
pub struct Signals(Reader);

impl Signals {
    /// Changes from now on.
    pub fn connect(world: &Member) -> Self {
        Self(world.reader())
    }

    /// What has changed since the last call. Changes of one element meanwhile are one.
    pub fn take(&mut self, world: &Member) -> Vec<Signal> {
        let Some(news) = World::news(world, &mut self.0) else {
            return Vec::new();
        };
        let (before, after) = (&news.before, &news.after);
        let mut attributes: Vec<(Element, Vec<String>)> = Vec::new();
        let mut signals = Vec::new();
        for change in &news.changes {
            signals.extend(match change {
                Change::EdgeRemoved(edge, _) => of_edge(before, *edge, |from, to, kind| {
                    Signal::DeleteEdge { from, to, kind }
                }),
                Change::NodeRemoved(id, _) => Some(Signal::DeleteNode { id: *id }),
                Change::NodeAdded(id) => after.node(*id).ok().map(|node| Signal::UpdateNode {
                    id: *id,
                    kind: node.type_name().to_owned(),
                }),
                Change::EdgeAdded(edge) => of_edge(after, *edge, |from, to, kind| {
                    Signal::UpdateEdge { from, to, kind }
                }),
                Change::Attribute(element, name) => {
                    let name = after.text(*name).to_owned();
                    match attributes.last_mut() {
                        Some((last, names)) if last == element => names.push(name),
                        _ => attributes.push((*element, vec![name])),
                    }
                    None
                }
            });
        }
        signals.extend(
            attributes
                .into_iter()
                .filter_map(|(element, names)| match element {
                    Element::Node(id) => Some(Signal::UpdateNodeAttr { id, names }),
                    Element::Edge(edge) => {
                        of_edge(after, edge, |from, to, kind| Signal::UpdateEdgeAttr {
                            from,
                            to,
                            kind,
                            names,
                        })
                    }
                }),
        );
        signals
    }
}

fn of_edge(
    of: &Snapshot,
    edge: EdgeId,
    make: impl FnOnce(NodeId, NodeId, String) -> Signal,
) -> Option<Signal> {
    let edge = of.edge(edge).ok()?;
    Some(make(edge.from(), edge.to(), edge.type_name().to_owned()))
}
