//! Programs that use iceoryx2 without this crate.

use crate::processes::Network;
use iceoryx2::prelude::{
    AttributeSpecifier, Config, FileName, Node, NodeBuilder, Path, SemanticString, ServiceName,
    SignalHandlingMode, ZeroCopySend, ipc,
};
use rc_conformance::network::{LIMIT, endpoint, header};
use rc_middleware::{Gaps, wait};
use std::os::unix::ffi::OsStrExt;
use std::time::{Duration, Instant};

/// The user header of each sample, as docs/shared-memory-wire.md documents it.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("RcHeader1")]
#[repr(C)]
#[repr(align(16))]
struct Header1 {
    version: u16,
    encoding: u16,
    flags: u32,
    type_hash: u64,
    sequence: u64,
    sent: u64,
}

/// The user header of each request, as documented there.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[type_name("RcRequestHeader1")]
#[repr(C)]
#[repr(align(16))]
struct RequestHeader1 {
    message: Header1,
    client: [u8; 16],
}

/// A node in `network`.
fn node(network: &Network) -> Node<ipc::Service> {
    let directory = network.environment("external").directory;
    let root = directory.middleware(rc_iceoryx2::NAME);
    let mut config = Config::default();
    let root = Path::new(root.as_os_str().as_bytes()).expect("a path");
    config.global.set_root_path(&root);
    let prefix = rc_iceoryx2::prefix(&directory).expect("a prefix");
    config.global.prefix = FileName::new(prefix.as_bytes()).expect("a prefix");
    NodeBuilder::new()
        .config(&config)
        .signal_handling_mode(SignalHandlingMode::Disabled)
        .create()
        .expect("a node")
}

/// Prints a line for each notification.
pub(crate) fn external(network: &Network) {
    let node = node(network);
    let name = ServiceName::new("default/Laser/scan").expect("a name");
    let events = node.service_builder(&name).event().open();
    let events = events.expect("the events of the topic");
    let listener = events.listener_builder().create().expect("a listener");
    println!("ready");
    let end = Instant::now() + LIMIT;
    while Instant::now() < end {
        let mut notified = false;
        listener.try_wait(|_| notified = true).expect("to listen");
        if notified {
            println!("notified");
        }
        wait(&[], Duration::from_millis(5));
    }
}

/// External programs hold no lock of this crate, but their nodes count as users of the network.
#[test]
fn the_last_process_keeps_files_that_an_external_program_uses() {
    let network = Network::new("ls");
    let scan = endpoint("default/Laser/scan");
    let first = network.join("publisher");
    let publisher = first.publisher(&scan).expect("a publisher");
    let mut external = network.start("external");
    drop((first, publisher));

    for _ in 0..2 {
        let next = network.join("publisher");
        let mut publisher = next.publisher(&scan).expect("a publisher");
        publisher.publish(header(1), b"x").expect("to publish");
        external.says("notified");
    }
    external.kill();
    // The last process removes all that the others left.
    drop(network.join("last"));
    let directory = network.environment("last").directory;
    assert!(rc_iceoryx2::leftovers(&directory).is_empty());
}

/// An unreadable sample counts as an error and not also as a loss.
#[test]
fn an_unreadable_header_is_counted_once() {
    let network = Network::new("su");
    let backend = network.join("subscriber");
    let mut scan = backend
        .subscriber(&endpoint("default/Laser/scan"))
        .expect("a subscriber");
    let node = node(&network);
    let name = ServiceName::new("default/Laser/scan").expect("a name");
    let topic = node
        .service_builder(&name)
        .publish_subscribe::<[u8]>()
        .user_header::<Header1>()
        .open()
        .expect("the topic");
    let port = topic
        .publisher_builder()
        .initial_max_slice_len(1)
        .create()
        .expect("a publisher");
    let send = |sequence, encoding| {
        let mut sample = port.loan_slice_uninit(1).expect("a sample");
        *sample.user_header_mut() = Header1 {
            version: 1,
            encoding,
            sequence,
            ..Header1::default()
        };
        let reached = sample.write_from_slice(b"x").send();
        assert_eq!(reached.expect("to send"), 1);
    };
    let (mut gaps, mut got, mut lost, mut errors) = (Gaps::default(), 0, 0, 0);
    // Two samples are unreadable, and two sequence numbers are skipped.
    for (sequence, encoding) in [(1, 1), (2, 77), (3, 1), (5, 1), (6, 77), (8, 1), (9, 1)] {
        send(sequence, encoding);
        let received = scan.receive(&mut |header, _| {
            got += 1;
            lost += gaps.note(&header);
        });
        match received {
            Ok(received) => assert!(received),
            Err(_) => errors += 1,
        }
    }
    assert_eq!((got, lost, errors), (5, 2, 2));
}

/// A program of an older version has other settings of a service.
#[test]
fn a_service_of_another_version_is_refused_with_what_helps() {
    let network = Network::new("ov");
    let motor = endpoint("default/Motor");
    let backend = network.join("server");
    let node = node(&network);
    let name = ServiceName::new("default/Motor").expect("a name");
    let types = motor.types.to_string();
    let types = AttributeSpecifier::new().define(
        &"rc.types".try_into().expect("a key"),
        &types.as_str().try_into().expect("a value"),
    );
    let _older = node
        .service_builder(&name)
        .request_response::<[u8], [u8]>()
        .request_user_header::<RequestHeader1>()
        .response_user_header::<Header1>()
        .enable_safe_overflow_for_responses(false)
        .create_with_attributes(&types.expect("attributes"))
        .expect("a service");
    let refused = backend.server(&motor).err().expect("to be refused");
    let said = refused.to_string();
    assert!(
        said.contains("build all programs of the network again"),
        "{said}"
    );
}
