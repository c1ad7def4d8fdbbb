//! Removals: forgotten safely, and against what others add meanwhile.

use crate::schema::house;
use graph_merge::{Conflict, MOST_TOMBSTONES, Reason, Replica, Vector};
use property_graph::Id;

/// `to` takes what it lacks of `from`, and tells what it has.
fn sync(to: &mut Replica, from: &mut Replica) {
    to.merge(&from.delta_since(&to.seen().clone()));
    from.acknowledge(to.writer(), &to.seen().clone());
}

/// A third replica has a copy, but none of its messages has arrived: the others do not wait for it.
#[test]
fn who_lacks_a_forgotten_removal_learns_of_it() {
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let (gone, stays) = (a.add_node("thing"), a.add_node("thing"));
    let edge = a.add_edge("in", gone, stays);
    sync(&mut b, &mut a);
    let mut late = Replica::new(3, [1, 2]);
    late.merge(&a.delta_since(&Vector::new()));
    let own = late.add_node("thing");
    let to_gone = late.add_edge("holds", own, gone);
    assert!(a.remove(gone));
    sync(&mut b, &mut a);
    sync(&mut a, &mut b);
    assert_eq!((a.tombstones(), b.tombstones()), (0, 0));
    // The delta has no tombstone: what the whole graph does not have was removed.
    let delta = b.delta_since(late.seen());
    assert!(delta.is_whole && delta.records.iter().all(|record| record.of() != gone));
    late.merge(&delta);
    assert!(!late.has(gone) && !late.has(edge) && late.has(stays));
    // What it has added itself stays, and so does what it tells a fourth one that has an old copy.
    assert!(late.has(own) && late.has(to_gone));
    sync(&mut a, &mut late);
    sync(&mut b, &mut late);
    assert_eq!(late.digests(8), a.digests(8));
    assert_eq!(late.digests(8), b.digests(8));
    assert!(late.delta_since(&[(1, 3)].into()).is_whole);
    // Who has seen the removal gets changes only.
    assert!(!late.delta_since(&a.seen().clone()).is_whole);
}

/// A crashed replica keeps nobody's memory, and comes back with what it has changed.
#[test]
fn a_replica_is_forgotten_and_comes_back() {
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let nodes: Vec<Id> = (0..10).map(|_| a.add_node("thing")).collect();
    sync(&mut b, &mut a);
    for node in &nodes[..9] {
        assert!(a.remove(*node));
    }
    a.acknowledge(1, &a.seen().clone());
    assert_eq!(a.tombstones(), 9);
    a.forget(2);
    assert_eq!(a.tombstones(), 0);
    let meanwhile = b.add_node("thing");
    assert!(b.remove(nodes[8]));
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
    let first = a.add_node("thing");
    let mut b = Replica::new(2, [1]);
    b.merge(&a.delta_since(&Vector::new()));
    assert!(a.remove(first));
    for _ in 0..MOST_TOMBSTONES + 10 {
        let node = a.add_node("thing");
        assert!(a.remove(node));
    }
    assert_eq!(a.tombstones(), MOST_TOMBSTONES);
    b.merge(&a.delta_since(&b.seen().clone()));
    assert!(!b.has(first));
}

#[test]
fn edges_go_with_their_nodes() {
    let mut a = Replica::new(1, []);
    let (cup, table) = (a.add_node("thing"), a.add_node("thing"));
    let on = a.add_edge("in", cup, table);
    // An edge may start at an edge.
    let about = a.add_edge("said", on, cup);
    let other = a.add_edge("holds", cup, cup);
    assert!(a.remove(table));
    assert!(!a.has(on) && !a.has(about) && a.has(other) && a.has(cup));
    assert!(a.dangling().is_empty());
}

#[test]
fn an_edge_to_what_is_removed_meanwhile_is_a_conflict_that_ends() {
    let schema = house();
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let (cup, table) = (a.add_node("thing"), a.add_node("thing"));
    sync(&mut b, &mut a);
    assert!(a.remove(table));
    let edge = b.add_edge("in", cup, table);
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
        assert!(b.remove(edge));
    }
    sync(&mut a, &mut b);
    sync(&mut b, &mut a);
    for replica in [&a, &b] {
        assert!(replica.view(&schema).conflicts.is_empty());
        assert!(!replica.has(edge));
        assert_eq!(replica.tombstones(), 0);
    }
}

/// An edge whose end has not arrived yet is no conflict.
#[test]
fn an_edge_waits_for_its_end() {
    let mut a = Replica::new(1, [2]);
    let mut b = Replica::new(2, [1]);
    let node = a.add_node("thing");
    let before = a.seen().clone();
    let edge = a.add_edge("in", node, node);
    b.merge(&a.delta_since(&before));
    assert!(b.has(edge) && b.view(&house()).conflicts.is_empty());
    b.merge(&a.delta_since(&Vector::new()));
    assert!(b.has(node));
    assert!(b.dangling().is_empty());
}

/// A count near the end of its range stops nobody.
#[test]
fn the_greatest_count_is_no_end() {
    let mut a = Replica::new(1, [2]);
    let node = a.add_node("thing");
    let mut delta = a.delta_since(&Vector::new());
    if let graph_merge::Record::Node { stamp, .. } = &mut delta.records[0] {
        stamp.count = u64::MAX;
    }
    let mut b = Replica::new(2, [1]);
    b.merge(&delta);
    assert!(b.set(node, "x", Some(1_i64.into())));
    assert!(b.remove(node));
}
