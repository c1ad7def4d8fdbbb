//! A stopped process must not affect others. The tests stop processes as a debugger or Ctrl-Z does,
//! and continue them later.

use crate::processes::{Network, Process};
use rc_conformance::network::{
    LIMIT, StopOnDrop, endpoint, header, receive, receive_all, sequences, serve_until, until,
};
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::{CallError, Client, Gaps, WakeEvent, wait};
use rustix::process::Signal;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// A deadline that the tests let expire.
const SHORT: Duration = Duration::from_millis(100);
/// The sequence number of the last sample.
const LAST: u64 = 500;

/// Runs a role of these tests.
pub(crate) fn play(role: &str, network: &Network) {
    let backend = network.join(role);
    let (scan, motor) = (endpoint("default/Laser/scan"), endpoint("default/Motor"));
    match role {
        "subscriber" => {
            let mut scan = backend.subscriber(&scan).expect("a subscriber");
            let (mut gaps, mut got, mut lost) = (Gaps::default(), 0, 0);
            println!("ready");
            while got + lost < LAST {
                for (header, _) in receive(&mut *scan, 1) {
                    got += 1;
                    lost += gaps.note(&header);
                }
                println!("got {got} and lost {lost}");
            }
        }
        "publisher" => {
            let mut scan = backend.publisher(&scan).expect("a publisher");
            println!("ready");
            for sequence in 1.. {
                let published = scan.publish(header(sequence), &[1; 500]);
                published.expect("to publish");
                wait(&[], Duration::from_micros(200));
            }
        }
        "server" => {
            let mut server = backend.server(&motor).expect("a server");
            let commands = std::cell::Cell::new(0_u8);
            println!("ready");
            let forever = WakeEvent::new().expect("a wake event");
            serve_until(&mut *server, &forever, &|_, request, reply| {
                if request == b"command" {
                    commands.set(commands.get() + 1);
                } else {
                    reply.push(commands.get());
                    reply.extend_from_slice(request);
                }
            });
        }
        "client" => {
            let mut client = backend.client(&motor).expect("a client");
            println!("ready");
            for number in 0_u32.. {
                let request = number.to_ne_bytes();
                let answered = ask(&mut *client, &request, LIMIT);
                assert_eq!(answered, Ok(request.to_vec()));
                println!("answered");
            }
        }
        other => panic!("no role `{other}`"),
    }
}

fn ask(client: &mut dyn Client, request: &[u8], limit: Duration) -> Result<Vec<u8>, CallError> {
    let mut reply = Vec::new();
    let answered = client.call(header(1), &request, limit, &mut |_, body| {
        body.clone_into(&mut reply);
    });
    answered.map(|()| reply)
}

/// Runs `work` while `process` is stopped. If `work` blocks, continues the process and fails.
fn while_stopped<R>(process: &Process, work: impl FnOnce() -> R) -> R {
    process.stop();
    let (result, held_up) = std::thread::scope(|scope| {
        let (done, is_done) = channel::<()>();
        let watchdog = scope.spawn(move || {
            let held_up = is_done.recv_timeout(LIMIT / 2) == Err(RecvTimeoutError::Timeout);
            process.go_on();
            held_up
        });
        let result = work();
        drop(done);
        (result, watchdog.join().expect("the watchdog"))
    });
    assert!(!held_up, "a process that stands still holds others up");
    result
}

#[test]
fn a_stopped_subscriber_delays_nobody_and_counts_lost_samples() {
    let network = Network::new("ss");
    let backend = network.join("both");
    let scan = endpoint("default/Laser/scan");
    let mut publisher = backend.publisher(&scan).expect("a publisher");
    let mut quick = backend.subscriber(&scan).expect("a subscriber");
    let mut stopped = network.start("stopped subscriber");
    until("both are there", || publisher.peers() == 2);
    publisher
        .publish(header(1), &[1; 1000])
        .expect("to publish");
    stopped.says("got 1 and lost 0");
    receive(&mut *quick, 1);
    while_stopped(&stopped, || {
        for sequence in 2..=LAST {
            // Large samples need new segments from time to time.
            let size = if sequence % 50 == 0 { 100_000 } else { 1000 };
            let published = publisher.publish(header(sequence), &vec![1; size]);
            published.expect("to publish");
            assert_eq!(sequences(&receive_all(&mut *quick)), [sequence]);
        }
    });
    // It still receives the newest ten samples.
    stopped.says("got 11 and lost 489");
}

