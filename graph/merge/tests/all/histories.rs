//! Random histories of five replicas, over a network that loses, repeats, reorders and parts.

use crate::schema::house;
use graph_merge::{Delta, Record, Replica, Stamp, Vector};
use property_graph::{Id, Value};
use std::collections::{BTreeMap, BTreeSet};

const WRITERS: [u64; 5] = [11, 12, 13, 14, 15];

/// The plain implementation: all changes that anybody made, in the order of their stamps.
fn replay(log: &[Record]) -> BTreeMap<Id, (String, BTreeMap<String, Value>)> {
    let mut sorted: Vec<&Record> = log.iter().collect();
    sorted.sort_by_key(|record| record.stamp());
    let mut living = BTreeMap::new();
    for record in &sorted {
        match record {
            Record::Node { kind, .. } => {
                living.insert(record.of(), (kind.to_string(), BTreeMap::new()));
            }
            Record::Edge { kind, from, to, .. } => {
                let made = format!("{kind} {from:?} {to:?}");
                living.insert(record.of(), (made, BTreeMap::new()));
            }
            Record::Attribute {
                of, name, value, ..
            } => {
                if let Some((_, attributes)) = living.get_mut(of) {
                    match value {
                        Some(value) => attributes.insert(name.to_string(), value.clone()),
                        None => attributes.remove(&**name),
                    };
                }
            }
            Record::Removed { .. } => {}
        }
    }
    for record in sorted {
        if let Record::Removed { of, .. } = record {
            living.remove(of);
        }
    }
    living
}

/// A replica as the plain implementation has it.
fn living(replica: &Replica) -> BTreeMap<Id, (String, BTreeMap<String, Value>)> {
    replay(&replica.delta_since(&Vector::new()).records)
}

fn step(replica: &mut Replica, random: &mut fastrand::Rng) {
    let all = replica.delta_since(&Vector::new()).records;
    let is_there = |record: &&Record| replica.has(record.of());
    let nodes = all.iter().filter(|r| matches!(r, Record::Node { .. }));
    let nodes: Vec<Id> = nodes.filter(is_there).map(Record::of).collect();
    let edges = all.iter().filter(|r| matches!(r, Record::Edge { .. }));
    let edges: Vec<Id> = edges.filter(is_there).map(Record::of).collect();
    let pick = |random: &mut fastrand::Rng, all: &[Id]| all[random.usize(0..all.len())];
    match random.u32(0..10) {
        0..2 => {
            replica.add_node("thing").expect("a stamp");
        }
        2 if !edges.is_empty() && !nodes.is_empty() => {
            // An edge may start at an edge.
            let (from, to) = (pick(random, &edges), pick(random, &nodes));
            replica.add_edge("said", from, to).expect("a stamp");
        }
        3..6 if !nodes.is_empty() => {
            let (from, to) = (pick(random, &nodes), pick(random, &nodes));
            replica
                .add_edge(["in", "holds"][random.usize(0..2)], from, to)
                .expect("a stamp");
        }
        6..8 if !nodes.is_empty() => {
            let node = pick(random, &nodes);
            let name = ["name", "x"][random.usize(0..2)];
            let value = (random.u32(0..4) > 0).then(|| Value::Int(random.i64(0..5)));
            assert_eq!(replica.set(node, name, value), Ok(true));
        }
        8 if !edges.is_empty() => {
            assert_eq!(replica.remove(pick(random, &edges)), Ok(true));
        }
        9 if nodes.len() > 3 => {
            assert_eq!(replica.remove(pick(random, &nodes)), Ok(true));
        }
        _ => {}
    }
}

/// What one step has added.
fn news(replica: &Replica, before: &Vector) -> Delta {
    let delta = replica.delta_since(before);
    let own = replica.writer();
    Delta {
        all_of: None,
        since: [(own, before.get(&own).copied().unwrap_or_default())].into(),
        upto: [(own, replica.seen().get(&own).copied().unwrap_or_default())].into(),
        records: delta
            .records
            .into_iter()
            .filter(|r| r.stamp().writer == own)
            .collect(),
        ..delta
    }
}

