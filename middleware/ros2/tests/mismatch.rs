//! An end that does not fit is refused, or told to who watches the component when it comes later and from elsewhere.

use rc_middleware::qos::Reliability;
use rc_middleware::{Backend, Endpoint, Environment, Interrupt, Qos, RunDirectory, Settings};
use std::time::{Duration, Instant};

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_secs(30);

/// A component that shares no run directory with others, as if on another machine.
fn join(machine: &str) -> (Box<dyn Backend>, RunDirectory) {
    let (environment, directory) = environment(machine);
    let backend = rc_ros2::connect(&environment).expect("the domain");
    (backend, directory)
}

fn environment(machine: &str) -> (Environment, RunDirectory) {
    let network = format!("mismatch{machine}-{}", std::process::id());
    let directory = RunDirectory::open(&network).expect("a run directory");
    let mut environment = Environment {
        network,
        instance: machine.to_owned(),
        directory: directory.clone(),
        interrupt: Interrupt::new().expect("an interrupt"),
        settings: Settings::default(),
    };
    let domain = vec!["13".to_owned()];
    environment.settings.set("ros2", "domain", domain);
    (environment, directory)
}

fn topic(qos: Qos) -> Endpoint {
    let address = format!("default/Laser/scan{}", std::process::id());
    Endpoint {
        qos,
        ..rc_conformance::network::endpoint(&address)
    }
}

#[test]
fn what_a_late_publisher_does_not_offer_is_told() {
    let ((here, one), (there, other)) = (join("here"), join("there"));
    let reliable = Qos {
        reliability: Reliability::Reliable,
        ..Qos::SUBSCRIBER
    };
    let _subscriber = here.subscriber(&topic(reliable)).expect("an end");
    assert_eq!(here.mismatches(), [""; 0]);
    let careless = Qos {
        reliability: Reliability::BestEffort,
        ..Qos::PUBLISHER
    };
    let publisher = there.publisher(&topic(careless)).expect("an end");
    let start = Instant::now();
    let told = loop {
        let told = here.mismatches();
        if !told.is_empty() {
            break told;
        }
        assert!(start.elapsed() < LIMIT, "nothing was told");
        std::thread::sleep(Duration::from_millis(10));
    };
    assert!(told[0].contains("hears nothing of"), "{told:?}");
    drop(publisher);
    for directory in [one, other] {
        directory.remove().expect("to remove it");
    }
}

/// What one mapping writes before a request, another one would execute.
#[test]
fn another_mapping_of_services_is_refused() {
    let (mut environment, directory) = environment("mapped");
    let enhanced = rc_ros2::connect(&environment).expect("the domain");
    let mapping = vec!["cyclone".to_owned()];
    environment.settings.set("ros2", "service_mapping", mapping);
    let cyclone = rc_ros2::connect(&environment).expect("the domain");
    let address = format!("default/Mapped{}", std::process::id());
    let endpoint = rc_conformance::network::endpoint(&address);
    let server = enhanced.server(&endpoint).expect("a server");
    let refused = cyclone
        .client(&endpoint)
        .err()
        .expect("a reason")
        .to_string();
    assert!(refused.contains("service_mapping=cyclone"), "{refused}");
    drop(server);
    let server = cyclone.server(&endpoint).expect("a server");
    assert!(enhanced.client(&endpoint).is_err());
    assert!(cyclone.client(&endpoint).is_ok());
    drop((server, enhanced, cyclone));
    directory.remove().expect("to remove it");
}
