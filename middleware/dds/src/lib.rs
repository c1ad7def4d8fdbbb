//! The backend for DDS, over the C library Cyclone DDS. `README.md` documents the names of
//! addresses and types in DDS, and what other programs have to know.

mod client;
mod config;
mod endpoint_state;
mod inbox;
mod names;
mod port;
mod publisher;
mod qos;
mod report;
mod server;
mod session;
mod shared_entity;
mod subscriber;
mod udp;
mod watcher;

use rc_middleware::{
    Backend, Client, Endpoint, Environment, OpenError, Publisher, Server, Subscriber,
};
use session::Session;
use std::rc::Rc;
use std::time::Duration;

/// The name of this middleware in the languages and on command lines.
pub const NAME: &str = "dds";

/// Joins the network of `environment`: the domain of the settings of `[middleware.dds]`.
pub fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    Ok(Box::new(Dds(Rc::new(Session::open(environment)?))))
}

/// The configuration of Cyclone DDS that `connect` makes from the settings: XML, and the content of
/// `CYCLONEDDS_URI`.
pub fn configuration(environment: &Environment) -> Result<String, OpenError> {
    config::of(environment).map(|config| config.xml)
}

struct Dds(Rc<Session>);

impl Backend for Dds {
    fn name(&self) -> &'static str {
        NAME
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        Ok(Box::new(publisher::open(&self.0, endpoint)?))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        Ok(Box::new(subscriber::open(&self.0, endpoint)?))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        Ok(Box::new(client::open(&self.0, endpoint)?))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Ok(Box::new(server::open(&self.0, endpoint)?))
    }

    fn mismatches(&self) -> Vec<String> {
        self.0.mismatches()
    }

    fn linger(&self, limit: Duration) {
        self.0.linger(limit);
    }
}
