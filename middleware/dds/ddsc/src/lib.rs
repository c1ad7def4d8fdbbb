//! Safe types over the parts of Cyclone DDS that the DDS backend needs. A C compiler builds the
//! library.
//!
//! A topic carries bytes, see `shim.c`: a type is only a name. This crate holds all `unsafe` code
//! of the backend. Each block argues that what C gets lives at least as long as C uses it.
//!
#![doc = include_str!("example.md")]

mod raw;
mod sample;

use raw::{CIdentity, CListener, CQos, CSample};
use rc_vocabulary::qos::{Contract, Reliability};
use sample::HEADROOM;
pub use sample::{BEFORE_BODY, Loan, Sample};
use std::ffi::{CStr, CString, c_char, c_void};
use std::fmt;
use std::ptr;
use std::time::Duration;

/// An error of the library: its code and its text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Error(i32);

impl Error {
    /// An invalid argument (`DDS_RETCODE_BAD_PARAMETER`).
    pub const BAD_PARAMETER: Self = Self(-3);
    /// No memory (`DDS_RETCODE_OUT_OF_RESOURCES`).
    pub const OUT_OF_RESOURCES: Self = Self(-5);

    /// Whether a limit of time was reached (`DDS_RETCODE_TIMEOUT`).
    pub fn is_timeout(self) -> bool {
        self.0 == -10
    }

    /// Whether the entity exists already (`DDS_RETCODE_PRECONDITION_NOT_MET`).
    pub fn is_precondition(self) -> bool {
        self.0 == -4
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // SAFETY: the function takes any number and returns a constant of the library.
        let text = unsafe { CStr::from_ptr(raw::rc_error(self.0)) };
        write!(f, "{} ({})", text.to_string_lossy(), self.0)
    }
}

impl std::error::Error for Error {}

fn checked(code: i32) -> Result<i32, Error> {
    if code < 0 { Err(Error(code)) } else { Ok(code) }
}

fn c_string(text: &str) -> Result<CString, Error> {
    CString::new(text).map_err(|_| Error::BAD_PARAMETER)
}

/// The global identity of an entity (RTPS 2.5, 8.2.4): 12 bytes of its participant, 4 of its own.
pub type Guid = [u8; 16];

/// Relates a reply to its request: an endpoint of the client, and the number of the request
/// (`SampleIdentity_t`, RTPS 2.5, 9.3.1.10).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Identity {
    /// The endpoint.
    pub guid: Guid,
    /// The number.
    pub number: i64,
}

/// An entity of the library. Dropping it deletes it with all entities in it.
#[derive(Debug)]
struct Entity(i32);

impl Entity {
    fn guid(&self) -> Result<Guid, Error> {
        let mut guid = [0; 16];
        // SAFETY: `guid` has the 16 bytes that are written.
        checked(unsafe { raw::rc_guid(self.0, guid.as_mut_ptr()) })?;
        Ok(guid)
    }
}

impl Drop for Entity {
    fn drop(&mut self) {
        // SAFETY: handles are numbers that the library checks. It returns when no callback of the
        // entity runs any more.
        unsafe { raw::rc_delete(self.0) };
    }
}

/// The library's part of one domain in this process: its sockets and threads.
#[derive(Debug)]
pub struct Domain {
    entity: Entity,
    id: u32,
}

impl Domain {
    /// Creates the domain `id` of this process; fails where it exists. `config`: fragments of
    /// Cyclone's XML and addresses of such files, separated by commas; later ones win.
    pub fn new(id: u32, config: &str) -> Result<Self, Error> {
        let config = c_string(config)?;
        // SAFETY: `config` is a C string; it is read before the function returns.
        let entity = checked(unsafe { raw::rc_domain(id, config.as_ptr()) })?;
        Ok(Self {
            entity: Entity(entity),
            id,
        })
    }

    /// Joins the domain. Peers receive `user_data` by discovery.
    pub fn participant(&self, user_data: &[u8]) -> Result<Participant, Error> {
        let _ = &self.entity;
        let (data, size) = (user_data.as_ptr(), user_data.len());
        // SAFETY: the data is copied before the function returns.
        let entity = checked(unsafe { raw::rc_participant(self.id, data, size) })?;
        Ok(Participant(Entity(entity)))
    }
}

