//! The sessions of components under test, while another one, or none, has the thread.

use pyo3::prelude::*;
use rc_host::{Session, session};
use std::cell::RefCell;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

/// The state that waits for a bench while another one, or none, has the thread.
pub(crate) struct Parked {
    pub(crate) session: Option<Box<Session>>,
    /// The first exception of an answer, for the caller of the worker's function.
    pub(crate) failure: Option<PyErr>,
    /// Counts the loans of each topic.
    pub(crate) loans: HashMap<(usize, usize), Arc<()>>,
}

thread_local! {
    pub(crate) static BENCHES: RefCell<HashMap<u64, Parked>> = RefCell::default();
}

pub(crate) static NUMBERS: AtomicU64 = AtomicU64::new(0);

/// While it lives, the session of a bench is that of its thread.
pub(crate) struct Here(Option<u64>);

impl Here {
    /// Without a bench, the session is that of the component. While a call runs, its answer finds
    /// none, as in a process.
    pub(crate) fn enter(bench: Option<u64>) -> Self {
        Self(bench.filter(|number| swap(*number)))
    }
}

impl Drop for Here {
    fn drop(&mut self) {
        if let Some(number) = self.0 {
            swap(number);
        }
    }
}

fn swap(number: u64) -> bool {
    BENCHES.with_borrow_mut(|benches| {
        let parked = benches.get_mut(&number);
        parked.is_some_and(|parked| session::swap(&mut parked.session))
    })
}

pub(crate) fn note(number: u64, error: PyErr) {
    BENCHES.with_borrow_mut(|benches| {
        if let Some(parked) = benches.get_mut(&number) {
            parked.failure.get_or_insert(error);
        }
    });
}

/// The exception of an answer that was called since the last time.
pub(crate) fn take_failure(bench: Option<u64>) -> Option<PyErr> {
    BENCHES.with_borrow_mut(|benches| benches.get_mut(&bench?)?.failure.take())
}

/// Counts one more loan of a topic of a bench, while the result is held. `None` if there is one.
pub(crate) fn count_loan(number: u64, slot: usize, operation: usize) -> Option<Arc<()>> {
    BENCHES.with_borrow_mut(|benches| {
        let loans = &mut benches.get_mut(&number)?.loans;
        let count = loans.entry((slot, operation)).or_default();
        (Arc::strong_count(count) == 1).then(|| Arc::clone(count))
    })
}
