//! Patterns: rows for all ways in which nodes and edges fit.

use crate::ast::{Chain, Direction, EdgePattern, Match, NodePattern};
use crate::cell::Cell;
use crate::eval::{Scope, truth};
use crate::run::{Budget, Error};
use property_graph::schema::Relation;
use property_graph::{EdgeId, EdgeRef, Element, NodeId, Snapshot, Symbol};

/// One step of finding a pattern.
enum Step<'p> {
    /// The first node of a chain.
    Start(&'p NodePattern),
    /// An edge from a node that is known, to the other node.
    Walk {
        edge: &'p EdgePattern,
        from: usize,
        to: &'p NodePattern,
        /// Whether the pattern is walked against the order in which it is written.
        turned: bool,
    },
}

/// Walks through patterns.
pub(crate) struct Matcher<'a, 'p> {
    scope: &'a Scope<'a>,
    steps: Vec<Step<'p>>,
    pattern: &'p Match,
    pub(crate) budget: &'a mut Budget,
    used: Vec<EdgeId>,
    rows: Vec<Vec<Cell>>,
}

/// How good a node is to start from: less is better.
fn cost(graph: &Snapshot, node: &NodePattern, row: &[Cell]) -> usize {
    if row
        .get(node.variable)
        .is_some_and(|cell| *cell != Cell::Null)
    {
        return 0;
    }
    if node.properties.iter().any(|(name, _)| name.text == "name") {
        return 1;
    }
    match &node.label {
        Some(label) => {
            let is_edge = !relations(graph, &label.text).is_empty();
            let edges = if is_edge { graph.edge_count() } else { 0 };
            2 + graph.instances(&label.text).count() + edges
        }
        None => 2 + graph.node_count(),
    }
}

/// The relations whose edges are nodes of a type to others.
fn relations(graph: &Snapshot, label: &str) -> Vec<Symbol> {
    let schema = graph.schema();
    let is_a = |relation: &&Relation| schema.is_a(&relation.name, label);
    let relations = schema.relations.iter().filter(is_a);
    relations
        .filter_map(|relation| graph.symbol(&relation.name))
        .collect()
}

/// A node as a value: the edge, if it stands for one.
pub(crate) fn cell(graph: &Snapshot, node: NodeId) -> Cell {
    graph.stands_for(node).map_or(Cell::Node(node), Cell::Edge)
}

/// Where the edges of a node, or of an edge to which others refer, begin and end.
fn place(graph: &Snapshot, cell: &Cell) -> Option<NodeId> {
    match cell {
        Cell::Node(node) => Some(*node),
        Cell::Edge(edge) => graph.node_of(*edge),
        _ => None,
    }
}

fn plan<'p>(graph: &Snapshot, chains: &'p [Chain], row: &[Cell]) -> Vec<Step<'p>> {
    let mut steps = Vec::new();
    // An edge is found where others start or end, or by its type. A lone node without a type comes
    // last, so that the order in which a pattern is written decides nothing.
    let is_lone = |chain: &&Chain| {
        chain.edges.is_empty() && chain.nodes.iter().all(|node| node.label.is_none())
    };
    let (lone, others): (Vec<_>, Vec<_>) = chains
        .iter()
        .partition(|chain| is_lone(chain) && graph.promoted().next().is_some());
    for chain in others.into_iter().chain(lone) {
        let nodes = chain.nodes.iter().enumerate();
        let start = nodes.min_by_key(|(_, node)| cost(graph, node, row));
        let Some((start, node)) = start else { continue };
        steps.push(Step::Start(node));
        for (at, edge) in chain.edges.iter().enumerate().skip(start) {
            steps.push(Step::Walk {
                edge,
                from: chain.nodes[at].variable,
                to: &chain.nodes[at + 1],
                turned: false,
            });
        }
        for (at, edge) in chain.edges.iter().enumerate().take(start).rev() {
            steps.push(Step::Walk {
                edge,
                from: chain.nodes[at + 1].variable,
                to: &chain.nodes[at],
                turned: true,
            });
        }
    }
    steps
}

/// The rows of a pattern, each with the values of `row`.
pub(crate) fn rows<'a>(
    scope: &'a Scope<'a>,
    pattern: &Match,
    row: &[Cell],
    budget: &'a mut Budget,
) -> Result<Vec<Vec<Cell>>, Error> {
    let mut matcher = Matcher {
        scope,
        steps: plan(scope.graph, &pattern.chains, row),
        pattern,
        budget,
        used: Vec::new(),
        rows: Vec::new(),
    };
    matcher.step(0, &mut row.to_vec())?;
    Ok(matcher.rows)
}

