//! Topics in both directions: samples of every type, in place, and for late subscribers.

use crate::network::Network;
use crate::process::{OtherEnd, Package};
use crate::values::{LEAST, MOST, SOME, outline, picture, sample};
use crate::{LIMIT, LOOK, until};
use interfaces::rc_types::earlier::{self, EarlierPublisher};
use interfaces::rc_types::pictures::{self, PicturesPublisher};
use interfaces::rc_types::samples::{self, SamplesPublisher};
use interfaces::rc_types::types::{self, TypesClient};
use interfaces::rc_types::{Everything, Kind, PictureInPlace, Point, copies, latest, repeats};
use rc_middleware::in_place::InPlace as _;
use rc_middleware::typed::{self, Operation, TypedClient, TypedPublisher};
use rc_middleware::{
    Backend, Cdr, DecodeError, Durability, Header, Qos, Reader, Reliability, Subscriber, wait,
};
use std::fmt::Debug;
use std::time::{Duration, Instant};

const RELIABLE: Qos = Qos {
    reliability: Reliability::Reliable,
    depth: 100,
    ..Qos::PUBLISHER
};
/// Pictures are large in shared memory.
const PICTURES: Qos = Qos {
    depth: 4,
    ..RELIABLE
};
/// The last two values, for late subscribers.
const LATCHED: Qos = Qos {
    durability: Durability::TransientLocal,
    depth: 2,
    ..RELIABLE
};
/// Numbers of the values that are published before the component starts.
const NUMBERS: [i32; 3] = [101, 102, 103];

/// The arguments of `several`.
type Several = (i32, f64, String, Vec<Point>, Kind, Option<Point>);

