//! Topics.

use crate::Subject;
use crate::network::{
    LIMIT, Network, endpoint, header, keep_last, receive, receive_all, sequences, until,
};
use rc_middleware::now;
use rc_middleware::{Durability, Endpoint, Gaps, Header, OpenError, Qos, TypeIdentity, wait};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::Instant;

/// Sizes at the limits of some middleware, and 8 MiB.
const SIZES: [usize; 15] = [
    0,
    1,
    2,
    15,
    16,
    17,
    255,
    256,
    257,
    4095,
    4097,
    1 << 16,
    1 << 20,
    (1 << 20) + 1,
    8 << 20,
];

/// Bytes that depend on their offset.
pub(crate) fn pattern(length: usize) -> Vec<u8> {
    (0..length)
        .map(|at| (at ^ (at >> 8) ^ (at >> 16)) as u8)
        .collect()
}

fn keeping(endpoint: &Endpoint) -> Endpoint {
    let mut endpoint = endpoint.clone();
    endpoint.qos.durability = Durability::TransientLocal;
    endpoint
}

fn asking(endpoint: &Endpoint) -> Endpoint {
    let mut endpoint = endpoint.clone();
    endpoint.qos = Qos::SUBSCRIBER;
    endpoint
}

/// One publisher, three subscribers in three components.
pub fn a_sample_reaches_every_subscriber(subject: &dyn Subject) {
    let begin = now();
    let network = Network::new(subject);
    let topic = endpoint("default/Laser/scan");
    std::thread::scope(|scope| {
        let (ready, is_ready) = channel();
        let receivers: Vec<_> = (0..3)
            .map(|_| {
                let (network, topic, ready) = (&network, asking(&topic), ready.clone());
                scope.spawn(move || {
                    let backend = network.join("subscriber");
                    let mut subscriber = backend.subscriber(&topic).expect("a subscriber");
                    ready.send(()).expect("a test that waits");
                    network.meet(|| subscriber.peers() == 1);
                    ready.send(()).expect("a test that waits");
                    receive(&mut *subscriber, 5)
                })
            })
            .collect();
        let all_ready = || (0..3).for_each(|_| is_ready.recv_timeout(LIMIT).expect("a subscriber"));
        all_ready();
        let backend = network.join("publisher");
        let mut publisher = backend.publisher(&topic).expect("a publisher");
        network.meet(|| publisher.peers() == 3);
        all_ready();
        let headers: Vec<_> = (1..=5).map(header).collect();
        for header in &headers {
            publisher.publish(*header, b"beam").expect("to publish");
        }
        let senders = publisher.senders();
        for receiver in receivers {
            let values = receiver.join().expect("a receiver");
            let sender = values[0].0.sender;
            assert_ne!(sender, 0, "the backend sets the sender");
            assert!(senders.contains(&sender), "{sender} of {senders:?}");
            for ((came, body), header) in values.iter().zip(&headers) {
                assert_eq!(body, b"beam");
                // A backend converts time stamps of another clock.
                assert!((begin..=now()).contains(&came.sent), "{came:?}");
                let sent = came.sent;
                let expected = Header {
                    sender,
                    sent,
                    ..*header
                };
                assert_eq!(*came, expected);
            }
        }
    });
}

/// In lockstep, a component acknowledges its tick when reliable subscribers have its samples.
pub fn samples_that_have_arrived_are_received_at_once(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Laser/scan");
    let backend = network.join("subscriber");
    let mut subscriber = backend.subscriber(&topic).expect("a subscriber");
    let backend = network.join("publisher");
    let mut publisher = backend.publisher(&topic).expect("a publisher");
    network.meet(|| publisher.peers() == 1 && subscriber.peers() == 1);
    for sequence in 1..=100 {
        let sent = publisher.publish(header(sequence), b"beam");
        sent.expect("to publish");
        assert!(backend.have_arrived(LIMIT), "{sequence}");
        let received = sequences(&receive_all(&mut *subscriber));
        assert_eq!(received, [sequence]);
    }
}

