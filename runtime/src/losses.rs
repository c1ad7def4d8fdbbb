//! Losses of clients that tap slots.

use std::collections::BTreeMap;

/// The slots that a client taps.
pub(crate) type Tapping = BTreeMap<usize, Losses>;

/// Messages that a client lost of a tapped slot.
#[derive(Debug)]
pub(crate) struct Losses {
    /// The messages of the slot that were not copied for any client, before this one tapped it.
    pub(crate) before: u64,
    /// The copies that found no room at this client.
    pub(crate) dropped: u64,
    /// How many losses the client knows of.
    pub(crate) told: u64,
}

impl Losses {
    /// All losses, if so many messages of the slot were not copied.
    pub(crate) fn total(&self, not_copied: u64) -> u64 {
        not_copied.saturating_sub(self.before) + self.dropped
    }
}
