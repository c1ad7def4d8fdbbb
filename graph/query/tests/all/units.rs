//! Units in queries: of attributes, of numbers that a query writes, and of the columns.

use graph_query::{Budget, Cell, Query, Rows};
use property_graph::schema::{Attribute, Entity, Kind};
use property_graph::{Graph, Schema, Snapshot, Time};
use rc_diagnostics::{Format, SourceMap, render};
use std::sync::Arc;

/// A stone of 0.5 kg and 20 cm, a car of 1200 kg and 3 m, which may carry 400,000 g.
fn graph() -> Arc<Snapshot> {
    let attribute = |name: &str, kind: Kind, unit: Option<&str>| Attribute {
        name: name.to_owned(),
        kind,
        unit: unit.map(str::to_owned),
        range: None,
        optional: true,
        key: false,
        history: None,
        doc: Vec::new(),
    };
    let schema = Schema {
        name: "things".to_owned(),
        entities: vec![Entity {
            name: "Thing".to_owned(),
            attributes: vec![
                attribute("name", Kind::Text, None),
                attribute("count", Kind::Int, None),
                attribute("mass", Kind::Float, Some("kg")),
                attribute("payload", Kind::Float, Some("g")),
                attribute("length", Kind::Float, Some("m")),
                attribute("warmth", Kind::Float, Some("°C")),
                attribute("sizes", Kind::Floats(None), Some("m")),
                attribute("odd", Kind::Float, Some("banana")),
            ],
            ..Entity::default()
        }],
        ..Schema::default()
    };
    let graph = Graph::new(schema.into(), 1);
    let made = graph.change(Time::ZERO, |edit| {
        for (name, mass, payload, length) in [
            ("stone", 0.5, None, 0.2),
            ("car", 1200.0, Some(400_000.0), 3.0),
        ] {
            let thing = edit.add_node("Thing")?;
            edit.set(thing, "name", name)?;
            edit.set(thing, "count", 2_i64)?;
            edit.set(thing, "mass", mass)?;
            edit.set(thing, "length", length)?;
            edit.set(thing, "warmth", 20.0)?;
            edit.set(thing, "odd", 1.0)?;
            edit.set(thing, "sizes", [length, 1.0].as_slice())?;
            if let Some(payload) = payload {
                edit.set(thing, "payload", payload)?;
            }
        }
        Ok::<(), property_graph::Error>(())
    });
    made.expect("a graph");
    graph.snapshot()
}

fn prepared(text: &str) -> (Option<Query>, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("query", text);
    let (query, found) = Query::prepare(&sources, source, graph().schema());
    (query, render(&sources, &found, Format::Short))
}

