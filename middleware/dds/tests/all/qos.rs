//! Quality of service between two components, each with sockets of its own.

use rc_middleware::now;
use rc_middleware::qos::Reliability;
use rc_middleware::{
    Address, Backend, Endpoint, Environment, Header, OpenError, Qos, RunDirectory, SendError,
    Subscriber, TypeIdentity, WakeEvent, wait,
};
use rc_vocabulary::Value;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Longest wait for an event.
const LIMIT: Duration = Duration::from_secs(30);

/// A network with a domain of its own. Dropping it removes its run directory.
pub(crate) struct Network {
    environment: Environment,
}

impl Network {
    pub(crate) fn new(domain: u32) -> Self {
        Self::beside(domain, "")
    }

    /// Another network in the same domain with a run directory of its own, as if on another
    /// machine.
    fn beside(domain: u32, machine: &str) -> Self {
        let network = format!("qos{domain}{machine}-{}", std::process::id());
        let directory = RunDirectory::open(&network).expect("a run directory");
        let mut environment = Environment {
            network,
            instance: "test".to_owned(),
            directory,
            wake_event: WakeEvent::new().expect("a wake event"),
            settings: rc_middleware::Settings::default(),
        };
        let settings = &mut environment.settings;
        settings.set("dds", "domain", Value::Int(domain.into()));
        settings.set("dds", "interfaces", Value::Texts(vec!["lo".to_owned()]));
        Self { environment }
    }

    pub(crate) fn join(&self) -> Box<dyn Backend> {
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
        external_types: Vec::new(),
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
fn expired_samples_are_not_delivered() {
    const LIFESPAN: Duration = Duration::from_millis(300);
    let network = Network::new(10);
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
    // A sample that is read in time is delivered.
    brief.publish(header(2), b"brief").expect("to publish");
    let sent = Instant::now();
    let mut came = None;
    while came.is_none() && sent.elapsed() < LIFESPAN / 2 {
        wait(&[subscriber.descriptor()], LIFESPAN / 2);
        subscriber.acknowledge(true);
        came = receive(&mut *subscriber);
    }
    // On a machine that was busy for so long, the test proves nothing.
    if sent.elapsed() < LIFESPAN / 2 {
        assert_eq!(came, Some(2));
    }
}

#[test]
fn a_sample_that_is_too_large_is_refused() {
    let network = Network::new(11);
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
fn an_unknown_network_interface_is_reported_with_the_existing_ones() {
    let mut network = Network::new(12);
    let wrong = Value::Texts(vec!["nosuch0".to_owned()]);
    network.environment.settings.set("dds", "interfaces", wrong);
    let Err(OpenError::Backend { reason, .. }) = rc_dds::connect(&network.environment) else {
        panic!("it was taken");
    };
    assert!(reason.starts_with("there is no network interface `nosuch0`; there are "));
    assert!(reason.contains("lo"), "{reason}");
}

/// The log of this process.
fn log() -> &'static Mutex<String> {
    static LOG: Mutex<String> = Mutex::new(String::new());
    static ONCE: std::sync::Once = std::sync::Once::new();
    struct Lines;
    impl std::io::Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            let mut log = LOG.lock().expect("no holder panics");
            log.push_str(&String::from_utf8_lossy(bytes));
            Ok(bytes.len())
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    ONCE.call_once(|| {
        tracing_subscriber::fmt()
            .with_ansi(false)
            .with_writer(|| Lines)
            .init();
    });
    &LOG
}

fn await_log(log: &Mutex<String>, told: &[String]) {
    let begin = Instant::now();
    while !told
        .iter()
        .all(|told| log.lock().expect("a log").contains(told))
    {
        assert!(begin.elapsed() < LIMIT, "{}", log.lock().expect("a log"));
        wait(&[], Duration::from_millis(5));
    }
}

#[test]
fn a_second_server_on_another_machine_is_refused_or_reported_on_both_sides() {
    let log = log();
    let machines = ["", "other"].map(|machine| Network::beside(14, machine));
    let served = Endpoint {
        address: Address::parse("default/Twice").expect("an address"),
        ..topic(Qos::CALL)
    };
    let backends = machines.each_ref().map(Network::join);
    let servers = backends.each_ref().map(|backend| backend.server(&served));
    let pid = std::process::id();
    let [Ok(_first), second] = servers else {
        panic!("the first one is refused");
    };
    if let Err(refused) = second {
        // The second server found the first one in time.
        let refused = refused.to_string();
        assert!(
            refused.contains(&format!("pid {pid} (test) on ")),
            "{refused}"
        );
        return;
    }
    let told = format!("`default/Twice` has two servers, this one and pid {pid} (test) on ");
    let begin = Instant::now();
    while log.lock().expect("a log").matches(&told).count() < 2 {
        assert!(begin.elapsed() < LIMIT, "{}", log.lock().expect("a log"));
        wait(&[], Duration::from_millis(5));
    }
}

#[test]
fn mismatched_endpoints_are_reported_on_both_sides() {
    let log = log();
    let network = Network::new(13);
    let (here, there) = (network.join(), network.join());
    let offered = Qos {
        reliability: Reliability::BestEffort,
        liveliness: Some(Duration::from_secs(2)),
        ..Qos::PUBLISHER
    };
    let requested = Qos {
        reliability: Reliability::Reliable,
        deadline: Some(Duration::from_millis(100)),
        liveliness: Some(Duration::from_secs(1)),
        ..Qos::SUBSCRIBER
    };
    let publisher = here.publisher(&topic(offered)).expect("an end");
    let subscriber = there.subscriber(&topic(requested)).expect("an end");
    let values = "reliability: offered best_effort, requested reliable; \
                  deadline: offered none, requested 100ms; liveliness: offered 2s, requested 1s";
    let (address, pid) = ("default/Laser/scan", std::process::id());
    let told = [
        format!("samples on `{address}` do not reach the subscriber pid {pid} (test): {values}"),
        format!("`{address}` receives no samples of the publisher pid {pid} (test): {values}"),
    ];
    await_log(log, &told);
    assert_eq!((publisher.peers(), subscriber.peers()), (0, 0));
}
