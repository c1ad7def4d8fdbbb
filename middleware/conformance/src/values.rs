//! Values through the typed layer: a backend may pass them as they are, or encoded.

use crate::Subject;
use crate::network::{LIMIT, Network, endpoint};
use rc_middleware::typed::{self, Operation, Request, Returned, TypedClient, TypedPublisher};
use rc_middleware::{
    CallError, Cdr, DecodeError, EncodeError, Reader, SendError, Server, Subscriber, WakeEvent,
    Writer, wait,
};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::os::fd::AsFd;
use std::thread;

/// A query, or a topic.
const ANY: Operation = Operation::query("any", 5, 7, &[]);

/// A number from 0 to 9.
#[derive(Clone, Debug, PartialEq)]
struct Digit(i32);

impl Cdr for Digit {
    fn encode(&self, writer: &mut Writer<'_>) {
        writer.range("Digit", self.0.into(), (0.0, 9.0), "[0, 9]");
        writer.put(&self.0);
    }

    fn decode(reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        let number: i32 = reader.get()?;
        reader.range("Digit", number.into(), (0.0, 9.0), "[0, 9]")?;
        Ok(Self(number))
    }
}

/// The next sample as parameters.
fn next<A: typed::Arguments>(subscriber: &mut dyn Subscriber) -> Result<A, DecodeError> {
    loop {
        let mut read = None;
        let received = subscriber
            .receive_message(&mut |header, message| {
                assert_eq!(header.type_hash, ANY.type_hash);
                read = Some(typed::read(&mut message.reader(header.encoding)));
            })
            .expect("to receive");
        if received {
            return read.expect("a sample");
        }
        let woken = wait(&[subscriber.descriptor()], LIMIT) != 0;
        assert!(woken, "no sample came");
        subscriber.acknowledge(woken);
    }
}

/// Every subscriber gets the published value: unchanged, in types of its own, or as bytes.
pub fn values_reach_every_subscriber(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Laser/scan");
    let backend = network.join_bare("both");
    let mut subscribers: Vec<_> = (0..4)
        .map(|_| backend.subscriber(&address).expect("a subscriber"))
        .collect();
    let port = backend.publisher(&address).expect("a publisher");
    network.meet(|| port.peers() == 4 && subscribers.iter().all(|one| one.peers() == 1));
    let mut topic = TypedPublisher::new(port, ANY);
    let map: BTreeMap<String, Vec<f64>> = [("a".to_owned(), vec![1.5, -2.0])].into();
    let large = vec![7_u16; 100_000];
    topic
        .publish_parts(("front", &large[..], &map, &Digit(9)))
        .expect("to be published");
    let expected = ("front".to_owned(), large.clone(), map.clone(), Digit(9));
    for subscriber in &mut subscribers[..2] {
        assert_eq!(next(&mut **subscriber), Ok(expected.clone()));
    }
    // The beginning, as other types with the same bytes.
    let read = next(&mut *subscribers[2]);
    assert_eq!(read, Ok(("front".to_owned(), 100_000_u32)));
    let mut writer = Writer::default();
    expected.write(&mut writer);
    let bodies = crate::network::receive(&mut *subscribers[3], 1);
    assert_eq!(bodies[0].1, writer.into_bytes());

    // A value outside its bounds is not sent, and gets no number.
    let wrong = topic.publish_parts(("front", &[1_u16][..], &map, &Digit(10)));
    assert!(
        matches!(
            wrong,
            Err(SendError::Invalid(EncodeError::OutOfRange { .. }))
        ),
        "{wrong:?}"
    );
    assert_eq!(topic.sent().get(), 1);
    topic.publish_parts(()).expect("to be published");
    assert_eq!(next(&mut *subscribers[0]), Ok(()));
}

