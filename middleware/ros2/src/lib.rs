//! The backend for ROS 2: a component is a node, its topics are topics of ROS, and its operations
//! are services. `docs/ros2.md` documents the names of addresses and types, `docs/ros2-mapping.md`
//! the mapping of an IDSL to messages.
//!
#![doc = include_str!("example.md")]

mod arguments;
mod calls;
mod client;
mod clock;
mod config;
mod graph;
mod lifecycle;
mod names;
mod node;
mod parameter_events;
mod rcl;
mod remap;
mod rosout;
mod server;
mod services;
mod topics;
mod type_descriptions;
mod types;
mod variables;

use lifecycle::ManagedNode;
use node::Node;
use parameter_events::Events;
use rc_middleware::lifecycle::LifecycleService;
use rc_middleware::parameters::ParameterService;
use rc_middleware::{
    Backend, Client, Endpoint, Environment, Linked, LogQueue, OpenError, Publisher, Server,
    Subscriber,
};
use rcl::Service;
use rosout::LogPublisher;
use services::{NodeRequest, Services};
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// The name of this middleware in the languages and on command lines.
pub const NAME: &str = "ros2";

/// This middleware, as a component links it. Generated code connects with types of its own.
pub const LINKED: Linked = Linked {
    name: NAME,
    connect: |environment| connect(environment, &[]),
    observe: Some(observe),
    arguments: Some(arguments::ARGUMENTS),
    clock: Some(clock::CLOCK),
    unmatched: remap::unmatched,
    variables: variables::add,
};

/// Joins the network of `environment` as a node, by the settings of `[middleware.ros2]` and the
/// variables of ROS 2. `types` are definitions of types that are not part of ROS 2, in the form
/// that [`rc_ros_types::Types`] reads; endpoints of other types have no type hash.
pub fn connect(
    environment: &Environment,
    types: &'static [&'static str],
) -> Result<Box<dyn Backend>, OpenError> {
    let node = Rc::new(Node::join(environment, types)?);
    Ok(Box::new(Ros2 {
        parameters: RefCell::default(),
        lifecycle: RefCell::default(),
        _type_descriptions: type_descriptions::open(&node)?,
        log: RefCell::default(),
        node,
    }))
}

/// Joins the domain as a tool: components do not count its endpoints as peers. Its name should
/// begin with `_`, which hides a node.
pub fn observe(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    let node = Rc::new(Node::join(environment, &[])?);
    node.session.observe();
    Ok(Box::new(Ros2 {
        parameters: RefCell::default(),
        lifecycle: RefCell::default(),
        _type_descriptions: None,
        log: RefCell::default(),
        node,
    }))
}

struct Ros2 {
    parameters: RefCell<Option<(Services, Events)>>,
    lifecycle: RefCell<Option<ManagedNode>>,
    _type_descriptions: Option<Services>,
    log: RefCell<Option<LogPublisher>>,
    node: Rc<Node>,
}

impl Backend for Ros2 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        Ok(Box::new(topics::publisher(&self.node, endpoint)?))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        Ok(Box::new(topics::subscriber(&self.node, endpoint)?))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        Ok(Box::new(client::open(&self.node, endpoint)?))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Ok(Box::new(server::open(&self.node, endpoint)?))
    }

    fn parameters(&self, service: Arc<dyn ParameterService>) -> Result<(), OpenError> {
        let names = Service::ALL.map(Service::names);
        let answered = Arc::clone(&service);
        let answer = move |asked: &NodeRequest<'_>| {
            rcl::answer(Service::ALL[asked.place], asked.body, &*answered)
        };
        let services = Services::open(&self.node, "rc-ros2-param", &names, Box::new(answer))?;
        let events = Events::open(&self.node, &*service)?;
        self.parameters.replace(Some((services, events)));
        Ok(())
    }

    fn lifecycle(&self, service: Arc<dyn LifecycleService>) -> Result<(), OpenError> {
        let managed = ManagedNode::open(&self.node, &service)?;
        self.lifecycle.replace(Some(managed));
        Ok(())
    }

    fn log(&self, log: &Arc<LogQueue>) -> Result<bool, OpenError> {
        let settings = &self.node.session.environment.settings;
        if settings.bool(NAME, "rosout") == Some(false) {
            return Ok(false);
        }
        self.log.replace(Some(LogPublisher::open(&self.node, log)?));
        Ok(true)
    }

    fn mismatches(&self) -> Vec<String> {
        self.node.session.mismatches()
    }

    fn have_arrived(&self, limit: Duration) -> bool {
        self.node.session.have_arrived(limit)
    }

    fn linger(&self, limit: Duration) {
        self.node.session.linger(limit);
    }
}
