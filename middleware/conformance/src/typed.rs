//! The typed layer over the backend: envelopes, results, exceptions, refusals.

use crate::Subject;
use crate::network::{LIMIT, Network, endpoint, receive};
use rc_middleware::typed::{Operation, ReplyVariant, Request, TypedClient, TypedPublisher};
use rc_middleware::{CallError, Cdr, Header, Reader, Reply};

/// `int32 divide(int32 a, int32 b)`, which throws where b is 0.
const DIVIDE: Operation = Operation {
    name: "divide",
    id: 11,
    type_hash: 7,
    two_way: true,
    replies: &[ReplyVariant::of::<i32>(BY_ZERO), ReplyVariant::of::<i32>(0)],
};
/// `divide` of an IDSL that differs.
const OTHER_DIVIDE: Operation = Operation {
    type_hash: 8,
    ..DIVIDE
};
/// `void note(string text)`
const NOTE: Operation = Operation {
    name: "note",
    id: 12,
    type_hash: 9,
    two_way: false,
    replies: &[],
};
/// The server refuses what has this argument, because of its state.
const UNAVAILABLE: i32 = -1;
/// The hash of the exception.
const BY_ZERO: i32 = 13;

/// A subscriber receives the published values.
pub fn topics_carry_values(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Laser/scan");
    let backend = network.join_bare("both");
    let mut subscriber = backend.subscriber(&address).expect("a subscriber");
    let port = backend.publisher(&address).expect("a publisher");
    let mut topic = TypedPublisher::new(port, DIVIDE);
    for number in 1..=3_i32 {
        topic
            .publish_with(|writer| writer.put(&number))
            .expect("to publish");
    }
    for ((header, body), number) in receive(&mut *subscriber, 3).iter().zip(1..) {
        assert_eq!(header.type_hash, DIVIDE.type_hash);
        assert_eq!(header.sequence, number as u64);
        assert!(header.sent > 0 && header.sent <= rc_middleware::now());
        assert_eq!(i32::decode(&mut Reader::new(body)), Ok(number));
    }
}

/// All kinds of replies to a query, and a command before it.
pub fn queries_return_results_exceptions_and_errors(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Calculator");
    let notes = std::sync::Mutex::new(Vec::new());
    let handler = |header: Header, body: &[u8], reply: &mut dyn Reply| {
        let mut request = Request::open(header, body, reply).expect("an envelope");
        if request.operation == DIVIDE.id {
            let read = |reader: &mut Reader<'_>| Ok((reader.get::<i32>()?, reader.get::<i32>()?));
            if let Ok((a, b)) = request.arguments(&DIVIDE, read) {
                if a == UNAVAILABLE {
                    request.unavailable(&DIVIDE, "driving.forward");
                    return request.close();
                }
                let (case, value) = match a.checked_div(b) {
                    Some(result) => (0, result),
                    None => (BY_ZERO, a),
                };
                request
                    .reply_with(case, |writer| writer.put(&value))
                    .expect("a reply");
            }
        } else {
            let note = request
                .arguments(&NOTE, Reader::get::<String>)
                .expect("a text");
            if note == "end" {
                request.unavailable(&NOTE, "driving.forward");
                return request.close();
            }
            notes.lock().expect("the notes").push(note);
        }
        request.close();
    };
    network.serving_bare(&address, handler, || {
        let backend = network.join_bare("client");
        let port = backend.client(&address).expect("a client");
        let mut caller = TypedClient::new(port, LIMIT);
        caller
            .send_with(&NOTE, |writer| writer.put(&"begin".to_owned()))
            .expect("to be sent");
        let mut divide = |operation: &Operation, a: i32, b: i32| {
            caller.call_with(
                operation,
                |writer| {
                    writer.put(&a);
                    writer.put(&b);
                },
                |case, reader| Ok((case, reader.get::<i32>()?)),
            )
        };
        assert_eq!(divide(&DIVIDE, 42, 6), Ok((0, 7)));
        assert_eq!(divide(&DIVIDE, 42, 0), Ok((BY_ZERO, 42)));
        if subject.compares_each_message() {
            let refused = divide(&OTHER_DIVIDE, 42, 6);
            assert!(
                matches!(&refused, Err(CallError::Refused(why)) if why.contains("divide")),
                "{refused:?}"
            );
        }
        assert_eq!(divide(&DIVIDE, 9, 3), Ok((0, 3)));
        let state = "driving.forward".to_owned();
        let held = divide(&DIVIDE, UNAVAILABLE, 3);
        assert_eq!(held, Err(CallError::Unavailable { state }));
        assert_eq!(divide(&DIVIDE, 8, 2), Ok((0, 4)));
        // A command that is refused has no reply, which the next call could take for its own.
        caller
            .send_with(&NOTE, |writer| writer.put(&"end".to_owned()))
            .expect("to be sent");
        let left = caller.call_with(
            &DIVIDE,
            |writer| {
                writer.put(&10_i32);
                writer.put(&2_i32);
            },
            |case, reader| Ok::<_, CallError>((case, reader.get::<i32>()?)),
        );
        assert_eq!(left, Ok((0, 5)));
    });
    assert_eq!(notes.into_inner().expect("the notes"), ["begin"]);
}
