//! The order in which a pattern is found, and where the parts of its condition are tested.

use crate::ast::{Chain, EdgePattern, Expr, Match, NodePattern, Operator};
use crate::cell::Cell;
use property_graph::schema::Relation;
use property_graph::{Snapshot, Symbol};
use std::collections::HashSet;

/// The type that a node of a pattern must have.
#[derive(Clone, Copy)]
pub(crate) enum Label {
    Any,
    Of(Symbol),
    /// A name that the graph does not know.
    Nothing,
}

/// A node of a pattern.
#[derive(Clone, Copy)]
pub(crate) struct Place<'p> {
    pub(crate) node: &'p NodePattern,
    pub(crate) label: Label,
}

impl<'p> Place<'p> {
    fn new(graph: &Snapshot, node: &'p NodePattern) -> Self {
        let label = match &node.label {
            Some(label) => graph.symbol(&label.text).map_or(Label::Nothing, Label::Of),
            None => Label::Any,
        };
        Self { node, label }
    }
}

/// An edge of a pattern.
pub(crate) struct Way<'p> {
    pub(crate) edge: &'p EdgePattern,
    /// The only relation, if there is one.
    pub(crate) relation: Option<Symbol>,
    /// All relations, if the pattern names several, or one that the graph does not know.
    pub(crate) relations: Option<Vec<Symbol>>,
}

impl<'p> Way<'p> {
    fn new(graph: &Snapshot, edge: &'p EdgePattern) -> Self {
        let known = edge.types.iter();
        let known: Vec<Symbol> = known.filter_map(|kind| graph.symbol(&kind.text)).collect();
        let (relation, relations) = match (edge.types.as_slice(), known.as_slice()) {
            ([], _) => (None, None),
            ([_], [one]) => (Some(*one), None),
            _ => (None, Some(known)),
        };
        Self {
            edge,
            relation,
            relations,
        }
    }
}

/// One step of finding a pattern.
pub(crate) enum Step<'p> {
    /// The first node of a chain.
    Start(Place<'p>),
    /// An edge from a node that is known, to the other node.
    Walk {
        way: Way<'p>,
        from: usize,
        to: Place<'p>,
        /// Whether the pattern is walked against the order in which it is written.
        turned: bool,
    },
}

/// Steps, and the parts of the condition behind each of them.
pub(crate) struct Plan<'p> {
    pub(crate) steps: Vec<Step<'p>>,
    pub(crate) tests: Vec<Vec<&'p Expr>>,
}

impl<'p> Plan<'p> {
    pub(crate) fn new(graph: &Snapshot, pattern: &'p Match, row: &[Cell]) -> Self {
        let steps = steps(graph, pattern, row);
        let mut parts = Vec::new();
        if let Some(condition) = &pattern.condition {
            conjuncts(condition, &mut parts);
        }
        let mut tests = vec![Vec::new(); steps.len()];
        // A variable that no step sets has its value from before.
        let mut set_at: Vec<(usize, usize)> = Vec::new();
        for (at, step) in steps.iter().enumerate() {
            match step {
                Step::Start(start) => set_at.push((start.node.variable, at)),
                Step::Walk { way, to, .. } => {
                    set_at.extend([(way.edge.variable, at), (to.node.variable, at)]);
                }
            }
        }
        for part in parts {
            let mut variables = Vec::new();
            part.variables(&mut variables);
            let first = |variable: &usize| {
                let set = set_at.iter().find(|(known, _)| known == variable);
                set.map_or(0, |(_, at)| *at)
            };
            let at = variables.iter().map(first).max().unwrap_or(0);
            if let Some(tests) = tests.get_mut(at) {
                tests.push(part);
            }
        }
        Self { steps, tests }
    }
}

/// The parts of a condition all of which must hold.
fn conjuncts<'p>(condition: &'p Expr, parts: &mut Vec<&'p Expr>) {
    match condition {
        Expr::Binary(Operator::And, a, b) => {
            conjuncts(a, parts);
            conjuncts(b, parts);
        }
        part => parts.push(part),
    }
}

