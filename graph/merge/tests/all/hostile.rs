//! Deltas that are well formed and that no replica sends: each is refused with its reason, and changes
//! nothing.

use graph_merge::{Delta, Error, MOST_ELEMENTS, Record, Replica, Stamp};
use property_graph::{Id, Value};
use std::sync::Arc;

/// A replica with a node of its own, and one that it knows of.
fn victim() -> (Replica, [Id; 2]) {
    let (mut a, mut b) = (Replica::new(1, [2]), Replica::new(2, [1]));
    let own = a.add_node("thing").expect("a node");
    a.set(own, "x", Some(1_i64.into())).expect("a value");
    let other = b.add_node("thing").expect("a node");
    a.merge(&b.delta_since(a.seen())).expect("a delta");
    (a, [own, other])
}

fn stamp(count: u64, writer: u64, sequence: u64) -> Stamp {
    Stamp {
        count,
        writer,
        sequence,
    }
}

/// A delta of one record, of writer 2.
fn delta(records: Vec<Record>) -> Delta {
    Delta {
        sender: 2,
        since: [(2, 1)].into(),
        upto: [(2, 2)].into(),
        records,
        ..Delta::default()
    }
}

fn attribute(of: Id, name: &str, value: Value) -> Record {
    Record::Attribute {
        stamp: stamp(9, 2, 2),
        of,
        name: name.into(),
        value: Some(value),
    }
}

#[track_caller]
fn refused(delta: &Delta, expected: Error) {
    let (mut replica, _) = victim();
    let (before, kept, count) = (replica.digests(1), replica.kept(), replica.count());
    assert_eq!(replica.merge(delta), Err(expected));
    assert_eq!(
        (replica.digests(1), replica.kept(), replica.count()),
        (before, kept, count)
    );
    // It goes on.
    replica.add_node("thing").expect("a node");
}

#[test]
fn numbers_that_nobody_counts_to_are_refused() {
    let (_, [own, _]) = victim();
    for number in [1 << 63, (1 << 63) - 1, u64::MAX, (1 << 62) + 1, 1 << 60] {
        let node = |stamp| Record::Node {
            stamp,
            kind: "thing".into(),
        };
        refused(&delta(vec![node(stamp(number, 2, 2))]), Error::TooFar(2));
        refused(&delta(vec![node(stamp(9, 2, number))]), Error::TooFar(2));
        let to = Id::new(7, number);
        let edge = Record::Edge {
            stamp: stamp(9, 2, 2),
            kind: "to".into(),
            from: own,
            to,
        };
        refused(&delta(vec![edge]), Error::TooFar(7));
        let of = Id::new(7, number);
        refused(
            &delta(vec![Record::Removed {
                stamp: stamp(9, 2, 2),
                of,
            }]),
            Error::TooFar(7),
        );
        for vector in 0..3 {
            let mut lie = delta(Vec::new());
            let vector = [&mut lie.upto, &mut lie.seen, &mut lie.forgotten]
                .into_iter()
                .nth(vector);
            vector.expect("a vector").insert(7, number);
            refused(&lie, Error::TooFar(7));
        }
    }
}

/// Many messages, each of which is ahead by as much as one may be, leave numbers for all others.
#[test]
fn no_sequence_of_messages_uses_the_numbers_up() {
    let (mut replica, _) = victim();
    let mut known = 1_u64;
    let mut taken = 0;
    loop {
        let next = known + (1 << 48) - 1;
        let node = Record::Node {
            stamp: stamp(next, 2, next),
            kind: "thing".into(),
        };
        let lie = Delta {
            upto: [(2, next)].into(),
            since: [(2, known)].into(),
            ..delta(vec![node])
        };
        match replica.merge(&lie) {
            Ok(_) => known = next,
            Err(error) => {
                assert_eq!(error, Error::TooFar(2));
                break;
            }
        }
        taken += 1;
        // Few elements: their memory is not what is tested.
        let id = Id::new(2, next);
        assert!(replica.has(id));
    }
    assert!(taken > 10_000 && known <= 1 << 62, "{taken} {known}");
    // A replica that has seen it, too, takes the later changes of this one.
    let mut other = Replica::new(3, [1]);
    let mut vector = replica.seen().clone();
    vector.insert(2, 0);
    let mut upto = 1;
    while upto < known {
        upto = known.min(upto + (1 << 48) - 1);
        let step = Delta {
            since: vector.clone(),
            upto: [(2, upto)].into(),
            ..delta(vec![Record::Removed {
                stamp: stamp(upto, 2, upto),
                of: Id::new(2, 1),
            }])
        };
        other.merge(&step).expect("a number that is not far");
        vector.insert(2, upto);
    }
    for _ in 0..10 {
        let node = replica.add_node("thing").expect("a number");
        other.merge(&replica.delta_since(&vector)).expect("a node");
        assert!(other.has(node));
    }
}