#[test]
fn replicas_converge_whatever_the_network_does() {
    let schema = house();
    let (mut conflicts, mut dropped) = (0, 0);
    for seed in 0..60 {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut replicas: Vec<Replica> = WRITERS
            .iter()
            .map(|writer| Replica::new(*writer, WRITERS))
            .collect();
        let mut log: Vec<Record> = Vec::new();
        let mut mail: Vec<(usize, Delta)> = Vec::new();
        for round in 0..200 {
            // For a third of the time, two replicas reach nobody.
            let parted = (60..120).contains(&round);
            let at = random.usize(0..5);
            let before = replicas[at].seen().clone();
            step(&mut replicas[at], &mut random);
            let news = news(&replicas[at], &before);
            log.extend(news.records.iter().cloned());
            for other in (0..5).filter(|other| *other != at) {
                let reached = !parted || (at < 3) == (other < 3);
                for _ in 0..random.usize(1..3) {
                    if reached && random.u32(0..20) > 0 {
                        mail.push((other, news.clone()));
                    } else {
                        dropped += 1;
                    }
                }
            }
            while random.bool() && !mail.is_empty() {
                let (to, delta) = mail.swap_remove(random.usize(0..mail.len()));
                replicas[to].merge(&delta).expect("a sound delta");
            }
        }
        // Everybody asks everybody what is missing.
        for _ in 0..2 {
            for to in 0..5 {
                for from in 0..5 {
                    let delta = replicas[from].delta_since(&replicas[to].seen().clone());
                    replicas[to].merge(&delta).expect("a sound delta");
                }
            }
        }
        // Late and repeated messages change nothing.
        for (to, delta) in mail {
            replicas[to].merge(&delta).expect("a sound delta");
        }
        let expected = replay(&log);
        for replica in &replicas {
            assert_eq!(living(replica), expected, "seed {seed}");
            assert_eq!(replica.digests(16), replicas[0].digests(16), "seed {seed}");
            let view = replica.view(&schema);
            assert_eq!(view, replicas[0].view(&schema), "seed {seed}");
            // The view is one that the schema allows.
            let graph = view.graph(schema.clone().into(), 1);
            assert!(graph.is_ok(), "seed {seed}: {:?}", graph.err());
            // Nothing is lost: shown, in conflict, or an edge of a node that is not shown.
            let hidden: BTreeSet<Id> = view.conflicts.iter().map(|c| c.id).collect();
            let shown = view.nodes.keys().chain(view.edges.keys());
            assert!(shown.clone().all(|id| !hidden.contains(id)));
            assert!(shown.chain(&hidden).all(|id| expected.contains_key(id)));
            conflicts += hidden.len();
            // All have seen all, so no tombstone is left.
            assert_eq!(replica.tombstones(), 0, "seed {seed}");
        }
    }
    assert!(
        conflicts > 100 && dropped > 1000,
        "{conflicts} conflicts, {dropped} lost"
    );
}

