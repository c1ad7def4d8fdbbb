//! The backend whose clients and publishers end in the fakes of a test.

use super::server::{self, Calls};
use super::subscriber::{self, Topic};
use rc_middleware::{
    Backend, Client, Endpoint, OpenError, Publisher, Server, Subscriber, WakeEvent,
};
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::time::Duration;

/// The fakes of one test, by their addresses.
pub(super) struct Hub {
    wake_event: WakeEvent,
    servers: RefCell<BTreeMap<String, Rc<RefCell<Calls>>>>,
    topics: RefCell<BTreeMap<String, Rc<RefCell<Topic>>>>,
}

impl Hub {
    pub(super) fn new(wake_event: WakeEvent) -> Self {
        Self {
            wake_event,
            servers: RefCell::default(),
            topics: RefCell::default(),
        }
    }

    /// The server at an address.
    pub(super) fn server(&self, address: &str) -> Rc<RefCell<Calls>> {
        let mut servers = self.servers.borrow_mut();
        let new = || Rc::new(RefCell::new(Calls::new(address)));
        Rc::clone(servers.entry(address.to_owned()).or_insert_with(new))
    }

    /// The topic at an address.
    pub(super) fn topic(&self, address: &str) -> Rc<RefCell<Topic>> {
        let mut topics = self.topics.borrow_mut();
        let new = || Rc::new(RefCell::new(Topic::new(address)));
        Rc::clone(topics.entry(address.to_owned()).or_insert_with(new))
    }
}

/// Stands for one middleware of the component.
pub(super) struct FakeBackend {
    name: &'static str,
    hub: Rc<Hub>,
}

impl FakeBackend {
    pub(super) fn new(name: &'static str, hub: Rc<Hub>) -> Self {
        Self { name, hub }
    }
}

impl Backend for FakeBackend {
    fn name(&self) -> &'static str {
        self.name
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        let topic = self.hub.topic(&endpoint.address.to_string());
        Ok(Box::new(subscriber::Port(topic)))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        Err(receives(endpoint))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        let calls = self.hub.server(&endpoint.address.to_string());
        Ok(Box::new(server::Port {
            calls,
            wake_event: self.hub.wake_event.clone(),
        }))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Err(receives(endpoint))
    }

    fn linger(&self, _limit: Duration) {}
}

fn receives(endpoint: &Endpoint) -> OpenError {
    OpenError::Backend {
        address: endpoint.address.to_string(),
        reason: "a test calls the handlers of its worker itself".to_owned(),
    }
}