/// What other replicas refuse, no replica makes.
#[test]
fn a_replica_makes_nothing_that_others_refuse() {
    let mut replica = Replica::new(1, []).with_most_elements(3);
    let node = replica.add_node("thing").expect("a node");
    replica.add_edge("to", node, node).expect("an edge");
    replica.add_node("thing").expect("a node");
    let count = replica.count();
    assert_eq!(replica.add_node("thing"), Err(Error::TooManyElements(3)));
    let edge = replica.add_edge("to", node, node);
    assert_eq!(edge, Err(Error::TooManyElements(3)));
    assert_eq!(replica.count(), count);
    for at in 0..4096 {
        let set = replica.set(node, &format!("x{at}"), Some(1_i64.into()));
        assert_eq!(set, Ok(true));
    }
    let refused = Err(Error::TooManyAttributes(4096));
    assert_eq!(replica.set(node, "more", Some(1_i64.into())), refused);
    assert_eq!(replica.set(node, "x7", None), Ok(true));
    // A change is refused whole, also if only its last part is wrong.
    let one = Value::from(1_i64);
    let value = |name: &'static str| (node, name, Some(&one));
    assert_eq!(replica.check_own([], [value("x1"), value("x2")]), Ok(()));
    let check = replica.check_own([], [value("x1"), value("more")]);
    assert_eq!(check, Err(Error::TooManyAttributes(4096)));
    let check = replica.check_own([], [value("x1"), value("a\nb")]);
    assert_eq!(check, Err(Error::Name(1)));
    let check = replica.check_own(["thing"], []);
    assert_eq!(check, Err(Error::TooManyElements(3)));
    let names: Vec<String> = (0..4097).map(|at| format!("x{at}")).collect();
    let of = Id::new(1, 9_000);
    let many = names.iter().map(|name| (of, name.as_str(), Some(&one)));
    let check = replica.check_own([], many);
    assert_eq!(check, Err(Error::TooManyAttributes(4096)));
    let mut other = Replica::new(2, []);
    let all = replica.delta_since(other.seen());
    other.merge(&all).expect("all of it");
}

#[test]
fn names_and_values_that_no_graph_has_are_refused() {
    let (_, [_, other]) = victim();
    let long = "n".repeat(257);
    for name in ["", "a\nb", "\u{1b}[31m", "a\0", "\u{85}", long.as_str()] {
        let kind: Arc<str> = name.into();
        let node = Record::Node {
            stamp: stamp(9, 2, 2),
            kind: Arc::clone(&kind),
        };
        refused(&delta(vec![node]), Error::Name(2));
        let edge = Record::Edge {
            stamp: stamp(9, 2, 2),
            kind,
            from: other,
            to: other,
        };
        refused(&delta(vec![edge]), Error::Name(2));
        refused(
            &delta(vec![attribute(other, name, 1_i64.into())]),
            Error::Name(2),
        );
        let (mut replica, [own, _]) = victim();
        assert_eq!(replica.add_node(name), Err(Error::Name(1)));
        assert_eq!(replica.add_edge(name, own, own), Err(Error::Name(1)));
        assert_eq!(replica.set(own, name, None), Err(Error::Name(1)));
    }
    let values: [Value; 5] = [
        f64::NAN.into(),
        f64::INFINITY.into(),
        [0.0, f64::NEG_INFINITY].into(),
        vec![0_u8; 64 * 1024 + 1].as_slice().into(),
        "x".repeat((1 << 24) + 1).into(),
    ];
    for value in values {
        refused(
            &delta(vec![attribute(other, "x", value.clone())]),
            Error::Value(2),
        );
        let (mut replica, [own, _]) = victim();
        assert_eq!(replica.set(own, "x", Some(value)), Err(Error::Value(1)));
    }
}

