//! Notes of messages on chains, over the socket of a component.

use super::time::{network, slot};
use rc_management::Client;
use rc_management::component::Request;
use rc_management::hops::{Following, HopReport, Message, Pair, Way};
use rc_middleware::typed::TypedPublisher;
use rc_middleware::{Qos, RunDirectory};
use rc_runtime::{
    Component, Core, Description, Ports, Role, Slot, StartError, Values, WorkerError, embed,
};
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(20);

static OUT: [Slot; 1] = [slot("Out", Role::Publishes, Qos::PUBLISHER)];
static DESCRIPTION: Description = Description {
    name: "sender",
    model_hash: 1,
    middleware: "local",
    period: Duration::from_millis(20),
    parameters: None,
    folder: "/nowhere",
    slots: &OUT,
    backends: &[rc_local::LINKED],
    types: &[],
    simulates_time: false,
    managed: false,
    converter: None,
    note: b"",
};

/// Publishes in each `compute()`.
struct Worker(Core, TypedPublisher);

impl Worker {
    fn start(core: Core, ports: &Ports, _: &Values) -> Result<Self, StartError> {
        Ok(Self(core, ports.publisher(0, 0)?))
    }
}

impl Component for Worker {
    fn core(&mut self) -> &mut Core {
        &mut self.0
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        self.1.publish_with(|writer| writer.put(&1))?;
        Ok(())
    }
}

/// The numbers of the samples that were noted, once there are some.
fn sent(client: &mut Client) -> Vec<u32> {
    let end = Instant::now() + LIMIT;
    loop {
        let report: HopReport = client.call(&Request::Hops, LIMIT).expect("the notes");
        assert_eq!(report.overwritten, 0);
        if !report.hops.is_empty() {
            return report.hops.iter().map(|hop| hop.output).collect();
        }
        assert!(Instant::now() < end, "nothing is noted");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The supervisor drops a connection on which it had no answer, and asks for the same messages on
/// another one.
#[test]
fn notes_wait_for_a_client_that_comes_back() {
    let network = network("followed");
    let component = embed(&DESCRIPTION, Worker::start, &["--network", &network]);
    let component = component.expect("a component");
    let socket = RunDirectory::of(&network).socket("sender");
    let follow = || {
        let output = Message {
            slot: "Out".to_owned(),
            operation: "value".to_owned(),
        };
        let pair = Pair {
            input: None,
            output: Some(output),
            way: Way::Any,
            stamp: None,
        };
        let pairs = vec![pair];
        let end = Instant::now() + LIMIT;
        loop {
            let mut client = Client::connect(&socket, LIMIT).expect("a connection");
            let request = Request::Follow {
                pairs: pairs.clone(),
            };
            match client.call::<Following>(&request, LIMIT) {
                Ok(_) => return client,
                // It starts, or has not seen yet that the other client has left.
                Err(error) => assert!(Instant::now() < end, "{error}"),
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    };
    let mut client = follow();
    let before = sent(&mut client);
    drop(client);
    // It sees that the client has left, and goes on to publish.
    std::thread::sleep(Duration::from_millis(200));
    let after = sent(&mut follow());
    let (last, first) = (before.last().expect("a number"), after[0]);
    assert_eq!(first, last + 1, "{after:?}");
    component.stop();
    component.join().expect("an orderly end");
}
