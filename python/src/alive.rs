//! Components of this process that may run Python code.

use pyo3::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// How long components may take to end.
const ENDING: Duration = Duration::from_secs(5);
/// The pause between two looks.
pub(crate) const LOOK: Duration = Duration::from_millis(1);

/// The number of components that may run Python code, on threads of this process.
static ALIVE: AtomicUsize = AtomicUsize::new(0);

/// Counts a component in [`ALIVE`], from its start until its thread drops it.
pub(crate) struct Alive(());

impl Alive {
    pub(crate) fn new() -> Self {
        ALIVE.fetch_add(1, Ordering::AcqRel);
        Self(())
    }
}

impl Drop for Alive {
    fn drop(&mut self) {
        ALIVE.fetch_sub(1, Ordering::AcqRel);
    }
}

/// Waits for a while until all components have ended, those that did not start in time included:
/// before the interpreter ends, as no thread may run Python code then. Returns whether they have.
#[pyfunction]
pub(crate) fn await_end(py: Python<'_>) -> bool {
    let end = Instant::now() + ENDING;
    py.detach(|| {
        while ALIVE.load(Ordering::Acquire) > 0 {
            if Instant::now() >= end {
                return false;
            }
            std::thread::sleep(LOOK);
        }
        true
    })
}

/// Leaves the shared memory of all networks, before the interpreter ends: what variables and threads
/// still keep of it ends with the process, without its destructors.
#[pyfunction]
pub(crate) fn leave_networks(py: Python<'_>) {
    py.detach(rc_iceoryx2::leave_all);
}
