//! The life cycle of a managed component, for a backend whose middleware has managed nodes.

use rc_lifecycle::{LifecycleState, Transition};
use std::sync::Arc;
use std::time::Instant;

/// A change of the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LifecycleChange {
    /// The state before.
    pub from: LifecycleState,
    /// The state after.
    pub to: LifecycleState,
}

/// Called with each change. It must return at once: it runs on the thread of the worker.
pub type LifecycleListener = Arc<dyn Fn(LifecycleChange) + Send + Sync>;

/// The life cycle of one component. Any thread but that of the worker may call it.
pub trait LifecycleService: Send + Sync {
    /// The state, at once.
    fn state(&self) -> LifecycleState;

    /// Takes the component through a transition, and returns the state after its hook. The request
    /// came at `asked`: the function returns within a minute after that, and begins no transition
    /// later. The error says why the transition did not begin, or has not succeeded.
    fn change(&self, transition: Transition, asked: Instant) -> Result<LifecycleState, String>;

    /// Calls `listener` with every change from now on.
    fn watch(&self, listener: LifecycleListener);
}
