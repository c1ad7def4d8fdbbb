//! The conformance suite. Each component is a participant of its own, as if it were a process, and
//! each network has a domain of its own.

use rc_middleware::{Backend, Environment, OpenError};
use rc_settings::Value;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

struct Ros2;

/// The domain of a network of these tests, `tNUMBER-PID`. Another run on the same machine begins
/// elsewhere.
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
        // Sixty-four components in one process announce themselves slowly.
        let lease = Value::Duration(Duration::from_secs(10));
        environment.settings.set("ros2", "lease", lease);
        rc_ros2::connect(&environment)
    }

    /// Two tests at a time have so many participants of `rustdds` on two processors that its threads
    /// wait for each other, or drop what they cannot confirm in time.
    fn alone(&self) -> Option<MutexGuard<'static, ()>> {
        static ONE: Mutex<()> = Mutex::new(());
        Some(ONE.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Endpoints compare types when they find each other, not with every message.
    fn compares_each_message(&self) -> bool {
        false
    }

    /// A publisher has to offer what a subscriber requests.
    fn keeps_or_refuses(&self) -> bool {
        true
    }

    /// `rustdds` removes samples beyond the depth only every six seconds.
    fn keeps_more(&self) -> bool {
        true
    }

    /// In `rustdds` every participant receives the confirmations of all others: sixty-four
    /// participants with sixteen pending requests each keep two processors busy for minutes.
    fn clients(&self) -> usize {
        16
    }

    /// Messages of other components about their endpoints make the descriptor readable, too.
    fn rings_for_less(&self) -> bool {
        true
    }

    /// What does not fit into the socket buffer of a busy receiver is lost, and `rustdds` repeats
    /// it at 200 KB a second.
    fn largest(&self) -> usize {
        2 << 20
    }

    /// Bodies are padded to a multiple of four bytes.
    fn pads(&self) -> bool {
        true
    }
}

rc_conformance::suite!(Ros2);
