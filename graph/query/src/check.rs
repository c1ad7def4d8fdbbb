//! Compares a query with the schema before it runs.

use crate::ast::{Chain, Clause, Expr, Item, Name};
use crate::parse::Parsed;
use property_graph::Schema;
use rc_diagnostics::{Diagnostic, Diagnostics, foreign, nearest};
use std::collections::{HashMap, HashSet};

struct Checker<'a> {
    schema: &'a Schema,
    found: Diagnostics,
    /// Types of nodes by variable, where a pattern says them.
    nodes: HashMap<usize, String>,
    /// Relations by variable, where a pattern says exactly one.
    edges: HashMap<usize, String>,
    parameters: Option<&'a HashSet<String>>,
}

/// Findings: types and attributes that the schema does not have are errors in a strict domain and
/// warnings in an open one. Parameters are checked if they are known.
pub(crate) fn check(
    parsed: &Parsed,
    schema: &Schema,
    parameters: Option<&HashSet<String>>,
) -> Diagnostics {
    let mut checker = Checker {
        schema,
        found: Diagnostics::new(),
        nodes: HashMap::new(),
        edges: HashMap::new(),
        parameters,
    };
    for clause in &parsed.clauses {
        match clause {
            Clause::Match(pattern) => {
                for chain in &pattern.chains {
                    checker.chain(chain);
                }
                if let Some(condition) = &pattern.condition {
                    checker.expr(condition);
                }
            }
            Clause::Project(project) => {
                for item in &project.items {
                    checker.expr(&item.value);
                    checker.follow(item);
                }
                let order = project.order.iter().map(|(value, _)| value);
                let ends = project.skip.iter().chain(&project.limit);
                for value in order.chain(ends).chain(&project.condition) {
                    checker.expr(value);
                }
            }
        }
    }
    checker.found
}

impl Checker<'_> {
    /// A variable that is only named again keeps its type.
    fn follow(&mut self, item: &Item) {
        if let Expr::Variable(slot) = item.value {
            if let Some(kind) = self.nodes.get(&slot).cloned() {
                self.nodes.insert(item.variable, kind);
            }
            if let Some(kind) = self.edges.get(&slot).cloned() {
                self.edges.insert(item.variable, kind);
            }
        }
    }

    fn unknown(&mut self, code: &'static str, name: &Name, message: String, known: &[&str]) {
        let mut diagnostic = if self.schema.open {
            Diagnostic::warning(code, name.span, message)
        } else {
            Diagnostic::error(code, name.span, message)
        };
        if let Some(near) = nearest(&name.text, known.iter().copied()) {
            diagnostic = diagnostic.help(format!("did you mean `{near}`?"));
        }
        self.found.push(diagnostic);
    }

    fn chain(&mut self, chain: &Chain) {
        let schema = self.schema;
        for node in &chain.nodes {
            if let Some(label) = &node.label {
                let is_relation = schema.relation(&label.text).is_some();
                if schema.entity(&label.text).is_some() || is_relation {
                    self.nodes.insert(node.variable, label.text.clone());
                } else if !schema.entities.is_empty() {
                    let known: Vec<&str> = schema.entities.iter().map(|e| &*e.name).collect();
                    let name = foreign::clean(&label.text);
                    let message = format!("the schema has no entity `{name}`");
                    self.unknown("unknown-type", label, message, &known);
                }
            }
            for (name, value) in &node.properties {
                self.attribute(node.variable, &name.name);
                self.expr(value);
            }
        }
        for edge in &chain.edges {
            for kind in &edge.types {
                if schema.relation(&kind.text).is_none() && !schema.relations.is_empty() {
                    let known: Vec<&str> = schema.relations.iter().map(|r| &*r.name).collect();
                    let name = foreign::clean(&kind.text);
                    let message = format!("the schema has no relation `{name}`");
                    self.unknown("unknown-type", kind, message, &known);
                }
            }
            if let [kind] = edge.types.as_slice()
                && schema.relation(&kind.text).is_some()
            {
                self.edges.insert(edge.variable, kind.text.clone());
            }
            for (name, value) in &edge.properties {
                self.attribute(edge.variable, &name.name);
                self.expr(value);
            }
        }
    }

    fn attribute(&mut self, variable: usize, name: &Name) {
        let schema = self.schema;
        let kind = self.nodes.get(&variable).or(self.edges.get(&variable));
        let Some(kind) = kind.cloned() else { return };
        let entity = schema.entity(&kind).map(|e| &e.attributes);
        let attributes = entity.or_else(|| schema.relation(&kind).map(|r| &r.attributes));
        let Some(attributes) = attributes else { return };
        // A node that is found by its type may be of one that inherits from it.
        let below = schema
            .entities
            .iter()
            .filter(|e| schema.is_a(&e.name, &kind));
        // So may an edge that is a node of the type to others.
        let edges = schema
            .relations
            .iter()
            .filter(|r| schema.is_a(&r.name, &kind));
        let below = below.flat_map(|e| &e.attributes);
        let mut all = below
            .chain(edges.flat_map(|r| &r.attributes))
            .chain(attributes);
        if all.all(|attribute| attribute.name != name.text) {
            let known: Vec<&str> = attributes.iter().map(|a| &*a.name).collect();
            let shown = foreign::clean(&name.text);
            let message = format!("`{kind}` has no attribute `{shown}`");
            self.unknown("unknown-attribute", name, message, &known);
        }
    }

    fn expr(&mut self, expr: &Expr) {
        match expr {
            Expr::Literal(_) | Expr::Variable(_) | Expr::Aggregate(_, _, None) => {}
            Expr::Parameter(name) => {
                if self
                    .parameters
                    .is_some_and(|known| !known.contains(&name.text))
                {
                    let message = format!("unknown parameter `${}`", foreign::clean(&name.text));
                    let known = self.parameters.into_iter().flatten().map(String::as_str);
                    let diagnostic = Diagnostic::error("unknown-parameter", name.span, message);
                    self.found.push(diagnostic.suggest(&name.text, known));
                }
            }
            Expr::Property(of, name) => {
                if let Expr::Variable(slot) = **of {
                    self.attribute(slot, &name.name);
                }
                self.expr(of);
            }
            Expr::Not(a)
            | Expr::Negate(a)
            | Expr::IsNull(a, _)
            | Expr::Aggregate(_, _, Some(a)) => self.expr(a),
            Expr::Index(a, b) | Expr::Binary(_, a, b) => {
                self.expr(a);
                self.expr(b);
            }
            Expr::List(all) | Expr::Call(_, all) => all.iter().for_each(|a| self.expr(a)),
        }
    }
}
