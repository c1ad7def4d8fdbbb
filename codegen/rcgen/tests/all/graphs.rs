//! `rcgen query` over a graph of the user: named queries and their parameters.

use crate::folders::rcgen;

const KITCHEN: &str = r#"Domain kitchen
{
    entity Room
    {
        name string key;
    };
    query room(room Room) "MATCH (r:Room) WHERE r = $room RETURN r.name";
    query called(text string) "MATCH (r:Room) WHERE r.name = $text RETURN r.name";
};
"#;

/// A finding in the text of a query has its place in the file of the schema.
#[test]
fn queries_of_a_schema_are_checked_with_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("kitchen.gdsl");
    std::fs::write(&path, KITCHEN).expect("a file");
    let (code, out, err) = rcgen(folder.path(), &["check", "kitchen.gdsl"]);
    assert_eq!(code, 0, "{out}{err}");
    let more = [
        r#"    query a() "MATCH (r:Rom) RETURN r.name";"#,
        r#"    query b(room Room) "MATCH (r:Room) WHERE r = $rom RETURN r.nam";"#,
        r#"    query c() "MATCH (r:Room RETURN r";"#,
        r#"    query d() "MATCH (r:Room) WHERE r.name = \"x\" RETURN r.size";"#,
    ];
    let text = KITCHEN.replace("\n};\n", &format!("\n{}\n}};\n", more.join("\n")));
    std::fs::write(&path, text).expect("a file");
    let args = ["check", "--format", "short", "kitchen.gdsl"];
    let (code, out, err) = rcgen(folder.path(), &args);
    assert_eq!(code, 1, "{out}{err}");
    for expected in [
        "kitchen.gdsl:9:25: error[unknown-type]: the schema has no entity `Rom`",
        "kitchen.gdsl:10:51: error[unknown-parameter]: unknown parameter `$rom`",
        "kitchen.gdsl:10:64: error[unknown-attribute]: `Room` has no attribute `nam`",
        "kitchen.gdsl:11:30: error[query-syntax]",
        "kitchen.gdsl:12:15: error[unknown-attribute]: `Room` has no attribute `size`",
    ] {
        assert!(err.contains(expected), "{expected}\nin\n{out}{err}");
    }
    // Each wrong query is a finding of its own, and the others answer.
    let graph = r#"{"schema": "kitchen.gdsl", "nodes": [
    {"id": "1:1", "type": "Room", "attributes": {"name": "a"}}], "edges": []}"#;
    std::fs::write(folder.path().join("a.graph"), graph).expect("a file");
    let run = |query: &[&str]| rcgen(folder.path(), &[&["query", "a.graph"], query].concat());
    let (code, out, err) = run(&["room", "room=a"]);
    assert_eq!((code, out.as_str()), (0, "r.name\na\n"), "{err}");
    let (code, out, err) = run(&["a"]);
    assert_eq!((code, out.as_str()), (1, ""), "{err}");
    assert!(err.contains("the schema has no entity `Rom`"), "{err}");
}

/// Each reader of InnerModel files starts with a world that a network has kept.
#[test]
fn the_frames_of_a_graph_become_an_innermodel_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = r#"<innerModel>
    <transform id="table" tx="1000" rz="0.5">
        <plane id="top" size="800,20,600"/>
        <laser id="front"/>
    </transform>
</innerModel>
"#;
    std::fs::write(folder.path().join("a.xml"), scene).expect("a file");
    let run = |args: &[&str]| rcgen(folder.path(), args);
    let import = |from: &str, to: &str| run(&["import", from, "--out", to]);
    for (from, to) in [
        ("a.xml", "a.graph"),
        ("a.graph", "b.xml"),
        ("b.xml", "b.graph"),
    ] {
        let (code, out, err) = import(from, to);
        assert_eq!(code, 0, "{from}: {out}{err}");
    }
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("a file");
    assert_eq!(read("b.graph"), read("a.graph"));
    assert!(
        read("b.xml").contains("<laser id=\"front\""),
        "{}",
        read("b.xml")
    );

    let graph = r#"{"schema": "kitchen.gdsl", "nodes": [], "edges": []}"#;
    std::fs::write(folder.path().join("kitchen.gdsl"), KITCHEN).expect("a file");
    std::fs::write(folder.path().join("c.graph"), graph).expect("a file");
    let (code, _, err) = import("c.graph", "c.xml");
    assert_eq!(code, 1, "{err}");
    let expected = "c.graph: its schema has no relation with poses, such as `RT` of geometry.gdsl";
    assert!(err.contains(expected), "{err}");
}

