//! Diagnostics and models of `.scxml` texts.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::shown::{read, shown};
use expect_test::{Expect, expect};

/// Checks the diagnostics for a whole file.
fn check_file(text: &str, expected: &Expect) {
    expected.assert_eq(&read("m.scxml", text).0);
}

/// Checks the model of a whole file, and that there are no diagnostics.
fn model_of_file(text: &str, expected: &Expect) {
    let (found, machine) = read("m.scxml", text);
    assert_eq!(found, "");
    expected.assert_eq(&shown(&machine.expect("a machine")));
}

/// A file with `body` from line 2 on.
fn file(body: &str) -> String {
    format!(
        "<scxml xmlns=\"http://www.w3.org/2005/07/scxml\" version=\"1.0\" name=\"m\">\n{body}\n</scxml>\n"
    )
}

/// Checks the diagnostics for a body.
fn check(body: &str, expected: &Expect) {
    check_file(&file(body), expected);
}

/// Checks the model of a body, and that there are no diagnostics.
fn model(body: &str, expected: &Expect) {
    model_of_file(&file(body), expected);
}

#[test]
fn every_supported_element_reaches_the_model() {
    model(
        r#"<!-- a comment -->
        <state id="idle">
          <onentry><log label="idle" expr="1"/><raise event="ready"/></onentry>
          <onexit><log/></onexit>
          <transition event="go start.*" cond="In('idle')" target="drive"><raise event="moving"/></transition>
          <transition event="tick"><log label="tick"/></transition>
          <transition cond="few_left" target="resume"/>
        </state>
        <parallel id="drive">
          <history id="again" type="deep"><transition target="wheels1 lidar1"><log label="anew"/></transition></history>
          <state id="wheels">
            <initial><transition target="wheels2"><raise event="first"/></transition></initial>
            <history id="last"><transition target="wheels1"/></history>
            <state id="wheels1"><transition event="e" target="wheels2"/></state>
            <state id="wheels2"><transition event="e" target="wheels1"/><transition event="back" target="last"/></state>
          </state>
          <state id="lidar" initial="deep">
            <state id="lidar1"><state id="deep"><transition target="lidar2"/></state></state>
            <state id="lidar2"/>
          </state>
          <transition event="stop" target="off"/>
          <transition event="pause" target="idle"/>
        </parallel>
        <final id="off"><onentry><log label="off"/></onentry></final>
        <state id="resume"><transition target="again"/></state>"#,
        &expect![[r#"
            m
              idle initial, entry log idle 1, entry raise ready, exit log - -
              drive, all of
                again deep history
                wheels, one of, first raise first
                  last history
                  wheels1
                  wheels2 initial
                lidar, one of, enters deep
                  lidar1, one of
                    deep initial
                  lidar2
              off end, entry log off -
              resume
            idle => drive, on go or start.*, if In('idle'), doing raise moving
            idle =>, on tick, doing log tick -
            idle => resume, if few_left
            again => wheels1 lidar1, doing log anew -
            last => wheels1
            wheels1 => wheels2, on e
            wheels2 => wheels1, on e
            wheels2 => last, on back
            deep => lidar2
            drive => off, on stop
            drive => idle, on pause
            resume => again
        "#]],
    );
}

#[test]
fn errors_outside_states() {
    // The first state is the initial one. The machine gets the name of the file.
    model_of_file(
        "\u{feff}<?xml version=\"1.0\"?>\n<scxml><state id=\"a\"><transition target=\"b\"/></state><final id=\"b\"/></scxml>",
        &expect![[r#"
            m
              a initial
              b end
            a => b
        "#]],
    );
    check_file(
        "",
        &expect![[r#"
            m.scxml:1:1: error[empty-file]: expected `<scxml …> … </scxml>`, found an empty file
        "#]],
    );
    check_file(
        "<scxml/>",
        &expect![[r#"
        m.scxml:1:2: error[no-states]: the machine has no states
    "#]],
    );
    check_file(
        "<machine/>",
        &expect![[r#"
        m.scxml:1:2: error[syntax-error]: expected `scxml`, found `machine`
    "#]],
    );
    check_file(
        "<scxml xmlns=\"http://example.com\"><state id=\"a\"/></scxml>",
        &expect![[r#"
            m.scxml:1:2: error[scxml-not-supported]: the element `scxml` is not supported
            m.scxml:1:2: error[no-states]: the machine has no states
            m.scxml:1:36: note[foreign-namespace]: what the namespace `http://example.com` adds is ignored
        "#]],
    );
    check_file(
        "states a;",
        &expect![[r#"
            m.scxml:1:1: error[other-format]: expected SCXML, found SMDSL (name the file `m.smdsl`)
        "#]],
    );
    check_file(
        "<!-- only this -->",
        &expect![[r#"
            m.scxml:1:19: error[malformed-xml]: malformed XML: the document does not have a root node
        "#]],
    );
    check_file(
        "<scxml>\n<state id=\"a\">\n</scxml>",
        &expect![[r#"
            m.scxml:3:1: error[malformed-xml]: malformed XML: expected `state` tag, not `scxml`
        "#]],
    );
    check_file(
        "<scxml>\n<state id=\"é\" é=x/>\n</scxml>",
        &expect![[r#"
            m.scxml:2:17: error[malformed-xml]: malformed XML: expected a quote not `x`
        "#]],
    );
    check_file(
        "<scxml>\n<state id=\"a\"/>\n",
        &expect![[r#"
            m.scxml:2:16: error[malformed-xml]: malformed XML: the root node was opened but never closed
        "#]],
    );
    check_file(
        "<scxml>\n<state id=\"a\"/> &unknown; </scxml>",
        &expect![[r#"
            m.scxml:2:17: error[malformed-xml]: malformed XML: unknown entity reference `unknown`
        "#]],
    );
    check_file(
        "<scxml>\n<state id=\"a\" id=\"b\"/></scxml>",
        &expect![[r#"
            m.scxml:2:15: error[malformed-xml]: malformed XML: attribute `id` is already defined
        "#]],
    );
    check_file(
        "<scxml>\n<state id=\"<\"/></scxml>",
        &expect![[r#"
            m.scxml:2:12: error[malformed-xml]: malformed XML: expected `"` not `<`
        "#]],
    );
    check_file(
        "<scxml>\n<x:state id=\"a\"/></scxml>",
        &expect![[r#"
            m.scxml:2:2: error[malformed-xml]: malformed XML: an unknown namespace prefix `x`
        "#]],
    );
}

#[test]
fn a_chart_of_qt_creator_opens() {
    let text = r#"<?xml version="1.0" encoding="UTF-8"?>
<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" binding="early" xmlns:qt="http://www.qt.io/2015/02/scxml-ext" name="m" qt:editorversion="4.13.1" initial="idle">
    <qt:editorinfo initialGeometry="60.87;116.60;-20;-20;40;40"/>
    <state id="idle">
        <qt:editorinfo scenegeometry="216.27;116.60;156.27;66.60;120;100" geometry="216.27;116.60;-60;-50;120;100"/>
        <transition type="external" event="go" target="off">
            <qt:editorinfo endTargetFactors="11.79;50"/>
        </transition>
    </state>
    <final id="off"><qt:editorinfo geometry="1;2;3;4;5;6"/></final>
</scxml>
"#;
    let (found, machine) = read("m.scxml", text);
    expect![[r#"
        m.scxml:2:133: note[foreign-namespace]: what the namespace `http://www.qt.io/2015/02/scxml-ext` adds is ignored
    "#]]
    .assert_eq(&found);
    expect![[r#"
        m
          idle initial
          off end
        idle => off, on go
    "#]]
    .assert_eq(&shown(&machine.expect("a machine")));
}

#[test]
fn sizes_are_limited() {
    check_file(
        "<?xml version=\"1.0\"?>\n<!DOCTYPE b [<!ENTITY a \"x\"><!ENTITY b \"&a;&a;&a;\">]>\n<scxml><state id=\"&b;\"/></scxml>",
        &expect![[r#"
            m.scxml:2:1: error[scxml-not-supported]: document types are not supported
        "#]],
    );
    let deep = |levels: usize| {
        let open: String = (0..levels)
            .map(|i| format!("<state id=\"s{i}\">"))
            .collect();
        format!("<scxml>\n{open}{}</scxml>", "</state>".repeat(levels))
    };
    check_file(
        &deep(100),
        &expect![[r#"
            m.scxml:1:2: warning[no-transitions]: state machine `m` has no transitions: it stays in its initial state
        "#]],
    );
    check_file(
        &deep(101),
        &expect![[r#"
            m.scxml:2:1592: error[nested-too-deep]: states are nested more than 100 levels deep
        "#]],
    );
    check_file(
        &deep(20_000),
        &expect![[r#"
            m.scxml:2:1592: error[nested-too-deep]: states are nested more than 100 levels deep
        "#]],
    );
}

#[test]
fn other_elements_are_rejected_at_their_location() {
    check(
        "<datamodel><data id=\"x\"/></datamodel>\n<state id=\"a\" x=\"1\">\n<invoke src=\"x\"/>\n<onentry><script>x</script><send event=\"e\"/><assign location=\"x\" expr=\"1\"/></onentry>\n<transition type=\"internal\" target=\"b\"><if cond=\"x\"/></transition>\n text in between\n and more\n</state>\n<final id=\"b\"><donedata/></final>\n<t:info xmlns:t=\"urn:t\" a=\"1\"/>\n<state id=\"c\" t:at=\"1\" xmlns:t=\"urn:t\"/>",
        &expect![[r#"
            m.scxml:2:2: error[scxml-not-supported]: the element `datamodel` is not supported
            m.scxml:3:15: error[scxml-not-supported]: the attribute `x` of `state` is not supported
            m.scxml:4:2: error[scxml-not-supported]: the element `invoke` is not supported
            m.scxml:5:46: error[scxml-not-supported]: the element `assign` is not supported
            m.scxml:6:41: error[scxml-not-supported]: the element `if` is not supported
            m.scxml:7:2: error[scxml-not-supported]: text in `state` is not supported
            m.scxml:10:16: error[scxml-not-supported]: the element `donedata` is not supported
            m.scxml:11:2: note[foreign-namespace]: what the namespace `urn:t` adds is ignored
        "#]],
    );
    check_file(
        "<scxml datamodel=\"ecmascript\" initial=\"a\"><state id=\"a\"/></scxml>",
        &expect![[r#"
            m.scxml:1:8: error[scxml-not-supported]: the attribute `datamodel` of `scxml` is not supported
        "#]],
    );
}

#[test]
fn misplaced_elements_are_reported() {
    check(
        "<history id=\"h\"/>\n<transition target=\"a\"/>\n<onentry/>\n<state id=\"a\">\n<raise event=\"e\"/><scxml/>\n<onentry><state id=\"x\"/><raise event=\"e\"><log/></raise></onentry>\n</state>\n<final id=\"z\">\n<state id=\"y\"/>\n</final>",
        &expect![[r#"
            m.scxml:2:2: error[misplaced-element]: `history` is not valid in `scxml`
            m.scxml:3:2: error[misplaced-element]: `transition` is not valid in `scxml`
            m.scxml:4:2: error[misplaced-element]: `onentry` is not valid in `scxml`
            m.scxml:6:2: error[misplaced-element]: `raise` is not valid in `state`
            m.scxml:6:20: error[misplaced-element]: `scxml` is not valid in `state`
            m.scxml:7:11: error[misplaced-element]: `state` is not valid in `onentry`
            m.scxml:7:43: error[misplaced-element]: `log` is not valid in `raise`
            m.scxml:10:2: error[misplaced-element]: `state` is not valid in `final`
        "#]],
    );
}

#[test]
fn missing_and_invalid_attributes_are_reported() {
    check(
        "<state>\n<transition/><transition event=\"e\"><raise/></transition>\n<transition target=\"\"/><transition event=\" \"/></state>\n<state id=\"\"/><state id=\"a b\"/>\n<state id=\"s\"><history id=\"h\" type=\"dep\"><transition event=\"e\" target=\"s1\"/></history><state id=\"s1\"/></state>",
        &expect![[r#"
            m.scxml:2:2: error[missing-attribute]: `state` has no attribute `id`
            m.scxml:3:2: error[missing-attribute]: `transition` has no `event`, `cond` or `target`
            m.scxml:3:37: error[missing-attribute]: `raise` has no `event`
            m.scxml:4:21: error[bad-attribute]: expected the name of a state, found nothing
            m.scxml:4:43: error[bad-attribute]: expected the name of an event, found nothing
            m.scxml:5:12: error[bad-attribute]: expected a name without spaces
            m.scxml:5:26: error[bad-attribute]: expected a name without spaces
            m.scxml:6:37: error[bad-attribute]: unknown type of history `dep` (did you mean `deep`?)
            m.scxml:6:61: error[bad-attribute]: the transition of `history` cannot have `event`: it is always taken
        "#]],
    );
    check(
        "<state id=\"a\">\n<history id=\"h1\"/>\n<history id=\"h2\"><transition/></history>\n<history id=\"h3\"><transition target=\"b\"/><transition target=\"b\"/></history>\n<state id=\"b\"/></state>",
        &expect![[r#"
            m.scxml:3:2: error[missing-element]: `history` has no `transition` with a `target`
            m.scxml:4:19: error[missing-attribute]: the transition of `history` has no `target`
            m.scxml:5:43: error[repeated-clause]: duplicate `transition` in `history`; first declared here at m.scxml:5:19
        "#]],
    );
}

#[test]
fn unknown_and_repeated_ids_are_reported() {
    check(
        "<state id=\"idle\"><transition target=\"driev\"/><transition target=\"Idle  park\"/></state>\n<state id=\"drive\"/><state id=\"drive\"/>\n<state id=\"DRIVE\"/>",
        &expect![[r#"
            m.scxml:2:38: error[unknown-state]: unknown state `driev` (did you mean `DRIVE`?)
            m.scxml:2:66: error[unknown-state]: unknown state `Idle` (did you mean `idle`?)
            m.scxml:2:72: error[unknown-state]: unknown state `park`
            m.scxml:3:31: error[duplicate-state]: state `drive` is declared twice; first declared here at m.scxml:3:12
            m.scxml:4:12: error[duplicate-state]: states `drive` and `DRIVE` differ only in case; first declared here at m.scxml:3:12
        "#]],
    );
}

#[test]
fn initial_states_are_checked() {
    check(
        "<state id=\"a\" initial=\"b\">\n<state id=\"c\"/></state>\n<state id=\"b\" initial=\"nothing\"/>\n<state id=\"d\" initial=\"e\">\n<initial><transition target=\"e\"/></initial>\n<state id=\"e\"/></state>\n<state id=\"f\"><initial/><state id=\"g\"/></state>\n<state id=\"h\"><history id=\"i\"><transition target=\"h\"/></history></state>",
        &expect![[r#"
            m.scxml:2:24: error[not-inside]: `b` is not inside `a`; declared here at m.scxml:4:12
            m.scxml:4:24: error[unknown-state]: unknown state `nothing`
            m.scxml:6:2: error[second-initial-state]: duplicate initial state; first declared here at m.scxml:5:24
            m.scxml:8:16: error[missing-element]: `initial` has no `transition` with a `target`
            m.scxml:9:2: error[no-initial-state]: expected an initial state, found only a history state
            m.scxml:9:16: error[not-inside]: `h` is not inside `h`; declared here at m.scxml:9:12
        "#]],
    );
    check(
        "<parallel id=\"p\" initial=\"q\">\n<initial><transition target=\"q\"/></initial>\n<state id=\"q\"/>\n<final id=\"r\"/>\n</parallel>\n<parallel id=\"s\"/>",
        &expect![[r#"
            m.scxml:2:27: error[not-in-parallel]: a parallel state cannot have an initial state; the parallel state at m.scxml:2:2
            m.scxml:3:2: error[not-in-parallel]: a parallel state cannot have an initial state; the parallel state at m.scxml:2:2
            m.scxml:5:2: error[not-in-parallel]: a parallel state cannot have an end state; the parallel state at m.scxml:2:2
            m.scxml:7:2: error[no-states]: `parallel` has no states
        "#]],
    );
}

#[test]
fn parallel_targets_are_checked() {
    check(
        "<state id=\"a\"><transition target=\"p1 p2\"/>\n<transition target=\"p1x q1\"/>\n<transition target=\"p1x p1y\"/><transition target=\"b p1\"/></state>\n<state id=\"b\"/>\n<parallel id=\"p\"><state id=\"p1\"><state id=\"p1x\"/><state id=\"p1y\"/></state><state id=\"p2\"><state id=\"q1\"/></state></parallel>",
        &expect![[r#"
            m.scxml:4:25: error[conflicting-targets]: `p1y` cannot be entered together with another state; the other state at m.scxml:4:21 (choose states in different regions of a `parallel`)
            m.scxml:4:53: error[conflicting-targets]: `p1` cannot be entered together with another state; the other state at m.scxml:4:51 (choose states in different regions of a `parallel`)
        "#]],
    );
}

#[test]
fn the_checks_of_smdsl_apply_to_scxml() {
    check(
        "<state id=\"a\"><transition event=\"e\" target=\"b\"/><transition event=\"f\" target=\"b\"/>\n<transition event=\"e\" target=\"b\"/></state>\n<final id=\"b\"/>\n<state id=\"c\"/><state id=\"d\"><transition target=\"e\"/></state><state id=\"e\"/>",
        &expect![[r#"
            m.scxml:3:2: warning[duplicate-transition]: duplicate transition `a => b`; first declared here at m.scxml:2:16
            m.scxml:5:12: warning[no-way-in]: no transition leads to state `c`
            m.scxml:5:27: warning[no-way-in]: no transition leads to state `d`
            m.scxml:5:73: warning[unreachable-state]: state `e` is not reachable from the initial state
        "#]],
    );
    check(
        "<state id=\"a\"/><final id=\"b\">\n<transition target=\"a\"/></final>",
        &expect![[r#"
            m.scxml:3:2: error[transition-from-end-state]: transition out of the end state `b`; declared here at m.scxml:2:27
        "#]],
    );
    check(
        "<state id=\"a\"/><state id=\"b\"/>",
        &expect![[r#"
            m.scxml:1:68: warning[no-transitions]: state machine `m` has no transitions: it stays in its initial state
        "#]],
    );
}

#[test]
fn conditions_and_scripts_are_names_of_functions() {
    let text = r#"<scxml><state id="a">
<transition event="e" cond="charge &gt; 20" target="b"/>
<transition event="e" cond="true" target="b"/>
<transition event="e" cond="In('c')" target="b"/>
<transition event="e" cond=" ready " target="b"><script>brake()</script><script> brake </script></transition>
<transition event="e" type="inner" target="b"><send event="x" delay="2 h"/><send event="x" target="other"/></transition>
<transition event="f" target="b"><send event="x y"/><send event="x.*"/><send/><cancel/></transition>
</state><state id="b"><history id="h"><transition target="i"/></history><history id="i"><transition target="b1"/></history>
<state id="b1"/></state></scxml>"#;
    let (found, _) = read("m.scxml", text);
    let expected = [
        "2:29: error[scxml-expression]: `charge > 20` is neither a function nor `In('state')`",
        "3:29: error[scxml-expression]: `true` is neither a function nor `In('state')`",
        "4:29: error[unknown-state]: unknown state `c`",
        "5:57: error[scxml-expression]: expected the name of a function; scripts are not evaluated",
        "6:29: error[bad-attribute]: unknown type of transition `inner`",
        "6:70: error[bad-attribute]: expected a time such as `1.5s` or `200ms`, at most a year",
        "6:100: error[scxml-not-supported]: events for `other` are not supported",
        "7:47: error[bad-attribute]: expected the name of one event",
        "7:66: error[bad-attribute]: expected the name of one event",
        "7:73: error[missing-attribute]: `send` has no `event`",
        "7:80: error[missing-attribute]: `cancel` has no `sendid`",
        "8:24: error[bad-attribute]: the default of a history state cannot be another history state",
    ];
    for line in expected {
        assert!(found.contains(line), "{line}\n{found}");
    }
    assert_eq!(found.lines().count(), expected.len(), "{found}");
}

#[test]
fn a_transition_behind_an_unguarded_one_is_a_warning() {
    let text = r#"<scxml><state id="a">
<transition event="e" cond="ready" target="b"/>
<transition event="e f" target="b"/>
<transition event="f.g" target="a"/>
<transition event="e x" target="a"/>
<transition event="*" target="b"/>
<transition event="x" target="a"/>
</state><state id="b"><transition target="a"/><transition cond="ready" target="b"/></state></scxml>"#;
    let (found, _) = read("m.scxml", text);
    let lines: Vec<&str> = found
        .lines()
        .filter_map(|line| line.split(": warning").next())
        .collect();
    assert_eq!(
        lines,
        ["m.scxml:4:2", "m.scxml:7:2", "m.scxml:8:48"],
        "{found}"
    );
}
