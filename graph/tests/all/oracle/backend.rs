//! The interface of a graph in the suite.

/// Why an operation was not done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// The element is not there any more.
    Absent,
    /// Another element has the id.
    There,
}

/// A node or an edge, with the names and values of its attributes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Element {
    pub(crate) id: u64,
    pub(crate) kind: String,
    pub(crate) attributes: Vec<(String, i64)>,
}

/// Nodes and edges with ids, types and integers as attributes. Several edges may lead from one node to
/// the same other one.
pub(crate) trait Backend {
    /// Names a node; after its removal it names no other one.
    type Node: Copy;
    /// Names an edge; after its removal it names no other one.
    type Edge: Copy;

    /// Does several operations as one change. If `make` returns `false`, nothing has changed.
    fn change(&mut self, make: impl FnOnce(&mut dyn Operations<Self::Node, Self::Edge>) -> bool);
    /// All nodes.
    fn nodes(&self) -> Vec<Element>;
    /// All edges, with the ids of their ends.
    fn edges(&self) -> Vec<(Element, u64, u64)>;
}

/// The edges of a node with their other ends, by ids.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Neighbours {
    pub(crate) out: Vec<(u64, u64)>,
    pub(crate) in_: Vec<(u64, u64)>,
    pub(crate) successors: Vec<u64>,
    pub(crate) predecessors: Vec<u64>,
}

/// The operations of a change.
pub(crate) trait Operations<N, E> {
    fn add_node(&mut self, id: u64, kind: &str) -> Result<N, Refusal>;
    fn remove_node(&mut self, node: N) -> Result<(), Refusal>;
    fn add_edge(&mut self, id: u64, kind: &str, from: N, to: N) -> Result<E, Refusal>;
    fn remove_edge(&mut self, edge: E) -> Result<(), Refusal>;
    /// Sets an attribute of a node, or removes it.
    fn set_node(&mut self, node: N, name: &str, value: Option<i64>) -> Result<(), Refusal>;
    /// Sets an attribute of an edge, or removes it.
    fn set_edge(&mut self, edge: E, name: &str, value: Option<i64>) -> Result<(), Refusal>;
    fn neighbours(&self, node: N) -> Result<Neighbours, Refusal>;
}
