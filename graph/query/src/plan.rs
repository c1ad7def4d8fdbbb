//! The order in which a pattern is found, and where the parts of its condition are tested.

use crate::ast::{Chain, Direction, EdgePattern, Expr, Item, Match, NodePattern, Operator, Part};
use crate::eval::Scope;
use property_graph::Symbol;

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
    fn new(scope: &Scope<'_>, node: &'p NodePattern) -> Self {
        let label = match &node.label {
            Some(label) => scope.symbol(label).map_or(Label::Nothing, Label::Of),
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
    /// Whether edges are followed from their start, and from their end.
    pub(crate) directions: [bool; 2],
}

impl<'p> Way<'p> {
    fn new(scope: &Scope<'_>, edge: &'p EdgePattern, is_turned: bool) -> Self {
        let (relation, relations) = match edge.types.as_slice() {
            [] => (None, None),
            [one] => match scope.symbol(one) {
                Some(one) => (Some(one), None),
                None => (None, Some(Vec::new())),
            },
            all => {
                let known = all.iter().filter_map(|kind| scope.symbol(kind));
                (None, Some(known.collect()))
            }
        };
        let forth = match edge.direction {
            Direction::Out => !is_turned,
            Direction::In => is_turned,
            Direction::Both => true,
        };
        Self {
            edge,
            relation,
            relations,
            directions: [forth, edge.direction == Direction::Both || !forth],
        }
    }
}

/// One step of finding a pattern.
pub(crate) enum Step<'p> {
    /// The first node of a chain, with the value that its name must have.
    Start(Place<'p>, Option<&'p Expr>),
    /// An edge from a node that is known, to the other node.
    Walk {
        way: Way<'p>,
        from: usize,
        to: Place<'p>,
        /// Whether the pattern is walked against the order in which it is written.
        turned: bool,
    },
}

/// Steps, and the parts of the condition after each of them.
pub(crate) struct Plan<'p> {
    pub(crate) steps: Vec<Step<'p>>,
    pub(crate) tests: Vec<Vec<&'p Expr>>,
    /// Whether what follows the last step depends on its edge and its two nodes alone.
    pub(crate) is_shared: bool,
}

impl<'p> Plan<'p> {
    /// The plan for a pattern whose earlier variables have values.
    pub(crate) fn new(scope: &Scope<'_>, pattern: &'p Match) -> Self {
        let steps = steps(scope, pattern);
        let mut tests = vec![Vec::new(); steps.len()];
        for part in &pattern.parts {
            // A variable that no step sets has its value from before.
            let first = |variable: &usize| {
                let sets = |step: &Step<'_>| match step {
                    Step::Start(start, _) => start.node.variable == *variable,
                    Step::Walk { way, to, .. } => {
                        way.edge.variable == *variable || to.node.variable == *variable
                    }
                };
                steps.iter().position(sets)
            };
            let at = part.variables.iter().filter_map(first).max().unwrap_or(0);
            if let Some(tests) = tests.get_mut(at) {
                tests.push(&part.value);
            }
        }
        Self {
            steps,
            tests,
            is_shared: false,
        }
    }

    /// Notes that only these expressions follow, and that equal rows need not be distinguished.
    pub(crate) fn share(&mut self, pattern: &Match, follow: &'p [Item]) {
        let Some((Step::Walk { way, from, to, .. }, before)) = self.steps.split_last() else {
            return;
        };
        let own = [*from, way.edge.variable, to.node.variable];
        let set = before.iter().flat_map(|step| match step {
            Step::Start(start, _) => [start.node.variable; 2],
            Step::Walk { way, to, .. } => [way.edge.variable, to.node.variable],
        });
        let set: Vec<usize> = set.collect();
        let is_known = |variable: &usize| {
            set.contains(variable) || pattern.earlier.contains(variable) || variable == from
        };
        if way.edge.length.is_some() || set.len() < 3 || own[1..].iter().any(is_known) {
            return;
        }
        let mut variables = Vec::new();
        let items = follow.iter().map(|item| &item.value);
        let written = way.edge.properties.iter().chain(&to.node.properties);
        let tests = self.tests.last().into_iter().flatten().copied();
        for expr in items.chain(written.map(|(_, value)| value)).chain(tests) {
            expr.variables(&mut variables);
        }
        self.is_shared = variables
            .iter()
            .all(|at| own.contains(at) || !set.contains(at));
    }
}

