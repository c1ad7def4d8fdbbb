//! The technology compatibility kit of openCypher: the scenarios that the subset claims pass, and each
//! other one is listed with the reason, in `scenarios.txt`.

mod feature;
mod value;

use feature::{Expected, Scenario};
use graph_query::{Budget, Cell, Error, Query, Rows};
use property_graph::{Graph, Schema, Snapshot, Time};
use rc_diagnostics::{Format, SourceMap, render};
use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use value::{Reader, Value};

/// A package of `PyPI` whose sources have the feature files of the kit.
const KIT: &str = "ocpg==0.3.0";

/// Its own tests, which have the graphs that the features name.
const GRAPHS: &str = "tests/tck/main.rs";

/// How a scenario ended.
enum Verdict {
    /// The answer is that of the kit.
    Answers,
    /// The kit expects a fault, and it is found.
    Refuses,
    /// The subset does not have what the scenario needs.
    Beyond(String),
    /// The subset answers, and not as the scenario says.
    Other(String),
}

/// The finding of ours that says what a fault of the kit says.
fn codes(fault: &str) -> &'static [&'static str] {
    match fault {
        "UndefinedVariable" => &["unknown-variable"],
        "ColumnNameConflict" => &["duplicate-name"],
        "InvalidAggregation" | "NestedAggregation" => &["query-aggregate"],
        "UnknownFunction" => &["unknown-function"],
        "UnexpectedSyntax"
        | "InvalidNumberLiteral"
        | "InvalidUnicodeLiteral"
        | "IntegerOverflow"
        | "NoExpressionAlias"
        | "InvalidRelationshipPattern"
        | "InvalidClauseComposition"
        | "NoVariablesInScope" => &["query-syntax"],
        // A `TypeError` of any name.
        "*" | "InvalidArgumentType" | "InvalidArgumentValue" | "NegativeIntegerArgument" => {
            &["type"]
        }
        _ => &[],
    }
}

/// Why ours answers where the kit expects a fault: it knows less before a query runs.
fn decided(how: &str) -> Option<&'static str> {
    Some(match how {
        "VariableTypeConflict is expected" => {
            "a variable of another kind matches nothing, and an edge may be a node"
        }
        "RelationshipUniquenessViolation is expected" => {
            "an edge that is twice in a pattern matches nothing"
        }
        "AmbiguousAggregationExpression is expected" => {
            "a value beside a sum is that of the first row of its group"
        }
        "InvalidArgumentType is expected" => "types are compared where a value is computed",
        "expected a list, found a node" => "an attribute is named in the text alone",
        _ => return None,
    })
}

/// A limit of ours that the message about an unknown variable does not name.
const GROUPS: &str = "behind `DISTINCT` or a sum, only the new names are known";

/// Whether a query orders or filters rows that several ones became.
fn is_of_group(query: &str) -> bool {
    let sums = ["DISTINCT", "count(", "sum(", "avg(", "min(", "max("];
    let is_ordered = query
        .rsplit_once("ORDER BY")
        .is_some_and(|(before, _)| sums.iter().any(|sum| before.contains(sum)));
    let is_filtered = query
        .split_once("WITH DISTINCT")
        .is_some_and(|(_, behind)| behind.contains("WHERE"));
    is_ordered || is_filtered
}

/// Endings of messages about what the subset does not have: they find no fault of a query.
const UNSUPPORTED: [&str; 6] = [
    "found `UNION`",
    "found `UNWIND`",
    "found `{`",
    "found `..`",
    "found `:`",
    "found `$`",
];

/// Whether a refusal finds the fault that the kit expects.
fn finds(fault: &str, code: &str, message: &str) -> bool {
    let is_supported = !UNSUPPORTED.iter().any(|end| message.ends_with(end));
    // A path with a name.
    let is_path = message.starts_with("expected `(`, found `");
    codes(fault).contains(&code) && is_supported && !is_path
}

