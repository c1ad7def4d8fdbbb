//! The traits of a backend. They move bytes and know no message types.
//!
//! A backend and its ports stay on the thread that made them. Each receiving port has a descriptor,
//! which becomes readable when a message may be there. The owner of a port waits for its
//! descriptor, receives until nothing is left, calls `acknowledge`, receives once more until
//! nothing is left, and waits again. So no message waits for `acknowledge`, which calls the kernel.
//! Every wait has a limit.

use crate::cdr::EncodeError;
use crate::error::{CallError, OpenError, ReceiveError, SendError};
use crate::freshness::Freshness;
use crate::lifecycle::LifecycleService;
use crate::log::LogQueue;
use crate::parameters::ParameterService;
pub use crate::profile::Profile;
use crate::request_body::RequestBody;
use crate::shared_value::{Message, SharedValue};
use crate::started::Awaiting;
use crate::{Address, Encoding, Header, Qos, QueueGauge};
use std::os::fd::BorrowedFd;
use std::sync::Arc;
use std::time::Duration;

/// The types of a connection: a name for people, and a hash that two endpoints compare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TypeIdentity {
    /// `RoboCompLaser::Laser`, for a topic `RoboCompLaserPub::LaserPub/pushLaserData`.
    pub name: String,
    /// Hash over the operations, in their order of declaration.
    pub hash: u64,
}

impl std::fmt::Display for TypeIdentity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}#{:016x}", self.name, self.hash)
    }
}

/// The type of an operation in a middleware that has types of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExternalType {
    /// The slot of the operation.
    pub slot: String,
    /// The name of the operation in the IDSL.
    pub operation: String,
    /// The discriminator of the operation in the envelope of a call.
    pub id: i32,
    /// The name of the type, such as `geometry_msgs/msg/Pose`.
    pub type_name: String,
}

/// Describes one side of a connection, which a backend opens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Endpoint {
    /// The address of the connection.
    pub address: Address,
    /// The types of the connection.
    pub types: TypeIdentity,
    /// Quality of service.
    pub qos: Qos,
    /// Types of the operations, where the component was generated for a middleware with types of
    /// its own; else empty.
    pub external_types: Vec<ExternalType>,
}

/// Opens ports on one middleware, for one component.
pub trait Backend {
    /// The name of the middleware in the languages and on command lines: `iceoryx2`, `local` …
    fn name(&self) -> &'static str;

    /// Opens a publisher of a topic.
    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError>;

    /// Opens a subscriber of a topic.
    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError>;

    /// Opens a client, which sends commands and queries.
    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError>;

    /// Opens the server. While another server of this address is alive, this fails and names that
    /// server.
    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError>;

    /// Offers the parameters of the component to nodes of the middleware, where the middleware has
    /// parameters.
    fn parameters(&self, service: Arc<dyn ParameterService>) -> Result<(), OpenError> {
        drop(service);
        Ok(())
    }

    /// Offers the life cycle of a managed component to nodes of the middleware, where the
    /// middleware has managed nodes.
    fn lifecycle(&self, service: Arc<dyn LifecycleService>) -> Result<(), OpenError> {
        drop(service);
        Ok(())
    }

    /// Publishes the log of the component from now on, where the middleware has a log. Returns
    /// whether it does.
    fn log(&self, log: &Arc<LogQueue>) -> Result<bool, OpenError> {
        let _ = log;
        Ok(false)
    }

    /// The reports about endpoints that do not match those of this component and are there: one
    /// text each.
    fn mismatches(&self) -> Vec<String> {
        Vec::new()
    }

    /// Whether the ends that are there have all messages that were sent to them, so that they
    /// receive them before anything that is sent later, by whatever way. Waits for that at most
    /// `limit`. Best-effort subscribers, tools and programs without a description do not count. A
    /// middleware that puts messages into the queues of their receivers has nothing to wait for.
    fn have_arrived(&self, limit: Duration) -> bool {
        let _ = limit;
        true
    }

