//! Random queries beside an evaluator that tries all assignments.

use graph_query::{Budget, Cell, Query};
use property_graph::{EdgeId, Error, Graph, NodeId, Schema, Snapshot, Time};
use rc_diagnostics::SourceMap;
use std::collections::HashMap;
use std::sync::Arc;

const KINDS: [&str; 2] = ["A", "B"];

fn graph(random: &mut fastrand::Rng) -> Arc<Snapshot> {
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let mut nodes = Vec::new();
        for _ in 0..random.usize(3..8) {
            let node = edit.add_node(KINDS[random.usize(0..2)])?;
            if random.u32(0..5) > 0 {
                edit.set(node, "x", random.i64(0..4))?;
            }
            nodes.push(node);
        }
        for _ in 0..random.usize(4..14) {
            let ends = [0, 1].map(|_| nodes[random.usize(0..nodes.len())]);
            let edge = edit.add_edge(["r", "s"][random.usize(0..2)], ends[0], ends[1])?;
            edit.set(edge, "w", random.i64(0..3))?;
        }
        Ok::<(), Error>(())
    });
    made.expect("a graph");
    graph.snapshot()
}

/// A pattern of a chain: types of nodes, and for each edge its types and its direction.
struct Pattern {
    nodes: Vec<Option<&'static str>>,
    edges: Vec<(Vec<&'static str>, u8)>,
    /// `n0.x < 2 AND …`: node, operator, number.
    conditions: Vec<(usize, &'static str, i64)>,
    is_any: bool,
    counts: bool,
}

fn pattern(random: &mut fastrand::Rng) -> Pattern {
    let kind = |random: &mut fastrand::Rng| random.bool().then(|| KINDS[random.usize(0..2)]);
    let count = random.usize(1..4);
    let nodes: Vec<_> = (0..count).map(|_| kind(random)).collect();
    let edges = (1..count).map(|_| {
        let types = match random.u32(0..4) {
            0 => vec![],
            1 => vec!["r"],
            2 => vec!["s"],
            _ => vec!["r", "s"],
        };
        (types, random.u8(0..3))
    });
    let edges = edges.collect();
    let operators = ["<", "<=", "=", "<>", ">", ">="];
    let conditions = (0..random.usize(0..3)).map(|_| {
        let operator = operators[random.usize(0..6)];
        (random.usize(0..count), operator, random.i64(0..4))
    });
    Pattern {
        conditions: conditions.collect(),
        nodes,
        edges,
        is_any: random.bool(),
        counts: random.bool(),
    }
}

fn text(pattern: &Pattern) -> String {
    let node = |at: usize| match pattern.nodes[at] {
        Some(kind) => format!("(n{at}:{kind})"),
        None => format!("(n{at})"),
    };
    let mut text = format!("MATCH {}", node(0));
    for (at, (types, direction)) in pattern.edges.iter().enumerate() {
        let types = if types.is_empty() {
            String::new()
        } else {
            format!(":{}", types.join("|"))
        };
        let (left, right) = [("-", "->"), ("<-", "-"), ("-", "-")][usize::from(*direction)];
        text += &format!("{left}[e{at}{types}]{right}{}", node(at + 1));
    }
    let conditions = pattern.conditions.iter();
    let conditions: Vec<String> = conditions
        .map(|(node, operator, number)| format!("n{node}.x {operator} {number}"))
        .collect();
    if !conditions.is_empty() {
        let word = if pattern.is_any { " OR " } else { " AND " };
        text += &format!(" WHERE {}", conditions.join(word));
    }
    let last = pattern.nodes.len() - 1;
    if pattern.counts {
        text + &format!(" RETURN n0.x AS x, count(*) AS n, sum(n{last}.x) AS s")
    } else {
        text + &format!(" RETURN n0.x AS x, n{last}.x AS y")
    }
}

/// All assignments of a pattern: nodes, by trying all.
fn assignments(graph: &Snapshot, pattern: &Pattern) -> Vec<Vec<NodeId>> {
    let nodes: Vec<NodeId> = graph.nodes().map(|node| node.node_id()).collect();
    let edges: Vec<EdgeId> = graph.edges().map(|edge| edge.edge_id()).collect();
    let mut ways: Vec<(Vec<NodeId>, Vec<EdgeId>)> =
        nodes.iter().map(|n| (vec![*n], vec![])).collect();
    for (types, direction) in &pattern.edges {
        let mut next = Vec::new();
        for (way, used) in &ways {
            for edge in edges.iter().filter(|edge| !used.contains(edge)) {
                let here = graph.edge(*edge).expect("an edge");
                if !types.is_empty() && !types.contains(&here.type_name()) {
                    continue;
                }
                for node in &nodes {
                    let last = way[way.len() - 1];
                    let forth = here.from() == last && here.to() == *node;
                    let back = here.to() == last && here.from() == *node;
                    let fits = match direction {
                        0 => forth,
                        1 => back,
                        _ => forth || back,
                    };
                    if fits {
                        let way = way.iter().copied().chain([*node]).collect();
                        next.push((way, used.iter().copied().chain([*edge]).collect()));
                    }
                }
            }
        }
        ways = next;
    }
    let value = |node: NodeId| graph.get(node, "x").and_then(property_graph::Value::as_i64);
    let fits = |way: &Vec<NodeId>| {
        let typed = way.iter().zip(&pattern.nodes).all(|(node, kind)| {
            kind.is_none_or(|kind| graph.node(*node).expect("a node").type_name() == kind)
        });
        // A comparison with nothing is not known.
        let truths: Vec<Option<bool>> = pattern
            .conditions
            .iter()
            .map(|(node, operator, number)| {
                let x = value(way[*node])?;
                Some(match *operator {
                    "<" => x < *number,
                    "<=" => x <= *number,
                    "=" => x == *number,
                    "<>" => x != *number,
                    ">" => x > *number,
                    _ => x >= *number,
                })
            })
            .collect();
        let holds = if pattern.is_any && !truths.is_empty() {
            truths.contains(&Some(true))
        } else {
            truths.iter().all(|truth| *truth == Some(true))
        };
        typed && holds
    };
    ways.into_iter().map(|(way, _)| way).filter(fits).collect()
}

fn expected(graph: &Snapshot, pattern: &Pattern) -> Vec<Vec<Cell>> {
    let value = |node: NodeId| graph.get(node, "x").and_then(property_graph::Value::as_i64);
    let cell = |value: Option<i64>| value.map_or(Cell::Null, Cell::Int);
    let ways = assignments(graph, pattern);
    if !pattern.counts {
        let rows = ways
            .iter()
            .map(|way| vec![cell(value(way[0])), cell(value(way[way.len() - 1]))]);
        return rows.collect();
    }
    let mut groups: HashMap<Option<i64>, (i64, i64)> = HashMap::new();
    for way in &ways {
        let group = groups.entry(value(way[0])).or_default();
        group.0 += 1;
        group.1 += value(way[way.len() - 1]).unwrap_or_default();
    }
    let rows = groups.into_iter();
    rows.map(|(key, (count, sum))| vec![cell(key), Cell::Int(count), Cell::Int(sum)])
        .collect()
}

#[test]
fn random_queries_are_those_of_all_assignments() {
    let mut rows_seen = 0;
    for seed in 0..500 {
        let mut random = fastrand::Rng::with_seed(seed);
        let (graph, pattern) = (graph(&mut random), pattern(&mut random));
        let text = text(&pattern);
        let mut sources = SourceMap::new();
        let source = sources.add("query", text.as_str());
        let (query, _) = Query::prepare(&sources, source, graph.schema());
        let query = query.unwrap_or_else(|| panic!("{text}"));
        let found = query.run(&graph, &HashMap::new(), Budget::default());
        let mut found = found
            .unwrap_or_else(|error| panic!("{text}: {error}"))
            .cells;
        let mut expected = expected(&graph, &pattern);
        let order = |a: &Vec<Cell>, b: &Vec<Cell>| {
            let pairs = a.iter().zip(b).map(|(a, b)| a.sorted(b));
            pairs.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        };
        found.sort_by(order);
        expected.sort_by(order);
        assert_eq!(found, expected, "seed {seed}: {text}");
        rows_seen += found.len();
    }
    assert!(rows_seen > 1000, "only {rows_seen} rows");
}
