//! The elements that are hidden in a view, kept from one message to the next, because most messages
//! do not change them.

use crate::replica::Replica;
use crate::sound::{is_edge, is_node};
use crate::view::{Conflict, Reason, View};
use graph_schema::Schema;
use property_graph::{Element, Id, Snapshot};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The conflicts of a view, and the effect of a change on them.
///
/// Elements that are shown together are allowed together, in whatever order they were made. So a
/// new element that fits to all shown ones changes no decision, and a removal or a key that becomes
/// free changes only those about elements of the same type.
#[derive(Clone, Debug, Default)]
pub struct Hidden {
    conflicts: BTreeMap<Id, Reason>,
    /// How many edges of each relation lose against others.
    losers: HashMap<String, usize>,
    /// How many nodes lose their keys.
    keys: usize,
}

impl Hidden {
    /// The hidden elements of a view.
    pub fn of(view: &View, replica: &Replica) -> Self {
        let mut hidden = Self::default();
        for conflict in &view.conflicts {
            hidden.add(replica, *conflict);
        }
        hidden
    }

    fn add(&mut self, replica: &Replica, Conflict { id, reason }: Conflict) {
        self.conflicts.insert(id, reason);
        match reason {
            Reason::Key => self.keys += 1,
            Reason::SecondParent | Reason::Cycle | Reason::Cardinality => {
                let kind = replica.kind_of(id).unwrap_or_default();
                *self.losers.entry(kind.to_owned()).or_default() += 1;
            }
            Reason::EndRemoved | Reason::Schema => {}
        }
    }

    /// The conflicts, in the order of their ids.
    pub fn conflicts(&self) -> Vec<Conflict> {
        let all = self.conflicts.iter();
        let all = all.map(|(id, reason)| Conflict {
            id: *id,
            reason: *reason,
        });
        all.collect()
    }

    /// The elements to show after a change, of those that it has touched, where a graph shows the view
    /// before. `None` if the change may decide about others: then the whole view has to be made. The
    /// graph decides whether the elements fit; if it refuses them, the whole view has to be made, too.
    ///
    /// It takes a time in proportion to what is touched, and to the edges there.
    pub fn update(
        &mut self,
        replica: &Replica,
        schema: &Schema,
        graph: &Snapshot,
        touched: &BTreeSet<Id>,
    ) -> Option<BTreeSet<Id>> {
        let mut dangling = BTreeSet::new();
        let mut shown = BTreeSet::new();
        let is_node = |id: &&Id| replica.ends_of(**id).is_none();
        let (nodes, edges): (Vec<&Id>, Vec<&Id>) = touched.iter().partition(is_node);
        for id in nodes.into_iter().chain(edges) {
            let known = self.conflicts.get(id);
            match (replica.has(*id), graph.find(*id)) {
                (false, before) => {
                    // An edge that is left there has lost its end. A loser that is removed is
                    // decided again.
                    let is_loser = known.is_some_and(|reason| *reason != Reason::EndRemoved);
                    if is_loser || replica.is_end(*id) || self.frees(schema, graph, before) {
                        return None;
                    }
                }
                (true, Some(before)) => {
                    if !self.keeps(replica, schema, graph, *id, before) {
                        return None;
                    }
                }
                (true, None) => match known {
                    Some(Reason::Key | Reason::Schema) => return None,
                    // It has lost against others, which are still there.
                    Some(_) => continue,
                    None => match self.comes(
                        replica,
                        schema,
                        graph,
                        [touched, &shown, &dangling],
                        *id,
                    )? {
                        Arrival::Shown => {}
                        Arrival::Waits => continue,
                        Arrival::Dangles => {
                            dangling.insert(*id);
                            continue;
                        }
                    },
                },
            }
            shown.insert(*id);
        }
        for id in touched.iter().filter(|id| !replica.has(**id)) {
            self.conflicts.remove(id);
        }
        let dangling = dangling.into_iter().map(|id| (id, Reason::EndRemoved));
        self.conflicts.extend(dangling);
        Some(shown)
    }

    /// Whether something that loses may come back when this goes.
    fn frees(&self, schema: &Schema, graph: &Snapshot, gone: Option<Element>) -> bool {
        let kind = gone.and_then(|gone| graph.type_of(gone));
        let Some(kind) = kind.map(|kind| graph.text(kind)) else {
            return false;
        };
        match gone {
            Some(Element::Edge(_)) => self.losers.contains_key(kind),
            _ => self.keys > 0 && has_keys(schema, kind),
        }
    }

