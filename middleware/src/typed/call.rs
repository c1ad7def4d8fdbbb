//! A call that was started and may not have ended.

use crate::rpc::RequestId;
use std::marker::PhantomData;
use std::sync::{Arc, Weak};

/// Identifies a started call. Those of one client are in the order of their start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CallId(pub(super) RequestId);

/// A started call, whose result will be an `R` or an error `E`. Dropping it forgets the call: its
/// end is not reported, and makes room for another call.
#[derive(Debug)]
#[must_use = "dropping a call forgets it"]
pub struct Call<R, E> {
    id: CallId,
    /// The client has a weak reference, and so learns of the drop.
    _holder: Arc<()>,
    result: PhantomData<fn() -> (R, E)>,
}

impl<R, E> Call<R, E> {
    /// A call, and what its client keeps of it.
    pub(super) fn new(id: RequestId) -> (Self, Weak<()>) {
        let holder = Arc::new(());
        let weak = Arc::downgrade(&holder);
        let call = Self {
            id: CallId(id),
            _holder: holder,
            result: PhantomData,
        };
        (call, weak)
    }

    /// Identifies the call when it ends.
    pub fn id(&self) -> CallId {
        self.id
    }
}
