//! Names that remember their numbers.

use property_graph::{Error, Graph, KnownName, NodeId, Schema, Time, Value};

fn set(graph: &Graph, node: NodeId, names: [&str; 2]) {
    let made = graph.change(Time::ZERO, |edit| {
        for name in names {
            edit.set(node, name, name)?;
        }
        Ok::<_, Error>(())
    });
    made.expect("a change");
}

fn graph(names: [&str; 2]) -> (Graph, NodeId) {
    let graph = Graph::new(Schema::anything().into(), 1);
    let node = graph.change(Time::ZERO, |edit| edit.add_node("Cup"));
    let node = node.expect("a node");
    set(&graph, node, names);
    (graph, node)
}

/// Graphs number names as they come: a name is found in each of them, whichever was asked last, and
/// one that comes later is found from then on.
#[test]
fn a_known_name_is_found_in_all_graphs_and_versions() {
    let (one, in_one) = graph(["mass", "colour"]);
    let (other, in_other) = graph(["colour", "mass"]);
    let [mass, later] = ["mass", "owner"].map(KnownName::new);
    for _ in 0..2 {
        for (graph, node) in [(&one, in_one), (&other, in_other)] {
            let now = graph.snapshot();
            assert_eq!(now.get(node, &mass), Some(&"mass".into()));
            assert_eq!((now.symbol(&later), now.get(node, &later)), (None, None));
        }
    }
    let before = one.snapshot();
    let fork = one.fork(2);
    set(&one, in_one, ["owner", "place"]);
    set(&fork, in_one, ["place", "owner"]);
    let (now, forked) = (one.snapshot(), fork.snapshot());
    assert_ne!(now.symbol("owner"), forked.symbol("owner"));
    for _ in 0..2 {
        for found in [&now, &forked] {
            assert_eq!(found.get(in_one, &later), Some(&"owner".into()));
            assert_eq!(found.symbol(&later), found.symbol("owner"));
        }
        assert_eq!(before.get(in_one, &later), None);
    }
    // A clone knows as much, and a change takes such a name, too.
    let again = later.clone();
    let changed = other.change(Time::ZERO, |edit| edit.set(in_other, &again, 1_i64));
    changed.expect("a change");
    let now = other.snapshot();
    assert_eq!(now.get(in_other, "owner"), Some(&Value::Int(1)));
}