    /// Whether an element that is shown only has other attributes, which take and free no key.
    fn keeps(
        &self,
        replica: &Replica,
        schema: &Schema,
        graph: &Snapshot,
        id: Id,
        before: Element,
    ) -> bool {
        let Some(now) = replica.element(schema, id) else {
            return false;
        };
        let kind = graph.type_of(before).map(|kind| graph.text(kind));
        if kind != Some(now.kind) || now.ends.is_some() != matches!(before, Element::Edge(_)) {
            return false;
        }
        let is_sound = match now.ends {
            None => is_node(schema, now.kind, &now.attributes),
            Some((from, to)) => {
                let ends = [from, to].map(|end| replica.kind_of(end).unwrap_or_default());
                is_edge(schema, now.kind, &now.attributes, ends)
            }
        };
        if !is_sound || self.keys == 0 || now.ends.is_some() {
            return is_sound;
        }
        let keys = schema
            .entity(now.kind)
            .into_iter()
            .flat_map(|e| &e.attributes);
        let mut keys = keys.filter(|attribute| attribute.key);
        keys.all(|key| graph.get(before, key.name.as_str()) == now.get(&key.name))
    }

    /// The state of a new element. `None` if others wait for it, or if it may take a key.
    fn comes(
        &self,
        replica: &Replica,
        schema: &Schema,
        graph: &Snapshot,
        [touched, shown, dangling]: [&BTreeSet<Id>; 3],
        id: Id,
    ) -> Option<Arrival> {
        let now = replica.element(schema, id)?;
        if replica.edges_at(id).any(|edge| !touched.contains(&edge)) {
            return None;
        }
        let Some((from, to)) = now.ends else {
            let is_free = self.keys == 0 || !has_keys(schema, now.kind);
            let is_sound = is_free && is_node(schema, now.kind, &now.attributes);
            return is_sound.then_some(Arrival::Shown);
        };
        // An edge that is decided later may dangle, or be shown.
        let is_later =
            |end: Id| end > id && touched.contains(&end) && replica.ends_of(end).is_some();
        let is_known = |end: Id| graph.find(end).is_some() || shown.contains(&end);
        let dangles = |end: Id| {
            let before = self.conflicts.get(&end) == Some(&Reason::EndRemoved);
            replica.is_removed(end) || before || dangling.contains(&end)
        };
        if [from, to].into_iter().any(dangles) {
            return Some(Arrival::Dangles);
        }
        if [from, to]
            .into_iter()
            .any(|end| !is_known(end) && is_later(end))
        {
            return None;
        }
        if ![from, to].into_iter().all(is_known) {
            return Some(Arrival::Waits);
        }
        let ends = [from, to].map(|end| replica.kind_of(end).unwrap_or_default());
        // One that loses already may lose by another rule now.
        if self.losers.contains_key(now.kind)
            && (has_both(schema, now.kind) || self.meets_loser(replica, [from, to]))
        {
            return None;
        }
        is_edge(schema, now.kind, &now.attributes, ends).then_some(Arrival::Shown)
    }

    /// Whether an edge that loses against others starts or ends at one of these.
    fn meets_loser(&self, replica: &Replica, at: [Id; 2]) -> bool {
        let mut losers = self.conflicts.keys().filter_map(|id| replica.ends_of(*id));
        losers.any(|(from, to)| at.contains(&from) || at.contains(&to))
    }
}

/// The state of a new element.
enum Arrival {
    Shown,
    /// One of its ends is not shown.
    Waits,
    /// One of its ends was removed.
    Dangles,
}

fn has_keys(schema: &Schema, kind: &str) -> bool {
    let entity = schema.entity(kind);
    entity.is_some_and(|entity| entity.attributes.iter().any(|attribute| attribute.key))
}

/// Whether a relation is a tree whose ports have most edges: a new edge may close a cycle for one that loses
/// by these.
fn has_both(schema: &Schema, kind: &str) -> bool {
    let relation = schema.relation(kind).filter(|r| r.tree.is_some());
    relation.is_some_and(|relation| relation.ports.iter().any(|port| port.max.is_some()))
}
