//! Attributes of nodes and edges, and the lists of names.

use super::Edit;
use crate::element::{Element, NONE, Neighbours, NodeId};
use crate::error::Error;
use crate::names::{Named, Symbol};
use crate::stored::{Attributes, Stored, value};
use crate::types::Types;
use crate::value::{MOST_BYTES, Value};
use rc_diagnostics::foreign;
use std::sync::Arc;

impl Edit {
    /// Sets an attribute.
    pub fn set(
        &mut self,
        element: impl Into<Element>,
        attribute: impl Named,
        value: impl Into<Value>,
    ) -> Result<(), Error> {
        self.step()?;
        let (element, value) = (self.owner(element.into()), value.into());
        let attribute = self.name(attribute);
        self.check_value(attribute, &value)?;
        self.put(element, attribute, Some(value))
    }

    /// Sets many attributes of one element, in a time in proportion to their number. Of two with
    /// the same name, the last one counts.
    pub fn set_all<N: Named, V: Into<Value>>(
        &mut self,
        element: impl Into<Element>,
        values: impl IntoIterator<Item = (N, V)>,
    ) -> Result<(), Error> {
        let element = self.owner(element.into());
        let before = self.next.attributes(element)?.clone();
        let mut set = std::mem::take(&mut self.set);
        for (attribute, value) in values {
            self.step()?;
            let (attribute, value) = (self.name(attribute), value.into());
            self.check_value(attribute, &value)?;
            set.push((attribute, value));
        }
        if set.is_empty() {
            return Ok(());
        }
        let types = Arc::clone(&self.next.types);
        let kind = self.next.kind(element)?;
        let mut set = last_of_each_value(&types, kind, set);
        for (attribute, value) in &set {
            self.note((element, kind), &types, *attribute, Some(value))?;
        }
        let new = set.drain(..);
        let new = new.map(|(attribute, value)| (attribute, stored(&types, kind, attribute, value)));
        let all: Arc<[(Symbol, Stored)]> = if let Some(before) = before {
            let new: Vec<_> = new.collect();
            let groups = new
                .iter()
                .filter_map(|(symbol, _)| types.group(kind, *symbol));
            let replaced: Vec<Symbol> = groups.flatten().map(|(symbol, _)| *symbol).collect();
            let kept = before.iter().filter(|(own, _)| !replaced.contains(own));
            last_of_each(kept.cloned().chain(new).collect()).into()
        } else {
            new.collect()
        };
        self.set = set;
        *self.attributes(element)? = Some(all);
        self.touch(element);
        Ok(())
    }

    fn check_value(&self, attribute: Symbol, value: &Value) -> Result<(), Error> {
        if !value.is_finite() {
            return Err(Error::NotFinite(self.cleaned(attribute)));
        }
        if value.size() > MOST_BYTES && !matches!(value, Value::Text(_) | Value::Texts(_)) {
            return Err(Error::TooManyBytes(self.cleaned(attribute)));
        }
        Ok(())
    }

    /// Removes an attribute. It is not an error if the element has none.
    pub fn unset(
        &mut self,
        element: impl Into<Element>,
        attribute: impl Named,
    ) -> Result<(), Error> {
        self.step()?;
        let element = self.owner(element.into());
        match self.next.symbol(attribute) {
            Some(attribute) => self.put(element, attribute, None),
            None => self.next.attributes(element).map(|_| ()),
        }
    }

    fn cleaned(&self, symbol: Symbol) -> String {
        foreign::clean(self.next.text(symbol))
    }

    fn put(
        &mut self,
        element: Element,
        attribute: Symbol,
        value: Option<Value>,
    ) -> Result<(), Error> {
        let types = Arc::clone(&self.next.types);
        let kind = self.next.kind(element)?;
        self.note((element, kind), &types, attribute, value.as_ref())?;
        let value = value.map(|value| stored(&types, kind, attribute, value));
        let all = self.attributes(element)?;
        // The value is there once, as the attribute that was set last.
        for (other, _) in types.group(kind, attribute).unwrap_or_default() {
            if *other != attribute {
                store(all, *other, None);
            }
        }
        store(all, attribute, value);
        self.touch(element);
        Ok(())
    }

    pub(super) fn attributes(&mut self, element: Element) -> Result<&mut Attributes, Error> {
        let found = match element {
            Element::Node(node) => {
                let here = self.next.nodes.get_mut(node.place as usize);
                here.map(|node| &mut node.attributes)
            }
            Element::Edge(edge) => {
                let here = self.next.edges.get_mut(edge.place as usize);
                here.map(|edge| &mut edge.attributes)
            }
        };
        found.ok_or(Error::Removed)
    }

