//! Calls that are started, and end while their client does other things.

use crate::Subject;
use crate::calls::{ask, echo};
use crate::network::{LIMIT, Network, endpoint, header, serve, until};
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::started::STARTED_CALLS;
use rc_middleware::{CallError, Client, Header, wait};
use std::sync::Mutex;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

/// A limit that the test lets expire.
const SHORT: Duration = Duration::from_millis(60);
const ADDRESS: &str = "default/Motor";

type Ended = (u64, Result<Vec<u8>, CallError>);

/// The next call that has ended.
fn poll(client: &mut dyn Client) -> Option<Ended> {
    let mut reply = (0, Vec::new());
    let (sequence, result) = client.poll(&mut |of, _, body| reply = (of, body.to_vec()))?;
    assert!(
        result.is_err() || reply.0 == sequence,
        "a reply to another call"
    );
    Some((sequence, result.map(|()| reply.1)))
}

/// The next call that ends, for which this waits as an event loop does.
fn next(client: &mut dyn Client) -> Ended {
    let end = Instant::now() + LIMIT;
    loop {
        if let Some(ended) = poll(client) {
            return ended;
        }
        assert!(Instant::now() < end, "no call has ended");
        let awaiting = client.awaiting().expect("a started call");
        let left = awaiting.until.saturating_duration_since(Instant::now());
        wait(&[awaiting.descriptor], left.min(LIMIT));
    }
}

/// All started calls have ended.
fn assert_nothing_left(client: &mut dyn Client) {
    assert_eq!(poll(client), None);
    assert!(client.awaiting().is_none());
}

fn start(client: &mut dyn Client, sequence: u64, limit: Duration) -> Result<(), CallError> {
    client.start(header(sequence), &[sequence as u8], limit)
}

fn deadline() -> CallError {
    CallError::Deadline {
        address: ADDRESS.to_owned(),
        limit: SHORT,
    }
}

/// As many calls at once as are allowed, a hundred times.
pub fn started_calls_get_their_own_replies(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    network.serving(&address, echo, || {
        let backend = network.join("client");
        let mut client = network.client(&*backend, &address);
        assert_nothing_left(&mut *client);
        for round in 0..100 {
            let first = round * STARTED_CALLS as u64;
            let all = first..first + STARTED_CALLS as u64;
            for sequence in all.clone() {
                start(&mut *client, sequence, LIMIT).expect("to be started");
            }
            let mut ended: Vec<_> = all.clone().map(|_| next(&mut *client)).collect();
            ended.sort_by_key(|(sequence, _)| *sequence);
            let expected = all.map(|sequence| (sequence, Ok(vec![sequence as u8, b'!'])));
            assert_eq!(ended, expected.collect::<Vec<_>>());
            assert_nothing_left(&mut *client);
        }
    });
}

/// A call beyond the limit is refused at once; commands and calls that wait still have room.
pub fn the_number_of_started_calls_is_limited(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    let backend = network.join("both");
    let mut server = backend.server(&address).expect("a server");
    let mut client = network.client(&*backend, &address);
    let count = STARTED_CALLS as u64;
    for sequence in 0..count {
        start(&mut *client, sequence, LIMIT).expect("to be started");
    }
    let full = Err(CallError::TooManyStarted);
    assert_eq!(start(&mut *client, count, LIMIT), full);
    for command in STARTED_CALLS..REQUEST_QUEUE {
        client
            .send(header(command as u64), b"-")
            .expect("to be sent");
    }
    assert_eq!(poll(&mut *client), None);
    let handler = |_: Header, request: &[u8], reply: &mut Vec<u8>| {
        if request != b"-" {
            echo(header(0), request, reply);
        }
    };
    serve(&mut *server, REQUEST_QUEUE, &handler);
    assert_eq!(next(&mut *client), (0, Ok(vec![0, b'!'])));
    start(&mut *client, count, LIMIT).expect("room for one call");
    serve(&mut *server, 1, &handler);
    for sequence in 1..=count {
        assert_eq!(
            next(&mut *client),
            (sequence, Ok(vec![sequence as u8, b'!']))
        );
    }
    assert_nothing_left(&mut *client);
}

/// It ends once, and its late reply is not that of another call.
pub fn a_started_call_ends_at_its_deadline(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    let backend = network.join("both");
    let mut server = backend.server(&address).expect("a server");
    let mut client = network.client(&*backend, &address);
    let begin = Instant::now();
    start(&mut *client, 1, LIMIT).expect("to be started");
    start(&mut *client, 2, SHORT).expect("to be started");
    assert_eq!(next(&mut *client), (2, Err(deadline())));
    assert!(begin.elapsed() >= SHORT, "{:?}", begin.elapsed());
    start(&mut *client, 3, LIMIT).expect("to be started");
    serve(&mut *server, 3, &echo);
    assert_eq!(next(&mut *client), (1, Ok(vec![1, b'!'])));
    assert_eq!(next(&mut *client), (3, Ok(vec![3, b'!'])));
    assert_nothing_left(&mut *client);
}

/// The server replies to more calls that have ended than a client has at a time. Then every call gets
/// its reply, also if its client looks for it late.
pub fn late_replies_take_no_place_of_others(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    let backend = network.join("both");
    let mut server = backend.server(&address).expect("a server");
    let mut clients: Vec<_> = (0..16)
        .map(|_| network.client(&*backend, &address))
        .collect();
    let most = STARTED_CALLS as u64;
    for round in 0..3 {
        let all = round * most..(round + 1) * most;
        for client in &mut clients {
            for sequence in all.clone() {
                start(&mut **client, sequence, SHORT).expect("to be started");
            }
        }
        for client in &mut clients {
            for _ in all.clone() {
                assert_eq!(next(&mut **client).1, Err(deadline()));
            }
        }
        serve(&mut *server, clients.len() * STARTED_CALLS, &echo);
    }
    for client in &mut clients {
        for sequence in 100..100 + 2 * REQUEST_QUEUE as u64 {
            start(&mut **client, sequence, LIMIT).expect("to be started");
            serve(&mut *server, 1, &echo);
            let expected = (sequence, Ok(vec![sequence as u8, b'!']));
            assert_eq!(next(&mut **client), expected);
        }
    }
}

