//! The check of a change at its end, in proportion to what it touched.

use crate::edit::Edit;
use crate::element::{EdgeId, Element, NodeId};
use crate::error::Error;
use crate::names::Symbol;
use crate::snapshot::Snapshot;
use crate::stored::{Attributes, value};
use crate::types::{self, RelationType, TreeOf, Types};
use crate::value::Value;
use graph_schema::{Attribute, Kind};
use rc_diagnostics::foreign;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// How many touched elements are checked without notes of earlier visits: notes need memory.
const FEW: usize = 16;

/// The notes of the check of a large change, so that it visits a hub or a deep tree once.
struct Seen {
    is_kept: bool,
    /// Nodes whose ports are right.
    ports: HashSet<NodeId>,
    /// The walk towards the top of a tree on which a node was met.
    trees: HashMap<(Symbol, NodeId), usize>,
    walks: usize,
}

/// Checks what a change touched, and brings keys up to date.
pub(crate) fn check(edit: &mut Edit, before: &Snapshot) -> Result<(), Error> {
    edit.demote()?;
    if edit.touched.len() > 1 {
        edit.touched.sort_unstable();
        edit.touched.dedup();
    }
    let types = Arc::clone(&edit.next.types);
    let next = &edit.next;
    let mut seen = Seen {
        is_kept: edit.touched.len().max(edit.bared.len()) > FEW,
        ports: HashSet::new(),
        trees: HashMap::new(),
        walks: 0,
    };
    for element in &edit.touched {
        match element {
            Element::Node(node) => check_node(next, &types, *node, &mut seen)?,
            Element::Edge(edge) => check_edge(next, &types, *edge, &mut seen)?,
        }
    }
    for node in &edit.bared {
        check_ports(next, &types, *node, &mut seen)?;
    }
    if !edit.keyed.is_empty() {
        keys(edit, before, &types)?;
    }
    Ok(())
}

fn check_node(next: &Snapshot, types: &Types, node: NodeId, seen: &mut Seen) -> Result<(), Error> {
    let Ok(kind) = next.kind(node.into()) else {
        // It was removed again.
        return Ok(());
    };
    let Some(entity) = types.entity(kind) else {
        return Ok(());
    };
    let attributes = next.attributes(node.into())?;
    let about = types.described(entity);
    let places = &entity.attributes;
    check_attributes(next, types, attributes, &about.name, |symbol| {
        about.attributes.get(places.place(symbol)?)
    })?;
    check_required(next, places, attributes, &about.name)?;
    check_ports(next, types, node, seen)?;
    check_rules_at(next, types, node)
}

/// Checks the rules of the edges of a node: they compare attributes of both ends.
fn check_rules_at(next: &Snapshot, types: &Types, node: NodeId) -> Result<(), Error> {
    let place = next.place(node)?;
    for half in place.out.all().iter().chain(next.incoming(node)) {
        let relation = types.relation(half.relation);
        let Some(relation) = relation.filter(|relation| !relation.rules.is_empty()) else {
            continue;
        };
        let edge = next.edge_at(half.edge).ok_or(Error::Removed)?;
        let edge = next.edge(edge)?;
        check_rules(next, types, relation, [edge.from(), edge.to()])?;
    }
    Ok(())
}

/// Whether an element has all that its type requires, in any representation.
fn check_required(
    next: &Snapshot,
    places: &types::Attributes,
    attributes: &Attributes,
    kind: &str,
) -> Result<(), Error> {
    for required in places.required() {
        let is_set = |(symbol, _): &(Symbol, usize)| value(attributes, *symbol).is_some();
        let others = || places.group(*required).unwrap_or_default();
        if value(attributes, *required).is_none() && !others().iter().any(is_set) {
            return Err(Error::Missing {
                kind: kind.to_owned(),
                attribute: next.text(*required).to_owned(),
            });
        }
    }
    Ok(())
}

fn check_ports(next: &Snapshot, types: &Types, node: NodeId, seen: &mut Seen) -> Result<(), Error> {
    if seen.is_kept && !seen.ports.insert(node) {
        return Ok(());
    }
    let Ok(place) = next.place(node) else {
        return Ok(());
    };
    // An edge that others refer to may have as many of them as a node, but needs none.
    let promoted = types.promoted(place.kind);
    let needs_none = promoted.is_some();
    let Some(entity) = promoted.or_else(|| types.entity(place.kind)) else {
        return Ok(());
    };
    for port in &entity.ports {
        let halves = [place.out.all(), next.incoming(node)][port.port];
        let ours = halves.iter().filter(|half| half.relation == port.relation);
        let found = ours.count();
        if (found < port.min && !needs_none) || port.max.is_some_and(|most| found > most) {
            let relation = next.text(port.relation).to_owned();
            let described = types.schema.relation(&relation);
            let name = described.and_then(|r| r.ports.get(port.port));
            return Err(Error::Cardinality {
                kind: next.text(place.kind).to_owned(),
                relation,
                port: name.map(|p| p.name.clone()).unwrap_or_default(),
                expected: bounds(port.min, port.max),
                found,
            });
        }
    }
    Ok(())
}

