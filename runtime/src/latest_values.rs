//! The last values of a component, which answer queries.

use crate::ages::FreshCounts;
use rc_middleware::typed::{HandlerError, Request};
use std::rc::Rc;

/// Replies with a value.
pub(crate) type Answer = Rc<dyn Fn(&mut Request<'_>) -> Result<(), HandlerError>>;

/// The last value of a query.
pub(crate) struct Latest {
    pub(crate) slot: usize,
    pub(crate) operation: usize,
    pub(crate) made: u64,
    pub(crate) is_used: bool,
    pub(crate) answer: Answer,
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
