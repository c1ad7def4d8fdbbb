//! The queries of a schema as functions, with parameters that have types.

use crate::{Budget, Cell, Error, Query, Rows};
use property_graph::schema::{self, Schema};
use property_graph::{NodeId, Snapshot};
use rc_diagnostics::{Diagnostics, Format, Severity, SourceMap, foreign, nearest, render};
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// The queries of a schema, read and checked once. Each is a function from parameters to rows.
///
/// ```
/// use graph_query::{Budget, Error, Queries};
/// use property_graph::schema::{Entity, Query};
/// use property_graph::{Graph, Schema, Time};
///
/// // As a `.gdsl` file declares them; `graph_language::load` reads one.
/// let schema = Schema {
///     entities: vec![Entity { name: "Room".to_owned(), ..Entity::default() }],
///     queries: vec![Query {
///         name: "people_in".to_owned(),
///         parameters: vec![("room".to_owned(), "Room".to_owned())],
///         text: "MATCH (p:Person)-[:in]->(r) WHERE r = $room RETURN p.name".to_owned(),
///     }],
///     ..Schema::anything()
/// };
/// let graph = Graph::new(schema.into(), 1);
/// let kitchen = graph.change(Time::ZERO, |edit| {
///     let ada = edit.add_node("Person")?;
///     edit.set(ada, "name", "Ada")?;
///     let kitchen = edit.add_node("Room")?;
///     edit.add_edge("in", ada, kitchen)?;
///     Ok::<_, property_graph::Error>(kitchen)
/// })?;
/// let now = graph.snapshot();
/// let queries = Queries::of(now.schema());
/// let rows = queries.run(&now, "people_in", [("room", kitchen.into())], Budget::default())?;
/// assert_eq!(rows.cells, [["Ada".into()]]);
/// let refused = queries.run(&now, "people_in", [("room", 7.into())], Budget::default());
/// assert!(matches!(refused, Err(Error::Argument { .. })));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Queries {
    schema: Arc<Schema>,
    /// In the order of the schema's queries. One with a fault does not stop the others.
    prepared: Vec<Result<Query, Error>>,
}

impl Queries {
    /// Reads and checks the queries of a schema. One whose text has a fault fails when it is run;
    /// [`Queries::faults`] lists all of these.
    pub fn of(schema: &Arc<Schema>) -> Self {
        let prepared = schema.queries.iter().map(|query| prepared(query, schema));
        Self {
            schema: Arc::clone(schema),
            prepared: prepared.collect(),
        }
    }

    /// The queries that cannot be run, each with the error in its text.
    pub fn faults(&self) -> impl Iterator<Item = (&str, &Error)> {
        let names = self.schema.queries.iter().map(|query| query.name.as_str());
        let all = names.zip(&self.prepared);
        all.filter_map(|(name, prepared)| Some((name, prepared.as_ref().err()?)))
    }

    /// The rows of a query in a version of a graph. The query has a value for each of its parameters.
    ///
    /// # Errors
    /// The schema has no such query, its text has a fault, a parameter is unknown, has no value or one
    /// of another type, or the query fails.
    pub fn run<'p>(
        &self,
        graph: &Snapshot,
        name: &str,
        parameters: impl IntoIterator<Item = (&'p str, Cell)>,
        budget: Budget,
    ) -> Result<Rows, Error> {
        let (declared, query) = self.find(name)?;
        let query = query.as_ref().map_err(Clone::clone)?;
        let mut values = HashMap::new();
        for (parameter, value) in parameters {
            let kind = kind_of(declared, parameter)?;
            if !self.fits(graph, kind, &value) {
                return Err(Error::Argument {
                    parameter: parameter.to_owned(),
                    expected: described(kind),
                    found: value.shown(graph),
                });
            }
            let value = match (kind, value) {
                // A query divides integers without a rest.
                ("float" | "double", value) => as_float(value),
                ("pose", Cell::List(cells)) => {
                    Cell::List(cells.iter().cloned().map(as_float).collect())
                }
                (_, value) => value,
            };
            values.insert(parameter.to_owned(), value);
        }
        let mut all = declared.parameters.iter().map(|(parameter, _)| parameter);
        if let Some(missing) = all.find(|parameter| !values.contains_key(*parameter)) {
            return Err(Error::Parameter(missing.clone()));
        }
        query.run(graph, &values, budget)
    }

    /// The value of a parameter that somebody has written as a text: a node by its name, a pose as six
    /// numbers with commas.
    ///
    /// # Errors
    /// The schema has no such query, the query has no such parameter, or the text is not a value of
    /// its type.
    pub fn argument(
        &self,
        graph: &Snapshot,
        name: &str,
        parameter: &str,
        text: &str,
    ) -> Result<Cell, Error> {
        let (declared, _) = self.find(name)?;
        let kind = kind_of(declared, parameter)?;
        if self.schema.entity(kind).is_some() {
            return self.node(graph, kind, text).map(Cell::Node);
        }
        let value = match kind {
            "bool" => text.parse().ok().map(Cell::Bool),
            "int" | "long" => text.parse().ok().map(Cell::Int),
            "float" | "double" => text.parse().ok().map(Cell::Float),
            "string" => Some(text.into()),
            "pose" => {
                let numbers = text.split(',').map(|number| number.trim().parse());
                let numbers: Result<Vec<f64>, _> = numbers.collect();
                let cells = numbers.ok().map(|all| all.into_iter().map(Cell::Float));
                cells.map(|cells| Cell::List(cells.collect()))
            }
            _ => None,
        };
        let value = value.filter(|value| self.fits(graph, kind, value));
        value.ok_or_else(|| Error::Argument {
            parameter: parameter.to_owned(),
            expected: described(kind),
            found: foreign::clean(text),
        })
    }

