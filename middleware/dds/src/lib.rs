//! The backend for DDS, over the C library Cyclone DDS. `docs/dds.md` documents the names of
//! addresses and types in DDS, and what other programs have to know.
//!
#![doc = include_str!("example.md")]

mod client;
mod config;
mod inbox;
mod names;
mod server;

use rc_middleware::{
    Backend, Client, Endpoint, Environment, Linked, OpenError, Publisher, Server, Subscriber,
};
use rc_network::{EndpointSpec, Role, Session, TopicPublisher, TopicSubscriber, signal};
use std::rc::Rc;
use std::time::Duration;

/// The name of this middleware in the languages and on command lines.
pub const NAME: &str = "dds";

/// This middleware, as a component links it.
pub const LINKED: Linked = Linked {
    observe: Some(observe),
    ..Linked::new(NAME, connect)
};

/// Joins the network of `environment`: the domain of the settings of `[middleware.dds]`.
pub fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    let joining = config::of(environment)?;
    Ok(Box::new(Dds(Rc::new(Session::open(
        environment,
        &joining,
    )?))))
}

/// Joins the domain as a tool: components do not count its endpoints as peers.
pub fn observe(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    let joining = config::of(environment)?;
    let session = Session::open(environment, &joining)?;
    session.observe();
    Ok(Box::new(Dds(Rc::new(session))))
}

/// The configuration of Cyclone DDS that `connect` makes from the settings: XML, and the content of
/// `CYCLONEDDS_URI`.
pub fn configuration(environment: &Environment) -> Result<String, OpenError> {
    config::of(environment).map(|joining| joining.configuration)
}

struct Dds(Rc<Session>);

/// An endpoint of a topic.
fn topic(endpoint: &Endpoint, role: Role) -> Result<EndpointSpec<'_>, OpenError> {
    Ok(EndpointSpec {
        names: names::topic(endpoint),
        role,
        types: &endpoint.types,
        qos: Some(endpoint.qos),
        signal: signal(endpoint.address.as_str())?,
        labels: String::new(),
    })
}

impl Backend for Dds {
    fn name(&self) -> &'static str {
        NAME
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        let spec = topic(endpoint, Role::Publisher)?;
        let address = endpoint.address.as_str();
        Ok(Box::new(TopicPublisher::open(&self.0, address, spec)?))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        let spec = topic(endpoint, Role::Subscriber)?;
        let (address, depth) = (endpoint.address.as_str(), endpoint.qos.depth);
        let subscriber = TopicSubscriber::open(&self.0, address, spec, depth)?;
        Ok(Box::new(subscriber))
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

    fn have_arrived(&self, limit: Duration) -> bool {
        self.0.have_arrived(limit)
    }

    fn linger(&self, limit: Duration) {
        self.0.linger(limit);
    }
}
