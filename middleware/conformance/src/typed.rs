//! The typed layer over the backend: envelopes, results, exceptions, refusals.

use crate::Subject;
use crate::network::{LIMIT, Network, endpoint, header, receive, until};
use rc_middleware::rpc::{self, RequestId};
use rc_middleware::started::STARTED_CALLS;
use rc_middleware::typed::{
    Call, CallId, DeferredRequest, HandlerError, Operation, ReplyVariant, Request, Throws,
    TypedClient, TypedPublisher,
};
use rc_middleware::{CallError, Cdr, DecodeError, Header, Reader, Reply, Writer, wait};
use std::time::{Duration, Instant};

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
    network.meet(|| port.peers() == 1 && subscriber.peers() == 1);
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
            answer(&mut request);
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
        let port = network.client(&*backend, &address);
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

/// The header of a reply has the time of its request less the age of the value, where replies have
/// ages, and no earlier one without an age.
pub fn replies_say_how_old_their_values_are(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Calculator");
    // The first argument is the age; the largest one is older than the clock. The second one says
    // whether the reply is deferred.
    let handler = |header: Header, body: &[u8], reply: &mut dyn Reply| {
        let mut request = Request::open(header, body, reply).expect("an envelope");
        let read = |reader: &mut Reader<'_>| Ok((reader.get::<i32>()?, reader.get::<i32>()?));
        let (age, later) = request.arguments(&DIVIDE, read).expect("two numbers");
        let reply = |request: &mut Request<'_>| {
            request.set_age(match age {
                i32::MAX => Duration::MAX,
                age => Duration::from_nanos(age.unsigned_abs().into()),
            });
            let replied = request.reply_with(0, |writer| writer.put(&1_i32));
            replied.expect("a reply");
        };
        if later == 0 {
            reply(&mut request);
        } else {
            let deferred = request.defer().expect("a later reply");
            deferred.reply(reply).expect("to be sent");
        }
        request.close();
    };
    network.serving_bare(&address, handler, || {
        let backend = network.join_bare("client");
        let mut port = network.client(&*backend, &address);
        if !port.replies_have_ages() {
            return;
        }
        let asked = header(1);
        let old = [(0, asked.sent), (250, asked.sent - 250), (i32::MAX, 1)];
        let all = [0, 1].map(|later| old.map(|(age, expected)| (age, later, expected)));
        for ((age, later, expected), sequence) in all.into_iter().flatten().zip(1..) {
            let mut request = Writer::default();
            let writer = port.guid();
            rpc::begin_request(&mut request, RequestId { writer, sequence }, DIVIDE.id);
            rpc::begin_body(&mut request, port.profile());
            request.put(&age);
            request.put(&later);
            let mut sent = None;
            let asked = Header { sequence, ..asked };
            port.call(asked, &request.into_bytes(), LIMIT, &mut |header, _| {
                sent = Some(header.sent);
            })
            .expect("a reply");
            let sent = sent.expect("a reply");
            // Without an age, it may be the time of the reply itself.
            let is_right = if age == 0 {
                sent >= expected
            } else {
                sent == expected
            };
            assert!(is_right, "{age}, {later}: {sent}, expected {expected}");
        }
    });
}

/// The exceptions of `divide`.
#[derive(Clone, Debug, PartialEq)]
enum Failed {
    ByZero(i32),
    Call(CallError),
}

impl From<CallError> for Failed {
    fn from(error: CallError) -> Self {
        Self::Call(error)
    }
}

impl Throws for Failed {
    fn read(case: i32, reader: &mut Reader<'_>) -> Result<Self, DecodeError> {
        match case {
            BY_ZERO => Ok(Self::ByZero(reader.get()?)),
            _ => Err(DecodeError::Unknown("exception in the reply")),
        }
    }

    fn refuse(self, request: &mut Request<'_>) -> Result<(), HandlerError> {
        match self {
            Self::ByZero(a) => request.reply_with(BY_ZERO, |writer| writer.put(&a)),
            Self::Call(error) => request.fail(&error),
        }
    }
}

/// The next started call that ends.
fn next(caller: &mut TypedClient) -> (CallId, Result<i32, Failed>) {
    let end = Instant::now() + LIMIT;
    loop {
        let ended = caller.poll_with(|ended| (ended.id, ended.result::<i32, Failed>()));
        if let Some(ended) = ended {
            return ended;
        }
        assert!(Instant::now() < end, "no call has ended");
        let awaiting = caller.awaiting().expect("a started call");
        let left = awaiting.until.saturating_duration_since(Instant::now());
        wait(&[awaiting.descriptor], left.min(LIMIT));
    }
}