    /// Waits until all sent messages have arrived, at most `limit`. The runtime calls it before it
    /// closes the ports of a component that ends.
    fn linger(&self, limit: Duration);
}

/// A publisher of a topic.
pub trait Publisher {
    /// Sends a sample to all subscribers that are there. A slow subscriber loses old samples and
    /// delays no other.
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError>;

    /// Whether receivers in this process get what [`Publisher::publish_value`] sends as a value.
    fn takes_values(&self) -> bool {
        false
    }

    /// [`Publisher::publish`] for a body that is a value.
    fn publish_value(&mut self, header: Header, body: SharedValue) -> Result<(), SendError> {
        self.publish(header, body.bytes())
    }

    /// Whether [`Publisher::loan`] gives memory for bodies of this encoding.
    fn can_loan(&self, encoding: Encoding) -> bool {
        let _ = encoding;
        false
    }

    /// Lends memory of `length` bytes for a sample that is written in place; it is aligned to 16 if
    /// images can be lent. Its content is undefined but initialized. It fails where
    /// [`Publisher::can_loan`] is false.
    fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
        let reason = format!("this middleware lends no memory; {length} bytes were wanted");
        Err(SendError::Backend {
            address: String::new(),
            reason,
        })
    }

    /// Lends memory of `length` bytes for an image, which its owner may keep while the publisher
    /// sends other samples. `None` if the middleware lends none, so that the sample has to be
    /// copied.
    fn loan_image(&mut self, length: usize) -> Result<Option<Box<dyn LoanedSample>>, SendError> {
        let _ = length;
        Ok(None)
    }

    /// Sends an image that [`Publisher::loan_image`] of this publisher has lent, see
    /// [`LoanedSample::send_image`].
    fn send_lent(
        &mut self,
        loan: Box<dyn LoanedSample>,
        header: Header,
        encode: ImageEncoder<'_>,
    ) -> Result<(), SendError> {
        loan.send_image(header, encode)
    }

    /// The value that subscribers see as [`Header::sender`] of its samples: one for each
    /// middleware, empty if a backend cannot tell.
    fn senders(&self) -> Vec<u128> {
        Vec::new()
    }

    /// The number of subscribers.
    fn peers(&self) -> usize;
}

/// Memory of a sample that a publisher has lent.
pub trait LoanedSample {
    /// The memory.
    fn memory(&self) -> &[u8];

    /// The memory, for writing.
    fn memory_mut(&mut self) -> &mut [u8];

    /// Sends the sample, as [`Publisher::publish`] does.
    fn send(self: Box<Self>, header: Header) -> Result<(), SendError>;

    /// Sends an image. Receivers over a middleware that carries none get what `encode` makes of it.
    fn send_image(
        self: Box<Self>,
        header: Header,
        encode: ImageEncoder<'_>,
    ) -> Result<(), SendError> {
        let _ = encode;
        self.send(header)
    }
}

/// Makes CDR of an image.
pub type ImageEncoder<'e> = &'e dyn Fn(&[u8]) -> Result<Vec<u8>, EncodeError>;

/// How many received samples a subscriber may keep besides the one that is handled.
pub const KEPT_SAMPLES: usize = 4;

/// A received sample in the memory of the middleware. It may outlive its subscriber, and be used
/// and dropped on any thread.
pub trait KeptSample: Send {
    /// The body. Its address does not change.
    fn memory(&self) -> &[u8];
}

/// A subscriber of a topic.
pub trait Subscriber {
    /// Readable when something may have arrived.
    fn descriptor(&self) -> BorrowedFd<'_>;

    /// Clears readiness. Drain with `receive` before and after. `woken`: whether the descriptor was
    /// readable. If it was not, a backend may have lost a wake-up and looks for messages itself.
    fn acknowledge(&mut self, woken: bool);

    /// Hands the next sample to `take`; says whether there was one.
    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError>;