fn graph(scenario: &Scenario, graphs: &str) -> Result<Arc<Snapshot>, String> {
    let graph = Graph::new(Schema::anything().into(), 1);
    let mut texts = Vec::new();
    if let Some(name) = &scenario.named_graph {
        let step = format!("#[given(\"{name}\")]");
        let text = graphs.split_once(&step).and_then(|(_, text)| {
            let (_, text) = text.split_once("r#\"")?;
            text.split_once("\"#")
        });
        let (text, _) = text.ok_or_else(|| format!("{KIT} does not have {name}"))?;
        texts.push(text.to_owned());
    }
    texts.extend(scenario.setup.iter().cloned());
    for text in texts {
        let mut reason = None;
        let made = graph.change(Time::ZERO, |edit| {
            value::create(edit, &text).map_err(|why| {
                reason = Some(why);
                property_graph::Error::NoFrame
            })
        });
        if let Err(error) = made {
            return Err(reason.unwrap_or_else(|| error.to_string()));
        }
    }
    Ok(graph.snapshot())
}

/// Prepares and runs a query. The first text of a refusal is its code.
fn run(scenario: &Scenario, graph: &Snapshot) -> Result<Rows, (String, String)> {
    let mut sources = SourceMap::new();
    let source = sources.add("query", scenario.query.as_str());
    let (query, found) = Query::prepare(&sources, source, graph.schema());
    let Some(query) = query else {
        let told = render(&sources, &found, Format::Short);
        let (_, told) = told.split_once("error[").unwrap_or(("", &told));
        let (code, message) = told.split_once("]: ").unwrap_or(("", told));
        return Err((code.to_owned(), message.trim_end().to_owned()));
    };
    let mut parameters: HashMap<String, Cell> = HashMap::new();
    for (name, text) in &scenario.parameters {
        let value = Reader::new(text).value();
        let cell = value.and_then(|value| value::parameter(&value));
        let cell = cell.map_err(|reason| ("parameter".to_owned(), reason))?;
        parameters.insert(name.clone(), cell);
    }
    let rows = query.run(graph, &parameters, Budget::default());
    rows.map_err(|error| {
        let code = match error {
            Error::Type(_) => "type",
            _ => "run",
        };
        (code.to_owned(), error.to_string())
    })
}

fn verdict(scenario: &Scenario, graphs: &str) -> Verdict {
    if let Some(step) = &scenario.beyond {
        let is_procedure = step.starts_with("there exists a procedure");
        return Verdict::Beyond(if is_procedure {
            "a procedure".to_owned()
        } else {
            step.clone()
        });
    }
    let graph = match graph(scenario, graphs) {
        Ok(graph) => graph,
        Err(reason) => return Verdict::Beyond(reason),
    };
    let found = run(scenario, &graph);
    let (columns, rows, is_ordered, lists_vary) = match (&scenario.expected, &found) {
        (Expected::None, _) => return Verdict::Beyond("it expects nothing".to_owned()),
        (Expected::Error(fault), Err((code, message))) if finds(fault, code, message) => {
            return Verdict::Refuses;
        }
        (_, Err((code, _))) if code == "unknown-variable" && is_of_group(&scenario.query) => {
            return Verdict::Beyond(GROUPS.to_owned());
        }
        (_, Err((code, message))) if code != "type" && code != "run" => {
            return Verdict::Beyond(message.clone());
        }
        (Expected::Error(fault), _) => return Verdict::Other(format!("{fault} is expected")),
        (_, Err((_, message))) => return Verdict::Other(message.clone()),
        (
            Expected::Rows {
                columns,
                rows,
                is_ordered,
                lists_vary,
            },
            Ok(_),
        ) => (columns, rows, *is_ordered, *lists_vary),
    };
    let found = found.unwrap_or_else(|_| panic!("rows"));
    let mut expected = Vec::new();
    for row in rows {
        let row: Result<Vec<Value>, String> =
            row.iter().map(|cell| Reader::new(cell).value()).collect();
        match row {
            Ok(row) => expected.push(row),
            Err(reason) => return Verdict::Beyond(reason),
        }
    }
    // Columns have no order in the kit, and a result without rows may have none.
    let places = columns
        .iter()
        .map(|name| found.columns.iter().position(|own| own == name));
    let places: Option<Vec<usize>> = places.collect();
    let places = places.filter(|places| places.len() == found.columns.len() || columns.is_empty());
    let Some(places) = places else {
        let (ours, theirs) = (found.columns.join(", "), columns.join(", "));
        return Verdict::Other(format!("columns {ours} instead of {theirs}"));
    };
    let cells = found.cells.iter();
    let cells: Vec<Vec<Value>> = cells
        .map(|row| {
            places
                .iter()
                .map(|at| value::of_cell(&row[*at], &graph))
                .collect()
        })
        .collect();
    let same_row = |a: &Vec<Value>, b: &Vec<Value>| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| value::same(a, b, lists_vary))
    };
    let same = cells.len() == expected.len()
        && if is_ordered {
            cells.iter().zip(&expected).all(|(a, b)| same_row(a, b))
        } else {
            value::same_in_any_order(&cells, &expected, same_row)
        };
    if same {
        Verdict::Answers
    } else {
        Verdict::Other(format!("found {cells:?}"))
    }
}

