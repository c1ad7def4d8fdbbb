//! Queries as texts: what they find, and why they are refused.

use graph_query::{Budget, Cell, Error, Query, Rows};
use property_graph::schema::{Attribute, Entity, Kind, Placed, Port, PoseOf, Relation};
use property_graph::{Graph, Sample, Schema, Snapshot, Time, Value};
use rc_diagnostics::{Format, SourceMap, render};
use std::collections::HashMap;
use std::sync::Arc;

fn schema(open: bool) -> Schema {
    let attribute = |name: &str, kind: Kind| Attribute {
        name: name.to_owned(),
        kind,
        unit: None,
        range: None,
        optional: true,
        key: false,
        history: None,
        doc: Vec::new(),
    };
    let entity = |name: &str, parent: Option<&str>| Entity {
        name: name.to_owned(),
        parent: parent.map(str::to_owned),
        attributes: vec![attribute("name", Kind::Text), attribute("age", Kind::Int)],
        ..Entity::default()
    };
    let port = |entity: &str| Port {
        name: entity.to_lowercase(),
        entity: entity.to_owned(),
        ..Port::default()
    };
    Schema {
        name: "house".to_owned(),
        open,
        entities: vec![
            entity("Person", None),
            entity("Child", Some("Person")),
            entity("Room", None),
        ],
        relations: vec![
            Relation {
                name: "in".to_owned(),
                ports: vec![port("Person"), port("Room")],
                attributes: vec![attribute("since", Kind::Int)],
                ..Relation::default()
            },
            Relation {
                name: "next".to_owned(),
                ports: vec![port("Room"), port("Room")],
                ..Relation::default()
            },
        ],
        ..Schema::default()
    }
}

/// Ada (36) and Bob (7, a child) in the kitchen, Eve (without an age) in the hall; kitchen → hall →
/// bath.
fn house() -> Arc<Snapshot> {
    let graph = Graph::new(schema(false).into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let mut rooms = Vec::new();
        for name in ["kitchen", "hall", "bath"] {
            let room = edit.add_node("Room")?;
            edit.set(room, "name", name)?;
            rooms.push(room);
        }
        edit.add_edge("next", rooms[0], rooms[1])?;
        edit.add_edge("next", rooms[1], rooms[2])?;
        let people = [
            ("Person", "Ada", Some(36), 0),
            ("Child", "Bob", Some(7), 0),
            ("Person", "Eve", None, 1),
        ];
        for (at, (kind, name, age, room)) in people.into_iter().enumerate() {
            let person = edit.add_node(kind)?;
            edit.set(person, "name", name)?;
            if let Some(age) = age {
                edit.set(person, "age", i64::from(age))?;
            }
            let edge = edit.add_edge("in", person, rooms[room])?;
            edit.set(edge, "since", at as i64)?;
        }
        Ok::<(), property_graph::Error>(())
    });
    made.expect("a house");
    graph.snapshot()
}

fn run(text: &str, budget: Budget) -> Result<Rows, Error> {
    let house = house();
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, found) = Query::prepare(&sources, source, house.schema());
    assert_eq!(render(&sources, &found, Format::Short), "", "{text}");
    let parameters: HashMap<String, Cell> = [("room".to_owned(), "kitchen".into())].into();
    query.expect("a query").run(&house, &parameters, budget)
}

/// The rows as lines.
fn rows(text: &str) -> String {
    let house = house();
    let rows = run(text, Budget::default()).expect("rows");
    let lines = rows.cells.iter().map(|row| {
        let cells: Vec<String> = row.iter().map(|cell| cell.shown(&house)).collect();
        cells.join(" ")
    });
    lines.collect::<Vec<_>>().join("; ")
}

