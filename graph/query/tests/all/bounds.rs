//! Queries with many rows and large values: each is refused with its bound, or ends as soon as it has
//! enough.

use graph_query::{Budget, Error, Query, Rows};
use property_graph::{Graph, Schema, Snapshot, Time};
use rc_diagnostics::SourceMap;
use std::collections::HashMap;
use std::sync::Arc;

/// A thousand things, so that pairs of them are a million rows, each with 64 KiB of numbers.
fn things() -> Arc<Snapshot> {
    let graph = Graph::new(Schema::anything().into(), 1);
    let large = vec![0.5; 8192];
    let made = graph.change(Time::ZERO, |edit| {
        for number in 0..1000_i64 {
            let thing = edit.add_node("thing")?;
            edit.set(thing, "number", number)?;
            if number < 100 {
                edit.set(thing, "large", large.as_slice())?;
            }
        }
        Ok::<(), property_graph::Error>(())
    });
    made.expect("a graph");
    graph.snapshot()
}

fn run(graph: &Snapshot, text: &str, budget: Budget) -> Result<Rows, Error> {
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, found) = Query::prepare(&sources, source, graph.schema());
    assert!(!found.has_errors(), "{text}");
    query.expect("a query").run(graph, &HashMap::new(), budget)
}

#[test]
fn a_million_rows_are_refused_and_counted() {
    let graph = things();
    let pairs = "MATCH (a:thing), (b:thing) RETURN a.number, b.number";
    let refused = run(&graph, pairs, Budget::default());
    let refused = refused.expect_err("too many rows").to_string();
    assert_eq!(refused, "the query makes more than 100000 rows");
    let sorted = format!("{pairs} ORDER BY a.number LIMIT 10");
    let refused = run(&graph, &sorted, Budget::new(1 << 30, 1000));
    assert_eq!(refused, Err(Error::Rows(1000)));
}

/// `LIMIT` ends a query as soon as it has its rows, if nothing has to be sorted before.
#[test]
fn a_query_ends_with_its_last_row() {
    let graph = things();
    let few = || Budget::new(1000, 100);
    for (text, count) in [
        ("MATCH (a:thing), (b:thing) RETURN a, b LIMIT 10", 10),
        ("MATCH (a:thing), (b:thing) RETURN a, b SKIP 7 LIMIT 10", 10),
        ("MATCH (a:thing), (b:thing) RETURN a LIMIT 0", 0),
        ("MATCH (a:thing) RETURN DISTINCT a.number LIMIT 20", 20),
        (
            "MATCH (a:thing) WITH a LIMIT 5 MATCH (a), (b:thing) RETURN a, b LIMIT 30",
            30,
        ),
        (
            "MATCH (a:thing) WITH a LIMIT 4 WHERE a.number < 0 RETURN a",
            0,
        ),
        (
            "MATCH (a:thing) WITH a LIMIT 4 RETURN a.number ORDER BY a.number DESC",
            4,
        ),
        ("MATCH (a:thing) WITH a LIMIT 4 RETURN count(*)", 1),
        (
            "OPTIONAL MATCH (a:thing) WITH a LIMIT 4 WITH a ORDER BY a.number DESC LIMIT 2 RETURN a",
            2,
        ),
    ] {
        let rows = run(&graph, text, few()).map(|rows| rows.cells.len());
        assert_eq!(rows, Ok(count), "{text}");
    }
    let text = "MATCH (a:thing) WITH a LIMIT 4 RETURN count(DISTINCT a.number) AS all";
    let rows = run(&graph, text, few()).expect("a row");
    assert_eq!(rows.cells, [[4.into()]]);
    let text = "MATCH (a:thing) RETURN a LIMIT -1";
    assert!(matches!(
        run(&graph, text, Budget::default()),
        Err(Error::Type(_))
    ));
}

/// What `collect` and `DISTINCT` keep counts, also what no row of the result has.
#[test]
fn what_groups_keep_has_a_bound() {
    let graph = things();
    for text in [
        "MATCH (a:thing), (b:thing) WHERE a.number < 100 AND b.number < 100 RETURN size(collect(a.large))",
        "MATCH (a:thing), (b:thing) WHERE a.number < 100 AND b.number < 100 \
         RETURN count(DISTINCT [a.number, b.number] + a.large)",
    ] {
        let refused = run(&graph, text, Budget::default());
        assert_eq!(refused, Err(Error::Bytes(256)), "{text}");
    }
    // What only counts keeps nothing.
    let text = "MATCH (a:thing), (b:thing) WHERE a.number < 30 AND b.number < 10 \
        RETURN count(a.large) AS n, count(DISTINCT a.large) AS one";
    let rows = run(&graph, text, Budget::default()).expect("a row");
    assert_eq!(rows.cells, [[300.into(), 1.into()]]);
}