#[test]
fn calls_to_a_stopped_server_end_at_their_deadline() {
    let network = Network::new("sv");
    let backend = network.join("client");
    let server = network.start("stopped server");
    let motor = endpoint("default/Motor");
    let mut client = backend.client(&motor).expect("a client");
    assert_eq!(ask(&mut *client, b"a", LIMIT), Ok(b"\0a".to_vec()));
    let mut sent = 0;
    for round in 1..=3 {
        while_stopped(&server, || {
            let start = Instant::now();
            let late = ask(&mut *client, b"b", SHORT);
            assert!(matches!(late, Err(CallError::Deadline { .. })), "{late:?}");
            assert!(start.elapsed() >= SHORT, "{:?}", start.elapsed());
            // The queue accepts commands until it is full. Then `send` fails.
            let before = sent;
            let refused = loop {
                match client.send(header(1), b"command") {
                    Ok(()) => sent += 1,
                    Err(error) => break error,
                }
                assert!(sent <= before + 4 * REQUEST_QUEUE, "the queue has no end");
            };
            assert_eq!(refused, CallError::QueueFull("default/Motor".to_owned()));
            assert!(
                sent + 1 >= before + REQUEST_QUEUE,
                "only {sent} of round {round}"
            );
            assert_eq!(ask(&mut *client, b"c", LIMIT), Err(refused));
        });
        until("there is room in the queue", || {
            ask(&mut *client, b"d", LIMIT) != Err(CallError::QueueFull("default/Motor".to_owned()))
        });
        // All accepted commands were handled in order before this call.
        let answered = ask(&mut *client, b"e", LIMIT);
        assert_eq!(answered, Ok(vec![sent as u8, b'e']), "round {round}");
    }
}

#[test]
fn a_stopped_client_does_not_block_the_server() {
    let network = Network::new("sc");
    let stop = WakeEvent::new().expect("a wake event");
    let motor = endpoint("default/Motor");
    std::thread::scope(|scope| {
        let (ready, is_ready) = channel();
        let (network, stop, motor) = (&network, &stop, &motor);
        scope.spawn(move || {
            let backend = network.join("server");
            let mut server = backend.server(motor).expect("a server");
            ready.send(()).expect("a test that waits");
            serve_until(&mut *server, stop, &|_, request, reply| {
                reply.extend_from_slice(request);
            });
        });
        let _stop = StopOnDrop(stop);
        is_ready.recv_timeout(LIMIT).expect("a server");
        let backend = network.join("client");
        let mut client = backend.client(motor).expect("a client");
        let mut stopped = network.start("stopped client");
        // The client stops at a different point of its call in each round.
        for round in 0..30 {
            stopped.says("answered");
            wait(&[], Duration::from_micros(17 * round));
            while_stopped(&stopped, || {
                for _ in 0..20 {
                    assert_eq!(ask(&mut *client, b"here", LIMIT), Ok(b"here".to_vec()));
                }
            });
        }
        // Finally, the stopped client is killed.
        stopped.stop();
        stopped.signal(Signal::KILL);
        assert_eq!(ask(&mut *client, b"here", LIMIT), Ok(b"here".to_vec()));
    });
}

#[test]
fn a_stopped_publisher_harms_nobody() {
    let network = Network::new("sp");
    let backend = network.join("both");
    let scan = endpoint("default/Laser/scan");
    let mut own = backend.publisher(&scan).expect("a publisher");
    let mut subscriber = backend.subscriber(&scan).expect("a subscriber");
    let stopped = network.start("stopped publisher");
    for round in 0..30_u64 {
        receive(&mut *subscriber, 5);
        wait(&[], Duration::from_micros(17 * round));
        while_stopped(&stopped, || {
            receive_all(&mut *subscriber);
            for sequence in 1..=20 {
                own.publish(header(sequence), &[2; 500])
                    .expect("to publish");
                assert_eq!(sequences(&receive(&mut *subscriber, 1)), [sequence]);
            }
            // A late subscriber finds a place, too.
            let mut late = backend.subscriber(&scan).expect("a subscriber");
            own.publish(header(21), &[2; 500]).expect("to publish");
            assert_eq!(sequences(&receive(&mut *late, 1)), [21]);
            assert_eq!(sequences(&receive(&mut *subscriber, 1)), [21]);
        });
    }
}
