//! Processes that die while they create a file. The kernel kills each one when it makes a file
//! larger than a limit; the file then exists without size or content. Other processes must not be
//! affected.

use crate::processes::{From, Network, ask, map};
use rc_conformance::network::{endpoint, receive};
use std::os::unix::process::ExitStatusExt;

const ROLES: [&str; 4] = ["server", "publisher", "client", "subscriber"];

/// Starts processes of `role` that die at larger and larger files, until one survives. Calls
/// `check` after each death. Returns the number of deaths.
fn die_at_each_file(network: &Network, role: &str, from: From, mut check: impl FnMut()) -> usize {
    let mut deaths = 0;
    for power in (3_u32..40).step_by(3) {
        // First less than the smallest file, then eight times as much each time.
        let bytes = if power == 3 { 0 } else { 1_u64 << power };
        let mut process = network.doomed(role, from, bytes);
        let Some(status) = process.outcome() else {
            return deaths;
        };
        // A partial write is an error instead, after which the process exits by itself.
        let at_the_limit = rustix::process::Signal::XFSZ.as_raw();
        deaths += usize::from(status.signal() == Some(at_the_limit));
        check();
    }
    panic!("every {role} dies")
}

/// Checks that new endpoints connect, and that a call and samples arrive.
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

/// Runs `test` for all roles concurrently, each in a network of its own.
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
fn death_while_creating_files_alone_harms_nobody() {
    each_of(&ROLES, "hn", |network, role| {
        let deaths = die_at_each_file(network, role, From::Start, || works(network));
        assert!(deaths > 1, "{role}");
    });
}

#[test]
fn death_while_creating_files_of_an_unused_service_harms_nobody() {
    each_of(&ROLES, "ho", |network, role| {
        let _bystander = network.join("bystander");
        let deaths = die_at_each_file(network, role, From::Joined, || works(network));
        assert!(deaths > 1, "{role}");
    });
}

#[test]
fn death_while_creating_files_that_others_wait_for_harms_nobody() {
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

/// Both ends set up connections, also while they send and receive.
#[test]
fn death_while_creating_files_that_others_serve_harms_nobody() {
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