    /// [`Subscriber::receive`] for samples that may be values of a publisher in this process.
    fn receive_message(
        &mut self,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Result<bool, ReceiveError> {
        self.receive(&mut |header, body| take(header, Message::Bytes(body)))
    }

    /// Whether [`Subscriber::receive_kept`] gives samples away.
    fn can_keep(&self) -> bool {
        false
    }

    /// Hands the next sample itself to `take`, where [`Subscriber::can_keep`]. It may keep up to [`KEPT_SAMPLES`] of them; with more, receiving fails.
    fn receive_kept(
        &mut self,
        take: &mut dyn FnMut(Header, Box<dyn KeptSample>),
    ) -> Result<bool, ReceiveError> {
        let _ = take;
        Ok(false)
    }

    /// The number of publishers.
    fn peers(&self) -> usize;

    /// Gauge of the receive queue; `None` if the middleware reserves the memory of the queue at the
    /// start.
    fn queue(&self) -> Option<QueueGauge> {
        None
    }
}

/// A client. Commands and queries share one queue and keep their order.
pub trait Client {
    /// Identifies this client in the envelopes of its calls.
    fn guid(&self) -> [u8; 16];

    /// The form of this client's calls.
    fn profile(&self) -> Profile {
        Profile::Rpc
    }

    /// Puts a command into the queue of a live server, or fails. A component that stops can still
    /// send commands.
    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError>;

    /// Whether servers in this process get [`RequestBody::value`]. Only in [`Profile::Rpc`].
    fn takes_values(&self) -> bool {
        false
    }

    /// Whether requests are written into memory of the middleware, so that a second pass over large
    /// arrays saves a copy.
    fn can_loan(&self) -> bool {
        false
    }

    /// Sends a request and waits for its reply, at most `limit`. If the result is `Ok`, `take` got
    /// the reply, once.
    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError>;

    /// [`Client::call`] for replies that may be values of a server in this process.
    fn call_message(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Result<(), CallError> {
        let mut take = |header, body: &[u8]| take(header, Message::Bytes(body));
        self.call(header, request, limit, &mut take)
    }

    /// Sends a request and returns without its reply. [`Client::poll`] ends the call, which the
    /// sequence number of `header` identifies, within `limit`. At most
    /// [`STARTED_CALLS`](crate::started::STARTED_CALLS) have not ended; one more is
    /// [`CallError::TooManyStarted`].
    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError>;

    /// The sequence number and the result of the next started call that has ended, the oldest
    /// first. If the result is `Ok`, `take` got the number and the reply, once. Each call ends
    /// once.
    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)>;

    /// [`Client::poll`] for replies that may be values of a server in this process.
    fn poll_message(
        &mut self,
        take: &mut dyn FnMut(u64, Header, Message<'_>),
    ) -> Option<(u64, Result<(), CallError>)> {
        self.poll(&mut |sequence, header, body| take(sequence, header, Message::Bytes(body)))
    }

    /// Whether started calls end in the order of their start, see
    /// [`StartedCalls::end_in_order`](crate::started::StartedCalls::end_in_order).
    fn end_in_order(&mut self, keeps: bool) {
        let _ = keeps;
    }

    /// Forgets a started call: it does not end any more, and its reply is dropped.
    fn forget(&mut self, sequence: u64);

    /// The descriptor and time to wait for while started calls have not ended. Poll until nothing
    /// is left before each wait: other calls of this client also clear readiness. `None` also for a
    /// client whose calls have ended when they are started.
    fn awaiting(&self) -> Option<Awaiting<'_>> {
        None
    }

    /// The number of servers, 0 or 1.
    fn peers(&self) -> usize;

    /// Identifies the server: another number once another server is there, 0 if there is none. A
    /// backend that cannot tell servers apart only says whether there is one.
    fn server(&self) -> u128 {
        self.peers() as u128
    }

    /// The identities that servers see as those of this client.
    fn senders(&self) -> Vec<u128> {
        vec![u128::from_be_bytes(self.guid())]
    }

    /// The number by which a server will see this request, if it is not that of its envelope.
    fn number_there(&self, request: &dyn RequestBody) -> Option<u64> {
        let _ = request;
        None
    }