/// Replicas that nobody announced join, old removals are forgotten early, and ranges are
/// compared before and after all have asked what is missing.
#[test]
fn replicas_converge_by_whole_graphs_and_ranges() {
    let schema = house();
    let (mut wholes, mut forgotten, mut ends) = (0, 0, 0);
    for seed in 0..60 {
        let mut random = fastrand::Rng::with_seed(seed);
        let replica = |writer: &u64| Replica::new(*writer, [11, 12]).with_most_tombstones(4);
        let mut replicas: Vec<Replica> = WRITERS.iter().map(replica).collect();
        let mut log: Vec<Record> = Vec::new();
        let mut mail: Vec<(usize, Delta)> = Vec::new();
        for round in 0..200 {
            let present = if round < 80 { 3 } else { 5 };
            let at = random.usize(0..present);
            let before = replicas[at].seen().clone();
            let had = living(&replicas[at]);
            step(&mut replicas[at], &mut random);
            let delta = replicas[at].delta_since(&before);
            let own = WRITERS[at];
            let is_new = |stamp: Stamp| {
                stamp.writer == own && stamp.sequence > before.get(&own).copied().unwrap_or(0)
            };
            let made = delta.records.iter().filter(|r| is_new(r.stamp()));
            log.extend(made.cloned());
            // The removal itself may be forgotten by now.
            let gone = had.into_keys().filter(|id| !replicas[at].has(*id));
            log.extend(gone.map(|of| Record::Removed {
                stamp: Stamp::default(),
                of,
            }));
            for other in (0..present).filter(|other| *other != at) {
                if random.u32(0..5) > 0 {
                    let news = if delta.all_of.is_some() {
                        delta.clone()
                    } else {
                        news(&replicas[at], &before)
                    };
                    mail.push((other, news));
                }
            }
            while random.bool() && !mail.is_empty() {
                let (to, delta) = mail.swap_remove(random.usize(0..mail.len()));
                wholes += usize::from(delta.all_of.is_some());
                replicas[to].merge(&delta).expect("a sound delta");
            }
            if random.u32(0..20) == 0 {
                let writer = WRITERS[random.usize(0..present)];
                replicas[at].forget(writer);
                forgotten += 1;
            }
        }
        for round in 0..3 {
            for to in 0..5 {
                for from in (0..5).filter(|from| *from != to) {
                    if round == 1 {
                        let delta = replicas[from].delta_since(&replicas[to].seen().clone());
                        replicas[to].merge(&delta).expect("a sound delta");
                        continue;
                    }
                    let (ours, theirs) = (replicas[to].digests(8), replicas[from].digests(8));
                    for range in (0..8).filter(|at| ours[*at] != theirs[*at]) {
                        let delta = replicas[from].range(range, 8);
                        replicas[to].merge(&delta).expect("a sound delta");
                    }
                }
            }
        }
        let expected = replay(&log);
        for replica in &replicas {
            assert_eq!(living(replica), expected, "seed {seed}");
            assert_eq!(replica.digests(8), replicas[0].digests(8), "seed {seed}");
            assert_eq!(
                replica.view(&schema),
                replicas[0].view(&schema),
                "seed {seed}"
            );
            assert!(replica.tombstones() <= 8, "seed {seed}");
            ends += replica.dangling().len();
        }
    }
    assert!(
        wholes > 100 && forgotten > 100 && ends > 100,
        "{wholes} whole graphs, {forgotten} forgotten, {ends} removed ends"
    );
}

#[test]
fn merging_is_commutative_associative_and_idempotent() {
    for seed in 0..50 {
        let mut random = fastrand::Rng::with_seed(seed);
        let mut sources: Vec<Replica> = WRITERS[..3]
            .iter()
            .map(|writer| Replica::new(*writer, WRITERS))
            .collect();
        for _ in 0..60 {
            let at = random.usize(0..3);
            step(&mut sources[at], &mut random);
            if random.u32(0..5) == 0 {
                let other = random.usize(0..3);
                let delta = sources[at].delta_since(&sources[other].seen().clone());
                sources[other].merge(&delta).expect("a sound delta");
            }
        }
        let deltas: Vec<Delta> = sources
            .iter()
            .map(|s| s.delta_since(&Vector::new()))
            .collect();
        let merged = |order: &[usize]| {
            let mut replica = Replica::new(15, WRITERS);
            for at in order {
                replica.merge(&deltas[*at]).expect("a sound delta");
            }
            replica.digests(4)
        };
        let expected = merged(&[0, 1, 2]);
        for order in [
            [2, 1, 0].as_slice(),
            &[1, 0, 2],
            &[0, 0, 1, 2, 1],
            &[2, 0, 1, 2, 0],
        ] {
            assert_eq!(merged(order), expected, "seed {seed}");
        }
        // First two of them together, then the third.
        let mut pair = Replica::new(14, WRITERS);
        pair.merge(&deltas[1]).expect("a sound delta");
        pair.merge(&deltas[2]).expect("a sound delta");
        let mut replica = Replica::new(15, WRITERS);
        replica
            .merge(&pair.delta_since(&Vector::new()))
            .expect("a sound delta");
        replica.merge(&deltas[0]).expect("a sound delta");
        assert_eq!(replica.digests(4), expected, "seed {seed}");
    }
}

