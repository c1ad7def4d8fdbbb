//! `shim.c` as Rust sees it; structures and functions have their comments there.

use crate::{End, Guid, Identity, Qos};
use rc_vocabulary::qos::{Contract, Durability, Reliability};
use std::ffi::{CStr, c_char, c_void};
use std::ptr;
use std::time::Duration;

/// `enum rc_kind`
pub(crate) const WRITER: i32 = 0;
pub(crate) const READER: i32 = 1;
pub(crate) const RELIABLE_READER: i32 = 2;

#[repr(C)]
pub(crate) struct CListener {
    pub(crate) callback: extern "C" fn(*mut c_void, i32, u64, i32),
    pub(crate) argument: *mut c_void,
}

#[repr(C)]
pub(crate) struct CQos {
    reliable: i32,
    transient_local: i32,
    depth: i32,
    deadline: i64,
    lifespan: i64,
    liveliness: i64,
    user_data: *const u8,
    user_data_size: usize,
}

impl CQos {
    /// Points to what `qos` borrows.
    pub(crate) fn of(qos: &Qos<'_>) -> Self {
        let nanoseconds = |time: Option<Duration>| {
            time.map_or(-1, |time| {
                i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
            })
        };
        // All fields, so that a new policy is not forgotten here.
        let rc_vocabulary::qos::Qos {
            reliability,
            durability,
            depth,
            deadline,
            lifespan,
            liveliness,
            timeout: _,
            spin: _,
            fresh: _,
            stale: _,
            cache: _,
            latest: _,
        } = qos.policies;
        Self {
            reliable: i32::from(reliability == Reliability::Reliable),
            transient_local: i32::from(durability == Durability::TransientLocal),
            depth: if qos.keeps_all {
                0
            } else {
                i32::try_from(depth.max(1)).unwrap_or(i32::MAX)
            },
            deadline: nanoseconds(deadline),
            lifespan: nanoseconds(lifespan),
            liveliness: nanoseconds(liveliness),
            user_data: qos.user_data.as_ptr(),
            user_data_size: qos.user_data.len(),
        }
    }
}

/// `RC_AT_ONCE`
pub(crate) const AT_ONCE: usize = 64;

#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct CSample {
    pub(crate) data: *mut c_void,
    pub(crate) bytes: *const u8,
    pub(crate) size: usize,
    pub(crate) sequence: u64,
    pub(crate) writer: u64,
    pub(crate) stamp: i64,
    pub(crate) related: *const CIdentity,
}

/// `struct identity`
#[repr(C)]
#[derive(Clone, Copy)]
pub(crate) struct CIdentity {
    guid: Guid,
    high: i32,
    low: u32,
}

impl From<Identity> for CIdentity {
    fn from(identity: Identity) -> Self {
        Self {
            guid: identity.guid,
            high: (identity.number >> 32) as i32,
            low: identity.number as u32,
        }
    }
}

impl From<CIdentity> for Identity {
    fn from(identity: CIdentity) -> Self {
        Self {
            guid: identity.guid,
            number: i64::from(identity.high) << 32 | i64::from(identity.low),
        }
    }
}

impl CSample {
    pub(crate) const NONE: Self = Self {
        data: ptr::null_mut(),
        bytes: ptr::null(),
        size: 0,
        sequence: 0,
        writer: 0,
        stamp: 0,
        related: ptr::null(),
    };
}

#[repr(C)]
pub(crate) struct CEnd {
    pub(crate) guid: Guid,
    participant: Guid,
    reliable: i32,
    transient_local: i32,
    deadline: i64,
    lifespan: i64,
    liveliness: i64,
    topic: *const c_char,
    type_name: *const c_char,
    user_data: *const u8,
    user_data_size: usize,
}

