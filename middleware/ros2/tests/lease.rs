//! Components with different leases.

use rc_conformance::network::{endpoint, until};
use rc_middleware::{Backend, Environment, RunDirectory, Settings, WakeEvent};
use rc_vocabulary::Value;
use std::time::{Duration, Instant};

/// A component with a run directory of its own, as if on another machine.
fn join(machine: &str, lease: Duration) -> (Box<dyn Backend>, RunDirectory) {
    let network = format!("lease{machine}-{}", std::process::id());
    let directory = RunDirectory::open(&network).expect("a run directory");
    let mut settings = Settings::default();
    settings.set("ros2", "domain", Value::Int(14));
    settings.set("ros2", "interfaces", Value::Texts(vec!["lo".to_owned()]));
    settings.set("ros2", "lease", Value::Duration(lease));
    let environment = Environment {
        network,
        instance: machine.to_owned(),
        directory: directory.clone(),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings,
    };
    let backend = rc_ros2::connect(&environment, &[]).expect("the domain");
    (backend, directory)
}

/// A component with a long lease does not count as dead for one with a short lease.
#[test]
fn leases_may_differ() {
    let (quick, here) = join("quick", Duration::from_millis(100));
    let (slow, there) = join("slow", Duration::from_secs(8));
    let address = format!("default/Slow{}", std::process::id());
    let server = slow.server(&endpoint(&address)).expect("a server");
    let client = quick.client(&endpoint(&address)).expect("a client");
    until("the server is there", || client.peers() == 1);
    // Many leases of this component, and less than the time between two signs of life of the other
    // one.
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(1) {
        assert_eq!(client.peers(), 1, "{:?}", start.elapsed());
        std::thread::sleep(Duration::from_millis(10));
    }
    drop((client, server, quick, slow));
    for directory in [here, there] {
        directory.remove().expect("to remove it");
    }
}