#[test]
fn ranges_find_what_differs() {
    let mut a = Replica::new(1, [2]);
    for _ in 0..200 {
        a.add_node("thing").expect("a stamp");
    }
    let mut b = Replica::new(2, [1]);
    b.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    assert_eq!(a.digests(64), b.digests(64));
    let node = a.add_node("thing").expect("a stamp");
    let (ours, theirs) = (a.digests(64), b.digests(64));
    let differing: Vec<usize> = (0..64).filter(|at| ours[*at] != theirs[*at]).collect();
    assert_eq!(differing.len(), 1);
    let range = a.range(differing[0], 64);
    assert!(range.records.len() < 20, "{} records", range.records.len());
    b.merge(&range).expect("a sound delta");
    assert!(b.has(node));
    assert_eq!(a.digests(64), b.digests(64));
}

#[test]
fn conflicts_are_seen_and_end() {
    let schema = house();
    let mut a = Replica::new(1, [2]);
    let (cup, table, shelf) = (
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
        a.add_node("thing").expect("a stamp"),
    );
    let mut b = Replica::new(2, [1]);
    b.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    let on_table = a.add_edge("in", cup, table).expect("a stamp");
    let on_shelf = b.add_edge("in", cup, shelf).expect("a stamp");
    assert_eq!(a.set(table, "name", Some(Value::Int(1))), Ok(true));
    assert_eq!(b.set(shelf, "name", Some(Value::Int(1))), Ok(true));
    a.merge(&b.delta_since(&a.seen().clone()))
        .expect("a sound delta");
    b.merge(&a.delta_since(&b.seen().clone()))
        .expect("a sound delta");
    let view = a.view(&schema);
    assert_eq!(view, b.view(&schema));
    // The shelf loses its key, and its edge with it.
    let ids: Vec<Id> = view.conflicts.iter().map(|conflict| conflict.id).collect();
    assert_eq!(ids, [shelf]);
    assert!(view.edges.contains_key(&on_table));
    // With another name, the shelf is there again, and the later edge wins.
    assert_eq!(b.set(shelf, "name", Some(Value::Int(2))), Ok(true));
    let view = b.view(&schema);
    let ids: Vec<Id> = view.conflicts.iter().map(|conflict| conflict.id).collect();
    assert_eq!(ids, [on_table]);
    assert!(view.edges.contains_key(&on_shelf));
}

/// A message that was delayed until all have forgotten what it adds.
#[test]
fn a_late_message_brings_nothing_back() {
    let mut a = Replica::new(1, 1..=2);
    let mut b = Replica::new(2, 1..=2);
    let node = a.add_node("thing").expect("a stamp");
    b.merge(&a.delta_since(&Vector::new()))
        .expect("a sound delta");
    let late = b.delta_since(&Vector::new());
    assert_eq!(a.remove(node), Ok(true));
    for _ in 0..2 {
        b.merge(&a.delta_since(&b.seen().clone()))
            .expect("a sound delta");
        a.merge(&b.delta_since(&a.seen().clone()))
            .expect("a sound delta");
    }
    assert_eq!((a.tombstones(), b.tombstones()), (0, 0));
    a.merge(&late).expect("a sound delta");
    b.merge(&late).expect("a sound delta");
    assert_eq!((living(&a).len(), living(&b).len()), (0, 0));
}

#[test]
fn tombstones_wait_for_all_and_go() {
    let mut replicas: Vec<Replica> = (1..=3).map(|writer| Replica::new(writer, 1..=3)).collect();
    for round in 0..100 {
        let node = replicas[0].add_node("thing").expect("a stamp");
        let delta = replicas[0].delta_since(&Vector::new());
        replicas[1].merge(&delta).expect("a sound delta");
        assert_eq!(replicas[1].remove(node), Ok(true));
        for (to, from) in [(0, 1), (1, 0)] {
            let delta = replicas[from].delta_since(&replicas[to].seen().clone());
            replicas[to].merge(&delta).expect("a sound delta");
        }
        // The third one has heard of nothing.
        assert_eq!(replicas[0].tombstones(), round + 1);
    }
    for (to, from) in [(2, 0), (0, 2), (1, 2), (0, 1), (2, 1)] {
        let delta = replicas[from].delta_since(&replicas[to].seen().clone());
        replicas[to].merge(&delta).expect("a sound delta");
    }
    let left: Vec<usize> = replicas.iter().map(Replica::tombstones).collect();
    assert_eq!(left, [0, 0, 0]);
    assert!(replicas.iter().all(|replica| living(replica).is_empty()));
}
