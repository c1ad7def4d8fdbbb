//! Topics, commands and queries over iceoryx2: one machine, shared memory, no broker.
//!
//! - [`connect`]: the backend of one component.
//! - [`Holder`], [`wipe`], [`leftovers`]: for the deployer of a network.
//!
//! `docs/shared-memory-wire.md` specifies service names and message formats.
//!
#![doc = include_str!("example.md")]

mod bounded;
mod cleanup;
mod client;
mod configuration;
mod descriptor;
mod holder;
mod incomplete_files;
mod late_joiners;
mod leader;
mod membership;
mod memory;
mod message;
mod mutex;
mod names;
mod nodes;
mod notifier;
mod observer;
mod open_lock;
mod opening;
mod port_tags;
mod ports;
mod process_monitor;
mod prompt;
mod publisher;
mod rounds;
mod server;
mod service;
mod service_files;
mod session;
mod subscriber;
mod tool_ports;
mod variant;
mod wait_set;

pub use holder::Holder;
pub use membership::leave_all;
pub use names::prefix;
pub use service_files::{leftovers, wipe};

use rc_middleware::{
    Backend, Client, Endpoint, Environment, Linked, OpenError, Publisher, Server, Subscriber,
};
use session::Session;
use std::sync::Arc;
use std::time::Duration;

/// Name of this middleware in the languages and on command lines.
pub const NAME: &str = "iceoryx2";

/// This middleware, as a component links it.
pub const LINKED: Linked = Linked {
    observe: Some(observe),
    ..Linked::new(NAME, connect)
};

/// Joins the network of `environment`. Blocks for at most eight seconds, as each opening of a port
/// does; the error then names the files that are in the way.
pub fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    Ok(Box::new(Iceoryx2 {
        session: Session::open(environment)?,
    }))
}

/// Joins the network of `environment` as a tool: its subscribers and publishers are not counted as
/// peers and take no place of a component. It blocks as [`connect`] does.
pub fn observe(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    let session = Session::open(environment)?;
    Ok(Box::new(observer::Observing::new(session)?))
}

/// One iceoryx2 node and the ports that it opens. [`bounded`] limits the time of each opening.
struct Iceoryx2 {
    session: Arc<Session>,
}

impl Backend for Iceoryx2 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        let port = opening::open(&self.session, endpoint, publisher::open)?;
        Ok(Box::new(port))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        let port = opening::open(&self.session, endpoint, subscriber::open)?;
        Ok(Box::new(port))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        let port = opening::open(&self.session, endpoint, client::open)?;
        Ok(Box::new(port))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        let port = opening::open(&self.session, endpoint, server::open)?;
        Ok(Box::new(port))
    }

    fn linger(&self, limit: Duration) {
        self.session.linger(limit);
    }
}