/// Four publishers in four components. The samples of each one keep their order.
pub fn many_publishers_reach_one_subscriber_in_order(subject: &dyn Subject) {
    const EACH: u64 = 25;
    let network = Network::new(subject);
    let topic = keep_last(100, &endpoint("default/Laser/scan"));
    let backend = network.join("subscriber");
    let mut subscriber = backend.subscriber(&topic).expect("a subscriber");
    let all_met = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let (done, all_done) = channel::<()>();
        let all_done = std::sync::Arc::new(std::sync::Mutex::new(all_done));
        for number in 0..4_u8 {
            let (network, topic, all_done) = (&network, &topic, all_done.clone());
            let all_met = &all_met;
            scope.spawn(move || {
                let backend = network.join("publisher");
                let mut publisher = backend.publisher(topic).expect("a publisher");
                network.meet(|| publisher.peers() == 1);
                until("all have met", || all_met.load(Ordering::Relaxed));
                for sequence in 1..=EACH {
                    publisher
                        .publish(header(sequence), &[number])
                        .expect("to publish");
                }
                // The publisher stays until the receiver has all: the receiver drops the sender of
                // this channel.
                let _ = all_done.lock().map(|all_done| all_done.recv());
            });
        }
        network.meet(|| subscriber.peers() == 4);
        all_met.store(true, Ordering::Relaxed);
        let values = receive(&mut *subscriber, 4 * EACH as usize);
        drop(done);
        for number in 0..4_u8 {
            let own: Vec<_> = values
                .iter()
                .filter(|(_, body)| body == &[number])
                .map(|(header, _)| header.sequence)
                .collect();
            assert_eq!(own, (1..=EACH).collect::<Vec<_>>(), "publisher {number}");
        }
        let mut senders: Vec<_> = values.iter().map(|(header, _)| header.sender).collect();
        senders.sort_unstable();
        senders.dedup();
        assert_eq!(senders.len(), 4, "senders are distinguished");
    });
}

/// From no bytes to 8 MiB, up and down.
pub fn samples_of_every_size_arrive(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Camera/image");
    let (camera, viewer) = (network.join("camera"), network.join("viewer"));
    let mut subscriber = viewer.subscriber(&topic).expect("a subscriber");
    let mut publisher = camera.publisher(&topic).expect("a publisher");
    network.meet(|| publisher.peers() == 1 && subscriber.peers() == 1);
    let sizes = SIZES.iter().chain(SIZES.iter().rev()).copied();
    for (size, sequence) in sizes.zip(1..) {
        let sent = (header(sequence), pattern(size));
        publisher.publish(sent.0, &sent.1).expect("to publish");
        let (header, body) = receive(&mut *subscriber, 1).remove(0);
        let came = (header.sequence, &body) == (sent.0.sequence, &sent.1);
        assert!(came, "{size} bytes came back different");
    }
}

/// Publishing without a subscriber.
pub fn publishing_without_a_subscriber_succeeds(subject: &dyn Subject) {
    let network = Network::new(subject);
    let backend = network.join("publisher");
    for topic in [endpoint("a/b/c"), keeping(&endpoint("a/b/d"))] {
        let mut publisher = backend.publisher(&topic).expect("a publisher");
        assert_eq!(publisher.peers(), 0);
        for sequence in 1..100 {
            publisher
                .publish(header(sequence), b"x")
                .expect("to publish");
        }
    }
}

/// Volatile: a late subscriber gets only new samples.
pub fn a_late_subscriber_gets_no_volatile_samples(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Laser/scan");
    let backend = network.join("both");
    let mut publisher = backend.publisher(&topic).expect("a publisher");
    publisher.publish(header(1), b"old").expect("to publish");
    let mut subscriber = backend.subscriber(&asking(&topic)).expect("a subscriber");
    network.meet(|| publisher.peers() == 1 && subscriber.peers() == 1);
    publisher.publish(header(2), b"new").expect("to publish");
    assert_eq!(sequences(&receive(&mut *subscriber, 1)), [2]);
    assert!(receive_all(&mut *subscriber).is_empty());
}

