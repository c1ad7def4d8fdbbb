//! The shared part of backends over a network: one participant of a domain of DDS, over the C
//! library Cyclone DDS (`rc-ddsc`).
//!
//! - [`Session`], [`Joining`], [`Configuration`]: the participant of a component, and its thread of
//!   discovery.
//! - [`EndpointInfo`]: the announcement of an endpoint, and whether two endpoints
//!   match.
//! - [`LocalRegistry`]: the endpoints on this machine, which need no discovery.
//! - [`EndpointState`], [`Peer`]: an endpoint of this component and the peers that it has found.
//! - [`Opening`], [`WriterPort`], [`ReaderPort`]: opens endpoints and waits for their peers.
//! - [`TopicPublisher`], [`TopicSubscriber`]: the ports of topics, for all middlewares over a
//!   network.
//! - [`SampleQueue`], [`RequestQueues`], [`ReplyQueue`]: messages that were received and not read
//!   yet.
//! - [`ReplyMemory`]: where a server writes a reply.
//! - [`Mismatches`], [`RateLimit`]: log lines about endpoints that do not match.
//!
#![doc = include_str!("example.md")]

mod caller;
mod configuration;
mod endpoint_info;
mod endpoint_state;
mod entities;
mod identity;
mod local_registry;
mod mismatches;
mod opener;
mod peers;
mod port;
mod publisher;
mod queues;
mod rate_limit;
mod reply;
mod report;
mod sample;
mod session;
mod shared_entity;
mod stamps;
mod subscriber;
mod udp;
mod watcher;

pub use caller::{CallState, Caller, ClientPorts, ROOM};
pub use configuration::{Configuration, Joining};
pub use endpoint_info::{EndpointInfo, Role, fnv, hex, host, types_match};
pub use endpoint_state::{Backlog, EndpointState};
pub use entities::{Inbox, ReaderState, Sender, WriterState};
pub use identity::{EndpointKind, Identity};
pub use local_registry::{LocalRegistry, OpenLock, Registration, RegistrationGuard};
pub use mismatches::Mismatches;
pub use peers::{GuidPrefix, Peer, Presence, prefix};
pub use port::{EndpointSpec, Opening, ReaderPort, WriterPort, signal};
pub use publisher::TopicPublisher;
pub use queues::{DuplicateFilter, NO_ROOM, QueuedRequest, ReplyQueue, RequestQueues, SampleQueue};
pub use rate_limit::RateLimit;
pub use reply::{ReplyMemory, Written};
pub use sample::{body, sample_header};
pub use session::{Session, refused};
pub use stamps::{age, header, reply_sent, reply_stamp, stamp};
pub use subscriber::TopicSubscriber;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The identity of an endpoint: that of its participant, 12 bytes, and its number there (RTPS 2.5,
/// 9.3.1).
pub type Guid = [u8; 16];

/// Locks a mutex, also one that a thread held when it panicked: no state of this crate is left half
/// written.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
