//! An endpoint that does not match is refused; if discovery finds it later, on another machine, it
//! is reported.

use rc_middleware::qos::Reliability;
use rc_middleware::{Backend, Endpoint, Environment, Qos, RunDirectory, Settings, WakeEvent};
use rc_vocabulary::Value;
use std::time::{Duration, Instant};

/// Longest wait for an event.
const LIMIT: Duration = Duration::from_secs(30);

/// A component with a run directory of its own, as if on another machine.
fn join(machine: &str) -> (Box<dyn Backend>, RunDirectory) {
    let (environment, directory) = environment(machine);
    let backend = rc_ros2::connect(&environment, &[]).expect("the domain");
    (backend, directory)
}

fn environment(machine: &str) -> (Environment, RunDirectory) {
    let network = format!("mismatch{machine}-{}", std::process::id());
    let directory = RunDirectory::open(&network).expect("a run directory");
    let mut environment = Environment {
        network,
        instance: machine.to_owned(),
        directory: directory.clone(),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings: Settings::default(),
    };
    let domain = Value::Int(13);
    environment.settings.set("ros2", "domain", domain);
    let interfaces = Value::Texts(vec!["lo".to_owned()]);
    environment.settings.set("ros2", "interfaces", interfaces);
    (environment, directory)
}

fn topic(name: &str, qos: Qos) -> Endpoint {
    let address = format!("default/Laser/{name}{}", std::process::id());
    Endpoint {
        qos,
        ..rc_conformance::network::endpoint(&address)
    }
}

/// Waits for reports about mismatched endpoints.
fn reports(backend: &dyn Backend) -> Vec<String> {
    let start = Instant::now();
    loop {
        let told = backend.mismatches();
        if !told.is_empty() {
            return told;
        }
        assert!(start.elapsed() < LIMIT, "nothing was reported");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Waits until no mismatched endpoint is there.
fn await_none(backend: &dyn Backend) {
    let start = Instant::now();
    while !backend.mismatches().is_empty() {
        assert!(start.elapsed() < LIMIT, "{:?}", backend.mismatches());
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// The library also compares the names of types, and reports no difference.
#[test]
fn an_endpoint_of_another_type_is_reported_while_it_is_there_and_not_received() {
    let ((here, one), (there, other)) = (join("hears"), join("says"));
    let right = topic("pose", Qos::PUBLISHER);
    let mut subscriber = here.subscriber(&right).expect("an end");
    let mut wrong = right.clone();
    // Only the DDS name of its types is known.
    wrong.types.hash = 0;
    for external in &mut wrong.external_types {
        "std_msgs/msg/String".clone_into(&mut external.type_name);
    }
    let mut wrong = there.publisher(&wrong).expect("an end");
    let told = reports(&*here);
    for name in [
        "conformance_msgs::msg::dds_::any_",
        "std_msgs::msg::dds_::String_",
    ] {
        assert!(told.len() == 1 && told[0].contains(name), "{told:?}");
    }
    // As if on another machine, so that no registration is compared.
    let (third, last) = join("says-too");
    let mut publisher = third.publisher(&right).expect("an end");
    let mut hear = || {
        let (mut heard, mut is_right) = (0, true);
        let mut take = |_, body: &[u8]| {
            heard += 1;
            is_right &= body == [1; 8];
        };
        while subscriber.receive(&mut take).expect("no error") {}
        assert!(is_right, "what has another type is heard");
        heard
    };
    let mut sequence = 0;
    let mut say = || {
        let mut header = rc_conformance::network::header(sequence);
        sequence += 1;
        publisher.publish(header, &[1; 8]).expect("to send");
        // More samples than a subscriber keeps.
        for _ in 0..2 * right.qos.depth {
            header.sequence += 1;
            wrong.publish(header, &[9; 8]).expect("to send");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let start = Instant::now();
    while hear() == 0 {
        assert!(start.elapsed() < LIMIT, "nothing is heard");
        say();
    }
    // Samples of other types take no room from those that can be read.
    let mut heard = 0;
    (0..20).for_each(|_| {
        say();
        heard += hear();
    });
    while heard < 20 {
        assert!(start.elapsed() < LIMIT, "{heard} were heard");
        std::thread::sleep(Duration::from_millis(1));
        heard += hear();
    }
    assert_eq!(subscriber.peers(), 1);
    assert_eq!(here.mismatches(), told);
    drop(wrong);
    await_none(&*here);
    for directory in [one, other, last] {
        directory.remove().expect("to remove it");
    }
}

#[test]
fn a_late_publisher_that_offers_less_is_reported() {
    let ((here, one), (there, other)) = (join("here"), join("there"));
    let reliable = Qos {
        reliability: Reliability::Reliable,
        ..Qos::SUBSCRIBER
    };
    let _subscriber = here.subscriber(&topic("scan", reliable)).expect("an end");
    assert_eq!(here.mismatches(), [""; 0]);
    let careless = Qos {
        reliability: Reliability::BestEffort,
        ..Qos::PUBLISHER
    };
    let publisher = there.publisher(&topic("scan", careless)).expect("an end");
    let told = reports(&*here);
    assert!(told[0].contains("receives no samples of"), "{told:?}");
    assert_eq!(here.mismatches(), told);
    drop(publisher);
    await_none(&*here);
    for directory in [one, other] {
        directory.remove().expect("to remove it");
    }
}
