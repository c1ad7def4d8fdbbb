//! Queries over two hops, prepared.

use crate::{best, print, random};
use graph_query::{Budget, Cell, Query};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;

const BY_NAME: &str =
    "MATCH (a:thing)-[:to]->(b:thing)-[:to]->(c:thing) WHERE a.name = $name RETURN c.x";
const WHOLE: &str = "MATCH (a:thing)-[:to]->(b:thing)-[:to]->(c:thing) RETURN sum(c.x) AS x";

/// Leaves the graph and the answer at `path` for others.
pub(crate) fn measure(path: &Path) {
    let (graph, nodes, _) = random(1000);
    let now = graph.snapshot();
    let mut sources = rc_diagnostics::SourceMap::new();
    let mut prepared = |text: &str| {
        let source = sources.add("query", text);
        let (query, _) = Query::prepare(&sources, source, now.schema());
        query.expect("a query")
    };
    let (by_name, whole) = (prepared(BY_NAME), prepared(WHOLE));
    let name: HashMap<String, Cell> = [("name".to_owned(), "n7".into())].into();
    let rows = |query: &Query| query.run(&now, &name, Budget::default()).expect("rows");
    let expected = rows(&by_name).cells;
    assert_eq!(expected.len(), 16);
    let time = best(100, || {
        (0..100).for_each(|_| drop(black_box(rows(&by_name))))
    });
    print("query-name", time);
    let time = best(5, || (0..5).for_each(|_| drop(black_box(rows(&whole)))));
    print("query-whole", time);
    let expected = expected.iter().map(|row| row[0].shown(&now));
    let expected: Vec<String> = expected.collect();
    let place: HashMap<_, usize> = nodes
        .iter()
        .enumerate()
        .map(|(at, node)| (*node, at))
        .collect();
    let mut edges = String::new();
    for edge in now.edges() {
        let comma = if edges.is_empty() { "" } else { ", " };
        let (from, to) = (place[&edge.from()], place[&edge.to()]);
        let _ = write!(edges, "{comma}[{from}, {to}]");
    }
    let expected = expected.join(", ");
    let text = format!("{{\"count\": 1000, \"edges\": [{edges}], \"expected\": [{expected}]}}");
    std::fs::write(path, text).expect("a file");
}
