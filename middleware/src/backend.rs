//! What a backend is: five traits over bytes.
//!
//! A backend and its ports stay on the thread that made them. A port that receives has a descriptor which
//! becomes readable when something may be there; one waits for it, takes until nothing comes, calls `acknowledge`,
//! takes once more until nothing comes, and waits again. (So nothing that came waits for the acknowledgement, which
//! asks the kernel.) Waiting without a limit is nowhere possible.

use crate::error::{CallError, OpenError, ReceiveError, SendError};
use crate::parameters::ParameterService;
use crate::{Address, Qos};
use std::os::fd::BorrowedFd;
use std::sync::Arc;
use std::time::Duration;

/// What travels beside a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// Hash of the type of the body, see `rc_idsl::canonical`; 0 from a stranger.
    pub type_hash: u64,
    /// Counts the messages of one sender, from 1; 0 where the sender does not count.
    pub sequence: u64,
    /// When it was sent, in nanoseconds of the system's monotonic clock; 0 where the sender does not say.
    pub sent: u64,
    /// How the body is to be read.
    pub encoding: Encoding,
    /// Who sent it: the backend of the receiver fills it in, with an id that no other sender of this connection has or
    /// had; 0 where it cannot tell. It says nothing else, and never travels.
    pub sender: u128,
}

/// How a body is to be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Encoding {
    /// CDR, see [`crate::cdr`].
    #[default]
    Cdr,
    /// The memory image of a plain type, see [`crate::in_place`]; in an answer behind the envelope.
    Image,
}

/// The types of a connection: a name for people and a hash of every operation for certainty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TypeIdentity {
    /// `RoboCompLaser::Laser`, for a topic `RoboCompLaserPub::LaserPub/pushLaserData`.
    pub name: String,
    /// Hash over its operations in their order of declaration.
    pub hash: u64,
}

impl std::fmt::Display for TypeIdentity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}#{:016x}", self.name, self.hash)
    }
}

/// How the body of a call stands behind its envelope, see [`crate::rpc`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Profile {
    /// OMG DDS-RPC: the envelope travels with the body, and an answer is a result or one exception.
    #[default]
    Rpc,
    /// A service of ROS 2: only the body travels, which begins at a multiple of 8 bytes; where an operation throws, its
    /// answer is a code, every exception and the result.
    Ros,
}

/// An operation in the words of a middleware that has types of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExternalType {
    /// The slot that it is of.
    pub slot: String,
    /// Its name in the IDSL.
    pub operation: String,
    /// Its number in the envelope of a call.
    pub id: i32,
    /// Its type, such as `geometry_msgs/msg/Pose`.
    pub type_name: String,
}

/// One end of a connection that is to be opened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// Where the ends meet.
    pub address: Address,
    /// What they say to each other.
    pub types: TypeIdentity,
    /// How.
    pub qos: Qos,
    /// Its operations, where the component was generated for a middleware that has types of its own; else empty.
    pub external_types: Vec<ExternalType>,
}

/// Opens ports on one middleware, for one component.
pub trait Backend {
    /// The word of the languages and command lines: `iceoryx2`, `local` …
    fn name(&self) -> &'static str;

    /// One end that sends to all subscribers of a topic.
    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError>;

    /// One end that receives from all publishers of a topic.
    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError>;

    /// One end that sends commands and queries.
    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError>;

    /// The one end that answers them; a second live one is refused and told who the first is.
    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError>;

    /// Shows the parameters of the component, where the middleware has a way to show them.
    fn parameters(&self, service: Arc<dyn ParameterService>) -> Result<(), OpenError> {
        drop(service);
        Ok(())
    }

    /// Ends that were found since the last look and do not fit to those of this component, a text for people each.
    fn mismatches(&self) -> Vec<String> {
        Vec::new()
    }

    /// Why this middleware works no more in this process, so that only a new one helps; `None` as long as it does.
    fn lost(&self) -> Option<String> {
        None
    }

