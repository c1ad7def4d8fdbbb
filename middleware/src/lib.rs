//! Communication of components: topics, commands and queries, over exchangeable backends.
//!
//! - [`backend`]: the traits of a backend. Backends move bytes and know no type.
//! - [`header`]: the metadata of a message.
//! - [`cdr`]: how a value becomes bytes (OMG CDR, XCDR1, little endian).
//! - [`in_place`]: samples that are written and read in shared memory.
//! - [`counter`]: the number of sent messages.
//! - [`request_body`]: the request of a client, as bytes or written into the memory of a
//!   middleware.
//! - [`rpc`]: the envelope of a call (after the basic mapping of OMG DDS-RPC 1.0).
//! - [`typed`]: typed publishers and clients, which generated code uses.
//! - [`fan_out`]: a publisher over several middlewares.
//! - [`freshness`]: how old a value is, and what it is made of.
//! - [`gaps`]: the samples that a receiver lost.
//! - [`lifecycle`]: the life cycle of a managed component, for a middleware with managed nodes.
//! - [`log`]: the log of a component, for a middleware that publishes it.
//! - [`environment`]: the network of a process, and its run directory.
//! - [`network_time`]: where a source of time and its followers meet.
//! - [`parameters`]: the parameters of a component, for a middleware with parameters.
//! - [`settings`]: the settings of middlewares.
//! - [`shared_value`]: messages between components of one process, encoded only on demand.
//!
//! This crate names no backend.
//!
//! # Example
//!
//! ```
//! use rc_middleware::{Cdr, Writer};
//!
//! let mut writer = Writer::over(Vec::new());
//! 7_u32.encode(&mut writer);
//! assert_eq!(writer.into_bytes(), [7, 0, 0, 0]);
//! ```

pub mod address;
pub mod backend;
pub mod cdr;
pub mod counter;
pub mod environment;
pub mod error;
pub mod fan_out;
pub mod freshness;
pub mod gaps;
pub mod header;
pub mod in_place;
pub mod lifecycle;
pub mod linked;
pub mod log;
mod macros;
mod member;
pub mod network_time;
pub mod parameters;
mod profile;
pub mod qos;
pub mod queue_gauge;
pub mod request_body;
pub mod rpc;
pub mod settings;
pub mod shared_value;
mod spin;
pub mod started;
pub mod typed;
pub mod wait;
pub mod wake_event;

pub use address::Address;
pub use backend::{
    Backend, Client, DeferredReply, Endpoint, ExternalType, KEPT_SAMPLES, KeptSample, LoanedSample,
    Profile, Publisher, Reply, Server, Subscriber, TypeIdentity,
};
pub use cdr::{Cdr, DecodeError, EncodeError, Reader, Writer};
pub use counter::Counter;
pub use environment::{Environment, RunDirectory, user_name};
pub use error::{CallError, OpenError, ReceiveError, SendError};
pub use freshness::{Fresh, Freshness, Made};
pub use gaps::{Gaps, Unread};
pub use header::{Encoding, Header, now};
pub use in_place::InPlace;
pub use linked::{Connect, Linked};
pub use log::{LogLevel, LogLine, LogQueue};
pub use member::Member;
pub use qos::{Durability, Qos, Reliability, Stale};
pub use queue_gauge::QueueGauge;
pub use request_body::RequestBody;
pub use settings::Settings;
pub use shared_value::{Message, SharedValue};
pub use spin::Spin;
pub use wait::wait;
pub use wake_event::WakeEvent;