/// Another replica may send on what this one has made, but not another version of it.
#[test]
fn nobody_else_says_what_this_writer_has_changed() {
    let (replica, [own, _]) = victim();
    let mut echo = replica.delta_since(&[].into());
    echo.sender = 2;
    let (mut same, _) = victim();
    same.merge(&echo).expect("what it has made");
    assert_eq!(same.digests(1), replica.digests(1));
    let of_first = stamp(1, 1, 1);
    let lies = [
        Record::Node {
            stamp: of_first,
            kind: "place".into(),
        },
        Record::Edge {
            stamp: of_first,
            kind: "thing".into(),
            from: own,
            to: own,
        },
        Record::Node {
            stamp: stamp(7, 1, 1),
            kind: "thing".into(),
        },
        Record::Attribute {
            stamp: stamp(2, 1, 2),
            of: own,
            name: "x".into(),
            value: Some(2_i64.into()),
        },
        Record::Attribute {
            stamp: stamp(2, 1, 2),
            of: own,
            name: "x".into(),
            value: None,
        },
        Record::Node {
            stamp: stamp(3, 1, 3),
            kind: "thing".into(),
        },
    ];
    for lie in lies {
        let lie = Delta {
            upto: [(2, 1)].into(),
            ..delta(vec![lie])
        };
        refused(&lie, Error::SameWriter(1));
    }
}

#[test]
fn more_than_a_replica_keeps_is_refused() {
    let nodes = |count: u64| {
        let node = |at| Record::Node {
            stamp: stamp(at, 2, at),
            kind: "thing".into(),
        };
        Delta {
            upto: [(2, count)].into(),
            ..delta((2..=count).map(node).collect())
        }
    };
    let mut small = victim().0.with_most_elements(1000);
    assert_eq!(small.merge(&nodes(2000)), Err(Error::TooManyElements(1000)));
    assert_eq!(small.kept(), 2);
    small.merge(&nodes(999)).expect("998 nodes");
    assert_eq!(small.kept(), 1000);
    // Its elements may change.
    let more = Delta {
        since: [(2, 999)].into(),
        upto: [(2, 1000)].into(),
        ..delta(vec![attribute(Id::new(2, 5), "x", 1_i64.into())])
    };
    small.merge(&more).expect("an attribute");
    assert_eq!(small.merge(&nodes(1001)), Err(Error::TooManyElements(1000)));
    // Attributes of elements that nobody has made are elements, too.
    let unmade = (0..1000).map(|at| attribute(Id::new(3, at + 1), "x", 1_i64.into()));
    assert_eq!(
        small.merge(&delta(unmade.collect())),
        Err(Error::TooManyElements(1000))
    );
    const { assert!(MOST_ELEMENTS <= 1 << 22) };
    let (_, [_, other]) = victim();
    let many = (0..5000).map(|at| attribute(other, &format!("x{at}"), 1_i64.into()));
    refused(&delta(many.collect()), Error::TooManyAttributes(4096));
    let mut writers = delta(Vec::new());
    writers
        .upto
        .extend((0..20_000).map(|writer| (writer + 100, 1)));
    refused(&writers, Error::TooManyWriters(16_384));
    let (mut replica, _) = victim();
    let sent = (0..20_000).map(|sender| {
        replica.merge(&Delta {
            sender: sender + 100,
            ..Delta::default()
        })
    });
    let refused = sent.filter(|result| *result == Err(Error::TooManyWriters(16_384)));
    assert_eq!(refused.count(), 20_000 - 16_384 + 1);
}
