//! Alignment of message bodies in shared memory, and memory usage.

use rc_conformance::network::{
    LIMIT, StopOnDrop, endpoint, header, keep_last, receive, serve_until, until,
};
use rc_middleware::qos::STARTED_CALLS;
use rc_middleware::{
    Backend, Encoding, Environment, KEPT_SAMPLES, RunDirectory, Settings, WakeEvent,
};
use std::os::unix::fs::MetadataExt;

/// A network of this process. Dropping it removes its files.
struct Network(RunDirectory, Box<dyn Backend>);

impl Network {
    fn new(name: &str) -> Self {
        let name = format!("{name}-{}", std::process::id());
        let directory = RunDirectory::open(&name).expect("a run directory");
        let backend = join(&directory);
        Self(directory, backend)
    }

    /// The allocated shared memory, in bytes.
    fn used(&self) -> u64 {
        let found = rc_iceoryx2::leftovers(&self.0);
        let sizes = found.iter().filter_map(|path| path.metadata().ok());
        sizes.map(|metadata| metadata.blocks() * 512).sum()
    }
}

fn join(directory: &RunDirectory) -> Box<dyn Backend> {
    let environment = Environment {
        network: "memory".to_owned(),
        instance: "both".to_owned(),
        directory: directory.clone(),
        wake_event: WakeEvent::new().expect("a wake event"),
        settings: Settings::default(),
    };
    rc_iceoryx2::connect(&environment).expect("the network")
}

impl Drop for Network {
    fn drop(&mut self) {
        let wiped = rc_iceoryx2::wipe(&self.0);
        let removed = self.0.remove();
        // A second panic would end the program, and all tests with it.
        if !std::thread::panicking() {
            wiped.expect("to wipe");
            removed.expect("to remove");
        }
    }
}

/// A plain type with an alignment of up to 16 can be read in place.
#[test]
fn bodies_are_aligned() {
    let network = Network::new("al");
    let (backend, at) = (&network.1, endpoint("default/Laser/scan"));
    let mut subscriber = backend.subscriber(&at).expect("a subscriber");
    let mut publisher = backend.publisher(&at).expect("a publisher");
    let mut server = backend.server(&at).expect("a server");
    let mut client = backend.client(&at).expect("a client");
    for size in (1..200).chain([5000, 70_000, 1 << 20]) {
        let body = vec![0; size];
        let aligned = |body: &[u8]| assert_eq!(body.as_ptr().addr() % 16, 0, "{size} bytes");
        publisher.publish(header(1), &body).expect("to publish");
        let received = subscriber.receive(&mut |_, body| aligned(body));
        assert_eq!(received, Ok(true));
        client.send(header(1), &body).expect("to be sent");
        let served = server.serve(&mut |_, body, _| aligned(body));
        assert_eq!(served, Ok(true));
    }
}

/// A sample written in place uses memory only for its written part, and is read at the address at
/// which it was written.
#[test]
fn the_unused_part_of_a_loan_is_not_allocated() {
    const SIZE: usize = 16 << 20;
    const USED: usize = 5000;
    let network = Network::new("in");
    let (backend, at) = (&network.1, endpoint("default/Camera/image"));
    let mut subscribers: Vec<_> = (0..3)
        .map(|_| backend.subscriber(&at).expect("a subscriber"))
        .collect();
    let mut publisher = backend.publisher(&at).expect("a publisher");
    let before = network.used();
    assert!(publisher.can_loan(Encoding::Image));
    for sequence in 1..100 {
        let mut loan = publisher.loan(SIZE).expect("a loan");
        assert_eq!(loan.memory().as_ptr().addr() % 16, 0);
        loan.memory_mut()[..USED].fill(sequence as u8);
        loan.send(header(sequence)).expect("to be sent");
        for subscriber in &mut subscribers {
            let received = subscriber.receive(&mut |_, body| {
                assert_eq!(body.len(), SIZE);
                assert_eq!((body[0], body[USED - 1]), (sequence as u8, sequence as u8));
            });
            assert_eq!(received, Ok(true));
        }
    }
    let used = network.used() - before;
    assert!(
        used < SIZE as u64 / 8,
        "{used} bytes exist of values of {SIZE}, of which {USED} were written"
    );
}

/// Memory is reserved for the worst case and allocated for pending messages only.
#[test]
fn memory_is_allocated_for_pending_messages_only() {
    const MIB: usize = 1 << 20;
    let network = Network::new("me");
    let (backend, at) = (&network.1, endpoint("default/Camera/image"));
    let mut subscriber = backend.subscriber(&at).expect("a subscriber");
    let mut publisher = backend.publisher(&at).expect("a publisher");
    let body = vec![1; MIB];
    for _ in 0..300 {
        publisher.publish(header(1), &body).expect("to publish");
        receive(&mut *subscriber, 1);
    }
    let used = network.used();
    assert!(
        used < 4 * MIB as u64,
        "{used} bytes for values that were read"
    );
    for _ in 0..300 {
        publisher.publish(header(1), &body).expect("to publish");
    }
    let used = network.used();
    assert!(
        used < 16 * MIB as u64,
        "{used} bytes for ten that are unread"
    );
    drop((publisher, subscriber));

    let stop = WakeEvent::new().expect("a wake event");
    let before = network.used();
    std::thread::scope(|scope| {
        let (stop, directory, at) = (&stop, &network.0, &at);
        let mut clients: Vec<_> = (0..16)
            .map(|_| network.1.client(at).expect("a client"))
            .collect();
        scope.spawn(move || {
            let other = join(directory);
            let mut server = other.server(at).expect("a server");
            serve_until(&mut *server, stop, &|_, body, reply| {
                reply.extend_from_slice(body);
            });
        });
        let _stop = StopOnDrop(stop);
        until("the server is there", || clients[0].peers() == 1);
        let mut reply = Vec::new();
        for _ in 0..10 {
            for client in &mut clients {
                let done = client.call(header(1), &&body[..1000], LIMIT, &mut |_, body| {
                    body.clone_into(&mut reply);
                });
                assert_eq!(done, Ok(()));
            }
        }
        let used = network.used() - before;
        assert!(used < 3 * MIB as u64, "{used} bytes for sixteen clients");
    });
}

