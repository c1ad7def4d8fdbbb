//! Changes of one replica, and another one that takes them over.

use crate::print;
use graph_merge::Replica;
use std::hint::black_box;
use std::time::Instant;

/// Attributes that are set: ten of each node.
const WRITES: usize = 10_000;

pub(crate) fn measure() {
    let (mut all, mut merge) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..15 {
        let mut first = Replica::new(1, [2]);
        let mut second = Replica::new(2, [1]);
        let nodes = (0..WRITES / 10).map(|_| first.add_node("thing"));
        let nodes: Vec<_> = nodes.collect::<Result<_, _>>().expect("nodes");
        let delta = first.delta_since(second.seen());
        second.merge(&delta).expect("nodes");
        let start = Instant::now();
        for at in 0..WRITES {
            let set = first.set(nodes[at / 10], NAMES[at % 10], Some((at as f64).into()));
            assert!(set.expect("a number"));
        }
        let middle = Instant::now();
        let delta = first.delta_since(second.seen());
        second.merge(black_box(&delta)).expect("a delta");
        let end = Instant::now();
        assert_eq!(first.seen(), second.seen());
        assert_eq!(second.get(nodes[7], NAMES[0]), Some(&70.0.into()));
        all = all.min((end - start).as_secs_f64() / WRITES as f64);
        merge = merge.min((end - middle).as_secs_f64() / WRITES as f64);
    }
    print("merge-all", all);
    print("merge", merge);
}

const NAMES: [&str; 10] = ["a0", "a1", "a2", "a3", "a4", "a5", "a6", "a7", "a8", "a9"];