#[test]
fn queries_find_what_they_say() {
    let cases = [
        (
            "MATCH (p:Person)-[:in]->(r:Room) WHERE r.name = $room RETURN p.name ORDER BY p.name",
            "Ada; Bob",
        ),
        ("MATCH (p:Child) RETURN p", "(Bob:Child)"),
        // Wherever the search begins, an attribute that depends on a variable waits for it.
        (
            "MATCH (a:Person)-[:in]->(r:Room), (b:Child {age: a.age}) RETURN a.name, b.name",
            "Bob Bob",
        ),
        (
            "MATCH (a:Person)-[:in]->(r:Room), (b {name: a.name}) RETURN b.name ORDER BY b.name",
            "Ada; Bob; Eve",
        ),
        (
            "MATCH (a:Child)-[:in]->(r:Room), (b)-[e:in {since: a.age - 7}]->(r) RETURN b.name",
            "Ada",
        ),
        (
            "MATCH (p:Person) RETURN count(*) AS all, count(p.age) AS known, avg(p.age) AS mean",
            "3 2 21.5",
        ),
        (
            "MATCH (r:Room)<-[:in]-(p) RETURN r.name, count(p) AS n ORDER BY n DESC",
            "kitchen 2; hall 1",
        ),
        (
            "MATCH (r:Room) OPTIONAL MATCH (p:Person)-[:in]->(r) RETURN r.name, collect(p.name) AS who ORDER BY r.name",
            "bath []; hall [Eve]; kitchen [Ada, Bob]",
        ),
        (
            "MATCH (a:Room {name: 'kitchen'})-[n:next*1..3]->(b) RETURN b.name, size(n) ORDER BY b.name",
            "bath 2; hall 1",
        ),
        (
            "MATCH (a:Room {name: 'bath'})<-[:next*0..1]-(b) RETURN b.name ORDER BY b.name",
            "bath; hall",
        ),
        ("MATCH (a)-[:next]-(b) RETURN count(*)", "4"),
        ("MATCH (p:Person) WHERE p.age > 10 RETURN p.name", "Ada"),
        ("MATCH (p:Person) WHERE NOT p.age > 10 RETURN p.name", "Bob"),
        ("MATCH (p:Person) WHERE p.age IS NULL RETURN p.name", "Eve"),
        (
            "MATCH (p:Person) WHERE p.age > 10 OR p.name STARTS WITH 'E' RETURN p.name ORDER BY p.name DESC",
            "Eve; Ada",
        ),
        (
            "MATCH (p:Person) WHERE p.age IN [7, 8] RETURN p.name",
            "Bob",
        ),
        (
            "MATCH (p:Person) WITH p.name AS name, p.age AS age WHERE age < 10 RETURN name",
            "Bob",
        ),
        (
            "MATCH (p:Person) WITH p.name AS name WHERE p.age < 10 OR name = 'Eve' RETURN name ORDER BY name",
            "Bob; Eve",
        ),
        (
            "MATCH (p:Person) WITH p.name AS name ORDER BY name LIMIT 1 WHERE p.age < 10 RETURN name",
            "",
        ),
        (
            "MATCH (p:Person) RETURN p.name ORDER BY p.age, p.name SKIP 1 LIMIT 1",
            "Ada",
        ),
        (
            "MATCH (p)-[e:in]->(r) WHERE e.since = 1 RETURN startNode(e).name, type(e), r.name",
            "Bob in kitchen",
        ),
        (
            "MATCH (p:Person)-[:in]->(r)<-[:in]-(q:Person) RETURN p.name, q.name ORDER BY p.name",
            "Ada Bob; Bob Ada",
        ),
        (
            "MATCH (p:Person) RETURN DISTINCT p.age IS NULL AS unknown ORDER BY unknown",
            "false; true",
        ),
        (
            "RETURN 1 + 2 * 3, 7 / 2, 7 % 2, 7 / 2.0, -abs(-2), 'a' + 'b', [1, 2][1], coalesce(null, 4)",
            "7 3 1 3.5 -2 ab 2 4",
        ),
        (
            "RETURN null = null, null AND false, null OR true, NOT null, 1 IN [null], 1 = 1.0",
            "null false true null null true",
        ),
        (
            "MATCH (p:Person) RETURN max(p.age) - min(p.age) AS range, sum(p.age) / count(p.age) AS mean",
            "29 21",
        ),
        (
            "MATCH (p:Person {name: 'Nobody'}) RETURN count(*), sum(p.age), max(p.age)",
            "0 0 null",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(rows(text), expected, "{text}");
    }
}

fn refused(text: &str, open: bool) -> String {
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, found) = Query::prepare(&sources, source, &schema(open));
    assert_eq!(query.is_none(), found.has_errors(), "{text}");
    render(&sources, &found, Format::Short)
}

#[test]
fn attributes_of_a_path_depend_on_no_variable() {
    let text = "MATCH (a)-[:next*1..2 {since: a.age}]->(b) RETURN b";
    assert!(refused(text, true).contains("a literal or a parameter"));
}