/// Transient local: a late subscriber gets the last samples, up to the depth of the publisher,
/// although it sends no more.
pub fn a_late_subscriber_gets_transient_local_samples(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Map/map");
    let publishing = network.join("publisher");
    let mut publisher = publishing
        .publisher(&keeping(&keep_last(3, &topic)))
        .expect("a publisher");
    for sequence in 1..=5 {
        publisher
            .publish(header(sequence), b"map")
            .expect("to publish");
    }
    let backend = network.join("subscriber");
    let mut late = backend.subscriber(&keeping(&topic)).expect("a subscriber");
    assert_eq!(sequences(&receive(&mut *late, 3)), [3, 4, 5]);
    let mut shallow = backend
        .subscriber(&keeping(&keep_last(1, &topic)))
        .expect("a subscriber");
    // Over a network they arrive one after the other, and the test may read in between.
    let mut newest = 0;
    while newest != 5 {
        let next = sequences(&receive(&mut *shallow, 1))[0];
        assert!((newest + 1..=5).contains(&next), "{next} after {newest}");
        newest = next;
    }
    let mut uninterested = backend.subscriber(&asking(&topic)).expect("a subscriber");
    until("all three are there", || publisher.peers() == 3);
    network.meet(|| uninterested.peers() == 1);
    publisher.publish(header(6), b"map").expect("to publish");
    for subscriber in [&mut late, &mut shallow, &mut uninterested] {
        assert_eq!(sequences(&receive(&mut **subscriber, 1)), [6]);
        assert!(receive_all(&mut **subscriber).is_empty());
    }
}

/// A connected subscriber gets all samples, whether it requested kept ones or not, also next to a
/// volatile publisher.
pub fn a_transient_local_publisher_reaches_all_subscribers(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Map/map");
    let backend = network.join("subscriber");
    let mut volatile = backend.subscriber(&asking(&topic)).expect("a subscriber");
    let mut late = backend.subscriber(&keeping(&topic)).expect("a subscriber");
    let publishing = network.join("publisher");
    let mut ordinary = publishing.publisher(&topic).expect("a publisher");
    let mut keeper = publishing.publisher(&keeping(&topic)).expect("a publisher");
    let both = [b"kept".as_slice(), b"ordinary"];
    let heard = if subject.keeps_or_refuses() { 1 } else { 2 };
    network.meet(|| {
        (
            keeper.peers(),
            ordinary.peers(),
            volatile.peers(),
            late.peers(),
        ) == (2, heard, 2, heard)
    });
    for sequence in 1..=3 {
        keeper
            .publish(header(sequence), b"kept")
            .expect("to publish");
        ordinary
            .publish(header(sequence), b"ordinary")
            .expect("to publish");
    }
    for (subscriber, heard) in [(&mut volatile, &both[..]), (&mut late, &both[..heard])] {
        let values = receive(&mut **subscriber, 3 * heard.len());
        for body in heard {
            let own: Vec<_> = values.iter().filter(|(_, b)| b == *body).collect();
            let own: Vec<_> = own.iter().map(|(header, _)| header.sequence).collect();
            assert_eq!(own, [1, 2, 3]);
        }
        assert_eq!(subscriber.peers(), heard.len());
    }
}