/// `1:`, `:2`, `0:1`
fn bounds(min: usize, max: Option<usize>) -> String {
    match max {
        Some(max) => format!("{min}:{max}"),
        None => format!("{min}:"),
    }
}

fn check_attributes<'s>(
    next: &Snapshot,
    types: &Types,
    attributes: &Attributes,
    kind: &str,
    described: impl Fn(Symbol) -> Option<&'s Attribute>,
) -> Result<(), Error> {
    for (symbol, stored) in attributes.as_deref().unwrap_or_default() {
        let Some(attribute) = described(*symbol) else {
            if types.schema.open {
                continue;
            }
            let known = types.schema.entity(kind).map(|e| &e.attributes);
            let known = known.or_else(|| types.schema.relation(kind).map(|r| &r.attributes));
            let known = known.into_iter().flatten().map(|a| a.name.as_str());
            let name = next.text(*symbol);
            return Err(Error::UnknownAttribute {
                kind: kind.to_owned(),
                nearest: rc_diagnostics::nearest(name, known).map(str::to_owned),
                name: foreign::clean(name),
            });
        };
        if let Err((expected, found)) = fits(attribute, stored.value()) {
            return Err(Error::Value {
                kind: kind.to_owned(),
                attribute: attribute.name.clone(),
                expected,
                found,
            });
        }
    }
    Ok(())
}

/// Whether the schema allows a value. If not: what was expected, and what was found.
pub fn fits(attribute: &Attribute, value: &Value) -> Result<(), (String, String)> {
    let sized = |count: &Option<usize>, len: usize| count.is_none_or(|count| count == len);
    let type_fits = match (&attribute.kind, value) {
        (Kind::Bool, Value::Bool(_))
        | (Kind::Int, Value::Int(_))
        | (Kind::Float, Value::Float(_) | Value::Int(_))
        | (Kind::Text, Value::Text(_))
        | (Kind::Bytes, Value::Bytes(_))
        | (Kind::Texts, Value::Texts(_)) => true,
        (Kind::Topic(kind), Value::Sample(sample)) => {
            kind.as_ref().is_none_or(|kind| *kind == sample.kind)
        }
        (Kind::Block(block), Value::Floats(_) | Value::Ints(_)) => {
            let numbers = value.numbers().unwrap_or_default();
            return match block.refusal(&numbers) {
                Some(refusal) => Err((block.text(), refusal)),
                None => Ok(()),
            };
        }
        (Kind::Enum(words), Value::Text(text)) => words.iter().any(|word| **word == **text),
        (Kind::Ints(count) | Kind::Floats(count), Value::Ints(all)) => sized(count, all.len()),
        (Kind::Floats(count), Value::Floats(all)) => sized(count, all.len()),
        _ => false,
    };
    if !type_fits {
        let found = match value {
            Value::Text(text) => format!("`{}`", foreign::clean(text)),
            Value::Ints(all) => format!("int[{}]", all.len()),
            Value::Floats(all) => format!("float[{}]", all.len()),
            Value::Sample(sample) => format!("topic \"{}\"", foreign::clean(&sample.kind)),
            other => other.kind().to_owned(),
        };
        return Err((attribute.kind.text(), found));
    }
    let Some((min, max)) = attribute.range else {
        return Ok(());
    };
    let outside = |number: f64| !(min..=max).contains(&number);
    let wrong = match value {
        Value::Ints(all) => all.iter().map(|v| *v as f64).find(|v| outside(*v)),
        Value::Floats(all) => all.iter().copied().find(|v| outside(*v)),
        other => other.as_f64().filter(|v| outside(*v)),
    };
    match wrong {
        Some(number) => {
            let unit = attribute.unit.as_deref().unwrap_or_default();
            let unit = if unit.is_empty() {
                String::new()
            } else {
                format!(" {unit}")
            };
            Err((format!("in {min}:{max}{unit}"), number.to_string()))
        }
        None => Ok(()),
    }
}

fn check_edge(next: &Snapshot, types: &Types, edge: EdgeId, seen: &mut Seen) -> Result<(), Error> {
    let Ok(here) = next.edge_of(edge) else {
        return Ok(());
    };
    let Some(relation) = types.relation(here.relation) else {
        return Ok(());
    };
    let about = types.described_relation(relation);
    let ends = [here.from, here.to].map(|at| next.node_at(at));
    let [Some(from), Some(to)] = ends else {
        return Err(Error::Removed);
    };
    for (at, (node, wanted)) in [from, to].into_iter().zip(relation.ports).enumerate() {
        let kind = next.place(node)?.kind;
        let Some(wanted) = wanted else { continue };
        let is_declared = types.entity(kind).is_some() || types.relation(kind).is_some();
        let is_known = is_declared || !types.schema.open;
        if is_known && !types.is_a(kind, wanted) {
            return Err(Error::Port {
                relation: about.name.clone(),
                port: about.ports[at].name.clone(),
                expected: about.ports[at].entity.clone(),
                found: foreign::clean(next.text(kind)),
            });
        }
        check_ports(next, types, node, seen)?;
    }
    let places = &relation.attributes;
    check_attributes(next, types, &here.attributes, &about.name, |symbol| {
        about.attributes.get(places.place(symbol)?)
    })?;
    check_required(next, places, &here.attributes, &about.name)?;
    if let Some(tree) = relation.tree {
        check_tree(next, here.relation, tree, [from, to], seen)?;
    }
    check_rules(next, types, relation, [from, to])?;
    // The edges at this one.
    match next.node_of(edge) {
        Some(node) => check_rules_at(next, types, node),
        None => Ok(()),
    }
}

