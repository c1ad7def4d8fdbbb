//! Notes on a scripted clock.

use super::*;
use rc_vocabulary::StampOf;
use std::cell::Cell;

thread_local! {
    static TIME: Cell<u64> = const { Cell::new(0) };
}

fn notes(pairs: Vec<FollowedPair>) -> (HopNotes, Vec<Vec<u32>>) {
    let notes = HopNotes {
        clock: || TIME.get(),
        ..HopNotes::new(Arc::default())
    };
    notes.opened(3, 0, &[77]);
    notes.opened(4, ALL_OPERATIONS, &[78]);
    let senders = notes.shared.follow(pairs);
    (notes, senders)
}

fn end(slot: usize) -> FollowedEnd {
    FollowedEnd {
        slots: vec![slot],
        operation: 0,
        id: 5,
    }
}

fn pair(way: Way) -> FollowedPair {
    FollowedPair {
        input: Some(end(1)),
        output: Some(end(3)),
        way,
        stamp: None,
    }
}

fn header(sequence: u64, sent: u64) -> Header {
    Header {
        sequence,
        sent,
        sender: 7,
        ..Header::default()
    }
}

/// Kind, input, output and times of a note.
fn taken(notes: &HopNotes) -> Vec<(Kind, u32, u32, [u64; 4])> {
    let (hops, overwritten) = notes.shared.take();
    assert_eq!(overwritten, 0);
    let hops = hops.iter();
    hops.map(|hop| {
        let times = [hop.sent, hop.begun, hop.used, hop.left];
        (hop.kind, hop.input, hop.output, times)
    })
    .collect()
}

#[test]
fn a_handler_that_sends_is_one_hop_with_its_four_times() {
    let (notes, senders) = notes(vec![pair(Way::Handler)]);
    assert_eq!(senders, [vec![short(77)]]);
    TIME.set(20);
    notes.sample(1, 0, &header(4, 10), || &[]);
    TIME.set(25);
    notes.published(3, 0, &header(9, 25), || &[]);
    notes.handled();
    assert_eq!(taken(&notes), [(Kind::Sent, 4, 9, [10, 20, 20, 25])]);
    // Other slots and operations are not followed, nor are outputs outside of the handler.
    notes.sample(2, 0, &header(5, 30), || &[]);
    notes.published(3, 0, &header(10, 31), || &[]);
    notes.handled();
    notes.published(3, 1, &header(1, 31), || &[]);
    notes.begin();
    notes.published(3, 0, &header(11, 32), || &[]);
    notes.end(true);
    assert_eq!(taken(&notes), []);
    // A handler that sends nothing ends the message.
    notes.sample(1, 0, &header(5, 30), || &[]);
    TIME.set(40);
    notes.handled();
    assert_eq!(taken(&notes), [(Kind::Ended, 5, 0, [30, 25, 25, 40])]);
    // A proxy sends what it has received with the time at which it was sent first.
    notes.sample(1, 0, &header(6, 30), || &[]);
    TIME.set(46);
    notes.published(3, 0, &header(12, 30), || &[]);
    notes.handled();
    assert_eq!(taken(&notes), [(Kind::Sent, 6, 12, [30, 40, 40, 46])]);
    let begins = FollowedPair {
        input: None,
        ..pair(Way::Any)
    };
    notes.shared.follow(vec![begins]);
    notes.sample(1, 0, &header(7, 30), || &[]);
    TIME.set(50);
    notes.published(3, 0, &header(13, 30), || &[]);
    notes.handled();
    assert_eq!(taken(&notes), [(Kind::Sent, 0, 13, [0, 50, 50, 50])]);
}

#[test]
fn compute_uses_the_newest_message_and_may_use_it_again() {
    let (notes, _) = notes(vec![pair(Way::Compute)]);
    for (number, at) in [(1, 10), (2, 20)] {
        TIME.set(at);
        notes.sample(1, 0, &header(number, at - 5), || &[]);
        notes.handled();
    }
    let compute = |at: u64, sends: Option<u64>| {
        TIME.set(at);
        notes.begin();
        if let Some(number) = sends {
            notes.published(3, 0, &header(number, at + 3), || &[]);
        }
        TIME.set(at + 4);
        notes.end(true);
    };
    compute(30, None);
    compute(40, None);
    compute(50, Some(8));
    compute(60, Some(9));
    let expected = [
        (Kind::Replaced, 1, 0, [5, 10, 10, 20]),
        (Kind::Kept, 2, 0, [15, 20, 20, 34]),
        (Kind::Sent, 2, 8, [15, 20, 50, 53]),
        (Kind::Sent, 2, 9, [15, 20, 60, 63]),
    ];
    assert_eq!(taken(&notes), expected);
    // Outputs of the handler of another message do not result from it.
    notes.sample(1, 0, &header(3, 70), || &[]);
    notes.handled();
    let other = vec![
        pair(Way::Compute),
        FollowedPair {
            input: Some(end(2)),
            ..pair(Way::Handler)
        },
    ];
    notes.shared.follow(other);
    notes.sample(1, 0, &header(3, 70), || &[]);
    notes.handled();
    notes.sample(2, 0, &header(6, 71), || &[]);
    notes.published(3, 0, &header(10, 72), || &[]);
    notes.handled();
    let hops = taken(&notes);
    assert_eq!(hops.iter().map(|hop| hop.1).collect::<Vec<_>>(), [6]);
}

