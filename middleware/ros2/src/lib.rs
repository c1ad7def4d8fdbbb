//! The three patterns over ROS 2: a component is a node, its topics are topics and its operations services of ROS. How
//! addresses and types are called there is in `README.md`, how an IDSL becomes messages in `MAPPING.md`.

mod calls;
mod client;
mod config;
mod ear;
mod names;
mod presence;
mod publisher;
mod qos;
mod server;
mod session;
mod subscriber;
mod watcher;
mod wire;

use rc_middleware::{
    Backend, Client, Endpoint, Environment, OpenError, Publisher, Server, Subscriber,
};
use session::Session;
use std::rc::Rc;
use std::time::Duration;

/// The name of this middleware in the languages and on command lines.
pub const NAME: &str = "ros2";

/// Joins the network of `environment` as a node, by the settings of `[middleware.ros2]` and the variables of ROS 2.
pub fn connect(environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
    Ok(Box::new(Ros2(Rc::new(Session::open(environment)?))))
}

struct Ros2(Rc<Session>);

impl Backend for Ros2 {
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
