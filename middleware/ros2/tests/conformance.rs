//! The suite that every backend passes. Each component is a participant of its own, as if it were a process of its own, and
//! each network has a domain of its own.

use rc_middleware::{Backend, Environment, OpenError};
use rc_settings::Value;
use std::time::Duration;

struct Ros2;

/// A domain for each network of these tests, `tNUMBER-PID`; another run on the same machine begins elsewhere.
fn domain(network: &str) -> Value {
    let mut numbers = network.trim_start_matches('t').split('-');
    let mut number = || numbers.next().and_then(|n| n.parse::<u32>().ok());
    let (number, pid) = (number().unwrap_or_default(), number().unwrap_or_default());
    let domain = 20 + number.wrapping_add(pid.wrapping_mul(37)) % 80;
    Value::Int(domain.into())
}

impl rc_conformance::Subject for Ros2 {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        let mut environment = environment.clone();
        let domain = domain(&environment.network);
        environment.settings.set("ros2", "domain", domain);
        // Sixty-four components in one process are slow to say that they live.
        let lease = Value::Duration(Duration::from_secs(10));
        environment.settings.set("ros2", "lease", lease);
        rc_ros2::connect(&environment)
    }

    /// The types of a connection are compared when its ends find each other, not with every message.
    fn compares_each_message(&self) -> bool {
        false
    }

    /// What is requested has to be offered.
    fn keeps_or_refuses(&self) -> bool {
        true
    }

    /// `rustdds` forgets what is beyond the depth once in six seconds.
    fn keeps_more(&self) -> bool {
        true
    }

    /// In `rustdds` every participant hears all that any other one confirms: with sixty-four of them, each with sixteen
    /// requests under way, two processors are at it for minutes.
    fn clients(&self) -> usize {
        16
    }

    /// What others tell of their ends rings, too, and may come just then.
    fn rings_for_less(&self) -> bool {
        true
    }

    /// What does not fit into the buffer of a receiver that has no processor is lost, and `rustdds` sends it again at 200 KB a
    /// second.
    fn largest(&self) -> usize {
        2 << 20
    }

    /// What is sent is a multiple of four bytes long.
    fn pads(&self) -> bool {
        true
    }
}

rc_conformance::suite!(Ros2);
