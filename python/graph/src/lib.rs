//! Property graphs for Python: the extension module `robocomp._graph`.
//!
//! It is a library of its own, because most programs in Python ask no graph.

mod element_methods;
mod elements;
mod steps;
mod values;
mod walk;
mod world;

use elements::Node;
use graph_exchange::{Document, dsr};
use graph_query::{Budget, Cell, Mark, Queries, Query, Rows, Traverser};
use property_graph::schema::Schema;
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The module `robocomp._graph`.
#[pymodule]
mod _graph {
    #[pymodule_export]
    use super::elements::{Edge, Node};
    #[pymodule_export]
    use super::world::World;
    #[pymodule_export]
    use super::{Graph, Snapshot};
}

/// Renders diagnostics, one a line.
fn told(sources: &SourceMap, found: &Diagnostics) -> String {
    render(sources, found, Format::Short).trim_end().to_owned()
}

fn budget(steps: u64, rows: u64) -> Budget {
    Budget::new(steps, usize::try_from(rows).unwrap_or(usize::MAX))
}

fn refused(error: &impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A graph of a file.
#[pyclass(frozen, module = "robocomp._graph")]
struct Graph {
    inner: property_graph::Graph,
    schema: Arc<Schema>,
    queries: Arc<Queries>,
}

impl Graph {
    fn of(file: &Path, include: &[PathBuf]) -> PyResult<(Self, Vec<String>)> {
        let mut sources = SourceMap::new();
        let mut found = Diagnostics::new();
        let loader = FileLoader::new(include);
        let loaded = rcgen::graphs::load(file, &mut sources, &loader, &mut found);
        let loaded = loaded.map_err(|error| {
            // Python raises the class of this kind, for instance `FileNotFoundError`.
            std::io::Error::new(error.kind(), format!("{}: {error}", file.display()))
        })?;
        let told = told(&sources, &found);
        let loaded = loaded.filter(|_| !found.has_errors());
        let loaded = loaded.ok_or_else(|| PyValueError::new_err(told.clone()))?;
        let graph = loaded.document.kept(&loaded.schema, 1);
        let graph = graph.map_err(|error| refused(&error))?;
        let schema = Arc::new(loaded.schema);
        let queries = Arc::new(Queries::of(&schema));
        let made = Self {
            inner: graph,
            schema,
            queries,
        };
        Ok((made, told.lines().map(str::to_owned).collect()))
    }
}

#[pymethods]
impl Graph {
    /// Reads a `.graph` file, the JSON of DSR, or the robot of a `.urdf` file. Its schema is looked for in its folder and in the
    /// folders `include`. Returns the graph, and warnings about the file.
    #[staticmethod]
    fn read(py: Python<'_>, file: PathBuf, include: Vec<PathBuf>) -> PyResult<(Self, Vec<String>)> {
        py.detach(move || Self::of(&file, &include))
    }

    /// The present version.
    fn snapshot(&self) -> Snapshot {
        Snapshot {
            now: self.inner.snapshot(),
            schema: Arc::clone(&self.schema),
            queries: Arc::clone(&self.queries),
        }
    }
}

/// A version of a graph, which never changes.
#[pyclass(frozen, module = "robocomp._graph")]
struct Snapshot {
    now: Arc<property_graph::Snapshot>,
    schema: Arc<Schema>,
    queries: Arc<Queries>,
}

/// Names of columns, and rows.
type Table<'py> = (
    Vec<String>,
    Vec<Option<String>>,
    Vec<Vec<Bound<'py, PyAny>>>,
);

impl Snapshot {
    fn node_of(&self, id: property_graph::NodeId) -> Node {
        Node {
            now: Arc::clone(&self.now),
            id,
        }
    }

    fn cells(
        &self,
        parameters: HashMap<String, Bound<'_, PyAny>>,
    ) -> PyResult<HashMap<String, Cell>> {
        let cells = parameters.into_iter().map(|(name, value)| {
            let cell = values::cell(&value, &self.now)?;
            Ok((name, cell))
        });
        cells.collect()
    }

