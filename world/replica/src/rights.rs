//! The types and attributes that a component writes, and the attributes that are streams.

use crate::error::Error;
use graph_schema::Schema;
use property_graph::{Change, Element, Id, Snapshot};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// The types and attributes that a component writes. A right for a type also holds for those that
/// inherit from it.
#[derive(Clone, Debug, Default)]
pub struct Rights {
    everything: bool,
    types: BTreeSet<String>,
    attributes: BTreeSet<(String, String)>,
    streams: BTreeMap<(String, String), Duration>,
}

impl Rights {
    /// May write everything.
    pub fn everything() -> Self {
        Self {
            everything: true,
            ..Self::default()
        }
    }

    /// May write nothing.
    pub fn nothing() -> Self {
        Self::default()
    }

    /// Also adds, removes and changes elements of a type.
    #[must_use]
    pub fn with_type(mut self, kind: &str) -> Self {
        self.types.insert(kind.to_owned());
        self
    }

    /// Also changes an attribute of a type.
    #[must_use]
    pub fn with_attribute(mut self, kind: &str, attribute: &str) -> Self {
        let right = (kind.to_owned(), attribute.to_owned());
        self.attributes.insert(right);
        self
    }

    /// Also changes an attribute as a stream: others get the newest value, without repair of lost
    /// ones. It is sent at most once in this time; with 0, at each change.
    #[must_use]
    pub fn with_stream(mut self, kind: &str, attribute: &str, at_most_each: Duration) -> Self {
        let right = (kind.to_owned(), attribute.to_owned());
        self.attributes.insert(right.clone());
        self.streams.insert(right, at_most_each);
        self
    }

    /// How often an attribute is sent at most, if it is a stream.
    pub(crate) fn stream(&self, schema: &Schema, kind: &str, attribute: &str) -> Option<Duration> {
        if self.streams.is_empty() {
            return None;
        }
        let mut all = schema.ancestry(kind);
        all.find_map(|kind| {
            self.streams
                .get(&(kind.to_owned(), attribute.to_owned()))
                .copied()
        })
    }

    fn may_write(&self, schema: &Schema, kind: &str, attribute: Option<&str>) -> bool {
        self.everything
            || schema.ancestry(kind).any(|kind| {
                self.types.contains(kind)
                    || attribute.is_some_and(|attribute| {
                        let right = (kind.to_owned(), attribute.to_owned());
                        self.attributes.contains(&right)
                    })
            })
    }

    /// Refuses changes that the component does not write, and ids that do not come from its
    /// replica. `is_own` says which ids do.
    pub(crate) fn check(
        &self,
        before: &Snapshot,
        after: &Snapshot,
        changes: &[Change],
        is_own: impl Fn(Id) -> bool,
    ) -> Result<(), Error> {
        for change in changes {
            let (of, element, attribute) = match change {
                Change::NodeRemoved(node, _) => (before, Element::Node(*node), None),
                Change::EdgeRemoved(edge, _) => (before, Element::Edge(*edge), None),
                Change::NodeAdded(node) => {
                    if !is_own(after.node(*node)?.id()) {
                        return Err(Error::ForeignId);
                    }
                    (after, Element::Node(*node), None)
                }
                Change::EdgeAdded(edge) => {
                    if !is_own(after.edge(*edge)?.id()) {
                        return Err(Error::ForeignId);
                    }
                    (after, Element::Edge(*edge), None)
                }
                Change::Attribute(element, attribute) => {
                    (after, *element, Some(after.text(*attribute)))
                }
            };
            if self.everything {
                continue;
            }
            let kind = type_of(of, element)?;
            if !self.may_write(of.schema(), kind, attribute) {
                let what = attribute.map_or_else(String::new, |name| format!(".{name}"));
                let what = format!("{kind}{what}");
                return Err(Error::NotWritten(rc_diagnostics::foreign::clean(&what)));
            }
        }
        Ok(())
    }
}

/// The type of an element.
pub(crate) fn type_of(of: &Snapshot, element: Element) -> Result<&str, property_graph::Error> {
    match element {
        Element::Node(node) => Ok(of.node(node)?.type_name()),
        Element::Edge(edge) => Ok(of.edge(edge)?.type_name()),
    }
}
