//! Looks at a running network, calls its operations and sends to its topics, with types that are
//! known at run time only.
//!
//! - [`Network`]: what runs, as the components themselves describe it.
//! - [`Processes`]: notices that all components are new ones.
//! - [`Observer`]: the messages of topics, and of slots that are tapped.
//! - [`call()`]: calls an operation of a component.
//! - [`Sender`]: sends samples to a topic.
//! - [`Responder`]: serves calls in place of a component, which is the one case where a tool is a
//!   peer.
//! - [`Poller`]: repeats a look on a thread of its own.
//! - [`RemoteClock`]: how far the clocks of another machine are ahead.
//! - [`send_transport`], [`receive_transport`]: how long messages need from process to process.
//! - [`latencies`]: how long messages need over each connection of a network.
//! - [`TimeTopic`], [`TimeSource`]: the time of the network, received and published.
//!
//! A tool is not a peer: it takes no place of a component, delays no message, and no component
//! waits for it. Topics of this machine, of DDS and of ROS 2 are read from the middleware; those in
//! the shared memory of another machine are copied by their component, over its management socket.

mod backends;
mod calls;
mod clock;
mod error;
mod latency;
mod lookup;
mod network;
mod observer;
mod poller;
mod processes;
mod reach;
mod responder;
mod sender;
mod source;
mod time;
mod transport;

pub use calls::{Answer, call};
pub use clock::{Estimate, MachineClock, Offset, RemoteClock};
pub use error::Error;
pub use latency::{ConnectionLatency, Latencies, latencies};
pub use lookup::nearest_of;
pub use network::{Component, End, Network, Operation, Service, Topic};
pub use observer::{FeedId, MessageKind, Observed, Observer};
pub use poller::Poller;
pub use processes::Processes;
pub use responder::Responder;
pub use sender::Sender;
pub use source::{SendingClock, Source};
pub use time::{TimeSource, TimeTopic};
pub use transport::{receive_transport, remove_transport, send_transport};
