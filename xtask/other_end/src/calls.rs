//! Calls in both directions: values of every type, and every error.

use crate::process::OtherEnd;
use crate::values::{LEAST, MOST, SOME, broken, outline, picture, sample, very_broken};
use crate::{LIMIT, LOOK, topics, until};
use interfaces::rc_types::mirror::FailError as MirrorError;
use interfaces::rc_types::types::{self, FailError, TypesClient};
use interfaces::rc_types::{Everything, Gone, Kind, Point};
use interfaces::rc_types::{mirror, repeats};
use rc_middleware::in_place::InPlace;
use rc_middleware::typed::{self, Request, Throws, TypedClient};
use rc_middleware::{Backend, CallError, Header, Reply, Server, wait};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{TryRecvError, channel};
use std::time::Duration;

/// What the mirror does besides throwing the exceptions.
const REFUSES: i32 = 4;
const IS_SLOW: i32 = 5;
/// Milliseconds of a call of `wait` that only the end of the component ends.
const LONG: i32 = 60_000;

/// A client of the slot `Types` of the component.
///
/// # Panics
/// The component is not found.
pub fn client(other: &OtherEnd, backend: &dyn Backend) -> TypesClient {
    let endpoint = other
        .network
        .calls(other.package.slot("Types"), types::OPERATIONS);
    let port = backend.client(&endpoint).expect("a client");
    let mut client = TypesClient::new(TypedClient::new(port, LIMIT));
    // Over ROS 2, a server may be found first and be ready for this client some time later.
    until("the server is found", || {
        client.is_connected() && !matches!(client.wait(0), Err(CallError::NoServer(_)))
    });
    client
}

pub(crate) fn values_are_equal_at_both_ends(other: &OtherEnd) {
    let backend = other.network.join("values");
    let mut client = client(other, &*backend);
    for which in [LEAST, MOST, SOME] {
        let own = sample(which);
        assert_eq!(client.differs(&own).as_deref(), Ok(""));
        assert_eq!(client.make(which).as_ref(), Ok(&own));
        assert_eq!(client.echo(&own), Ok(own));
    }
    let mut large = sample(MOST);
    large.sequences.bytes = vec![7; 1 << 20];
    assert_eq!(client.echo(&large), Ok(large));

    let point = Point { x: 0.5, y: -0.5 };
    for (length, text, point) in [(0, "", None), (3, "Grüße!", Some(point))] {
        let line = outline(length);
        let several = client.several(i32::MIN, text, &line, Kind::Nothing, &point);
        let answer = (i32::MIN, text.to_owned(), line, Kind::Nothing, point);
        assert_eq!(several, Ok(answer));
    }
    let texts = vec!["a".to_owned(), String::new()];
    assert_eq!(client.outputs(), Ok((i64::MIN, texts)));
}

pub(crate) fn errors_reach_the_caller(other: &OtherEnd) {
    let backend = other.network.join("errors");
    let mut client = client(other, &*backend);
    assert_eq!(client.fail(0), Ok(()));
    assert_eq!(client.fail(LEAST), Err(FailError::Broken(broken())));
    let very_broken = FailError::VeryBroken(very_broken());
    assert_eq!(client.fail(MOST), Err(very_broken));
    assert_eq!(client.fail(SOME), Err(FailError::Gone(Gone {})));

    // A result and an argument beyond their range, and an argument beyond its bound.
    assert_eq!(client.ranged(4), Ok(9));
    let answer = client.ranged(5);
    let Err(CallError::Refused(reason)) = &answer else {
        panic!("{answer:?}");
    };
    assert!(reason.contains("ranged()"), "{reason}");
    let answer = client.ranged(10);
    assert!(matches!(answer, Err(CallError::Invalid(_))), "{answer:?}");
    let answer = client.several(0, "too long!", &[], Kind::Wall, &None);
    assert!(matches!(answer, Err(CallError::Invalid(_))), "{answer:?}");

    // A late reply is none to the next question.
    client.set_timeout(Duration::from_millis(50));
    let answer = client.wait(300);
    assert!(
        matches!(answer, Err(CallError::Deadline { .. })),
        "{answer:?}"
    );
    client.set_timeout(LIMIT);
    assert_eq!(client.make(SOME), Ok(sample(SOME)));
}

pub(crate) fn commands_keep_their_order(other: &OtherEnd) {
    let backend = other.network.join("notes");
    let mut client = client(other, &*backend);
    let before = client.noted().expect("numbers").len();
    let mut note = sample(SOME);
    for number in 0..10 {
        note.number = number;
        client.note(&note).expect("a command");
    }
    let noted = client.noted().expect("numbers");
    assert_eq!(noted[before..], (0..10).collect::<Vec<i32>>());
}

