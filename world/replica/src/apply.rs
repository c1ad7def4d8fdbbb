//! Shows the contents of the replica in the graph: only the changed elements, if that is enough.

use crate::core::Core;
use crate::start::attributes;
use graph_merge::{Hidden, Shown, allows};
use property_graph::{Edit, Element, Error, Graph, Id, Time, Value, in_order};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Why a change is not shown alone.
enum Refused {
    /// The graph shows it already.
    Equal,
    /// Something else decides which elements are shown.
    NotWhole,
    Wrong,
}

impl From<Error> for Refused {
    fn from(_: Error) -> Self {
        Self::Wrong
    }
}

impl Core {
    /// Shows elements that have changed, or leaves it to the next turn.
    pub(crate) fn show(&mut self, graph: &Graph, time: Time, touched: &BTreeSet<Id>) {
        if touched.is_empty() || self.is_stale {
            return;
        }
        let shown = if self.is_whole {
            graph.change(time, |edit| self.show_in(edit, touched))
        } else {
            self.show_beside(graph, time, touched)
        };
        // That takes a time in proportion to the graph: once for all messages of a turn.
        self.is_stale = matches!(shown, Err(Refused::NotWhole | Refused::Wrong));
    }

    /// Shows elements while others stay out: those that decide about no other one.
    fn show_beside(
        &mut self,
        graph: &Graph,
        time: Time,
        touched: &BTreeSet<Id>,
    ) -> Result<(), Refused> {
        if self.fault.is_some() {
            return Err(Refused::NotWhole);
        }
        let now = graph.snapshot();
        let shown = self
            .hidden
            .update(&self.replica, &self.schema, &now, touched);
        let shown = shown.ok_or(Refused::NotWhole)?;
        self.conflicts = self.hidden.conflicts();
        graph.change(time, |edit| self.show_in(edit, &shown))
    }

    fn show_in(&self, edit: &mut Edit, touched: &BTreeSet<Id>) -> Result<(), Refused> {
        let mut is_equal = true;
        let mut gone = Vec::new();
        let mut there: Vec<(Id, Shown<'_>)> = Vec::new();
        for id in touched {
            match self.replica.element(&self.schema, *id) {
                Some(shown) => there.push((*id, shown)),
                None if self.replica.is_end(*id) => return Err(Refused::NotWhole),
                None => gone.push(*id),
            }
        }
        for id in gone {
            match edit.snapshot().find(id) {
                Some(Element::Edge(edge)) => edit.remove_edge(edge)?,
                Some(Element::Node(node)) => edit.remove_node(node)?,
                None => continue,
            }
            is_equal = false;
        }
        let nodes = there.iter_mut().filter(|(_, shown)| shown.ends.is_none());
        for (id, shown) in nodes {
            let node = match edit.snapshot().find(*id) {
                Some(Element::Node(node))
                    if edit.snapshot().node(node)?.type_name() == shown.kind =>
                {
                    Element::Node(node)
                }
                Some(_) => return Err(Refused::NotWhole),
                None => {
                    is_equal = false;
                    Element::Node(edit.add_node_as(*id, shown.kind)?)
                }
            };
            is_equal &= self.set(edit, *id, node, shown)?;
        }
        let edges = there.iter_mut().filter(|(_, shown)| shown.ends.is_some());
        let mut edges: Vec<_> = edges.collect();
        let ends = edges.iter().filter_map(|(id, shown)| {
            let (from, to) = shown.ends?;
            Some((Some(*id), [from, to]))
        });
        let ends: Vec<_> = ends.collect();
        let (order, rest) = in_order(&ends, |id| edit.snapshot().find(id).is_some());
        if !rest.is_empty() {
            return Err(Refused::NotWhole);
        }
        for at in order {
            let ((id, shown), [from, to]) = (&mut *edges[at], ends[at].1);
            let edge = match edit.snapshot().find(*id) {
                Some(Element::Edge(edge)) => {
                    let now = edit.snapshot();
                    let here = now.edge(edge)?;
                    let own = [now.node(here.from())?.id(), now.node(here.to())?.id()];
                    if here.type_name() != shown.kind || own != [from, to] {
                        return Err(Refused::NotWhole);
                    }
                    edge
                }
                Some(Element::Node(_)) => return Err(Refused::NotWhole),
                None => {
                    is_equal = false;
                    let (from, to) = (edit.end(from)?, edit.end(to)?);
                    edit.add_edge_as(*id, shown.kind, from, to)?
                }
            };
            is_equal &= self.set(edit, *id, Element::Edge(edge), shown)?;
        }
        if is_equal {
            return Err(Refused::Equal);
        }
        Ok(())
    }

    /// Gives an element its attributes. Returns whether it has them already.
    fn set(
        &self,
        edit: &mut Edit,
        id: Id,
        element: Element,
        shown: &mut Shown<'_>,
    ) -> Result<bool, Error> {
        let mut wanted = std::mem::take(&mut shown.attributes);
        self.streamed(id, shown.kind, &mut wanted);
        let mut gone: Vec<String> = Vec::new();
        for (name, own) in attributes(edit.snapshot(), element)? {
            match wanted.get(name) {
                None => gone.push(name.to_owned()),
                Some(wanted_value) if wanted_value == own => {
                    wanted.remove(name);
                }
                Some(_) => {}
            }
        }
        for name in &gone {
            edit.unset(element, name)?;
        }
        if !wanted.is_empty() {
            let set = wanted.iter();
            edit.set_all(element, set.map(|(name, value)| (name, value.clone())))?;
        }
        Ok(gone.is_empty() && wanted.is_empty())
    }

    /// Puts in the values of streams.
    fn streamed(&self, id: Id, kind: &str, attributes: &mut BTreeMap<String, Value>) {
        for (name, stamp, value) in self.streams.of(id) {
            if self.overrides(id, name, stamp)
                && let Some(shown) = attributes.get_mut(name)
                && allows(&self.schema, kind, name, value)
            {
                *shown = value.clone();
            }
        }
    }

    /// Whether a value of a stream is later than the last change of the attribute. An attribute
    /// without a value is none of a stream.
    pub(crate) fn overrides(&self, id: Id, name: &str, stamp: (u64, u64)) -> bool {
        let changed = self.replica.stamp_of(id, name);
        changed.is_some_and(|changed| (changed.count, changed.writer) < stamp)
    }

    /// Shows the whole replica, and notes what stays out of it.
    pub(crate) fn show_all(&mut self, graph: &Graph, time: Time) {
        self.is_stale = false;
        let mut view = self.replica.view(&self.schema);
        for (id, (kind, attributes)) in &mut view.nodes {
            self.streamed(*id, kind, attributes);
        }
        for (id, (kind, _, _, attributes)) in &mut view.edges {
            self.streamed(*id, kind, attributes);
        }
        let wanted = view.graph(Arc::clone(&self.schema), self.replica.writer());
        let shown = wanted.and_then(|wanted| graph.adopt(time, &wanted.snapshot()));
        self.fault = shown.err().map(|error| error.to_string());
        let count = view.nodes.len() + view.edges.len();
        self.is_whole = self.fault.is_none()
            && view.conflicts.is_empty()
            && count == self.replica.element_count();
        self.hidden = Hidden::of(&view, &self.replica);
        self.conflicts = view.conflicts;
    }
}
