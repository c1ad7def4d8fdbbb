//! Patterns: rows for all ways in which nodes and edges fit.

use crate::ast::Match;
use crate::budget::{Budget, Error, Result};
use crate::cell::Cell;
use crate::eval::{Scope, truth};
use crate::plan::{Label, Place, Plan, Step, Way};
use property_graph::{Element, NodeId, Snapshot, Step as Along};
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// The receiver of the rows, one after the other, each with the number of equal ones that it
/// represents.
pub(crate) type Sink<'f> = &'f mut dyn FnMut(&mut [Cell], u32, &mut Budget) -> Result<()>;

/// Walks through a pattern.
struct Matcher<'a, 'f, 'p> {
    scope: &'a Scope<'a>,
    plan: &'a Plan<'p>,
    /// Why tests on the way could not be computed. They are errors of a row that all others accept.
    doubts: Vec<Error>,
    budget: &'a mut Budget,
    /// The edges of the present row.
    used: Vec<Used>,
    /// Nodes from which the last step is still to be done, each with the number of rows that have come
    /// there, and their places in the list.
    ends: Vec<(NodeId, u32)>,
    places: HashMap<NodeId, usize, BuildHasherDefault<Quick>>,
    /// How many equal rows the present one represents.
    weight: u32,
    is_found: bool,
    sink: Sink<'f>,
}

/// An edge of the present row, with the nodes where it starts and ends.
#[derive(Clone, Copy)]
struct Used {
    number: u32,
    from: NodeId,
    to: NodeId,
}

impl Used {
    fn new(along: &Along<'_>, here: NodeId) -> Self {
        let (number, there) = (along.number(), along.node());
        let (from, to) = if along.is_forth() {
            (here, there)
        } else {
            (there, here)
        };
        Self { number, from, to }
    }
}

/// A walk along several edges.
struct Walk<'a, 'p> {
    way: &'a Way<'p>,
    to: Place<'p>,
    is_turned: bool,
    least: usize,
    most: usize,
    /// How many edges the row had before.
    before: usize,
}

/// Hashes nodes of a graph. Their numbers cannot be chosen by an attacker.
#[derive(Default)]
struct Quick(u64);

impl Hasher for Quick {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes
            .iter()
            .for_each(|byte| self.write_u32(u32::from(*byte)));
    }

    fn write_u32(&mut self, number: u32) {
        let mixed = self.0.rotate_left(5) ^ u64::from(number);
        self.0 = mixed.wrapping_mul(0x517c_c1b7_2722_0a95);
    }
}

/// Where the edges of a node, or of an edge to which others refer, begin and end.
fn place(graph: &Snapshot, cell: &Cell) -> Option<NodeId> {
    match cell {
        Cell::Node(node) => Some(*node),
        Cell::Edge(edge) => graph.node_of(*edge),
        _ => None,
    }
}

/// Gives all rows of a pattern to `sink`, each with the values of `row`. Returns whether there are any.
pub(crate) fn rows<'p>(
    scope: &Scope<'_>,
    pattern: &'p Match,
    plan: &Plan<'p>,
    row: &mut [Cell],
    budget: &mut Budget,
    sink: Sink<'_>,
) -> Result<bool> {
    // No match starts at a node that an optional pattern has not found.
    let mut earlier = pattern.earlier.iter();
    if earlier.any(|variable| row[*variable] == Cell::Null) {
        return Ok(false);
    }
    let mut matcher = Matcher {
        scope,
        plan,
        doubts: Vec::new(),
        budget,
        used: Vec::new(),
        ends: Vec::new(),
        places: HashMap::default(),
        weight: 1,
        is_found: false,
        sink,
    };
    matcher.step(0, row)?;
    matcher.last_steps(row)?;
    Ok(matcher.is_found)
}

