//! The backend for ROS 2: a component is a node, its topics are topics of ROS, and its operations
//! are services. `docs/ros2.md` documents the names of addresses and types, `docs/ros2-mapping.md`
//! the mapping of an IDSL to messages.

mod calls;
mod client;
mod config;
mod graph;
mod names;
mod node;
mod parameter_events;
mod parameters;
mod rcl;
mod server;
mod topics;

use node::Node;
use parameter_events::Events;
use parameters::Services;
use rc_middleware::parameters::ParameterService;
use rc_middleware::{
    Backend, Client, Endpoint, Environment, OpenError, Publisher, Server, Subscriber,
};
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// The name of this middleware in the languages and on command lines.
pub const NAME: &str = "ros2";

/// Joins the network of `environment` as a node, by the settings of `[middleware.ros2]` and the
/// variables of ROS 2.
pub fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    Ok(Box::new(Ros2 {
        parameters: RefCell::default(),
        node: Rc::new(Node::join(environment)?),
    }))
}

struct Ros2 {
    parameters: RefCell<Option<(Services, Events)>>,
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
        let services = Services::open(&self.node, Arc::clone(&service))?;
        let events = Events::open(&self.node, &*service)?;
        self.parameters.replace(Some((services, events)));
        Ok(())
    }

    fn mismatches(&self) -> Vec<String> {
        self.node.session.mismatches()
    }

    fn linger(&self, limit: Duration) {
        self.node.session.linger(limit);
    }
}
