//! Traversals whose steps Python says.

use crate::elements::Node;
use crate::values;
use graph_query::{Cell, Mark, Traversal, Traverser, traverse};
use property_graph::schema::Schema;
use property_graph::{NodeId, Snapshot};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rc_diagnostics::{foreign, nearest};
use std::cell::{Cell as Counter, OnceCell};
use std::sync::Arc;

/// A step in Python's form: its word, a relation, a type or an attribute, and a value, the number
/// of a mark, or a test of a node.
pub(crate) type Words<'py> = (String, String, Bound<'py, PyAny>);

/// A step of a traversal.
pub(crate) enum Step {
    Out(String),
    In(String),
    HasType(String),
    Has(String, Cell),
    As(Mark),
    WhereEq(Mark),
    Select(Mark),
    RepeatUntil(String, Py<PyAny>),
}

impl Step {
    /// Compares the names of a step with the schema.
    pub(crate) fn of(
        (word, name, value): Words<'_>,
        now: &Snapshot,
        schema: &Schema,
    ) -> PyResult<Self> {
        let relations = || schema.relations.iter();
        match word.as_str() {
            "out" | "in_" | "repeat_until" => {
                let known = relations().map(|relation| relation.name.as_str());
                known_in(schema, "relation", &name, known)?;
            }
            "has_type" => {
                // A node may represent an edge.
                let edges = relations().map(|relation| relation.name.as_str());
                let known = schema.entities.iter().map(|entity| entity.name.as_str());
                known_in(schema, "type", &name, known.chain(edges))?;
            }
            "has" => {
                let edges = relations().flat_map(|relation| &relation.attributes);
                let known = schema.entities.iter().flat_map(|entity| &entity.attributes);
                let known = known.chain(edges).map(|attribute| attribute.name.as_str());
                known_in(schema, "attribute", &name, known)?;
            }
            _ => {}
        }
        let mark = || value.extract().map(Mark);
        Ok(match word.as_str() {
            "out" => Self::Out(name),
            "in_" => Self::In(name),
            "has_type" => Self::HasType(name),
            "has" => Self::Has(name, values::cell(&value, now)?),
            "as_" => Self::As(mark()?),
            "where_eq" => Self::WhereEq(mark()?),
            "select" => Self::Select(mark()?),
            "repeat_until" => Self::RepeatUntil(name, value.unbind()),
            other => return Err(PyValueError::new_err(format!("unknown step `{other}`"))),
        })
    }
}

/// Refuses a name that a strict schema does not have.
fn known_in<'a>(
    schema: &Schema,
    what: &str,
    name: &str,
    known: impl Iterator<Item = &'a str> + Clone,
) -> PyResult<()> {
    if schema.open || known.clone().any(|known| known == name) {
        return Ok(());
    }
    let near =
        nearest(name, known).map_or_else(String::new, |near| format!("; did you mean `{near}`?"));
    let name = foreign::clean(name);
    let message = format!("the schema has no {what} `{name}`{near}");
    Err(PyValueError::new_err(message))
}

/// A traversal looks for signals, as that of Ctrl+C, once in so many steps.
const SIGNALS: u64 = 4096;

/// The rest of a traversal's budget.
struct Budget {
    most: u64,
    left: Counter<u64>,
    /// The first error of a traversal; once set, no traverser continues.
    error: OnceCell<PyErr>,
}

impl Budget {
    fn is_over(&self) -> bool {
        self.error.get().is_some()
    }

    fn fail(&self, error: PyErr) {
        self.error.get_or_init(|| error);
    }

    /// Takes a step. Returns whether the traversal continues.
    fn step(&self) -> bool {
        if let Some(left) = self.left.get().checked_sub(1) {
            self.left.set(left);
            if left.is_multiple_of(SIGNALS) {
                Python::attach(|py| {
                    if let Err(error) = py.check_signals() {
                        self.fail(error);
                    }
                });
            }
        } else {
            let most = self.most;
            let message = format!("the traversal takes more than {most} steps");
            self.fail(PyValueError::new_err(message));
        }
        !self.is_over()
    }
}

/// Takes steps from nodes, at most `most` of all traversers together, and passes each traverser that
/// arrives to `found`. Other threads of Python run meanwhile, unless a step calls a function of Python.
pub(crate) fn walk(
    py: Python<'_>,
    now: &Arc<Snapshot>,
    starts: Vec<NodeId>,
    steps: &[Step],
    most: u64,
    found: impl FnMut(Traverser) -> PyResult<()> + Send,
) -> PyResult<()> {
    let walk = || {
        let budget = Budget {
            most,
            left: Counter::new(most),
            error: OnceCell::new(),
        };
        let starts = starts.into_iter().take_while(|_| !budget.is_over());
        let mut traversal = traverse(now, starts).boxed();
        for step in steps {
            let stepped = take(now, traversal, step, &budget);
            traversal = stepped.filter(|_, _| budget.step()).boxed();
        }
        let ended = traversal.traversers().try_for_each(found);
        budget.error.into_inner().map_or(ended, Err)
    };
    let calls = |step: &Step| matches!(step, Step::RepeatUntil(..));
    if steps.iter().any(calls) {
        walk()
    } else {
        py.detach(walk)
    }
}

type Boxed<'s> = Traversal<'s, Box<dyn Iterator<Item = Traverser> + 's>>;

fn take<'s>(
    now: &'s Arc<Snapshot>,
    traversal: Boxed<'s>,
    step: &'s Step,
    budget: &'s Budget,
) -> Boxed<'s> {
    match step {
        Step::Out(relation) => traversal.out(relation.as_str()).boxed(),
        Step::In(relation) => traversal.in_(relation.as_str()).boxed(),
        Step::HasType(kind) => traversal.has_type(kind.as_str()).boxed(),
        Step::Has(attribute, wanted) => {
            let attribute = now.symbol(attribute.as_str());
            let same = move |graph: &Snapshot, traverser: &Traverser| {
                let found = attribute.and_then(|name| graph.get(traverser.node, name));
                let found = found.map(Cell::from);
                found.is_some_and(|found| found.equals(wanted) == Some(true))
            };
            traversal.filter(same).boxed()
        }
        Step::As(mark) => traversal.as_(*mark).boxed(),
        Step::WhereEq(mark) => traversal.where_eq(*mark).boxed(),
        Step::Select(mark) => traversal.select(*mark).boxed(),
        Step::RepeatUntil(relation, until) => {
            let ends = move |_: &Snapshot, id: NodeId| {
                if !budget.step() {
                    return true;
                }
                let node = Node {
                    now: Arc::clone(now),
                    id,
                };
                let is_there = Python::attach(|py| until.call1(py, (node,))?.is_truthy(py));
                is_there.unwrap_or_else(|error| {
                    budget.fail(error);
                    true
                })
            };
            traversal.repeat_until(relation.as_str(), ends).boxed()
        }
    }
}
