//! Changes of a text that leave the rest of it alone.

use crate::right;
use innermodel_language::Document;
use innermodel_language::rewrite::{self, Value};
use rc_diagnostics::Span;

const WORLD: &str = "\
<?xml version='1.0'?>
<!-- a world -->
<innerModel>
    <transform   id='a' x = '1.50' allowed=\"b\">   <!-- its x is tuned -->
        <sphere radius=\"10\" id=\"b\" ></sphere>
        <plane id=\"c\"/>

        <!-- the last one -->
        <cone id=\"d\" radius=\"5\" length=\"6\" collide=\"1\"/> <!-- beside -->
    </transform>
    <translation id=\"e\" />
</innerModel>
";

fn tag(text: &str, id: &str) -> Span {
    let document = right(text);
    let at = document.find(id).expect("a node");
    document.nodes[at].span
}

fn set(text: &str, id: &str, name: &str, value: &Value) -> String {
    rewrite::set(text, tag(text, id), name, value).expect("a change")
}

fn without(document: &Document, ids: &[&str]) -> Vec<String> {
    let nodes = document.nodes.iter().map(|node| node.id.clone());
    nodes.filter(|id| !ids.contains(&id.as_str())).collect()
}

/// Only the lines that change differ.
#[track_caller]
fn check(new: &str, changes: &[(&str, &str)]) {
    let expected = changes
        .iter()
        .fold(WORLD.to_owned(), |text, (before, after)| {
            assert_eq!(text.matches(before).count(), 1, "{before}");
            text.replacen(before, after, 1)
        });
    assert_eq!(new, expected);
}

#[test]
fn an_attribute_keeps_its_spelling_place_and_quotes() {
    let new = set(WORLD, "a", "tx", &Value::length(-20.25));
    check(&new, &[("x = '1.50'", "x = '-20.25'")]);
    let new = set(WORLD, "b", "radius", &Value::length(0.1 + 0.2));
    check(&new, &[("radius=\"10\"", "radius=\"0.3\"")]);
}

#[test]
fn a_new_attribute_stands_behind_those_listed_before_it() {
    let new = set(WORLD, "a", "tz", &Value::length(7.0));
    check(&new, &[("x = '1.50'", "x = '1.50' tz=\"7\"")]);
    let new = set(WORLD, "b", "tx", &Value::length(7.0));
    check(&new, &[("id=\"b\" >", "id=\"b\" tx=\"7\" >")]);
    let new = set(WORLD, "d", "ry", &Value::Number(0.5));
    check(&new, &[("id=\"d\"", "id=\"d\" ry=\"0.5\"")]);
    let new = set(WORLD, "d", "texture", &Value::Text("#fff000".into()));
    check(
        &new,
        &[("length=\"6\"", "length=\"6\" texture=\"#fff000\"")],
    );
}

#[test]
fn values_are_escaped_and_rounded_for_the_eye_only() {
    let text = "a \"b\" 'c' <d> & é\n";
    let new = set(WORLD, "c", "texture", &Value::Text(text.to_owned()));
    let document = right(&new);
    let at = document.find("c").expect("a node");
    let kind = &document.nodes[at].kind;
    assert!(matches!(kind, innermodel_language::Kind::Plane(plane) if plane.texture == text));
    let again = set(&new, "c", "texture", &Value::Text("it's".to_owned()));
    assert!(again.contains("texture=\"it&#39;s\""), "{again}");
    for (value, written) in [
        (1_250.000_000_000_000_2, "1250"),
        (-0.0, "0"),
        (-1e-12, "0"),
        (100.0, "100"),
        (1e21, "1000000000000000000000"),
        (1.0 / 3.0, "0.333333333"),
    ] {
        let new = set(WORLD, "e", "ty", &Value::length(value));
        check(&new, &[("id=\"e\"", &format!("id=\"e\" ty=\"{written}\""))]);
    }
}

