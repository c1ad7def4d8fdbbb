//! Compares a query with the schema before it runs.

use crate::ast::{Aggregate, Chain, Clause, Expr, Function, Item, Name, Operator, SchemaName};
use crate::cell::Cell;
use crate::measured::Measured;
use crate::parse::Parsed;
use property_graph::Schema;
use rc_diagnostics::{Diagnostic, Diagnostics, foreign, nearest};
use std::collections::{HashMap, HashSet};

pub(crate) struct Checker<'a> {
    pub(crate) schema: &'a Schema,
    pub(crate) found: Diagnostics,
    /// Types of nodes by variable, where a pattern says them.
    pub(crate) nodes: HashMap<usize, String>,
    /// Relations by variable, where a pattern says exactly one.
    pub(crate) edges: HashMap<usize, String>,
    /// Units of variables that are numbers.
    units: HashMap<usize, Measured>,
    parameters: Option<&'a HashSet<String>>,
}

/// Findings: types and attributes that the schema does not have are errors in a strict domain and
/// warnings in an open one; numbers of different units are errors in both. Parameters are checked if
/// they are known. Also returns the units of the columns, and sets the conversions in the query.
pub(crate) fn check(
    parsed: &mut Parsed,
    schema: &Schema,
    parameters: Option<&HashSet<String>>,
) -> (Diagnostics, Vec<Option<String>>) {
    let mut checker = Checker {
        schema,
        found: Diagnostics::new(),
        nodes: HashMap::new(),
        edges: HashMap::new(),
        units: HashMap::new(),
        parameters,
    };
    let mut columns = Vec::new();
    for clause in &mut parsed.clauses {
        match clause {
            Clause::Match(pattern) => {
                for chain in &mut pattern.chains {
                    checker.chain(chain);
                }
                for part in &mut pattern.parts {
                    checker.expr(&mut part.value);
                }
            }
            Clause::Project(project) => {
                columns.clear();
                for item in &mut project.items {
                    let unit = checker.expr(&mut item.value);
                    columns.push(unit.as_ref().map(|measured| measured.unit.clone()));
                    checker.follow(item, unit);
                }
                let order = project.order.iter_mut().map(|(value, _)| value);
                let ends = project.skip.iter_mut().chain(&mut project.limit);
                for value in order.chain(ends).chain(&mut project.condition) {
                    checker.expr(value);
                }
            }
        }
    }
    (checker.found, columns)
}

impl Checker<'_> {
    /// A variable that is only named again keeps its type.
    fn follow(&mut self, item: &Item, unit: Option<Measured>) {
        self.units.extend(unit.map(|unit| (item.variable, unit)));
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

    fn chain(&mut self, chain: &mut Chain) {
        let schema = self.schema;
        for node in &mut chain.nodes {
            if let Some(SchemaName { name: label, .. }) = &node.label {
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
            for (name, value) in &mut node.properties {
                self.written(node.variable, &name.name, value);
            }
        }
        for edge in &mut chain.edges {
            for SchemaName { name: kind, .. } in &edge.types {
                if schema.relation(&kind.text).is_none() && !schema.relations.is_empty() {
                    let known: Vec<&str> = schema.relations.iter().map(|r| &*r.name).collect();
                    let name = foreign::clean(&kind.text);
                    let message = format!("the schema has no relation `{name}`");
                    self.unknown("unknown-type", kind, message, &known);
                }
            }
            if let [SchemaName { name: kind, .. }] = edge.types.as_slice()
                && schema.relation(&kind.text).is_some()
            {
                self.edges.insert(edge.variable, kind.text.clone());
            }
            for (name, value) in &mut edge.properties {
                self.written(edge.variable, &name.name, value);
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

    /// An attribute in a pattern, with the value that it must have.
    fn written(&mut self, variable: usize, name: &Name, value: &mut Expr) {
        self.attribute(variable, name);
        let own = self.unit_of(variable, name, None);
        let unit = self.expr(value);
        self.in_unit_of(own.as_ref(), value, unit.as_ref());
    }

    /// Several values, which have one unit.
    fn several(&mut self, all: &mut [Expr]) -> Option<Measured> {
        let mut known = None;
        for value in all {
            let own = self.expr(value);
            self.in_unit_of(known.as_ref(), value, own.as_ref());
            known = known.or(own);
        }
        known
    }

    /// Checks an expression, and returns the unit of its numbers.
    fn expr(&mut self, expr: &mut Expr) -> Option<Measured> {
        match expr {
            Expr::Literal(_) | Expr::Aggregate(_, _, None) => None,
            Expr::Variable(slot) => self.units.get(slot).cloned(),
            Expr::Parameter(name, _) => {
                if self
                    .parameters
                    .is_some_and(|known| !known.contains(&name.text))
                {
                    let message = format!("unknown parameter `${}`", foreign::clean(&name.text));
                    let known = self.parameters.into_iter().flatten().map(String::as_str);
                    let diagnostic = Diagnostic::error("unknown-parameter", name.span, message);
                    self.found.push(diagnostic.suggest(&name.text, known));
                }
                None
            }
            Expr::Property(of, name) => {
                self.expr(of);
                let Expr::Variable(slot) = **of else {
                    return None;
                };
                self.attribute(slot, &name.name);
                self.unit_of(slot, &name.name, None)
            }
            Expr::Not(a) | Expr::IsNull(a, _) => {
                self.expr(a);
                None
            }
            Expr::Negate(a) => self.expr(a),
            Expr::Aggregate(what, _, Some(a)) => {
                let unit = self.expr(a);
                unit.filter(|_| *what != Aggregate::Count)
            }
            Expr::InUnit(own) => {
                let inner = self.expr(&mut own.of);
                let (measured, factor) = self.stated(&own.unit, inner);
                own.factor = factor;
                Some(measured)
            }
            Expr::Index(a, b) => {
                let unit = self.expr(a);
                self.expr(b);
                if let Expr::Property(of, name) = &**a
                    && let (Expr::Variable(slot), Expr::Literal(Cell::Int(at))) = (&**of, &**b)
                {
                    let at = usize::try_from(*at).ok()?;
                    return self.unit_of(*slot, &name.name, Some(at));
                }
                unit
            }
            Expr::Binary(operator, a, b) => {
                let (one, other) = (self.expr(a), self.expr(b));
                match operator {
                    Operator::Add | Operator::Subtract | Operator::Modulo => {
                        self.same_unit((a, one), (b, other), true)
                    }
                    Operator::Multiply | Operator::Divide => Self::product(*operator, one, other),
                    Operator::Equal
                    | Operator::NotEqual
                    | Operator::Less
                    | Operator::LessOrEqual
                    | Operator::Greater
                    | Operator::GreaterOrEqual
                    | Operator::In => {
                        self.same_unit((a, one), (b, other), false);
                        None
                    }
                    Operator::Or
                    | Operator::Xor
                    | Operator::And
                    | Operator::StartsWith
                    | Operator::EndsWith
                    | Operator::Contains => None,
                }
            }
            Expr::List(all) | Expr::Call(Function::Coalesce, all) => self.several(all),
            Expr::Call(function, all) => {
                let units: Vec<_> = all.iter_mut().map(|a| self.expr(a)).collect();
                let is_number = *function == Function::Absolute;
                units.into_iter().next().flatten().filter(|_| is_number)
            }
        }
    }
}