#[test]
fn a_parameter_has_the_type_that_its_query_declares() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    write("kitchen.gdsl", KITCHEN);
    let rooms: Vec<String> = ["12", "inf"]
        .iter()
        .enumerate()
        .map(|(at, name)| {
            format!(
                r#"{{"id": "1:{}", "type": "Room", "attributes": {{"name": "{name}"}}}}"#,
                at + 1
            )
        })
        .collect();
    let graph = format!(
        "{{\"schema\": \"kitchen.gdsl\", \"nodes\": [\n{}\n], \"edges\": []}}\n",
        rooms.join(",\n")
    );
    write("rooms.graph", &graph);
    for (query, parameter, answer) in [
        ("room", "room=12", "r.name\n12\n"),
        ("room", "room=inf", "r.name\ninf\n"),
        ("called", "text=12", "r.name\n12\n"),
    ] {
        let args = ["query", "rooms.graph", query, parameter];
        let (code, out, err) = rcgen(folder.path(), &args);
        assert_eq!((code, out.as_str()), (0, answer), "{err}");
    }
    let args = ["query", "rooms.graph", "room", "room=13"];
    let (code, _, err) = rcgen(folder.path(), &args);
    assert_eq!(code, 2);
    let expected = "expected one node of type `Room` with the name `13`, found 0";
    assert!(err.contains(expected), "{err}");
    for (args, expected) in [
        (vec!["rom"], "no query `rom`; did you mean `room`?"),
        (vec!["room"], "the parameter `$room` has no value"),
        (
            vec!["room", "rom=12"],
            "no parameter `rom`; did you mean `room`?",
        ),
        (vec!["room", "room"], "expected NAME=VALUE, found `room`"),
    ] {
        let args = [vec!["query", "rooms.graph"], args].concat();
        let (code, out, err) = rcgen(folder.path(), &args);
        assert_eq!((code, out.as_str()), (2, ""), "{err}");
        assert!(err.contains(expected), "{expected}\nin\n{err}");
    }
    let (code, out, err) = rcgen(folder.path(), &["query", "rooms.graph"]);
    let listed = "room(room Room)\ncalled(text string)\n";
    assert_eq!((code, out.as_str()), (0, listed), "{err}");
    let text = "MATCH (r:Room) WHERE r.name = toString($n) RETURN r.name";
    let (code, out, err) = rcgen(folder.path(), &["query", "rooms.graph", text, "n=12"]);
    assert_eq!((code, out.as_str()), (0, "r.name\n12\n"), "{err}");
}

/// A type finds nodes of the types that inherit from it, also in files, and as parameters.
#[test]
fn a_query_of_a_file_knows_which_types_inherit() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    let more = "    entity Kitchen : Room { };\n};\n";
    let schema = KITCHEN.strip_suffix("};\n").expect("a domain");
    write("kitchen.gdsl", &format!("{schema}{more}"));
    let node = r#"{"id": "1:1", "type": "Kitchen", "attributes": {"name": "a"}}"#;
    let graph = format!("{{\"schema\": \"kitchen.gdsl\", \"nodes\": [{node}]}}\n");
    write("rooms.graph", &graph);
    for args in [["room", "room=a"], ["called", "text=a"]] {
        let args = [["query", "rooms.graph"], args].concat();
        let (code, out, err) = rcgen(folder.path(), &args);
        assert_eq!((code, out.as_str()), (0, "r.name\na\n"), "{err}");
    }
}

