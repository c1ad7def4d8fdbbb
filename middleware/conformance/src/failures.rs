//! Calls that fail, and the time until they do.

use crate::Subject;
use crate::calls::{ask, echo};
use crate::network::{LIMIT, Network, StopOnDrop, endpoint, header, serve, serve_until, until};
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::{CallError, Header, WakeEvent, wait};
use rustix::time::{ClockId, clock_gettime};
use std::os::fd::AsFd;
use std::sync::Mutex;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

/// A limit that the test lets expire.
const SHORT: Duration = Duration::from_millis(60);

/// Neither a command nor a query waits for a server.
pub fn without_a_server_a_call_fails_at_once(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let backend = network.join("client");
    let mut client = backend.client(&address).expect("a client");
    let start = Instant::now();
    let nobody = Err(CallError::NoServer("default/Motor".to_owned()));
    assert_eq!(client.send(header(1), b"command"), nobody);
    let mut reply = Vec::new();
    assert_eq!(
        client.call(header(2), b"query", LIMIT, &mut |_, body| body
            .clone_into(&mut reply)),
        nobody
    );
    assert!(start.elapsed() < LIMIT / 10, "{:?}", start.elapsed());
}

/// The server does not serve at first. When it does, each new call gets its own reply.
pub fn an_expired_call_leaves_nothing_behind(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let stop = WakeEvent::new().expect("a wake event");
    std::thread::scope(|scope| {
        let (ready, is_ready) = channel();
        let (go, may_go) = channel();
        let (network, address, stop) = (&network, &address, &stop);
        scope.spawn(move || {
            let backend = network.join("server");
            let mut server = backend.server(address).expect("a server");
            ready.send(()).expect("a test that waits");
            may_go.recv().expect("a test that goes on");
            serve_until(&mut *server, stop, &echo);
        });
        let _stop = StopOnDrop(stop);
        is_ready.recv_timeout(LIMIT).expect("a server");
        let backend = network.join("client");
        let mut client = network.client(&*backend, address);
        let mut reply = Vec::new();
        for request in [b"first", b"other"] {
            let start = Instant::now();
            let result = client.call(header(1), request, SHORT, &mut |_, body| {
                body.clone_into(&mut reply);
            });
            let expected = CallError::Deadline {
                address: "default/Motor".to_owned(),
                limit: SHORT,
            };
            assert_eq!(result, Err(expected));
            assert!(start.elapsed() >= SHORT, "{:?}", start.elapsed());
            assert!(start.elapsed() < LIMIT / 10, "{:?}", start.elapsed());
        }
        go.send(()).expect("a server");
        for request in [b"third", b"forth"] {
            assert_eq!(ask(&mut *client, request)[..5], *request);
        }
    });
}

/// The server replies to the first request after its client has given up, while the second call
/// waits.
pub fn a_late_reply_is_not_taken_for_the_next_one(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let (go, may_go) = channel::<()>();
    let may_go = Mutex::new(may_go);
    let handler = |header: Header, request: &[u8], reply: &mut Vec<u8>| {
        if request == b"slow" {
            let _ = may_go.lock().map(|may_go| may_go.recv());
        }
        echo(header, request, reply);
    };
    network.serving(&address, handler, || {
        let backend = network.join("client");
        let mut client = network.client(&*backend, &address);
        let mut reply = Vec::new();
        let late = client.call(header(1), b"slow", SHORT, &mut |_, body| {
            body.clone_into(&mut reply);
        });
        assert!(matches!(late, Err(CallError::Deadline { .. })), "{late:?}");
        go.send(()).expect("a server");
        assert_eq!(ask(&mut *client, b"second"), b"second!");
        assert_eq!(ask(&mut *client, b"third"), b"third!");
        drop(go);
    });
}

/// The server takes no requests: the client gets an error and is never blocked. Accepted requests
/// are served.
pub fn a_full_queue_is_reported(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let backend = network.join("both");
    let mut server = backend.server(&address).expect("a server");
    let mut client = network.client(&*backend, &address);
    for _ in 0..3 {
        let mut accepted = 0;
        let refused = loop {
            match client.send(header(1), &[accepted as u8]) {
                Ok(()) => accepted += 1,
                Err(error) => break error,
            }
            assert!(accepted <= 4 * REQUEST_QUEUE, "the queue has no end");
        };
        let full = CallError::QueueFull("default/Motor".to_owned());
        assert_eq!(refused, full);
        assert!(accepted >= REQUEST_QUEUE, "only {accepted} were accepted");
        let mut reply = Vec::new();
        let refused = client.call(header(1), b"query", LIMIT, &mut |_, body| {
            body.clone_into(&mut reply);
        });
        assert_eq!(refused, Err(full));
        let served = serve(&mut *server, accepted, &|_, _, _| {});
        let expected: Vec<_> = (0..accepted).map(|number| vec![number as u8]).collect();
        assert_eq!(served, expected);
    }
}