fn rows(text: &str) -> Rows {
    let (query, found) = prepared(text);
    assert_eq!(found, "", "{text}");
    let parameters = [("limit".to_owned(), Cell::Int(500))].into();
    let query = query.expect("a query");
    let rows = query.run(&graph(), &parameters, Budget::default());
    rows.unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn names(condition: &str) -> Vec<String> {
    let found = rows(&format!(
        "MATCH (o:Thing) WHERE {condition} RETURN o.name ORDER BY o.name"
    ));
    let cells = found.cells.iter().map(|row| row[0].shown(&graph()));
    cells.collect()
}

#[test]
fn numbers_with_a_unit_are_converted_to_that_of_the_attribute() {
    for (condition, found) in [
        ("o.mass >= 500 unit \"g\"", vec!["car", "stone"]),
        ("o.mass > 500 unit \"g\"", vec!["car"]),
        ("500 unit 'g' < o.mass", vec!["car"]),
        ("o.mass > -500 unit \"g\"", vec!["car", "stone"]),
        ("o.mass = 0.5", vec!["stone"]),
        ("o.mass = 500 unit \"g\"", vec!["stone"]),
        ("o.mass IN [500 unit \"g\", 7 unit \"kg\"]", vec!["stone"]),
        ("o.mass > $limit unit \"g\"", vec!["car"]),
        ("o.length < 30 unit \"cm\"", vec!["stone"]),
        ("o.sizes[0] < 30 unit \"cm\"", vec!["stone"]),
        ("o.sizes = [20 unit \"cm\", 1 unit \"m\"]", vec!["stone"]),
        ("o.warmth < 293.2 unit \"K\"", vec!["car", "stone"]),
        ("o.warmth < 293.1 unit \"K\"", vec![]),
        // Attributes of one quantity, where somebody says the unit.
        ("o.payload unit \"kg\" < o.mass", vec!["car"]),
        ("o.payload < o.mass unit \"g\"", vec!["car"]),
        ("o.mass + 600 unit \"g\" < 1.2", vec!["stone"]),
        ("o.mass + 600 unit \"g\" < 1200 unit \"g\"", vec!["stone"]),
        ("o.mass / o.length < 3 unit \"kg/m\"", vec!["stone"]),
        ("o.mass * o.count < 1.5 unit \"kg\"", vec!["stone"]),
        ("o.length * o.length < 500 unit \"cm^2\"", vec!["stone"]),
        (
            "coalesce(o.payload, 0 unit \"kg\") > 1 unit \"kg\"",
            vec!["car"],
        ),
        // A plain number has the unit of the other side, as in a rule.
        ("o.payload > 1", vec!["car"]),
    ] {
        assert_eq!(names(condition), found, "{condition}");
    }
    let text = "MATCH (o:Thing {mass: 500 unit \"g\"}) RETURN o.name";
    assert_eq!(rows(text).cells, [["stone".into()]]);
}

#[test]
fn columns_tell_their_units() {
    let text = "MATCH (o:Thing) WHERE o.name = 'car' WITH o, o.mass unit \"t\" AS tons \
        RETURN o.name, o.mass, tons, sum(o.length) AS all, count(o.mass) AS n, \
        max(o.payload unit \"kg\") AS most, o.mass / o.length AS part, o.mass * 2 AS two, \
        -tons AS less, abs(tons) AS size, [o.mass] AS list";
    let found = rows(text);
    let units: Vec<&str> = found
        .units
        .iter()
        .map(|u| u.as_deref().unwrap_or("-"))
        .collect();
    assert_eq!(
        units,
        [
            "-", "kg", "t", "m", "-", "kg", "(kg)/(m)", "kg", "t", "t", "kg"
        ]
    );
    let cells: Vec<String> = found.cells[0]
        .iter()
        .map(|cell| cell.shown(&graph()))
        .collect();
    assert_eq!(cells[1..6], ["1200.0", "1.2", "3.0", "1", "400.0"]);
}

#[test]
fn numbers_of_different_units_are_refused_at_their_place() {
    for (condition, expected) in [
        (
            "o.mass > 5 unit \"m\"",
            "query:1:39: error[unit-mismatch]: `mass` is in `kg`, but a number is in `m` (`m` and `kg` measure different things)",
        ),
        (
            "o.mass < o.payload",
            "query:1:34: error[unit-mismatch]: `mass` is in `kg`, but `payload` is in `g` (1 g is 0.001 kg; `unit \"kg\"` after a value converts it)",
        ),
        (
            "o.mass + o.length > 1",
            "query:1:34: error[unit-mismatch]: `mass` is in `kg`, but `length` is in `m` (`m` and `kg` measure different things)",
        ),
        (
            "o.mass unit \"m\" > 1",
            "query:1:35: error[unit-mismatch]: `mass` is in `kg`, expected `m` (`kg` and `m` measure different things)",
        ),
        (
            "o.mass IN [1 unit \"kg\", o.length]",
            "query:1:49: error[unit-mismatch]: a number is in `kg`, but `length` is in `m` (`m` and `kg` measure different things)",
        ),
        (
            "o.mass / o.length > 1 unit \"kg\"",
            "query:1:50: error[unit-mismatch]: `mass` is in `(kg)/(m)`, but a number is in `kg` (`kg` and `(kg)/(m)` measure different things)",
        ),
        // 5 K more are 5 °C more, and 5 K is -268 °C.
        (
            "o.warmth + 5 unit \"K\" > 20",
            "query:1:41: error[unit-mismatch]: `warmth` is in `°C`, but a number is in `K` (`K` and `°C` are two scales of one quantity; write a difference without a unit, as a number in `°C`)",
        ),
        (
            "o.mass > 1 unit \"kilo\"",
            "query:1:39: warning[unknown-unit]: unknown unit `kilo`",
        ),
        (
            "o.mass > 1 unit \"\\n\\u202e\"",
            "query:1:39: warning[unknown-unit]: ",
        ),
    ] {
        let (query, found) = prepared(&format!("MATCH (o:Thing) WHERE {condition} RETURN o"));
        assert!(found.contains(expected), "{condition}: {found}");
        assert!(found.contains("unit-mismatch"), "{condition}: {found}");
        assert!(query.is_none(), "{condition}");
    }
    let (_, found) = prepared("MATCH (o:Thing {mass: 5 unit \"m\"}) RETURN o.name");
    assert!(
        found.starts_with("query:1:30: error[unit-mismatch]"),
        "{found}"
    );
    // Behind `WITH`, a number keeps its unit.
    let (_, found) =
        prepared("MATCH (o:Thing) WITH o.mass AS w, o.length AS l WHERE w = l RETURN w");
    assert!(
        found.starts_with("query:1:37: error[unit-mismatch]"),
        "{found}"
    );
    // A text has none.
    let (query, _) = prepared("RETURN 'a' unit \"kg\" AS x, 1 unit AS y");
    assert!(query.is_none());
}