    fn steps(
        &self,
        py: Python<'_>,
        starts: Vec<PyRef<'_, Node>>,
        steps: Vec<walk::Words<'_>>,
        most: u64,
        found: impl FnMut(Traverser) -> PyResult<()> + Send,
    ) -> PyResult<()> {
        let starts = starts.into_iter().map(|node| node.id_in(&self.now));
        let starts = starts.collect::<PyResult<Vec<_>>>()?;
        let steps = steps.into_iter();
        let steps = steps.map(|words| walk::Step::of(words, &self.now, &self.schema));
        let steps = steps.collect::<PyResult<Vec<_>>>()?;
        walk::walk(py, &self.now, starts, &steps, most, found)
    }

    fn table<'py>(&self, py: Python<'py>, rows: Rows) -> PyResult<Table<'py>> {
        let cells = rows.cells.iter().map(|row| {
            let row = row.iter().map(|cell| values::of_cell(py, cell, &self.now));
            row.collect()
        });
        Ok((rows.columns, rows.units, cells.collect::<PyResult<_>>()?))
    }
}

#[pymethods]
impl Snapshot {
    /// The number of this version.
    #[getter]
    fn version(&self) -> u64 {
        self.now.version()
    }

    fn __len__(&self) -> usize {
        self.now.node_count()
    }

    /// All nodes, or those of a type and of all that inherit from it.
    #[pyo3(signature = (kind=None))]
    fn nodes(&self, kind: Option<&str>) -> Vec<Node> {
        let all = || self.now.nodes().map(|node| node.node_id()).collect();
        let nodes: Vec<_> = kind.map_or_else(all, |kind| self.now.instances(kind).collect());
        nodes.into_iter().map(|node| self.node_of(node)).collect()
    }

    /// The only node with a name.
    fn node(&self, name: &str) -> PyResult<Node> {
        let mut named = self.now.named(name);
        match (named.next(), named.next()) {
            (Some(node), None) => Ok(self.node_of(node)),
            (None, _) => Err(PyKeyError::new_err(format!(
                "no node has the name {name:?}"
            ))),
            _ => Err(PyKeyError::new_err(format!(
                "several nodes have the name {name:?}"
            ))),
        }
    }

    /// The node with an id, as of `Node.id`.
    fn find(&self, id: &str) -> Option<Node> {
        let (writer, count) = id.split_once(':')?;
        let id = property_graph::Id::new(writer.parse().ok()?, count.parse().ok()?);
        self.now.find_node(id).map(|node| self.node_of(node))
    }