/// Before there was a server, and after it has left.
pub fn without_a_server_no_call_is_started(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    let backend = network.join("client");
    let mut client = backend.client(&address).expect("a client");
    let none = Err(CallError::NoServer(ADDRESS.to_owned()));
    assert_eq!(start(&mut *client, 1, LIMIT), none);
    assert_nothing_left(&mut *client);
    network.serving(&address, echo, || {
        until("the server is seen", || client.peers() == 1);
        start(&mut *client, 2, LIMIT).expect("to be started");
        assert_eq!(next(&mut *client), (2, Ok(vec![2, b'!'])));
    });
    until("the server has left", || client.peers() == 0);
    assert_eq!(start(&mut *client, 3, LIMIT), none);
    assert_nothing_left(&mut *client);
}

/// Its replies count; calls without one end long before their limits, also where the next server
/// is there already.
pub fn a_closing_server_ends_started_calls(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    let backend = network.join("client");
    let mut client = backend.client(&address).expect("a client");
    let serving = network.join("server");
    let mut server = serving.server(&address).expect("a server");
    until("the server is seen", || client.peers() == 1);
    for sequence in 1..=3 {
        start(&mut *client, sequence, LIMIT).expect("to be started");
    }
    serve(&mut *server, 1, &echo);
    serving.linger(LIMIT);
    drop(server);
    let begin = Instant::now();
    assert_eq!(next(&mut *client), (1, Ok(vec![1, b'!'])));
    let died = || Err(CallError::ServerDied(ADDRESS.to_owned()));
    assert_eq!(next(&mut *client), (2, died()));
    network.serving(&address, echo, || {
        until("the next server is seen", || client.peers() == 1);
        start(&mut *client, 4, LIMIT).expect("to be started");
        assert_eq!(next(&mut *client), (3, died()));
        assert_eq!(next(&mut *client), (4, Ok(vec![4, b'!'])));
        assert_nothing_left(&mut *client);
    });
    assert!(begin.elapsed() < LIMIT / 2, "{:?}", begin.elapsed());
}

/// Neither its reply nor its deadline ends it.
pub fn a_forgotten_call_does_not_end(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    let backend = network.join("both");
    let mut server = backend.server(&address).expect("a server");
    let mut client = network.client(&*backend, &address);
    for (sequence, limit) in [(1, LIMIT), (2, SHORT), (3, LIMIT)] {
        start(&mut *client, sequence, limit).expect("to be started");
    }
    client.forget(1);
    client.forget(2);
    client.forget(7);
    serve(&mut *server, 3, &echo);
    assert_eq!(next(&mut *client), (3, Ok(vec![3, b'!'])));
    assert_nothing_left(&mut *client);
    start(&mut *client, 4, SHORT).expect("to be started");
    assert_eq!(next(&mut *client), (4, Err(deadline())));
    assert_nothing_left(&mut *client);
}

/// Started calls, commands and calls that wait share one queue. A reply that comes while another
/// call waits is kept.
pub fn started_calls_keep_their_order_with_others(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    let served = Mutex::new(Vec::new());
    let record = |header: Header, request: &[u8], reply: &mut Vec<u8>| {
        served.lock().expect("a record").push(request.to_vec());
        echo(header, request, reply);
    };
    network.serving(&address, record, || {
        let backend = network.join("client");
        let mut client = network.client(&*backend, &address);
        for sequence in (0..60).step_by(3) {
            start(&mut *client, sequence, LIMIT).expect("to be started");
            let command = header(sequence + 1);
            client
                .send(command, &[sequence as u8 + 1])
                .expect("to be sent");
            let last = sequence as u8 + 2;
            assert_eq!(ask(&mut *client, &[last]), [last, b'!']);
            assert_eq!(
                next(&mut *client),
                (sequence, Ok(vec![sequence as u8, b'!']))
            );
        }
        assert_nothing_left(&mut *client);
    });
    let expected: Vec<_> = (0..60).map(|number| vec![number]).collect();
    assert_eq!(served.into_inner().expect("a record"), expected);
}

/// Calls end, and none is started any more.
pub fn a_stop_ends_started_calls(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint(ADDRESS);
    let environment = network.environment("client");
    let (go, may_go) = channel::<()>();
    let may_go = Mutex::new(may_go);
    let held = |header: Header, request: &[u8], reply: &mut Vec<u8>| {
        let _ = may_go.lock().map(|may_go| may_go.recv());
        echo(header, request, reply);
    };
    network.serving(&address, held, || {
        let backend = network.join_as(&environment);
        let mut client = network.client(&*backend, &address);
        start(&mut *client, 1, LIMIT).expect("to be started");
        start(&mut *client, 2, LIMIT).expect("to be started");
        assert_eq!(poll(&mut *client), None);
        environment.wake_event.stop();
        assert_eq!(next(&mut *client), (1, Err(CallError::Stopping)));
        assert_eq!(next(&mut *client), (2, Err(CallError::Stopping)));
        assert_eq!(start(&mut *client, 3, LIMIT), Err(CallError::Stopping));
        assert_nothing_left(&mut *client);
        drop(go);
    });
}
