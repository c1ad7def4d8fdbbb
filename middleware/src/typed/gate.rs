//! Keeps the publishers of a component silent while it is not active.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Lets the publishers of a component publish, or not. Clones are one gate.
///
/// ```
/// use rc_middleware::typed::Gate;
///
/// let gate = Gate::default();
/// gate.clone().set_open(false);
/// assert!(!gate.is_open());
/// ```
#[derive(Clone, Debug)]
pub struct Gate(Arc<AtomicBool>);

/// An open gate.
impl Default for Gate {
    fn default() -> Self {
        Self(Arc::new(AtomicBool::new(true)))
    }
}

impl Gate {
    /// Opens or closes it.
    pub fn set_open(&self, open: bool) {
        self.0.store(open, Ordering::Relaxed);
    }

    /// Whether samples pass.
    pub fn is_open(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