/// A publisher reserves memory for the newest samples once, not once for each subscriber, and for
/// those that subscribers keep.
#[test]
fn samples_suffice_for_subscribers_that_keep_old_ones_and_others_that_do_not_read() {
    const DEPTH: u32 = 64;
    let network = Network::new("su");
    let (backend, at) = (
        &network.1,
        keep_last(DEPTH, &endpoint("default/Camera/image")),
    );
    let mut publisher = backend.publisher(&at).expect("a publisher");
    let mut subscribers = vec![backend.subscriber(&at).expect("a subscriber")];
    publisher.publish(header(1), &[1]).expect("to publish");
    let used = network.used();
    assert!(used < 512 << 10, "{used} bytes for one connection");
    subscribers.extend((1..64).map(|_| backend.subscriber(&at).expect("a subscriber")));
    let mut kept = Vec::new();
    let mut sequence = 0_u64;
    for subscriber in &mut subscribers {
        // A kept sample is in no buffer afterwards. The samples grow meanwhile.
        for _ in 0..=DEPTH {
            sequence += 1;
            let mut body = sequence.to_le_bytes().to_vec();
            body.resize(8 + sequence as usize, 1);
            let published = publisher.publish(header(sequence), &body);
            published.expect("to publish");
        }
        let first = sequence + 1 - u64::from(DEPTH);
        for at in 0..KEPT_SAMPLES as u64 {
            let received =
                subscriber.receive_kept(&mut |_, sample| kept.push((first + at, sample)));
            assert_eq!(received, Ok(true));
        }
    }
    for _ in 0..10 * DEPTH {
        let published = publisher.publish(header(1), &[2; 5000]);
        published.expect("to publish");
    }
    assert_eq!(kept.len(), 64 * KEPT_SAMPLES);
    for (sequence, sample) in &kept {
        assert_eq!(sample.memory()[..8], sequence.to_le_bytes());
        assert_eq!(sample.memory().len(), 8 + *sequence as usize);
    }
    for subscriber in &mut subscribers {
        assert_eq!(receive(&mut **subscriber, 1)[0].1, [2; 5000]);
    }
}

/// Nobody writes into a kept sample while it lives, whether its subscriber and its publisher do or not.
#[test]
fn a_kept_sample_outlives_its_subscriber() {
    let network = Network::new("ou");
    let (backend, at) = (&network.1, endpoint("default/Camera/image"));
    let mut publisher = backend.publisher(&at).expect("a publisher");
    let mut subscriber = backend.subscriber(&at).expect("a subscriber");
    let mut kept = Vec::new();
    publisher
        .publish(header(1), &[1; 5000])
        .expect("to publish");
    let received = subscriber.receive_kept(&mut |_, sample| kept.push(sample));
    assert_eq!(received, Ok(true));
    drop(subscriber);
    // Somebody who does not read keeps many samples busy, so that all memory is used in turn.
    let _slow = backend.subscriber(&at).expect("a subscriber");
    for sequence in 2..100 {
        let published = publisher.publish(header(sequence), &[2; 5000]);
        published.expect("to publish");
        assert!(kept[0].memory() == [1; 5000], "overwritten");
    }
    drop(publisher);
    assert!(kept[0].memory() == [1; 5000], "overwritten");
    kept.clear();
    let publisher = backend.publisher(&at).expect("a publisher");
    until("the subscriber is gone", || publisher.peers() == 1);
}

/// Clients that receive no replies have a limited number of them. The error names the cause, and calls
/// go on once they receive.
#[test]
fn the_number_of_waiting_replies_is_limited() {
    let network = Network::new("wr");
    let (backend, at) = (&network.1, endpoint("default/Motor"));
    let mut server = backend.server(&at).expect("a server");
    let mut clients: Vec<_> = (0..=192 / STARTED_CALLS)
        .map(|_| backend.client(&at).expect("a client"))
        .collect();
    let mut serve = |count: usize| -> Vec<String> {
        let mut errors = Vec::new();
        let mut served = 0;
        until("the requests are served", || {
            match server.serve(&mut |_, body, reply| reply.body().extend_from_slice(body)) {
                Ok(came) => served += usize::from(came),
                Err(error) => {
                    served += 1;
                    errors.push(error.to_string());
                }
            }
            served == count
        });
        errors
    };
    let count = clients.len() * STARTED_CALLS;
    for client in &mut clients {
        for sequence in 0..STARTED_CALLS as u64 {
            client
                .start(header(sequence), b"?", LIMIT)
                .expect("to start");
        }
    }
    let errors = serve(count);
    assert_eq!(errors.len(), count - 192);
    assert!(
        errors[0].contains("192 replies wait until their clients receive them"),
        "{errors:?}"
    );
    let mut replies = 0;
    for client in &mut clients {
        for _ in 0..STARTED_CALLS {
            until("a call ends", || {
                match client.poll(&mut |_, _, _| replies += 1) {
                    Some((_, ended)) => {
                        if let Err(error) = ended {
                            assert!(error.to_string().contains("sent no reply"), "{error}");
                        }
                        true
                    }
                    None => false,
                }
            });
        }
    }
    assert_eq!(replies, 192);
    clients[0].start(header(9), b"?", LIMIT).expect("to start");
    assert_eq!(serve(1), [""; 0]);
}
