//! The view of a replica: a graph that its schema allows, and the elements that are hidden.

use crate::record::Stamp;
use crate::replica::{Element, Made, Replica};
use crate::sound::{Allowed, allows, is_edge, is_node, value};
use graph_schema::{Relation, Schema};
use property_graph::{Error, Graph, Id, Time, Value, in_order};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::sync::Arc;

/// Why an element is not shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// An older node has the same key.
    Key,
    /// The child has a parent by a later edge.
    SecondParent,
    /// With later edges, the edge would close a circle in a tree.
    Cycle,
    /// The node has as many later edges at this port as the schema allows.
    Cardinality,
    /// The edge was added while another replica removed one of its ends, or is at such an edge. It is
    /// never shown again: [`Replica::remove`] takes it away, everywhere.
    EndRemoved,
    /// The schema never allows the element, so no correct replica made it.
    Schema,
}

/// An element that is not shown, because another replica made one against which it loses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Conflict {
    /// The element.
    pub id: Id,
    /// Why it loses.
    pub reason: Reason,
}

/// Type and attributes of a node.
type NodeOf = (String, BTreeMap<String, Value>);
/// Relation, ends and attributes of an edge.
type EdgeOf = (String, Id, Id, BTreeMap<String, Value>);

/// The graph that a replica shows. Replicas with equal digests have equal views.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View {
    /// Nodes.
    pub nodes: BTreeMap<Id, NodeOf>,
    /// Edges.
    pub edges: BTreeMap<Id, EdgeOf>,
    /// A hidden element. It is kept, and shown again as soon as it is allowed.
    pub conflicts: Vec<Conflict>,
}

/// An element that was made and is not removed.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown<'r> {
    /// Its type.
    pub kind: &'r str,
    /// Where it starts and ends, if it is an edge.
    pub ends: Option<(Id, Id)>,
    /// Its attributes, those that the schema allows. Of several that are one value, this is the one that
    /// was changed last.
    /// They are in the order of their names.
    pub attributes: Vec<(&'r Arc<str>, &'r Value)>,
}

impl<'r> Shown<'r> {
    /// The value of an attribute.
    pub fn get(&self, name: &str) -> Option<&'r Value> {
        value(&self.attributes, name)
    }
}

