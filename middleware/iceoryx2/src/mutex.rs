//! Mutexes of values that a panic does not damage.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks. The guarded values are valid even after a panic.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
