//! Values between the ends of one process are moved or cloned, and never encoded.

use rc_conformance::network::{Network, endpoint};
use rc_middleware::request_body::RequestBody;
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{self, Checked, Operation, Put, Request, TypedClient, TypedPublisher};
use rc_middleware::{
    Backend, CallError, Client, EncodeError, Environment, Header, Message, OpenError, Subscriber,
    WakeEvent, wait,
};
use std::collections::BTreeMap;
use std::os::fd::AsFd;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

struct Local;

impl rc_conformance::Subject for Local {
    fn connect(&self, environment: &Environment) -> Result<Box<dyn Backend>, OpenError> {
        rc_local::connect(environment)
    }
}

const SCAN: Operation = Operation::one_way("scan", 1, 7);
const TELL: Operation = Operation::one_way("tell", 2, 7);
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

/// Queues count the memory of a message: at least the allocated size, and not much more.
#[test]
fn a_queue_counts_the_memory_of_values() {
    fn texts(count: usize, text: &str) -> Vec<String> {
        vec![text.to_owned(); count]
    }
    let network = Network::new(&Local);
    let address = endpoint("default/Laser/scan");
    let backend = network.join_bare("both");
    let mut subscriber = backend.subscriber(&address).expect("a subscriber");
    let queue = subscriber.queue().expect("a gauge");
    let port = backend.publisher(&address).expect("a publisher");
    let mut topic = TypedPublisher::new(port, SCAN);
    // Encoded, an empty list takes 4 bytes.
    let lists: Vec<Vec<u8>> = vec![Vec::new(); 1000];
    let short: Vec<Vec<u8>> = vec![vec![7]; 1000];
    let map = |count: u32| -> BTreeMap<u32, f64> { (0..count).map(|key| (key, 1.5)).collect() };
    let mut check = |what: &str, factor: u64, publish: &mut dyn FnMut(&mut TypedPublisher)| {
        // Queues have their room after the first sample.
        for is_warm in [false, true] {
            let used = allocation_counter::measure(|| publish(&mut topic));
            let (counted, taken) = (queue.bytes(), u64::try_from(used.bytes_current));
            let taken = taken.expect("a sample that waits");
            assert!(
                !is_warm || counted >= taken,
                "{what}: {counted} of {taken} bytes"
            );
            assert!(
                !is_warm || counted <= factor * taken + 64,
                "{what}: {counted} of {taken} bytes"
            );
            let mut came = 0;
            while subscriber
                .receive_message(&mut |_, _| came += 1)
                .expect("to receive")
            {}
            assert_eq!((came, queue.bytes(), queue.dropped()), (1, 0, 0), "{what}");
        }
    };
    check("numbers", 1, &mut |to| {
        to.publish_parts((&vec![1.5_f64; 1000],)).expect("sent");
    });
    check("empty lists", 1, &mut |to| {
        to.publish_parts((&lists,)).expect("sent");
    });
    check("short lists", 3, &mut |to| {
        to.publish_parts((&lists, &short[..])).expect("sent");
    });
    check("texts", 3, &mut |to| {
        let texts = texts(100, "abc");
        to.publish_parts(("front", &texts[..], &Some("x".to_owned())))
            .expect("sent");
    });
    for count in [1, 5, 11, 12, 200] {
        check("maps", 4, &mut |to| {
            to.publish_parts((&map(count),)).expect("sent");
        });
    }
}

/// A queue of values is full by their memory. Encoded, 3,000,000 empty lists take 12 MB.
#[test]
fn a_value_beyond_the_memory_of_a_queue_is_dropped() {
    let network = Network::new(&Local);
    let address = endpoint("default/Laser/scan");
    let backend = network.join_bare("both");
    let subscriber = backend.subscriber(&address).expect("a subscriber");
    let queue = subscriber.queue().expect("a gauge");
    let port = backend.publisher(&address).expect("a publisher");
    let mut topic = TypedPublisher::new(port, SCAN);
    let lists: Vec<Vec<u8>> = vec![Vec::new(); 3_000_000];
    topic.publish_parts((&lists,)).expect("to be sent");
    assert_eq!((queue.bytes(), queue.dropped()), (0, 1));
    let lists = &lists[..1_000_000];
    for count in 1..=4 {
        topic.publish_parts((lists,)).expect("to be sent");
        assert!(queue.bytes() <= queue.limit(), "{queue:?}");
        assert!(queue.bytes() >= 24_000_000 * count.min(2), "{queue:?}");
    }
    assert_eq!(queue.dropped(), 3, "each of the last two replaces one");
    let client = backend.client(&endpoint("default/Ask")).expect("a client");
    let mut server = backend.server(&endpoint("default/Ask")).expect("a server");
    let queue = server.queue().expect("a gauge");
    let mut client = TypedClient::new(client, LIMIT);
    for _ in 0..2 {
        client.send(&TELL, (lists,)).expect("there is room");
    }
    let full = client.send(&TELL, (lists,));
    assert!(matches!(full, Err(CallError::QueueFull(_))), "{full:?}");
    assert!(queue.bytes() >= 48_000_000, "{queue:?}");
    while server.serve_message(&mut |_, _, _| {}).expect("requests") {}
    assert_eq!(queue.bytes(), 0);
}

