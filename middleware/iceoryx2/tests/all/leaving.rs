//! Processes that end right after sending, and a foreign configuration of iceoryx2 in the working
//! directory.

use crate::processes::{Network, ask};
use rc_conformance::network::{StopOnDrop, endpoint, receive, serve_until, until};
use rc_middleware::WakeEvent;

/// A receiver maps a segment of shared memory when it receives the first sample in it. The sender's
/// exit removes the segment.
#[test]
fn messages_sent_right_before_exit_arrive() {
    let network = Network::new("lv");
    let stop = WakeEvent::new().expect("a wake event");
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
            let status = leaving.outcome().expect("an exit status");
            assert!(status.success(), "{status}");
            until("the order is there", || {
                orders.load(std::sync::atomic::Ordering::Relaxed) == round
            });
        }
    });
}

/// By default, iceoryx2 would read this configuration.
#[test]
fn a_configuration_in_the_working_directory_is_ignored() {
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
