//! Quality of service between two components, each with sockets of its own.

use rc_middleware::backend::now;
use rc_middleware::{
    Address, Backend, Endpoint, Environment, Header, Interrupt, OpenError, Qos, RunDirectory,
    SendError, Subscriber, TypeIdentity, wait,
};
use std::time::{Duration, Instant};

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_secs(30);

/// A network and a domain of its own; its run directory goes with it.
struct Network {
    environment: Environment,
}

impl Network {
    fn new(domain: u32) -> Self {
        let network = format!("qos{domain}-{}", std::process::id());
        let directory = RunDirectory::open(&network).expect("a run directory");
        let mut environment = Environment {
            network,
            instance: "test".to_owned(),
            directory,
            interrupt: Interrupt::new().expect("an interrupt"),
            settings: rc_middleware::Settings::default(),
        };
        let settings = &mut environment.settings;
        settings.set("dds", "domain", vec![domain.to_string()]);
        settings.set("dds", "interfaces", vec!["lo".to_owned()]);
        Self { environment }
    }

    fn join(&self) -> Box<dyn Backend> {
        rc_dds::connect(&self.environment).expect("the domain")
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        let _ = self.environment.directory.remove();
    }
}

fn topic(qos: Qos) -> Endpoint {
    Endpoint {
        address: Address::parse("default/Laser/scan").expect("an address"),
        types: TypeIdentity {
            name: "Test::Laser/scan".to_owned(),
            hash: 7,
        },
        qos,
    }
}

fn header(sequence: u64) -> Header {
    Header {
        sequence,
        sent: now(),
        ..Header::default()
    }
}

fn receive(subscriber: &mut dyn Subscriber) -> Option<u64> {
    let mut sequence = None;
    subscriber
        .receive(&mut |header, _| sequence = Some(header.sequence))
        .expect("values");
    sequence
}

#[test]
fn what_has_outlived_its_lifespan_is_not_handed_on() {
    const LIFESPAN: Duration = Duration::from_millis(300);
    let network = Network::new(110);
    let (here, there) = (network.join(), network.join());
    let mut subscriber = there.subscriber(&topic(Qos::SUBSCRIBER)).expect("an end");
    let brief = Qos {
        lifespan: Some(LIFESPAN),
        ..Qos::PUBLISHER
    };
    let mut brief = here.publisher(&topic(brief)).expect("an end");
    let mut lasting = here.publisher(&topic(Qos::PUBLISHER)).expect("an end");
    brief.publish(header(1), b"brief").expect("to publish");
    lasting.publish(header(1), b"lasting").expect("to publish");
    lasting.publish(header(2), b"lasting").expect("to publish");
    let sent = Instant::now();
    assert_eq!(wait(&[subscriber.descriptor()], LIMIT), 1);
    wait(
        &[],
        LIFESPAN.saturating_sub(sent.elapsed()) + Duration::from_millis(1),
    );
    let mut handed_on = Vec::new();
    while handed_on.len() < 2 {
        assert!(sent.elapsed() < LIMIT, "{handed_on:?}");
        handed_on.extend(receive(&mut *subscriber));
    }
    assert_eq!(handed_on, [1, 2], "those of the lasting one");
    assert_eq!(receive(&mut *subscriber), None);
    // One that is read in time is handed on.
    brief.publish(header(2), b"brief").expect("to publish");
    let sent = Instant::now();
    let mut came = None;
    while came.is_none() && sent.elapsed() < LIFESPAN / 2 {
        wait(&[subscriber.descriptor()], LIFESPAN / 2);
        subscriber.acknowledge(true);
        came = receive(&mut *subscriber);
    }
    // A machine that was busy for so long proves nothing.
    if sent.elapsed() < LIFESPAN / 2 {
        assert_eq!(came, Some(2));
    }
}

#[test]
fn what_is_too_large_is_refused_and_harms_nobody() {
    let network = Network::new(111);
    let (here, there) = (network.join(), network.join());
    let mut subscriber = there.subscriber(&topic(Qos::SUBSCRIBER)).expect("an end");
    let mut publisher = here.publisher(&topic(Qos::PUBLISHER)).expect("an end");
    let large = vec![0; 129 << 20];
    let refused = publisher.publish(header(1), &large);
    assert!(
        matches!(&refused, Err(SendError::Backend { address, .. }) if address == "default/Laser/scan"),
        "{refused:?}"
    );
    publisher.publish(header(1), b"small").expect("to publish");
    let begin = Instant::now();
    while receive(&mut *subscriber).is_none() {
        assert!(begin.elapsed() < LIMIT, "the small one does not come");
        wait(&[subscriber.descriptor()], Duration::from_millis(50));
        subscriber.acknowledge(true);
    }
}

#[test]
fn a_wrong_interface_is_told_with_those_that_there_are() {
    let mut network = Network::new(112);
    let wrong = vec!["nosuch0".to_owned()];
    network.environment.settings.set("dds", "interfaces", wrong);
    let Err(OpenError::Backend { reason, .. }) = rc_dds::connect(&network.environment) else {
        panic!("it was taken");
    };
    assert!(reason.starts_with("there is no network interface `nosuch0`; there are "));
    assert!(reason.contains("lo"), "{reason}");
}