/// The name of a node, or its id.
pub(crate) fn called(next: &Snapshot, node: NodeId) -> String {
    match next.node(node) {
        Ok(node) if node.name().is_empty() => format!("node {:#x}", node.id().0),
        Ok(node) => format!("`{}`", foreign::clean(node.name())),
        Err(_) => "a removed node".to_owned(),
    }
}

/// Whether a new edge keeps the forest: its child has one parent, and is not above itself.
fn check_tree(
    next: &Snapshot,
    relation: Symbol,
    tree: TreeOf,
    ends: [NodeId; 2],
    seen: &mut Seen,
) -> Result<(), Error> {
    let child = ends[tree.child];
    let cycle = |node| Error::Cycle(called(next, node), next.text(relation).to_owned());
    let mut steps = 0;
    let mut here = child;
    seen.walks += 1;
    loop {
        if seen.is_kept {
            match seen.trees.insert((relation, here), seen.walks) {
                // A cycle above the child.
                Some(walk) if walk == seen.walks => return Err(cycle(here)),
                // An earlier walk came to the top from here.
                Some(_) => return Ok(()),
                None => {}
            }
        }
        let halves = parents(next, tree, here);
        let mut of_tree = halves.iter().filter(|half| half.relation == relation);
        let Some(first) = of_tree.next() else {
            return Ok(());
        };
        if of_tree.next().is_some() {
            let name = next.text(relation).to_owned();
            return Err(Error::TwoParents(called(next, here), name));
        }
        here = first.node;
        steps += 1;
        if here == child || steps > next.node_count() {
            return Err(cycle(child));
        }
    }
}

/// The ends at which the parents of a node are.
pub(crate) fn parents(next: &Snapshot, tree: TreeOf, node: NodeId) -> &[crate::element::Half] {
    if tree.child == 0 {
        next.outgoing(node)
    } else {
        next.incoming(node)
    }
}

fn check_rules(
    next: &Snapshot,
    types: &Types,
    relation: &RelationType,
    ends: [NodeId; 2],
) -> Result<(), Error> {
    for (at, left, right) in &relation.rules {
        let rule = &types.schema.rules[*at];
        let number = |port: usize, attribute: Symbol| {
            let node = ends.get(port)?;
            next.get(*node, attribute)?.as_f64()
        };
        // A rule about an attribute that is left out says nothing.
        let (Some(a), Some(b)) = (number(rule.left.0, *left), number(rule.right.0, *right)) else {
            continue;
        };
        if !rule.comparison.holds(a, b) {
            return Err(Error::Rule {
                relation: rule.relation.clone(),
                message: rule.message.clone(),
                left: a,
                comparison: rule.comparison.text(),
                right: b,
            });
        }
    }
    Ok(())
}

/// Brings the index of keys up to date, and refuses a key that two nodes have.
fn keys(edit: &mut Edit, before: &Snapshot, types: &Types) -> Result<(), Error> {
    edit.keyed.sort_unstable();
    edit.keyed.dedup();
    let shape = Arc::make_mut(&mut edit.next.shape);
    let mut keys = std::mem::take(&mut shape.keys);
    for place in &edit.keyed {
        for (key, _) in keys_at(before, types, *place) {
            keys.remove(&key);
        }
    }
    for place in &edit.keyed {
        for (key, shown) in keys_at(&edit.next, types, *place) {
            if keys.get(&key).is_some() {
                return Err(Error::DuplicateKey {
                    kind: edit.next.text(key.0).to_owned(),
                    attribute: edit.next.text(key.1).to_owned(),
                    value: foreign::clean(&shown),
                });
            }
            keys.insert(key, *place);
        }
    }
    Arc::make_mut(&mut edit.next.shape).keys = keys;
    Ok(())
}

type KeyOf = ((Symbol, Symbol, Arc<str>), Arc<str>);

/// The keys of a node, with their values for messages.
fn keys_at(snapshot: &Snapshot, types: &Types, place: u32) -> Vec<KeyOf> {
    let Some(node) = snapshot.node_at(place) else {
        return Vec::new();
    };
    let Ok(kind) = snapshot.kind(node.into()) else {
        return Vec::new();
    };
    let Some(entity) = types.entity(kind) else {
        return Vec::new();
    };
    let keys = entity.keys.iter().filter_map(|(attribute, declarer)| {
        let text: Arc<str> = match snapshot.get(node, *attribute)? {
            Value::Text(text) => Arc::clone(text),
            Value::Int(number) => number.to_string().into(),
            Value::Bool(yes) => yes.to_string().into(),
            _ => return None,
        };
        Some(((*declarer, *attribute, Arc::clone(&text)), text))
    });
    keys.collect()
}