    /// All edges, or those of a relation, from a node, to a node.
    fn edges(
        &self,
        kind: Option<&str>,
        start: Option<PyRef<'_, Node>>,
        end: Option<PyRef<'_, Node>>,
    ) -> PyResult<Vec<elements::Edge>> {
        let place =
            |node: Option<PyRef<'_, Node>>| node.map(|node| node.id_in(&self.now)).transpose();
        let (start, end) = (place(start)?, place(end)?);
        let is_wanted = |edge: &property_graph::EdgeRef<'_>| {
            kind.is_none_or(|kind| edge.type_name() == kind)
                && start.is_none_or(|start| edge.from() == start)
                && end.is_none_or(|end| edge.to() == end)
        };
        let of = |edge: property_graph::EdgeRef<'_>| elements::Edge {
            now: Arc::clone(&self.now),
            id: edge.edge_id(),
        };
        Ok(match (start, end) {
            (Some(start), _) => self
                .now
                .out_edges(start, None)
                .filter(is_wanted)
                .map(of)
                .collect(),
            (None, Some(end)) => self
                .now
                .in_edges(end, None)
                .filter(is_wanted)
                .map(of)
                .collect(),
            (None, None) => self.now.edges().filter(is_wanted).map(of).collect(),
        })
    }

    /// The rows of a query in openCypher.
    fn query<'py>(
        &self,
        py: Python<'py>,
        text: &str,
        parameters: HashMap<String, Bound<'py, PyAny>>,
        #[pyo3(from_py_with = values::budget)] steps: u64,
        #[pyo3(from_py_with = values::budget)] rows: u64,
    ) -> PyResult<Table<'py>> {
        let parameters = self.cells(parameters)?;
        let mut sources = SourceMap::new();
        let source = sources.add("query", text);
        let known: HashSet<String> = parameters.keys().cloned().collect();
        let (query, found) = Query::with_parameters(&sources, source, &self.schema, &known);
        let query = query.ok_or_else(|| PyValueError::new_err(told(&sources, &found)))?;
        let found = py.detach(|| query.run(&self.now, &parameters, budget(steps, rows)));
        self.table(py, found.map_err(|error| refused(&error))?)
    }

    /// The rows of a query that the schema names.
    fn run<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        parameters: HashMap<String, Bound<'py, PyAny>>,
        #[pyo3(from_py_with = values::budget)] steps: u64,
        #[pyo3(from_py_with = values::budget)] rows: u64,
    ) -> PyResult<Table<'py>> {
        let parameters = self.cells(parameters)?;
        let found = py.detach(|| {
            let parameters = parameters
                .iter()
                .map(|(name, cell)| (name.as_str(), cell.clone()));
            self.queries
                .run(&self.now, name, parameters, budget(steps, rows))
        });
        self.table(py, found.map_err(|error| refused(&error))?)
    }

    /// Writes a file of DSR, without these attributes. Returns what such a file does not have.
    #[expect(
        clippy::needless_pass_by_value,
        reason = "a list in Python is not a slice"
    )]
    fn write_dsr(&self, file: PathBuf, skip: Vec<String>) -> PyResult<Vec<String>> {
        let mut document = Document::of(&self.now);
        let nodes = document.nodes.iter_mut().map(|node| &mut node.attributes);
        let edges = document.edges.iter_mut().map(|edge| &mut edge.attributes);
        for attributes in nodes.chain(edges) {
            // The name of a node is none of its attributes in DSR.
            attributes.retain(|(name, ..)| name == "name" || !skip.contains(name));
        }
        let (text, lost) = dsr::write(&document);
        rc_files::write(&file, text)?;
        Ok(lost)
    }

    /// The names of the queries of the schema.
    fn queries(&self) -> Vec<&str> {
        let queries = self.schema.queries.iter();
        queries.map(|query| query.name.as_str()).collect()
    }

    /// The pose of a node in the frame of another one: x, y, z and the angles about x, y, z.
    fn pose(&self, frame: &Node, node: &Node) -> PyResult<(f64, f64, f64, f64, f64, f64)> {
        let (frame, node) = (frame.id_in(&self.now)?, node.id_in(&self.now)?);
        let pose = self.now.pose(frame, node);
        let pose = pose.map_err(|error| refused(&error))?;
        let ([x, y, z], [rx, ry, rz]) = (pose.translation, pose.rotation);
        Ok((x, y, z, rx, ry, rz))
    }

    /// Where steps lead from nodes, at most `rows` times: the last node, and the nodes of the first
    /// `marks` marks.
    fn walk(
        &self,
        py: Python<'_>,
        starts: Vec<PyRef<'_, Node>>,
        steps: Vec<walk::Words<'_>>,
        marks: usize,
        #[pyo3(from_py_with = values::budget)] most: u64,
        #[pyo3(from_py_with = values::budget)] rows: u64,
    ) -> PyResult<Vec<(Node, Vec<Option<Node>>)>> {
        let mut found = Vec::new();
        self.steps(py, starts, steps, most, |traverser| {
            if found.len() as u64 == rows {
                let message = format!("the traversal makes more than {rows} rows");
                return Err(PyValueError::new_err(message));
            }
            found.push(traverser);
            Ok(())
        })?;
        let rows = found.into_iter().map(|traverser| {
            let marked = (0..marks).map(|at| traverser.marked(Mark(at)));
            let marked = marked.map(|node| Some(self.node_of(node?)));
            (self.node_of(traverser.node), marked.collect())
        });
        Ok(rows.collect())
    }

    /// The number of paths by which steps lead from nodes to a node.
    fn count(
        &self,
        py: Python<'_>,
        starts: Vec<PyRef<'_, Node>>,
        steps: Vec<walk::Words<'_>>,
        #[pyo3(from_py_with = values::budget)] most: u64,
    ) -> PyResult<u64> {
        let mut count = 0;
        self.steps(py, starts, steps, most, |_| {
            count += 1;
            Ok(())
        })?;
        Ok(count)
    }
}
