//! A component that forwards: what one of its slots receives, another one sends. Its types are
//! known at run time.
//!
//! [`Description`] is that of a component (`rc_host::Program`) with a list of routes. The slots of a
//! route have the same interface and opposite roles: samples of a topic go from a subscriber to a
//! publisher, calls from a server to a client, and their replies, exceptions and refusals back. The
//! two slots may have different middlewares, and each converts as the command line says
//! (`--convert`).
//!
//! - A message keeps its bytes. It is decoded and encoded again only where the two middlewares align
//!   it differently, and where a value in place meets a middleware that has none.
//! - A sample keeps the time at which it was sent first, and the value of a reply its age.
//! - Up to [`STARTED_CALLS`](rc_middleware::started::STARTED_CALLS) calls of a slot are under way at a
//!   time, each until its reply comes or the timeout of the sending slot is over. Requests wait beyond
//!   that in the queue of their middleware, which has a bound. Those of one sender keep their order.
//! - In simulated time and in an exact recording, calls pass one at a time, and other messages wait.
//! - A call that nobody serves is refused with the reason, and a state that refuses keeps its name.

mod caller;
mod description;
mod forwarder;

pub use description::{Description, Route};
pub use forwarder::Forwarder;

use std::ffi::OsString;
use std::path::PathBuf;

/// Runs the component of a description with these arguments until it ends. Returns the exit code.
#[must_use]
pub fn run(description: &Description, args: impl IntoIterator<Item = OsString>) -> u8 {
    rc_runtime::run_with(
        description.program.description,
        |core, ports, _| Forwarder::open(description, core, ports),
        args,
        PathBuf::new(),
    )
}
