//! The table in which the endpoints of this process find each other.

use rc_middleware::{Address, Endpoint, Environment, OpenError, TypeIdentity, WakeEvent};
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// The most bytes that wait in the queue of one subscriber or server.
pub(crate) const QUEUE_LIMIT: u64 = 64 << 20;

/// The state `T` of each address of each network. An entry lives as long as one of its endpoints.
pub(crate) type Table<T> = HashMap<(String, Address), (TypeIdentity, Weak<Mutex<T>>)>;

/// A number that no other endpoint of this process has or had.
pub(crate) fn number() -> u64 {
    static ENDS: AtomicU64 = AtomicU64::new(1);
    ENDS.fetch_add(1, Ordering::Relaxed)
}

/// The state of the address of `endpoint`. It fails where another endpoint there has other types.
pub(crate) fn meet<T: Default>(
    table: &Mutex<Table<T>>,
    environment: &Environment,
    endpoint: &Endpoint,
) -> Result<Arc<Mutex<T>>, OpenError> {
    let mut table = lock(table);
    table.retain(|_, (_, state)| state.strong_count() > 0);
    let key = (environment.network.clone(), endpoint.address.clone());
    let found = table.get(&key);
    if let Some((types, state)) = found.and_then(|(types, state)| Some((types, state.upgrade()?))) {
        if *types == endpoint.types {
            return Ok(state);
        }
        return Err(OpenError::TypeMismatch {
            address: endpoint.address.to_string(),
            ours: endpoint.types.to_string(),
            theirs: types.to_string(),
        });
    }
    let state = Arc::new(Mutex::new(T::default()));
    let entry = (endpoint.types.clone(), Arc::downgrade(&state));
    table.insert(key, entry);
    Ok(state)
}

/// Locks a mutex, also after a panic: the state of this crate is never left half written.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Opens the wake event of an endpoint.
pub(crate) fn signal(endpoint: &Endpoint) -> Result<WakeEvent, OpenError> {
    WakeEvent::new().map_err(|error| OpenError::Backend {
        address: endpoint.address.to_string(),
        reason: format!("no descriptor for it: {error}"),
    })
}