/// MM11 of `RobMoSys` D3.2: the parts of all domains, joined, are the file.
#[test]
fn parts_of_domains_are_written_and_joined() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    let schema = KITCHEN.replace(
        "    query room",
        "    relation sees { room Room; frame Frame; };\n    query room",
    );
    let schema = format!("import \"geometry.gdsl\";\n{schema}");
    write("kitchen.gdsl", &schema);
    let house = r#"{
  "schema": "kitchen.gdsl",
  "nodes": [
    {"id": "1:1", "type": "Room", "attributes": {"name": "a"}},
    {"id": "1:2", "type": "Frame", "attributes": {"name": "b"}},
    {"id": "1:3", "type": "Frame", "attributes": {"name": "c"}}
  ],
  "edges": [
    {"id": "1:4", "type": "sees", "from": "1:1", "to": "1:3"}
  ]
}
"#;
    write("house.graph", house);
    let run = |args: &[&str]| rcgen(folder.path(), args);
    let export = ["export", "house.graph", "--to", "graph", "--out", "."];
    for domain in ["geometry", "kitchen"] {
        let (code, out, err) = run(&[&export[..], &["--domain", domain]].concat());
        assert_eq!(code, 0, "{out}{err}");
        let file = format!("house.{domain}.graph");
        let (code, out, err) = run(&["check", &file]);
        assert_eq!(code, 0, "{out}{err}");
        let part = std::fs::read_to_string(folder.path().join(&file)).expect("a part");
        assert_ne!(part, house);
    }
    let parts = ["house.kitchen.graph", "house.geometry.graph"];
    let join = ["import", parts[0], parts[1], "--out", "joined.graph"];
    let (code, out, err) = run(&join);
    assert_eq!(code, 0, "{out}{err}");
    let joined = std::fs::read_to_string(folder.path().join("joined.graph"));
    assert_eq!(joined.expect("a graph"), house);
    let changed = house.replace("\"c\"", "\"d\"");
    write("other.graph", &changed);
    let args = ["import", "house.graph", "other.graph", "--out", "no.graph"];
    let (code, _, err) = run(&args);
    assert_eq!(code, 1);
    let expected = "other.graph: 1:3 is not the same element in both graphs";
    assert!(err.contains(expected), "{err}");
    assert!(!folder.path().join("no.graph").exists());
    std::fs::create_dir(folder.path().join("old")).expect("a folder");
    write("old/house.graph", house);
    let older = schema.replace("string key", "string");
    write("old/kitchen.gdsl", &older);
    let args = [
        "import",
        "house.graph",
        "old/house.graph",
        "--out",
        "no.graph",
    ];
    let (code, _, err) = run(&args);
    assert_eq!(code, 1);
    let expected = "old/house.graph: the graphs have different schemas:\n  \
                    Room.name: `string key` in the first schema, `string` in the second\n";
    assert!(err.contains(expected), "{err}");
    for (more, expected) in [
        (
            vec!["--domain", "geometri"],
            "no domain `geometri`; did you mean `geometry`?",
        ),
        (vec![], "`--to graph` needs `--domain`"),
    ] {
        let (code, _, err) = run(&[&export[..], &more].concat());
        assert_eq!(code, 2, "{err}");
        assert!(err.contains(expected), "{err}");
    }
}

