//! The backend for ROS 2: a component is a node, its topics are topics of ROS, and its operations
//! are services. `README.md` documents the names of addresses and types, `MAPPING.md` the mapping
//! of an IDSL to messages.

mod bound;
mod calls;
mod client;
mod config;
mod endpoint_state;
mod held;
mod names;
mod parameter_events;
mod parameters;
mod presence;
mod publisher;
mod qos;
mod rcl;
mod server;
mod session;
mod shared;
mod subscriber;
mod watcher;
mod wire;

use parameter_events::Events;
use parameters::Services;
use rc_middleware::parameters::ParameterService;
use rc_middleware::{
    Backend, Client, Endpoint, Environment, OpenError, Publisher, Server, Subscriber,
};
use session::Session;
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
        session: Rc::new(Session::open(environment)?),
    }))
}

struct Ros2 {
    parameters: RefCell<Option<(Services, Events)>>,
    session: Rc<Session>,
}

impl Backend for Ros2 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        Ok(Box::new(publisher::open(&self.session, endpoint)?))
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        Ok(Box::new(subscriber::open(&self.session, endpoint)?))
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        Ok(Box::new(client::open(&self.session, endpoint)?))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Ok(Box::new(server::open(&self.session, endpoint)?))
    }

    fn parameters(&self, service: Arc<dyn ParameterService>) -> Result<(), OpenError> {
        let services = Services::open(&self.session, Arc::clone(&service))?;
        let events = Events::open(&self.session, &*service)?;
        self.parameters.replace(Some((services, events)));
        Ok(())
    }

    fn lost(&self) -> Option<String> {
        self.session.shared.lost.get().cloned()
    }

    fn mismatches(&self) -> Vec<String> {
        self.session.mismatches()
    }

    fn linger(&self, limit: Duration) {
        self.session.linger(limit);
    }
}
