//! Values of a query, with the three-valued logic of openCypher.

use property_graph::{EdgeId, NodeId, Snapshot, Value};
use std::cmp::Ordering;
use std::sync::Arc;

/// A value in a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Null: nothing, or unknown.
    Null,
    /// A truth value.
    Bool(bool),
    /// An integer.
    Int(i64),
    /// A number.
    Float(f64),
    /// A text.
    Text(Arc<str>),
    /// Several values.
    List(Arc<[Cell]>),
    /// Bytes.
    Bytes(Arc<[u8]>),
    /// A node.
    Node(NodeId),
    /// An edge.
    Edge(EdgeId),
}

impl Cell {
    /// A node as a value: the edge, if it stands for one.
    pub(crate) fn of_node(graph: &Snapshot, node: NodeId) -> Self {
        graph.stands_for(node).map_or(Self::Node(node), Self::Edge)
    }
}

impl From<&Value> for Cell {
    fn from(value: &Value) -> Self {
        match value {
            Value::Bool(yes) => Self::Bool(*yes),
            Value::Int(number) => Self::Int(*number),
            Value::Float(number) => Self::Float(*number),
            Value::Text(text) => Self::Text(Arc::clone(text)),
            Value::Bytes(bytes) => Self::Bytes(Arc::clone(bytes)),
            Value::Ints(all) => Self::List(all.iter().map(|n| Self::Int(*n)).collect()),
            Value::Floats(all) => Self::List(all.iter().map(|n| Self::Float(*n)).collect()),
            Value::Texts(all) => Self::List(
                all.iter()
                    .map(|text| Self::Text(Arc::clone(text)))
                    .collect(),
            ),
            // Topic, type and number. A number beyond those of queries is a text.
            Value::Sample(sample) => Self::List(Arc::new([
                sample.topic.as_str().into(),
                sample.kind.as_str().into(),
                match i64::try_from(sample.sequence) {
                    Ok(number) => Self::Int(number),
                    Err(_) => Self::Text(sample.sequence.to_string().into()),
                },
            ])),
        }
    }
}

impl From<bool> for Cell {
    fn from(yes: bool) -> Self {
        Self::Bool(yes)
    }
}

impl From<i64> for Cell {
    fn from(number: i64) -> Self {
        Self::Int(number)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Float(number)
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.into())
    }
}

impl From<NodeId> for Cell {
    fn from(node: NodeId) -> Self {
        Self::Node(node)
    }
}

