//! Traversals whose steps Python says.

use crate::elements::Node;
use graph_query::{Cell, Mark, Traversal, Walker, traverse};
use property_graph::{NodeId, Snapshot};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::cell::{Cell as Counter, RefCell};
use std::rc::Rc;
use std::sync::Arc;

/// A step: its name, a relation, a type or an attribute, and a value, the number of a mark, or what is
/// asked about a node.
pub(crate) type Words<'py> = (String, String, Bound<'py, PyAny>);

type Ways<'s> = Traversal<'s, Box<dyn Iterator<Item = Walker> + 's>>;

/// Ends a traversal that has failed: then no way goes on.
#[derive(Clone, Default)]
struct Stop(Rc<RefCell<Option<PyErr>>>);

impl Stop {
    fn is_set(&self) -> bool {
        self.0.borrow().is_some()
    }

    fn set(&self, error: PyErr) {
        self.0.borrow_mut().get_or_insert(error);
    }
}

/// The ways that steps lead from nodes, `most` in all steps together.
pub(crate) fn walk(
    now: &Arc<Snapshot>,
    starts: Vec<NodeId>,
    steps: Vec<Words<'_>>,
    most: u64,
) -> PyResult<Vec<(Node, Vec<Option<Node>>)>> {
    let stop = Stop::default();
    let left = Rc::new(Counter::new(most));
    let mut ways = traverse(now, starts).boxed();
    for words in steps {
        ways = step(now, ways, words, &stop)?;
        let (stop, left) = (stop.clone(), Rc::clone(&left));
        let counted = ways.filter(move |_, _| {
            if let Some(rest) = left.get().checked_sub(1) {
                left.set(rest);
            } else {
                let message = format!("the traversal has more than {most} ways");
                stop.set(PyValueError::new_err(message));
            }
            !stop.is_set()
        });
        ways = counted.boxed();
    }
    let node = |id: NodeId| Node {
        now: Arc::clone(now),
        id,
    };
    let found = ways.walkers().map(|way| {
        let marked = (0..Walker::MARKS).map(|at| way.marked(Mark(at)).map(node));
        (node(way.node), marked.collect())
    });
    let found = found.collect();
    match stop.0.take() {
        Some(error) => Err(error),
        None => Ok(found),
    }
}

fn step<'s>(
    now: &'s Arc<Snapshot>,
    ways: Ways<'s>,
    (word, name, value): Words<'_>,
    stop: &Stop,
) -> PyResult<Ways<'s>> {
    let mark = || value.extract().map(Mark);
    // A name that the graph does not have leads nowhere.
    let symbol = now.symbol(name.as_str());
    Ok(match (word.as_str(), symbol) {
        ("as_", _) => ways.as_(mark()?).boxed(),
        ("where_eq", _) => ways.where_eq(mark()?).boxed(),
        ("select", _) => ways.select(mark()?).boxed(),
        (_, None) => ways.filter(|_, _| false).boxed(),
        ("out", Some(relation)) => ways.out(relation).boxed(),
        ("in_", Some(relation)) => ways.in_(relation).boxed(),
        ("has_type", Some(kind)) => ways.has_type(kind).boxed(),
        ("has", Some(attribute)) => {
            let wanted = crate::values::cell(&value, now)?;
            let same = move |graph: &Snapshot, way: &Walker| {
                let found = graph.get(way.node, attribute).map(Cell::from);
                found.is_some_and(|found| found.equals(&wanted) == Some(true))
            };
            ways.filter(same).boxed()
        }
        ("repeat_until", Some(relation)) => {
            let (until, stop, graph) = (value.unbind(), stop.clone(), Arc::clone(now));
            let ends = move |_: &Snapshot, id: NodeId| {
                let node = Node {
                    now: Arc::clone(&graph),
                    id,
                };
                let is_there = Python::attach(|py| until.call1(py, (node,))?.is_truthy(py));
                is_there.unwrap_or_else(|error| {
                    stop.set(error);
                    true
                })
            };
            ways.repeat_until(relation, ends).boxed()
        }
        (other, _) => {
            return Err(PyValueError::new_err(format!("unknown step `{other}`")));
        }
    })
}
