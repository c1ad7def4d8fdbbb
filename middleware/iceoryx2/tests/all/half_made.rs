//! Processes that die in the middle of making a file: the system ends them at the first one that is larger than a
//! limit, when it is there and has neither size nor content. Nobody is harmed, whoever else is alive.

use crate::processes::{From, Network, ask, map};
use rc_conformance::network::{endpoint, receive};
use std::os::unix::process::ExitStatusExt;

const ROLES: [&str; 4] = ["server", "publisher", "client", "subscriber"];

/// Starts processes of `role` that die at ever larger files, until one does not, and says how many died. After each
/// death `check` is done.
fn die_at_each_file(network: &Network, role: &str, from: From, mut check: impl FnMut()) -> usize {
    let mut deaths = 0;
    for power in (3_u32..40).step_by(3) {
        // Less than the smallest file, then eight times as much each time.
        let bytes = if power == 3 { 0 } else { 1_u64 << power };
        let mut process = network.doomed(role, from, bytes);
        let Some(status) = process.outcome() else {
            return deaths;
        };
        // A file that could be written in part is an error, at which it ends by itself.
        let at_the_limit = rustix::process::Signal::XFSZ.as_raw();
        deaths += usize::from(status.signal() == Some(at_the_limit));
        check();
    }
    panic!("every {role} dies")
}

/// The network does its work: those who come meet, and a call and values go through.
fn works(network: &Network) {
    let backend = network.join("check");
    let _server = network.start("server");
    let _publisher = network.start("publisher");
    let mut client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    let mut scan = backend
        .subscriber(&endpoint("default/Laser/scan"))
        .expect("a subscriber");
    let mut late = backend.subscriber(&map()).expect("a subscriber");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    receive(&mut *scan, 2);
    receive(&mut *late, 2);
}

/// Each role in a network of its own, all at once.
fn each_of(roles: &[&str], name: &str, test: impl Fn(&Network, &str) + Sync) {
    std::thread::scope(|scope| {
        for role in roles {
            let network = Network::new(&format!("{name}-{role}"));
            let test = &test;
            scope.spawn(move || test(&network, role));
        }
    });
}

#[test]
fn where_nobody_else_is() {
    each_of(&ROLES, "hn", |network, role| {
        let deaths = die_at_each_file(network, role, From::Start, || works(network));
        assert!(deaths > 1, "{role}");
    });
}

#[test]
fn where_others_have_no_such_service() {
    each_of(&ROLES, "ho", |network, role| {
        let _bystander = network.join("bystander");
        let deaths = die_at_each_file(network, role, From::Joined, || works(network));
        assert!(deaths > 1, "{role}");
    });
}

#[test]
fn where_others_wait_for_it() {
    each_of(&ROLES, "hw", |network, role| {
        let backend = network.join("bystander");
        let mut client = backend
            .client(&endpoint("default/Motor"))
            .expect("a client");
        let mut scan = backend
            .subscriber(&endpoint("default/Laser/scan"))
            .expect("a subscriber");
        let mut late = backend.subscriber(&map()).expect("a subscriber");
        let deaths = die_at_each_file(network, role, From::Joined, || {
            let _server = network.start("server");
            let _publisher = network.start("publisher");
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
            receive(&mut *scan, 2);
            receive(&mut *late, 2);
        });
        assert!(deaths > 0, "{role}");
    });
}

/// Connections are made by both ends, also while they send and receive.
#[test]
fn where_others_serve_it() {
    each_of(&["client", "subscriber"], "hs", |network, role| {
        let backend = network.join("bystander");
        let _server = network.start("server");
        let _publisher = network.start("publisher");
        let mut client = backend
            .client(&endpoint("default/Motor"))
            .expect("a client");
        let mut scan = backend
            .subscriber(&endpoint("default/Laser/scan"))
            .expect("a subscriber");
        let deaths = die_at_each_file(network, role, From::Joined, || {
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
            receive(&mut *scan, 20);
            network.start(role);
        });
        assert!(deaths > 0, "{role}");
    });
}
