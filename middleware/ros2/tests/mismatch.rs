//! An end that does not fit is told to who watches the component, when it comes later and from elsewhere.

use rc_middleware::qos::Reliability;
use rc_middleware::{Backend, Endpoint, Environment, Interrupt, Qos, RunDirectory, Settings};
use std::time::{Duration, Instant};

/// No test waits longer for anything.
const LIMIT: Duration = Duration::from_secs(30);

/// A component that shares no run directory with others, as if on another machine.
fn join(machine: &str) -> (Box<dyn Backend>, RunDirectory) {
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
    let backend = rc_ros2::connect(&environment).expect("the domain");
    (backend, directory)
}

fn topic(name: &str, qos: Qos) -> Endpoint {
    let address = format!("default/Laser/{name}{}", std::process::id());
    Endpoint {
        qos,
        ..rc_conformance::network::endpoint(&address)
    }
}

/// What is told of ends that do not fit, when something is.
fn told(backend: &dyn Backend) -> Vec<String> {
    let start = Instant::now();
    loop {
        let told = backend.mismatches();
        if !told.is_empty() {
            return told;
        }
        assert!(start.elapsed() < LIMIT, "nothing was told");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// `rustdds` brings together whoever names the same topic, and sends what it cannot read to a reader of another type.
#[test]
fn who_has_another_type_is_told_of_once_and_not_heard() {
    let ((here, one), (there, other)) = (join("hears"), join("says"));
    let right = topic("pose", Qos::PUBLISHER);
    let mut subscriber = here.subscriber(&right).expect("an end");
    let mut wrong = right.clone();
    // Nothing is known of its types but their name in DDS.
    wrong.types.hash = 0;
    for foreign in &mut wrong.foreign {
        "std_msgs/msg/String".clone_into(&mut foreign.type_name);
    }
    let mut wrong = there.publisher(&wrong).expect("an end");
    let told = told(&*here);
    for name in [
        "conformance_msgs::msg::dds_::any_",
        "std_msgs::msg::dds_::String_",
    ] {
        assert!(told.len() == 1 && told[0].contains(name), "{told:?}");
    }
    // On another machine, as it were, so that nobody there compares the two.
    let (third, last) = join("says-too");
    let mut publisher = third.publisher(&right).expect("an end");
    let start = Instant::now();
    let mut heard = 0;
    let mut sequence = 0;
    while heard < 20 {
        assert!(start.elapsed() < LIMIT, "{heard} were heard");
        sequence += 1;
        let header = rc_conformance::network::header(sequence);
        wrong.publish(header, &[9; 8]).expect("to send");
        publisher.publish(header, &[1; 8]).expect("to send");
        std::thread::sleep(Duration::from_millis(5));
        let mut is_right = true;
        let mut take = |_, body: &[u8]| is_right &= body == [1; 8];
        while subscriber.receive(&mut take).expect("no error") {
            heard += 1;
        }
        assert!(is_right, "what has another type is heard");
    }
    assert_eq!(subscriber.peers(), 1);
    assert_eq!(here.mismatches(), [""; 0]);
    for directory in [one, other, last] {
        directory.remove().expect("to remove it");
    }
}

#[test]
fn what_a_late_publisher_does_not_offer_is_told() {
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
    let told = told(&*here);
    assert!(told[0].contains("hears nothing of"), "{told:?}");
    drop(publisher);
    for directory in [one, other] {
        directory.remove().expect("to remove it");
    }
}
