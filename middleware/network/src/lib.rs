//! What backends over a network have in common: who is there, and what has come from them.
//!
//! - [`EndpointInfo`]: what an end tells of itself, and whether two ends fit.
//! - [`LocalRegistry`]: the ends on this machine, which need not be searched for.
//! - [`SampleQueue`], [`RequestQueues`], [`ReplyQueue`]: what has come and was not read yet.

mod endpoint_info;
mod inbox;
mod local_registry;
mod report;

pub use endpoint_info::{EndpointInfo, QosContract, Role, differences, fnv, hex, host};
pub use inbox::{
    DuplicateFilter, QueuedRequest, ReplyQueue, RequestQueues, SampleQueue, age, header, stamp,
};
pub use local_registry::{LocalRegistry, OpenLock, Registration, RegistrationGuard};
pub use report::{Mismatches, RateLimit};

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The identity of an end of a topic: that of its process, 12 bytes, and its number there (RTPS 2.5, 9.3.1).
pub type Guid = [u8; 16];

/// Locks also what a thread that panicked held: no state of ours is left half written.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
