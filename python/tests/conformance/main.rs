//! Generated clients, publishers and servers in Rust, with a generated component in Python at the
//! other end: every pattern, every type and every error, over each middleware.

mod calls;
mod other_end;
mod topics;
mod values;

use other_end::{Network, OtherEnd, Over};
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

fn conforms(over: &'static Over) {
    let Some(package) = other_end::package(over) else {
        return;
    };
    let network = Network::new(over);
    let earlier = topics::Earlier::publish(&network, &package);
    let other = OtherEnd::start(network, package);
    topics::earlier_values_arrive(&other);
    drop(earlier);
    calls::values_are_equal_at_both_ends(&other);
    calls::errors_reach_the_caller(&other);
    calls::commands_keep_their_order(&other);
    calls::replies_travel_in_place(&other);
    calls::calls_are_made(&other);
    topics::samples_are_repeated(&other);
    topics::pictures_travel_in_place(&other);
    calls::a_call_ends_with_its_server(other);
}

#[test]
fn a_component_in_python_conforms_over_iceoryx2() {
    conforms(&Over {
        backend: rc_cdsl::model::Middleware::Iceoryx2,
        domain: 0,
        connect: |environment| rc_iceoryx2::connect(environment).expect("the network"),
    });
}

#[test]
fn a_component_in_python_conforms_over_dds() {
    conforms(&Over {
        backend: rc_cdsl::model::Middleware::Dds,
        domain: 146,
        connect: |environment| rc_dds::connect(environment).expect("the domain"),
    });
}

#[test]
fn a_component_in_python_conforms_over_ros2() {
    conforms(&Over {
        backend: rc_cdsl::model::Middleware::Ros2,
        domain: 147,
        connect: |environment| rc_ros2::connect(environment, &[]).expect("the domain"),
    });
}