const LIMIT: Duration = Duration::from_secs(20);
const ASK: Operation = Operation::query("ask", 1, 7, &[]);

/// The exception of `ask`.
#[derive(Clone, Debug, PartialEq)]
struct Refusal {
    text: String,
}

rc_middleware::cdr_struct!(Refusal: text);
rc_middleware::exception!(Refusal);
rc_middleware::call_error!(AskErrors: Refusal(Refusal) = 9; AskError "ask",);

type Swapped = Result<(f64, String), AskError>;

/// Swaps its parameters, unless the text is `no`.
fn swap((text, number): (String, f64)) -> Swapped {
    match text.as_str() {
        "no" => Err(Refusal { text }.into()),
        _ => Ok((number, text)),
    }
}

/// A client that gets values only.
struct OfValues(Box<dyn Client>);

impl Client for OfValues {
    fn guid(&self) -> [u8; 16] {
        self.0.guid()
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        self.0.send(header, request)
    }

    fn takes_values(&self) -> bool {
        self.0.takes_values()
    }

    fn call(
        &mut self,
        _: Header,
        _: &dyn RequestBody,
        _: Duration,
        _: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        unreachable!("the reply would be encoded")
    }

    fn call_message(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Result<(), CallError> {
        self.0
            .call_message(header, request, limit, &mut |header, message| {
                assert!(matches!(message, Message::Value(_)), "it is encoded");
                take(header, message);
            })
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        self.0.start(header, request, limit)
    }

    fn poll(
        &mut self,
        _: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        unreachable!("the reply would be encoded")
    }

    fn poll_message(
        &mut self,
        take: &mut dyn FnMut(u64, Header, Message<'_>),
    ) -> Option<(u64, Result<(), CallError>)> {
        self.0.poll_message(&mut |sequence, header, message| {
            assert!(matches!(message, Message::Value(_)), "it is encoded");
            take(sequence, header, message);
        })
    }

    fn forget(&mut self, sequence: u64) {
        self.0.forget(sequence);
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.0.awaiting()
    }

    fn peers(&self) -> usize {
        self.0.peers()
    }
}

#[test]
fn requests_and_replies_are_values() {
    let network = Network::new(&Local);
    let address = endpoint("default/Laser");
    let stop = WakeEvent::new().expect("an event");
    thread::scope(|scope| {
        let (open, opened) = mpsc::channel();
        let (network, address, stop) = (&network, &address, &stop);
        scope.spawn(move || {
            let backend = network.join_bare("server");
            let mut server = backend.server(address).expect("a server");
            open.send(()).expect("a client");
            while !stop.is_stopping() {
                server.acknowledge(true);
                let mut serve = || {
                    server.serve_message(&mut |header, message, reply| {
                        assert!(matches!(message, Message::Value(_)), "it is encoded");
                        let request = Request::open_message(header, &message, reply);
                        let mut request = request.expect("an envelope");
                        let answered = request.try_answer(&ASK, typed::read, typed::reply, swap);
                        answered.expect("its parameters");
                        request.close();
                    })
                };
                while serve().expect("requests") {}
                wait(&[server.descriptor(), stop.as_fd()], LIMIT);
            }
        });
        let _stop = rc_conformance::network::StopOnDrop(stop);
        opened.recv().expect("a server");
        let backend = network.join_bare("client");
        let port = backend.client(address).expect("a client");
        let mut client = TypedClient::new(Box::new(OfValues(port)), LIMIT);
        let swapped = (1.5_f64, "a".to_owned());
        let result: Swapped = client.call(&ASK, ("a", &1.5_f64));
        assert_eq!(result, Ok(swapped.clone()));
        let text = "no".to_owned();
        let result: Swapped = client.call(&ASK, ("no", &1.5_f64));
        assert_eq!(result, Err(Refusal { text }.into()));
        // Bounds are checked, and the parameters are a value nevertheless.
        let mut limited = |text: &str| -> Swapped {
            let parts = Checked::new((text, &1.5_f64), |writer| {
                writer.bound("ask.text", text.len(), 1);
                (text, &1.5_f64).put(writer);
            });
            client.call(&ASK, parts)
        };
        assert_eq!(limited("a"), Ok(swapped.clone()));
        let long = limited("aa");
        assert!(
            matches!(
                long,
                Err(AskError::Call(CallError::Invalid(EncodeError::TooLong {
                    length: 2,
                    ..
                })))
            ),
            "{long:?}"
        );
        let started = client.start::<(f64, String), AskError>(&ASK, ("a", &1.5_f64));
        let call = started.expect("to be started");
        let ended = loop {
            let ended = client.poll_with(|ended| (ended.id, ended.result::<_, AskError>()));
            if let Some(ended) = ended {
                break ended;
            }
            let awaiting = client.awaiting().expect("a call");
            wait(&[awaiting.descriptor], LIMIT);
        };
        assert_eq!(ended, (call.id(), Ok(swapped)));
    });
}
