//! Shows the contents of the replica in the graph: only the changed elements, if that is enough.

use crate::core::Core;
use crate::start::attributes;
use graph_merge::{Hidden, Record, Shown, allows};
use property_graph::{Edit, Element, Error, Graph, Id, Symbol, Time, Value, in_order};
use std::collections::BTreeSet;
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

/// The numbers of the names that many elements have: a replica has most of these once.
#[derive(Default)]
struct Names<'r> {
    known: Vec<(&'r str, Symbol)>,
    /// Memory for the attributes of one element.
    set: Vec<(Symbol, Value)>,
}

impl<'r> Names<'r> {
    fn of(&mut self, edit: &mut Edit, name: &'r str) -> Symbol {
        let mut known = self.known.iter();
        if let Some((_, symbol)) = known.find(|(known, _)| std::ptr::eq(*known, name)) {
            return *symbol;
        }
        let symbol = edit.name(name);
        if self.known.len() == 16 {
            self.known.clear();
        }
        self.known.push((name, symbol));
        symbol
    }
}

impl Core {
    /// Shows values of attributes of which the graph shows earlier ones: the usual case of a change, without a look
    /// at the other attributes. Returns `false`, and shows none, if one of them is `None` or something else.
    pub(crate) fn show_values<'v>(
        &self,
        graph: &Graph,
        time: Time,
        values: impl Iterator<Item = Option<(Id, &'v str, &'v Value)>>,
    ) -> bool {
        if !self.is_whole || self.is_stale {
            return false;
        }
        let shown = graph.change(time, |edit| {
            let mut is_equal = true;
            for value in values {
                let (of, name, value) = value.ok_or(Refused::NotWhole)?;
                let now = edit.snapshot();
                let element = now.find(of).ok_or(Refused::NotWhole)?;
                let symbol = now.symbol(name).ok_or(Refused::NotWhole)?;
                let known = now.set_as(element, symbol).ok_or(Refused::NotWhole)?;
                if known != value {
                    edit.set(element, symbol, value.clone())?;
                    is_equal = false;
                }
            }
            if is_equal {
                return Err(Refused::Equal);
            }
            Ok(())
        });
        matches!(shown, Ok(()) | Err(Refused::Equal))
    }

    /// The value that a record gives an attribute, for [`Self::show_values`]. `None` if it is not the one to show.
    pub(crate) fn value_of<'r>(&self, record: &'r Record) -> Option<(Id, &'r str, &'r Value)> {
        let Record::Attribute {
            stamp,
            of,
            name,
            value: Some(value),
        } = record
        else {
            return None;
        };
        let is_latest = self.replica.stamp_of(*of, name) == Some(*stamp);
        // A stream may have given the attribute a later value.
        let has_streams = self.streams.len() > 0 && self.streams.of(*of).next().is_some();
        (is_latest && !has_streams).then_some((*of, name, value))
    }

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
        // Where nothing is, nothing has to be found.
        let now = edit.snapshot();
        let is_empty = now.node_count() + now.edge_count() == 0;
        let known = |edit: &Edit, id: Id| {
            let now = edit.snapshot();
            (!is_empty).then(|| now.find(id)).flatten()
        };
        let mut gone = Vec::new();
        let mut there: Vec<(Id, Shown<'_>)> = Vec::new();
        for (id, shown) in self.replica.elements(&self.schema, touched) {
            match shown {
                Some(shown) => there.push((id, shown)),
                None if self.replica.is_end(id) => return Err(Refused::NotWhole),
                None => gone.push(id),
            }
        }
        for id in gone {
            match known(edit, id) {
                Some(Element::Edge(edge)) => edit.remove_edge(edge)?,
                Some(Element::Node(node)) => edit.remove_node(node)?,
                None => continue,
            }
            is_equal = false;
        }
        let mut names = Names::default();
        let nodes = there.iter_mut().filter(|(_, shown)| shown.ends.is_none());
        for (id, shown) in nodes {
            let before = known(edit, *id);
            let node = match before {
                Some(Element::Node(node))
                    if edit.snapshot().node(node)?.type_name() == shown.kind =>
                {
                    Element::Node(node)
                }
                Some(_) => return Err(Refused::NotWhole),
                None => {
                    is_equal = false;
                    let kind = names.of(edit, shown.kind);
                    Element::Node(edit.add_node_as(*id, kind)?)
                }
            };
            is_equal &= self.set(edit, &mut names, (*id, node, before.is_none()), shown)?;
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
            let before = known(edit, *id);
            let edge = match before {
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
                    let kind = names.of(edit, shown.kind);
                    edit.add_edge_as(*id, kind, from, to)?
                }
            };
            is_equal &= self.set(
                edit,
                &mut names,
                (*id, Element::Edge(edge), before.is_none()),
                shown,
            )?;
        }
        if is_equal {
            return Err(Refused::Equal);
        }
        Ok(())
    }

    /// Gives an element its attributes. Returns whether it has them already.
    fn set<'r>(
        &'r self,
        edit: &mut Edit,
        names: &mut Names<'r>,
        (id, element, is_new): (Id, Element, bool),
        shown: &mut Shown<'r>,
    ) -> Result<bool, Error> {
        let mut wanted = std::mem::take(&mut shown.attributes);
        let place = |all: &[(&Arc<str>, &Value)], name: &str| {
            all.binary_search_by(|(known, _)| (***known).cmp(name))
        };
        for (name, value) in self.streamed(id, shown.kind) {
            if let Ok(at) = place(&wanted, name) {
                wanted[at].1 = value;
            }
        }
        let mut gone: Vec<String> = Vec::new();
        let owned = (!is_new).then(|| attributes(edit.snapshot(), element));
        for (name, own) in owned.transpose()?.into_iter().flatten() {
            match place(&wanted, name) {
                Err(_) => gone.push(name.to_owned()),
                Ok(at) if wanted[at].1 == own => {
                    wanted.remove(at);
                }
                Ok(_) => {}
            }
        }
        for name in &gone {
            edit.unset(element, name)?;
        }
        if let [(name, value)] = wanted[..] {
            // The usual case: a change sets one attribute.
            let name = names.of(edit, name);
            edit.set(element, name, value.clone())?;
        } else if !wanted.is_empty() {
            for (name, value) in &wanted {
                let name = names.of(edit, name);
                names.set.push((name, (*value).clone()));
            }
            edit.set_all(element, names.set.drain(..))?;
        }
        Ok(gone.is_empty() && wanted.is_empty())
    }

    /// The attributes of an element to which streams give values, with these.
    fn streamed<'c>(&'c self, id: Id, kind: &str) -> impl Iterator<Item = (&'c str, &'c Value)> {
        let all = self.streams.of(id).filter(move |(name, stamp, value)| {
            self.overrides(id, name, *stamp) && allows(&self.schema, kind, name, value)
        });
        all.map(|(name, _, value)| (name, value))
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
        let nodes = view
            .nodes
            .iter_mut()
            .map(|(id, (kind, all))| (id, kind, all));
        let edges = view.edges.iter_mut();
        let edges = edges.map(|(id, (kind, _, _, all))| (id, kind, all));
        for (id, kind, attributes) in nodes.chain(edges) {
            for (name, value) in self.streamed(*id, kind) {
                if let Some(shown) = attributes.get_mut(name) {
                    *shown = value.clone();
                }
            }
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