/// Started calls end with all kinds of replies. A call that is dropped leaves its place to another
/// one, and never ends.
pub fn started_queries_end_with_results_exceptions_and_errors(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Calculator");
    network.serving_bare(&address, divide, || {
        let backend = network.join_bare("client");
        let port = network.client(&*backend, &address);
        let mut caller = TypedClient::new(port, LIMIT);
        let start = |caller: &mut TypedClient, a: i32, b: i32| {
            caller
                .start::<i32, Failed>(&DIVIDE, (&a, &b))
                .expect("to be started")
        };
        let state = "driving.forward".to_owned();
        let cases = [
            ((42, 6), Ok(7)),
            ((42, 0), Err(Failed::ByZero(42))),
            (
                (UNAVAILABLE, 3),
                Err(Failed::Call(CallError::Unavailable { state })),
            ),
            ((9, 3), Ok(3)),
        ];
        let calls = cases.clone().map(|((a, b), _)| start(&mut caller, a, b));
        let called = caller.call::<i32, Failed>(&DIVIDE, (&8, &2));
        assert_eq!(called, Ok(4), "a call that waits, among them");
        for (call, (_, expected)) in calls.iter().zip(cases) {
            assert_eq!(next(&mut caller), (call.id(), expected));
        }
        assert!(caller.awaiting().is_none());
        let dropped: Vec<Call<i32, Failed>> = (0..STARTED_CALLS)
            .map(|_| start(&mut caller, 1, 1))
            .collect();
        drop(dropped);
        let last = start(&mut caller, 10, 2);
        assert_eq!(next(&mut caller), (last.id(), Ok(5)));
        assert!(caller.awaiting().is_none());
        assert!(caller.poll_with(|_| ()).is_none());
    });
}

/// Replies may come after their handlers, in another order, with results, exceptions and refusals.
/// One that is dropped leaves the others as they are.
pub fn replies_may_come_later(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Calculator");
    let backend = network.join_bare("both");
    let mut server = backend.server(&address).expect("a server");
    let clients = ["one", "other"].map(|name| network.join_bare(name));
    let mut callers = clients
        .each_ref()
        .map(|client| TypedClient::new(client.client(&address).expect("a client"), LIMIT));
    network.meet(|| callers.iter().all(|caller| caller.peers() == 1));
    let state = "driving.forward".to_owned();
    let cases = [
        (42, 6, Ok(7)),
        (42, 0, Err(Failed::ByZero(42))),
        (
            UNAVAILABLE,
            3,
            Err(Failed::Call(CallError::Unavailable { state })),
        ),
        (9, 3, Ok(3)),
    ];
    for round in 0..3 {
        let mut started = Vec::new();
        for (a, b, expected) in cases.clone() {
            for caller in &mut callers {
                let call = caller.start::<i32, Failed>(&DIVIDE, (&a, &b));
                started.push((call.expect("to be started"), expected.clone()));
            }
        }
        let mut kept = Vec::new();
        until("all requests have come", || {
            while server
                .serve(&mut |header, body, reply| keep(header, body, reply, &mut kept))
                .expect("requests")
            {}
            kept.len() == started.len()
        });
        for caller in &mut callers {
            assert!(caller.poll_with(|_| ()).is_none(), "nobody has replied");
        }
        if round == 1 {
            kept.rotate_left(3);
        }
        for (request, a, b) in kept.into_iter().rev() {
            request
                .reply(|request| reply_to(request, a, b))
                .expect("a reply");
        }
        for (at, caller) in callers.iter_mut().enumerate() {
            let own = started.iter().skip(at).step_by(2);
            let mut ended: Vec<_> = own.clone().map(|_| next(caller)).collect();
            ended.sort_by_key(|(id, _)| *id);
            let expected: Vec<_> = own
                .map(|(call, result)| (call.id(), result.clone()))
                .collect();
            assert_eq!(ended, expected);
        }
    }
    let [caller, _] = &mut callers;
    let dropped = caller
        .start::<i32, Failed>(&DIVIDE, (&1, &1))
        .expect("to be started");
    let last = caller
        .start::<i32, Failed>(&DIVIDE, (&8, &2))
        .expect("to be started");
    let mut kept = Vec::new();
    until("both have come", || {
        while server
            .serve(&mut |header, body, reply| keep(header, body, reply, &mut kept))
            .expect("requests")
        {}
        kept.len() == 2
    });
    let (request, a, b) = kept.pop().expect("a request");
    drop(kept);
    request
        .reply(|request| reply_to(request, a, b))
        .expect("a reply");
    drop(dropped);
    assert_eq!(next(caller), (last.id(), Ok(4)));
}

/// Keeps a request of `divide` with its parameters.
fn keep(
    header: Header,
    body: &[u8],
    reply: &mut dyn Reply,
    kept: &mut Vec<(DeferredRequest, i32, i32)>,
) {
    let mut request = Request::open(header, body, reply).expect("an envelope");
    let read = |reader: &mut Reader<'_>| Ok((reader.get::<i32>()?, reader.get::<i32>()?));
    let (a, b) = request.arguments(&DIVIDE, read).expect("two numbers");
    kept.push((request.defer().expect("a later reply"), a, b));
    assert!(request.defer().is_none(), "it was deferred");
    request.close();
}

/// Serves `divide`.
fn divide(header: Header, body: &[u8], reply: &mut dyn Reply) {
    let mut request = Request::open(header, body, reply).expect("an envelope");
    answer(&mut request);
    request.close();
}

/// Replies to `divide`.
fn answer(request: &mut Request<'_>) {
    let read = |reader: &mut Reader<'_>| Ok((reader.get::<i32>()?, reader.get::<i32>()?));
    let Ok((a, b)) = request.arguments(&DIVIDE, read) else {
        return;
    };
    reply_to(request, a, b);
}

fn reply_to(request: &mut Request<'_>, a: i32, b: i32) {
    if a == UNAVAILABLE {
        request.unavailable(&DIVIDE, "driving.forward");
        return;
    }
    let replied = match a.checked_div(b) {
        Some(result) => request.reply_with(0, |writer| writer.put(&result)),
        None => Failed::ByZero(a).refuse(request),
    };
    replied.expect("a reply");
}