impl<'p> Matcher<'_, 'p> {
    fn step(&mut self, at: usize, row: &mut Vec<Cell>) -> Result<(), Error> {
        self.budget.step()?;
        let graph = self.scope.graph;
        match self.steps.get(at) {
            None => {
                if let Some(condition) = &self.pattern.condition
                    && truth(&self.scope.eval(condition, row)?)? != Some(true)
                {
                    return Ok(());
                }
                self.budget.row()?;
                self.rows.push(row.clone());
                Ok(())
            }
            Some(Step::Start(node)) => {
                let node: &'p NodePattern = node;
                match row[node.variable].clone() {
                    known @ (Cell::Node(_) | Cell::Edge(_)) => self.node(at, node, known, row),
                    Cell::Null => {
                        let is_end = matches!(self.steps.get(at + 1), Some(Step::Walk { .. }));
                        for candidate in self.candidates(node, is_end, row)? {
                            self.node(at, node, candidate, row)?;
                        }
                        row[node.variable] = Cell::Null;
                        Ok(())
                    }
                    _ => Ok(()),
                }
            }
            Some(Step::Walk {
                edge,
                from,
                to,
                turned,
            }) => {
                let (edge, to, from, turned): (&'p EdgePattern, &'p NodePattern, usize, bool) =
                    (edge, to, *from, *turned);
                let Some(here) = place(graph, &row[from]) else {
                    return Ok(());
                };
                if let Some(length) = edge.length {
                    let mut way = Vec::new();
                    return self.walk(at, edge, to, turned, here, length, &mut way, row);
                }
                let known = row[edge.variable].clone();
                for (found, other) in neighbours(graph, here, edge, turned) {
                    self.budget.step()?;
                    if !self.edge_fits(edge, found, row)? {
                        continue;
                    }
                    let id = found.edge_id();
                    if known != Cell::Null && known != Cell::Edge(id) {
                        continue;
                    }
                    row[edge.variable] = Cell::Edge(id);
                    self.used.push(id);
                    self.arrive(at, to, other, row)?;
                    self.used.pop();
                    row[edge.variable] = known.clone();
                }
                Ok(())
            }
        }
    }

    /// The nodes that a pattern may start with: those of a name, of a type, or all; and edges that are
    /// nodes to others.
    fn candidates(
        &self,
        node: &NodePattern,
        is_end: bool,
        row: &[Cell],
    ) -> Result<Vec<Cell>, Error> {
        let graph = self.scope.graph;
        let of_type = |edge: &EdgeRef<'_>, all: &[Symbol]| all.contains(&edge.relation());
        let mut edges: Vec<Cell> = Vec::new();
        if let Some(label) = &node.label {
            let relations = relations(graph, &label.text);
            if !relations.is_empty() {
                let all = graph.edges().filter(|edge| of_type(edge, &relations));
                edges.extend(all.map(|edge| Cell::Edge(edge.edge_id())));
            }
        } else if is_end {
            edges.extend(graph.promoted().map(|edge| Cell::Edge(edge.edge_id())));
        }
        let mut nodes = self.nodes(node, row)?;
        nodes.extend(edges);
        Ok(nodes)
    }

    fn nodes(&self, node: &NodePattern, row: &[Cell]) -> Result<Vec<Cell>, Error> {
        let graph = self.scope.graph;
        let name = node.properties.iter().find(|(name, _)| name.text == "name");
        if let Some((_, value)) = name
            && let Cell::Text(name) = self.scope.eval(value, row)?
        {
            return Ok(graph.named(&name).map(Cell::Node).collect());
        }
        if let Some(label) = &node.label {
            return Ok(graph.instances(&label.text).map(Cell::Node).collect());
        }
        let nodes = graph.nodes().map(|node| Cell::Node(node.node_id()));
        Ok(nodes.collect())
    }

    /// Goes on with a node, if it fits.
    fn node(
        &mut self,
        at: usize,
        pattern: &NodePattern,
        node: Cell,
        row: &mut Vec<Cell>,
    ) -> Result<(), Error> {
        self.budget.step()?;
        let graph = self.scope.graph;
        let element: Element = match node {
            Cell::Node(node) => node.into(),
            Cell::Edge(edge) => edge.into(),
            _ => return Ok(()),
        };
        if let Some(label) = &pattern.label {
            let kind = match element {
                Element::Node(node) => graph.node(node).map(|node| node.kind()).ok(),
                Element::Edge(edge) => graph.edge(edge).map(|edge| edge.relation()).ok(),
            };
            let wanted = graph.symbol(&label.text);
            let fits = kind.zip(wanted).is_some_and(|(k, w)| graph.is_a(k, w));
            if !fits {
                return Ok(());
            }
        }
        let before = std::mem::replace(&mut row[pattern.variable], node);
        for (name, value) in &pattern.properties {
            let wanted = self.scope.eval(value, row)?;
            let found = self.scope.attribute(element, &name.text);
            if found.equals(&wanted) != Some(true) {
                row[pattern.variable] = before;
                return Ok(());
            }
        }
        let result = self.step(at + 1, row);
        row[pattern.variable] = before;
        result
    }

    fn arrive(
        &mut self,
        at: usize,
        to: &'p NodePattern,
        other: NodeId,
        row: &mut Vec<Cell>,
    ) -> Result<(), Error> {
        let other = cell(self.scope.graph, other);
        match &row[to.variable] {
            Cell::Null => self.node(at, to, other, row),
            known if *known == other => self.node(at, to, other, row),
            _ => Ok(()),
        }
    }

    fn edge_fits(
        &self,
        pattern: &EdgePattern,
        edge: EdgeRef<'_>,
        row: &[Cell],
    ) -> Result<bool, Error> {
        // An edge is in one place of a pattern only.
        if self.used.contains(&edge.edge_id()) {
            return Ok(false);
        }
        let kind = edge.type_name();
        if !pattern.types.is_empty() && pattern.types.iter().all(|t| t.text != kind) {
            return Ok(false);
        }
        for (name, value) in &pattern.properties {
            let wanted = self.scope.eval(value, row)?;
            let found = self.scope.attribute(edge.edge_id().into(), &name.text);
            if found.equals(&wanted) != Some(true) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Walks several edges. No edge is in a path twice, and a path has a greatest length.
    #[expect(clippy::too_many_arguments, reason = "the state of one recursion")]
    fn walk(
        &mut self,
        at: usize,
        edge: &'p EdgePattern,
        to: &'p NodePattern,
        turned: bool,
        here: NodeId,
        (least, most): (usize, usize),
        way: &mut Vec<EdgeId>,
        row: &mut Vec<Cell>,
    ) -> Result<(), Error> {
        self.budget.step()?;
        if way.len() >= least {
            let mut list: Vec<Cell> = way.iter().map(|edge| Cell::Edge(*edge)).collect();
            if turned {
                list.reverse();
            }
            let before = std::mem::replace(&mut row[edge.variable], Cell::List(list.into()));
            if before == Cell::Null || before == row[edge.variable] {
                self.arrive(at, to, here, row)?;
            }
            row[edge.variable] = before;
        }
        if way.len() >= most {
            return Ok(());
        }
        let graph = self.scope.graph;
        for (found, other) in neighbours(graph, here, edge, turned) {
            self.budget.step()?;
            if !self.edge_fits(edge, found, row)? {
                continue;
            }
            let id = found.edge_id();
            way.push(id);
            self.used.push(id);
            self.walk(at, edge, to, turned, other, (least, most), way, row)?;
            self.used.pop();
            way.pop();
        }
        Ok(())
    }
}

/// The edges of a node in the direction of a pattern, each with its other node.
fn neighbours<'g>(
    graph: &'g Snapshot,
    node: NodeId,
    edge: &EdgePattern,
    turned: bool,
) -> impl Iterator<Item = (EdgeRef<'g>, NodeId)> + use<'g> {
    let relation = match edge.types.as_slice() {
        [one] => graph.symbol(&one.text),
        _ => None,
    };
    let forth = match edge.direction {
        Direction::Out => !turned,
        Direction::In => turned,
        Direction::Both => true,
    };
    let back = edge.direction == Direction::Both || !forth;
    let out = graph.out_edges(node, relation).filter(move |_| forth);
    let out = out.map(|edge| (edge, edge.to()));
    let incoming = graph.in_edges(node, relation).filter(move |_| back);
    // An edge from a node to itself was among the outgoing ones.
    let incoming = incoming.filter(move |edge| !(forth && edge.from() == edge.to()));
    out.chain(incoming.map(|edge| (edge, edge.from())))
}