#[test]
fn wrong_queries_are_findings() {
    let cases = [
        (
            "MATCH (p:Persn) RETURN p",
            "query:1:10: error[unknown-type]: the schema has no entity `Persn` (did you mean `Person`?)",
        ),
        (
            "MATCH (p:Person)-[:inn]->(r) RETURN p",
            "query:1:20: error[unknown-type]: the schema has no relation `inn` (did you mean `in`?)",
        ),
        (
            "MATCH (p:Person) RETURN p.aeg",
            "query:1:27: error[unknown-attribute]: `Person` has no attribute `aeg` (did you mean `age`?)",
        ),
        (
            "MATCH (p:Person {aeg: 1}) RETURN p",
            "query:1:18: error[unknown-attribute]: `Person` has no attribute `aeg` (did you mean `age`?)",
        ),
        (
            "MATCH (p)-[e:in]->() RETURN e.sinse",
            "query:1:31: error[unknown-attribute]: `in` has no attribute `sinse` (did you mean `since`?)",
        ),
        (
            "MATCH (p) RETURN q",
            "query:1:18: error[unknown-variable]: unknown variable `q` (expected `p`)",
        ),
        (
            "MATCH (p) WITH p.name AS n RETURN p",
            "query:1:35: error[unknown-variable]: unknown variable `p` (expected `n`)",
        ),
        (
            "MATCH (p)-[*]->(q) RETURN p",
            "query:1:12: error[unbounded-path]: the path has no bound, or one beyond 64 (write the most edges, as in `*1..5`)",
        ),
        (
            "MATCH (p)-[*2..]->(q) RETURN p",
            "query:1:12: error[unbounded-path]: the path has no bound, or one beyond 64 (write the most edges, as in `*1..5`)",
        ),
        (
            "CREATE (p) RETURN p",
            "query:1:1: error[query-writes]: `CREATE` is not possible: a query changes nothing",
        ),
        (
            "MATCH (p) RETURN",
            "query:1:17: error[query-syntax]: expected a value, found the end of the query",
        ),
        (
            "MATCH (p RETURN p",
            "query:1:10: error[query-syntax]: expected `)`, found `RETURN`",
        ),
        (
            "MATCH (p) RETURN p.name p",
            "query:1:25: error[query-syntax]: expected the end of the query, found `p`",
        ),
        (
            "MATCH (p) WHERE count(p) > 1 RETURN p",
            "query:1:17: error[query-aggregate]: a condition cannot count or sum",
        ),
        (
            "RETURN siz('a')",
            "query:1:8: error[unknown-function]: unknown function `siz` (did you mean `size`?)",
        ),
        (
            "RETURN 'a",
            "query:1:8: error[query-syntax]: a string does not end",
        ),
        (
            "RETURN 99999999999999999999",
            "query:1:8: error[query-syntax]: the number is too large",
        ),
        (
            "RETURN 1 AS a, 2 AS a",
            "query:1:22: error[duplicate-name]: two columns are named `a`",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(refused(text, false).trim_end(), expected, "{text}");
    }
    // An open domain keeps what it does not know.
    let found = refused("MATCH (p:Persn) RETURN p.aeg", true);
    assert!(
        found.starts_with("query:1:10: warning[unknown-type]"),
        "{found}"
    );
    let deep = format!("RETURN {}1{}", "(".repeat(10_000), ")".repeat(10_000));
    assert!(refused(&deep, false).contains("error[nested-too-deep]"));
    let long = format!("RETURN {}1", "1 + ".repeat(10_000));
    assert!(refused(&long, false).contains("error[nested-too-deep]"));
    let variables: String = (0..300).map(|at| format!("1 AS a{at}, ")).collect();
    let found = refused(&format!("RETURN {variables}1 AS b"), false);
    assert!(found.contains("more than 256 variables"), "{found}");
    // Each chain is short, and the tree of all of them is deep.
    let mixed = format!(
        "RETURN {}1{}",
        "(1 + 1 + 1 * 1 * 1 * 1 OR 1 = 1 AND ".repeat(60),
        ")".repeat(60)
    );
    let found = refused(
        &format!("{mixed} + {}", mixed.trim_start_matches("RETURN ")),
        false,
    );
    assert!(found.contains("more than 512 operators"), "{found}");
    let long = format!("MATCH {}(a) RETURN a", "(),".repeat(10_000));
    assert!(refused(&long, false).contains("have more than 128 nodes"));
    assert!(refused(&format!("RETURN '{}'", "a".repeat(70_000)), false).contains("at most 65536"));
}

#[test]
fn a_query_keeps_to_its_budget() {
    let cross = "MATCH (a), (b), (c), (d), (e), (f) RETURN a";
    assert_eq!(
        run(cross, Budget::new(1_000_000, 1000)),
        Err(Error::Rows(1000))
    );
    assert_eq!(
        run(cross, Budget::new(1000, 1_000_000)),
        Err(Error::Steps(1000))
    );
    let text = "MATCH (p:Person) RETURN p.name + 1";
    let wrong = Error::Type("expected a number, found a text".to_owned());
    assert_eq!(run(text, Budget::default()), Err(wrong));
    assert_eq!(
        run("RETURN $nothing", Budget::default()),
        Err(Error::Parameter("nothing".to_owned()))
    );
    assert_eq!(
        run("RETURN 9223372036854775807 + 1", Budget::default()),
        Err(Error::Overflow)
    );
    // Each text is short enough, and all of them are too much.
    let text: String = (1..14)
        .map(|at| format!("WITH a{} + a{} AS a{at} ", at - 1, at - 1))
        .collect();
    let text = format!("WITH '{}' AS a0 {text}", "x".repeat(60));
    let crossed = format!("{text}MATCH (a), (b), (c), (d), (e) RETURN a13 + a13");
    assert_eq!(
        run(&crossed, Budget::new(10_000_000, 1_000_000)),
        Err(Error::Bytes(256))
    );
    let doubled: String = (1..40)
        .map(|at| format!("WITH a{} + a{} AS a{at} ", at - 1, at - 1))
        .collect();
    assert_eq!(
        run(
            &format!("WITH [1] AS a0 {doubled}RETURN a39"),
            Budget::default()
        ),
        Err(Error::Overflow)
    );
    // Small in memory, and long for those that print it.
    let nested: String = (1..12)
        .map(|at| {
            format!(
                "WITH [{}] AS a{at} ",
                vec![format!("a{}", at - 1); 8].join(", ")
            )
        })
        .collect();
    assert_eq!(
        run(
            &format!("WITH [1] AS a0 {nested}RETURN a11"),
            Budget::default()
        ),
        Err(Error::Overflow)
    );
}

#[test]
fn integers_and_floats_have_one_order() {
    let at = 9_007_199_254_740_992_i64;
    let cells = [
        Cell::Float(-1e300),
        Cell::Int(-1),
        Cell::Float(-0.5),
        Cell::Int(0),
        Cell::Float(0.5),
        Cell::Int(at - 1),
        Cell::Int(at),
        Cell::Int(at + 1),
        Cell::Float(9_007_199_254_740_994.0),
        Cell::Int(i64::MAX),
        Cell::Float(1e19),
        Cell::Float(f64::INFINITY),
    ];
    for (a, left) in cells.iter().enumerate() {
        for (b, right) in cells.iter().enumerate() {
            assert_eq!(left.sorted(right), a.cmp(&b), "{left:?} {right:?}");
        }
    }
    let whole = Cell::Float(at as f64);
    assert_eq!(whole.sorted(&Cell::Int(at)), std::cmp::Ordering::Equal);
    assert_eq!(whole.sorted(&Cell::Int(at + 1)), std::cmp::Ordering::Less);
}

#[test]
fn poses_and_chains_are_those_of_the_graph() {
    let port = |name: &str| Port {
        name: name.to_owned(),
        entity: "Room".to_owned(),
        ..Port::default()
    };
    let mut schema = schema(true);
    schema.relations.push(Relation {
        name: "seen_from".to_owned(),
        ports: vec![port("child"), port("parent")],
        pose: Some(Placed {
            child: 0,
            pose: PoseOf::One("pose".to_owned()),
        }),
        ..Relation::default()
    });
    let graph = Graph::new(schema.into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let mut last = None;
        for name in ["a", "b", "c", "d"] {
            let node = edit.add_node("Room")?;
            edit.set(node, "name", name)?;
            if let Some(last) = last.filter(|_| name != "d") {
                let edge = edit.add_edge("seen_from", node, last)?;
                edit.set(edge, "pose", [1.0, 0.5, 0.0, 0.0, 0.0, 0.0])?;
            }
            last = Some(node);
        }
        Ok::<(), property_graph::Error>(())
    });
    made.expect("a graph");
    let now = graph.snapshot();
    let ask = |text: &str, budget: Budget| {
        let mut sources = SourceMap::new();
        let source = sources.add("query", text);
        let (query, found) = Query::prepare(&sources, source, now.schema());
        match query {
            Some(query) => query.run(&now, &HashMap::new(), budget).map(|rows| {
                let shown = |row: &Vec<Cell>| row.iter().map(|cell| cell.shown(&now)).collect();
                let rows: Vec<String> = rows.cells.iter().map(shown).collect();
                rows.join("; ")
            }),
            None => Ok(render(&sources, &found, Format::Short)),
        }
    };
    let between = |a: &str, b: &str, what: &str| {
        format!("MATCH (a {{name: '{a}'}}), (b {{name: '{b}'}}) RETURN {what}")
    };
    let cases = [
        ("a", "c", "pose(a, b)", "[2.0, 1.0, 0.0, 0.0, 0.0, 0.0]"),
        ("c", "b", "pose(a, b)", "[-1.0, -0.5, 0.0, 0.0, 0.0, 0.0]"),
        (
            "a",
            "b",
            "chain(a, b)",
            "[seen_from of b in a: translation (1, 0.5, 0), rotation (0, 0, 0)]",
        ),
        ("a", "c", "size(chain(a, b))", "2"),
        ("a", "a", "chain(a, b)", "[]"),
        ("a", "d", "pose(a, b)", "null"),
        ("a", "d", "chain(a, b)", "null"),
        ("a", "b", "pose(a, null)", "null"),
    ];
    for (a, b, what, expected) in cases {
        let found = ask(&between(a, b, what), Budget::default());
        let found = found.unwrap_or_else(|error| panic!("{what}: {error}"));
        // Zeros have no sign here.
        assert_eq!(
            found.replace("-0.0", "0.0"),
            expected,
            "{what} of {a} and {b}"
        );
    }
    let wrong = ask(&between("a", "b", "pose(a, 1)"), Budget::default());
    let expected = "expected a node, found an integer";
    assert_eq!(wrong, Err(Error::Type(expected.to_owned())));
    let wrong = ask(&between("a", "b", "pose(a)"), Budget::default()).expect("a text");
    assert!(
        wrong.contains("`pose` takes 2 arguments, found 1"),
        "{wrong}"
    );
    let pairs = "MATCH (a), (b) RETURN chain(a, b), chain(b, a), pose(a, b), pose(b, a)";
    assert_eq!(ask(pairs, Budget::new(200, 100)), Err(Error::Walks));
    assert!(ask(pairs, Budget::new(1000, 100)).is_ok());
}

