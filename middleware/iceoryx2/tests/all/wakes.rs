//! Wake-ups with several concurrent notifiers. After a lost wake-up, a message stays in its queue
//! until the receiver polls by itself.
//!
//! iceoryx2 0.10.0 can lose a wake-up if a notifier is interrupted at a certain point while another
//! one notifies (see `notifier.rs`), about once in a million. These tests fail if that happens
//! repeatedly.

use crate::processes::Network;
use rc_conformance::network::{endpoint, header, keep_last};
use rc_middleware::{Backend, Endpoint, Server, Subscriber, wait};
use std::os::fd::BorrowedFd;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

const SENDERS: usize = 3;
/// The number of messages that each sender sends without a pause. Then all wait until everything
/// has arrived.
const BURST: usize = 12;
/// The longest sleep, as in the runtime.
const CYCLE: Duration = Duration::from_millis(50);
/// The time for which bursts are sent.
const RUN: Duration = Duration::from_secs(1);
/// The number of lost wake-ups that fails the test.
const LOST: usize = 2;

/// A receiving endpoint.
trait End {
    fn descriptor(&self) -> BorrowedFd<'_>;
    fn acknowledge(&mut self, woken: bool);
    fn take(&mut self) -> bool;
}

impl End for Box<dyn Subscriber> {
    fn descriptor(&self) -> BorrowedFd<'_> {
        (**self).descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        (**self).acknowledge(woken);
    }

    fn take(&mut self) -> bool {
        self.receive(&mut |_, _| {}).expect("values")
    }
}

impl End for Box<dyn Server> {
    fn descriptor(&self) -> BorrowedFd<'_> {
        (**self).descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        (**self).acknowledge(woken);
    }

    fn take(&mut self) -> bool {
        self.serve(&mut |_, _, _| {}).expect("requests")
    }
}

/// The progress of all senders. They pause when `sent` reaches `wanted`.
#[derive(Default)]
struct Progress {
    wanted: AtomicUsize,
    sent: AtomicUsize,
}

impl Progress {
    /// Sends bursts until `wanted` is `usize::MAX`.
    fn send(&self, mut send: impl FnMut(u64)) {
        let mut burst = 0;
        loop {
            match self.wanted.load(Ordering::SeqCst) {
                usize::MAX => return,
                wanted if wanted > burst * SENDERS * BURST => {
                    for _ in 0..BURST {
                        send(burst as u64);
                        self.sent.fetch_add(1, Ordering::SeqCst);
                    }
                    burst += 1;
                }
                _ => std::thread::yield_now(),
            }
        }
    }

    /// Receives as the runtime does. Returns the number of sleeps, and of sleeps that a lost
    /// wake-up prolonged.
    fn receive(&self, end: &mut dyn End) -> (usize, usize) {
        let (mut taken, mut sleeps, mut lost) = (0, 0, 0);
        let start = Instant::now();
        while start.elapsed() < RUN {
            if taken == self.wanted.load(Ordering::SeqCst) {
                self.wanted.fetch_add(SENDERS * BURST, Ordering::SeqCst);
            }
            let woken = wait(&[end.descriptor()], CYCLE) != 0;
            if !woken {
                // The notification of a slow sender may still follow.
                if self.sent.load(Ordering::SeqCst) < self.wanted.load(Ordering::SeqCst)
                    || wait(&[end.descriptor()], Duration::ZERO) != 0
                {
                    continue;
                }
                lost += 1;
            }
            sleeps += 1;
            taken += std::iter::repeat_with(|| end.take())
                .take_while(|took| *took)
                .count();
            end.acknowledge(woken);
            taken += std::iter::repeat_with(|| end.take())
                .take_while(|took| *took)
                .count();
        }
        self.wanted.store(usize::MAX, Ordering::SeqCst);
        (sleeps, lost)
    }
}

/// Several senders notify one endpoint. Each sender has its own thread and joins the network.
fn wakes<E: End>(
    name: &str,
    receiver: impl Fn(&dyn Backend) -> E,
    sender: impl Fn(&dyn Backend) -> Box<dyn FnMut(u64)> + Sync,
) {
    let network = Network::new(name);
    let backend = network.join("receiver");
    let mut end = receiver(&*backend);
    let progress = Progress::default();
    let (sleeps, lost) = std::thread::scope(|scope| {
        for number in 0..SENDERS {
            let (network, progress, sender) = (&network, &progress, &sender);
            scope.spawn(move || {
                let backend = network.join(&format!("sender{number}"));
                progress.send(sender(&*backend));
            });
        }
        progress.receive(&mut end)
    });
    println!("{name}: {sleeps} sleeps, {lost} wake-ups lost");
    assert!(sleeps > 0, "nothing was sent");
    assert!(lost < LOST, "{lost} of {sleeps} wake-ups were lost");
}

fn scan() -> Endpoint {
    keep_last(BURST as u32, &endpoint("default/Laser/scan"))
}

#[test]
fn a_subscriber_is_woken_by_each_of_many_publishers() {
    wakes(
        "wp",
        |backend| backend.subscriber(&scan()).expect("a subscriber"),
        |backend| {
            let mut port = backend.publisher(&scan()).expect("a publisher");
            Box::new(move |sequence| {
                port.publish(header(sequence), b"value")
                    .expect("to publish");
            })
        },
    );
}

#[test]
fn a_server_is_woken_by_each_of_many_clients() {
    let motor = endpoint("default/Motor");
    wakes(
        "wc",
        |backend| backend.server(&motor).expect("a server"),
        |backend| {
            let mut port = backend.client(&motor).expect("a client");
            Box::new(move |sequence| {
                port.send(header(sequence), b"command").expect("to send");
            })
        },
    );
}