/// A graph and its schema as pictures and as JSON, with an edge to an edge.
#[test]
fn graphs_and_schemas_are_drawn_and_viewed() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    let text = "import \"measurement.gdsl\";\nDomain lab { entity Cup : Frame { mass float unit \"kg\"; }; };\n";
    write("lab.gdsl", text);
    write(
        "lab.graph",
        r#"{"schema": "lab.gdsl", "nodes": [
    {"id": "1:1", "type": "Frame", "attributes": {"name": "table"}},
    {"id": "1:2", "type": "Cup", "attributes": {"name": "cup", "mass": 0.2}},
    {"id": "1:3", "type": "Measurement", "attributes": {"time": 3}}], "edges": [
    {"id": "1:4", "type": "RT", "from": "1:1", "to": "1:2", "attributes": {"pose": [1, 0, 0, 0, 0, 0]}},
    {"id": "1:5", "type": "measured_by", "from": "1:4", "to": "1:3"}]}"#,
    );
    let run = |args: &[&str]| rcgen(folder.path(), args);
    let (code, out, err) = run(&["check", "lab.graph"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    for (file, expected) in [
        ("lab.graph", "measured_by"),
        ("lab.gdsl", "mass float unit &quot;kg&quot;"),
    ] {
        let (code, svg, err) = run(&["graph", file]);
        assert_eq!(code, 0, "{err}");
        assert!(svg.starts_with("<svg ") && svg.contains(expected), "{svg}");
        let (code, _, err) = run(&["graph", file, "-o", "lab.dot"]);
        assert_eq!(code, 0, "{err}");
        let dot = std::fs::read_to_string(folder.path().join("lab.dot")).expect("a file");
        assert!(dot.starts_with("digraph \"lab\" {\n"), "{dot}");
        let (_, printed, _) = run(&["graph", file, "--to", "dot"]);
        assert_eq!(printed, dot);
    }
    let (code, out, err) = run(&["export", "lab.graph", "--to", "turtle", "--out", "."]);
    assert_eq!(code, 0, "{out}{err}");
    for (file, expected) in [
        (
            "lab.ttl",
            "<urn:robocomp:element:1:2> a <urn:robocomp:domain:lab#Cup>",
        ),
        (
            "lab.shapes.ttl",
            "<urn:robocomp:domain:lab#Cup> a rdfs:Class, sh:NodeShape",
        ),
    ] {
        let text = std::fs::read_to_string(folder.path().join(file)).expect("a file");
        assert!(text.contains(expected), "{text}");
    }
    // One of the two files is there: nothing is written.
    let shapes = folder.path().join("lab.shapes.ttl");
    std::fs::remove_file(&shapes).expect("a file");
    let (code, out, err) = run(&["export", "lab.graph", "--to", "turtle", "--out", "."]);
    assert_eq!((code, out.as_str()), (2, ""), "{err}");
    assert!(!shapes.exists());
    let (code, json, err) = run(&["view", "lab.graph"]);
    assert_eq!(code, 0, "{err}");
    let view: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let cup = &view["nodes"][1];
    assert_eq!(cup["types"], serde_json::json!(["Cup", "Frame"]));
    assert_eq!(cup["domain"], "lab");
    assert_eq!(
        cup["attributes"]["mass"],
        serde_json::json!({ "value": 0.2, "unit": "kg" })
    );
    assert_eq!(view["edges"][1]["from"], "1:4");
    let (code, json, err) = run(&["view", "lab.gdsl"]);
    assert_eq!(code, 0, "{err}");
    let schema: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(schema, view["schema"]);
    let reflected = "MATCH (m:Measurement)<-[:measured_by]-(p)-[:instance_of]->(t)-[:instance_of]->(d:Domain) \
         RETURN t.name, d.name, mid(p), mmid(m)";
    let (code, out, err) = run(&["query", "lab.graph", reflected, "--reflect"]);
    assert_eq!(code, 0, "{err}");
    assert!(
        out.ends_with("\nRT      geometry  RT      measurement\n"),
        "{out}"
    );
    write(
        "rover.smdsl",
        "rover { initial_state a; end_state b; transitions { a => b; }; };\n",
    );
    let (code, _, err) = run(&["graph", "rover.smdsl", "--to", "dot"]);
    assert_eq!(code, 2, "{err}");
    assert!(
        err.contains("a state machine is drawn as svg only"),
        "{err}"
    );
    let (code, _, err) = run(&["graph", "lab.png"]);
    assert_eq!(code, 2);
    assert!(err.contains("expected a file with the extension"), "{err}");
    write("other.json", "{}");
    let (code, _, err) = run(&["view", "other.json"]);
    assert_eq!(code, 1);
    assert!(err.contains("other-format"), "{err}");
}

/// `rcgen fmt` lays a graph out; one with an error stays as it is.
#[test]
fn a_graph_is_laid_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.graph");
    let text = r#"{"edges": [{"id": "1:3", "type": "in", "from": "1:2", "to": "1:1"}],
        "nodes": [{"type": "Cup", "id": "1:2", "attributes": {"name": "c", "mass": {"unit": "kg", "value": 1e0}}},
        {"id": "1:1", "type": "Room"}]}"#;
    std::fs::write(&path, text).expect("a file");
    let (code, out, err) = rcgen(folder.path(), &["fmt", "--check", "a.graph"]);
    assert_eq!(code, 1, "{out}{err}");
    let (code, out, err) = rcgen(folder.path(), &["fmt", "a.graph"]);
    assert_eq!(code, 0, "{out}{err}");
    let expected = r#"{
  "nodes": [
    {"id": "1:1", "type": "Room"},
    {"id": "1:2", "type": "Cup", "attributes": {"mass": {"value": 1.0, "unit": "kg"}, "name": "c"}}
  ],
  "edges": [
    {"id": "1:3", "type": "in", "from": "1:2", "to": "1:1"}
  ]
}
"#;
    assert_eq!(std::fs::read_to_string(&path).expect("a file"), expected);
    let (code, ..) = rcgen(folder.path(), &["fmt", "--check", "a.graph"]);
    assert_eq!(code, 0);
    // Also as a file of a folder. A byte order mark goes, and the ends of lines stay.
    std::fs::write(&path, format!("\u{feff}{}", text.replace('\n', "\r\n"))).expect("a file");
    let (code, out, err) = rcgen(folder.path(), &["fmt", "."]);
    assert_eq!((code, out.as_str()), (0, "format ./a.graph\n"), "{err}");
    let written = std::fs::read_to_string(&path).expect("a file");
    assert_eq!(written, expected.replace('\n', "\r\n"));
    // No digit of an integer is lost.
    let long =
        r#"{"nodes": [{"id": "1:1", "type": "Cup", "attributes": {"n": 18446744073709551616}}]}"#;
    std::fs::write(&path, long).expect("a file");
    let (code, _, err) = rcgen(folder.path(), &["fmt", "a.graph"]);
    assert_eq!(code, 1, "{err}");
    assert_eq!(std::fs::read_to_string(&path).expect("a file"), long);
    std::fs::write(&path, r#"{"nodes": [{"id": "x", "type": "Cup"}]}"#).expect("a file");
    let (code, _, err) = rcgen(folder.path(), &["fmt", "a.graph"]);
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("error[wrong-json]"), "{err}");
    let left = std::fs::read_to_string(&path).expect("a file");
    assert_eq!(left, r#"{"nodes": [{"id": "x", "type": "Cup"}]}"#);
}