/// A participant of a domain.
#[derive(Debug)]
pub struct Participant(Entity);

impl Participant {
    /// GUID: a prefix of 12 bytes for the participant, and 4 bytes for the entity.
    pub fn guid(&self) -> Result<Guid, Error> {
        self.0.guid()
    }

    /// Creates a topic of bytes with the name of its type.
    pub fn topic(&self, name: &str, type_name: &str) -> Result<Topic, Error> {
        let (name, type_name) = (c_string(name)?, c_string(type_name)?);
        // SAFETY: both are C strings, which are copied.
        let entity =
            checked(unsafe { raw::rc_topic(self.0.0, name.as_ptr(), type_name.as_ptr()) })?;
        Ok(Topic(Entity(entity)))
    }

    /// Creates a writer of a topic.
    pub fn writer(
        &self,
        topic: &Topic,
        qos: &Qos<'_>,
        listener: Box<dyn Listener>,
    ) -> Result<Writer, Error> {
        Attached::new(listener, |listener| {
            let qos = CQos::of(qos);
            // SAFETY: `qos` is read before the function returns; `listener` is deleted after the
            // entity, see `Attached`.
            unsafe { raw::rc_writer(self.0.0, topic.0.0, &raw const qos, listener) }
        })
        .map(Writer)
    }

    /// Creates a reader of a topic.
    pub fn reader(
        &self,
        topic: &Topic,
        qos: &Qos<'_>,
        listener: Box<dyn Listener>,
    ) -> Result<Reader, Error> {
        Attached::new(listener, |listener| {
            let qos = CQos::of(qos);
            // SAFETY: as for a writer.
            unsafe { raw::rc_reader(self.0.0, topic.0.0, &raw const qos, listener) }
        })
        .map(|attached| {
            let is_reliable = qos.policies.reliability == Reliability::Reliable;
            Reader(attached, is_reliable)
        })
    }

    /// Discovers the endpoints of the domain: all writers, or all readers.
    pub fn discovery(
        &self,
        writers: bool,
        listener: Box<dyn Listener>,
    ) -> Result<Discovery, Error> {
        Attached::new(listener, |listener| {
            // SAFETY: `listener` is deleted after the entity, see `Attached`.
            unsafe { raw::rc_discovery(self.0.0, i32::from(writers), listener) }
        })
        .map(Discovery)
    }
}

/// A name and a type.
#[derive(Debug)]
pub struct Topic(Entity);

/// The quality of service that an endpoint offers or requests, as the library takes it.
#[derive(Clone, Copy, Debug)]
pub struct Qos<'a> {
    /// The policies of topics.
    pub policies: rc_vocabulary::qos::Qos,
    /// Whether all samples are kept, whatever the depth is.
    pub keeps_all: bool,
    /// Data that peers receive by discovery.
    pub user_data: &'a [u8],
}

impl Qos<'static> {
    /// For endpoints that lose nothing.
    pub const LOSSLESS: Self = Self {
        policies: rc_vocabulary::qos::Qos::CALL,
        keeps_all: true,
        user_data: &[],
    };

    /// For a publisher or a subscriber.
    pub const fn of(policies: &rc_vocabulary::qos::Qos) -> Self {
        Self {
            policies: *policies,
            keeps_all: false,
            user_data: &[],
        }
    }
}

/// Receives the events of an endpoint, on a thread of the library. It must neither block nor delete
/// the endpoint.
pub trait Listener: Send + Sync {
    /// Handles an event.
    fn event(&self, event: Event);
}

/// An event of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// Samples can be taken.
    Data,
    /// The peer with this handle was found.
    Matched(u64),
    /// The peer with this handle has left.
    Unmatched(u64),
    /// The quality of service of an endpoint does not match: the number of a policy (DDS 1.4,
    /// 2.3.3).
    Incompatible(i32),
    /// No sample arrived within the deadline, this many times.
    Deadline(u32),
    /// The writer with this handle is alive, or no longer alive.
    Alive(u64, bool),
}