    /// Waits until what was sent has reached those who are there, at most `limit`; called before the ports of
    /// a component that ends are closed.
    fn linger(&self, limit: Duration);
}

/// The sending end of a topic.
pub trait Publisher {
    /// Sends to all who subscribe now. A slow subscriber loses old values and delays nobody.
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError>;

    /// Whether values can be written in place here.
    fn can_loan(&self) -> bool {
        false
    }

    /// Memory of `length` bytes, aligned to 16, in which a value is written before it is sent. Its content is what
    /// was in it. Fails where nothing is lent.
    fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
        let reason = format!("this middleware lends no memory; {length} bytes were wanted");
        Err(SendError::Backend {
            address: String::new(),
            reason,
        })
    }

    /// How many subscribers there are.
    fn peers(&self) -> usize;
}

/// Memory that a publisher has lent.
pub trait LoanedSample {
    /// The memory.
    fn memory(&self) -> &[u8];

    /// The memory, to be written.
    fn memory_mut(&mut self) -> &mut [u8];

    /// Sends what is in it, as [`Publisher::publish`] does.
    fn send(self: Box<Self>, header: Header) -> Result<(), SendError>;
}

/// The receiving end of a topic.
pub trait Subscriber {
    /// Readable when something may be there.
    fn descriptor(&self) -> BorrowedFd<'_>;

    /// Takes the wake-ups back; what they announced is received before or afterwards. `woken`: whether the descriptor
    /// was readable; where it was not, a backend may have to look more thoroughly.
    fn acknowledge(&mut self, woken: bool);

    /// Hands one value to `take`, where one is there; says whether one was.
    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError>;

    /// How many publishers there are.
    fn peers(&self) -> usize;
}

/// The calling end of a connection. Commands and queries share one queue and keep their order.
pub trait Client {
    /// Identifies this client in the envelope of its calls.
    fn guid(&self) -> [u8; 16];

    /// How its calls are written.
    fn profile(&self) -> Profile {
        Profile::Rpc
    }

    /// Puts a command into the queue of a live server, or fails; also where this component is stopping.
    fn send(&mut self, header: Header, request: &[u8]) -> Result<(), CallError>;

    /// Sends a request and waits for its answer, at most `limit`. `take` gets the answer, once, where `Ok` comes back.
    fn call(
        &mut self,
        header: Header,
        request: &[u8],
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError>;

    /// How many servers there are: none or one.
    fn peers(&self) -> usize;
}

/// The answering end of a connection.
pub trait Server {
    /// Readable when something may be there.
    fn descriptor(&self) -> BorrowedFd<'_>;

    /// Takes the wake-ups back; what they announced is served before or afterwards. `woken`: whether the descriptor
    /// was readable; where it was not, a backend may have to look more thoroughly.
    fn acknowledge(&mut self, woken: bool);

    /// Hands one request to `answer`, where one is there, with a place for the reply. Says whether a request was
    /// there.
    fn serve(
        &mut self,
        answer: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError>;

    /// How many clients there are.
    fn peers(&self) -> usize;
}

/// Where the answer to a request goes.
pub trait Reply {
    /// What is in it in the end is the reply, and nothing is none; empty at first.
    fn body(&mut self) -> &mut Vec<u8>;

    /// How the request is to be read and the reply to be written.
    fn profile(&self) -> Profile {
        Profile::Rpc
    }

    /// Memory of `length` bytes, aligned to 16, in which the reply is written instead; none where this middleware
    /// lends none, or has none left.
    fn loan(&mut self, length: usize) -> Option<&mut [u8]> {
        let _ = length;
        None
    }

    /// The memory that was lent becomes the reply, as the memory image of a plain type behind its envelope.
    fn send_loan(&mut self) {}
}

impl Reply for Vec<u8> {
    fn body(&mut self) -> &mut Vec<u8> {
        self
    }
}

/// The time that goes into [`Header::sent`].
pub fn now() -> u64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::Monotonic);
    time.tv_sec as u64 * 1_000_000_000 + time.tv_nsec as u64
}
