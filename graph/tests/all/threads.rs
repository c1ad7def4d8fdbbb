//! Readers see whole changes only, and wait for nobody.

use property_graph::{Error, Graph, Schema, Time, Value};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc;

/// How many changes each writer makes that add edges.
const CHANGES: i64 = 500;

/// How many reads there are at least.
const READS: u64 = 1_000_000;

#[test]
fn readers_see_no_half_change() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let pair = graph.change(Time::ZERO, |edit| {
        let pair = [edit.add_node("a")?, edit.add_node("b")?];
        edit.set(pair[0], "x", 0_i64)?;
        edit.set(pair[1], "x", 0_i64)?;
        Ok::<_, Error>(pair)
    });
    let pair = pair.expect("two nodes");
    let reads = AtomicU64::new(0);
    let made = AtomicU64::new(0);
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                while reads.fetch_add(1, Ordering::Relaxed) < READS {
                    let now = graph.snapshot();
                    let [a, b] = pair.map(|node| now.get(node, "x").cloned());
                    assert_eq!(a, b);
                    assert_eq!(now.edge_count() % 2, 0);
                }
            });
        }
        for _ in 0..2 {
            scope.spawn(|| {
                let mut round = 0;
                while round < CHANGES || reads.load(Ordering::Relaxed) < READS {
                    let changed = graph.change(Time::ZERO, |edit| {
                        let value = edit.snapshot().get(pair[0], "x");
                        let next = value.and_then(Value::as_i64).unwrap_or_default() + 1;
                        edit.set(pair[0], "x", next)?;
                        if round < CHANGES {
                            edit.add_edge("to", pair[0], pair[1])?;
                            edit.add_edge("to", pair[1], pair[0])?;
                        }
                        edit.set(pair[1], "x", next)
                    });
                    changed.expect("a change");
                    made.fetch_add(1, Ordering::Relaxed);
                    round += 1;
                }
            });
        }
    });
    let now = graph.snapshot();
    let made = made.into_inner() as i64;
    assert_eq!(now.get(pair[0], "x"), Some(&Value::Int(made)));
    assert_eq!(now.edge_count() as i64, 4 * CHANGES);
}

#[test]
fn a_paused_writer_delays_no_reader() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let node = graph.change(Time::ZERO, |edit| edit.add_node("a"));
    let node = node.expect("a node");
    let (inside, is_inside) = mpsc::channel();
    let (go_on, may_go_on) = mpsc::channel::<()>();
    std::thread::scope(|scope| {
        let graph = &graph;
        scope.spawn(move || {
            let changed = graph.change(Time::ZERO, |edit| {
                edit.set(node, "x", 1_i64)?;
                inside.send(()).expect("the reader");
                may_go_on.recv().expect("the reader");
                Ok::<(), Error>(())
            });
            changed.expect("a change");
        });
        is_inside.recv().expect("the writer");
        // The writer holds its lock; all of these return.
        assert!(graph.snapshot().get(node, "x").is_none());
        assert!(graph.at(Time::ZERO).is_ok());
        assert!(graph.history_of(node, "x").is_empty());
        go_on.send(()).expect("the writer");
    });
    assert_eq!(graph.snapshot().get(node, "x"), Some(&Value::Int(1)));
}

#[test]
fn a_step_and_an_attribute_allocate_nothing() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let hub = edit.add_node("hub")?;
        edit.set(hub, "x", 1.0)?;
        for _ in 0..100 {
            let leaf = edit.add_node("leaf")?;
            edit.add_edge("to", hub, leaf)?;
        }
        Ok::<_, Error>(hub)
    });
    let hub = made.expect("a hub");
    let now = graph.snapshot();
    let to = now.symbol("to").expect("a relation");
    let mut count = 0;
    let allocated = allocation_counter::measure(|| {
        count = now.out(hub, to).count();
        assert!(now.get(hub, "x").is_some());
        assert!(now.named("nobody").next().is_none());
        assert!(now.out_edges(hub, Some(to)).next().is_some());
    });
    assert_eq!((count, allocated.count_total), (100, 0));
}