    /// The only node of an entity with a name.
    fn node(&self, graph: &Snapshot, entity: &str, name: &str) -> Result<NodeId, Error> {
        let nodes: Vec<NodeId> = graph
            .named(name)
            .filter(|node| self.is_a(graph, *node, entity))
            .collect();
        match nodes.as_slice() {
            [node] => Ok(*node),
            _ => Err(Error::Named {
                entity: entity.to_owned(),
                name: foreign::clean(name),
                count: nodes.len(),
            }),
        }
    }

    fn is_a(&self, graph: &Snapshot, node: NodeId, entity: &str) -> bool {
        let node = graph.node(node);
        node.is_ok_and(|node| self.schema.is_a(node.type_name(), entity))
    }

    fn fits(&self, graph: &Snapshot, kind: &str, value: &Cell) -> bool {
        let is_number = |cell: &Cell| cell.number().is_some_and(f64::is_finite);
        match (kind, value) {
            // An entity may have the name of no type of attributes.
            ("bool", value) => matches!(value, Cell::Bool(_)),
            ("int" | "long", value) => matches!(value, Cell::Int(_)),
            ("float" | "double", value) => is_number(value),
            ("string", value) => matches!(value, Cell::Text(_)),
            ("bytes", value) => matches!(value, Cell::Bytes(_)),
            ("pose", Cell::List(cells)) => cells.len() == 6 && cells.iter().all(is_number),
            (entity, Cell::Node(node)) => self.is_a(graph, *node, entity),
            (entity, Cell::Edge(edge)) => {
                let edge = graph.edge(*edge);
                edge.is_ok_and(|edge| self.schema.is_a(edge.type_name(), entity))
            }
            _ => false,
        }
    }

    fn find(&self, name: &str) -> Result<(&schema::Query, &Result<Query, Error>), Error> {
        let mut all = self.schema.queries.iter().zip(&self.prepared);
        all.find(|(query, _)| query.name == name).ok_or_else(|| {
            let known = self.schema.queries.iter().map(|query| query.name.as_str());
            Error::UnknownQuery(foreign::clean(name), near(name, known))
        })
    }
}

fn prepared(query: &schema::Query, schema: &Schema) -> Result<Query, Error> {
    let mut sources = SourceMap::new();
    let source = sources.add(query.name.as_str(), query.text.as_str());
    let names = query.parameters.iter().map(|(name, _)| name.clone());
    let names: HashSet<String> = names.collect();
    let (prepared, found) = Query::with_parameters(&sources, source, schema, &names);
    prepared.ok_or_else(|| {
        let mut errors = found.into_iter().filter(|f| f.severity == Severity::Error);
        let mut first = Diagnostics::new();
        first.extend(errors.next());
        let finding = render(&sources, &first, Format::Short);
        Error::Text(finding.trim_end().to_owned())
    })
}

/// A number as a float, anything else as it is.
fn as_float(cell: Cell) -> Cell {
    cell.number().map_or(cell, Cell::Float)
}

/// The type of a parameter.
fn kind_of<'q>(query: &'q schema::Query, parameter: &str) -> Result<&'q str, Error> {
    let mut all = query.parameters.iter();
    let found = all.find(|(name, _)| name == parameter);
    found.map(|(_, kind)| kind.as_str()).ok_or_else(|| {
        let known = query.parameters.iter().map(|(name, _)| name.as_str());
        Error::UnknownParameter {
            query: query.name.clone(),
            parameter: foreign::clean(parameter),
            hint: near(parameter, known),
        }
    })
}

/// The values that a parameter of a type accepts.
fn described(kind: &str) -> String {
    match kind {
        "pose" => "a pose: x, y, z and the angles about x, y, z".to_owned(),
        "float" | "double" => "a number".to_owned(),
        "int" | "long" => "an integer".to_owned(),
        "bool" => "`true` or `false`".to_owned(),
        "string" => "a text".to_owned(),
        "bytes" => "bytes".to_owned(),
        entity => format!("a node of type `{entity}`"),
    }
}

/// `; did you mean …?`, or all names.
fn near<'n>(name: &str, known: impl Iterator<Item = &'n str> + Clone) -> String {
    if let Some(near) = nearest(name, known.clone()) {
        return format!("; did you mean `{near}`?");
    }
    let names: Vec<String> = known.map(|name| format!("`{name}`")).collect();
    if names.is_empty() {
        return "; it has none".to_owned();
    }
    format!("; it has {}", names.join(", "))
}
