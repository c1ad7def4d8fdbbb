//! Patterns: rows for all ways in which nodes and edges fit.

use crate::ast::{Chain, Direction, EdgePattern, Match, NodePattern};
use crate::cell::Cell;
use crate::eval::{Scope, truth};
use crate::run::{Budget, Error};
use property_graph::{EdgeId, EdgeRef, NodeId, Snapshot};

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
        Some(label) => 2 + graph.instances(&label.text).count(),
        None => 2 + graph.node_count(),
    }
}

fn plan<'p>(graph: &Snapshot, chains: &'p [Chain], row: &[Cell]) -> Vec<Step<'p>> {
    let mut steps = Vec::new();
    for chain in chains {
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
                match row[node.variable] {
                    Cell::Node(known) => self.node(at, node, known, row),
                    Cell::Null => {
                        for candidate in self.candidates(node, row)? {
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
                let Cell::Node(here) = row[from] else {
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

    /// The nodes that a pattern may start with: those of a name, of a type, or all.
    fn candidates(&self, node: &NodePattern, row: &[Cell]) -> Result<Vec<NodeId>, Error> {
        let graph = self.scope.graph;
        let name = node.properties.iter().find(|(name, _)| name.text == "name");
        if let Some((_, value)) = name
            && let Cell::Text(name) = self.scope.eval(value, row)?
        {
            return Ok(graph.named(&name).collect());
        }
        Ok(match &node.label {
            Some(label) => graph.instances(&label.text).collect(),
            None => graph.nodes().map(|node| node.node_id()).collect(),
        })
    }

    /// Goes on with a node, if it fits.
    fn node(
        &mut self,
        at: usize,
        pattern: &NodePattern,
        node: NodeId,
        row: &mut Vec<Cell>,
    ) -> Result<(), Error> {
        self.budget.step()?;
        let graph = self.scope.graph;
        if let Some(label) = &pattern.label {
            let kind = graph.node(node).map(|node| node.kind()).ok();
            let wanted = graph.symbol(&label.text);
            let fits = kind.zip(wanted).is_some_and(|(k, w)| graph.is_a(k, w));
            if !fits {
                return Ok(());
            }
        }
        let before = std::mem::replace(&mut row[pattern.variable], Cell::Node(node));
        for (name, value) in &pattern.properties {
            let wanted = self.scope.eval(value, row)?;
            let found = self.scope.attribute(node.into(), &name.text);
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
        match &row[to.variable] {
            Cell::Node(known) if *known != other => Ok(()),
            Cell::Node(_) | Cell::Null => self.node(at, to, other, row),
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