/// A part of the condition is tested as soon as its variables are known, and a name is looked up.
#[test]
fn conditions_bound_the_search() {
    let graph = Graph::new(Schema::anything().into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        let mut nodes = Vec::new();
        for at in 0..300_i64 {
            let node = edit.add_node("thing")?;
            edit.set(node, "name", format!("n{at}"))?;
            edit.set(node, "x", at)?;
            nodes.push(node);
        }
        for at in 0..300 {
            for step in 1..=10 {
                edit.add_edge("to", nodes[at], nodes[(at + step) % 300])?;
            }
        }
        Ok::<(), property_graph::Error>(())
    });
    made.expect("a graph");
    let now = graph.snapshot();
    let run = |text: &str, steps: u64| {
        let mut sources = SourceMap::new();
        let source = sources.add("query", text);
        let (query, found) = Query::prepare(&sources, source, now.schema());
        assert_eq!(render(&sources, &found, Format::Short), "", "{text}");
        let parameters: HashMap<String, Cell> = [("name".to_owned(), "n7".into())].into();
        let query = query.expect("a query");
        query.run(&now, &parameters, Budget::new(steps, 1000))
    };
    let pattern = "MATCH (a:thing)-[:to]->(b)-[:to]->(c)";
    for (condition, steps, rows) in [
        ("a.name = 'n7'", 700, 100),
        ("'n7' = a.name", 700, 100),
        ("a.name = $name AND b.x = 8", 200, 10),
        ("c.name = $name AND a.x = 5", 700, 1),
        ("c.name = 'n7' AND b.x = 5 AND a.x = 3", 200, 1),
        ("a.x = 7 AND b.x < 0", 2000, 0),
    ] {
        let text = format!("{pattern} WHERE {condition} RETURN a.x");
        let found = run(&text, steps).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(found.cells.len(), rows, "{text}");
    }
    // Either part alone decides nothing.
    let text = format!("{pattern} WHERE a.name = 'n7' OR b.x = 8 RETURN a.x");
    assert_eq!(run(&text, 2000), Err(Error::Steps(2000)));
    // A part that cannot be computed is an error only of a row that the others accept.
    let wrong = format!("{pattern} WHERE a.name = 'n7' AND abs(a.name) > 1 RETURN a.x");
    assert!(matches!(run(&wrong, 10_000), Err(Error::Type(_))));
    let unseen = format!("{pattern} WHERE abs(a.name) > 1 AND b.x = -1 RETURN a.x");
    assert_eq!(run(&unseen, 100_000).map(|rows| rows.cells.len()), Ok(0));
}

#[test]
fn the_number_of_a_sample_is_never_another_one() {
    let number = |sequence| {
        let sample = Sample {
            topic: "a".to_owned(),
            kind: "b".to_owned(),
            sequence,
        };
        match Cell::from(&Value::from(sample)) {
            Cell::List(all) => all[2].clone(),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(number(42), Cell::Int(42));
    assert_eq!(number(u64::MAX), Cell::from("18446744073709551615"));
}
