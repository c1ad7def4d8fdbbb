//! Removals: forgotten safely, and against what others add meanwhile.

use crate::schema::house;
use graph_merge::{
    Conflict, Delta, Error, MOST_TOMBSTONES, Reason, Record, Replica, Stamp, Vector,
};
use property_graph::Id;

/// `to` takes what it lacks of `from`, and tells what it has.
fn sync(to: &mut Replica, from: &mut Replica) {
    to.merge(&from.delta_since(&to.seen().clone()))
        .expect("a sound delta");
    from.acknowledge(to.writer(), &to.seen().clone());
}

/// A third replica has a copy, but none of its messages has arrived: the others do not wait for it.
#[test]
fn who_lacks_a_forgotten_removal_learns_of_it() {
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let (gone, stays) = (
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
    );
    let edge = a.add_edge("in", gone, stays).expect("a stamp");
    sync(&mut b, &mut a);
    let mut late = Replica::new(3, [1, 2]);
    late.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    let own = late.add_node("thing").expect("a stamp");
    let to_gone = late.add_edge("holds", own, gone).expect("a stamp");
    assert_eq!(a.remove(gone), Ok(true));
    sync(&mut b, &mut a);
    sync(&mut a, &mut b);
    assert_eq!((a.tombstones(), b.tombstones()), (0, 0));
    // The delta has no tombstone: what the whole graph does not have was removed.
    let delta = b.delta_since(late.seen());
    assert_eq!(delta.all_of, Some((0, 1)));
    assert!(delta.records.iter().all(|record| record.of() != gone));
    late.merge(&delta).expect("a sound delta");
    assert!(!late.has(gone) && !late.has(edge) && late.has(stays));
    // What it has added itself stays, and so does what it tells a fourth one that has an old copy.
    assert!(late.has(own) && late.has(to_gone));
    sync(&mut a, &mut late);
    sync(&mut b, &mut late);
    assert_eq!(late.digests(8), a.digests(8));
    assert_eq!(late.digests(8), b.digests(8));
    assert_eq!(late.delta_since(&[(1, 3)].into()).all_of, Some((0, 1)));
    // A replica that has seen the removal gets changes only.
    assert_eq!(late.delta_since(&a.seen().clone()).all_of, None);
}

/// A crashed replica keeps nobody's memory, and comes back with what it has changed.
#[test]
fn a_replica_is_forgotten_and_comes_back() {
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let nodes: Vec<Id> = (0..10)
        .map(|_| a.add_node("thing").expect("a stamp"))
        .collect();
    sync(&mut b, &mut a);
    for node in &nodes[..9] {
        assert_eq!(a.remove(*node), Ok(true));
    }
    a.acknowledge(1, &a.seen().clone());
    assert_eq!(a.tombstones(), 9);
    a.forget(2);
    assert_eq!(a.tombstones(), 0);
    let meanwhile = b.add_node("thing").expect("a stamp");
    assert_eq!(b.remove(nodes[8]), Ok(true));
    sync(&mut b, &mut a);
    sync(&mut a, &mut b);
    sync(&mut b, &mut a);
    for replica in [&a, &b] {
        assert!(replica.has(nodes[9]) && replica.has(meanwhile));
        assert!(nodes[..9].iter().all(|node| !replica.has(*node)));
    }
    assert_eq!(a.digests(4), b.digests(4));
    assert_eq!(a.view(&house()), b.view(&house()));
}

/// The memory of removals has a bound, also if another replica never answers.
#[test]
fn old_removals_are_forgotten_beyond_a_bound() {
    let mut a = Replica::new(1, [2]);
    let first = a.add_node("thing").expect("a stamp");
    let mut b = Replica::new(2, [1]);
    b.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    assert_eq!(a.remove(first), Ok(true));
    for _ in 0..MOST_TOMBSTONES + 10 {
        let node = a.add_node("thing").expect("a stamp");
        assert_eq!(a.remove(node), Ok(true));
    }
    assert_eq!(a.tombstones(), MOST_TOMBSTONES);
    b.merge(&a.delta_since(&b.seen().clone()))
        .expect("a sound delta");
    assert!(!b.has(first));
}

#[test]
fn edges_go_with_their_nodes() {
    let mut a = Replica::new(1, []);
    let (cup, table) = (
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
    );
    let on = a.add_edge("in", cup, table).expect("a stamp");
    // An edge may start at an edge.
    let about = a.add_edge("said", on, cup).expect("a stamp");
    let other = a.add_edge("holds", cup, cup).expect("a stamp");
    assert_eq!(a.remove(table), Ok(true));
    assert!(!a.has(on) && !a.has(about) && a.has(other) && a.has(cup));
    assert!(a.dangling().is_empty());
}

