//! The backend whose clients and publishers end in the fakes of a test.

use super::server::{self, Calls};
use super::subscriber::{self, Topic};
use rc_middleware::{
    Backend, Client, Endpoint, OpenError, Publisher, Server, Subscriber, WakeEvent,
};
use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::rc::Rc;
use std::time::Duration;

/// The fakes of one test, by their addresses.
pub(super) struct Hub {
    wake_event: WakeEvent,
    servers: RefCell<BTreeMap<String, Rc<RefCell<Calls>>>>,
    topics: RefCell<BTreeMap<String, Rc<RefCell<Topic>>>>,
    /// Constructors of the fakes of a member, by the prefix of the addresses of its array.
    arrays: RefCell<Vec<(String, Rc<MakeMember>)>>,
}

/// Makes the fakes of a member, by its name.
type MakeMember = dyn Fn(&Rc<Hub>, &str);

impl Hub {
    pub(super) fn new(wake_event: WakeEvent) -> Self {
        Self {
            wake_event,
            servers: RefCell::default(),
            topics: RefCell::default(),
            arrays: RefCell::default(),
        }
    }

    /// The server at an address.
    pub(super) fn server(&self, address: &str) -> Rc<RefCell<Calls>> {
        let mut servers = self.servers.borrow_mut();
        let number = servers.len() as u64;
        let new = || Rc::new(RefCell::new(Calls::new(address, number)));
        Rc::clone(servers.entry(address.to_owned()).or_insert_with(new))
    }

    /// Makes the fakes of each member that is opened at `array/NAME`.
    pub(super) fn prepare(&self, array: &str, make: impl Fn(&Rc<Self>, &str) + 'static) {
        let array = (format!("{array}/"), Rc::new(make) as Rc<MakeMember>);
        self.arrays.borrow_mut().push(array);
    }

    /// Makes the fakes of the member at this address, if it is one.
    fn make_member(self: &Rc<Self>, address: &str) {
        let arrays = self.arrays.borrow().clone();
        let found = arrays
            .iter()
            .find_map(|(array, make)| Some((address.strip_prefix(array)?, make)));
        if let Some((rest, make)) = found {
            // The address of a topic ends with its operation.
            let name = rest.split('/').next().unwrap_or_default();
            make(self, name);
        }
    }

    /// The topic at an address.
    pub(super) fn topic(&self, address: &str) -> Rc<RefCell<Topic>> {
        let mut topics = self.topics.borrow_mut();
        let new = || Rc::new(RefCell::new(Topic::new(address)));
        Rc::clone(topics.entry(address.to_owned()).or_insert_with(new))
    }
}

/// Represents one middleware of the component.
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
        self.hub.make_member(endpoint.address.as_str());
        let topic = self.hub.topic(endpoint.address.as_str());
        Ok(Box::new(subscriber::Port(topic)))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        Err(receives(endpoint))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        self.hub.make_member(endpoint.address.as_str());
        let calls = self.hub.server(endpoint.address.as_str());
        Ok(Box::new(server::Port {
            calls,
            wake_event: self.hub.wake_event.clone(),
            ended: VecDeque::new(),
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
