//! Random queries of the whole subset beside an evaluator that tries all assignments, and beside
//! grafeo, a graph database of others.

mod ast;
mod brute;
mod generate;
mod world;

use ast::{Clause, Expr};
use brute::Value;
use graph_query::{Budget, Query};
use rc_diagnostics::{Format, SourceMap, render};
use rc_test_support::python;
use std::collections::HashMap;
use std::process::Command;
use world::World;

/// How many queries are compared.
const QUERIES: usize = 500;

/// One query, its graph, and its rows.
struct Case {
    /// The seed of the random numbers.
    seed: u64,
    world: World,
    /// The columns that sum.
    sums: Vec<bool>,
    text: String,
    rows: Vec<Vec<Value>>,
    /// Whether the rows are in an order.
    is_ordered: bool,
}

/// What our engine finds.
fn found(world: &World, text: &str) -> Vec<Vec<Value>> {
    let graph = world.graph();
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, findings) = Query::prepare(&sources, source, graph.schema());
    let told = render(&sources, &findings, Format::Short);
    let query = query.unwrap_or_else(|| panic!("{text}: {told}"));
    let rows = query.run(&graph, &HashMap::new(), Budget::new(1 << 30, 1 << 20));
    let rows = rows.unwrap_or_else(|error| panic!("{text}: {error}"));
    let rows = rows.cells.iter();
    rows.map(|row| row.iter().map(Value::from).collect())
        .collect()
}

/// Rows that may be compared: what is collected has no order, nor have rows without `ORDER BY`.
fn settled(mut rows: Vec<Vec<Value>>, is_ordered: bool) -> Vec<Vec<Value>> {
    for cell in rows.iter_mut().flatten() {
        if let Value::List(all) = cell {
            all.sort_by(Value::order);
        }
    }
    if !is_ordered {
        rows.sort_by(|a, b| brute::rows(a, b));
    }
    rows
}

fn cases() -> Vec<Case> {
    let cases = (0..).filter_map(|seed| {
        let mut random = fastrand::Rng::with_seed(seed);
        let world = World::random(&mut random);
        let clauses = generate::query(&mut random);
        let Some(Clause::Return(last)) = clauses.last() else {
            panic!("a query without RETURN");
        };
        let is_ordered = !last.order.is_empty();
        let is_sum = |expr: &Expr| matches!(expr, Expr::Aggregate("sum", ..));
        let rows = brute::run(&world, &clauses)?;
        Some(Case {
            seed,
            sums: last.items.iter().map(|(expr, _)| is_sum(expr)).collect(),
            text: ast::text(&clauses),
            rows: settled(rows, is_ordered),
            world,
            is_ordered,
        })
    });
    cases.take(QUERIES).collect()
}

#[test]
fn random_queries_are_those_of_all_assignments() {
    let cases = cases();
    for case in &cases {
        let found = settled(found(&case.world, &case.text), case.is_ordered);
        assert_eq!(found, case.rows, "seed {}: {}", case.seed, case.text);
    }
    let with_rows = cases.iter().filter(|case| case.rows.len() > 1).count();
    assert!(
        with_rows > 150,
        "only {with_rows} queries have several rows"
    );
}

fn of_json(value: &serde_json::Value) -> Value {
    match value {
        serde_json::Value::Null => Value::Null,
        serde_json::Value::Bool(yes) => Value::Bool(*yes),
        serde_json::Value::Number(number) => match number.as_i64() {
            Some(number) => Value::Int(number),
            None => Value::Float(number.as_f64().expect("a number")),
        },
        serde_json::Value::String(text) => Value::Text(text.clone()),
        serde_json::Value::Array(all) => Value::List(all.iter().map(of_json).collect()),
        serde_json::Value::Object(_) => panic!("{value}"),
    }
}

/// Queries that grafeo 0.6.0 answers otherwise than openCypher says: it goes on from a node that an
/// optional pattern has not found (71), ends with an internal error (145 and 333), and does not know
/// whether nothing is in an empty list (202).
const OTHERS: [u64; 4] = [71, 145, 202, 333];

#[test]
fn random_queries_are_those_of_grafeo() {
    let test = "random_queries_are_those_of_grafeo";
    let Some(python) = python::wheels("grafeo", "grafeo==0.6.0\n", test) else {
        return;
    };
    let cases = cases();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("cases.json");
    let texts = cases.iter().map(|case| (case.world.json(), &case.text));
    let texts = serde_json::to_string(&texts.collect::<Vec<_>>()).expect("a text");
    std::fs::write(&file, texts).expect("a file");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/random/answers.py");
    let output = Command::new(python).arg(script).arg(&file).output();
    let output = output.expect("python");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let answers: Vec<serde_json::Value> = serde_json::from_slice(&output.stdout).expect("rows");
    assert_eq!(answers.len(), cases.len());
    let mut others = Vec::new();
    for (case, answer) in cases.iter().zip(&answers) {
        let theirs = match answer {
            serde_json::Value::String(error) => Err(error.clone()),
            rows => {
                let rows = rows.as_array().into_iter().flatten();
                let cells = |row: &serde_json::Value| -> Vec<Value> {
                    let cells = row.as_array().into_iter().flatten().zip(&case.sums);
                    // openCypher says 0 for the sum of nothing.
                    let cell = |(cell, is_sum): (_, &bool)| match of_json(cell) {
                        Value::Null if *is_sum => Value::Int(0),
                        other => other,
                    };
                    cells.map(cell).collect()
                };
                Ok(settled(rows.map(cells).collect(), case.is_ordered))
            }
        };
        if theirs.as_ref() != Ok(&case.rows) {
            println!(
                "seed {}: {}\n  ours {:?}\n  grafeo {theirs:?}",
                case.seed, case.text, case.rows
            );
            others.push(case.seed);
        }
    }
    assert_eq!(others, OTHERS);
}