fn features(folder: &Path, all: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).expect("a folder of features");
    for entry in entries.flatten() {
        let path = entry.path();
        if path.is_dir() {
            features(&path, all);
        } else if path.extension().is_some_and(|end| end == "feature") {
            all.push(path);
        }
    }
}

#[test]
fn the_kit_of_opencypher_passes_where_the_subset_claims_it() {
    let test = "the_kit_of_opencypher_passes_where_the_subset_claims_it";
    let Some(kit) = rc_test_support::python::sources(KIT, &[".feature", GRAPHS], test) else {
        return;
    };
    let kit = kit.join(KIT.replace("==", "-"));
    let graphs = std::fs::read_to_string(kit.join(GRAPHS)).expect("the graphs of the kit");
    let kit = kit.join("tests/tck");
    let mut paths = Vec::new();
    features(&kit.join("features"), &mut paths);
    paths.sort();
    let (mut answered, mut refused, mut beyond, mut text) = (0, 0, 0, String::new());
    let mut others = Vec::new();
    for path in &paths {
        let name = path.strip_prefix(kit.join("features")).expect("a feature");
        let name = name.with_extension("");
        let mut reasons: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let (mut answers, mut refusals) = (Vec::new(), Vec::new());
        for scenario in feature::read(path) {
            match verdict(&scenario, &graphs) {
                Verdict::Answers => answers.push(scenario.number),
                Verdict::Refuses => refusals.push(scenario.number),
                Verdict::Beyond(reason) => reasons.entry(reason).or_default().push(scenario.number),
                Verdict::Other(how) if decided(&how).is_some() => {
                    let reason = decided(&how).unwrap_or_default().to_owned();
                    reasons.entry(reason).or_default().push(scenario.number);
                }
                Verdict::Other(how) => {
                    others.push(format!(
                        "{} [{}]: {how}\n{}",
                        name.display(),
                        scenario.number,
                        scenario.query
                    ));
                }
            }
        }
        answered += answers.len();
        refused += refusals.len();
        let _ = writeln!(text, "{}", name.display());
        for (what, numbers) in [("answers", answers), ("refuses", refusals)] {
            if !numbers.is_empty() {
                let _ = writeln!(text, "  {what}: {}", numbers.join(" "));
            }
        }
        for (reason, numbers) in reasons {
            beyond += numbers.len();
            let _ = writeln!(text, "  {}: {reason}", numbers.join(" "));
        }
    }
    assert!(others.is_empty(), "{}", others.join("\n"));
    let text = format!(
        "Scenarios of the kit of openCypher, from {KIT}: {answered} are answered as there, {refused} are \
         refused as there, {beyond} do not pass, each for its reason.\n\
         UPDATE_EXPECT=1 writes this list.\n\n{text}"
    );
    expect_test::expect_file!["scenarios.txt"].assert_eq(&text);
}
