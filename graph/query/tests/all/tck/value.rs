//! Values as scenarios write them, and `CREATE`, which makes their graphs: our queries change nothing.

use graph_query::Cell;
use property_graph::{Edit, NodeId, Snapshot, Value as Stored};
use std::collections::{BTreeMap, HashMap};

/// The type of a node that the scenario gives no label.
pub(crate) const NO_LABEL: &str = "(no label)";

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Null,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(String),
    List(Vec<Value>),
    Map(BTreeMap<String, Value>),
    Node(String, BTreeMap<String, Value>),
    Edge(String, BTreeMap<String, Value>),
}

/// Why a text is not read.
pub(crate) type Reason = String;

pub(crate) struct Reader<'a> {
    rest: &'a str,
}

impl<'a> Reader<'a> {
    pub(crate) fn new(text: &'a str) -> Self {
        Self { rest: text }
    }

    fn blank(&mut self) {
        loop {
            self.rest = self.rest.trim_start();
            match self.rest.strip_prefix("//") {
                Some(comment) => self.rest = comment.split_once('\n').map_or("", |(_, r)| r),
                None => return,
            }
        }
    }

    fn sign(&mut self, sign: &str) -> bool {
        self.blank();
        match self.rest.strip_prefix(sign) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn need(&mut self, sign: &str) -> Result<(), Reason> {
        if self.sign(sign) {
            return Ok(());
        }
        let rest: String = self.rest.chars().take(12).collect();
        Err(format!("expected `{sign}` at `{}`", rest.trim_end()))
    }

    fn word(&mut self) -> Option<String> {
        self.blank();
        if let Some(rest) = self.rest.strip_prefix('`') {
            let (word, rest) = rest.split_once('`')?;
            self.rest = rest;
            return Some(word.to_owned());
        }
        let is_part = |sign: char| sign.is_alphanumeric() || sign == '_';
        let end = self.rest.find(|sign| !is_part(sign));
        let (word, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        if word.is_empty() || word.starts_with(|sign: char| sign.is_numeric()) {
            return None;
        }
        self.rest = rest;
        Some(word.to_owned())
    }

    pub(crate) fn at_end(&mut self) -> bool {
        self.blank();
        self.rest.is_empty()
    }

    fn text(&mut self, quote: char) -> Result<Value, Reason> {
        let mut text = String::new();
        let mut signs = self.rest[1..].char_indices();
        while let Some((at, sign)) = signs.next() {
            if sign == quote {
                self.rest = &self.rest[at + 2..];
                return Ok(Value::Text(text));
            }
            text.push(match sign {
                '\\' => match signs.next().map(|(_, sign)| sign) {
                    Some('n') => '\n',
                    Some('t') => '\t',
                    Some('r') => '\r',
                    Some(other) => other,
                    None => break,
                },
                other => other,
            });
        }
        Err("a text does not end".to_owned())
    }

    fn number(&mut self) -> Result<Value, Reason> {
        let is_part = |sign: char| sign.is_ascii_alphanumeric() || ".+-".contains(sign);
        let end = self.rest.find(|sign| !is_part(sign));
        let (number, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        let value = match number.parse::<i64>() {
            Ok(number) => Value::Int(number),
            Err(_) => match number.parse() {
                Ok(number) => Value::Float(number),
                Err(_) => return Err(format!("no number: `{number}`")),
            },
        };
        self.rest = rest;
        Ok(value)
    }

    pub(crate) fn value(&mut self) -> Result<Value, Reason> {
        self.blank();
        match self.rest.chars().next() {
            Some(quote @ ('\'' | '"')) => self.text(quote),
            Some('0'..='9' | '-' | '.') => self.number(),
            Some('(') => {
                let (_, label, properties) = self.node()?;
                Ok(Value::Node(label, properties))
            }
            Some('[') => {
                self.need("[")?;
                if self.sign(":") {
                    let kind = self.word().ok_or("an edge without a type")?;
                    let properties = self.properties()?;
                    self.need("]")?;
                    return Ok(Value::Edge(kind, properties));
                }
                let mut all = Vec::new();
                while !self.sign("]") {
                    all.push(self.value()?);
                    self.sign(",");
                }
                Ok(Value::List(all))
            }
            Some('{') => Ok(Value::Map(self.properties()?)),
            Some('<') => Err("a path is not a value".to_owned()),
            _ => match self.word().as_deref() {
                Some("null") => Ok(Value::Null),
                Some("true") => Ok(Value::Bool(true)),
                Some("false") => Ok(Value::Bool(false)),
                Some("NaN") => Ok(Value::Float(f64::NAN)),
                other => Err(format!("no literal: `{}`", other.unwrap_or(self.rest))),
            },
        }
    }

    fn properties(&mut self) -> Result<BTreeMap<String, Value>, Reason> {
        let mut all = BTreeMap::new();
        if !self.sign("{") {
            return Ok(all);
        }
        while !self.sign("}") {
            let name = self.word().ok_or("a property without a name")?;
            self.need(":")?;
            let value = self.value()?;
            if value != Value::Null {
                all.insert(name, value);
            }
            self.sign(",");
        }
        Ok(all)
    }

    #[expect(clippy::type_complexity, reason = "the three parts of a node")]
    fn node(&mut self) -> Result<(Option<String>, String, BTreeMap<String, Value>), Reason> {
        self.need("(")?;
        let variable = self.word();
        let mut label = NO_LABEL.to_owned();
        if self.sign(":") {
            label = self.word().ok_or("a node without a label")?;
            if self.sign(":") {
                return Err("a node has several labels".to_owned());
            }
        }
        let properties = self.properties()?;
        self.need(")")?;
        Ok((variable, label, properties))
    }
}

fn stored(value: &Value) -> Result<Stored, Reason> {
    let beyond = || "an attribute cannot hold the value".to_owned();
    match value {
        Value::Bool(yes) => Ok((*yes).into()),
        Value::Int(number) => Ok((*number).into()),
        Value::Float(number) if number.is_finite() => Ok((*number).into()),
        Value::Text(text) => Ok(text.as_str().into()),
        Value::List(all) => {
            let ints = all.iter().map(|value| match value {
                Value::Int(number) => Some(*number),
                _ => None,
            });
            if let Some(ints) = ints.collect::<Option<Vec<i64>>>() {
                return Ok(Stored::Ints(ints.into()));
            }
            let floats = all.iter().map(|value| match value {
                Value::Float(number) => Some(*number),
                _ => None,
            });
            if let Some(floats) = floats.collect::<Option<Vec<f64>>>() {
                return Ok(Stored::Floats(floats.into()));
            }
            let texts = all.iter().map(|value| match value {
                Value::Text(text) => Some(text.as_str().into()),
                _ => None,
            });
            let texts = texts.collect::<Option<Vec<_>>>();
            Ok(Stored::Texts(texts.ok_or_else(beyond)?.into()))
        }
        _ => Err(beyond()),
    }
}

fn set(
    edit: &mut Edit,
    element: impl Into<property_graph::Element>,
    properties: &BTreeMap<String, Value>,
) -> Result<(), Reason> {
    let element = element.into();
    for (name, value) in properties {
        let set = edit.set(element, name.as_str(), stored(value)?);
        set.map_err(|error| error.to_string())?;
    }
    Ok(())
}

/// Makes what `CREATE` clauses say.
pub(crate) fn create(edit: &mut Edit, text: &str) -> Result<(), Reason> {
    let mut reader = Reader::new(text);
    let mut known: HashMap<String, NodeId> = HashMap::new();
    while !reader.at_end() {
        match reader.word() {
            Some(word) if word.eq_ignore_ascii_case("CREATE") => {}
            other => {
                let word = other.unwrap_or_default();
                return Err(format!("the graph is made with `{}`", word.to_uppercase()));
            }
        }
        loop {
            let mut from = node(edit, &mut reader, &mut known)?;
            loop {
                let back = reader.sign("<-");
                if !back && !reader.sign("-") {
                    break;
                }
                reader.need("[")?;
                reader.word();
                reader.need(":")?;
                let kind = reader.word().ok_or("an edge without a type")?;
                let properties = reader.properties()?;
                reader.need("]")?;
                reader.need(if back { "-" } else { "->" })?;
                let to = node(edit, &mut reader, &mut known)?;
                let (start, end) = if back { (to, from) } else { (from, to) };
                let edge = edit.add_edge(kind.as_str(), start, end);
                let edge = edge.map_err(|error| error.to_string())?;
                set(edit, edge, &properties)?;
                from = to;
            }
            if !reader.sign(",") {
                break;
            }
        }
        reader.sign(";");
    }
    Ok(())
}

fn node(
    edit: &mut Edit,
    reader: &mut Reader<'_>,
    known: &mut HashMap<String, NodeId>,
) -> Result<NodeId, Reason> {
    let (variable, label, properties) = reader.node()?;
    if let Some(node) = variable.as_ref().and_then(|name| known.get(name)) {
        return Ok(*node);
    }
    let node = edit.add_node(label.as_str());
    let node = node.map_err(|error| error.to_string())?;
    set(edit, node, &properties)?;
    if let Some(name) = variable {
        known.insert(name, node);
    }
    Ok(node)
}

/// A value of the kit as a parameter of ours.
pub(crate) fn parameter(value: &Value) -> Result<Cell, Reason> {
    Ok(match value {
        Value::Null => Cell::Null,
        Value::Bool(yes) => Cell::Bool(*yes),
        Value::Int(number) => Cell::Int(*number),
        Value::Float(number) => Cell::Float(*number),
        Value::Text(text) => Cell::Text(text.as_str().into()),
        Value::List(all) => {
            let all: Result<Vec<Cell>, Reason> = all.iter().map(parameter).collect();
            Cell::List(all?.into())
        }
        _ => return Err("a map is not a value".to_owned()),
    })
}

fn attributes<'a>(
    all: impl Iterator<Item = (&'a str, &'a Stored)>,
    graph: &Snapshot,
) -> BTreeMap<String, Value> {
    let all = all.map(|(name, value)| (name.to_owned(), of_cell(&Cell::from(value), graph)));
    all.collect()
}

/// A value of ours as one of the kit.
pub(crate) fn of_cell(cell: &Cell, graph: &Snapshot) -> Value {
    match cell {
        Cell::Null => Value::Null,
        Cell::Bool(yes) => Value::Bool(*yes),
        Cell::Int(number) => Value::Int(*number),
        Cell::Float(number) => Value::Float(*number),
        Cell::Text(text) => Value::Text(text.to_string()),
        Cell::List(all) => Value::List(all.iter().map(|cell| of_cell(cell, graph)).collect()),
        Cell::Bytes(bytes) => Value::Text(format!("{} bytes", bytes.len())),
        Cell::Node(node) => {
            let node = graph.node(*node).expect("a node");
            let attributes = attributes(node.attributes(), graph);
            Value::Node(node.type_name().to_owned(), attributes)
        }
        Cell::Edge(edge) => {
            let edge = graph.edge(*edge).expect("an edge");
            let attributes = attributes(edge.attributes(), graph);
            Value::Edge(edge.type_name().to_owned(), attributes)
        }
    }
}

/// Whether two values are the same, also two that are not numbers.
pub(crate) fn same(a: &Value, b: &Value, lists_vary: bool) -> bool {
    match (a, b) {
        (Value::Float(a), Value::Float(b)) => a == b || (a.is_nan() && b.is_nan()),
        (Value::List(a), Value::List(b)) if lists_vary => {
            a.len() == b.len() && same_in_any_order(a, b, |a, b| same(a, b, true))
        }
        (Value::List(a), Value::List(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b, false))
        }
        _ => a == b,
    }
}

/// Whether two lists of one length have the same elements.
pub(crate) fn same_in_any_order<T>(a: &[T], b: &[T], same: impl Fn(&T, &T) -> bool) -> bool {
    let mut left: Vec<&T> = b.iter().collect();
    a.iter()
        .all(|a| match left.iter().position(|b| same(a, b)) {
            Some(at) => {
                left.swap_remove(at);
                true
            }
            None => false,
        })
}
