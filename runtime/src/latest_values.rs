//! The last values of a component, which answer queries.

use crate::freshness::FreshCounts;
use rc_middleware::Writer;
use std::rc::Rc;

/// Writes a value as a reply has it.
pub(crate) type Write = Rc<dyn Fn(&mut Writer<'_>)>;

/// The last value of a query.
pub(crate) struct Latest {
    pub(crate) slot: usize,
    pub(crate) operation: usize,
    pub(crate) made: u64,
    pub(crate) is_used: bool,
    pub(crate) write: Write,
}

/// The last values of a component.
#[derive(Default)]
pub(crate) struct LatestValues {
    pub(crate) values: Vec<Latest>,
    pub(crate) counts: Vec<(usize, FreshCounts)>,
}

impl std::fmt::Debug for LatestValues {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LatestValues({})", self.values.len())
    }
}