impl Replica {
    /// An element, hidden or not. `None` if it was removed, or is not known yet.
    pub fn element(&self, schema: &Schema, id: Id) -> Option<Shown<'_>> {
        shown(schema, self.elements.get(&id)?)
    }

    /// Elements as [`Replica::element`] returns them.
    pub fn elements<'r>(
        &'r self,
        schema: &'r Schema,
        ids: &'r BTreeSet<Id>,
    ) -> impl Iterator<Item = (Id, Option<Shown<'r>>)> {
        // To walk over all costs less than to look up many.
        let are_many = ids.len() > self.elements.len() / 8;
        let mut all = are_many.then(|| self.elements.iter().peekable());
        ids.iter().map(move |id| {
            let element = match &mut all {
                Some(all) => {
                    while all.next_if(|(known, _)| *known < id).is_some() {}
                    let found = all.next_if(|(known, _)| *known == id);
                    found.map(|(_, element)| element)
                }
                None => self.elements.get(id),
            };
            (*id, element.and_then(|element| shown(schema, element)))
        })
    }

    /// The type of an element that was made and is not removed.
    pub fn kind_of(&self, id: Id) -> Option<&str> {
        let element = self.elements.get(&id).filter(|e| e.removed.is_none())?;
        match &element.made.as_ref()?.1 {
            Made::Node(kind) | Made::Edge(kind, ..) => Some(kind),
        }
    }

    /// Whether an edge starts or ends at an element.
    pub fn is_end(&self, id: Id) -> bool {
        self.edges_at(id).next().is_some()
    }

    /// The edges that start or end at an element.
    pub(crate) fn edges_at(&self, id: Id) -> impl Iterator<Item = Id> {
        let edges = self.edges.get(&id).into_iter().flatten().copied();
        edges.filter(|edge| self.has(*edge))
    }

    /// Where an edge that was made starts and ends. `None` for a node.
    pub(crate) fn ends_of(&self, id: Id) -> Option<(Id, Id)> {
        match &self.elements.get(&id)?.made.as_ref()?.1 {
            Made::Node(_) => None,
            Made::Edge(_, from, to) => Some((*from, *to)),
        }
    }

    /// How many elements were made and are not removed.
    pub fn element_count(&self) -> usize {
        let is_there = |element: &&Element| element.made.is_some() && element.removed.is_none();
        self.elements.values().filter(is_there).count()
    }

    /// The view for a schema.
    pub fn view(&self, schema: &Schema) -> View {
        let mut view = View::default();
        let mut nodes: Vec<(Stamp, Id, &str)> = Vec::new();
        let mut edges: Vec<(Stamp, Id, &str, Id, Id)> = Vec::new();
        for (id, element) in &self.elements {
            match element.made.as_ref().filter(|_| element.removed.is_none()) {
                Some((stamp, Made::Node(kind))) => nodes.push((*stamp, *id, kind)),
                Some((stamp, Made::Edge(kind, from, to))) => {
                    edges.push((*stamp, *id, kind, *from, *to));
                }
                None => {}
            }
        }
        let attributes = |kind: &str, id: &Id| {
            let element = self.elements.get(id);
            element.map_or_else(Vec::new, |element| latest(schema, kind, element))
        };
        // The older node keeps its key.
        nodes.sort_unstable();
        let mut keys: HashSet<(String, String, String)> = HashSet::new();
        for (_, id, kind) in nodes {
            let attributes = attributes(kind, &id);
            if !is_node(schema, kind, &attributes) {
                view.conflicts.push(Conflict {
                    id,
                    reason: Reason::Schema,
                });
                continue;
            }
            let own = keys_of(schema, kind, &attributes);
            if own.iter().any(|key| keys.contains(key)) {
                view.conflicts.push(Conflict {
                    id,
                    reason: Reason::Key,
                });
                continue;
            }
            keys.extend(own);
            view.nodes.insert(id, (kind.to_owned(), owned(&attributes)));
        }
        // The later edge wins.
        edges.sort_unstable();
        let mut taken: HashMap<(&str, usize, Id), u32> = HashMap::new();
        let mut parents: HashMap<(&str, Id), Id> = HashMap::new();
        edges.reverse();
        let dangling = self.dangling();
        edges.retain(|(_, id, ..)| {
            let is_dangling = dangling.binary_search(id).is_ok();
            view.conflicts.extend(is_dangling.then_some(Conflict {
                id: *id,
                reason: Reason::EndRemoved,
            }));
            !is_dangling
        });
        let ends = edges
            .iter()
            .map(|(_, id, _, from, to)| (Some(*id), [*from, *to]));
        let ends: Vec<_> = ends.collect();
        // An edge goes with its nodes, and with the edges where it starts and ends.
        let order = by_level(&ends, |id| view.nodes.contains_key(&id));
        for (_, id, kind, from, to) in order.into_iter().map(|at| edges[at]) {
            let is_shown = |end| view.nodes.contains_key(end) || view.edges.contains_key(end);
            if !is_shown(&from) || !is_shown(&to) {
                continue;
            }
            let attributes = attributes(kind, &id);
            let ends = [from, to].map(|end| self.kind_of(end).unwrap_or_default());
            let relation = schema.relation(kind);
            let reason = if is_edge(schema, kind, &attributes, ends) {
                relation.and_then(|r| loses(r, from, to, &taken, &parents))
            } else {
                Some(Reason::Schema)
            };
            if let Some(reason) = reason {
                view.conflicts.push(Conflict { id, reason });
                continue;
            }
            *taken.entry((kind, 0, from)).or_default() += 1;
            *taken.entry((kind, 1, to)).or_default() += 1;
            if let Some(tree) = relation.and_then(|r| r.tree.as_ref()) {
                let (child, parent) = if tree.child == 0 {
                    (from, to)
                } else {
                    (to, from)
                };
                parents.insert((kind, child), parent);
            }
            view.edges
                .insert(id, (kind.to_owned(), from, to, owned(&attributes)));
        }
        view.conflicts.sort_unstable();
        view
    }
}

/// The order in which edges are decided, of those that are sorted already: first those between
/// nodes, then those at these, and so on. So a later edge at an edge wins against an earlier one at
/// another edge.
fn by_level(edges: &[(Option<Id>, [Id; 2])], is_node: impl Fn(Id) -> bool) -> Vec<usize> {
    let (mut order, _) = in_order(edges, is_node);
    let mut levels: HashMap<Id, usize> = HashMap::new();
    let mut level_of = vec![0; edges.len()];
    for at in &order {
        let (id, ends) = &edges[*at];
        let below = ends.iter().filter_map(|end| levels.get(end)).max();
        level_of[*at] = below.map_or(0, |level| level + 1);
        levels.extend(id.map(|id| (id, level_of[*at])));
    }
    order.sort_unstable_by_key(|at| (level_of[*at], *at));
    order
}

fn shown<'r>(schema: &Schema, element: &'r Element) -> Option<Shown<'r>> {
    let made = element
        .made
        .as_ref()
        .filter(|_| element.removed.is_none())?;
    let (kind, ends) = match &made.1 {
        Made::Node(kind) => (kind, None),
        Made::Edge(kind, from, to) => (kind, Some((*from, *to))),
    };
    Some(Shown {
        kind,
        ends,
        attributes: latest(schema, kind, element),
    })
}

fn owned(attributes: &Allowed<'_>) -> BTreeMap<String, Value> {
    let all = attributes.iter();
    all.map(|(name, value)| (name.to_string(), (*value).clone()))
        .collect()
}