impl<'a, 'p> Matcher<'a, '_, 'p> {
    fn step(&mut self, at: usize, row: &mut [Cell]) -> Result<()> {
        self.budget.step()?;
        let graph = self.scope.graph;
        let plan = self.plan;
        match plan.steps.get(at) {
            None => {
                if let Some(error) = self.doubts.first() {
                    return Err(error.clone().into());
                }
                self.budget.row()?;
                self.is_found = true;
                (self.sink)(row, self.weight, self.budget)
            }
            Some(Step::Start(start, name)) => match row[start.node.variable].clone() {
                known @ (Cell::Node(_) | Cell::Edge(_)) => self.node(at, *start, known, row),
                Cell::Null => {
                    let name = match name {
                        Some(name) => self.scope.eval(name, row)?,
                        None => Cell::Null,
                    };
                    self.start(at, *start, &name, row)
                }
                _ => Ok(()),
            },
            Some(Step::Walk {
                way,
                from,
                to,
                turned,
            }) => {
                let Some(here) = place(graph, &row[*from]) else {
                    return Ok(());
                };
                if let Some((least, most)) = way.edge.length {
                    let walk = Walk {
                        way,
                        to: *to,
                        is_turned: *turned,
                        least,
                        most,
                        before: self.used.len(),
                    };
                    return self.walk(at, &walk, here, &mut Vec::new(), row);
                }
                if plan.is_shared && at + 1 == plan.steps.len() && self.shares(way, here) {
                    return Ok(());
                }
                self.hop(at, way, *to, here, row)
            }
        }
    }

    /// Along one edge.
    fn hop(
        &mut self,
        at: usize,
        way: &Way<'p>,
        to: Place<'p>,
        here: NodeId,
        row: &mut [Cell],
    ) -> Result<()> {
        let graph = self.scope.graph;
        if !way.edge.is_read {
            for along in graph.steps(here, way.relation, way.directions) {
                self.budget.step()?;
                if self.edge_fits(way, &along, row)? {
                    self.used.push(Used::new(&along, here));
                    self.arrive(at, to, along.node(), row)?;
                    self.used.pop();
                }
            }
            return Ok(());
        }
        let variable = way.edge.variable;
        let known = match &row[variable] {
            Cell::Null => None,
            known => Some(known.clone()),
        };
        for along in graph.steps(here, way.relation, way.directions) {
            self.budget.step()?;
            if !self.edge_fits(way, &along, row)? {
                continue;
            }
            let Some(edge) = along.edge() else { continue };
            let found = Cell::Edge(edge.edge_id());
            if known.as_ref().is_some_and(|known| *known != found) {
                continue;
            }
            row[variable] = found;
            self.used.push(Used::new(&along, here));
            self.arrive(at, to, along.node(), row)?;
            self.used.pop();
        }
        row[variable] = known.unwrap_or(Cell::Null);
        Ok(())
    }

    /// Leaves the last step from a node for later, when it is known how many rows have come there: what
    /// follows depends on nothing else. Returns whether that is possible.
    fn shares(&mut self, way: &Way<'p>, here: NodeId) -> bool {
        let [forth, back] = way.directions;
        // A row that has taken an edge of this node cannot take it again.
        let meets = |used: &Used| forth && used.from == here || back && used.to == here;
        if !self.doubts.is_empty() || self.used.iter().any(meets) {
            return false;
        }
        let next = self.ends.len();
        let at = *self.places.entry(here).or_insert(next);
        match self.ends.get_mut(at) {
            Some((_, weight)) if *weight < u32::MAX => *weight += 1,
            Some(_) => return false,
            None => self.ends.push((here, 1)),
        }
        true
    }

    /// Does the last step from all nodes that were left for later.
    fn last_steps(&mut self, row: &mut [Cell]) -> Result<()> {
        let plan = self.plan;
        let Some(Step::Walk { way, from, to, .. }) = plan.steps.last() else {
            return Ok(());
        };
        let before = row[*from].clone();
        for (here, weight) in std::mem::take(&mut self.ends) {
            row[*from] = Cell::of_node(self.scope.graph, here);
            self.weight = weight;
            self.hop(plan.steps.len() - 1, way, *to, here, row)?;
        }
        row[*from] = before;
        Ok(())
    }

    /// Starts at each node that a pattern may start with: those of a name, of a type, or all; and at edges
    /// that are nodes to others.
    fn start(&mut self, at: usize, start: Place<'p>, name: &Cell, row: &mut [Cell]) -> Result<()> {
        let graph = self.scope.graph;
        match (name, start.label) {
            (Cell::Text(name), _) => {
                for node in graph.named(name) {
                    self.node(at, start, Cell::Node(node), row)?;
                }
            }
            (_, Label::Of(label)) => {
                for node in graph.instances(label) {
                    self.node(at, start, Cell::Node(node), row)?;
                }
            }
            (_, Label::Nothing) => {}
            (_, Label::Any) => {
                for node in graph.nodes() {
                    self.node(at, start, Cell::Node(node.node_id()), row)?;
                }
            }
        }
        match start.label {
            Label::Of(label) if graph.relations_as(label).next().is_some() => {
                for edge in graph.edges() {
                    let mut all = graph.relations_as(label);
                    if all.any(|relation| relation == edge.relation()) {
                        self.node(at, start, Cell::Edge(edge.edge_id()), row)?;
                    }
                }
            }
            Label::Any if matches!(self.plan.steps.get(at + 1), Some(Step::Walk { .. })) => {
                for edge in graph.promoted() {
                    self.node(at, start, Cell::Edge(edge.edge_id()), row)?;
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Goes on with a node, if it fits.
    fn node(&mut self, at: usize, place: Place<'p>, node: Cell, row: &mut [Cell]) -> Result<()> {
        self.budget.step()?;
        let graph = self.scope.graph;
        let element: Element = match node {
            Cell::Node(node) => node.into(),
            Cell::Edge(edge) => edge.into(),
            _ => return Ok(()),
        };
        let pattern = place.node;
        let fits = match place.label {
            Label::Any => true,
            Label::Of(wanted) => {
                let kind = graph.type_of(element);
                kind.is_some_and(|kind| kind == wanted || graph.is_a(kind, wanted))
            }
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
        let doubts = self.doubts.len();
        let result = if self.passes(at, row) {
            self.step(at + 1, row)
        } else {
            Ok(())
        };
        self.doubts.truncate(doubts);
        row[pattern.variable] = before;
        result
    }

    /// Whether the parts of the condition may hold whose variables are known now.
    #[inline]
    fn passes(&mut self, at: usize, row: &[Cell]) -> bool {
        for test in self.plan.tests.get(at).into_iter().flatten() {
            match self.scope.eval(test, row).and_then(|value| truth(&value)) {
                Ok(Some(true)) => {}
                Ok(_) => return false,
                // Another part may still say no: then this one is of no interest.
                Err(error) => self.doubts.push(*error),
            }
        }
        true
    }

    #[inline]
    fn arrive(&mut self, at: usize, to: Place<'p>, other: NodeId, row: &mut [Cell]) -> Result<()> {
        let other = Cell::of_node(self.scope.graph, other);
        match &row[to.node.variable] {
            Cell::Null => self.node(at, to, other, row),
            known if *known == other => self.node(at, to, other, row),
            _ => Ok(()),
        }
    }

    #[inline]
    fn edge_fits(&self, way: &Way<'p>, along: &Along<'_>, row: &[Cell]) -> Result<bool> {
        // An edge is in one place of a pattern only.
        let number = along.number();
        if self.used.iter().any(|used| used.number == number) {
            return Ok(false);
        }
        let mut relations = way.relations.iter();
        if relations.any(|relations| !relations.contains(&along.relation())) {
            return Ok(false);
        }
        if way.edge.properties.is_empty() {
            return Ok(true);
        }
        let Some(edge) = along.edge() else {
            return Ok(false);
        };
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
        walk: &Walk<'a, 'p>,
        here: NodeId,
        path: &mut Vec<Cell>,
        row: &mut [Cell],
    ) -> Result<()> {
        self.budget.step()?;
        let (way, edge) = (walk.way, walk.way.edge);
        let length = self.used.len() - walk.before;
        if length >= walk.least && !edge.is_read {
            self.arrive(at, walk.to, here, row)?;
        } else if length >= walk.least {
            let mut list = path.clone();
            if walk.is_turned {
                list.reverse();
            }
            let before = std::mem::replace(&mut row[edge.variable], Cell::List(list.into()));
            if before == Cell::Null || before == row[edge.variable] {
                self.arrive(at, walk.to, here, row)?;
            }
            row[edge.variable] = before;
        }
        if length >= walk.most {
            return Ok(());
        }
        let graph = self.scope.graph;
        for along in graph.steps(here, way.relation, way.directions) {
            self.budget.step()?;
            if !self.edge_fits(way, &along, row)? {
                continue;
            }
            if edge.is_read {
                let Some(found) = along.edge() else { continue };
                path.push(Cell::Edge(found.edge_id()));
            }
            self.used.push(Used::new(&along, here));
            self.walk(at, walk, along.node(), path, row)?;
            self.used.pop();
            path.pop();
        }
        Ok(())
    }
}
