//! A query that is prepared once answers for all versions and all graphs.

use graph_query::{Budget, Query};
use property_graph::{Error, Graph, Schema, Snapshot, Time};
use rc_diagnostics::SourceMap;
use std::collections::HashMap;

fn graph(names: [&str; 3]) -> Graph {
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let first = edit.add_node("start")?;
        for name in names {
            edit.set(first, name, 1_i64)?;
        }
        Ok::<_, Error>(())
    });
    made.expect("a graph");
    graph
}

#[test]
fn names_that_come_later_and_other_graphs_are_known() {
    let text = "MATCH (a:Cup)-[:in|on]->(b:Room) WHERE b.size > 1 RETURN a.name";
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, _) = Query::prepare(&sources, source, &Schema::anything());
    let query = query.expect("a query");
    let count = |graph: &Snapshot| {
        let rows = query.run(graph, &HashMap::new(), Budget::default());
        rows.expect("rows").cells.len()
    };
    // Names in different orders, so that their numbers differ.
    let graphs = [["in", "Cup", "x"], ["size", "Room", "in"]].map(graph);
    let before = [0, 1].map(|at| graphs[at].snapshot());
    for (at, graph) in graphs.iter().enumerate() {
        assert_eq!(count(&before[0]) + count(&before[1]), 0);
        let made = graph.change(Time::ZERO, |edit| {
            let (cup, room) = (edit.add_node("Cup")?, edit.add_node("Room")?);
            edit.set(room, "size", 2_i64)?;
            edit.add_edge(["in", "on"][at], cup, room)
        });
        made.expect("a change");
        assert_eq!(count(&graph.snapshot()), 1);
    }
    for _ in 0..2 {
        assert_eq!(
            graphs.each_ref().map(|graph| count(&graph.snapshot())),
            [1, 1]
        );
        assert_eq!(before.each_ref().map(|graph| count(graph)), [0, 0]);
    }
}