/// A graph goes over into a schema that it has outgrown: differences are listed, and what does not fit.
#[test]
fn a_graph_goes_over_into_another_schema() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    let run = |schema: &str, out: &str| {
        let args = ["import", "a.graph", "--schema", schema, "--out", out];
        rcgen(folder.path(), &args)
    };
    write(
        "old.gdsl",
        "Domain a { entity Cup { mass float unit \"g\"; }; };",
    );
    write(
        "kg.gdsl",
        "Domain a { entity Cup { mass float unit \"kg\"; }; };",
    );
    write(
        "new.gdsl",
        "Domain a { entity Cup { mass float unit \"g\"; full bool optional; }; entity Mug { }; };",
    );
    let graph = r#"{"schema": "old.gdsl", "nodes": [{"id": "1:1", "type": "Cup", "attributes": {"mass": 250.0}}]}"#;
    write("a.graph", graph);
    let (code, out, err) = run("kg.gdsl", "b.graph");
    assert_eq!((code, out.as_str()), (1, ""), "{err}");
    for line in [
        "Cup.mass: `float unit \"g\"` in the first schema, `float unit \"kg\"` in the second",
        "error[unit-mismatch]",
        "a.graph: does not fit kg.gdsl",
    ] {
        assert!(err.contains(line), "{line} in {err}");
    }
    assert!(!folder.path().join("b.graph").exists());
    let (code, _, err) = run("new.gdsl", "b.graph");
    assert_eq!(code, 0, "{err}");
    let expected = "Cup.full: `bool optional` in the second schema only\nMug: `entity Mug of a` in the second schema only\n";
    assert_eq!(err, expected);
    let (code, _, err) = rcgen(folder.path(), &["check", "b.graph"]);
    assert_eq!(code, 0, "{err}");
    let made = std::fs::read_to_string(folder.path().join("b.graph")).expect("a file");
    assert!(made.contains("\"schema\": \"new.gdsl\""), "{made}");
    let (code, _, err) = run("none.gdsl", "c.graph");
    assert_eq!(code, 3, "{err}");
    let (code, ..) = run("new.gdsl", "c.xml");
    assert_eq!(code, 2);
}

/// A file that nobody could read into memory is refused before it is read, whatever is done with it.
#[test]
fn a_file_of_a_gibibyte_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = std::fs::File::create(folder.path().join("large.graph")).expect("a file");
    // It has no blocks on the disk.
    file.set_len(1 << 30).expect("a large file");
    for args in [
        &["check", "large.graph"][..],
        &["query", "large.graph", "MATCH (n) RETURN n"],
        &["view", "large.graph"],
        &["graph", "large.graph"],
        &["export", "large.graph", "--to", "dsr", "--out", "out"],
    ] {
        let (code, out, err) = rcgen(folder.path(), args);
        assert_eq!((code, out.as_str()), (3, ""), "{args:?}: {err}");
        assert!(err.contains("large.graph"), "{args:?}: {err}");
    }
    assert!(!folder.path().join("out").exists());
}

