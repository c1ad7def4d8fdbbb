//! The conformance suite. Each component is a participant of its own, as if it were a process, and
//! each network has a domain of its own.

use rc_middleware::{Backend, Environment, OpenError};
use rc_vocabulary::Value;
use std::time::Duration;

struct Ros2;

impl rc_conformance::Subject for Ros2 {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        let mut environment = environment.clone();
        let domain = Value::Int(rc_conformance::domain(&environment.network));
        environment.settings.set("ros2", "domain", domain);
        let interfaces = Value::Texts(vec!["lo".to_owned()]);
        environment.settings.set("ros2", "interfaces", interfaces);
        // Sixty-four components in one process announce themselves slowly.
        let lease = Value::Duration(Duration::from_secs(10));
        environment.settings.set("ros2", "lease", lease);
        rc_ros2::connect(&environment, &[])
    }

    /// Endpoints compare types when they find each other, not with every message.
    fn compares_each_message(&self) -> bool {
        false
    }

    /// A publisher has to offer what a subscriber requests.
    fn keeps_or_refuses(&self) -> bool {
        true
    }
}

rc_conformance::suite!(Ros2);