/// A component that stops does not wait for replies. It can still send commands, for example to
/// stop its motors.
pub fn a_stop_ends_a_call(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let environment = network.environment("client");
    std::thread::scope(|scope| {
        let backend = network.join("server");
        let mut server = backend.server(&address).expect("a server");
        let (network, address, own) = (&network, &address, &environment);
        let (ended, end) = channel();
        scope.spawn(move || {
            let backend = network.join_as(own);
            let mut client = network.client(&*backend, address);
            let mut reply = Vec::new();
            let first = client.call(header(1), b"query", LIMIT, &mut |_, body| {
                body.clone_into(&mut reply);
            });
            ended.send(first).expect("a test that waits");
            let second = client.call(header(1), b"query", LIMIT, &mut |_, body| {
                body.clone_into(&mut reply);
            });
            ended.send(second).expect("a test that waits");
            let last = client.send(header(1), b"command");
            ended.send(last).expect("a test that waits");
            backend.linger(LIMIT);
        });
        let start = Instant::now();
        serve(&mut *server, 1, &|_, _, _| {
            // The call waits now, and its reply arrives only after it has ended.
            environment.wake_event.stop();
            let result = end.recv_timeout(LIMIT).expect("a result");
            assert_eq!(result, Err(CallError::Stopping));
        });
        let result = end.recv_timeout(LIMIT).expect("a result");
        assert_eq!(
            result,
            Err(CallError::Stopping),
            "no call is begun any more"
        );
        assert!(start.elapsed() < LIMIT / 2, "{:?}", start.elapsed());
        let last = end.recv_timeout(LIMIT).expect("a result");
        assert_eq!(last, Ok(()));
        assert_eq!(serve(&mut *server, 1, &|_, _, _| {}), [b"command"]);
    });
}

/// Management wakes the event loop while a call waits: the call continues, and the wake-up is not
/// lost.
pub fn a_wake_up_during_a_call_is_not_lost(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    let environment = network.environment("client");
    let woken = |header: Header, request: &[u8], reply: &mut Vec<u8>| {
        environment.wake_event.wake();
        echo(header, request, reply);
    };
    network.serving(&address, woken, || {
        let backend = network.join_as(&environment);
        let mut client = network.client(&*backend, &address);
        for _ in 0..3 {
            assert_eq!(ask(&mut *client, b"query"), b"query!");
        }
    });
    let readable = wait(&[environment.wake_event.as_fd()], Duration::ZERO);
    assert_eq!(readable, 1, "the wake-up is still there");
}

/// A server ends with a request in its queue: the call fails long before its limit.
pub fn a_closing_server_ends_queued_calls(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    std::thread::scope(|scope| {
        let backend = network.join("server");
        let mut server = backend.server(&address).expect("a server");
        let (network, address) = (&network, &address);
        let caller = scope.spawn(move || {
            let backend = network.join("client");
            let mut client = network.client(&*backend, address);
            let mut reply = Vec::new();
            let start = Instant::now();
            let result = client.call(header(1), b"query", LIMIT, &mut |_, body| {
                body.clone_into(&mut reply);
            });
            (result, start.elapsed())
        });
        until("a request is there", || {
            wait(&[server.descriptor()], LIMIT) == 1
        });
        server.acknowledge(true);
        drop(server);
        let (result, elapsed) = caller.join().expect("a caller");
        let died = CallError::ServerDied("default/Motor".to_owned());
        assert_eq!(result, Err(died));
        assert!(elapsed < LIMIT / 2, "{elapsed:?}");
    });
}

/// A server that closes after it has taken a request, and before it handles it, ends the call.
pub fn a_closing_server_ends_accepted_calls(subject: &dyn Subject) {
    let network = Network::new(subject);
    let address = endpoint("default/Motor");
    std::thread::scope(|scope| {
        let backend = network.join("server");
        let mut server = backend.server(&address).expect("a server");
        let (network, address) = (&network, &address);
        let (go, may_go) = channel();
        let caller = scope.spawn(move || {
            let backend = network.join("client");
            let mut client = network.client(&*backend, address);
            client.send(header(1), b"command").expect("to be sent");
            may_go.recv().expect("a test that goes on");
            client.call(header(2), b"query", LIMIT, &mut |_, _| {})
        });
        let mut woken = || {
            until("a request is there", || {
                wait(&[server.descriptor()], LIMIT) == 1
            });
            server.acknowledge(true);
        };
        woken();
        go.send(()).expect("a client");
        woken();
        assert_eq!(serve(&mut *server, 1, &|_, _, _| {}), [b"command"]);
        drop(server);
        let result = caller.join().expect("a caller");
        let died = CallError::ServerDied("default/Motor".to_owned());
        assert_eq!(result, Err(died));
    });
}

/// A client that polls for some time gets its replies, and sleeps when they take longer.
pub fn a_polling_client_sleeps_in_the_end(subject: &dyn Subject) {
    const LONG: Duration = Duration::from_millis(200);
    let network = Network::new(subject);
    let mut address = endpoint("default/Motor");
    address.qos.spin = Duration::from_millis(2);
    let slow = |header: Header, request: &[u8], reply: &mut Vec<u8>| {
        if request == b"slow" {
            wait(&[], LONG);
        }
        echo(header, request, reply);
    };
    network.serving(&address, slow, || {
        let backend = network.join("client");
        let mut client = network.client(&*backend, &address);
        for _ in 0..100 {
            assert_eq!(ask(&mut *client, b"quick"), b"quick!");
        }
        let before = processor_time();
        assert_eq!(ask(&mut *client, b"slow"), b"slow!");
        let used = processor_time().saturating_sub(before);
        assert!(used < LONG / 2, "{used:?}");
    });
}

/// The processor time of this thread.
fn processor_time() -> Duration {
    let used = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(used.tv_sec as u64, used.tv_nsec as u32)
}