/// Attributes with data prototypes: checked, laid out, viewed, drawn, and read in any representation.
#[test]
fn a_schema_imports_data_prototypes() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).expect("a file");
    };
    let run = |args: &[&str]| rcgen(folder.path(), args);
    write(
        "places.dproto",
        "algebraic xyz :: Scalar{x, y, z}
units millimetres :: qudt, xyz { x = mm, y = mm, z = mm }
dproto place :: geometry
{
    semantic = Position coord = cartesian algebraic = xyz ddr = :: c99{double[3]}
    dr = { 0 = x, 1 = y, 2 = z }
}
dproto raw :: geometry
{
    semantic = Position coord = cartesian algebraic = xyz ddr = :: c99{double[3]}
    dr = { 0 = x, 1 = y, 2 = z } units = millimetres
}
",
    );
    let schema = r#"import "places.dproto";
Domain seeing
{
    entity Sighting
    {
        place dproto place;
        raw dproto raw consistency place;
        picture topic "RoboCompCamera::TImage" optional;
    };
};
"#;
    write("seeing.gdsl", schema);
    write(
        "a.graph",
        r#"{"schema": "seeing.gdsl", "nodes": [
{"id": "1:1", "type": "Sighting", "attributes": {"raw": [1500.0, 0.0, 0.0], "picture": {"topic": "camera", "type": "RoboCompCamera::TImage", "sequence": 7}}}
], "edges": []}
"#,
    );
    let (code, out, err) = run(&["check", "seeing.gdsl", "a.graph"]);
    assert_eq!(code, 0, "{out}{err}");
    let (code, out, err) = run(&["fmt", "--check", "seeing.gdsl"]);
    assert_eq!(code, 0, "{out}{err}");
    let query = "MATCH (s:Sighting) RETURN s.place, s.raw[0], s.picture[2]";
    let (code, out, err) = run(&["query", "a.graph", query]);
    let expected =
        "s.place [m]      s.raw[0] [mm]  s.picture[2]\n[1.5, 0.0, 0.0]  1500.0         7\n";
    assert_eq!((code, out.as_str()), (0, expected), "{err}");
    assert!(!err.contains("converted"), "{err}");
    // A number in another unit is converted; one that measures something else is a finding.
    let query = "MATCH (s:Sighting) WHERE s.raw[0] > 149 unit 'cm' RETURN s.raw[0] unit 'dm' AS x";
    let (code, out, err) = run(&["query", "a.graph", query]);
    assert_eq!((code, out.as_str()), (0, "x [dm]\n15.0\n"), "{err}");
    let query = "MATCH (s:Sighting) WHERE s.raw[0] > 149 unit 'kg' RETURN s";
    let (code, _, err) = run(&["query", "a.graph", query, "--format", "short"]);
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("query:1:46: error[unit-mismatch]"), "{err}");
    // Both of one value: each is kept, and that they do not convert is said.
    write(
        "twice.graph",
        r#"{"schema": "seeing.gdsl", "nodes": [
{"id": "1:1", "type": "Sighting", "attributes": {"raw": [1500.0, 0.0, 0.0], "place": [2.0, 0.0, 0.0]}}
], "edges": []}
"#,
    );
    let query = "MATCH (s:Sighting) RETURN s.place[0], s.raw[0]";
    let (code, out, err) = run(&["query", "twice.graph", query]);
    let expected = "s.place[0] [m]  s.raw[0] [mm]\n2.0             1500.0\n";
    assert_eq!((code, out.as_str()), (0, expected), "{err}");
    let expected = "twice.graph: no value of Sighting is converted, since one is wrong or given twice; \
                    `rcgen check` names it\n";
    assert_eq!(err, expected);
    let (code, json, err) = run(&["view", "seeing.gdsl"]);
    assert_eq!(code, 0, "{err}");
    let view: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let block = &view["entities"][0]["attributes"][1]["block"];
    assert_eq!(block["meaning"], "Position (cartesian, mm)");
    assert_eq!(block["consistency"], "place");
    assert_eq!(block["numbers"][2]["unit"], "mm");
    let (code, svg, err) = run(&["graph", "seeing.gdsl"]);
    assert_eq!(code, 0, "{err}");
    assert!(svg.contains("dproto place"), "{svg}");
    write(
        "wrong.gdsl",
        &schema.replace("consistency place", "consistency plce"),
    );
    let (code, out, err) = run(&["check", "--format", "short", "wrong.gdsl"]);
    assert_eq!(code, 1, "{out}{err}");
    let expected = "wrong.gdsl:7:36: error[unknown-attribute]: `Sighting` has no attribute `plce`";
    assert!(
        err.contains(expected) && err.contains("did you mean `place`?"),
        "{err}"
    );
}
