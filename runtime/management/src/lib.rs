//! The line protocol between components, supervisors, agents and tools.
//!
//! Each message is one JSON object a line. Sockets in the run directory and the link between a
//! component and its supervisor speak JSON-RPC 2.0; a supervisor and its agents exchange the plain
//! objects of [`agent`].
//!
//! | module | between |
//! |---|---|
//! | [`component`] | tools and a component, on `NAME.sock` |
//! | [`supervisor`] | tools and the supervisor of a network, on `rcdeploy.sock` |
//! | [`link`] | a component and the supervisor that started it, on a socket at its standard input |
//! | [`agent`] | a supervisor and its agent on another machine, over ssh |
//!
//! [`hops`] are the notes of a component about messages on chains, [`chains`] the report of its
//! supervisor.
//!
//! [`lines`] splits bytes into lines of bounded length, [`rpc`] reads and writes JSON-RPC,
//! [`Client`] sends requests and receives answers and notifications, [`Server`] receives requests
//! and sends answers. [`Output`] is what waits for the other side of any connection.
//!
//! # Example
//!
//! ```
//! use rc_management::lines::{Lines, Overlong};
//!
//! let mut lines = Lines::new(Overlong::Skip);
//! let found = lines.push(b"{\"a\":1}\n{\"b\"");
//! assert_eq!(found.len(), 1); // the second line has no end yet
//! ```

pub mod agent;
pub mod chains;
mod client;
pub mod component;
mod component_state;
pub mod event;
pub mod hops;
pub mod lines;
pub mod link;
mod listener;
pub mod observation;
mod output;
pub mod rpc;
pub mod server;
pub mod supervisor;

pub use client::{CallError, Client, Incoming, LONGEST};
pub use listener::Listener;
pub use output::Output;
pub use rc_lifecycle as lifecycle;
pub use server::{Server, ServerSource};
