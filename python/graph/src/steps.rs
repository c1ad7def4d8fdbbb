//! The steps of a change, and their values.

use property_graph::schema::Kind;
use property_graph::{EdgeId, Edit, Element, NodeId, Sample, Value};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyInt, PyString};
use std::collections::BTreeMap;

/// A step of a change: what, and its arguments. Nothing of it is Python's: a change keeps others out, and code
/// in Python that runs meanwhile could make one, too, or wait for a thread that does.
pub(crate) enum Step {
    AddNode(String),
    AddEdge(String, End, End),
    Set(End, String, Value),
    Unset(End, String),
    Remove(End),
}

/// The new elements of the steps so far, by the numbers of these: type, and whether it is an edge.
pub(crate) type Kinds = BTreeMap<usize, (String, bool)>;

/// An element that a step names: one of a version, or the result of an earlier step, by its number.
#[derive(Clone, Copy)]
pub(crate) enum End {
    Known(Element),
    New(usize),
}

fn element(end: End, made: &BTreeMap<usize, Element>) -> Result<Element, property_graph::Error> {
    match end {
        End::Known(element) => Ok(element),
        End::New(at) => made.get(&at).copied().ok_or(property_graph::Error::Removed),
    }
}

fn node(end: End, made: &BTreeMap<usize, Element>) -> Result<NodeId, property_graph::Error> {
    match element(end, made)? {
        Element::Node(node) => Ok(node),
        Element::Edge(_) => Err(property_graph::Error::Removed),
    }
}

/// Takes one step. Returns what is new.
pub(crate) fn take_step(
    edit: &mut Edit,
    step: Step,
    made: &BTreeMap<usize, Element>,
) -> Result<Option<Element>, property_graph::Error> {
    match step {
        Step::AddNode(kind) => return Ok(Some(edit.add_node(kind.as_str())?.into())),
        Step::AddEdge(relation, from, to) => {
            let (from, to) = (node(from, made)?, node(to, made)?);
            let edge: EdgeId = edit.add_edge(relation.as_str(), from, to)?;
            return Ok(Some(edge.into()));
        }
        Step::Set(of, name, value) => edit.set(element(of, made)?, name.as_str(), value)?,
        Step::Unset(of, name) => edit.unset(element(of, made)?, name.as_str())?,
        Step::Remove(of) => match element(of, made)? {
            Element::Node(node) => edit.remove_node(node)?,
            Element::Edge(edge) => edit.remove_edge(edge)?,
        },
    }
    Ok(None)
}

/// A value of Python for an attribute of a type, which may not be known.
pub(crate) fn value(given: &Bound<'_, PyAny>, kind: Option<&Kind>) -> PyResult<Value> {
    // Numbers of numpy are not `int` or `bool`, and 1 is a number of an attribute with fractions,
    // too.
    let is_bool = given.is_instance_of::<PyBool>();
    match kind {
        Some(Kind::Bool) if let Ok(yes) = given.extract() => return Ok(Value::Bool(yes)),
        Some(Kind::Int) if !is_bool && let Ok(number) = given.extract() => {
            return Ok(Value::Int(number));
        }
        Some(Kind::Float) if !is_bool && let Ok(number) = given.extract() => {
            return Ok(Value::Float(number));
        }
        Some(Kind::Topic(_)) => return sample(given),
        _ => {}
    }
    if let Ok(yes) = given.cast::<PyBool>() {
        return Ok(Value::Bool(yes.is_true()));
    }
    if given.is_instance_of::<PyInt>() {
        return given
            .extract()
            .map(Value::Int)
            .map_err(|_| PyValueError::new_err("an integer of a graph has 64 bits at most"));
    }
    if let Ok(text) = given.cast::<PyString>() {
        return Ok(Value::Text(text.to_cow()?.into()));
    }
    if let Ok(bytes) = given.cast::<PyBytes>() {
        return Ok(Value::Bytes(bytes.as_bytes().into()));
    }
    if let Ok(number) = given.extract::<f64>() {
        return Ok(Value::Float(number));
    }
    let Ok(items) = given.try_iter() else {
        let found = given.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "expected a truth value, a number, a text, bytes, or a list of numbers or texts, found {found}"
        )));
    };
    let items: Vec<Bound<'_, PyAny>> = items.collect::<PyResult<_>>()?;
    let wants_floats = matches!(kind, Some(Kind::Floats(_) | Kind::Block(_)));
    let wants_texts = matches!(kind, Some(Kind::Texts));
    let wants_ints = matches!(kind, Some(Kind::Ints(_)));
    let is_int = |item: &Bound<'_, PyAny>| {
        item.is_instance_of::<PyInt>() || wants_ints && item.extract::<i64>().is_ok()
    };
    if wants_texts
        || !items.is_empty() && items.iter().all(PyAnyMethods::is_instance_of::<PyString>)
    {
        let texts = items
            .iter()
            .map(|item| Ok(item.extract::<String>()?.as_str().into()));
        return Ok(Value::Texts(texts.collect::<PyResult<_>>()?));
    }
    if !wants_floats && items.iter().all(is_int) {
        let numbers = items.iter().map(PyAnyMethods::extract::<i64>);
        return Ok(Value::Ints(numbers.collect::<PyResult<_>>()?));
    }
    let numbers = items.iter().map(PyAnyMethods::extract::<f64>);
    Ok(Value::Floats(numbers.collect::<PyResult<_>>()?))
}

/// A reference to a sample, as a version has it: the topic, its type, and the number of the sample, which is a text
/// if no integer of a query has it.
fn sample(given: &Bound<'_, PyAny>) -> PyResult<Value> {
    let parts: Option<Vec<Bound<'_, PyAny>>> = given.extract().ok();
    let sample = parts.as_deref().and_then(|parts| {
        let [topic, kind, number] = parts else {
            return None;
        };
        let in_text = || number.extract::<String>().ok()?.parse().ok();
        Some(Sample {
            topic: topic.extract().ok()?,
            kind: kind.extract().ok()?,
            sequence: number.extract().ok().or_else(in_text)?,
        })
    });
    sample.map(Value::from).ok_or_else(|| {
        PyTypeError::new_err(
            "expected a topic, its type and the number of a sample, such as (\"camera.image\", \"RoboCompCamera::TImage\", 42)",
        )
    })
}