/// A slow subscriber of depth 4 keeps 4 of 100 samples; a fast one next to it gets all.
pub fn a_slow_subscriber_keeps_the_newest_and_delays_nobody(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Laser/scan");
    let backend = network.join("both");
    let mut slow = backend
        .subscriber(&keep_last(4, &asking(&topic)))
        .expect("a subscriber");
    let mut quick = backend.subscriber(&asking(&topic)).expect("a subscriber");
    let mut publisher = backend.publisher(&topic).expect("a publisher");
    network.meet(|| (publisher.peers(), quick.peers(), slow.peers()) == (2, 1, 1));
    let mut got = Vec::new();
    let start = Instant::now();
    for sequence in 1..=100 {
        publisher
            .publish(header(sequence), &[0; 1000])
            .expect("to publish");
        got.extend(sequences(&receive(&mut *quick, 1)));
    }
    assert!(start.elapsed() < LIMIT / 2, "{:?}", start.elapsed());
    assert_eq!(got, (1..=100).collect::<Vec<_>>());
    // The last sample may reach it a moment after the other subscriber.
    let mut kept = sequences(&receive_all(&mut *slow));
    while kept.last() != Some(&100) {
        kept.extend(sequences(&receive(&mut *slow, 1)));
    }
    assert!(
        kept.len() <= 8 && kept.ends_with(&[97, 98, 99, 100]),
        "{kept:?}"
    );
}

/// A receiver counts lost samples for each sender. A late subscriber has lost nothing, and a
/// publisher that comes back starts a new count.
pub fn lost_samples_are_counted(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Laser/scan");
    let backend = network.join("both");
    let mut steady = backend.publisher(&topic).expect("a publisher");
    let lost = |gaps: &mut Gaps, values: &[(Header, Vec<u8>)]| {
        let lost = values.iter().map(|(header, _)| gaps.note(header));
        lost.sum::<u64>()
    };
    steady.publish(header(1), b"before").expect("to publish");
    let asking = asking(&topic);
    let mut subscribers = [(); 2].map(|()| backend.subscriber(&asking).expect("a subscriber"));
    let mut counts = [(); 2].map(|()| Gaps::default());
    for round in 0..3 {
        let mut brief = backend.publisher(&topic).expect("a publisher");
        network.meet(|| {
            let known = subscribers.iter().map(|subscriber| subscriber.peers());
            brief.peers() == 2 && steady.peers() == 2 && known.eq([2, 2])
        });
        for sequence in 1..=20 {
            let next = header(20 * round + sequence + 1);
            steady.publish(next, b"steady").expect("to publish");
            brief
                .publish(header(sequence), b"brief")
                .expect("to publish");
            let values = receive(&mut *subscribers[0], 2);
            let none = lost(&mut counts[0], &values);
            assert_eq!(none, 0, "value {sequence} of round {round}");
        }
        // The other subscriber reads the rest after each round, up to the last sample.
        let mut values = receive_all(&mut *subscribers[1]);
        let last = 20 * round + 21;
        let is_last =
            |(header, body): &(Header, Vec<u8>)| header.sequence == last && body == b"steady";
        while !values.iter().any(is_last) {
            values.extend(receive(&mut *subscribers[1], 1));
        }
        let late = lost(&mut counts[1], &values);
        let kept = values.iter().filter(|(_, body)| body == b"steady").count() as u64;
        assert!(
            (1..20).contains(&kept),
            "{kept} of the steady one were kept"
        );
        // The brief publishers are new in each round, the steady one in the first round.
        let expected = if round == 0 { 0 } else { 20 - kept };
        assert_eq!(late, expected, "round {round}");
        // A subscriber that still counts this publisher would take it for the next one.
        drop(brief);
        network.meet(|| {
            let known = subscribers.iter().map(|subscriber| subscriber.peers());
            known.eq([1, 1])
        });
    }
}

