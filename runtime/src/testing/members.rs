//! The members of slot arrays for a test whose fake peers are not those of this module: that of a
//! worker in another language.

use super::slots;
use crate::description::Description;
use crate::error::StartError;
use crate::member::{Member, MemberError};
use crate::slots::SlotTable;

/// The members that a worker under test opens. It refuses what a process refuses.
pub struct TestMembers {
    description: &'static Description,
    slots: SlotTable,
}

impl TestMembers {
    /// No member is open, and none is listed.
    ///
    /// # Errors
    /// The description names no addresses.
    pub fn new(description: &'static Description) -> Result<Self, StartError> {
        let slots = slots(description)?;
        Ok(Self { description, slots })
    }

    /// Opens a member of an array, by the number of the array. `None` if there is no such array.
    ///
    /// # Errors
    /// Those of [`SlotArray::open`](crate::SlotArray::open).
    pub fn open(&self, array: usize, name: &str) -> Option<Result<Member, MemberError>> {
        let of = self.description.slots.get(array)?;
        of.is_array.then(|| self.slots.add(array, name))
    }

    /// The number in the description of a slot, for a member that of its array.
    pub fn described(&self, slot: usize) -> Option<usize> {
        self.slots.get(slot).map(|open| open.described)
    }

    /// The members of an array that a network would list.
    pub fn listed(&self, array: usize) -> Option<Vec<String>> {
        self.slots.listed(array)
    }

    /// Lists the members of an array as a network does. Says whether there is such an array.
    pub fn list(&self, array: &str, members: &[&str]) -> bool {
        let mut arrays = self.description.slots.iter().filter(|slot| slot.is_array);
        let is_there = arrays.any(|slot| slot.name == array);
        if is_there {
            self.slots.list(array, members);
        }
        is_there
    }

    /// Ends the opening of members, as the end of `initialize` does.
    ///
    /// # Errors
    /// The open members are not the listed ones.
    pub fn complete(&self) -> Result<(), StartError> {
        self.slots.complete()
    }
}
