//! Whether a schema allows an element by itself, without regard to others. Replicas make no other
//! elements, but a damaged or hostile message may contain some.

use graph_schema::{Attribute, Kind, PoseOf, Schema};
use property_graph::{MOST_BYTES, Value, fits};
use std::sync::Arc;

/// Attributes of an element that its schema allows, in the order of their names.
pub(crate) type Allowed<'r> = Vec<(&'r Arc<str>, &'r Value)>;

/// The value of an attribute.
pub(crate) fn value<'r>(attributes: &Allowed<'r>, name: &str) -> Option<&'r Value> {
    let at = attributes.binary_search_by(|(known, _)| (***known).cmp(name));
    Some(attributes[at.ok()?].1)
}

fn declared<'s>(schema: &'s Schema, kind: &str, name: &str) -> Option<&'s Attribute> {
    let mut all = schema.attributes(kind)?.iter();
    all.find(|attribute| attribute.name == name)
}

/// Whether a type has an attribute.
pub fn has_attribute(schema: &Schema, kind: &str, name: &str) -> bool {
    schema.open || declared(schema, kind, name).is_some()
}

/// Whether a graph of this schema holds a value as an attribute of this type.
pub fn allows(schema: &Schema, kind: &str, name: &str, value: &Value) -> bool {
    let is_text = matches!(value, Value::Text(_) | Value::Texts(_));
    if !value.is_finite() || value.size() > MOST_BYTES && !is_text {
        return false;
    }
    match declared(schema, kind, name) {
        Some(attribute) => fits(attribute, value).is_ok(),
        None => schema.open,
    }
}

/// The first attribute that a type requires and that is not there, in any representation.
pub fn missing<'s>(
    schema: &'s Schema,
    kind: &str,
    is_there: impl Fn(&str) -> bool,
) -> Option<&'s str> {
    let all = schema.attributes(kind)?;
    let mut required = all.iter().filter(|attribute| !attribute.optional);
    let missing = required.find(|required| {
        let mut group = all
            .iter()
            .filter(|own| own.value_of() == required.value_of());
        !group.any(|own| is_there(&own.name))
    });
    missing.map(|attribute| attribute.name.as_str())
}

/// Whether a node may have this type and these attributes.
pub(crate) fn is_node(schema: &Schema, kind: &str, attributes: &Allowed<'_>) -> bool {
    let is_known = schema.open || schema.entity(kind).is_some();
    is_known && missing(schema, kind, |name| value(attributes, name).is_some()).is_none()
}

/// Whether an edge may have this type, these attributes, and ends of these types.
pub(crate) fn is_edge(
    schema: &Schema,
    kind: &str,
    attributes: &Allowed<'_>,
    ends: [&str; 2],
) -> bool {
    let Some(relation) = schema.relation(kind) else {
        return schema.open;
    };
    let is_end = |wanted: &str, end: &str| {
        let is_free = schema.open && schema.attributes(end).is_none();
        schema.entity(wanted).is_none() || is_free || schema.is_a(end, wanted)
    };
    let mut ports = relation.ports.iter().zip(ends);
    ports.all(|(port, end)| is_end(&port.entity, end))
        && missing(schema, kind, |name| value(attributes, name).is_some()).is_none()
        && has_pose(schema, kind, attributes)
}

/// Whether an edge of a tree of frames has the numbers of a pose.
fn has_pose(schema: &Schema, kind: &str, attributes: &Allowed<'_>) -> bool {
    let tree = schema.relation(kind).and_then(|own| own.tree.as_ref());
    let has = |name: &str, count: usize| {
        let attribute = declared(schema, kind, name);
        let Some(value) = value(attributes, name) else {
            // It may exist in another representation.
            let all = schema.attributes(kind).into_iter().flatten();
            let mut group =
                all.filter(|other| attribute.is_some_and(|own| own.value_of() == other.value_of()));
            return group.any(|other| value(attributes, &other.name).is_some());
        };
        match attribute.map(|own| &own.kind) {
            Some(Kind::Block(block)) => {
                let numbers = value.numbers();
                numbers.is_some_and(|all| block.as_pose(&all).is_some())
            }
            _ => value.number(count - 1).is_some(),
        }
    };
    match tree.and_then(|tree| tree.pose.as_ref()) {
        None => true,
        Some(PoseOf::One(pose)) => has(pose, 6),
        Some(PoseOf::Two(by, angles)) => has(by, 3) && has(angles, 3),
    }
}