/// Serves requests, which may be values, until `stop`.
fn serve(
    server: &mut dyn Server,
    stop: &WakeEvent,
    answer: impl Fn(&mut Request<'_>) -> Result<(), typed::HandlerError>,
) {
    let mut woken = true;
    while !stop.is_stopping() {
        server.acknowledge(woken);
        let mut serve = || {
            server.serve_message(&mut |header, message, reply| {
                let request = Request::open_message(header, &message, reply);
                let mut request = request.expect("an envelope");
                // Why a request is refused is in its reply.
                let _ = answer(&mut request);
                request.close();
            })
        };
        while serve().expect("requests") {}
        woken = wait(&[server.descriptor(), stop.as_fd()], LIMIT) & 1 != 0;
    }
}

/// Calls of a server that answers `answer` to the parameters.
fn calling<A: typed::Arguments, R: Returned>(
    subject: &dyn Subject,
    answer: impl Fn(A) -> R + Sync,
    call: impl FnOnce(&mut TypedClient),
) {
    let network = Network::new(subject);
    let address = endpoint("default/Calculator");
    let stop = WakeEvent::new().expect("an event");
    thread::scope(|scope| {
        let (open, opened) = std::sync::mpsc::channel();
        let (network, address, stop, answer) = (&network, &address, &stop, &answer);
        scope.spawn(move || {
            let backend = network.join_bare("server");
            let mut server = backend.server(address).expect("a server");
            open.send(()).expect("a client");
            serve(&mut *server, stop, |request| {
                request.answer(&ANY, typed::read, typed::reply, answer)
            });
        });
        opened.recv().expect("a server");
        let backend = network.join_bare("client");
        let mut client = TypedClient::new(backend.client(address).expect("a client"), LIMIT);
        crate::network::until("a server is there", || client.peers() == 1);
        call(&mut client);
        stop.stop();
    });
}

/// The result of a call.
fn ok<R: Debug>(result: Result<R, CallError>) -> R {
    result.expect("a result")
}

/// A client gets what the handler returns, and the handler what the client sends.
pub fn calls_carry_values(subject: &dyn Subject) {
    let answer = |(text, number): (String, f64)| (number, text);
    calling(subject, answer, |client| {
        let both: (f64, String) = ok(client.call(&ANY, ("a", &1.5_f64)));
        assert_eq!(both, (1.5, "a".to_owned()));
        // In other types with the same bytes, and as bytes.
        let first: f64 = ok(client.call(&ANY, (&"b".to_owned(), &2.5_f64)));
        assert_eq!(first, 2.5);
        let written = client.call_with(
            &ANY,
            |writer| {
                writer.put(&"c".to_owned());
                writer.put(&3.5_f64);
            },
            |case, reader| {
                typed::expect_result(case)?;
                Ok::<f64, CallError>(reader.get()?)
            },
        );
        assert_eq!(ok(written), 3.5);
        let wrong = client.call::<f64, CallError>(&ANY, ("a\0b", &1.5_f64));
        assert_eq!(wrong, Err(CallError::Invalid(EncodeError::ZeroByte)));
        // Started calls.
        let started = client.start::<(f64, String), CallError>(&ANY, ("d", &4.5_f64));
        let call = started.expect("to be started");
        let mut ended = None;
        crate::network::until("the call has ended", || {
            ended = client.poll_with(|ended| (ended.id, ended.result::<_, CallError>()));
            ended.is_some()
        });
        let result = Ok((4.5_f64, "d".to_owned()));
        assert_eq!(ended, Some((call.id(), result)));
    });
    // No parameters, and a result that cannot be sent at first.
    let count = std::sync::atomic::AtomicI32::new(10);
    let answer = |(): ()| Digit(count.fetch_sub(1, std::sync::atomic::Ordering::Relaxed));
    calling(subject, answer, |client| {
        let refused = client.call::<Digit, CallError>(&ANY, ());
        assert!(
            matches!(&refused, Err(CallError::Refused(why)) if why.contains("Digit")),
            "{refused:?}"
        );
        assert_eq!(ok::<Digit>(client.call(&ANY, ())), Digit(9));
    });
}
