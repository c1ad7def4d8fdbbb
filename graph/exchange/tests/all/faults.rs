//! Files with one fault each: the finding is at its place.

use graph_exchange::{check, dsr, graph_json};
use rc_diagnostics::{Format, SourceMap, render};

/// Findings of a file of DSR or of ours.
fn findings(schema: &str, text: &str) -> String {
    let mut sources = SourceMap::new();
    let source = sources.add("a.gdsl", schema);
    let loader = rc_syntax::MemoryLoader::default();
    let (schema, found) = graph_language::load(&mut sources, &loader, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    let (source, mark) = graph_exchange::add(&mut sources, "a", text.to_owned());
    if let Some(error) = mark {
        let mut found = rc_diagnostics::Diagnostics::new();
        found.push(error);
        return render(&sources, &found, Format::Short);
    }
    let (document, mut found) = if dsr::is_dsr(text) {
        dsr::read(&sources, source)
    } else {
        graph_json::read(&sources, source)
    };
    if let Some(document) = document {
        let schema = schema.expect("a schema");
        found.extend(check(&document, &schema, &sources, source));
        // The library refuses what the check calls an error.
        let graph = document.graph(schema.into(), 1);
        let checked = found.has_errors() || graph.is_ok();
        assert!(checked, "{:?} in {text}", graph.err());
    }
    render(&sources, &found, Format::Short)
}

pub(crate) const KITCHEN: &str = r#"Domain kitchen
{
    entity Object { name string key; mass float unit "kg" 0:100 optional; colour { red, green } optional; size float[3] optional; };
    entity Cup : Object { };
    entity Room { name string key; };
    entity Gripper { payload float unit "kg"; };
    relation in { what Object; where Room; tree; };
    relation near { what Object; other Object; tree; };
    relation grasp { by Gripper :1; what Object :1; };
    entity Event { };
    relation move { what Object; to Room; promotes Event; };
    relation causes { first Event :1; second Event; promotes Event; };
    relation lies { what Cup 0:1; on Object; since int; };
    require what.mass <= by.payload of grasp "heavier than the payload";
};
"#;

/// A graph of our kind with these nodes and edges.
pub(crate) fn ours(nodes: &str, edges: &str) -> String {
    format!("{{\"nodes\": [\n{nodes}\n], \"edges\": [\n{edges}\n]}}")
}

pub(crate) const CUP: &str = r#"{"id": "1:1", "type": "Cup", "attributes": {"name": "cup"}}"#;
pub(crate) const ROOM: &str = r#"{"id": "1:2", "type": "Room", "attributes": {"name": "kitchen"}}"#;

pub(crate) fn edge(number: u32, kind: &str, from: u32, to: u32) -> String {
    format!(r#"{{"id": "1:{number}", "type": "{kind}", "from": "1:{from}", "to": "1:{to}"}}"#)
}

#[test]
fn a_right_graph_has_no_finding() {
    let nodes = format!("{CUP},\n{ROOM}");
    assert_eq!(findings(KITCHEN, &ours(&nodes, &edge(9, "in", 1, 2))), "");
}

/// An edge is what its relation promotes it to, at the ends of others.
#[test]
fn a_right_edge_to_an_edge_has_no_finding() {
    let two = format!("{CUP},\n{ROOM}");
    let edges = [
        edge(9, "causes", 7, 8),
        edge(7, "move", 1, 2),
        edge(8, "move", 1, 2),
    ];
    assert_eq!(findings(KITCHEN, &ours(&two, &edges.join(",\n"))), "");
}

#[test]
fn a_graph_without_a_schema_may_have_any_type() {
    let text = ours(
        r#"{"id": "1:1", "type": "anything"}"#,
        &edge(2, "any", 1, 1),
    );
    assert_eq!(findings("Domain any open { };", &text), "");
}

/// Graphs with one fault each, and its code. The third member of a case is the text at the place of the
/// finding, or `@LINE:COLUMN`.
pub(crate) fn cases() -> Vec<(String, &'static str, &'static str)> {
    let cup = |attributes: &str| {
        format!(r#"{{"id": "1:1", "type": "Cup", "attributes": {{"name": "cup", {attributes}}}}}"#)
    };
    let object = |number: u32, name: &str| {
        format!(r#"{{"id": "1:{number}", "type": "Object", "attributes": {{"name": "{name}"}}}}"#)
    };
    let two = format!("{CUP},\n{ROOM}");
    let three = format!(
        "{},\n{},\n{}",
        object(1, "a"),
        object(2, "b"),
        object(3, "c")
    );
    let grip = r#"{"id": "1:5", "type": "Gripper", "attributes": {"payload": 1.0}}"#;
    vec![
        // Values.
        (ours(&cup(r#""mass": -1.0"#), ""), "wrong-value", "-1.0"),
        (ours(&cup(r#""mass": 101"#), ""), "wrong-value", "101"),
        (ours(&cup(r#""mass": "1""#), ""), "wrong-value", "\"1\"}"),
        (ours(&cup(r#""mass": true"#), ""), "wrong-value", "true"),
        (ours(&cup(r#""mass": [1.0]"#), ""), "wrong-value", "[1.0]"),
        (ours(&cup(r#""mass": null"#), ""), "wrong-json", "null"),
        (
            ours(&cup(r#""mass": 1e999"#), ""),
            "malformed-json",
            "@2:72",
        ),
        (ours(&cup(r#""mass": NaN"#), ""), "malformed-json", "@2:68"),
        (
            ours(&cup(r#""mass": {"value": 1, "unit": "g"}"#), ""),
            "unit-mismatch",
            "{\"value\"",
        ),
        (
            ours(&cup(r#""mass": {"value": 1}"#), ""),
            "wrong-json",
            "{\"value\"",
        ),
        (
            ours(&cup(r#""colour": "blue""#), ""),
            "wrong-value",
            "\"blue\"",
        ),
        (
            ours(&cup(r#""size": [1.0, 2.0]"#), ""),
            "wrong-value",
            "[1.0",
        ),
        (
            ours(&cup(r#""size": [1.0, "2", 3.0]"#), ""),
            "wrong-json",
            "[1.0",
        ),
        (
            ours(&cup(r#""masss": 1.0"#), ""),
            "unknown-attribute",
            "1.0}",
        ),
        (
            ours(&cup(r#""mass": 1.0, "mass": 2.0"#), ""),
            "duplicate-member",
            "@2:81",
        ),
        (
            ours(r#"{"id": "1:1", "type": "Cup"}"#, ""),
            "missing-value",
            "{\"id\": \"1:1\"",
        ),
        // Nodes.
        (
            ours(&format!("{CUP},\n{}", object(1, "other")), ""),
            "duplicate-id",
            "{\"id\"",
        ),
        (
            ours(&format!("{},\n{}", object(1, "a"), object(2, "a")), ""),
            "duplicate-key",
            "\"a\"",
        ),
        (
            ours(&format!("{CUP},\n{}", object(2, "cup")), ""),
            "duplicate-key",
            "\"cup\"",
        ),
        (
            ours(r#"{"id": "1:1", "type": "Cupp"}"#, ""),
            "unknown-type",
            "\"Cupp\"",
        ),
        (
            ours(r#"{"id": 1, "type": "Cup"}"#, ""),
            "malformed-json",
            "@2:8",
        ),
        (
            ours(r#"{"id": "one", "type": "Cup"}"#, ""),
            "wrong-json",
            "\"one\"",
        ),
        (ours(r#"{"id": "1:1"}"#, ""), "malformed-json", "@2:13"),
        (
            ours(r#"{"id": "1:1", "type": "Cup", "colour": "red"}"#, ""),
            "malformed-json",
            "@2:37",
        ),
        // Edges.
        (ours(&two, &edge(9, "in", 1, 7)), "unknown-node", "\"1:7\""),
        (ours(&two, &edge(9, "in", 7, 2)), "unknown-node", "\"1:7\""),
        (ours(&two, &edge(9, "on", 1, 2)), "unknown-type", "\"on\""),
        (ours(&three, &edge(9, "in", 1, 2)), "wrong-port", "{\"id\""),
        (
            ours(&three, &edge(9, "grasp", 1, 2)),
            "wrong-port",
            "{\"id\"",
        ),
        (
            ours(&three, &edge(9, "near", 1, 1)),
            "edge-to-itself",
            "{\"id\"",
        ),
        // Edges to edges.
        (
            ours(
                &two,
                &[
                    edge(8, "in", 1, 2),
                    edge(7, "move", 1, 2),
                    edge(9, "causes", 8, 7),
                ]
                .join(",\n"),
            ),
            "wrong-port",
            "{\"id\": \"1:9\"",
        ),
        (
            ours(&two, &edge(9, "causes", 9, 9)),
            "edge-to-itself",
            "{\"id\": \"1:9\"",
        ),
        (
            ours(
                &two,
                &[
                    edge(7, "move", 1, 2),
                    edge(8, "causes", 7, 7),
                    edge(9, "causes", 7, 7),
                ]
                .join(",\n"),
            ),
            "wrong-count",
            "{\"id\": \"1:7\"",
        ),
        (
            ours(
                &three,
                &format!("{},\n{}", edge(8, "near", 1, 2), edge(9, "near", 1, 3)),
            ),
            "two-parents",
            "{\"id\"",
        ),
        (
            ours(
                &three,
                &format!("{},\n{}", edge(8, "near", 1, 2), edge(9, "near", 2, 1)),
            ),
            "cycle-in-tree",
            "{\"id\": \"1:8\"",
        ),
        (
            ours(
                &three,
                &[
                    edge(7, "near", 1, 2),
                    edge(8, "near", 2, 3),
                    edge(9, "near", 3, 1),
                ]
                .join(",\n"),
            ),
            "cycle-in-tree",
            "{\"id\": \"1:7\"",
        ),
        (
            ours(
                &format!("{CUP},\n{}", object(2, "tray")),
                &edge(9, "lies", 1, 2),
            ),
            "missing-value",
            "{\"id\": \"1:9\"",
        ),
        (
            ours(
                &format!("{three},\n{grip}"),
                &format!("{},\n{}", edge(8, "grasp", 5, 1), edge(9, "grasp", 5, 2)),
            ),
            "wrong-count",
            "{\"id\": \"1:5\"",
        ),
        (
            ours(
                &format!("{},\n{grip}", cup(r#""mass": 2.0"#)),
                &edge(9, "grasp", 5, 1),
            ),
            "broken-rule",
            "{\"id\"",
        ),
        // Texts.
        (
            String::from("\u{feff}{\"nodes\": []}"),
            "malformed-json",
            "@1:1",
        ),
        (String::from("{\"nodes\": []} x"), "malformed-json", "@1:15"),
        (String::from("{\"nodes\": [}"), "malformed-json", "@1:12"),
        (
            String::from("{\"nodes\": [], \"nods\": []}"),
            "malformed-json",
            "@1:20",
        ),
        (
            format!("{{\"nodes\": {}", "[".repeat(100_000)),
            "malformed-json",
            "@1:12",
        ),
        (String::from("[]"), "malformed-json", "@1:2"),
    ]
}

#[test]
fn each_fault_is_found_at_its_place() {
    let cases = cases();
    assert!(cases.len() >= 40);
    for (text, code, needle) in &cases {
        let found = findings(KITCHEN, text);
        assert!(
            found.contains(&format!("error[{code}]")),
            "{found} for {code} in\n{text}"
        );
        assert_eq!(found.lines().count(), 1, "{found} for\n{text}");
        let place = if let Some(place) = needle.strip_prefix('@') {
            place.to_owned()
        } else {
            let before = &text[..text.rfind(needle).expect("the place")];
            let line = before.matches('\n').count() + 1;
            let column = before.len() - before.rfind('\n').map_or(0, |at| at + 1) + 1;
            format!("{line}:{column}")
        };
        let place = format!("a:{place}: ");
        assert!(found.starts_with(&place), "{found} at {place} in\n{text}");
    }
}

/// A value that cannot be read is no missing one, and the message about an empty array says how to write it.
#[test]
fn one_fault_has_one_finding() {
    let schema = "Domain lists { entity Cup { all int[]; words string[]; some float[]; }; };";
    let node = |attributes: &str| {
        let node = format!(r#"{{"id": "1:1", "type": "Cup", "attributes": {{{attributes}}}}}"#);
        findings(schema, &ours(&node, ""))
    };
    let found = node(r#""all": [], "words": [], "some": []"#);
    let expected = "\
a:2:52: error[wrong-value]: `all` of `Cup` is int[], found float[0] (write an empty array of them as `{\"ints\": []}`)
a:2:65: error[wrong-value]: `words` of `Cup` is string[], found float[0] (write an empty array of them as `{\"strings\": []}`)
";
    assert_eq!(found, expected);
    let right = node(r#""all": {"ints": []}, "words": {"strings": []}, "some": []"#);
    assert_eq!(right, "");
    let found = node(r#""all": [1, "x"], "words": ["a"], "some": []"#);
    assert_eq!(found.lines().count(), 1, "{found}");
    assert!(found.contains("error[wrong-json]"), "{found}");
}

/// Integers keep their value, or are refused: none becomes a float of about its size.
#[test]
fn integers_of_more_bits_than_a_value_has_are_refused() {
    let found = |values: &str| {
        let node = format!(r#"{{"id": "1:1", "type": "Cup", "attributes": {{{values}}}}}"#);
        findings("Domain any open { };", &ours(&node, ""))
    };
    for (value, column) in [
        ("18446744073709551616", 64),
        ("-9223372036854775809", 64),
        ("[0.5, 123456789012345678901234]", 70),
    ] {
        let text = format!(r#""a": "\"10e", "b": {value}"#);
        let line = found(&text);
        let place = format!("a:2:{column}: error[wrong-json]: an integer has 64 bits");
        assert!(line.contains(&place), "{line} in {text}");
    }
    let rounded = found(r#""a": [0.5, 9007199254740993]"#);
    assert!(rounded.contains("error[wrong-json]"), "{rounded}");
    let right = r#""a": "18446744073709551616", "b": 1e30, "c": [0.5, 9007199254740992], "d": -9223372036854775808"#;
    let right = found(right);
    assert!(!right.contains("error"), "{right}");
}

/// A file of another form is told what is expected in its place.
#[test]
fn another_form_of_a_file_is_a_finding_in_our_words() {
    let schema = "Domain any open { };";
    let oldest = r#"{"DSRModel": {"symbols": [{"id": "138", "type": "laser"}]}}"#;
    let expected = "a:1:25: error[malformed-json]: expected an object, found an array (DSR's first files had arrays, and texts as values; they are not read)\n";
    assert_eq!(findings(schema, oldest), expected);
    for (text, expected) in [
        (r#"{"nodes": {}}"#, "expected an array, found an object"),
        (r#"{"nodes": [7]}"#, "expected an object, found an integer"),
        (
            r#"{"nodes": [{"id": true, "type": "x"}]}"#,
            "expected a string, found true or false",
        ),
    ] {
        let found = findings(schema, text);
        let line = format!(": error[malformed-json]: {expected}\n");
        assert!(found.ends_with(&line), "{found}");
    }
}

#[test]
fn two_edges_with_one_id_are_a_finding() {
    let text = ours(&format!("{CUP},\n{ROOM}"), &edge(2, "in", 1, 2));
    let found = findings(KITCHEN, &text);
    assert!(
        found.contains("error[duplicate-id]: another element has the id"),
        "{found}"
    );
}

/// Places need memory and a stack in proportion to the file, whatever it nests.
#[test]
fn deep_and_long_members_are_bounded() {
    let deep = format!("{}{}", "[".repeat(1_000_000), "]".repeat(1_000_000));
    let text = format!(
        r#"{{"DSRModel": {{"symbols": {{"1": {{"id": "x", "type": "room"}}}}}}, "x": {deep}}}"#
    );
    assert!(
        findings(KITCHEN, &text).contains("error"),
        "it has no finding"
    );
    let numbers = vec!["1"; 100_000].join(",");
    let name = "n".repeat(100_000);
    let node =
        format!(r#"{{"id": "1:1", "type": "Cup", "attributes": {{"{name}": [{numbers}]}}}}"#);
    assert!(findings(KITCHEN, &ours(&node, "")).contains("error[unknown-attribute]"));
}

/// The time of a check grows as the file does: sixteen times the file takes no 256 times as long.
#[test]
fn hubs_deep_trees_and_many_attributes_take_time_in_proportion() {
    let attributes = |count: usize| {
        let all: Vec<String> = (0..count).map(|at| format!("\"a{at}\": 1")).collect();
        let all = all.join(",");
        let grippers =
            r#"{"id": "1:2", "type": "Gripper", "attributes": {"name": "g", "payload": 1}}"#;
        let cup = format!(
            r#"{{"id": "1:1", "type": "Cup", "attributes": {{"name": "cup", {all}, "mass": 0.5}}}}"#
        );
        let edges: Vec<String> = (3..count + 3)
            .map(|at| edge(at as u32, "grasp", 2, 1))
            .collect();
        ours(&format!("{cup},\n{grippers}"), &edges.join(",\n"))
    };
    let deep = |count: usize| {
        let nodes: Vec<String> = (1..=count)
            .map(|at| {
                format!(r#"{{"id": "1:{at}", "type": "Cup", "attributes": {{"name": "c{at}"}}}}"#)
            })
            .collect();
        let edges: Vec<String> = (1..count)
            .map(|at| edge((count + at) as u32, "near", at as u32, at as u32 + 1))
            .collect();
        ours(&nodes.join(",\n"), &edges.join(",\n"))
    };
    let open = KITCHEN.replace("Domain kitchen", "Domain kitchen open");
    for text in [&attributes as &dyn Fn(usize) -> String, &deep] {
        let time = |count| {
            let text = text(count);
            let started = std::time::Instant::now();
            findings(&open, &text);
            started.elapsed()
        };
        let (short, long) = (time(1_000), time(16_000));
        assert!(
            long < short * 60 + std::time::Duration::from_millis(200),
            "1,000: {short:?}, 16,000: {long:?}"
        );
    }
}

#[test]
fn faults_of_dsr_are_found_at_their_places() {
    let (_, dsr) = graph_language::DOMAINS[3];
    let text = r#"{"DSRModel": {"symbols": {
"100": {"id": "100", "name": "root", "type": "root", "attribute": {"level": {"type": 1, "value": 0}}, "links": [
{"src": "100", "dst": "200", "label": "RT", "linkAttribute": {
"rt_translation": {"type": 3, "value": [1500, 0, 0]},
"rt_rotation_euler_xyz": {"type": 3, "value": [0, 0, 0]}}},
{"src": "100", "dst": "100", "label": "RT", "linkAttribute": {
"rt_translation": {"type": 3, "value": [0, 0, 0]},
"rt_rotation_euler_xyz": {"type": 3, "value": [0, 0, 0]}}},
{"src": "100", "dst": "300", "label": "has", "linkAttribute": {}}]},
"200": {"id": "200", "name": "robot", "type": "omnirobot", "links": [], "attribute": {
"parent": {"type": 7, "value": "150"},
"levle": {"type": 1, "value": 3},
"width": {"type": 1, "value": "wide"}}}
}}}"#;
    let expected = "\
a:4:19: error[wrong-value]: `rt_translation` of `RT` is in -100:100 m, found 1500 (the schema says metres, and the value fits if it is in millimetres)
a:6:1: error[edge-to-itself]: an edge `RT` leads from node 100 to itself
a:9:23: error[unknown-node]: an edge `has` ends at 300, which is not a node
a:11:11: error[unknown-node]: `parent` is 150, which is not a node
a:12:10: warning[unknown-attribute]: `omnirobot` has no attribute `levle` (did you mean `level`?)
a:13:31: error[wrong-json]: expected a value of DSR's type 1 (int), found a string
";
    assert_eq!(findings(dsr, text), expected);
}

#[test]
fn a_loop_of_poses_that_does_not_close_is_reported() {
    let (_, geometry) = graph_language::DOMAINS[0];
    let frame = |number: u32, name: &str| {
        format!(r#"{{"id": "1:{number}", "type": "Frame", "attributes": {{"name": "{name}"}}}}"#)
    };
    let edge = |number: u32, kind: &str, from: u32, to: u32, x: f64| {
        format!(
            r#"{{"id": "1:{number}", "type": "{kind}", "from": "1:{from}", "to": "1:{to}", "attributes": {{"pose": [{x:?}, 0, 0, 0, 0, 0]}}}}"#
        )
    };
    let nodes = [frame(1, "world"), frame(2, "table"), frame(3, "cup")].join(",\n");
    let graph = |x: f64| {
        let edges = [
            edge(4, "RT", 1, 2, 1.0),
            edge(5, "RT", 2, 3, 0.5),
            edge(6, "loop_closure", 1, 3, x),
        ];
        ours(&nodes, &edges.join(",\n"))
    };
    assert_eq!(findings(geometry, &graph(1.5)), "");
    let expected = "a:8:1: warning[open-loop]: the pose of `loop_closure` differs from that of 2 other edges \
        by a distance of 0.250000 and an angle of 0.000000 (RT of table in world: translation (1, 0, 0), \
        rotation (0, 0, 0); RT of cup in table: translation (0.5, 0, 0), rotation (0, 0, 0))\n";
    assert_eq!(findings(geometry, &graph(1.75)), expected);
}