#[test]
fn an_edge_to_what_is_removed_meanwhile_is_a_conflict_that_ends() {
    let schema = house();
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let (cup, table) = (
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
    );
    sync(&mut b, &mut a);
    assert_eq!(a.remove(table), Ok(true));
    let edge = b.add_edge("in", cup, table).expect("a stamp");
    // Before anybody knows of the other change, nothing is wrong.
    assert!(b.view(&schema).edges.contains_key(&edge));
    sync(&mut b, &mut a);
    sync(&mut a, &mut b);
    sync(&mut b, &mut a);
    let conflict = Conflict {
        id: edge,
        reason: Reason::EndRemoved,
    };
    for replica in [&a, &b] {
        // Also where the removal itself is forgotten.
        assert_eq!(replica.tombstones(), 0);
        assert_eq!(replica.view(&schema).conflicts, [conflict]);
        assert_eq!(replica.dangling(), [edge]);
    }
    for edge in b.dangling() {
        assert_eq!(b.remove(edge), Ok(true));
    }
    sync(&mut a, &mut b);
    sync(&mut b, &mut a);
    for replica in [&a, &b] {
        assert!(replica.view(&schema).conflicts.is_empty());
        assert!(!replica.has(edge));
        assert_eq!(replica.tombstones(), 0);
    }
}

/// An edge whose end has not arrived yet is not a conflict.
#[test]
fn an_edge_waits_for_its_end() {
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let node = a.add_node("thing").expect("a stamp");
    let before = a.seen().clone();
    let edge = a.add_edge("in", node, node).expect("a stamp");
    b.merge(&a.delta_since(&before)).expect("a sound delta");
    assert!(b.has(edge) && b.view(&house()).conflicts.is_empty());
    b.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    assert!(b.has(node));
    assert!(b.dangling().is_empty());
}

/// Numbers that no replica has made would make others drop all that comes later.
#[test]
fn damaged_deltas_are_refused_and_change_nothing() {
    let mut a = Replica::new(1, [2]);
    let node = a.add_node("thing").expect("a stamp");
    let sound = a.delta_since(&Vector::new());
    let mut b = Replica::new(2, [1]);
    b.add_node("thing").expect("a stamp");
    let before = b.delta_since(&Vector::new());
    let with = |change: &dyn Fn(&mut Delta)| {
        let mut delta = sound.clone();
        change(&mut delta);
        delta
    };
    let node_at = |count, writer, sequence| {
        with(&|delta| {
            delta.records = vec![Record::Node {
                stamp: Stamp {
                    count,
                    writer,
                    sequence,
                },
                kind: "thing".into(),
            }];
        })
    };
    let cases = [
        (with(&|d| d.upto = [(1, u64::MAX)].into()), Error::TooFar(1)),
        (with(&|d| d.seen = [(9, u64::MAX)].into()), Error::TooFar(9)),
        (
            with(&|d| d.forgotten = [(1, u64::MAX)].into()),
            Error::TooFar(1),
        ),
        (with(&|d| d.upto = [(2, 2)].into()), Error::SameWriter(2)),
        (with(&|d| d.seen = [(2, 2)].into()), Error::SameWriter(2)),
        (node_at(u64::MAX, 1, 1), Error::TooFar(1)),
        (node_at(1, 1, u64::MAX), Error::TooFar(1)),
        (node_at(1, 1, 0), Error::NoNumber(1)),
        (node_at(0, 1, 1), Error::NoNumber(1)),
        (node_at(1, 2, 2), Error::SameWriter(2)),
    ];
    for (delta, expected) in cases {
        assert_eq!(b.merge(&delta), Err(expected), "{delta:?}");
        assert_eq!(b.delta_since(&Vector::new()), before);
    }
    b.merge(&sound).expect("a sound delta");
    assert_eq!(b.set(node, "x", Some(1_i64.into())), Ok(true));
    assert_eq!(b.get(node, "x"), Some(&1_i64.into()));
    a.merge(&b.delta_since(&Vector::new()))
        .expect("a sound delta");
    assert_eq!(a.get(node, "x"), Some(&1_i64.into()));
}

/// A restarted process with its former writer takes back what it had changed, and goes on after it.
#[test]
fn a_restarted_replica_keeps_its_writer() {
    let mut a = Replica::new(1, [2]);
    let first = a.add_node("thing").expect("a stamp");
    let mut b = Replica::new(2, [1]);
    sync(&mut b, &mut a);
    let mut again = Replica::new(1, [2]);
    // A part of its changes is not enough.
    let second = a.add_node("thing").expect("a stamp");
    let part = a.delta_since(b.seen());
    assert_eq!(again.merge(&part), Err(Error::SameWriter(1)));
    sync(&mut b, &mut a);
    sync(&mut again, &mut b);
    let third = again.add_node("thing").expect("a stamp");
    assert!(again.has(first) && again.has(second) && third != first && third != second);
}

