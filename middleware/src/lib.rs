//! The three patterns of communication, as every backend offers them and every component uses them.
//!
//! - [`backend`]: the traits of a backend. Backends move bytes and know no type.
//! - [`cdr`]: how a value becomes bytes (OMG CDR, XCDR1, little endian).
//! - [`in_place`]: values that are written and read where they are.
//! - [`counter`]: how many values an end has sent.
//! - [`rpc`]: the envelope of a call (after the basic mapping of OMG DDS-RPC 1.0).
//! - [`typed`]: the layer between both, which generated code uses.
//! - [`gaps`]: what a receiver never saw.
//! - [`environment`]: the network that a process belongs to, and its run directory.
//! - [`parameters`]: those of a component, for a middleware that shows them.
//! - [`settings`]: what a configuration says of a middleware.
//!
//! No backend is named here.

pub mod address;
pub mod backend;
pub mod cdr;
pub mod counter;
pub mod environment;
pub mod error;
pub mod gaps;
pub mod in_place;
pub mod parameters;
pub mod qos;
pub mod rpc;
pub mod settings;
pub mod typed;
pub mod wait;
pub mod wake_event;

pub use address::Address;
pub use backend::{
    Backend, Client, Encoding, Endpoint, ExternalType, Header, LoanedSample, Profile, Publisher,
    Reply, Server, Subscriber, TypeIdentity,
};
pub use cdr::{Cdr, DecodeError, EncodeError, Reader, Writer};
pub use counter::Counter;
pub use environment::{Environment, RunDirectory};
pub use error::{CallError, OpenError, ReceiveError, SendError};
pub use gaps::{Gaps, Unread};
pub use in_place::InPlace;
pub use qos::{Durability, Qos, Reliability};
pub use settings::Settings;
pub use wait::wait;
pub use wake_event::WakeEvent;