#[test]
fn beginnings_ends_and_calls_are_noted() {
    let source = FollowedPair {
        input: None,
        output: Some(end(4)),
        way: Way::Any,
        stamp: None,
    };
    let sink = FollowedPair {
        output: None,
        ..pair(Way::Handler)
    };
    let (notes, senders) = notes(vec![source, sink]);
    assert_eq!(senders, [vec![short(78)], vec![]]);
    let id = rpc::RequestId {
        writer: [1; 16],
        sequence: 12,
    };
    for operation in [5, 6] {
        let mut writer = rc_middleware::Writer::default();
        rpc::begin_request(&mut writer, id, operation);
        notes.called(4, &header(12, 100), &writer.into_bytes(), || None);
    }
    TIME.set(110);
    notes.sample(1, 0, &header(2, 105), || &[]);
    TIME.set(120);
    notes.handled();
    let expected = [
        (Kind::Sent, 0, 12, [0, 100, 100, 100]),
        (Kind::Ended, 2, 0, [105, 110, 110, 120]),
    ];
    assert_eq!(taken(&notes), expected);
}

#[test]
fn the_ring_keeps_the_newest_and_counts_the_others() {
    let (notes, _) = notes(vec![pair(Way::Handler)]);
    // A second of the fastest sender, of which nothing is taken.
    let many = 100_000;
    for number in 1..=many {
        notes.sample(1, 0, &header(number, 1), || &[]);
        notes.handled();
    }
    let (hops, overwritten) = notes.shared.take();
    assert_eq!((hops.len(), overwritten), (RING, many - RING as u64));
    assert_eq!(hops.back().map(|hop| hop.input), Some(many as u32));
    assert_eq!(notes.shared.take().1, 0);
    // Without a follower, it notes nothing.
    notes.shared.follow(Vec::new());
    notes.sample(1, 0, &header(1, 1), || &[]);
    notes.handled();
    assert!(!notes.is_on() && notes.shared.take().0.is_empty());
}

#[test]
fn notes_wait_for_a_supervisor_that_asks_again_and_not_for_another_request() {
    let pairs = vec![pair(Way::Handler)];
    let (notes, senders) = notes(pairs.clone());
    let handle = |number: u64| {
        notes.sample(1, 0, &header(number, 1), || &[]);
        notes.handled();
    };
    handle(1);
    assert_eq!(notes.shared.follow(pairs), senders);
    handle(2);
    let inputs = |notes: &HopNotes| -> Vec<u32> {
        taken(notes).iter().map(|(_, input, ..)| *input).collect()
    };
    assert_eq!(inputs(&notes), [1, 2]);
    handle(3);
    notes.shared.follow(vec![FollowedPair {
        output: None,
        ..pair(Way::Handler)
    }]);
    handle(4);
    assert_eq!(inputs(&notes), [4]);
}

/// A message is noted with its stamp, as input and as what begins, in place of the time in its header.
#[test]
fn stamps_take_the_place_of_times() {
    let stamp = Some(Stamp {
        before: Vec::new(),
        of: StampOf::Nanoseconds,
    });
    let input = FollowedPair {
        stamp: stamp.clone(),
        ..pair(Way::Handler)
    };
    let output = FollowedPair {
        input: None,
        ..input.clone()
    };
    let (notes, _) = notes(vec![input, pair(Way::Handler), output]);
    let [received, sent] = [70_u64, 71].map(u64::to_le_bytes);
    TIME.set(20);
    notes.sample(1, 0, &header(4, 10), || &received);
    notes.published(3, 0, &header(9, 25), || &sent);
    notes.handled();
    let expected = [
        (Kind::Sent, 4, 9, [70, 20, 20, 25]),
        (Kind::Sent, 4, 9, [10, 20, 20, 25]),
        (Kind::Sent, 0, 9, [71, 25, 25, 25]),
    ];
    assert_eq!(taken(&notes), expected);
}