#[test]
fn ranges_tell_of_forgotten_removals() {
    let mut a = Replica::new(1, []);
    let (gone, stays) = (
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
    );
    let mut late = Replica::new(3, [1]);
    late.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    let before = a.seen().clone();
    let to_gone = late.add_edge("holds", stays, gone).expect("a stamp");
    assert_eq!(a.remove(gone), Ok(true));
    a.acknowledge(1, &before);
    assert_eq!(a.tombstones(), 0);
    let old = late.clone();
    // Two others know only the edge, and only the node.
    let [mut third, mut fourth] = [(4, to_gone), (5, gone)].map(|(writer, known)| {
        let mut replica = Replica::new(writer, [1]);
        let mut delta = late.range(0, 1);
        delta.records.retain(|record| record.of() == known);
        delta.upto.clear();
        replica.merge(&delta).expect("a sound delta");
        replica
    });
    a.merge(&late.delta_since(&before)).expect("a sound delta");
    for replica in [&mut late, &mut third, &mut fourth] {
        assert_ne!(replica.digests(8), a.digests(8));
        for range in 0..8 {
            replica.merge(&a.range(range, 8)).expect("a sound delta");
        }
        // A replica without the removal does not bring it back.
        for range in 0..8 {
            replica.merge(&old.range(range, 8)).expect("a sound delta");
        }
        assert!(!replica.has(gone) && replica.has(stays));
        assert_eq!(replica.digests(8), a.digests(8));
        assert_eq!(replica.view(&house()), a.view(&house()));
        assert_eq!(replica.dangling(), [to_gone]);
    }
}

/// Equal elements are not enough: whether the end of an edge was removed is part of the digest.
#[test]
fn digests_differ_if_one_knows_of_a_removed_end() {
    let mut a = Replica::new(1, []);
    let (from, to) = (
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
    );
    let mut b = Replica::new(2, [1]);
    b.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    let edge = b.add_edge("holds", from, to).expect("a stamp");
    assert_eq!(a.remove(to), Ok(true));
    a.merge(&b.delta_since(a.seen())).expect("a sound delta");
    a.forget(2);
    assert_eq!(a.tombstones(), 0);
    // It has the same elements, but no vector.
    let mut c = Replica::new(3, []);
    let mut delta = a.range(0, 1);
    delta.upto.clear();
    c.merge(&delta).expect("a sound delta");
    assert_eq!(c.range(0, 1).records, a.range(0, 1).records);
    assert!(c.dangling().is_empty() && a.dangling() == [edge]);
    assert_ne!(c.digests(4), a.digests(4));
    for range in 0..4 {
        c.merge(&a.range(range, 4)).expect("a sound delta");
    }
    assert_eq!(c.digests(4), a.digests(4));
    assert_eq!(c.view(&house()), a.view(&house()));
}

/// The bound holds over all writers, and for what arrives before its element.
#[test]
fn the_bound_holds_for_any_removals() {
    let mut a = Replica::new(1, [2, 3, 9]).with_most_tombstones(20);
    let mut b = Replica::new(2, [1, 3, 9]);
    let mut c = Replica::new(3, [1, 2, 9]);
    for replica in [&mut b, &mut c] {
        for _ in 0..30 {
            let node = replica.add_node("thing").expect("a stamp");
            assert_eq!(replica.remove(node), Ok(true));
        }
        a.merge(&replica.delta_since(&Vector::new()))
            .expect("a sound delta");
    }
    assert_eq!(a.tombstones(), 20);
    // What replica 9 has seen needs no place among the twenty.
    a.acknowledge(9, &[(2, 60), (3, 20)].into());
    a.acknowledge(2, &[(2, 60), (3, 60)].into());
    a.acknowledge(3, &[(2, 60), (3, 60)].into());
    assert_eq!(a.tombstones(), 20);
    let unknown = |sequence: u64, is_removal: bool| {
        let stamp = Stamp {
            count: sequence,
            writer: 5,
            sequence: sequence + 1000,
        };
        let of = Id::new(5, sequence);
        if is_removal {
            Record::Removed { stamp, of }
        } else {
            Record::Attribute {
                stamp,
                of,
                name: "x".into(),
                value: None,
            }
        }
    };
    let records = (100..200).map(|sequence| unknown(sequence, sequence % 2 == 0));
    let delta = Delta {
        sender: 5,
        since: [(5, 99)].into(),
        upto: [(5, 1300)].into(),
        records: records.collect(),
        ..Delta::default()
    };
    a.merge(&delta).expect("a sound delta");
    assert!(a.tombstones() <= 20, "{}", a.tombstones());
    assert!(a.range(0, 1).records.len() <= 60);
    // A removal that had no place is not undone by the elements that it had removed.
    let mut d = Replica::new(4, []).with_most_tombstones(0);
    let of = Id::new(5, 100);
    let delta_of = |record: Record| Delta {
        sender: 5,
        records: vec![record],
        ..Delta::default()
    };
    d.merge(&delta_of(unknown(100, true)))
        .expect("a sound delta");
    let made = Record::Node {
        stamp: Stamp {
            count: 1,
            writer: 5,
            sequence: 100,
        },
        kind: "thing".into(),
    };
    d.merge(&delta_of(made)).expect("a sound delta");
    assert!(d.tombstones() == 0 && !d.has(of));
}