/// Receives one sample, if it comes in time.
pub(crate) fn take<T>(
    subscriber: &mut dyn Subscriber,
    limit: Duration,
    read: impl Fn(&mut Reader<'_>) -> Result<T, DecodeError>,
) -> Option<T> {
    let end = Instant::now() + limit;
    let mut found = None;
    while found.is_none() && Instant::now() < end {
        let woken = wait(&[subscriber.descriptor()], LOOK) != 0;
        subscriber.acknowledge(woken);
        let received = subscriber.receive(&mut |header: Header, body| {
            found = Some(read(&mut Reader::of(body, header.encoding)).expect("a sample"));
        });
        received.expect("to receive");
    }
    found
}

/// Reads the only parameter of a topic.
fn one<T: Cdr>(reader: &mut Reader<'_>) -> Result<T, DecodeError> {
    typed::read(reader).map(|(value,)| value)
}

/// Publishes the probe until a sample comes back, then the mark, which comes after all probes. A
/// pause between two probes does not tell that no more are on their way.
fn meet<T: PartialEq + Debug>(
    subscriber: &mut dyn Subscriber,
    read: impl Fn(&mut Reader<'_>) -> Result<T, DecodeError> + Copy,
    (probe, mark): (&T, &T),
    mut publish: impl FnMut(&T),
) {
    until("a probe comes back", || {
        publish(probe);
        take(subscriber, Duration::from_millis(100), read).is_some()
    });
    publish(mark);
    let mut rest = std::iter::from_fn(|| take(subscriber, LIMIT, read));
    assert_eq!(rest.find(|value| value != probe).as_ref(), Some(mark));
}

fn subscriber(
    other: &OtherEnd,
    backend: &dyn Backend,
    slot: &str,
    operations: &[Operation],
    operation: &Operation,
    qos: Qos,
) -> Box<dyn Subscriber> {
    let network = &other.network;
    let endpoint = network.topic(other.package.slot(slot), operations, operation, qos);
    backend.subscriber(&endpoint).expect("a subscriber")
}

/// The publisher of a topic of the component.
fn publisher(
    (network, package): (&Network, &Package),
    backend: &dyn Backend,
    slot: &str,
    operations: &[Operation],
    number: usize,
    qos: Qos,
) -> Result<TypedPublisher, rc_middleware::OpenError> {
    let operation = operations[number];
    let endpoint = network.topic(package.slot(slot), operations, &operation, qos);
    Ok(TypedPublisher::new(
        backend.publisher(&endpoint)?,
        operation,
    ))
}

/// A publisher that is there, with its values, before the component starts.
pub(crate) struct Earlier {
    /// Before its backend, on which it depends.
    _publisher: EarlierPublisher,
    _backend: Box<dyn Backend>,
}

impl Earlier {
    pub(crate) fn publish(network: &Network, package: &Package) -> Self {
        let backend = network.join("earlier");
        let open = |number| {
            let operations = earlier::OPERATIONS;
            publisher(
                (network, package),
                &*backend,
                "Earlier",
                operations,
                number,
                LATCHED,
            )
        };
        let mut publisher = EarlierPublisher::new(open).expect("a publisher");
        let mut value = sample(SOME);
        for number in NUMBERS {
            value.number = number;
            publisher.earlier(&value).expect("to be sent");
        }
        Self {
            _publisher: publisher,
            _backend: backend,
        }
    }
}

/// The component gets the last two values, publishes them again, and a subscriber that comes
/// still later gets them from it.
pub(crate) fn earlier_values_arrive(other: &OtherEnd) {
    let backend = other.network.join("later");
    let endpoint = other
        .network
        .calls(other.package.slot("Types"), types::OPERATIONS);
    let port = backend.client(&endpoint).expect("a client");
    let mut client = TypesClient::new(TypedClient::new(port, LIMIT));
    let last = NUMBERS[1..].to_vec();
    until("the component has the values", || {
        client
            .noted()
            .is_ok_and(|numbers| numbers.len() >= last.len())
    });
    assert_eq!(client.noted(), Ok(last.clone()));
    let operations = latest::OPERATIONS;
    let mut subscriber = subscriber(
        other,
        &*backend,
        "Latest",
        operations,
        &latest::LATEST,
        LATCHED,
    );
    for number in last {
        let mut value = sample(SOME);
        value.number = number;
        let taken = take(&mut *subscriber, LIMIT, one);
        assert_eq!(taken, Some(value));
    }
    let more = take(
        &mut *subscriber,
        Duration::from_millis(100),
        one::<Everything>,
    );
    assert_eq!(more, None);
}

/// A subscriber of one topic of `Repeats`.
pub(crate) fn repeats_of(
    other: &OtherEnd,
    backend: &dyn Backend,
    operation: &Operation,
) -> Box<dyn Subscriber> {
    let operations = repeats::OPERATIONS;
    subscriber(other, backend, "Repeats", operations, operation, RELIABLE)
}

pub(crate) fn samples_are_repeated(other: &OtherEnd) {
    let backend = other.network.join("samples");
    let ends = (&other.network, &other.package);
    let open = |number| {
        publisher(
            ends,
            &*backend,
            "Samples",
            samples::OPERATIONS,
            number,
            RELIABLE,
        )
    };
    let mut publisher = SamplesPublisher::new(open).expect("a publisher");
    let listen = |operation| repeats_of(other, &*backend, operation);
    let mut all = listen(&repeats::ALL);
    let ends = (&sample(LEAST), &sample(MOST));
    meet(&mut *all, one, ends, |value| {
        publisher.all(value).expect("to be sent");
    });
    for round in 0..5 {
        for which in [LEAST, MOST, SOME] {
            let mut value = sample(which);
            value.sequences.bytes = vec![9; 1000 * round];
            publisher.all(&value).expect("to be sent");
            assert_eq!(take(&mut *all, LIMIT, one), Some(value));
        }
    }
    let mut large = sample(SOME);
    large.sequences.bytes = vec![9; 1 << 20];
    publisher.all(&large).expect("to be sent");
    assert_eq!(take(&mut *all, LIMIT, one), Some(large));

    let mut several = listen(&repeats::SEVERAL);
    let value = |number, point| {
        let text = "Grüße!".to_owned();
        (number, 9.0, text, outline(3), Kind::Nothing, point)
    };
    let mut send = |(number, level, text, line, kind, point): &Several| {
        let sent = publisher.several(*number, *level, text, line, *kind, point);
        sent.expect("to be sent");
    };
    let ends = (&value(0, None), &value(1, None));
    meet(&mut *several, repeats::read_several, ends, &mut send);
    for point in [None, Some(Point { x: -0.5, y: 1e300 })] {
        let sent = value(i32::MAX, point);
        send(&sent);
        let taken = take(&mut *several, LIMIT, repeats::read_several);
        assert_eq!(taken, Some(sent));
    }
    let beyond = publisher.several(0, 9.5, "", &[], Kind::Wall, &None);
    assert!(beyond.is_err(), "its range ends at 9");

    let mut nothing = listen(&repeats::NOTHING);
    until("nothing comes back", || {
        publisher.nothing().expect("to be sent");
        take(&mut *nothing, Duration::from_millis(100), typed::read::<()>).is_some()
    });
}

/// The publisher of pictures for the component.
///
/// # Panics
/// It cannot be opened.
pub fn pictures(other: &OtherEnd, backend: &dyn Backend) -> PicturesPublisher {
    let ends = (&other.network, &other.package);
    let operations = pictures::OPERATIONS;
    let open = |number| publisher(ends, backend, "Pictures", operations, number, PICTURES);
    PicturesPublisher::new(open).expect("a publisher")
}

/// Each end writes in place and by value, and reads what the other one wrote in either way.
pub(crate) fn pictures_travel_in_place(other: &OtherEnd) {
    let backend = other.network.join("camera");
    let mut publisher = pictures(other, &*backend);
    let operations = copies::OPERATIONS;
    let mut copies = subscriber(
        other,
        &*backend,
        "Copies",
        operations,
        &copies::COPY,
        PICTURES,
    );
    let ends = (&picture(0, 0), &picture(1, 0));
    meet(
        &mut *copies,
        |reader| copies::read_copy(reader).map(|(copy,)| copy),
        ends,
        |value| {
            publisher.picture(value).expect("to be sent");
        },
    );
    for (number, bytes) in [
        (0, 0),
        (1, 1),
        (2, 1000),
        (3, 1 << 16),
        (8, 1 << 16),
        (11, 77),
    ] {
        let sent = picture(number, bytes);
        for in_place in [false, true] {
            if in_place {
                let mut loan = publisher.loan_picture().expect("a loan");
                loan.set(&sent).expect("to fit");
                loan.send().expect("to be sent");
            } else {
                publisher.picture(&sent).expect("to be sent");
            }
            let read = |reader: &mut Reader<'_>| reader.in_place::<PictureInPlace>()?.value();
            let taken = take(&mut *copies, LIMIT, read);
            assert_eq!(taken.as_ref(), Some(&sent));
        }
    }
}