/// The value that the name of a node must have: by its pattern, or by the condition.
fn named<'p>(node: &'p NodePattern, parts: &'p [Part]) -> Option<&'p Expr> {
    let written = node
        .properties
        .iter()
        .find(|(own, _)| own.name.text == "name");
    if let Some((_, value)) = written {
        return Some(value);
    }
    parts.iter().find_map(|part| {
        let Expr::Binary(Operator::Equal, a, b) = &part.value else {
            return None;
        };
        let is_name = |expr: &Expr| match expr {
            Expr::Property(of, name) => {
                matches!(**of, Expr::Variable(slot) if slot == node.variable)
                    && name.name.text == "name"
            }
            _ => false,
        };
        let is_constant = |expr: &Expr| matches!(expr, Expr::Literal(_) | Expr::Parameter(..));
        match (&**a, &**b) {
            (a, b) if is_name(a) && is_constant(b) => Some(b),
            (a, b) if is_name(b) && is_constant(a) => Some(a),
            _ => None,
        }
    })
}

/// Whether a part of the condition is about a node alone.
fn is_chosen(variable: usize, parts: &[Part]) -> bool {
    parts.iter().any(|part| {
        let mut variables = part.variables.iter();
        !part.variables.is_empty() && variables.all(|other| *other == variable)
    })
}

/// How many nodes a pattern may start with: less is better.
fn cost(scope: &Scope<'_>, node: &NodePattern, parts: &[Part]) -> usize {
    let graph = scope.graph;
    let count = match &node.label {
        Some(label) => scope.symbol(label).map_or(0, |label| {
            let is_edge = graph.relations_as(label).next().is_some();
            let edges = if is_edge { graph.edge_count() } else { 0 };
            graph.count_of_instances(label) + edges
        }),
        None => graph.node_count(),
    };
    let is_chosen = !node.properties.is_empty() || is_chosen(node.variable, parts);
    if is_chosen { count / 8 } else { count }
}

/// The node of a chain to start from: one that is known, one whose name is, or one of the fewest.
fn best(
    scope: &Scope<'_>,
    chain: &Chain,
    parts: &[Part],
    is_known: impl Fn(usize) -> bool,
) -> Option<usize> {
    let nodes = &chain.nodes;
    let known = nodes.iter().position(|node| is_known(node.variable));
    let named = || nodes.iter().position(|node| named(node, parts).is_some());
    known.or_else(named).or_else(|| {
        let all = nodes.iter().enumerate();
        let best = all.min_by_key(|(_, node)| cost(scope, node, parts));
        best.map(|(at, _)| at)
    })
}

fn steps<'p>(scope: &Scope<'_>, pattern: &'p Match) -> Vec<Step<'p>> {
    let (graph, parts) = (scope.graph, pattern.parts.as_slice());
    let mut steps = Vec::with_capacity(pattern.chains.iter().map(|c| c.nodes.len()).sum());
    // An edge is found where others start or end, or by its type. A lone node without a type comes
    // last, so that the written order of a pattern makes no difference.
    let is_lone = |chain: &&Chain| {
        chain.edges.is_empty() && chain.nodes.iter().all(|node| node.label.is_none())
    };
    let has_promoted = pattern.chains.len() > 1 && graph.promoted().next().is_some();
    let is_last = |chain: &&Chain| has_promoted && is_lone(chain);
    let first = pattern.chains.iter().filter(|chain| !is_last(chain));
    let last = pattern.chains.iter().filter(is_last);
    for chain in first.chain(last) {
        // The nodes that are known: those of earlier clauses, then those of earlier chains.
        let is_known = |variable| {
            let mut before = steps.iter();
            pattern.earlier.contains(&variable)
                || before.any(|step| match step {
                    Step::Start(start, _) => start.node.variable == variable,
                    Step::Walk { to, .. } => to.node.variable == variable,
                })
        };
        let Some(start) = best(scope, chain, parts, is_known) else {
            continue;
        };
        let node = &chain.nodes[start];
        steps.push(Step::Start(Place::new(scope, node), named(node, parts)));
        for (at, edge) in chain.edges.iter().enumerate().skip(start) {
            steps.push(Step::Walk {
                way: Way::new(scope, edge, false),
                from: chain.nodes[at].variable,
                to: Place::new(scope, &chain.nodes[at + 1]),
                turned: false,
            });
        }
        for (at, edge) in chain.edges.iter().enumerate().take(start).rev() {
            steps.push(Step::Walk {
                way: Way::new(scope, edge, true),
                from: chain.nodes[at + 1].variable,
                to: Place::new(scope, &chain.nodes[at]),
                turned: true,
            });
        }
    }
    steps
}