/// An endpoint and its listener, which is dropped after the endpoint.
struct Attached {
    entity: Option<Entity>,
    listener: *mut CListener,
}

// SAFETY: the listener is `Send` and `Sync`, the library's functions may be called from every
// thread, and `Attached` uses the pointer only when it is created and dropped.
unsafe impl Send for Attached {}
// SAFETY: as above.
unsafe impl Sync for Attached {}

impl fmt::Debug for Attached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.entity.fmt(f)
    }
}

impl Attached {
    fn new(
        listener: Box<dyn Listener>,
        open: impl FnOnce(*mut CListener) -> i32,
    ) -> Result<Self, Error> {
        let argument = Box::into_raw(Box::new(listener)).cast::<c_void>();
        let listener = Box::into_raw(Box::new(CListener {
            callback: heard,
            argument,
        }));
        let mut attached = Self {
            entity: None,
            listener,
        };
        attached.entity = Some(Entity(checked(open(listener))?));
        Ok(attached)
    }

    fn id(&self) -> i32 {
        self.entity.as_ref().map_or(0, |entity| entity.0)
    }

    fn guid(&self) -> Result<Guid, Error> {
        Entity::guid(self.entity.as_ref().ok_or(Error::BAD_PARAMETER)?)
    }

    /// Looks up the peer with this handle; `None` after it has left.
    fn matched(&self, handle: u64, kind: i32) -> Option<End> {
        let mut found = None;
        let mut take = |end: Option<End>, _: Guid| found = end;
        let (call, argument) = trampoline(&mut take);
        // SAFETY: the callback is called before the function returns, with the closure that it was
        // made for.
        unsafe { raw::rc_matched(self.id(), handle, kind, call, argument) };
        found
    }
}

impl Drop for Attached {
    fn drop(&mut self) {
        // After this the library no longer calls the listener.
        drop(self.entity.take());
        // SAFETY: both come from `Box::into_raw` in `new`, and nothing else refers to them.
        unsafe {
            let listener = Box::from_raw(self.listener);
            drop(Box::from_raw(listener.argument.cast::<Box<dyn Listener>>()));
        }
    }
}

extern "C" fn heard(argument: *mut c_void, event: i32, handle: u64, number: i32) {
    // SAFETY: the argument is the boxed listener of `Attached::new`, which outlives the entity that
    // calls.
    let listener = unsafe { &*argument.cast::<Box<dyn Listener>>() };
    let count = number.max(0).unsigned_abs();
    listener.event(match event {
        0 => Event::Data,
        1 if number > 0 => Event::Matched(handle),
        1 => Event::Unmatched(handle),
        2 => Event::Incompatible(number),
        3 => Event::Deadline(count),
        _ => Event::Alive(handle, number > 0),
    });
}

/// A writer of a topic.
#[derive(Debug)]
pub struct Writer(Attached);

impl Writer {
    /// GUID: a prefix of 12 bytes for the participant, and 4 bytes for the entity.
    pub fn guid(&self) -> Result<Guid, Error> {
        self.0.guid()
    }

    /// Sends a body in CDR, little endian. `sequence`: its number, from 1, for readers in this
    /// process; other readers count the samples of this writer. `stamp`: nanoseconds since 1970.
    pub fn write(&self, sequence: u64, stamp: i64, body: &[u8]) -> Result<(), Error> {
        let (data, size) = (body.as_ptr(), body.len());
        // SAFETY: the bytes are copied before the function returns.
        checked(unsafe { raw::rc_write(self.0.id(), sequence, stamp, data, size) })?;
        Ok(())
    }

    /// Writes a sample with an identity outside the body, in the inline quality of service.
    pub fn write_related(
        &self,
        sequence: u64,
        stamp: i64,
        body: &[u8],
        related: Identity,
    ) -> Result<(), Error> {
        let mut loan = self.loan(body.len())?;
        loan.memory()[BEFORE_BODY..].copy_from_slice(body);
        self.send(loan, (sequence, stamp), 0, Some(related))
    }