pub(crate) fn replies_travel_in_place(other: &OtherEnd) {
    let backend = other.network.join("pictures");
    let mut client = client(other, &*backend);
    for (number, bytes) in [(0, 0), (1, 3), (11, 1 << 16)] {
        let sent = picture(number, bytes);
        let mut turned = sent.clone();
        turned.data.reverse();
        let read = client.turned_in_place(&sent, InPlace::value);
        assert_eq!(read, Ok(Ok(turned.clone())));
        assert_eq!(client.turned(&sent), Ok(turned));
    }
}

/// Serves one request.
fn answer(header: Header, body: &[u8], reply: &mut dyn Reply) {
    let mut request = Request::open(header, body, reply).expect("an envelope");
    if request.operation == mirror::ECHO.id {
        let same = |(all,): (Everything,)| all;
        let _ = request.answer(&mirror::ECHO, typed::read, typed::reply, same);
        return request.close();
    }
    let which = request.arguments(&mirror::FAIL, typed::read);
    let which: (i32,) = which.expect("a number");
    let refuse = |error: MirrorError, request: &mut Request<'_>| error.refuse(request);
    let _ = match which.0 {
        LEAST => refuse(broken().into(), &mut request),
        MOST => refuse(very_broken().into(), &mut request),
        SOME => refuse(Gone {}.into(), &mut request),
        REFUSES => request.fail(&"not today"),
        IS_SLOW => {
            // Longer than the limit of the call.
            std::thread::sleep(Duration::from_millis(300));
            request.reply_with(0, |writer| typed::reply(&(), writer))
        }
        which => panic!("{which} is not a number of the mirror"),
    };
    request.close();
}

/// Serves until `ends`, or until a request waits after it `dies`.
fn serve(server: &mut dyn Server, ends: &AtomicBool, dies: &AtomicBool, idle: &AtomicBool) {
    while !ends.load(Ordering::Relaxed) {
        let woken = wait(&[server.descriptor()], LOOK) != 0;
        if dies.load(Ordering::Relaxed) {
            // A wake-up of an earlier call is over when nothing wakes it.
            if woken && idle.load(Ordering::Relaxed) {
                return;
            }
            idle.fetch_or(!woken, Ordering::Relaxed);
            if !woken {
                // The request that comes now waits.
                continue;
            }
        }
        server.acknowledge(woken);
        while server.serve(&mut answer).expect("to serve") {}
    }
}

/// The component calls this test, and reports the result.
pub(crate) fn calls_are_made(other: &OtherEnd) {
    let backend = other.network.join("asker");
    let mut client = client(other, &*backend);
    let mut mirrored = |number| client.mirrored(number).expect("an answer");
    assert_eq!(mirrored(SOME), "NoServer");
    let [ends, dies, idle] = [(); 3].map(|()| AtomicBool::new(false));
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let backend = other.network.join("mirror");
            let slot = other.package.slot("Mirror");
            let endpoint = other.network.calls(slot, mirror::OPERATIONS);
            let mut server = backend.server(&endpoint).expect("a server");
            serve(&mut *server, &ends, &dies, &idle);
        });
        let _stop = Stop(&ends);
        until("the component finds the mirror", || {
            mirrored(LEAST).is_empty()
        });
        for which in [LEAST, MOST, SOME] {
            assert_eq!(mirrored(which), "");
            assert_eq!(mirrored(-which), "", "an exception");
        }
        let refused = mirrored(-REFUSES);
        assert!(
            refused.starts_with("Refused: ") && refused.contains("not today"),
            "{refused}"
        );
        assert_eq!(mirrored(-IS_SLOW), "Deadline");
        // A late reply is none to the next call.
        assert_eq!(mirrored(MOST), "");
        dies.store(true, Ordering::Relaxed);
        until("the mirror is idle", || idle.load(Ordering::Relaxed));
        assert_eq!(mirrored(MOST), "ServerDied");
    });
    until("the mirror is gone", || mirrored(SOME) == "NoServer");
}

/// Ends the mirror, also after a failed assertion.
struct Stop<'a>(&'a AtomicBool);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

pub(crate) fn a_call_ends_with_its_server(mut other: OtherEnd) {
    let backend = other.network.join("last");
    let mut client = client(&other, &*backend);
    let (sender, met) = channel();
    let killer = std::thread::spawn(move || {
        let backend = other.network.join("watcher");
        // The component publishes the argument of `wait` when a call begins.
        let mut begins = topics::repeats_of(&other, &*backend, &repeats::SEVERAL);
        let mut begun = || topics::take(&mut *begins, LIMIT, repeats::read_several);
        let is_met = begun().is_some();
        sender.send(()).expect("a test that waits");
        let mut more = std::iter::from_fn(begun);
        let is_under_way = more.any(|(milliseconds, ..)| milliseconds == LONG);
        other.kill();
        is_met && is_under_way
    });
    while met.try_recv() == Err(TryRecvError::Empty) {
        assert_eq!(client.wait(0), Ok(()));
    }
    let answer = client.wait(LONG);
    assert_eq!(killer.join().ok(), Some(true));
    assert!(
        matches!(answer, Err(CallError::ServerDied(_))),
        "{answer:?}"
    );
}
