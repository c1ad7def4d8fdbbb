//! Generated clients, publishers and servers in Rust, with the generated component `every_type` in
//! another language at the other end: every pattern, every type and every error, over each
//! middleware.

mod ages;
mod calls;
mod network;
mod process;
mod topics;
mod values;

pub use ages::ages;
pub use calls::client;
pub use network::{Network, Over};
pub use process::{OtherEnd, Package};
pub use topics::pictures;
pub use values::picture;

use std::time::{Duration, Instant};

/// Longest wait for an event.
const LIMIT: Duration = Duration::from_secs(30);
/// The pause between two looks.
const LOOK: Duration = Duration::from_millis(5);

fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let end = Instant::now() + LIMIT;
    while !holds() {
        assert!(Instant::now() < end, "waited {LIMIT:?} until {what}");
        std::thread::sleep(LOOK);
    }
}

/// Runs the suite against the component of `package` in a new network. `faults`: those that only
/// its language has; the component runs on after them.
///
/// # Panics
/// The component does not conform.
pub fn conforms(network: Network, package: Package, faults: impl FnOnce(&OtherEnd)) {
    let earlier = topics::Earlier::publish(&network, &package);
    let other = OtherEnd::start(network, package);
    topics::earlier_values_arrive(&other);
    drop(earlier);
    calls::values_are_equal_at_both_ends(&other);
    calls::errors_reach_the_caller(&other);
    faults(&other);
    calls::commands_keep_their_order(&other);
    calls::replies_travel_in_place(&other);
    calls::calls_are_made(&other);
    topics::samples_are_repeated(&other);
    topics::pictures_travel_in_place(&other);
    calls::a_call_ends_with_its_server(other);
}
