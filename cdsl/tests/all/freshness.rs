//! Diagnostics for settings of fresh values, and for `collect`.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_cdsl::model::{Component, Step};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use std::time::Duration;

const PARTS: &str = "module Parts {
    interface Scans { void scan(int x); void bumped(); };
    interface Poses { void pose(int x); };
    interface Base { void go(float speed); };
    interface Battery { float charge(); float at(int cell); void reset(); };
    interface Cells { float at(int cell); };
    struct Image { sequence<byte, 9> data; };
    interface Pictures { void seen(Image image); };
};";

fn check(comms: &str, clauses: &str, expected: &Expect) -> Component {
    let text = format!(
        "import \"Parts.idsl\";\nComponent C {{ Communications {{\n{comms}\n}};\nlanguage rust;\n{clauses}\n}};\n"
    );
    let mut sources = SourceMap::new();
    let source = sources.add("c.cdsl", &text);
    let loader = MemoryLoader::new([("Parts.idsl", PARTS)]);
    let (component, found) = rc_cdsl::load(&mut sources, &loader, source);
    expected.assert_eq(&render(&sources, &found, Format::Short));
    component.expect("a component")
}

#[test]
fn settings_of_fresh_values() {
    let component = check(
        "subscribesTo Scans { fresh 100ms; stale refuse; }, Poses as pose { fresh 200; };\n\
         requires Battery { cache 50ms; fresh 60ms; stale last; };\n\
         implements Battery as own { serve latest 200ms; };",
        "",
        &expect![[""]],
    );
    let qos = |slot: usize| component.slots[slot].whole_qos();
    assert_eq!(qos(0).fresh, Some(Duration::from_millis(100)));
    assert_eq!(qos(0).stale.word(), "refuse");
    assert_eq!(qos(1).fresh, Some(Duration::from_millis(200)));
    assert_eq!(qos(2).cache, Some(Duration::from_millis(50)));
    assert_eq!(qos(3).latest, Some(Duration::from_millis(200)));
    check(
        "publishes Scans { fresh 1ms; };\nimplements Battery { cache 1ms; fresh 1s; serve 5ms; };\n\
         requires Base { cache 50ms; stale sometimes; fresh 0; };\n\
         subscribesTo Poses { stale refuse; cache 5ms; fresh latest 5ms; };",
        "",
        &expect![[r#"
            c.cdsl:3:19: error[unknown-qos]: `publishes` has no setting `fresh` (expected one of `reliability`, `durability`, `depth`, `deadline`, `lifespan`, `liveliness`)
            c.cdsl:4:22: error[unknown-qos]: `implements` has no setting `cache` (expected one of `timeout`, `wake`, `serve`, `in_place`)
            c.cdsl:4:33: error[unknown-qos]: `implements` has no setting `fresh` (expected one of `timeout`, `wake`, `serve`, `in_place`)
            c.cdsl:4:49: error[bad-qos]: invalid value of `serve`: expected `latest` and a duration such as `200ms`, found a duration
            c.cdsl:5:17: error[bad-qos]: `Base` has no query, whose reply could be kept (remove `cache`)
            c.cdsl:5:29: error[bad-qos]: `stale` says what is done with a value that is not fresh (add the age up to which it is: `fresh 100ms;`)
            c.cdsl:5:35: error[bad-qos]: invalid value of `stale`: expected `inform` or `refuse` or `last`, found `sometimes`
            c.cdsl:5:52: error[bad-qos]: invalid value of `fresh`: expected a duration such as `500ms`, found the number 0
            c.cdsl:6:22: error[bad-qos]: `stale` says what is done with a value that is not fresh (add the age up to which it is: `fresh 100ms;`)
            c.cdsl:6:36: error[unknown-qos]: `subscribesTo` has no setting `cache` (expected one of `reliability`, `durability`, `depth`, `deadline`, `lifespan`, `liveliness`, `wake`, `fresh`, `stale`, `in_place`)
            c.cdsl:6:60: error[bad-qos]: invalid value of `fresh`: expected a duration such as `500ms`, found `latest 5ms`
        "#]],
    );
    check(
        "requires Battery { cache 50ms; fresh 40ms; };\nimplements Cells { serve latest 1s; };\n\
         subscribesTo Pictures { in_place true; fresh 1s; }, Scans[] as all { fresh 1s; };\n\
         implements Battery { serve spin 1ms; };",
        "",
        &expect![[r#"
            c.cdsl:3:20: warning[cache-over-fresh]: a reply may be 50ms old, and counts as fresh for 40ms (shorten `cache`, or lengthen `fresh`)
            c.cdsl:4:20: error[bad-qos]: `Cells` has no query without parameters, whose last result could answer (remove `serve`)
            c.cdsl:5:40: error[bad-qos]: a value in place is not kept, so that it has no age (remove `fresh` or `in_place`)
            c.cdsl:5:70: error[bad-qos]: a slot array cannot have `fresh` (remove it, or declare slots of their own)
            c.cdsl:6:1: error[repeated-clause]: duplicate communication clause `implements`; first used here at c.cdsl:4:1
            c.cdsl:6:33: error[bad-qos]: invalid value of `serve`: expected `latest` and a duration such as `200ms`, found `spin 1ms`
        "#]],
    );
}

#[test]
fn collect_names_topics() {
    let comms = "subscribesTo Scans, Poses as pose, Poses[] as many; implements Battery; requires Base; publishes Scans as out;";
    let component = check(
        comms,
        "collect Scans.scan, pose within 20ms as view; collect scan, bumped, pose.pose EXACT as all;\n\
         reactions { view -> go budget 3ms; compute -> out.scan; }",
        &expect![[r#"
            c.cdsl:6:21: error[ambiguous-operation]: several slots have an operation `pose`; one of them at c.cdsl:3:21 (write `pose.pose` or `many.pose`)
        "#]],
    );
    assert_eq!(component.collects.len(), 2);
    check(
        comms,
        "collect Scans.scan, pose.pose within 20ms as view; collect bumped, pose.pose exact as all;\n\
         reactions { view, all -> go budget 3ms; compute -> out.scan; }",
        &expect![[""]],
    );
    check(
        comms,
        "collect Scans.scan, pose.pose within 0 as compute;\ncollect scan exact as one;\n\
         collect charge, go, many.pose, compute, scann within 1s as wrong;\n\
         collect scan, Scans.scan exact as one;\ncollect scan, bumped as three;\nreactions { vieuw -> go; }",
        &expect![[r#"
            c.cdsl:6:38: error[bad-collect]: `within` takes a duration of more than 0, such as `20ms` (write `exact` in its place for samples of equal times)
            c.cdsl:6:43: error[bad-collect]: `compute` is the periodic function (rename it)
            c.cdsl:7:23: error[bad-collect]: a collection has 2 to 8 topics, this one has 1 (the handler of one topic needs none)
            c.cdsl:8:9: error[bad-collect]: `Battery.charge` is not a topic that the component subscribes to (name topics of slots under `subscribesTo`)
            c.cdsl:8:17: error[bad-reaction]: expected an operation that the component implements or subscribes to, but it requires `go`; declared here at c.cdsl:3:82 (write what the component receives left of `->`, and what it sends right of it)
            c.cdsl:8:21: error[bad-collect]: `many.pose` is a topic of a slot array (name topics of slots under `subscribesTo`)
            c.cdsl:8:32: error[bad-collect]: `compute` has no samples (name topics)
            c.cdsl:8:41: error[unknown-operation]: no slot has an operation `scann` (did you mean `scan`?)
            c.cdsl:9:15: error[bad-collect]: `Scans.scan` occurs twice (name each topic once)
            c.cdsl:9:35: error[repeated-clause]: duplicate collection `one`; first used here at c.cdsl:7:23
            c.cdsl:10:22: error[syntax-error]: expected `,`, `.`, `exact` or `within`, found `as`
            c.cdsl:11:13: error[unknown-operation]: no slot has an operation `vieuw` (expected one of `scan`, `bumped`, `pose`, `pose`, `charge`, `at`, `reset`, `compute`)
        "#]],
    );
}

#[test]
fn a_collection_is_a_cause() {
    let component = check(
        "subscribesTo Scans, Poses; requires Base;",
        "collect scan, pose within 20ms as view; reactions { view -> go; }",
        &expect![[""]],
    );
    let reactions = component.reactions.expect("reactions");
    assert_eq!(reactions[0].cause, Step::Collected("view".to_owned()));
    assert_eq!(reactions[0].cause.to_string(), "view");
    let topic = |slot: &str, operation: &str| (slot.to_owned(), operation.to_owned());
    assert_eq!(
        component.collects[0].topics,
        [topic("Scans", "scan"), topic("Poses", "pose")]
    );
    assert_eq!(component.collects[0].within, Duration::from_millis(20));
}