/// A message that was sent before its sender was forgotten makes nobody wait again.
#[test]
fn a_late_message_of_a_forgotten_replica_is_no_return() {
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let node = a.add_node("thing").expect("a stamp");
    sync(&mut b, &mut a);
    let late = b.delta_since(&Vector::new());
    a.forget(2);
    a.merge(&late).expect("a sound delta");
    assert_eq!(a.remove(node), Ok(true));
    a.acknowledge(1, &Vector::new());
    assert_eq!(a.tombstones(), 0);
    // With something newer it is back.
    b.add_node("thing").expect("a stamp");
    a.merge(&b.delta_since(a.seen())).expect("a sound delta");
    let node = a.add_node("thing").expect("a stamp");
    assert_eq!(a.remove(node), Ok(true));
    a.acknowledge(1, &Vector::new());
    assert_eq!(a.tombstones(), 1);
}

#[test]
fn an_edge_needs_ends_that_are_not_removed() {
    let mut a = Replica::new(1, []);
    let (cup, table) = (
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
    );
    assert_eq!(a.remove(table), Ok(true));
    let before = a.seen().clone();
    assert_eq!(a.add_edge("in", cup, table), Err(Error::EndRemoved(table)));
    assert_eq!(a.seen(), &before);
    assert!(a.add_edge("in", cup, Id::new(7, 1)).is_ok());
}

/// Two replicas have one writer by mistake: what others show does not depend on who came first.
#[test]
fn two_changes_with_one_stamp_end_the_same_everywhere() {
    let stamp = |sequence| Stamp {
        count: sequence,
        writer: 1,
        sequence,
    };
    let end = |at| Id::new(3, at);
    let records = [
        Record::Edge {
            stamp: stamp(1),
            kind: "in".into(),
            from: end(1),
            to: end(2),
        },
        Record::Edge {
            stamp: stamp(1),
            kind: "in".into(),
            from: end(1),
            to: end(3),
        },
        Record::Attribute {
            stamp: stamp(2),
            of: Id::new(1, 1),
            name: "x".into(),
            value: Some(1_i64.into()),
        },
        Record::Attribute {
            stamp: stamp(2),
            of: Id::new(1, 1),
            name: "x".into(),
            value: Some(2_i64.into()),
        },
    ];
    let ends = |records: &mut dyn Iterator<Item = &Record>| {
        let mut replica = Replica::new(2, []);
        for record in records {
            let delta = Delta {
                sender: 1,
                records: vec![record.clone()],
                ..Delta::default()
            };
            replica.merge(&delta).expect("a sound delta");
        }
        // The end that lost is not an end of the edge.
        let gone = Delta {
            sender: 3,
            since: [(3, 2)].into(),
            upto: [(3, 3)].into(),
            records: vec![Record::Removed {
                stamp: Stamp {
                    count: 4,
                    writer: 3,
                    sequence: 4,
                },
                of: end(3),
            }],
            ..Delta::default()
        };
        replica.merge(&gone).expect("a sound delta");
        assert!(replica.dangling().is_empty());
        replica.digests(4)
    };
    assert_eq!(ends(&mut records.iter()), ends(&mut records.iter().rev()));
}

#[test]
fn an_edge_at_a_dangling_edge_dangles() {
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let (cup, table) = (
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
    );
    sync(&mut b, &mut a);
    assert_eq!(a.remove(table), Ok(true));
    let on = b.add_edge("in", cup, table).expect("a stamp");
    let about = b.add_edge("said", on, cup).expect("a stamp");
    sync(&mut a, &mut b);
    assert_eq!(a.dangling(), [on, about]);
    let conflicts = a.view(&house()).conflicts;
    let reason = Reason::EndRemoved;
    assert_eq!(conflicts, [on, about].map(|id| Conflict { id, reason }));
}