impl CEnd {
    /// A copy. `self` comes from `tell_end` of `shim.c`, which makes every pointer valid.
    pub(crate) fn read(&self) -> End {
        let text = |pointer: *const c_char| {
            if pointer.is_null() {
                return String::new();
            }
            // SAFETY: not null, so a C string, see above.
            unsafe { CStr::from_ptr(pointer) }
                .to_string_lossy()
                .into_owned()
        };
        let time = |nanoseconds: i64| {
            let known = u64::try_from(nanoseconds).ok()?;
            (nanoseconds != i64::MAX).then(|| Duration::from_nanos(known))
        };
        let user_data = if self.user_data.is_null() {
            Vec::new()
        } else {
            // SAFETY: not null, so the address and the size of memory, see above.
            unsafe { std::slice::from_raw_parts(self.user_data, self.user_data_size) }.to_vec()
        };
        End {
            guid: self.guid,
            participant: self.participant,
            topic: text(self.topic),
            type_name: text(self.type_name),
            contract: Contract {
                reliability: if self.reliable == 0 {
                    Reliability::BestEffort
                } else {
                    Reliability::Reliable
                },
                durability: if self.transient_local == 0 {
                    Durability::Volatile
                } else {
                    Durability::TransientLocal
                },
                deadline: time(self.deadline),
                liveliness: time(self.liveliness),
            },
            lifespan: time(self.lifespan),
            user_data,
        }
    }
}

unsafe extern "C" {
    pub(crate) fn rc_domain(id: u32, config: *const c_char) -> i32;
    pub(crate) fn rc_participant(domain: u32, user_data: *const u8, user_data_size: usize) -> i32;
    pub(crate) fn rc_topic(participant: i32, name: *const c_char, type_name: *const c_char) -> i32;
    pub(crate) fn rc_delete(entity: i32) -> i32;
    pub(crate) fn rc_guid(entity: i32, guid: *mut u8) -> i32;
    pub(crate) fn rc_error(code: i32) -> *const c_char;
    pub(crate) fn rc_writer(
        participant: i32,
        topic: i32,
        qos: *const CQos,
        listener: *mut CListener,
    ) -> i32;
    pub(crate) fn rc_reader(
        participant: i32,
        topic: i32,
        qos: *const CQos,
        listener: *mut CListener,
    ) -> i32;
    pub(crate) fn rc_discovery(
        participant: i32,
        publications: i32,
        listener: *mut CListener,
    ) -> i32;
    pub(crate) fn rc_write(
        writer: i32,
        sequence: u64,
        stamp: i64,
        body: *const u8,
        size: usize,
    ) -> i32;
    pub(crate) fn rc_write_raw(
        writer: i32,
        sequence: u64,
        stamp: i64,
        bytes: *const u8,
        size: usize,
    ) -> i32;
    pub(crate) fn rc_loan(writer: i32, size: usize, body: *mut *mut u8) -> *mut c_void;
    pub(crate) fn rc_send(
        writer: i32,
        data: *mut c_void,
        sequence: u64,
        stamp: i64,
        before: usize,
        related: *const CIdentity,
    ) -> i32;
    pub(crate) fn rc_is_unique(data: *const c_void) -> i32;
    pub(crate) fn rc_take(reader: i32, samples: *mut CSample, more: *mut i32) -> i32;
    pub(crate) fn rc_release(data: *mut c_void);
    pub(crate) fn rc_wait_for_acks(writer: i32, nanoseconds: i64, reader: *const u8) -> i32;
    pub(crate) fn rc_matched(
        entity: i32,
        handle: u64,
        kind: i32,
        callback: extern "C" fn(*mut c_void, *const CEnd, i32),
        argument: *mut c_void,
    ) -> i32;
    pub(crate) fn rc_take_discovered(
        reader: i32,
        callback: extern "C" fn(*mut c_void, *const CEnd, i32),
        argument: *mut c_void,
    ) -> i32;
    pub(crate) fn rc_interfaces(
        callback: extern "C" fn(*mut c_void, *const c_char, *const c_char),
        argument: *mut c_void,
    ) -> i32;
    pub(crate) fn rc_log(callback: extern "C" fn(i32, *const c_char, usize));
}