    /// Lends the memory of a sample with a body of `size` bytes, which [`Writer::send`] sends.
    pub fn loan(&self, size: usize) -> Result<Loan, Error> {
        let mut body = ptr::null_mut();
        // SAFETY: `body` is writable.
        let data = unsafe { raw::rc_loan(self.0.id(), size, &raw mut body) };
        if data.is_null() {
            return Err(Error::OUT_OF_RESOURCES);
        }
        Ok(Loan::new(data, body, size))
    }

    /// Sends a lent sample, see [`Writer::write`]. The last `before` bytes in front of its body are
    /// a part of it, a multiple of 8. `related`: an identity outside the body, in the inline
    /// quality of service.
    pub fn send(
        &self,
        loan: Loan,
        (sequence, stamp): (u64, i64),
        before: usize,
        related: Option<Identity>,
    ) -> Result<(), Error> {
        if before > HEADROOM || !before.is_multiple_of(8) {
            return Err(Error::BAD_PARAMETER);
        }
        let related = related.map(CIdentity::from);
        let related = related.as_ref().map_or(ptr::null(), ptr::from_ref);
        let data = loan.into_data();
        // SAFETY: `data` comes from `rc_loan`, and nothing else refers to it; the identity is
        // copied.
        checked(unsafe { raw::rc_send(self.0.id(), data, sequence, stamp, before, related) })?;
        Ok(())
    }

    /// Sends these bytes, which begin with the encapsulation: for tests that send invalid samples.
    pub fn write_raw(&self, sequence: u64, stamp: i64, bytes: &[u8]) -> Result<(), Error> {
        let (data, size) = (bytes.as_ptr(), bytes.len());
        // SAFETY: the bytes are copied before the function returns.
        checked(unsafe { raw::rc_write_raw(self.0.id(), sequence, stamp, data, size) })?;
        Ok(())
    }

    /// Waits until every reliable reader has all samples, at most `limit`.
    pub fn wait_for_acks(&self, limit: Duration) -> Result<(), Error> {
        self.wait(limit, ptr::null())
    }

    /// Waits until this reader has all samples, at most `limit`. Does not wait for a reader that
    /// has left.
    pub fn wait_for_acks_of(&self, reader: &Guid, limit: Duration) -> Result<(), Error> {
        self.wait(limit, reader.as_ptr())
    }

    fn wait(&self, limit: Duration, reader: *const u8) -> Result<(), Error> {
        let limit = i64::try_from(limit.as_nanos()).unwrap_or(i64::MAX);
        // SAFETY: `reader` is null, or the 16 bytes of an identity, which are copied.
        checked(unsafe { raw::rc_wait_for_acks(self.0.id(), limit, reader) })?;
        Ok(())
    }

    /// Looks up the reader with this handle; `None` after it has left.
    pub fn matched(&self, handle: u64) -> Option<End> {
        self.0.matched(handle, raw::WRITER)
    }
}

/// A reader of a topic, and whether it is reliable.
#[derive(Debug)]
pub struct Reader(Attached, bool);

impl Reader {
    /// GUID: a prefix of 12 bytes for the participant, and 4 bytes for the entity.
    pub fn guid(&self) -> Result<Guid, Error> {
        self.0.guid()
    }

    /// Takes all samples that are there, and gives their number.
    pub fn take(&self, mut each: impl FnMut(Sample)) -> Result<usize, Error> {
        let mut total = 0;
        loop {
            let batch = self.take_batch(&mut each)?;
            total += batch.count;
            if !batch.more {
                return Ok(total);
            }
        }
    }

    /// Takes a limited number of samples.
    pub fn take_batch(&self, mut each: impl FnMut(Sample)) -> Result<Batch, Error> {
        let (mut samples, mut more) = ([CSample::NONE; raw::AT_ONCE], 0);
        // SAFETY: there is room for that many samples, and for the answer.
        let count = unsafe { raw::rc_take(self.0.id(), samples.as_mut_ptr(), &raw mut more) };
        let count = checked(count)?.unsigned_abs() as usize;
        for sample in samples.into_iter().take(count) {
            each(Sample::new(sample));
        }
        Ok(Batch {
            count,
            more: more != 0,
        })
    }

