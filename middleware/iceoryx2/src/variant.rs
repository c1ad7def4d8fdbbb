//! The service variant of this backend: `ipc_threadsafe` of iceoryx2 with a cheaper lock.
//!
//! Ports must be `Send`, because they open on a helper thread. `ipc_threadsafe` (0.10.0) protects
//! them with POSIX mutexes, creates and destroys one for each loan, and takes several for each
//! message: 1500 instructions for a published sample, a third of all. Files and shared memory are
//! those of `ipc::Service`, so endpoints of all variants meet.
#![expect(
    unsafe_code,
    reason = "a trait of iceoryx2 has an unsafe function, which does nothing here"
)]

use iceoryx2::config::Config;
use iceoryx2::prelude::{PortName, ProcessId};
use iceoryx2::unique_id_generator::unique_system_id::UniqueSystemId;
use iceoryx2::unique_id_generator::{
    Entity, UniqueId as Id, UniqueIdGenerator, UniqueIdGeneratorDetailsError,
    UniqueIdGeneratorGenerateError,
};
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use iceoryx2_cal::arc_sync_policy::{ArcSyncPolicy, ArcSyncPolicyCreationError, LockGuard};
use iceoryx2_cal::shm_allocator::bump_allocator::BumpAllocator;
use iceoryx2_cal::shm_allocator::pool_allocator::PoolAllocator;
use iceoryx2_cal::{
    bag, dynamic_storage, event, hash, monitoring, reactor, resizable_shared_memory, serialize,
    shared_memory, static_storage, zero_copy_connection,
};
use parking_lot::{ReentrantMutex, ReentrantMutexGuard};
use std::fmt::Debug;
use std::ops::Deref;
use std::ptr::NonNull;
use std::sync::Arc;

/// The service variant.
#[derive(Clone, Debug)]
pub(crate) struct Service;

impl iceoryx2::service::Service for Service {
    type StaticStorage = static_storage::recommended::Ipc;
    type ConfigSerializer = serialize::recommended::Recommended;
    type PersistentDynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> =
        dynamic_storage::recommended::PersistentIpc<T>;
    type Bag = bag::recommended::Recommended;
    type DynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> =
        dynamic_storage::recommended::Ipc<T>;
    type ServiceNameHasher = hash::recommended::Recommended;
    type SharedMemory = shared_memory::recommended::Ipc<PoolAllocator>;
    type ResizableSharedMemory = resizable_shared_memory::recommended::Ipc<PoolAllocator>;
    type Connection = zero_copy_connection::recommended::Ipc;
    type Event = event::recommended::Ipc;
    type Monitoring = monitoring::recommended::Ipc;
    type Reactor = reactor::recommended::Ipc;
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> = Locked<T>;
    type BlackboardMgmt<T: Send + Sync + Debug + ZeroCopySend + 'static> =
        dynamic_storage::recommended::Ipc<T>;
    type BlackboardPayload = shared_memory::recommended::Ipc<BumpAllocator>;
    type UniqueId = UniqueId;
}

impl iceoryx2::service::internal::ServiceInternal<Self> for Service {}

/// The ids of nodes, services and ports: process id, time in nanoseconds and a counter.
///
/// iceoryx2 (0.10.0) takes the counter of a node from a shared memory that every user of the
/// machine may write (mode 0666), and a user that breaks its first eight bytes keeps all components
/// from starting. Here a node gets its id as a port does, from a counter of its process.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UniqueId;

impl UniqueIdGenerator for UniqueId {
    fn generate<S: iceoryx2::service::Service>(
        entity: Entity,
        config: &Config,
    ) -> Result<Id, UniqueIdGeneratorGenerateError> {
        let entity = match entity {
            Entity::Node(_) => Entity::Listener(PortName::new_empty()),
            other => other,
        };
        UniqueSystemId::generate::<S>(entity, config)
    }

    fn pid(id: Id) -> Result<ProcessId, UniqueIdGeneratorDetailsError> {
        <UniqueSystemId as UniqueIdGenerator>::pid(id)
    }
}

/// The state of a port or a loan, behind a lock that its holder may take again, as iceoryx2 wants
/// it.
#[derive(Debug)]
pub(crate) struct Locked<T: Send + Debug + Abandonable>(Arc<ReentrantMutex<T>>);

impl<T: Send + Debug + Abandonable> Clone for Locked<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: Send + Debug + Abandonable> Abandonable for Locked<T> {
    // Only tests of iceoryx2 abandon resources, to imitate the death of a process.
    unsafe fn abandon_in_place(_: NonNull<Self>) {}
}

impl<T: Send + Debug + Abandonable> ArcSyncPolicy<T> for Locked<T> {
    type LockGuard<'parent>
        = Guard<'parent, T>
    where
        Self: 'parent,
        T: 'parent;

    fn new(value: T) -> Result<Self, ArcSyncPolicyCreationError> {
        Ok(Self(Arc::new(ReentrantMutex::new(value))))
    }

    fn lock(&self) -> Guard<'_, T> {
        Guard(self.0.lock())
    }
}

/// A held lock.
pub(crate) struct Guard<'parent, T: Send + Debug>(ReentrantMutexGuard<'parent, T>);

impl<T: Send + Debug> Deref for Guard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0
    }
}

impl<'parent, T: Send + Debug + Abandonable> LockGuard<'parent, T> for Guard<'parent, T> {}
