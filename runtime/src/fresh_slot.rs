//! The newest samples of a slot with `fresh`, as the worker asks for them.

use crate::context::Core;
use crate::freshness::{Inputs, Moments};
use rc_middleware::freshness::Fresh;
use rc_middleware::{CallError, DecodeError, Reader};
use std::cell::RefCell;
use std::rc::Rc;

/// The newest samples of a slot with `fresh`: a field of the context has one.
#[derive(Debug)]
pub struct FreshSlot {
    slot: usize,
    inputs: Rc<RefCell<Inputs>>,
    moments: Moments,
}

impl FreshSlot {
    /// The newest samples of a slot.
    pub fn new(core: &Core, slot: usize) -> Self {
        Self {
            slot,
            inputs: Rc::clone(&core.inputs),
            moments: core.moments(),
        }
    }

    /// The newest sample of a topic, which `read` reads, with its age.
    ///
    /// # Errors
    /// [`CallError::NoValue`] before the first one, and [`CallError::Stale`] for one that is too old
    /// if the slot has `stale refuse`.
    pub fn newest<T>(
        &self,
        operation: usize,
        read: impl FnOnce(&mut Reader<'_>) -> Result<T, DecodeError>,
    ) -> Result<Fresh<T>, CallError> {
        let now = self.moments.now();
        let mut inputs = self.inputs.borrow_mut();
        inputs.newest((self.slot, operation), now, read)
    }
}
