//! Other processes that are stopped, that leave at once, or that stand in a folder with a configuration of iceoryx2.

mod processes;

use processes::{Network, ask};
use rc_conformance::network::{
    LIMIT, StopOnDrop, endpoint, header, receive, receive_all, sequences, serve_until, until,
};
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::{CallError, Interrupt};
use rustix::process::Signal;
use std::time::{Duration, Instant};

#[test]
fn a_stopped_subscriber_delays_nobody() {
    let network = Network::new("sp");
    let topic = endpoint("default/Laser/scan");
    let backend = network.join("both");
    let stopped = network.start("subscriber");
    let mut quick = backend.subscriber(&topic).expect("a subscriber");
    let mut publisher = backend.publisher(&topic).expect("a publisher");
    until("both are there", || publisher.peers() == 2);
    stopped.signal(Signal::STOP);
    let mut got = Vec::new();
    let start = Instant::now();
    for sequence in 1..=1000 {
        publisher
            .publish(header(sequence), &[0; 5000])
            .expect("to publish");
        got.extend(sequences(&receive_all(&mut *quick)));
    }
    assert!(start.elapsed() < LIMIT / 2, "{:?}", start.elapsed());
    assert_eq!(got, (1..=1000).collect::<Vec<_>>());
}

#[test]
fn a_stopped_server_is_an_error_of_each_call() {
    let network = Network::new("ss");
    let motor = endpoint("default/Motor");
    let backend = network.join("client");
    let server = network.start("server");
    let mut client = backend.client(&motor).expect("a client");
    assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
    server.signal(Signal::STOP);
    let late = client.call(header(1), b"?", Duration::from_millis(50), &mut Vec::new());
    assert!(matches!(late, Err(CallError::Deadline { .. })), "{late:?}");
    let full = Err(CallError::QueueFull("default/Motor".to_owned()));
    let accepted = (0..4 * REQUEST_QUEUE).find(|_| client.send(header(1), b"command") == full);
    assert!(accepted.is_some(), "the queue has no end");
    server.signal(Signal::CONT);
    until("it answers again", || {
        ask(&mut *client, b"here") == Ok(b"here".to_vec())
    });
}

#[test]
fn a_stopped_client_delays_no_other() {
    let network = Network::new("sc");
    let motor = endpoint("default/Motor");
    let stop = Interrupt::new().expect("an interrupt");
    std::thread::scope(|scope| {
        let (network, motor, stop) = (&network, &motor, &stop);
        let backend = network.join("client");
        let mut client = backend.client(motor).expect("a client");
        scope.spawn(move || {
            let backend = network.join("server");
            let mut server = backend.server(motor).expect("a server");
            serve_until(&mut *server, stop, &|_, request, reply| {
                reply.extend_from_slice(request);
            });
        });
        let _stop = StopOnDrop(stop);
        until("the server is there", || client.peers() == 1);
        // They call without a pause, so that some are stopped with an answer on its way.
        let stopped: Vec<_> = (0..4).map(|_| network.start("client")).collect();
        stopped
            .iter()
            .for_each(|client| client.signal(Signal::STOP));
        for _ in 0..200 {
            assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
        }
    });
}

/// A receiver maps a piece of shared memory when it receives the first value in it, and it is gone when the sender is.
#[test]
fn what_is_sent_before_leaving_arrives() {
    let network = Network::new("lv");
    let stop = Interrupt::new().expect("an interrupt");
    let orders = std::sync::atomic::AtomicUsize::new(0);
    std::thread::scope(|scope| {
        let (network, stop, orders) = (&network, &stop, &orders);
        let backend = network.join("subscriber");
        let mut scan = backend
            .subscriber(&endpoint("default/Laser/scan"))
            .expect("a subscriber");
        scope.spawn(move || {
            let backend = network.join("server");
            let mut server = backend
                .server(&endpoint("default/Motor"))
                .expect("a server");
            serve_until(&mut *server, stop, &|_, request, _| {
                assert_eq!(request, b"last order");
                orders.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            });
        });
        let _stop = StopOnDrop(stop);
        for round in 1..=15 {
            let mut leaving = network.begin("leaving");
            let values = receive(&mut *scan, 1);
            assert_eq!(values[0].1, b"last words");
            let status = leaving.outcome().expect("it ends");
            assert!(status.success(), "{status}");
            until("the order is there", || {
                orders.load(std::sync::atomic::Ordering::Relaxed) == round
            });
        }
    });
}

/// Without a configuration of its own, iceoryx2 would read this one.
#[test]
fn no_configuration_in_the_way_is_read() {
    let network = Network::new("cf");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("config")).expect("a folder");
    let stray = format!("stray{}_", std::process::id());
    let text = format!("[global]\nroot-path = '/dev/shm/{stray}root'\nprefix = '{stray}'\n");
    std::fs::write(folder.path().join("config/iceoryx2.toml"), text).expect("a file");
    let backend = network.join("client");
    let mut client = backend
        .client(&endpoint("default/Motor"))
        .expect("a client");
    for _ in 0..2 {
        let mut server = network.start_in(folder.path(), "server");
        assert_eq!(ask(&mut *client, b"here"), Ok(b"here".to_vec()));
        server.kill();
    }
    let memory = std::fs::read_dir("/dev/shm").expect("shared memory");
    let names = memory.map(|entry| entry.expect("an entry").file_name());
    let stray: Vec<_> = names
        .filter(|name| name.to_string_lossy().starts_with(&stray))
        .collect();
    assert!(stray.is_empty(), "{stray:?}");
}
