//! A component sends more in its life than may wait for confirmation.

use rc_conformance::Subject;
use rc_conformance::network::{LIMIT, Network, endpoint, header};
use rc_middleware::{Backend, Environment, OpenError};
use rc_settings::Value;
use std::time::Duration;

struct Ros2;

impl Subject for Ros2 {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        let mut environment = environment.clone();
        let domain = 100 + std::process::id() % 80;
        let domain = Value::Int(domain.into());
        environment.settings.set("ros2", "domain", domain);
        let lease = Value::Duration(Duration::from_secs(10));
        environment.settings.set("ros2", "lease", lease);
        rc_ros2::connect(&environment)
    }

    fn pads(&self) -> bool {
        true
    }
}

/// 160 MiB in all, with one pending request at a time.
#[test]
fn calls_go_on_for_ever() {
    let network = Network::new(&Ros2);
    let address = endpoint("default/Camera");
    let echo = |_: rc_middleware::Header, request: &[u8], reply: &mut Vec<u8>| {
        reply.extend_from_slice(&request[..4]);
    };
    network.serving(&address, echo, || {
        let backend = network.join("client");
        let mut client = backend.client(&address).expect("a client");
        let request = vec![7; 256 << 10];
        for number in 0..640 {
            let answered = client.call(header(1), &request, LIMIT, &mut |_, _| {});
            assert_eq!(answered, Ok(()), "{number}");
        }
    });
}
