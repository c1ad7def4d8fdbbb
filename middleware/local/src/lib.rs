//! The backend between threads of one process: for components that share one (`middleware auto;`),
//! and for tests. It is the simplest example of a backend. It passes the suite of `rc-conformance`.
//!
//! Endpoints find each other by network and address, in one table of the process. All subscribers
//! of a sample share its memory: a sample that is written in place is read where it was written.
//!
#![doc = include_str!("example.md")]

mod body;
mod calls;
mod hub;
mod reply;
mod topic;

use rc_middleware::{
    Backend, Client, Endpoint, Environment, Linked, OpenError, Publisher, Server, Subscriber,
};
use std::time::Duration;

/// The name of this middleware in the languages and on command lines.
pub const NAME: &str = "local";

/// This middleware, as a component links it.
pub const LINKED: Linked = Linked::new(NAME, connect);

/// Joins the network of `environment`.
pub fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    Ok(Box::new(Local {
        environment: environment.clone(),
    }))
}

struct Local {
    environment: Environment,
}

impl Backend for Local {
    fn name(&self) -> &'static str {
        NAME
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        Ok(Box::new(topic::publisher(&self.environment, endpoint)?))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        Ok(Box::new(topic::subscriber(&self.environment, endpoint)?))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        Ok(Box::new(calls::client(&self.environment, endpoint)?))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Ok(Box::new(calls::server(&self.environment, endpoint)?))
    }

    /// Sent messages are in the queues of their receivers already.
    fn linger(&self, _limit: Duration) {}
}
