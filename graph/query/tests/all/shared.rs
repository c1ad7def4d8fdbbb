//! Counts and sums over paths, whose last step is made once for all rows that come to a node, beside
//! lists of all rows.

use graph_query::{Budget, Query};
use property_graph::{Graph, Schema, Snapshot, Time};
use rc_diagnostics::{Format, SourceMap, render};
use std::collections::HashMap;

/// A graph with parallel edges, edges in both directions, and edges from a node to itself.
fn random(random: &mut fastrand::Rng) -> Graph {
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let mut nodes = Vec::new();
        for at in 0..random.usize(1..8) {
            let node = edit.add_node(["thing", "place"][at % 2])?;
            if random.bool() {
                edit.set(node, "x", random.i64(-4..4))?;
            }
            nodes.push(node);
        }
        for _ in 0..random.usize(0..20) {
            let [from, to] = [0; 2].map(|_| nodes[random.usize(0..nodes.len())]);
            let edge = edit.add_edge(["to", "at"][random.usize(0..2)], from, to)?;
            edit.set(edge, "w", random.i64(0..3))?;
        }
        Ok::<(), property_graph::Error>(())
    });
    made.expect("a graph");
    graph
}

fn cells(graph: &Snapshot, text: &str) -> Result<Vec<Vec<String>>, String> {
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, found) = Query::prepare(&sources, source, graph.schema());
    let query = query.unwrap_or_else(|| panic!("{}", render(&sources, &found, Format::Short)));
    let rows = query.run(graph, &HashMap::new(), Budget::default());
    let rows = rows.map_err(|error| error.to_string())?.cells;
    let shown = |row: Vec<graph_query::Cell>| row.iter().map(|cell| cell.shown(graph)).collect();
    Ok(rows.into_iter().map(shown).collect())
}

#[test]
fn counts_and_sums_are_those_of_the_rows() {
    let mut rng = fastrand::Rng::with_seed(40);
    let hops = [
        "-[:to]->",
        "<-[:to]-",
        "-[:to]-",
        "-[e:to]->",
        "-[]->",
        "-[:to|at]-",
        "-[e {w: 1}]->",
    ];
    for round in 0..400 {
        let graph = random(&mut rng);
        let now = graph.snapshot();
        let hop = |rng: &mut fastrand::Rng| hops[rng.usize(0..hops.len())];
        let (first, last) = (hop(&mut rng).replace('e', ""), hop(&mut rng));
        let middle = ["", "(m)-[:to]->"][rng.usize(0..2)];
        let condition = [
            "",
            "WHERE c.x > 0",
            "WHERE b.x < c.x",
            "WHERE a.x = 1",
            "WHERE abs(c.x) > 1 AND c.x / c.x = 1",
        ];
        let condition = condition[rng.usize(0..condition.len())];
        let key = ["", "b.x AS k, ", "c AS k, "][rng.usize(0..3)];
        let pattern = format!("MATCH {middle}(a){first}(b){last}(c) {condition} RETURN {key}");
        let shared = cells(
            &now,
            &format!("{pattern}count(*), count(c.x), sum(c.x), max(c.x), count(DISTINCT c)"),
        );
        // A list has each row, so no row may stand for others.
        let listed = cells(
            &now,
            &format!(
                "{pattern}count(*), count(c.x), sum(c.x), max(c.x), count(DISTINCT c), size(collect(1))"
            ),
        );
        let (mut shared, mut listed) = (shared.expect("rows"), listed.expect("rows"));
        for row in &mut listed {
            let size = row.pop();
            assert_eq!(size.as_ref(), row.get(usize::from(!key.is_empty())));
        }
        shared.sort();
        listed.sort();
        assert_eq!(shared, listed, "round {round}: {pattern}");
    }
}

/// A hub with a thousand ways to it and a thousand from it has a million paths, and takes thousands of
/// steps.
#[test]
fn a_sum_over_a_million_paths_takes_few_steps() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let hub = edit.add_node("hub")?;
        for _ in 0..1000 {
            let [from, to] = [edit.add_node("from")?, edit.add_node("to")?];
            edit.add_edge("in", from, hub)?;
            edit.add_edge("out", hub, to)?;
            edit.set(to, "x", 2_i64)?;
        }
        Ok::<(), property_graph::Error>(())
    });
    made.expect("a graph");
    let now = graph.snapshot();
    let text = "MATCH (a:from)-[:in]->(h)-[:out]->(b) RETURN sum(b.x) AS x, count(*) AS n";
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, _) = Query::prepare(&sources, source, now.schema());
    let query = query.expect("a query");
    let rows = query.run(&now, &HashMap::new(), Budget::new(20_000, 2_000));
    let rows = rows.expect("a row");
    assert_eq!(rows.cells, [[2_000_000_i64.into(), 1_000_000_i64.into()]]);
}
