//! The picture has all states and transitions, and marks what is active.

use super::*;
use rc_diagnostics::SourceMap;
use std::path::PathBuf;

const CHART: &str = r#"<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" name="rover" initial="on">
  <parallel id="on">
    <state id="motion" initial="idle">
      <state id="idle"><transition event="go" cond="In('charged')" target="driving"/></state>
      <state id="driving">
        <onentry><send event="tired" delay="2s"/></onentry>
        <transition event="stop" target="idle"><script>brake</script></transition>
        <transition event="tick"><log expr="'x'"/></transition>
        <transition event="again" target="driving"/>
        <history id="last"><transition target="fast"/></history>
        <state id="slow"><transition event="&lt;&amp;" target="fast"/></state>
        <state id="fast"/>
      </state>
    </state>
    <state id="battery">
      <transition event="resume" target="last charged"/>
      <state id="charged"><transition event="battery.low" target="low"/></state>
      <state id="low"><transition target="charged" cond="is_full"/></state>
    </state>
    <transition event="off" target="end"/>
  </parallel>
  <final id="end"/>
</scxml>"#;

fn load(file: &str, text: &str) -> StateMachine {
    let mut sources = SourceMap::new();
    let source = sources.add(PathBuf::from(file), text.to_owned());
    let (machine, found) = rc_smdsl::load(&sources, source);
    assert!(!found.has_errors(), "{found:?}");
    machine.expect("a machine")
}

fn texts(svg: &str) -> Vec<String> {
    let document = roxmltree::Document::parse(svg).expect("XML");
    let texts = document
        .descendants()
        .filter(|node| node.has_tag_name("text"));
    texts
        .filter_map(|node| node.text().map(str::to_owned))
        .collect()
}

#[test]
fn all_states_and_transitions_are_drawn() {
    let machine = load("rover.scxml", &CHART.replace("&lt;&amp;", "faster"));
    let svg = document(&machine);
    let texts = texts(&svg);
    for expected in [
        "on",
        "motion",
        "idle",
        "driving",
        "H",
        "slow",
        "fast",
        "battery",
        "charged",
        "low",
        "end",
        "go [In('charged')]",
        "stop / brake()",
        "tick / log",
        "↺ again",
        "faster",
        "battery.low",
        "[is_full]",
        "off",
        "the first time",
        "resume",
    ] {
        assert!(
            texts.iter().any(|text| text == expected),
            "{expected}: {texts:?}"
        );
    }
    // A line for each transition that leads to another state, and for each initial state.
    let document = roxmltree::Document::parse(&svg).expect("XML");
    let titles = document
        .descendants()
        .filter(|node| node.has_tag_name("title"));
    let titles: Vec<&str> = titles.filter_map(|node| node.text()).collect();
    let lines = titles
        .iter()
        .filter(|title| title.contains("=>") || title.starts_with("initially"));
    assert_eq!(lines.count(), 8 + 4, "{titles:?}");
    assert!(
        titles.contains(&"battery => last, charged: resume"),
        "{titles:?}"
    );
}

#[test]
fn boxes_do_not_overlap_and_active_states_are_marked() {
    let machine = load("rover.scxml", &CHART.replace("&lt;&amp;", "faster"));
    let active: BTreeSet<String> = ["on.motion.driving.slow", "on.battery.low"]
        .map(str::to_owned)
        .into();
    let marked = draw(&machine, &active).at(Point::new(0, 0));
    for state in ["on", "motion", "driving", "slow", "battery", "low"] {
        assert!(
            marked.contains(&format!("state {state}, active")),
            "{state}: {marked}"
        );
    }
    assert!(!marked.contains("state fast, active"));
    let plain = draw(&machine, &BTreeSet::new());
    assert!(!plain.at(Point::new(0, 0)).contains("active"));
    assert_eq!(plain, draw(&machine, &BTreeSet::new()));
    let boxes = Boxes::new(&machine);
    let nets: Vec<_> = boxes.lines.iter().map(|line| line.net.clone()).collect();
    let layout = rc_graph_layout::layout(&boxes.nodes, &nets);
    let leaves = boxes.contents.iter().zip(&layout.boxes);
    let leaves: Vec<_> = leaves
        .filter(|(content, _)| !matches!(content, boxes::Content::Frame(_)))
        .map(|(_, rect)| rect)
        .collect();
    for (at, one) in leaves.iter().enumerate() {
        for other in &leaves[..at] {
            let apart = one.x + one.width <= other.x
                || other.x + other.width <= one.x
                || one.y + one.height <= other.y
                || other.y + other.height <= one.y;
            assert!(apart, "{one:?} and {other:?}");
        }
    }
}

#[test]
fn a_machine_of_smdsl_is_drawn() {
    let text = "m { initial_state a; states b; end_state c; transitions { a => a, b; b => c; }; };
        :b { initial_state x; end_state y; transitions { x => y; }; };";
    let texts = texts(&document(&load("m.smdsl", text)));
    for expected in ["a", "b", "c", "x", "y", "↺ aToA", "AToB", "BToC", "XToY"] {
        let found = texts.iter().any(|text| text.eq_ignore_ascii_case(expected));
        assert!(found, "{expected}: {texts:?}");
    }
}
