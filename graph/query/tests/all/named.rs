//! Queries of a schema as functions: what they accept.

use graph_query::{Budget, Cell, Error, Queries};
use property_graph::schema::{Entity, Query};
use property_graph::{Graph, Schema, Time};

const KINDS: [&str; 8] = [
    "bool", "int", "long", "float", "double", "string", "bytes", "Room",
];

fn schema() -> Schema {
    let entity = |name: &str, parent: Option<&str>| Entity {
        name: name.to_owned(),
        parent: parent.map(str::to_owned),
        ..Entity::default()
    };
    let query = |kind: &&str| Query {
        name: format!("echo_{kind}"),
        parameters: vec![("value".to_owned(), (*kind).to_owned())],
        text: "MATCH (k:Kitchen) RETURN $value".to_owned(),
    };
    Schema {
        entities: vec![
            entity("Room", None),
            entity("Kitchen", Some("Room")),
            entity("Person", None),
        ],
        queries: KINDS.iter().chain(&["pose"]).map(query).collect(),
        ..Schema::anything()
    }
}

/// Each type accepts its own values and no others.
#[test]
fn parameters_have_the_types_that_the_schema_declares() {
    let graph = Graph::new(schema().into(), 1);
    let [kitchen, person] = ["Kitchen", "Person"].map(|kind| {
        let made = graph.change(Time::ZERO, |edit| edit.add_node(kind));
        made.expect("a node")
    });
    let removed = graph.fork(2);
    let gone = removed.change(Time::ZERO, |edit| edit.add_node("Room"));
    let gone = gone.expect("a node");
    let now = graph.snapshot();
    let queries = Queries::of(now.schema());
    let list = |count: usize| Cell::List(vec![Cell::Float(0.5); count].into());
    let values: [(Cell, &[&str]); 11] = [
        (true.into(), &["bool"]),
        (7.into(), &["int", "long", "float", "double"]),
        (0.5.into(), &["float", "double"]),
        (f64::NAN.into(), &[]),
        ("a".into(), &["string"]),
        (Cell::Bytes([1].into()), &["bytes"]),
        (list(6), &["pose"]),
        (list(5), &[]),
        (kitchen.into(), &["Room"]),
        (person.into(), &[]),
        (gone.into(), &[]),
    ];
    for (value, accepted) in &values {
        for kind in KINDS.iter().chain(&["pose"]) {
            let parameters = [("value", value.clone())];
            let budget = Budget::default();
            let rows = queries.run(&now, &format!("echo_{kind}"), parameters, budget);
            if accepted.contains(kind) {
                // An integer becomes the float that the schema declares.
                let expected = match (*kind, value) {
                    ("float" | "double", Cell::Int(_)) => Cell::Float(7.0),
                    (_, value) => value.clone(),
                };
                let expected = [[expected]];
                assert_eq!(rows.expect("rows").cells, expected, "{kind}: {value:?}");
            } else {
                let refused = matches!(rows, Err(Error::Argument { .. }));
                assert!(refused, "{kind}: {value:?}: {rows:?}");
            }
        }
    }
}

#[test]
fn texts_become_values_of_the_type_of_a_parameter() {
    let graph = Graph::new(schema().into(), 1);
    let node = |kind: &str, name: &str| {
        let made = graph.change(Time::ZERO, |edit| {
            let node = edit.add_node(kind)?;
            edit.set(node, "name", name)?;
            Ok::<_, property_graph::Error>(node)
        });
        made.expect("a node")
    };
    let kitchen = node("Kitchen", "here");
    node("Person", "here");
    node("Room", "twice");
    node("Room", "twice");
    let now = graph.snapshot();
    let queries = Queries::of(now.schema());
    let read = |kind: &str, text: &str| {
        let read = queries.argument(&now, &format!("echo_{kind}"), "value", text);
        read.map_err(|error| error.to_string())
    };
    let pose = [1.0, 2.0, 3.0, 0.0, 0.0, 0.5].map(Cell::Float);
    assert_eq!(read("bool", "true"), Ok(true.into()));
    assert_eq!(read("long", "-7"), Ok((-7).into()));
    assert_eq!(read("double", "1e3"), Ok(1000.0.into()));
    assert_eq!(read("string", "12"), Ok("12".into()));
    assert_eq!(read("pose", "1, 2,3,0,0,.5"), Ok(Cell::List(pose.into())));
    assert_eq!(read("Room", "here"), Ok(kitchen.into()));
    for (kind, text, expected) in [
        ("bool", "yes", "is `yes`, expected `true` or `false`"),
        ("int", "1.5", "is `1.5`, expected an integer"),
        ("float", "inf", "is `inf`, expected a number"),
        ("pose", "1,2,3", "is `1,2,3`, expected a pose"),
        ("bytes", "ab", "is `ab`, expected bytes"),
        ("Room", "nowhere", "with the name `nowhere`, found 0"),
        ("Room", "twice", "with the name `twice`, found 2"),
    ] {
        let error = read(kind, text).expect_err("a refused text");
        assert!(error.contains(expected), "{error}");
    }
}

/// The caller learns which query or parameter is meant, and which text of the schema is wrong.
#[test]
fn names_and_texts_are_checked() {
    let graph = Graph::new(schema().into(), 1);
    let now = graph.snapshot();
    let queries = Queries::of(now.schema());
    let run = |name: &str, parameters: &[(&str, Cell)]| {
        let rows = queries.run(&now, name, parameters.to_vec(), Budget::default());
        rows.expect_err("a refused call").to_string()
    };
    let value = || ("value", Cell::Int(7));
    assert_eq!(
        run("echo_itn", &[value()]),
        "the schema has no query `echo_itn`; did you mean `echo_int`?"
    );
    assert_eq!(
        run("echo_int", &[("valu", 7.into())]),
        "the query `echo_int` has no parameter `valu`; did you mean `value`?"
    );
    assert_eq!(run("echo_int", &[]), "the parameter `$value` has no value");
}

/// A query with a fault says so when it is called; the others of its schema work.
#[test]
fn a_wrong_query_stops_no_other_one() {
    let query = |name: &str, text: &str| Query {
        name: name.to_owned(),
        parameters: Vec::new(),
        text: text.to_owned(),
    };
    let schema = Schema {
        queries: vec![
            query("broken", "MATCH (k:Kitchen) RETURN $value"),
            query("all", "MATCH (k:Room) RETURN count(*)"),
            query("unreadable", "MATCH (k"),
        ],
        ..schema()
    };
    let graph = Graph::new(schema.into(), 1);
    let now = graph.snapshot();
    let queries = Queries::of(now.schema());
    let run = |name: &str| queries.run(&now, name, [], Budget::default());
    let expected = "broken:1:27: error[unknown-parameter]: unknown parameter `$value`";
    assert_eq!(run("broken").expect_err("a fault").to_string(), expected);
    assert_eq!(run("all").expect("rows").cells, [[Cell::Int(0)]]);
    let faults: Vec<(&str, String)> = queries
        .faults()
        .map(|(name, error)| (name, error.to_string()))
        .collect();
    let names: Vec<&str> = faults.iter().map(|(name, _)| *name).collect();
    assert_eq!(names, ["broken", "unreadable"]);
    assert_eq!(faults[0].1, expected);
}
