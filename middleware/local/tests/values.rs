//! Values between the ends of one process are moved or cloned, and never encoded.

use rc_conformance::network::{Network, endpoint};
use rc_middleware::typed::{self, Operation, TypedPublisher};
use rc_middleware::{Backend, Environment, Message, OpenError, Subscriber};

struct Local;

impl rc_conformance::Subject for Local {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        rc_local::connect(environment)
    }
}

const SCAN: Operation = Operation::one_way("scan", 1, 7);
const SIZE: usize = 1 << 20;

/// The next sample, which is a value.
fn next(subscriber: &mut dyn Subscriber) -> (String, Vec<u8>) {
    let mut read = None;
    let received = subscriber.receive_message(&mut |header, message| {
        assert!(matches!(message, Message::Value(_)), "it is encoded");
        read = typed::read(&mut message.reader(header.encoding)).ok();
    });
    received.expect("to receive");
    read.expect("a sample")
}

#[test]
fn a_value_is_copied_once_for_each_subscriber() {
    let network = Network::new(&Local);
    let address = endpoint("default/Laser/scan");
    let backend = network.join_bare("both");
    let mut subscribers = Vec::new();
    let port = backend.publisher(&address).expect("a publisher");
    let mut topic = TypedPublisher::new(port, SCAN);
    let scan = vec![7_u8; SIZE];
    for count in 1..=3 {
        subscribers.push(backend.subscriber(&address).expect("a subscriber"));
        let mut exchange = || {
            topic
                .publish_parts(("front", &scan[..]))
                .expect("to be sent");
            for subscriber in &mut subscribers {
                assert_eq!(next(&mut **subscriber), ("front".to_owned(), scan.clone()));
            }
        };
        // Queues have their room after the first sample.
        exchange();
        let used = allocation_counter::measure(exchange);
        // The message, then for each subscriber both parts; the comparison copies them again.
        let expected = 1 + count * (2 + 2);
        assert_eq!(used.count_total, expected, "{count} subscribers: {used:?}");
        let bytes = 2 * count * (SIZE as u64 + 5);
        assert!(used.bytes_total < bytes + 1024, "{count}: {used:?}");
    }
}
