//! The attributes of an element of a replica.

use crate::record::Stamp;
use property_graph::Value;
use std::sync::Arc;

/// When an attribute was last changed, and its value. `None` if it was removed.
pub(crate) type Set = (Stamp, Option<Value>);

/// Attributes, in the order of their names. An element has few, so one block of memory holds them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Attributes(Vec<(Arc<str>, Set)>);

impl Attributes {
    fn place(&self, name: &str) -> Result<usize, usize> {
        self.0.binary_search_by(|(known, _)| (**known).cmp(name))
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Set> {
        self.place(name).ok().map(|at| &self.0[at].1)
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.place(name).is_ok()
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (&Arc<str>, &Set)> {
        self.0.iter().map(|(name, set)| (name, set))
    }

    /// Sets an attribute.
    pub(crate) fn insert(&mut self, name: &Arc<str>, set: Set) {
        match self.place(name) {
            Ok(at) => self.0[at].1 = set,
            Err(at) => self.0.insert(at, (Arc::clone(name), set)),
        }
    }

    /// Whether a name comes after all others.
    pub(crate) fn is_last(&self, name: &str) -> bool {
        self.0.last().is_none_or(|(last, _)| **last < *name)
    }

    /// Adds an attribute whose name comes after all others.
    pub(crate) fn push(&mut self, name: &Arc<str>, set: Set) {
        self.0.push((Arc::clone(name), set));
    }
}