#[test]
fn lengths_have_the_unit_of_the_file() {
    let metres = WORLD.replace("<innerModel>", "<innerModel units=\"metres\">");
    let new = set(&metres, "a", "tx", &Value::length(1234.567));
    assert!(new.contains("x = '1.234567'"), "{new}");
    let document = right(&new);
    let place = document.nodes[0].pose.translation[0];
    assert!((place - 1234.567).abs() < 1e-9, "{place}");
    let new = set(&metres, "a", "rx", &Value::Number(0.25));
    assert!((right(&new).nodes[0].pose.rotation[0] - 0.25).abs() < 1e-15);
    let size = Value::Lengths(vec![100.0, 20.0, 1.0]);
    let new = set(&metres, "c", "size", &size);
    assert!(new.contains("size=\"0.1,0.02,0.001\""), "{new}");
}

#[test]
fn an_element_is_added_as_its_siblings_are_written() {
    let tag_of = |id| Some(tag(WORLD, id));
    let ball = [
        ("id", Value::Text("new".into())),
        ("radius", Value::length(3.0)),
    ];
    let add = |parent| rewrite::add(WORLD, parent, "sphere", &ball).expect("a change");
    let element = "<sphere id=\"new\" radius=\"3\"/>";
    let last = "    <translation id=\"e\" />\n";
    check(&add(None), &[(last, &format!("{last}    {element}\n"))]);
    let comment = "<!-- beside -->\n";
    check(
        &add(tag_of("a")),
        &[(comment, &format!("{comment}        {element}\n"))],
    );
    // An element that was empty gets an end.
    let content = format!("    <translation id=\"e\">\n        {element}\n    </translation>\n");
    check(&add(tag_of("e")), &[(last, &content)]);
    let windows = "<innerModel>\r\n  <transform id=\"t\"></transform>\r\n</innerModel>";
    let new = rewrite::add(windows, Some(tag(windows, "t")), "sphere", &ball);
    assert_eq!(
        new.expect("a change"),
        format!(
            "<innerModel>\r\n  <transform id=\"t\">\r\n      {element}\r\n  </transform>\r\n</innerModel>"
        )
    );
    let none = rewrite::add("<innerModel/>", None, "sphere", &ball).expect("a change");
    assert_eq!(none, format!("<innerModel>\n    {element}\n</innerModel>"));
}

#[test]
fn an_element_is_removed_with_its_line() {
    let remove = |id| rewrite::remove(WORLD, tag(WORLD, id)).expect("a change");
    check(&remove("c"), &[("        <plane id=\"c\"/>\n", "")]);
    // Adjacent text stays.
    check(
        &remove("d"),
        &[(
            "<cone id=\"d\" radius=\"5\" length=\"6\" collide=\"1\"/>",
            "",
        )],
    );
    let rest = remove("a");
    assert_eq!(without(&right(&rest), &[]), ["e"]);
    assert!(rest.contains("<!-- a world -->") && !rest.contains("the last one"));
}

/// Whatever is changed, the other nodes stay as they are.
#[test]
fn nothing_else_changes() {
    let before = right(WORLD);
    for node in &before.nodes {
        let new = set(WORLD, &node.id, "allowed", &Value::Text("e".into()));
        let after = right(&new);
        for (old, new) in before.nodes.iter().zip(&after.nodes) {
            if old.id == node.id {
                assert_eq!(new.allowed, ["e"]);
            } else {
                assert_eq!(old, new);
            }
        }
        let rest = rewrite::remove(WORLD, node.span).expect("a change");
        let removed: Vec<&str> = match node.id.as_str() {
            "a" => vec!["a", "b", "c", "d"],
            id => vec![id],
        };
        assert_eq!(without(&right(&rest), &[]), without(&before, &removed));
    }
}

#[test]
fn what_is_not_there_is_not_changed() {
    let at = tag(WORLD, "c");
    assert_eq!(rewrite::set(WORLD, at, "radius", &Value::Number(1.0)), None);
    let shifted = Span::new(at.source, at.start + 1, at.end);
    assert_eq!(rewrite::remove(WORLD, shifted), None);
    assert_eq!(rewrite::add(WORLD, Some(shifted), "sphere", &[]), None);
    assert_eq!(rewrite::remove("<innerModel>", at), None);
    assert!(rewrite::has_attribute("mesh", "tx") && !rewrite::has_attribute("laser", "tx"));
    assert!(rewrite::has_children("joint") && !rewrite::has_children("sphere"));
}