/// A subscriber outlives its publishers, and receives the samples that they sent before they left.
pub fn a_subscriber_outlives_its_publishers(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Laser/scan");
    let backend = network.join("subscriber");
    let mut subscriber = backend.subscriber(&asking(&topic)).expect("a subscriber");
    for round in 1..=3_u8 {
        std::thread::scope(|scope| {
            let (network, topic) = (&network, &topic);
            let (go, may_go) = channel();
            scope.spawn(move || {
                let backend = network.join("publisher");
                let mut publisher = backend.publisher(topic).expect("a publisher");
                until("the subscriber is found", || publisher.peers() == 1);
                may_go.recv_timeout(LIMIT).expect("a subscriber");
                publisher.publish(header(1), &[round]).expect("to publish");
                backend.linger(LIMIT);
            });
            until("the publisher is found", || subscriber.peers() == 1);
            go.send(()).expect("a publisher");
            let (header, body) = receive(&mut *subscriber, 1).remove(0);
            assert_eq!((header.sequence, body), (1, vec![round]));
        });
        until("the publisher is gone", || subscriber.peers() == 0);
    }
}

/// Publishers and subscribers count each other.
pub fn publishers_and_subscribers_are_counted(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Laser/scan");
    let (one, other) = (network.join("one"), network.join("other"));
    let publisher = one.publisher(&topic).expect("a publisher");
    let first = one.subscriber(&asking(&topic)).expect("a subscriber");
    let second = other.subscriber(&asking(&topic)).expect("a subscriber");
    until("both subscribers are seen", || publisher.peers() == 2);
    until("the publisher is seen", || first.peers() == 1);
    drop(first);
    until("one has left", || publisher.peers() == 1);
    drop(publisher);
    until("the publisher has left", || second.peers() == 0);
}

/// The descriptor is not readable, then readable, then not readable again.
pub fn a_sample_wakes_its_subscriber(subject: &dyn Subject) {
    let network = Network::new(subject);
    let topic = endpoint("default/Laser/scan");
    let backend = network.join("both");
    let mut subscriber = backend.subscriber(&asking(&topic)).expect("a subscriber");
    let mut publisher = backend.publisher(&topic).expect("a publisher");
    until("the connection stands", || publisher.peers() == 1);
    network.meet(|| subscriber.peers() == 1);
    subscriber.acknowledge(false);
    let now = std::time::Duration::ZERO;
    assert_eq!(wait(&[subscriber.descriptor()], now), 0, "quiet at first");
    publisher.publish(header(1), b"x").expect("to publish");
    let mut values = Vec::new();
    while values.is_empty() {
        assert_eq!(wait(&[subscriber.descriptor()], LIMIT), 1, "woken");
        subscriber.acknowledge(true);
        let quiet = wait(&[subscriber.descriptor()], now) == 0;
        values = receive_all(&mut *subscriber);
        assert!(quiet && !values.is_empty(), "quiet again, {values:?}");
    }
    assert_eq!(values.len(), 1);
    until("it is quiet again", || {
        subscriber.acknowledge(false);
        wait(&[subscriber.descriptor()], now) == 0
    });
}

/// The error has both types, whichever side opens first.
pub fn topics_of_different_types_refuse_each_other(subject: &dyn Subject) {
    let network = Network::new(subject);
    let (one, other) = (network.join("one"), network.join("other"));
    for (address, first_keeps) in [("a/b/c", false), ("a/b/d", true)] {
        let ours = endpoint(address);
        let mut theirs = ours.clone();
        theirs.types = TypeIdentity {
            hash: 8,
            ..theirs.types
        };
        let first = if first_keeps {
            keeping(&theirs)
        } else {
            theirs.clone()
        };
        let _publisher = one.publisher(&first).expect("a publisher");
        let expected = OpenError::TypeMismatch {
            address: address.to_owned(),
            ours: ours.types.to_string(),
            theirs: theirs.types.to_string(),
        };
        network.meet(|| other.subscriber(&ours).is_err());
        assert_eq!(other.subscriber(&ours).err(), Some(expected.clone()));
        assert_eq!(other.publisher(&ours).err(), Some(expected.clone()));
        assert_eq!(other.publisher(&keeping(&ours)).err(), Some(expected));
    }
}