/// The attributes of an element that the schema allows. Of several that are one value, this is the one
/// that was changed last.
fn latest<'r>(schema: &Schema, kind: &str, element: &'r Element) -> Allowed<'r> {
    let declared = schema.entity(kind).map(|entity| &entity.attributes);
    let declared = declared.or_else(|| schema.relation(kind).map(|r| &r.attributes));
    let all = element.attributes.iter();
    // The usual case: each attribute is a value of its own.
    let mut of_type = declared.into_iter().flatten();
    if of_type.all(|attribute| attribute.value_of() == attribute.name) {
        let all = all.filter_map(|(name, (_, value))| Some((name, value.as_ref()?)));
        return all
            .filter(|(name, value)| allows(schema, kind, name, value))
            .collect();
    }
    let value_of = |name: &str| {
        let mut all = declared.into_iter().flatten();
        let attribute = all.find(|attribute| attribute.name == name)?;
        Some(attribute.value_of())
    };
    let mut latest: BTreeMap<&str, (Stamp, &Arc<str>, Option<&Value>)> = BTreeMap::new();
    for (name, (stamp, value)) in all {
        let own = (*stamp, name, value.as_ref());
        let known = latest.entry(value_of(name).unwrap_or(name)).or_insert(own);
        if known.0 < *stamp {
            *known = own;
        }
    }
    let all = latest.into_values();
    let all = all.filter_map(|(_, name, value)| Some((name, value?)));
    let mut all: Allowed<'_> = all
        .filter(|(name, value)| allows(schema, kind, name, value))
        .collect();
    all.sort_unstable_by_key(|(name, _)| *name);
    all
}

/// The keys of a node: the type that declares one, its name, its value.
fn keys_of(schema: &Schema, kind: &str, attributes: &Allowed<'_>) -> Vec<(String, String, String)> {
    let Some(entity) = schema.entity(kind) else {
        return Vec::new();
    };
    let keys = entity.attributes.iter().filter(|attribute| attribute.key);
    let keys = keys.filter_map(|key| {
        let value = value(attributes, &key.name)?;
        let mut declarer = entity;
        while let Some(parent) = declarer.parent.as_deref().and_then(|p| schema.entity(p)) {
            if parent.attribute(&key.name).is_none() {
                break;
            }
            declarer = parent;
        }
        Some((
            declarer.name.clone(),
            key.name.clone(),
            format!("{value:?}"),
        ))
    });
    keys.collect()
}

/// Whether an edge loses against those that are shown already.
fn loses(
    relation: &Relation,
    from: Id,
    to: Id,
    taken: &HashMap<(&str, usize, Id), u32>,
    parents: &HashMap<(&str, Id), Id>,
) -> Option<Reason> {
    let kind = relation.name.as_str();
    if let Some(tree) = &relation.tree {
        let (child, parent) = if tree.child == 0 {
            (from, to)
        } else {
            (to, from)
        };
        if parents.contains_key(&(kind, child)) {
            return Some(Reason::SecondParent);
        }
        let mut here = Some(parent);
        while let Some(node) = here {
            if node == child {
                return Some(Reason::Cycle);
            }
            here = parents.get(&(kind, node)).copied();
        }
    }
    for (at, (port, node)) in relation.ports.iter().zip([from, to]).enumerate() {
        let count = taken.get(&(kind, at, node)).copied().unwrap_or_default();
        if port.max.is_some_and(|most| count >= most) {
            return Some(Reason::Cardinality);
        }
    }
    None
}

impl View {
    /// The view as a graph.
    ///
    /// # Errors
    /// A rule is broken, or a node has too few edges at a port: that is nothing that two replicas did
    /// against each other.
    pub fn graph(&self, schema: Arc<Schema>, writer: u64) -> Result<Graph, Error> {
        let graph = Graph::new(schema, writer);
        graph.change(Time::ZERO, |edit| {
            for (id, (kind, attributes)) in &self.nodes {
                let node = edit.add_node_as(*id, kind.as_str())?;
                for (name, value) in attributes {
                    edit.set(node, name.as_str(), value.clone())?;
                }
            }
            let edges: Vec<_> = self.edges.iter().collect();
            let ends = edges
                .iter()
                .map(|(id, (_, from, to, _))| (Some(**id), [*from, *to]));
            let ends: Vec<_> = ends.collect();
            let (order, rest) = in_order(&ends, |id| self.nodes.contains_key(&id));
            if !rest.is_empty() {
                return Err(Error::Removed);
            }
            for (id, (kind, from, to, attributes)) in order.into_iter().map(|at| edges[at]) {
                let (from, to) = (edit.end(*from)?, edit.end(*to)?);
                let edge = edit.add_edge_as(*id, kind.as_str(), from, to)?;
                for (name, value) in attributes {
                    edit.set(edge, name.as_str(), value.clone())?;
                }
            }
            Ok(())
        })?;
        Ok(graph)
    }
}
