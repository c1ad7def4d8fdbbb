//! A replica that knows nothing takes all at once: the result is that of one record after the other.

use crate::schema::house;
use graph_merge::{Delta, Record, Replica, Stamp, Vector};
use property_graph::{Id, Value};

const WRITERS: u64 = 3;
const MOST: u64 = 12;
const OWN: u64 = 50;

fn any_id(random: &mut fastrand::Rng) -> Id {
    Id::new(random.u64(1..=WRITERS), random.u64(1..=MOST))
}

/// Records as no correct replica tells them: in any order, repeated, with one stamp twice, of elements that
/// nobody made, and of removed ones.
fn any_records(random: &mut fastrand::Rng) -> Vec<Record> {
    let mut records = Vec::new();
    for _ in 0..random.usize(0..40) {
        let stamp = Stamp {
            count: random.u64(1..30),
            writer: random.u64(1..=WRITERS),
            sequence: random.u64(1..=MOST),
        };
        let kind = ["thing", "place"][random.usize(0..2)];
        records.push(match random.u32(0..10) {
            0..4 => Record::Node {
                stamp,
                kind: kind.into(),
            },
            4..6 => Record::Edge {
                stamp,
                kind: "in".into(),
                from: any_id(random),
                to: any_id(random),
            },
            6..9 => Record::Attribute {
                stamp,
                of: any_id(random),
                name: ["x", "y", "z"][random.usize(0..3)].into(),
                value: (random.u32(0..4) > 0).then(|| Value::Int(random.i64(0..3))),
            },
            _ => Record::Removed {
                stamp,
                of: any_id(random),
            },
        });
    }
    match random.u32(0..3) {
        // As a replica tells them, or nearly so.
        0 => records.sort_by_key(|record| (record.of(), rank(record))),
        1 => records.sort_by_key(Record::of),
        _ => {}
    }
    records
}

fn rank(record: &Record) -> (u32, String) {
    match record {
        Record::Node { .. } | Record::Edge { .. } => (0, String::new()),
        Record::Removed { .. } => (1, String::new()),
        Record::Attribute { name, .. } => (2, name.to_string()),
    }
}

/// A change of which nothing is left, so that a replica is no longer empty.
fn nothing() -> Delta {
    Delta {
        sender: OWN,
        since: [(99, 0)].into(),
        upto: [(99, 1)].into(),
        ..Delta::default()
    }
}

#[test]
fn what_is_loaded_at_once_is_what_follows_one_by_one() {
    let schema = house();
    let mut loaded = 0;
    for seed in 0..3000 {
        let mut random = fastrand::Rng::with_seed(seed);
        let vector = |random: &mut fastrand::Rng, most: u64| -> Vector {
            let all = (1..=WRITERS).filter_map(|writer| {
                let count = random.u64(0..=most);
                (count > 0).then_some((writer, count))
            });
            all.collect()
        };
        let ranges = [None, Some((0, 1)), Some((1, 3))];
        let delta = Delta {
            sender: 1,
            seen: vector(&mut random, MOST),
            since: vector(&mut random, if seed % 3 == 0 { MOST } else { 0 }),
            upto: vector(&mut random, MOST),
            forgotten: vector(&mut random, 3),
            all_of: ranges[random.usize(0..3)],
            records: any_records(&mut random),
        };
        let (mut once, mut each) = (Replica::new(OWN, []), Replica::new(OWN, []));
        each.merge(&nothing()).expect("no record");
        let take = |replica: &mut Replica| match seed % 2 {
            0 => replica.merge(&delta),
            _ => replica.merge_answer(&delta),
        };
        let touched = (take(&mut once), take(&mut each));
        assert_eq!(touched.0, touched.1, "seed {seed}");
        once.merge(&nothing()).expect("no record");
        let state = |replica: &Replica| {
            (
                replica.delta_since(&Vector::new()),
                replica.digests(4),
                replica.view(&schema),
                [
                    replica.kept(),
                    replica.tombstones(),
                    replica.element_count(),
                ],
                replica.dangling(),
                replica.count(),
            )
        };
        assert_eq!(state(&once), state(&each), "seed {seed}");
        // What follows finds the same, too.
        let more = Delta {
            records: any_records(&mut random),
            ..delta.clone()
        };
        let touched = (once.merge(&more), each.merge(&more));
        assert_eq!(touched.0, touched.1, "seed {seed}");
        assert_eq!(state(&once), state(&each), "seed {seed}");
        loaded += once.element_count();
    }
    assert!(loaded > 1000, "{loaded}");
}
