//! Patterns: rows for all ways in which nodes and edges fit.

use crate::ast::{Direction, Expr, Match, NodePattern};
use crate::cell::Cell;
use crate::eval::{Scope, truth};
use crate::plan::{self, Label, Place, Plan, Step, Way, relations};
use crate::run::{Budget, Error};
use property_graph::{EdgeId, EdgeRef, Element, NodeId, Snapshot, Symbol};

/// Walks through patterns.
pub(crate) struct Matcher<'a, 'p> {
    scope: &'a Scope<'a>,
    steps: &'a [Step<'p>],
    /// The parts of the condition that are tested once a step is done.
    tests: &'a [Vec<&'p Expr>],
    /// How many tests on the way have failed to be computed: then the whole condition decides.
    doubts: usize,
    pattern: &'p Match,
    pub(crate) budget: &'a mut Budget,
    used: Vec<EdgeId>,
    rows: Vec<Vec<Cell>>,
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

/// The rows of a pattern, each with the values of `row`.
pub(crate) fn rows<'a>(
    scope: &'a Scope<'a>,
    pattern: &Match,
    row: &[Cell],
    budget: &'a mut Budget,
) -> Result<Vec<Vec<Cell>>, Error> {
    // Nothing is found at what an optional pattern has not found.
    if pattern
        .earlier
        .iter()
        .any(|variable| row[*variable] == Cell::Null)
    {
        return Ok(Vec::new());
    }
    let plan = Plan::new(scope.graph, pattern, row);
    let mut matcher = Matcher {
        scope,
        tests: &plan.tests,
        steps: &plan.steps,
        doubts: 0,
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
                    && self.doubts > 0
                    && truth(&self.scope.eval(condition, row)?)? != Some(true)
                {
                    return Ok(());
                }
                self.budget.row()?;
                self.rows.push(row.clone());
                Ok(())
            }
            Some(Step::Start(start)) => {
                let node = start.node;
                match row[node.variable].clone() {
                    known @ (Cell::Node(_) | Cell::Edge(_)) => self.node(at, *start, known, row),
                    Cell::Null => {
                        let is_end = matches!(self.steps.get(at + 1), Some(Step::Walk { .. }));
                        for candidate in self.candidates(node, is_end, row)? {
                            self.node(at, *start, candidate, row)?;
                        }
                        row[node.variable] = Cell::Null;
                        Ok(())
                    }
                    _ => Ok(()),
                }
            }
            Some(Step::Walk {
                way,
                from,
                to,
                turned,
            }) => {
                let Some(here) = place(graph, &row[*from]) else {
                    return Ok(());
                };
                let edge = way.edge;
                if let Some(length) = edge.length {
                    let walk = (way, *to, *turned);
                    return self.walk(at, walk, here, length, &mut Vec::new(), row);
                }
                let known = row[edge.variable].clone();
                for (found, other) in neighbours(graph, here, way, *turned) {
                    self.budget.step()?;
                    if !self.edge_fits(way, found, row)? {
                        continue;
                    }
                    let id = found.edge_id();
                    if known != Cell::Null && known != Cell::Edge(id) {
                        continue;
                    }
                    row[edge.variable] = Cell::Edge(id);
                    self.used.push(id);
                    self.arrive(at, *to, other, row)?;
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
        let name = match plan::named(node, self.pattern.condition.as_ref()) {
            Some(value) => self.scope.eval(value, row)?,
            None => Cell::Null,
        };
        if let Cell::Text(name) = name {
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
        place: Place<'p>,
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
        let pattern = place.node;
        let kind = || match element {
            Element::Node(node) => graph.node(node).map(|node| node.kind()).ok(),
            Element::Edge(edge) => graph.edge(edge).map(|edge| edge.relation()).ok(),
        };
        let fits = match place.label {
            Label::Any => true,
            Label::Of(wanted) => kind().is_some_and(|kind| graph.is_a(kind, wanted)),
            Label::Nothing => false,
        };
        if !fits {
            return Ok(());
        }
        let before = std::mem::replace(&mut row[pattern.variable], node);
        for (name, value) in &pattern.properties {
            let wanted = self.scope.eval(value, row)?;
            let found = self.scope.attribute(element, name);
            if found.equals(&wanted) != Some(true) {
                row[pattern.variable] = before;
                return Ok(());
            }
        }
        let doubts = self.doubts;
        let result = if self.passes(at, row) {
            self.step(at + 1, row)
        } else {
            Ok(())
        };
        self.doubts = doubts;
        row[pattern.variable] = before;
        result
    }

    /// Whether the parts of the condition may hold whose variables are known now.
    fn passes(&mut self, at: usize, row: &[Cell]) -> bool {
        for test in self.tests.get(at).into_iter().flatten() {
            match self.scope.eval(test, row).and_then(|value| truth(&value)) {
                Ok(Some(true)) => {}
                Ok(_) => return false,
                // Another part may still say no: then this one is of no interest.
                Err(_) => self.doubts += 1,
            }
        }
        true
    }

    fn arrive(
        &mut self,
        at: usize,
        to: Place<'p>,
        other: NodeId,
        row: &mut Vec<Cell>,
    ) -> Result<(), Error> {
        let other = cell(self.scope.graph, other);
        match &row[to.node.variable] {
            Cell::Null => self.node(at, to, other, row),
            known if *known == other => self.node(at, to, other, row),
            _ => Ok(()),
        }
    }

    fn edge_fits(&self, way: &Way<'p>, edge: EdgeRef<'_>, row: &[Cell]) -> Result<bool, Error> {
        // An edge is in one place of a pattern only.
        if self.used.contains(&edge.edge_id()) {
            return Ok(false);
        }
        let mut relations = way.relations.iter();
        if relations.any(|relations| !relations.contains(&edge.relation())) {
            return Ok(false);
        }
        for (name, value) in &way.edge.properties {
            let wanted = self.scope.eval(value, row)?;
            let found = self.scope.attribute(edge.edge_id().into(), name);
            if found.equals(&wanted) != Some(true) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Walks several edges. No edge is in a path twice, and a path has a greatest length.
    fn walk(
        &mut self,
        at: usize,
        walk: (&Way<'p>, Place<'p>, bool),
        here: NodeId,
        (least, most): (usize, usize),
        path: &mut Vec<EdgeId>,
        row: &mut Vec<Cell>,
    ) -> Result<(), Error> {
        self.budget.step()?;
        let (way, to, turned) = walk;
        let edge = way.edge;
        if path.len() >= least {
            let mut list: Vec<Cell> = path.iter().map(|edge| Cell::Edge(*edge)).collect();
            if turned {
                list.reverse();
            }
            let before = std::mem::replace(&mut row[edge.variable], Cell::List(list.into()));
            if before == Cell::Null || before == row[edge.variable] {
                self.arrive(at, to, here, row)?;
            }
            row[edge.variable] = before;
        }
        if path.len() >= most {
            return Ok(());
        }
        let graph = self.scope.graph;
        for (found, other) in neighbours(graph, here, way, turned) {
            self.budget.step()?;
            if !self.edge_fits(way, found, row)? {
                continue;
            }
            let id = found.edge_id();
            path.push(id);
            self.used.push(id);
            self.walk(at, walk, other, (least, most), path, row)?;
            self.used.pop();
            path.pop();
        }
        Ok(())
    }
}

/// The edges of a node in the direction of a pattern, each with its other node.
fn neighbours<'g>(
    graph: &'g Snapshot,
    node: NodeId,
    way: &Way<'_>,
    turned: bool,
) -> impl Iterator<Item = (EdgeRef<'g>, NodeId)> + use<'g> {
    let forth = match way.edge.direction {
        Direction::Out => !turned,
        Direction::In => turned,
        Direction::Both => true,
    };
    let back = way.edge.direction == Direction::Both || !forth;
    graph.steps(node, way.relation, [forth, back])
}