    /// Looks up the writer with this handle; `None` after it has left.
    pub fn matched(&self, handle: u64) -> Option<End> {
        let reliable = self.1;
        self.0.matched(
            handle,
            if reliable {
                raw::RELIABLE_READER
            } else {
                raw::READER
            },
        )
    }
}

/// Result of [`Reader::take_batch`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// The number of samples.
    pub count: usize,
    /// Whether more samples are there.
    pub more: bool,
}

/// Discovers endpoints of the domain.
#[derive(Debug)]
pub struct Discovery(Attached);

impl Discovery {
    /// Calls `each` for each change: with the present state of an endpoint, or with the identity of
    /// one that has left.
    pub fn take(&self, mut each: impl FnMut(Option<End>, Guid)) -> Result<(), Error> {
        let (call, argument) = trampoline(&mut each);
        // SAFETY: the callback is called before the function returns, with the closure that it was
        // made for.
        checked(unsafe { raw::rc_take_discovered(self.0.id(), call, argument) })?;
        Ok(())
    }
}

/// An endpoint somewhere in the domain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct End {
    /// GUID: a prefix of 12 bytes for the participant, and 4 bytes for the entity.
    pub guid: Guid,
    /// The identity of its participant.
    pub participant: Guid,
    /// Topic name in DDS.
    pub topic: String,
    /// The name of its type.
    pub type_name: String,
    /// Quality of service by which it matches peers.
    pub contract: Contract,
    /// Time after which a sample expires.
    pub lifespan: Option<Duration>,
    /// USER_DATA of the endpoint, as its program has set it.
    pub user_data: Vec<u8>,
}

type EndFunction = extern "C" fn(*mut c_void, *const raw::CEnd, i32);

/// Gives a C function that calls `each`, and its argument.
fn trampoline<F: FnMut(Option<End>, Guid)>(each: &mut F) -> (EndFunction, *mut c_void) {
    extern "C" fn call<F: FnMut(Option<End>, Guid)>(
        argument: *mut c_void,
        end: *const raw::CEnd,
        alive: i32,
    ) {
        // SAFETY: the argument is the closure next to this function, borrowed only by C while it
        // calls; `end` is valid during the call.
        let (each, end) = unsafe { (&mut *argument.cast::<F>(), &*end) };
        each((alive != 0).then(|| end.read()), end.guid);
    }
    (call::<F>, (&raw mut *each).cast())
}

/// The network interfaces of this machine: names and IPv4 addresses.
pub fn interfaces() -> Vec<(String, String)> {
    type Found = Vec<(String, String)>;
    extern "C" fn push(argument: *mut c_void, name: *const c_char, address: *const c_char) {
        // SAFETY: the argument is the vector below, the others are C strings that are valid during
        // the call.
        let (found, name, address) = unsafe {
            let found = &mut *argument.cast::<Found>();
            (found, CStr::from_ptr(name), CStr::from_ptr(address))
        };
        let text = |text: &CStr| text.to_string_lossy().into_owned();
        found.push((text(name), text(address)));
    }
    let mut found: Found = Vec::new();
    // SAFETY: the callback is called before the function returns.
    unsafe { raw::rc_interfaces(push, (&raw mut found).cast()) };
    found.sort();
    found.dedup();
    found
}

/// Passes the messages of the library to `log` instead of standard error, for the whole process.
/// `true` means an error, `false` a warning.
pub fn set_log(log: fn(bool, &str)) {
    static LOG: std::sync::OnceLock<fn(bool, &str)> = std::sync::OnceLock::new();
    extern "C" fn hear(priority: i32, message: *const c_char, size: usize) {
        if let Some(log) = LOG.get() {
            // SAFETY: the library gives the address and the size of a text that is valid during the
            // call.
            let bytes = unsafe { std::slice::from_raw_parts(message.cast::<u8>(), size) };
            log(priority > 1, String::from_utf8_lossy(bytes).trim_end());
        }
    }
    if LOG.set(log).is_ok() {
        // SAFETY: the function is static.
        unsafe { raw::rc_log(hear) };
    }
}
