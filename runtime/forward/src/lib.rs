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
//! - A call waits in the forwarder until its reply comes or the timeout of the sending slot is over.
//!   Until then, the other messages wait in the queues of their middlewares, which have bounds.
//! - A call that nobody serves is refused with the reason, and a state that refuses keeps its name.

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
