//! The views of replicas after contradictory changes, compared with a plain implementation: all
//! changes, sorted, and the rules written once more without a schema.

use graph_merge::{Conflict, Reason, Record, Replica, Stamp};
use property_graph::schema::{Attribute, Entity, Kind, Port, Relation, Tree};
use property_graph::{Id, Schema, Value};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// How many random histories are compared, unless `RC_GRAPH_HISTORIES` says it.
const HISTORIES: u64 = 15;
const WRITERS: [u64; 5] = [11, 12, 13, 14, 15];

/// The relations: name, entities of the ports, the most edges there, and the port of the children of a tree.
type Row = (
    &'static str,
    [&'static str; 2],
    [Option<u32>; 2],
    Option<usize>,
);
const RELATIONS: [Row; 6] = [
    ("in", ["thing", "thing"], [None, None], Some(0)),
    ("on", ["thing", "thing"], [None, Some(2)], Some(1)),
    ("holds", ["thing", "thing"], [Some(1), Some(1)], None),
    ("near", ["thing", "thing"], [Some(2), Some(3)], None),
    ("said", ["event", "thing"], [Some(2), Some(1)], None),
    ("causes", ["event", "event"], [Some(1), None], None),
];

fn schema() -> Schema {
    let name = Attribute {
        name: "name".to_owned(),
        kind: Kind::Int,
        unit: None,
        range: None,
        optional: true,
        key: true,
        history: None,
        doc: Vec::new(),
    };
    let entity = |kind: &str, parent: Option<&str>, attributes: &[&Attribute]| Entity {
        name: kind.to_owned(),
        parent: parent.map(str::to_owned),
        attributes: attributes.iter().copied().cloned().collect(),
        ..Entity::default()
    };
    let relations = RELATIONS
        .iter()
        .map(|(kind, entities, most, child)| Relation {
            name: (*kind).to_owned(),
            ports: (0..2)
                .map(|at| Port {
                    name: ["first", "second"][at].to_owned(),
                    entity: entities[at].to_owned(),
                    min: 0,
                    max: most[at],
                })
                .collect(),
            tree: child.map(|child| Tree { child, pose: None }),
            promotes: Some("event".to_owned()),
            ..Relation::default()
        });
    Schema {
        entities: vec![
            entity("thing", None, &[&name]),
            entity("cup", Some("thing"), &[&name]),
            entity("event", None, &[]),
        ],
        relations: relations.collect(),
        ..Schema::default()
    }
}

/// An element of the plain implementation.
#[derive(Clone)]
struct Plain {
    stamp: Stamp,
    kind: String,
    ends: Option<[Id; 2]>,
    attributes: BTreeMap<String, Value>,
}

/// The elements that the plain implementation shows, and those that it does not.
#[derive(Debug, Default, PartialEq)]
struct Shown {
    nodes: BTreeMap<Id, (String, BTreeMap<String, Value>)>,
    edges: BTreeMap<Id, (String, Id, Id)>,
    conflicts: Vec<Conflict>,
}

fn living(log: &[Record]) -> BTreeMap<Id, Plain> {
    let mut sorted: Vec<&Record> = log.iter().collect();
    sorted.sort_by_key(|record| record.stamp());
    let mut all: BTreeMap<Id, Plain> = BTreeMap::new();
    let mut removed = BTreeSet::new();
    for record in sorted {
        let (stamp, id) = (record.stamp(), record.of());
        let new = |kind: &str, ends| Plain {
            stamp,
            kind: kind.to_owned(),
            ends,
            attributes: BTreeMap::new(),
        };
        match record {
            Record::Node { kind, .. } => drop(all.insert(id, new(kind, None))),
            Record::Edge { kind, from, to, .. } => {
                all.insert(id, new(kind, Some([*from, *to])));
            }
            Record::Attribute { name, value, .. } => {
                let of = all.get_mut(&id).expect("made before it is changed");
                of.attributes.remove(&**name);
                let value = value.clone().map(|value| (name.to_string(), value));
                of.attributes.extend(value);
            }
            Record::Removed { .. } => drop(removed.insert(id)),
        }
    }
    all.retain(|id, _| !removed.contains(id));
    all
}

fn replay(log: &[Record]) -> Shown {
    let all = living(log);
    let mut shown = Shown::default();
    let mut conflicts: BTreeMap<Id, Reason> = BTreeMap::new();
    // Of nodes with one key, the oldest.
    let mut nodes: Vec<(Stamp, Id)> = Vec::new();
    nodes.extend(
        all.iter()
            .filter(|(_, e)| e.ends.is_none())
            .map(|(id, e)| (e.stamp, *id)),
    );
    nodes.sort_unstable();
    for (_, id) in nodes {
        let own = &all[&id];
        let name = own.attributes.get("name");
        let mut others = shown.nodes.values();
        if name.is_some() && others.any(|(_, attributes)| attributes.get("name") == name) {
            conflicts.insert(id, Reason::Key);
        } else {
            shown
                .nodes
                .insert(id, (own.kind.clone(), own.attributes.clone()));
        }
    }
    // An edge at what was removed, or at such an edge.
    loop {
        let is_lost =
            |id: &Id| !all.contains_key(id) || conflicts.get(id) == Some(&Reason::EndRemoved);
        let lost = all.iter().filter(|(id, element)| {
            !conflicts.contains_key(id) && element.ends.is_some_and(|ends| ends.iter().any(is_lost))
        });
        let lost: Vec<Id> = lost.map(|(id, _)| *id).collect();
        if lost.is_empty() {
            break;
        }
        conflicts.extend(lost.into_iter().map(|id| (id, Reason::EndRemoved)));
    }
    // Edges between nodes, then those at these, and so on: the later ones first.
    let mut waiting: Vec<Id> = all.keys().copied().collect();
    waiting.retain(|id| all[id].ends.is_some() && !conflicts.contains_key(id));
    let mut decided: BTreeSet<Id> = all
        .keys()
        .filter(|id| all[id].ends.is_none())
        .copied()
        .collect();
    while !waiting.is_empty() {
        let is_next = |id: &Id| {
            all[id]
                .ends
                .iter()
                .flatten()
                .all(|end| decided.contains(end))
        };
        let (mut level, rest): (Vec<Id>, Vec<Id>) = waiting.into_iter().partition(is_next);
        assert!(!level.is_empty(), "edges in a circle");
        level.sort_by_key(|id| Reverse(all[id].stamp));
        for id in &level {
            let ends = all[id].ends.expect("an edge");
            let is_shown =
                |end: &Id| shown.nodes.contains_key(end) || shown.edges.contains_key(end);
            if !ends.iter().all(is_shown) {
                continue;
            }
            match refused(&all[id].kind, ends, &shown) {
                Some(reason) => drop(conflicts.insert(*id, reason)),
                None => drop(
                    shown
                        .edges
                        .insert(*id, (all[id].kind.clone(), ends[0], ends[1])),
                ),
            }
        }
        decided.extend(level);
        waiting = rest;
    }
    let conflicts = conflicts.into_iter();
    shown.conflicts = conflicts
        .map(|(id, reason)| Conflict { id, reason })
        .collect();
    shown
}

/// Why an edge does not go together with those that are shown.
fn refused(kind: &str, ends: [Id; 2], shown: &Shown) -> Option<Reason> {
    let (_, _, most, child) = RELATIONS.iter().find(|row| row.0 == kind)?;
    let same = || {
        shown
            .edges
            .values()
            .filter(|edge| edge.0 == kind)
            .map(|edge| [edge.1, edge.2])
    };
    if let Some(child) = *child {
        let parent_of = |node: Id| {
            same()
                .find(|other| other[child] == node)
                .map(|e| e[1 - child])
        };
        if parent_of(ends[child]).is_some() {
            return Some(Reason::SecondParent);
        }
        let above = std::iter::successors(Some(ends[1 - child]), |node| parent_of(*node));
        if above.take(1000).any(|node| node == ends[child]) {
            return Some(Reason::Cycle);
        }
    }
    let is_full = |at: usize| {
        let count = same().filter(|other| other[at] == ends[at]).count();
        most[at].is_some_and(|most| count >= most as usize)
    };
    (is_full(0) || is_full(1)).then_some(Reason::Cardinality)
}

/// One change of a replica, and its records.
fn step(
    replica: &mut Replica,
    known: &BTreeMap<Id, bool>,
    random: &mut fastrand::Rng,
) -> Vec<Record> {
    let before = replica.seen().clone();
    let own = |is_edge: bool| -> Vec<Id> {
        let all = known
            .iter()
            .filter(|(id, edge)| **edge == is_edge && replica.has(**id));
        all.map(|(id, _)| *id).collect()
    };
    let (nodes, edges) = (own(false), own(true));
    let either = [nodes.clone(), edges.clone()].concat();
    let pick = |random: &mut fastrand::Rng, all: &[Id]| all[random.usize(0..all.len())];
    match random.u32(0..20) {
        0..3 => drop(replica.add_node(["thing", "cup"][random.usize(0..2)])),
        3..10 if !nodes.is_empty() => {
            let (from, to) = (pick(random, &nodes), pick(random, &nodes));
            let _ = replica.add_edge(RELATIONS[random.usize(0..4)].0, from, to);
        }
        10..14 if !edges.is_empty() => {
            let (from, to) = (pick(random, &edges), pick(random, &nodes));
            let _ = replica.add_edge("said", from, to);
        }
        14 if !edges.is_empty() => {
            let (from, to) = (pick(random, &edges), pick(random, &edges));
            let _ = replica.add_edge("causes", from, to);
        }
        15..18 if !nodes.is_empty() => {
            let value = (random.u32(0..5) > 0).then(|| Value::Int(random.i64(0..8)));
            let node = pick(random, &nodes);
            assert_eq!(replica.set(node, "name", value), Ok(true));
        }
        18 if !edges.is_empty() => assert_eq!(replica.remove(pick(random, &edges)), Ok(true)),
        19 if nodes.len() > 4 => assert_eq!(replica.remove(pick(random, &either)), Ok(true)),
        _ => {}
    }
    let own = replica.writer();
    let since = before.get(&own).copied().unwrap_or_default();
    let records = replica.delta_since(&before).records.into_iter();
    let is_new = |stamp: Stamp| stamp.writer == own && stamp.sequence > since;
    records.filter(|record| is_new(record.stamp())).collect()
}

fn take(replicas: &mut [Replica], to: usize, from: usize) {
    let delta = replicas[from].delta_since(&replicas[to].seen().clone());
    replicas[to].merge(&delta).expect("a sound delta");
}

#[test]
fn conflicts_are_repaired_as_a_plain_log_says() {
    let schema = schema();
    let mut reasons: BTreeMap<Reason, usize> = BTreeMap::new();
    let mut deep = 0;
    let count = std::env::var("RC_GRAPH_HISTORIES").ok();
    let count = count.and_then(|text| text.parse().ok());
    let count: u64 = count.unwrap_or(HISTORIES);
    for seed in 0..count {
        let mut random = fastrand::Rng::with_seed(seed);
        let replicas = WRITERS.iter().map(|writer| Replica::new(*writer, WRITERS));
        let mut replicas: Vec<Replica> = replicas.collect();
        let mut log: Vec<Record> = Vec::new();
        // All elements, and whether each is an edge.
        let mut known: BTreeMap<Id, bool> = BTreeMap::new();
        for round in 0..4 {
            for _ in 0..60 {
                let at = random.usize(0..5);
                let made = step(&mut replicas[at], &known, &mut random);
                for record in &made {
                    match record {
                        Record::Node { .. } => drop(known.insert(record.of(), false)),
                        Record::Edge { .. } => drop(known.insert(record.of(), true)),
                        _ => {}
                    }
                }
                log.extend(made);
                // In the second half of a round, two replicas hear of nobody.
                let (to, from) = (random.usize(0..5), random.usize(0..5));
                if to != from && (round % 2 == 0 || (to < 3) == (from < 3)) && random.bool() {
                    take(&mut replicas, to, from);
                }
            }
            for (to, from) in (0..2).flat_map(|_| (0..25).map(|at| (at / 5, at % 5))) {
                if to != from {
                    take(&mut replicas, to, from);
                }
            }
            let expected = replay(&log);
            for replica in &replicas {
                assert_eq!(replica.digests(7), replicas[0].digests(7), "seed {seed}");
                let view = replica.view(&schema);
                let edges = view.edges.iter();
                let edges =
                    edges.map(|(id, (kind, from, to, _))| (*id, (kind.clone(), *from, *to)));
                let ours = Shown {
                    nodes: view.nodes.clone(),
                    edges: edges.collect(),
                    conflicts: view.conflicts.clone(),
                };
                assert_eq!(ours, expected, "seed {seed}");
                let graph = view.graph(schema.clone().into(), 1);
                assert!(graph.is_ok(), "seed {seed}: {:?}", graph.err());
            }
            for conflict in &expected.conflicts {
                *reasons.entry(conflict.reason).or_default() += 1;
            }
            deep += expected.edges.values().filter(|e| e.0 == "causes").count();
        }
    }
    assert!(
        reasons.len() == 5 && reasons.values().all(|count| *count > 15),
        "{reasons:?}"
    );
    assert!(deep > 10, "{deep} edges between edges");
}

/// Three virtual hours of five replicas, each with a change in five seconds, of which two are cut off for
/// twenty minutes of each hour. A tenth of the messages is lost.
#[test]
fn tombstones_are_bounded_over_hours_with_partitions() {
    const MOST: usize = 100;
    let replica = |writer: &u64| Replica::new(*writer, WRITERS).with_most_tombstones(MOST);
    let mut replicas: Vec<Replica> = WRITERS.iter().map(replica).collect();
    let mut random = fastrand::Rng::with_seed(5);
    let mut own: Vec<Vec<Id>> = vec![Vec::new(); 5];
    let (mut longest, mut removed) = (0, 0);
    for second in 0..3 * 3600 {
        let parted = (1200..2400).contains(&(second % 3600));
        // Each in its own second.
        for at in (0..5).filter(|at| second % 5 == *at) {
            if own[at].len() < 12 {
                own[at].push(replicas[at].add_node("thing").expect("a stamp"));
            } else {
                let node = own[at].swap_remove(random.usize(0..12));
                removed += usize::from(replicas[at].remove(node).expect("a stamp"));
            }
        }
        if second % 30 == 0 {
            for (to, from) in (0..25).map(|at| (at / 5, at % 5)) {
                let reached = !parted || (to < 3) == (from < 3);
                if to != from && reached && random.u32(0..10) > 0 {
                    take(&mut replicas, to, from);
                }
            }
        }
        let most = replicas.iter().map(Replica::tombstones).max();
        longest = longest.max(most.unwrap_or_default());
    }
    for (to, from) in (0..3).flat_map(|_| (0..25).map(|at| (at / 5, at % 5))) {
        if to != from {
            take(&mut replicas, to, from);
        }
    }
    let left: usize = replicas.iter().map(Replica::tombstones).sum();
    assert!(removed > 5_000, "{removed} removals");
    assert!(
        longest > MOST / 2 && left == 0,
        "{longest} at most, {left} left"
    );
    // One change beyond them, until others tell what they have seen.
    assert!(longest <= 2 * MOST, "{longest} tombstones");
    for replica in &replicas {
        assert_eq!(replica.digests(7), replicas[0].digests(7));
        let there = own.iter().flatten().filter(|id| replica.has(**id));
        assert_eq!(there.count(), own.iter().map(Vec::len).sum::<usize>());
    }
}
