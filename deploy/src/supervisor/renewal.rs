//! The state of the renewal of shared memory.

use std::collections::BTreeSet;

/// The machines whose components restart with new shared memory. `None` is this one.
#[derive(Debug, Default)]
pub(super) struct Renewal {
    /// The components of this machine end, and then the services are created.
    pub(super) is_due: bool,
    pub(super) restarting: BTreeSet<Option<usize>>,
}

impl Renewal {
    /// Forgets a machine that is lost.
    pub(super) fn forget(&mut self, h: usize) {
        self.restarting.remove(&Some(h));
    }
}