/// The value that the name of a node must have: by its pattern, or by the condition.
pub(crate) fn named<'p>(node: &'p NodePattern, condition: Option<&'p Expr>) -> Option<&'p Expr> {
    let written = node
        .properties
        .iter()
        .find(|(own, _)| own.name.text == "name");
    if let Some((_, value)) = written {
        return Some(value);
    }
    let mut parts = Vec::new();
    conjuncts(condition?, &mut parts);
    parts.into_iter().find_map(|part| {
        let Expr::Binary(Operator::Equal, a, b) = part else {
            return None;
        };
        let is_name = |expr: &Expr| match expr {
            Expr::Property(of, name) => {
                matches!(**of, Expr::Variable(slot) if slot == node.variable)
                    && name.name.text == "name"
            }
            _ => false,
        };
        let is_constant = |expr: &Expr| matches!(expr, Expr::Literal(_) | Expr::Parameter(_));
        match (&**a, &**b) {
            (a, b) if is_name(a) && is_constant(b) => Some(b),
            (a, b) if is_name(b) && is_constant(a) => Some(a),
            _ => None,
        }
    })
}

/// Whether a part of the condition is about a node alone.
fn is_chosen(variable: usize, condition: Option<&Expr>) -> bool {
    let mut parts = Vec::new();
    if let Some(condition) = condition {
        conjuncts(condition, &mut parts);
    }
    parts.into_iter().any(|part| {
        let mut variables = Vec::new();
        part.variables(&mut variables);
        !variables.is_empty() && variables.iter().all(|other| *other == variable)
    })
}

/// How good a node is to start from: less is better.
fn cost(graph: &Snapshot, node: &NodePattern, condition: Option<&Expr>) -> usize {
    if named(node, condition).is_some() {
        return 1;
    }
    let count = match &node.label {
        Some(label) => {
            let is_edge = !relations(graph, &label.text).is_empty();
            let edges = if is_edge { graph.edge_count() } else { 0 };
            instances(graph, &label.text) + edges
        }
        None => graph.node_count(),
    };
    let is_chosen = !node.properties.is_empty() || is_chosen(node.variable, condition);
    2 + if is_chosen { count / 8 } else { count }
}

/// How many nodes of a type, and of those that inherit from it, there are.
fn instances(graph: &Snapshot, label: &str) -> usize {
    let schema = graph.schema();
    let below = schema.entities.iter().map(|entity| entity.name.as_str());
    let below = below.filter(|name| *name != label && schema.is_a(name, label));
    [label]
        .into_iter()
        .chain(below)
        .map(|name| graph.count_of_type(name))
        .sum()
}

/// The relations whose edges are nodes of a type to others.
pub(crate) fn relations(graph: &Snapshot, label: &str) -> Vec<Symbol> {
    let schema = graph.schema();
    let is_a = |relation: &&Relation| schema.is_a(&relation.name, label);
    let relations = schema.relations.iter().filter(is_a);
    relations
        .filter_map(|relation| graph.symbol(&relation.name))
        .collect()
}

fn steps<'p>(graph: &Snapshot, pattern: &'p Match, row: &[Cell]) -> Vec<Step<'p>> {
    let condition = pattern.condition.as_ref();
    let mut steps = Vec::new();
    // An edge is found where others start or end, or by its type. A lone node without a type comes
    // last, so that the order in which a pattern is written decides nothing.
    let is_lone = |chain: &&Chain| {
        chain.edges.is_empty() && chain.nodes.iter().all(|node| node.label.is_none())
    };
    let (lone, others): (Vec<_>, Vec<_>) = pattern
        .chains
        .iter()
        .partition(|chain| is_lone(chain) && graph.promoted().next().is_some());
    let is_null = |variable: usize| row.get(variable).is_none_or(|cell| *cell == Cell::Null);
    // What earlier chains have set.
    let mut known: HashSet<usize> = HashSet::new();
    for chain in others.into_iter().chain(lone) {
        let nodes = chain.nodes.iter().enumerate();
        let start = nodes.min_by_key(|(_, node)| {
            if known.contains(&node.variable) || !is_null(node.variable) {
                return 0;
            }
            cost(graph, node, condition)
        });
        let Some((start, node)) = start else { continue };
        steps.push(Step::Start(Place::new(graph, node)));
        for (at, edge) in chain.edges.iter().enumerate().skip(start) {
            steps.push(Step::Walk {
                way: Way::new(graph, edge),
                from: chain.nodes[at].variable,
                to: Place::new(graph, &chain.nodes[at + 1]),
                turned: false,
            });
        }
        for (at, edge) in chain.edges.iter().enumerate().take(start).rev() {
            steps.push(Step::Walk {
                way: Way::new(graph, edge),
                from: chain.nodes[at + 1].variable,
                to: Place::new(graph, &chain.nodes[at]),
                turned: true,
            });
        }
        known.extend(chain.nodes.iter().map(|node| node.variable));
    }
    steps
}
