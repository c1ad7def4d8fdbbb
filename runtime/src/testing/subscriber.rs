//! Fake subscribers: they keep the publications of a worker under test.

use super::{Fake, TestBed};
use rc_middleware::{DecodeError, Header, Publisher, Reader, SendError};
use std::cell::RefCell;
use std::rc::Rc;

type Record = Box<dyn FnMut(&mut Reader<'_>) -> Result<(), DecodeError>>;

/// One topic.
pub(super) struct Topic {
    address: String,
    /// Keeps a sample.
    record: Option<Record>,
    fault: Option<String>,
    subscribers: usize,
}

impl Topic {
    pub(super) fn new(address: &str) -> Self {
        Self {
            address: address.to_owned(),
            record: None,
            fault: None,
            subscribers: 1,
        }
    }
}

/// The subscriber of all topics of one slot of a worker under test. Its clones are the same
/// subscriber.
#[derive(Clone)]
pub struct FakeSubscriber<T> {
    topics: Vec<Rc<RefCell<Topic>>>,
    samples: Rc<RefCell<Vec<T>>>,
}

/// A sample that a fake keeps: generated code has one for each interface with topics.
pub trait FakeSample: Clone + 'static {
    /// Reads a sample of an operation, by its number.
    fn read(operation: usize, reader: &mut Reader<'_>) -> Result<Self, DecodeError>;
}

impl<T: FakeSample> Fake for FakeSubscriber<T> {
    fn new(bed: &TestBed, slot: usize, member: Option<&str>) -> Self {
        Self::reading(bed, slot, member, T::read)
    }
}

impl<T: Clone + 'static> FakeSubscriber<T> {
    /// The subscriber of a slot, or of a member of an array. `read` reads a sample of an operation,
    /// by its number.
    #[doc(hidden)]
    pub fn reading(
        bed: &TestBed,
        slot: usize,
        member: Option<&str>,
        read: impl Fn(usize, &mut Reader<'_>) -> Result<T, DecodeError> + 'static,
    ) -> Self {
        let samples: Rc<RefCell<Vec<T>>> = Rc::default();
        let read = Rc::new(read);
        let (operations, address) = bed.end(slot, member);
        let topics = operations.iter().enumerate().map(|(at, operation)| {
            let topic = bed.hub.topic(&format!("{address}/{}", operation.name));
            let (kept, read) = (Rc::clone(&samples), Rc::clone(&read));
            topic.borrow_mut().record = Some(Box::new(move |reader| {
                let sample = read(at, reader)?;
                kept.borrow_mut().push(sample);
                Ok(())
            }));
            topic
        });
        let topics = topics.collect();
        Self { topics, samples }
    }

    /// The published samples, in their order.
    pub fn samples(&self) -> Vec<T> {
        self.samples.borrow().clone()
    }

    /// Removes and returns them. A long test does so now and then, because all are kept until then.
    pub fn take_samples(&self) -> Vec<T> {
        self.samples.take()
    }

    /// Lets publishing fail from now on, with `SendError::Backend` and this reason.
    pub fn fail(&self, reason: &str) {
        self.each(|topic| topic.fault = Some(reason.to_owned()));
    }

    /// Ends a fault.
    pub fn recover(&self) {
        self.each(|topic| topic.fault = None);
    }

    /// Sets the number of subscribers that the worker sees; there is one.
    pub fn set_subscribers(&self, count: usize) {
        self.each(|topic| topic.subscribers = count);
    }

    fn each(&self, change: impl Fn(&mut Topic)) {
        self.topics
            .iter()
            .for_each(|topic| change(&mut topic.borrow_mut()));
    }
}

/// The publisher of the worker.
pub(super) struct Port(pub(super) Rc<RefCell<Topic>>);

impl Publisher for Port {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let mut topic = self.0.borrow_mut();
        let Topic {
            address,
            record,
            fault,
            ..
        } = &mut *topic;
        let failed = |reason: String| SendError::Backend {
            address: address.clone(),
            reason,
        };
        if let Some(reason) = fault {
            return Err(failed(reason.clone()));
        }
        let recorded = record.as_mut().map_or(Ok(()), |record| {
            record(&mut Reader::of(body, header.encoding))
        });
        recorded.map_err(|error| failed(error.to_string()))
    }

    fn peers(&self) -> usize {
        self.0.borrow().subscribers
    }
}

/// Declares the samples `Sample` of an interface that fakes keep, over the list of operations that
/// [`rc_middleware::operations!`] documents.
///
/// ```
/// use rc_middleware::{Reader, typed};
/// use rc_runtime::testing::FakeSample;
///
/// macro_rules! interface {
///     ($($what:tt)+) => {
///         $($what)+! {
///             /// The handlers of `Ticks`.
///             Ticks ServeTicks ReceiveTicks, TicksMembers ServeTicksMembers ReceiveTicksMembers;
///             fn tick(number: i64) {
///                 TICK.command(typed::read)
///                 Tick on_tick one_way("tick", 7, 0x2a)
///             }
///         }
///     };
/// }
/// interface!(rc_middleware::operations);
/// interface!(rc_runtime::fake_subscriber);
///
/// let sample = 42_i64.to_le_bytes();
/// assert_eq!(Sample::read(0, &mut Reader::new(&sample)), Ok(Sample::Tick { number: 42 }));
/// ```
#[macro_export]
macro_rules! fake_subscriber {
    (
        $(#[$about:meta])*
        $single:ident $serve:ident $receive:ident, $members:ident $serve_member:ident $receive_member:ident;
        $(
            $(#[$doc:meta])*
            fn $method:ident $(($($arg:ident: $ty:ty),+ $(,)?))? {
                $operation:ident.$how:ident($read:expr $(,)?)
                $sample:ident $on:ident $kind:ident($name:literal $(, $fact:expr)* $(,)?)
            }
        )*
    ) => {
        /// A sample.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Sample {
            $(
                #[doc = ::std::concat!("`", $name, "`")]
                $sample $({ $($arg: $ty),+ })?,
            )*
        }

        impl $crate::testing::FakeSample for Sample {
            fn read(
                topic: usize,
                reader: &mut $crate::middleware::Reader<'_>,
            ) -> ::std::result::Result<Self, $crate::middleware::DecodeError> {
                let mut before = 0..topic;
                $(
                    if before.next().is_none() {
                        return $read(reader).map(|($($($arg,)+)?)| Self::$sample $({ $($arg),+ })?);
                    }
                )*
                ::std::result::Result::Err($crate::middleware::DecodeError::Unknown("topic"))
            }
        }
    };
}
