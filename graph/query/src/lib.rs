//! Queries of a property graph.
//!
//! [`Query`] is a text in a read-only subset of openCypher, checked against a schema before it runs,
//! within a [`Budget`]. [`Queries`] are those that a schema names. [`traverse`] starts a typed traversal with Gremlin's words.
//!
//! ```
//! use graph_query::{Budget, Query};
//! use property_graph::{Error, Graph, Schema, Time};
//! use rc_diagnostics::SourceMap;
//!
//! let graph = Graph::new(Schema::anything().into(), 1);
//! graph.change(Time::ZERO, |edit| {
//!     let ada = edit.add_node("person")?;
//!     edit.set(ada, "name", "Ada")?;
//!     let kitchen = edit.add_node("room")?;
//!     edit.set(kitchen, "name", "kitchen")?;
//!     edit.add_edge("in", ada, kitchen)
//! })?;
//! let now = graph.snapshot();
//! let mut sources = SourceMap::new();
//! let text = "MATCH (p:person)-[:in]->(r) WHERE r.name = $room RETURN p.name";
//! let source = sources.add("query", text);
//! let (query, found) = Query::prepare(&sources, source, now.schema());
//! assert!(found.is_empty());
//! let query = query.expect("a query");
//! let parameters = [("room".to_owned(), "kitchen".into())].into();
//! let rows = query.run(&now, &parameters, Budget::default()).expect("rows");
//! assert_eq!(rows.cells, [["Ada".into()]]);
//! # Ok::<(), Error>(())
//! ```

mod ast;
mod budget;
mod cell;
mod check;
mod eval;
mod groups;
mod lexer;
mod matching;
mod measured;
mod named;
mod parse;
mod plan;
mod stages;
mod traversal;
mod units;

pub use budget::{Budget, Error};
pub use cell::Cell;
pub use named::Queries;
pub use traversal::{Mark, Traversal, Traverser, traverse};

pub use property_graph::Snapshot;

use eval::Scope;
use property_graph::Schema;
use rc_diagnostics::{Diagnostics, SourceId, SourceMap};
use std::collections::{HashMap, HashSet};

/// The longest text of a query, in bytes.
pub const LONGEST_QUERY: usize = 64 * 1024;

/// A query that was read and checked.
#[derive(Clone, Debug)]
pub struct Query {
    parsed: parse::Parsed,
    columns: Vec<String>,
    units: Vec<Option<String>>,
}

/// The result of a query.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Units of their numbers, as far as the schema and the query say them.
    pub units: Vec<Option<String>>,
    /// The rows.
    pub cells: Vec<Vec<Cell>>,
}

impl Query {
    /// Reads a text, and compares it with the schema. `None` if it cannot be read, or if a strict
    /// schema lacks a name in it.
    pub fn prepare(
        sources: &SourceMap,
        source: SourceId,
        schema: &Schema,
    ) -> (Option<Self>, Diagnostics) {
        Self::prepared(sources, source, schema, None)
    }

    /// Prepares a query that has these parameters and no others.
    pub fn with_parameters(
        sources: &SourceMap,
        source: SourceId,
        schema: &Schema,
        parameters: &HashSet<String>,
    ) -> (Option<Self>, Diagnostics) {
        Self::prepared(sources, source, schema, Some(parameters))
    }

    fn prepared(
        sources: &SourceMap,
        source: SourceId,
        schema: &Schema,
        parameters: Option<&HashSet<String>>,
    ) -> (Option<Self>, Diagnostics) {
        let mut found = Diagnostics::new();
        let text = sources.text(source);
        if text.len() > LONGEST_QUERY {
            let span = rc_diagnostics::Span::new(source, 0, 0);
            let message = format!("a query has at most {LONGEST_QUERY} bytes");
            found.push(rc_diagnostics::Diagnostic::error(
                "query-syntax",
                span,
                message,
            ));
            return (None, found);
        }
        let mut parsed = match parse::parse(text, source) {
            Ok(parsed) => parsed,
            Err(error) => {
                found.push(error);
                return (None, found);
            }
        };
        let (findings, units) = check::check(&mut parsed, schema, parameters);
        found.extend(findings);
        let columns = match parsed.clauses.last() {
            Some(ast::Clause::Project(last)) => {
                last.items.iter().map(|item| item.name.clone()).collect()
            }
            _ => Vec::new(),
        };
        let query = (!found.has_errors()).then_some(Self {
            parsed,
            columns,
            units,
        });
        (query, found)
    }

    /// The rows of the query in a version of a graph.
    pub fn run(
        &self,
        graph: &Snapshot,
        parameters: &HashMap<String, Cell>,
        mut budget: Budget,
    ) -> Result<Rows, Error> {
        let names = self.parsed.names.iter();
        let values = self.parsed.parameters.iter();
        let scope = Scope {
            graph,
            parameters: values.map(|name| parameters.get(name)).collect(),
            symbols: names.map(|name| graph.symbol(name)).collect(),
            walk: budget.steps.into(),
        };
        let cells = stages::run(&self.parsed, &scope, &mut budget).map_err(|error| *error)?;
        Ok(Rows {
            columns: self.columns.clone(),
            units: self.units.clone(),
            cells,
        })
    }
}
