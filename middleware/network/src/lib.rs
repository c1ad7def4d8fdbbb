//! What backends over a network have in common: opening endpoints, their peers, and queues of what
//! was received.
//!
//! - [`EndpointInfo`], [`QosContract`]: what an endpoint tells of itself, and whether two endpoints
//!   match.
//! - [`LocalRegistry`]: the endpoints on this machine, which need no discovery.
//! - [`EndpointState`], [`Peer`]: an endpoint of this component and the peers that it has found.
//! - [`Opener`]: opens endpoints and waits for their peers.
//! - [`SampleQueue`], [`RequestQueues`], [`ReplyQueue`]: what was received and not read yet.
//! - [`Mismatches`], [`RateLimit`]: what the log says of endpoints that do not match.

mod endpoint_info;
mod endpoint_state;
mod identity;
mod local_registry;
mod mismatches;
mod opener;
mod peers;
mod qos_contract;
mod queues;
mod rate_limit;
mod stamps;

pub use endpoint_info::{EndpointInfo, Role, fnv, hex, host, types_match};
pub use endpoint_state::{Backlog, EndpointState};
pub use identity::{EndpointKind, Identity};
pub use local_registry::{LocalRegistry, OpenLock, Registration, RegistrationGuard};
pub use mismatches::Mismatches;
pub use opener::{Opener, Opening, Patience};
pub use peers::{GuidPrefix, Peer, Presence, prefix};
pub use qos_contract::{QosContract, differences};
pub use queues::{DuplicateFilter, QueuedRequest, ReplyQueue, RequestQueues, SampleQueue};
pub use rate_limit::RateLimit;
pub use stamps::{age, header, stamp};

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The identity of an endpoint: that of its participant, 12 bytes, and its number there (RTPS 2.5,
/// 9.3.1).
pub type Guid = [u8; 16];

/// Locks a mutex, also one that a thread held when it panicked: no state of this crate is left half
/// written.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