impl Cell {
    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Self::Int(number) => Some(*number as f64),
            Self::Float(number) => Some(*number),
            _ => None,
        }
    }

    /// Whether two values are equal. `None` if unknown.
    pub fn equals(&self, other: &Self) -> Option<bool> {
        match (self, other) {
            (Self::Null, _) | (_, Self::Null) => None,
            (Self::List(a), Self::List(b)) => {
                if a.len() != b.len() {
                    return Some(false);
                }
                let mut known = true;
                for (a, b) in a.iter().zip(b.iter()) {
                    match a.equals(b) {
                        Some(false) => return Some(false),
                        Some(true) => {}
                        None => known = false,
                    }
                }
                known.then_some(true)
            }
            (Self::Int(a), Self::Int(b)) => Some(a == b),
            (a, b) => match (a.number(), b.number()) {
                (Some(a), Some(b)) => Some(a == b),
                _ => Some(a == b),
            },
        }
    }

    /// The order of two values of one kind. `None` if unknown.
    pub(crate) fn compared(&self, other: &Self) -> Option<Ordering> {
        match (self, other) {
            (Self::Int(a), Self::Int(b)) => Some(a.cmp(b)),
            (Self::Text(a), Self::Text(b)) => Some(a.cmp(b)),
            (Self::Bool(a), Self::Bool(b)) => Some(a.cmp(b)),
            (Self::List(a), Self::List(b)) => {
                // The first elements that differ decide; then the longer list is greater.
                let mut pairs = a.iter().zip(b.iter());
                let differ = pairs.find(|(a, b)| a.equals(b) != Some(true));
                differ.map_or(Some(a.len().cmp(&b.len())), |(a, b)| a.compared(b))
            }
            (a, b) => a.number()?.partial_cmp(&b.number()?),
        }
    }

    fn rank(&self) -> u8 {
        match self {
            Self::Node(_) => 0,
            Self::Edge(_) => 1,
            Self::List(_) => 2,
            Self::Text(_) => 3,
            Self::Bytes(_) => 4,
            Self::Bool(_) => 5,
            Self::Int(_) | Self::Float(_) => 6,
            Self::Null => 7,
        }
    }

    /// The bytes that it holds outside of itself.
    pub(crate) fn bytes(&self) -> usize {
        match self {
            Self::Text(text) => text.len(),
            Self::Bytes(bytes) => bytes.len(),
            Self::List(cells) => {
                let own = cells.len() * size_of::<Self>();
                cells
                    .iter()
                    .map(Self::bytes)
                    .fold(own, usize::saturating_add)
            }
            _ => 0,
        }
    }

    /// The order of any two values, as `ORDER BY` has it: nothing is the greatest.
    pub fn sorted(&self, other: &Self) -> Ordering {
        match (self, other) {
            (Self::Int(a), Self::Int(b)) => a.cmp(b),
            (Self::Text(a), Self::Text(b)) => a.cmp(b),
            (Self::Bool(a), Self::Bool(b)) => a.cmp(b),
            (Self::Bytes(a), Self::Bytes(b)) => a.cmp(b),
            (Self::Node(a), Self::Node(b)) => a.cmp(b),
            (Self::Edge(a), Self::Edge(b)) => a.cmp(b),
            (Self::List(a), Self::List(b)) => {
                let pairs = a.iter().zip(b.iter()).map(|(a, b)| a.sorted(b));
                let first = pairs.into_iter().find(|order| order.is_ne());
                first.unwrap_or_else(|| a.len().cmp(&b.len()))
            }
            (Self::Int(a), Self::Float(b)) => int_and_float(*a, *b),
            (Self::Float(a), Self::Int(b)) => int_and_float(*b, *a).reverse(),
            (a, b) => match (a.number(), b.number()) {
                (Some(a), Some(b)) => a.total_cmp(&b),
                _ => a.rank().cmp(&b.rank()),
            },
        }
    }

    /// The value as a table shows it.
    pub fn shown(&self, graph: &Snapshot) -> String {
        match self {
            Self::Null => "null".to_owned(),
            Self::Bool(yes) => yes.to_string(),
            Self::Int(number) => number.to_string(),
            Self::Float(number) => format!("{number:?}"),
            Self::Text(text) => rc_diagnostics::foreign::clean(text),
            Self::Bytes(bytes) => format!("{} bytes", bytes.len()),
            Self::List(all) => {
                let all = all.iter().map(|cell| cell.shown(graph));
                format!("[{}]", all.collect::<Vec<_>>().join(", "))
            }
            Self::Node(node) => match graph.node(*node) {
                Ok(node) => {
                    let name = rc_diagnostics::foreign::clean(node.name());
                    let kind = rc_diagnostics::foreign::clean(node.type_name());
                    format!("({name}:{kind})")
                }
                Err(_) => "a removed node".to_owned(),
            },
            Self::Edge(edge) => match graph.edge(*edge) {
                Ok(edge) => format!("[:{}]", rc_diagnostics::foreign::clean(edge.type_name())),
                Err(_) => "a removed edge".to_owned(),
            },
        }
    }
}

/// The order of an integer and a float by their exact values: as floats, integers beyond 2^53 would
/// equal their neighbours, and the order would not be total.
fn int_and_float(a: i64, b: f64) -> Ordering {
    if !b.is_finite() {
        return (a as f64).total_cmp(&b);
    }
    let whole = i128::from(a).cmp(&(b.trunc() as i128));
    let part = 0.0_f64.partial_cmp(&b.fract());
    whole
        .then(part.unwrap_or(Ordering::Equal))
        .then((a as f64).total_cmp(&b))
}