    /// Notes what else an attribute of an element of a type changes: names, keys, trees and histories.
    fn note(
        &mut self,
        (element, kind): (Element, Symbol),
        types: &Types,
        attribute: Symbol,
        value: Option<&Value>,
    ) -> Result<(), Error> {
        match element {
            Element::Node(node) => {
                if attribute == types.name {
                    self.unname(node)?;
                    if let Some(Value::Text(text)) = value {
                        self.rename(node, text)?;
                    }
                }
                let entity = types.entity(kind);
                if entity.is_some_and(|e| e.keys.iter().any(|(key, _)| *key == attribute)) {
                    self.keyed.push(node.place);
                }
            }
            Element::Edge(edge) => {
                let here = self.next.edge_of(edge)?;
                let (from, to) = (here.from, here.to);
                let ends = (self.next.node_at(from), self.next.node_at(to));
                if let (Some(from), Some(to)) = ends {
                    self.note_moved(kind, from, to);
                }
            }
        }
        if types.has_history {
            let keeps = |symbol: Symbol| {
                let history = types.attribute(kind, symbol)?.history;
                history.map(|_| (element, symbol))
            };
            // Another attribute may have the value, too.
            let own = [(attribute, 0)];
            let all = types.group(kind, attribute).unwrap_or(&own).iter();
            self.kept
                .extend(all.filter_map(|(symbol, _)| keeps(*symbol)));
        }
        Ok(())
    }

    /// Takes a node out of the list of its name.
    pub(super) fn unname(&mut self, node: NodeId) -> Result<(), Error> {
        let here = self.next.nodes.get(node.place as usize);
        let attributes = &here.ok_or(Error::Removed)?.attributes;
        let Some(Value::Text(name)) = value(attributes, self.next.types.name) else {
            return Ok(());
        };
        let name = Arc::clone(name);
        let list = self.lists(node.place)?.of_name;
        if list.next != NONE {
            self.lists(list.next)?.of_name.previous = list.previous;
        }
        if list.previous == NONE {
            let named = &mut self.shape().named;
            named.remove(&*name);
            if list.next != NONE {
                named.insert(name, list.next);
            }
        } else {
            self.lists(list.previous)?.of_name.next = list.next;
        }
        self.lists(node.place)?.of_name = Neighbours::NO;
        Ok(())
    }

    /// Puts a node into the list of a name.
    fn rename(&mut self, node: NodeId, name: &Arc<str>) -> Result<(), Error> {
        let first = self.shape().named.replace(Arc::clone(name), node.place);
        self.lists(node.place)?.of_name.next = first.unwrap_or(NONE);
        if let Some(first) = first {
            self.lists(first)?.of_name.previous = node.place;
        }
        Ok(())
    }
}

/// A value as elements hold it.
fn stored(types: &Types, kind: Symbol, attribute: Symbol, value: Value) -> Stored {
    match types.group(kind, attribute) {
        Some(group) => Stored::shared(value, group.len()),
        None => Stored::Plain(value),
    }
}

/// Whether two attributes have one value.
fn is_one_value(types: &Types, kind: Symbol, one: Symbol, other: Symbol) -> bool {
    let group = types.group(kind, one).unwrap_or_default();
    one == other || group.iter().any(|(symbol, _)| *symbol == other)
}

/// Of several attributes that have one value, the last one.
fn last_of_each_value(
    types: &Types,
    kind: Symbol,
    set: Vec<(Symbol, Value)>,
) -> Vec<(Symbol, Value)> {
    if !types.has_groups {
        return last_of_each(set);
    }
    let mut kept: Vec<(Symbol, Value)> = Vec::with_capacity(set.len());
    for entry in set.into_iter().rev() {
        let is_group = types.group(kind, entry.0).is_some();
        if !is_group
            || kept
                .iter()
                .all(|(later, _)| !is_one_value(types, kind, *later, entry.0))
        {
            kept.push(entry);
        }
    }
    kept.reverse();
    last_of_each(kept)
}

/// Attributes in the order of their symbols. Of several with one name, the last one stays.
fn last_of_each<V>(mut all: Vec<(Symbol, V)>) -> Vec<(Symbol, V)> {
    // The sort is stable.
    all.sort_by_key(|(attribute, _)| *attribute);
    if all.is_sorted_by(|one, next| one.0 < next.0) {
        return all;
    }
    let mut kept: Vec<(Symbol, V)> = Vec::with_capacity(all.len());
    for entry in all {
        match kept.last_mut() {
            Some(last) if last.0 == entry.0 => *last = entry,
            _ => kept.push(entry),
        }
    }
    kept
}

/// Sets or removes one of the attributes. They stay in the order of their symbols.
fn store(attributes: &mut Attributes, attribute: Symbol, value: Option<Stored>) {
    let old = attributes.as_deref().unwrap_or_default();
    let at = old.iter().position(|(known, _)| *known >= attribute);
    let at = at.unwrap_or(old.len());
    let is_there = old.get(at).is_some_and(|(known, _)| *known == attribute);
    if is_there && let Some(value) = value {
        // The usual case: one value is another one.
        if let Some(all) = attributes.as_mut() {
            Arc::make_mut(all)[at].1 = value;
        }
        return;
    }
    let rest = &old[at + usize::from(is_there)..];
    let new = value.map(|value| (attribute, value));
    let all: Arc<[_]> = old[..at]
        .iter()
        .cloned()
        .chain(new)
        .chain(rest.iter().cloned())
        .collect();
    *attributes = (!all.is_empty()).then_some(all);
}
