//! A member of a slot array, as handlers see it.

use std::sync::Arc;

/// A member of a slot array. Its clones are the same member, and cheap.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Member {
    index: usize,
    slot: usize,
    name: Arc<str>,
}

impl Member {
    /// The member `name`, which is number `index` of its array and number `slot` of the component.
    pub fn new(index: usize, slot: usize, name: &str) -> Self {
        Self {
            index,
            slot,
            name: Arc::from(name),
        }
    }

    /// Number in the array, in the order in which the worker opened the members, from 0: an
    /// index into a list that the worker keeps.
    pub fn index(&self) -> usize {
        self.index
    }

    /// Name, as the worker opened it: `front`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number among all slots of the component: those of the description come first.
    pub fn slot(&self) -> usize {
        self.slot
    }
}