    /// Whether `sent` of a reply is that of its request less the age of its value, and not before its
    /// request without an age, see [`Reply::set_age`].
    fn replies_have_ages(&self) -> bool {
        false
    }

    /// The age of the last reply, and what it is made of, where the slot keeps track.
    fn freshness(&self) -> Option<Freshness> {
        None
    }

    /// Gauge of the queue of replies; `None` if the middleware reserves the memory of
    /// the queue at the start.
    fn queue(&self) -> Option<QueueGauge> {
        None
    }
}

/// A server.
pub trait Server {
    /// Readable when something may have arrived.
    fn descriptor(&self) -> BorrowedFd<'_>;

    /// Clears readiness. Drain with `serve` before and after. `woken`: as for a subscriber.
    fn acknowledge(&mut self, woken: bool);

    /// Passes the next request and its reply buffer to `handler`. Returns whether there was a
    /// request.
    fn serve(
        &mut self,
        handler: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError>;

    /// [`Server::serve`] for requests that may be values of a client in this process.
    fn serve_message(
        &mut self,
        handler: &mut dyn FnMut(Header, Message<'_>, &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        self.serve(&mut |header, body, reply| handler(header, Message::Bytes(body), reply))
    }

    /// The number of clients.
    fn peers(&self) -> usize;

    /// Gauge of the receive queue; `None` if the middleware reserves the memory of the queue at the
    /// start.
    fn queue(&self) -> Option<QueueGauge> {
        None
    }
}

/// Takes the reply to a request.
pub trait Reply {
    /// Reply buffer, initially empty. If it is empty after the call, no reply is sent.
    fn body(&mut self) -> &mut Vec<u8>;

    /// The form of the request, and of the reply.
    fn profile(&self) -> Profile {
        Profile::Rpc
    }

    /// Says how old the value of the reply is. Backends whose replies have no place for it ignore it,
    /// see [`Client::replies_have_ages`].
    fn set_age(&mut self, age: Duration) {
        let _ = age;
    }

    /// Whether the client is in this process, so that [`Reply::send_value`] may be called. Only in
    /// [`Profile::Rpc`].
    fn takes_values(&self) -> bool {
        false
    }

    /// Makes a value the reply, instead of [`Reply::body`].
    fn send_value(&mut self, value: SharedValue) {
        let _ = value;
    }

    /// Whether [`Reply::loan`] gives memory for replies of this encoding.
    fn can_loan(&self, encoding: Encoding) -> bool {
        let _ = encoding;
        false
    }

    /// Memory of the middleware, `length` bytes, for a reply of this encoding. An image follows its
    /// envelope, and is aligned to 16. Its content is undefined but initialized. `None` if
    /// [`Reply::can_loan`] is false or the middleware has no memory left.
    fn loan(&mut self, length: usize, encoding: Encoding) -> Option<&mut [u8]> {
        let _ = (length, encoding);
        None
    }

    /// Makes the memory of [`Reply::loan`] the reply, instead of [`Reply::body`].
    fn send_loan(&mut self) {}

    /// Defers the reply, in place of sending it. `None` if the reply has to be ready when the
    /// handler returns. Only for a query, and once.
    fn defer(&mut self) -> Option<Box<dyn DeferredReply>> {
        None
    }
}

/// A reply after the handler of its request has returned. Dropping it leaves the client without a
/// reply.
pub trait DeferredReply {
    /// Lets `write` write the reply and sends it. It cannot be deferred again.
    ///
    /// # Errors
    /// The reply was not sent.
    fn send(self: Box<Self>, write: &mut dyn FnMut(&mut dyn Reply)) -> Result<(), ReceiveError>;
}

impl Reply for Vec<u8> {
    fn body(&mut self) -> &mut Vec<u8> {
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_shown_with_their_hash() {
        let types = TypeIdentity {
            name: "A::B".to_owned(),
            hash: 0x1f,
        };
        assert_eq!(types.to_string(), "A::B#000000000000001f");
    }
}
