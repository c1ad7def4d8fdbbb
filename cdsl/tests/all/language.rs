//! Diagnostics for `.cdsl` texts: common mistakes, each with its location, and RoboComp's habits,
//! which the parser accepts.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

/// Files that the tests import.
const INTERFACES: [(&str, &str); 9] = [
    (
        "Second.idsl",
        "module Second { interface Laser { void other(); }; };",
    ),
    (
        "Request.idsl",
        "module RoboCompRequest { interface Request { int get(); }; };",
    ),
    (
        "Laser.idsl",
        "module RoboCompLaser { sequence<float> Data; interface Laser { Data get(); }; };",
    ),
    (
        "Pub.idsl",
        "module RoboCompPub {\n interface LaserPub { void push(int x); };\n interface Mixed { publish void one(); command void two(); };\n};",
    ),
    (
        "Pictures.idsl",
        "module RoboCompPictures { struct Image { sequence<byte, 9> data; }; interface Pictures { Image get(); void seen(Image image); }; };",
    ),
    (
        "Empty.idsl",
        "module RoboCompEmpty { interface Empty { }; };",
    ),
    (
        "Types.idsl",
        "module RoboCompTypes { struct S { int a; }; };",
    ),
    (
        "Broken.idsl",
        "module RoboCompBroken {\n interface Broken { itn get(); };\n};",
    ),
    (
        "Both.idsl",
        "import \"Laser.idsl\";\nmodule RoboCompBoth { interface Both { RoboCompLaser::Data get(); }; };",
    ),
];

/// Checks the diagnostics for a whole file `c.cdsl`. Returns the resolved slots.
fn check_file(text: &str, expected: &Expect) -> Vec<String> {
    let mut sources = SourceMap::new();
    let source = sources.add("c.cdsl", text);
    let loader = MemoryLoader::new(INTERFACES);
    let (component, found) = rc_cdsl::load(&mut sources, &loader, source);
    expected.assert_eq(&render(&sources, &found, Format::Short));
    let slots = component.into_iter().flat_map(|c| c.slots);
    slots
        .map(|s| format!("{} {}", s.role.word(), s.name))
        .collect()
}

/// Checks the diagnostics for a component that imports `Laser.idsl` and `Pub.idsl`. `comms` begins
/// on line 3, `clauses` on the line after it.
fn check(comms: &str, clauses: &str, expected: &Expect) -> Vec<String> {
    let text = format!(
        "import \"Laser.idsl\"; import \"Pub.idsl\";\nComponent C {{ Communications {{\n{comms}\n}};\n{clauses}\n}};\n"
    );
    check_file(&text, expected)
}

const USED: &str = "requires Laser; publishes LaserPub;";

#[test]
fn errors_outside_clauses() {
    check_file(
        "",
        &expect![[r#"
            c.cdsl:1:1: error[empty-file]: expected `Component NAME { … };`, found an empty file
        "#]],
    );
    check_file(
        "// nothing",
        &expect![[r#"
            c.cdsl:1:1: error[empty-file]: expected `Component NAME { … };`, found an empty file
        "#]],
    );
    check_file(
        "Component C { language rust; Communications { }; }; }",
        &expect![[r#"
            c.cdsl:1:53: error[text-after-end]: unexpected text: a file contains one `Component NAME { … };`
        "#]],
    );
    check_file(
        "Component C { language rust; Communications { }; };\nComponent D { };",
        &expect![[r#"
            c.cdsl:2:1: error[text-after-end]: unexpected text: a file contains one `Component NAME { … };`
        "#]],
    );
    check_file(
        "Component C { language rust; Communications { };",
        &expect![[r#"
            c.cdsl:1:49: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
    check_file(
        "Component C\n language rust; Communications { };\n};",
        &expect![[r#"
            c.cdsl:2:2: error[syntax-error]: expected `{`, found `language`
        "#]],
    );
    check_file(
        "Componet C { };",
        &expect![[r#"
            c.cdsl:1:1: error[syntax-error]: expected `Component`, found `Componet` (did you mean `Component`?)
        "#]],
    );
    check_file(
        "Component { };",
        &expect![[r#"
        c.cdsl:1:11: error[syntax-error]: expected a name, found `{`
    "#]],
    );
    check_file(
        "Component C { };",
        &expect![[r#"
            c.cdsl:1:11: error[missing-clause]: component `C` has no `Communications` clause (add `Communications { };` with the interfaces of the component)
            c.cdsl:1:11: error[missing-clause]: component `C` has no `language` clause (add `language rust;`)
        "#]],
    );
    check_file(
        "language rust;",
        &expect![[r#"
        c.cdsl:1:1: error[syntax-error]: expected `Component`, found `language`
    "#]],
    );
    check_file(
        "import Laser.idsl;\nComponent C { language rust; Communications { }; };",
        &expect![[r#"
            c.cdsl:1:8: error[syntax-error]: expected a string, found `Laser`
        "#]],
    );
}

#[test]
fn a_missing_semicolon_is_one_error_at_its_location() {
    check(
        "requires Laser // far\npublishes LaserPub { depth 3 }\n",
        "language rust\nperiod 50ms\noptions agmagent\ngui Qt(QWidget)\nparameters \"c.pdsl\"\ndependencies { libm \"0.2\" serde \"1\" }\nstatemachine \"x.smdsl\"",
        &expect![[r#"
            c.cdsl:3:15: error[missing-semicolon]: expected `;`
            c.cdsl:4:29: error[missing-semicolon]: expected `;`
            c.cdsl:4:31: error[missing-semicolon]: expected `;`
            c.cdsl:7:14: error[missing-semicolon]: expected `;`
            c.cdsl:8:12: error[missing-semicolon]: expected `;`
            c.cdsl:9:1: warning[not-generated-yet]: `options` has no effect yet: it is only checked
            c.cdsl:9:17: error[missing-semicolon]: expected `;`
            c.cdsl:10:1: error[gui-in-rust]: workers in Rust have no window of Qt; the language of this component at c.cdsl:7:10 (write the component with the window in C++ or Python (`language cpp;`), or show the tree of this one with `options InnerModelViewer;`, write on a terminal, or serve a page)
            c.cdsl:10:16: error[missing-semicolon]: expected `;`
            c.cdsl:11:20: error[missing-semicolon]: expected `;`
            c.cdsl:12:26: error[missing-semicolon]: expected `;`
            c.cdsl:12:36: error[missing-semicolon]: expected `;`
            c.cdsl:13:23: error[missing-semicolon]: expected `;`
        "#]],
    );
    check_file(
        "import \"Laser\"\nComponent C { Communications { requires Laser; }\nlanguage rust }",
        &expect![[r#"
            c.cdsl:1:15: error[missing-semicolon]: expected `;`
            c.cdsl:3:14: error[missing-semicolon]: expected `;`
        "#]],
    );
}

#[test]
fn unresolved_and_unused_imports_are_reported() {
    check_file(
        "import \"Lasre.idsl\";\nimport \"/opt/robocomp/interfaces/IDSLs/Camera.idsl\";\nComponent C { Communications { requires Laser, Camera; }; language rust; };",
        &expect![[r#"
            c.cdsl:1:8: error[import-not-found]: cannot find `Lasre.idsl`; searched in memory (did you mean `Laser.idsl`?)
            c.cdsl:2:8: error[import-not-found]: cannot find `Camera.idsl`; searched in memory (copy the file into one of these folders, or pass its folder with `-I DIR`)
        "#]],
    );
    check_file(
        "import \"Laser.idsl\"; import \"Pub.idsl\"; import \"Types.idsl\"; import \"Both\";\nComponent C { Communications { requires Laser; }; language rust; };",
        &expect![[r#"
            c.cdsl:1:29: warning[unused-import]: unused import of `RoboCompPub`
        "#]],
    );
    check_file(
        "import \"Broken.idsl\";\nComponent C { Communications { requires Broken; }; language rust; };",
        &expect![[r#"
            Broken.idsl:2:21: error[unknown-type]: unknown type `itn` (did you mean `int`?)
        "#]],
    );
    check_file(
        "Component C { Communications { requires Laser; }; language rust; };",
        &expect![[r#"
            c.cdsl:1:41: error[unknown-interface]: unknown interface `Laser` (add `import "Laser.idsl";`)
        "#]],
    );
}

#[test]
fn unknown_interfaces_and_invalid_roles_are_reported() {
    check(
        "requires laser, Lasr, Camera;\npublishes LaserPub;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:10: error[unknown-interface]: unknown interface `laser` (did you mean `Laser`?)
            c.cdsl:3:17: error[unknown-interface]: unknown interface `Lasr` (did you mean `Laser`?)
            c.cdsl:3:23: error[unknown-interface]: unknown interface `Camera` (import the file that declares it; `import "Camera.idsl";` finds no file)
        "#]],
    );
    check(
        "publishes Laser;\nimplements LaserPub;\nrequires Mixed; subscribesTo Mixed;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:11: error[wrong-pattern]: `Laser` cannot be used under `publishes`: operation `get` returns a value; declared here at Laser.idsl:1:69 (use the topics of `LaserPub`, or use `Laser` under `implements`)
            c.cdsl:5:10: error[wrong-pattern]: `Mixed` cannot be used under `requires`: operation `one` is a `publish`; declared here at Pub.idsl:3:33 (use the interface under `publishes` or `subscribesTo`)
            c.cdsl:5:30: error[wrong-pattern]: `Mixed` cannot be used under `subscribesTo`: operation `two` is a `command`; declared here at Pub.idsl:3:53 (topics are one-way: use `Mixed` under `requires`, or move its topics into an interface `MixedPub`)
        "#]],
    );
    check_file(
        "import \"Empty.idsl\";\nComponent C { Communications { requires Empty; }; language rust; };",
        &expect![[r#"
            c.cdsl:2:41: warning[empty-interface]: interface `Empty` has no operations; declared here at Empty.idsl:1:34
        "#]],
    );
}

#[test]
fn syntax_errors_in_communications() {
    check(
        "provides Laser;\nimplement Laser;\nimplements ;\nrequires Laser LaserPub;\npublishes LaserPub(;\nsubscribesTo LaserPub(iceoryx) { depth 3; };\nLaser;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:1: error[unknown-communication]: expected a communication clause, found `provides` (did you mean `implements`? expected one of `implements`, `requires`, `publishes`, `subscribesTo`)
            c.cdsl:4:1: error[unknown-communication]: expected a communication clause, found `implement` (did you mean `implements`? expected one of `implements`, `requires`, `publishes`, `subscribesTo`)
            c.cdsl:5:12: error[syntax-error]: expected a name, found `;`
            c.cdsl:6:16: error[syntax-error]: expected `(`, `,`, `;`, `[`, `as` or `{`, found `LaserPub`
            c.cdsl:7:20: error[syntax-error]: expected a name, found `;`
            c.cdsl:8:23: error[unknown-middleware]: unknown middleware `iceoryx` (did you mean `iceoryx2`?)
            c.cdsl:9:1: error[unknown-communication]: expected a communication clause, found `Laser` (expected one of `implements`, `requires`, `publishes`, `subscribesTo`)
        "#]],
    );
    check(
        "requires Laser, ;\npublishes LaserPub, requires Laser;\n§",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:17: error[syntax-error]: expected a name, found `;`
            c.cdsl:4:21: error[syntax-error]: expected a name, found `requires`
            c.cdsl:5:1: error[unknown-communication]: expected a communication clause, found `§` (expected one of `implements`, `requires`, `publishes`, `subscribesTo`)
        "#]],
    );
    check(
        "implements Laser as ;\nrequires Laser { timeout 3s ;\npublishes LaserPub;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:21: error[syntax-error]: expected a name, found `;`
            c.cdsl:5:1: error[unknown-qos]: `requires` has no setting `publishes` (expected one of `timeout`, `wake`, `fresh`, `stale`, `cache`, `asynchronous`)
            c.cdsl:7:1: error[unknown-communication]: expected a communication clause, found `language` (end `Communications` with `};` before `language`)
            c.cdsl:9:1: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
}

#[test]
fn the_version_of_python_is_checked() {
    for (version, venv) in [("3.12", " venv"), ("3.11", "")] {
        let clauses = format!("language python;\npython \"{version}\"{venv};");
        check(USED, &clauses, &expect![""]);
    }
    check(
        USED,
        "python \"3.9\" venv;\nlanguage python;",
        &expect![[r#"
            c.cdsl:5:8: error[bad-python-version]: expected a version of Python from 3.11 on, such as `"3.12"`, found `3.9` (write the oldest version that the worker runs on)
        "#]],
    );
    check(
        USED,
        "language python;\npython \"3.12.1\";\npython 3.12 vnev;",
        &expect![[r#"
            c.cdsl:6:8: error[bad-python-version]: expected a version of Python from 3.11 on, such as `"3.12"`, found `3.12.1` (write the oldest version that the worker runs on)
            c.cdsl:7:8: error[syntax-error]: expected a string, found `3`
        "#]],
    );
    check(
        USED,
        "language rust;\npython \"3.12\" vnev;\nperiod 5ms;",
        &expect![[r#"
            c.cdsl:6:15: error[syntax-error]: expected `;` or `venv`, found `vnev` (did you mean `venv`?)
        "#]],
    );
    check(
        USED,
        "python \"3.12\" venv;\nlanguage rust;",
        &expect![[r#"
            c.cdsl:5:1: error[python-of-another-language]: `python` is a clause of components with `language python;`; the language of this component at c.cdsl:6:10
        "#]],
    );
}

#[test]
fn syntax_errors_in_clauses() {
    check(
        USED,
        "language ;\nlanguage = rust;\nlangauge rust;\ngui;\noptions dsr agmagent;\nparameters c.pdsl;\nperiod fast;\ndependencies { libm = \"0.2\"; };\n§;\nx;",
        &expect![[r#"
            c.cdsl:5:10: error[syntax-error]: expected a name, found `;`
            c.cdsl:6:10: error[syntax-error]: expected a name, found `=`
            c.cdsl:7:1: error[unknown-clause]: expected a clause of a component, found `langauge` (did you mean `language`?)
            c.cdsl:8:4: error[syntax-error]: expected a name, found `;`
            c.cdsl:9:13: error[syntax-error]: expected `,` or `;`, found `agmagent`
            c.cdsl:10:12: error[syntax-error]: expected a string, found `c`
            c.cdsl:11:8: error[syntax-error]: expected a duration such as `50ms`, found `fast`
            c.cdsl:12:21: error[syntax-error]: expected `{` or a string, found `=`
            c.cdsl:13:1: error[unknown-clause]: expected a clause of a component, found `§` (expected one of `Communications`, `language`, `gui`, `options`, `statemachine`, `parameters`, `kinematics`, `world`, `dependencies`, `python`, `period`, `collect`, `reactions`, `simulates`, `lifecycle`)
            c.cdsl:14:1: error[unknown-clause]: expected a clause of a component, found `x` (expected one of `Communications`, `language`, `gui`, `options`, `statemachine`, `parameters`, `kinematics`, `world`, `dependencies`, `python`, `period`, `collect`, `reactions`, `simulates`, `lifecycle`)
        "#]],
    );
    check(
        USED,
        "language rsut;\ngui Qtt (QWidgt);\noptions drs, foo;\nperiod 10us;\nlifecycle manged;",
        &expect![[r#"
            c.cdsl:5:10: error[unknown-language]: unknown language `rsut` (did you mean `rust`?)
            c.cdsl:6:5: error[unknown-gui]: unknown GUI toolkit `Qtt` (did you mean `Qt`?)
            c.cdsl:6:10: error[unknown-widget]: unknown widget `QWidgt` (did you mean `QWidget`?)
            c.cdsl:7:1: warning[not-generated-yet]: `options` has no effect yet: it is only checked
            c.cdsl:7:9: error[unknown-option]: unknown option `drs` (did you mean `dsr`?)
            c.cdsl:7:14: error[unknown-option]: unknown option `foo` (expected one of `dsr`, `agmagent`, `InnerModelViewer`, `InnerModelSlots`)
            c.cdsl:8:8: error[bad-period]: expected a duration of at least 100us, such as `50ms`
            c.cdsl:9:11: error[unknown-lifecycle]: unknown life cycle `manged` (did you mean `managed`?)
        "#]],
    );
    check(
        USED,
        "language cpp; gui egui; options dsr; statemachine \"x.smdsl\" visual;",
        &expect![[r#"
            c.cdsl:5:15: warning[not-generated-yet]: `gui egui` has no effect yet: it is only checked
            c.cdsl:5:25: warning[not-generated-yet]: `options` has no effect yet: it is only checked
        "#]],
    );
}

#[test]
fn states_and_events_are_checked() {
    let machine = "language rust; statemachine \"m.scxml\" { external motor.stopped, go-on; }";
    check(
        "implements Laser { available moving, at-rest; timeout 1s; };",
        machine,
        &expect![[r#"
            c.cdsl:1:29: warning[unused-import]: unused import of `RoboCompPub`
        "#]],
    );
    check(
        "implements Laser { available moving, Moving; available two; };",
        "language rust; statemachine \"m.smdsl\" visual { external A; external a; };",
        &expect![[r#"
            c.cdsl:3:38: error[repeated-clause]: duplicate state `Moving`; first used here at c.cdsl:3:30
            c.cdsl:3:46: error[repeated-clause]: duplicate clause `available`; first used here at c.cdsl:3:20
            c.cdsl:5:60: error[repeated-clause]: duplicate clause `external`; first used here at c.cdsl:5:48
            c.cdsl:5:69: error[repeated-clause]: duplicate event `a`; first used here at c.cdsl:5:57
        "#]],
    );
    check(
        "requires Laser { available moving; }; publishes LaserPub { available moving; };",
        machine,
        &expect![[r#"
            c.cdsl:3:18: error[unknown-qos]: `requires` has no setting `available` (`available` belongs to a slot under `implements`, whose calls it refuses in other states)
            c.cdsl:3:60: error[unknown-qos]: `publishes` has no setting `available` (`available` belongs to a slot under `implements`, whose calls it refuses in other states)
        "#]],
    );
    check(
        "implements Laser { available moving; };",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:30: error[no-state-machine]: `moving` is a state, but the component has no state machine (add `statemachine "FILE.smdsl";`, or remove `available`)
        "#]],
    );
    check(
        "implements Laser { available ; };",
        "language rust; statemachine \"m.smdsl\" { extrnal go; };",
        &expect![[r#"
            c.cdsl:3:30: error[syntax-error]: expected a name or a value, found `;`
            c.cdsl:5:41: error[syntax-error]: expected `}`, found `extrnal` (did you mean `external`?)
        "#]],
    );
}

#[test]
fn repeated_clauses_are_reported() {
    check(
        "requires Laser; requires Laser as two; publishes LaserPub;",
        "language rust; Language rust; Communications { }; period 1s; period 2s;",
        &expect![[r#"
            c.cdsl:3:17: error[repeated-clause]: duplicate communication clause `requires`; first used here at c.cdsl:3:1
            c.cdsl:5:16: error[repeated-clause]: duplicate clause `Language`; first used here at c.cdsl:5:1
            c.cdsl:5:31: error[repeated-clause]: duplicate clause `Communications`; first used here at c.cdsl:2:15
            c.cdsl:5:62: error[repeated-clause]: duplicate clause `period`; first used here at c.cdsl:5:51
        "#]],
    );
    check(
        "request Laser; requires Laser as two; publishes LaserPub;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:16: error[repeated-clause]: duplicate communication clause `requires`; first used here at c.cdsl:3:1
        "#]],
    );
}

#[test]
fn clauses_of_the_eclipse_tools_are_explained() {
    check(
        USED,
        "language rust;\nuseQt;\nRoboCompModules RoboCompLaser;\nRoboCompClasses x;\nworker isThread;",
        &expect![[r#"
            c.cdsl:6:1: error[old-clause]: clause `useQt` is obsolete (use `gui Qt (QWidget);`)
            c.cdsl:7:1: error[old-clause]: clause `RoboCompModules` is obsolete (use `dependencies { NAME "VERSION"; };` with crates instead of classes)
            c.cdsl:8:1: error[old-clause]: clause `RoboCompClasses` is obsolete (use `dependencies { NAME "VERSION"; };` with crates instead of classes)
            c.cdsl:9:1: error[old-clause]: clause `worker` is obsolete (remove it: the worker's loop needs no clause; `period 50ms;` sets its period)
        "#]],
    );
}

#[test]
fn slot_names_are_unique() {
    check(
        "requires Laser as a, Laser as A, Laser;\npublishes LaserPub as laser;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:22: error[duplicate-slot]: duplicate slot `A`; first declared here at c.cdsl:3:10 (rename one of them: `Laser as other`)
            c.cdsl:4:11: error[duplicate-slot]: duplicate slot `laser`; first declared here at c.cdsl:3:34 (rename one of them: `LaserPub as other`)
        "#]],
    );
    let slots = check(
        "requires Laser, Laser, Laser; implements Laser; publishes LaserPub;",
        "language rust;",
        &expect![[""]],
    );
    expect![
        "requires Laser, requires Laser1, requires Laser2, implements Laser3, publishes LaserPub"
    ]
    .assert_eq(&slots.join(", "));
}

#[test]
fn backends_and_quality_of_service() {
    check(
        "requires Laser(dsd) { timout 3s; depth 3; timeout soon; timeout 3s; };\npublishes LaserPub(ros2) { reliability reliabel; depth 0; durability \"volatile\"; deadline -1ms; timeout 3s; };",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:16: error[unknown-middleware]: unknown middleware `dsd` (did you mean `dds`?)
            c.cdsl:3:23: error[unknown-qos]: `requires` has no setting `timout` (did you mean `timeout`?)
            c.cdsl:3:34: error[unknown-qos]: `requires` has no setting `depth` (expected one of `timeout`, `wake`, `fresh`, `stale`, `cache`, `asynchronous`)
            c.cdsl:3:51: error[bad-qos]: invalid value of `timeout`: expected a duration such as `500ms`, found `soon`
            c.cdsl:3:57: error[repeated-clause]: duplicate setting `timeout`; first used here at c.cdsl:3:43
            c.cdsl:4:40: error[bad-qos]: invalid value of `reliability`: expected `reliable` or `best_effort`, found `reliabel`
            c.cdsl:4:56: error[bad-qos]: invalid value of `depth`: expected an integer from 1 to 1000, found the number 0
            c.cdsl:4:70: error[bad-qos]: invalid value of `durability`: expected `volatile` or `transient_local`, found the string "volatile"
            c.cdsl:4:91: error[bad-qos]: invalid value of `deadline`: expected a duration such as `500ms`, found `-1ms`
            c.cdsl:4:97: error[unknown-qos]: `publishes` has no setting `timeout` (expected one of `reliability`, `durability`, `depth`, `deadline`, `lifespan`, `liveliness`)
        "#]],
    );
    check(
        "requires Laser { wake 50us; }, Laser as a { wake spin; }, Laser as b { wake spin 20ms; };\nimplements Laser as c { timeout spin 3s; wake spin 0us; };\npublishes LaserPub { wake spin 50us; };\nsubscribesTo LaserPub as d { wake spin 1us; };",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:23: error[bad-qos]: invalid value of `wake`: expected `spin` and a duration from 1us to 10ms, found a duration
            c.cdsl:3:50: error[bad-qos]: invalid value of `wake`: expected `spin` and a duration from 1us to 10ms, found `spin`
            c.cdsl:3:82: error[bad-qos]: invalid value of `wake`: expected `spin` and a duration from 1us to 10ms, found `spin 20ms`
            c.cdsl:4:38: error[bad-qos]: invalid value of `timeout`: expected a duration such as `500ms`, found `spin 3s`
            c.cdsl:4:52: error[bad-qos]: invalid value of `wake`: expected `spin` and a duration from 1us to 10ms, found `spin 0ms`
            c.cdsl:5:22: error[unknown-qos]: `publishes` has no setting `wake` (expected one of `reliability`, `durability`, `depth`, `deadline`, `lifespan`, `liveliness`)
        "#]],
    );
    let slots = check(
        "requires Laser(ice) { timeout 500; wake spin 50us; };\npublishes LaserPub(ros) { reliability best_effort; depth 5; durability transient_local; deadline 100ms; lifespan 1s; liveliness 2 s; };",
        "language rust;",
        &expect![[""]],
    );
    expect!["requires Laser, publishes LaserPub"].assert_eq(&slots.join(", "));
}

#[test]
fn slots_that_require_queries_may_be_asynchronous() {
    check(
        "requires Laser { asynchronous true; timeout 1s; }, Laser as a { asynchronous false; },\nLaser as b { asynchronous 1; }, Mixed { asynchronous true; };\nimplements Laser as d { asynchronous true; };",
        "language rust;",
        &expect![[r#"
            c.cdsl:4:27: error[bad-qos]: invalid value of `asynchronous`: expected `true` or `false`, found the number 1
            c.cdsl:4:33: error[wrong-pattern]: `Mixed` cannot be used under `requires`: operation `one` is a `publish`; declared here at Pub.idsl:3:33 (use the interface under `publishes` or `subscribesTo`)
            c.cdsl:4:54: error[bad-qos]: `Mixed` has no query, whose end could come later (remove this setting: a command never waits for its server)
            c.cdsl:5:25: error[unknown-qos]: `implements` has no setting `asynchronous` (expected one of `timeout`, `wake`, `serve`, `in_place`)
        "#]],
    );
}

#[test]
fn in_place_is_for_handlers_of_plain_structures() {
    check_file(
        "import \"Pictures.idsl\"; import \"Laser.idsl\"; import \"Pub.idsl\"; Component c { Communications {\n\
         implements Pictures { in_place true; timeout 1s; }, Pictures { in_place false; }, Laser { in_place true; };\n\
         subscribesTo LaserPub { in_place true; depth 2; }, LaserPub { in_place 1; };\n\
         requires Pictures { in_place true; };\n\
         publishes LaserPub { in_place true; }; }; language rust; };",
        &expect![[r#"
            c.cdsl:2:100: error[bad-qos]: no operation of `Laser` has a plain struct with a bounded sequence as its only result (use only numbers, enums, `string<N>`, `sequence<T, N>`, arrays and structs of them)
            c.cdsl:3:34: error[bad-qos]: no operation of `LaserPub` has a plain struct with a bounded sequence as its only parameter (use only numbers, enums, `string<N>`, `sequence<T, N>`, arrays and structs of them)
            c.cdsl:3:72: error[bad-qos]: invalid value of `in_place`: expected `true` or `false`, found the number 1
            c.cdsl:4:21: error[unknown-qos]: `requires` has no setting `in_place` (expected one of `timeout`, `wake`, `fresh`, `stale`, `cache`, `asynchronous`)
            c.cdsl:5:22: error[unknown-qos]: `publishes` has no setting `in_place` (expected one of `reliability`, `durability`, `depth`, `deadline`, `lifespan`, `liveliness`)
        "#]],
    );
}

#[test]
fn the_habits_of_robocomp_are_accepted() {
    let slots = check_file(
        "\u{feff}import \"/opt/robocomp/interfaces/IDSLs/Laser.idsl\";\r\nimport \"../..//Pub\";\r\n\r\nComponent publish\r\n{\r\n\tCommunications\r\n\t{\r\n\
         \t\timplements Laser(ice), Laser;\trequires Laser;\r\n\t\tpublishes LaserPub;\r\n\t};\r\n\tlanguage Cpp11;\r\n\tgui Qt(QMainWindow);\r\n}",
        &expect![""],
    );
    expect!["implements Laser, implements Laser1, requires Laser2, publishes LaserPub"]
        .assert_eq(&slots.join(", "));
    check_file(
        "import \"Request.idsl\"; Component c { Communications { implements Request, Request as one; requires Request; }; language rust; };",
        &expect![[""]],
    );
    check_file(
        "COMPONENT c { communications {} LANGUAGE Rust; }",
        &expect![[""]],
    );
}

#[test]
fn constructs_of_real_files_are_accepted() {
    // A missing file is reported once, not at each use of its content.
    check_file(
        "import \"Camera.idsl\";\nComponent C { Communications { requires Camera, Camera as other; }; language N++; };",
        &expect![[r#"
            c.cdsl:1:8: error[import-not-found]: cannot find `Camera.idsl`; searched in memory (copy the file into one of these folders, or pass its folder with `-I DIR`)
            c.cdsl:2:78: error[unknown-language]: unknown language `N++` (did you mean `c++`?)
        "#]],
    );
    // The first import wins, as in RoboComp.
    check_file(
        "import \"Laser.idsl\"; import \"Second.idsl\";\nComponent C { Communications { requires Laser; }; language cpp; gui qt(qwidget); };",
        &expect![[r#"
            c.cdsl:1:29: warning[unused-import]: unused import of `Second`
            c.cdsl:2:41: warning[ambiguous-interface]: ambiguous interface `Laser`: using `RoboCompLaser::Laser`, which is imported first; used at Laser.idsl:1:56; not used at Second.idsl:1:27
        "#]],
    );
    // The modules that a used interface depends on may also be imported.
    let slots = check_file(
        "import \"Laser.idsl\"; import \"Both.idsl\";\nComponent C { Communications { requires Both; };; language rust;; }",
        &expect![[""]],
    );
    assert_eq!(slots, ["requires Both"]);
}

#[test]
fn optional_slots() {
    let text = "import \"Laser.idsl\"; import \"Pub.idsl\";\nComponent C { Communications {\n\
        requires Laser optional, Laser as front optional { timeout 1s; }, Laser as optional;\n\
        subscribesTo LaserPub(dds) OPTIONAL;\n}; language rust; };";
    let mut sources = SourceMap::new();
    let source = sources.add("c.cdsl", text);
    let (component, found) = rc_cdsl::load(&mut sources, &MemoryLoader::new(INTERFACES), source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    let slots = component.expect("a component").slots;
    let slots: Vec<_> = slots
        .iter()
        .map(|s| (s.name.as_str(), s.optional))
        .collect();
    assert_eq!(
        slots,
        [
            ("Laser", true),
            ("front", true),
            ("optional", false),
            ("LaserPub", true)
        ]
    );
    check(
        "implements Laser optional; publishes LaserPub as scan optional; requires optional Laser;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:18: error[optional-provider]: a slot that implements its interface is always optional (remove `optional`: it is for slots that require or subscribe, whose peer may be missing)
            c.cdsl:3:55: error[optional-provider]: a slot that publishes its interface is always optional (remove `optional`: it is for slots that require or subscribe, whose peer may be missing)
            c.cdsl:3:83: error[syntax-error]: expected `(`, `,`, `;`, `[`, `as` or `{`, found `Laser`
        "#]],
    );
}

#[test]
fn reactions_lead_from_what_comes_to_what_is_sent() {
    let comms = "implements Laser; subscribesTo LaserPub; publishes LaserPub as out; requires Laser as peer;";
    let reactions = |text: &str, expected: &Expect| {
        check(
            comms,
            &format!("language rust;\nreactions {{ {text} }}"),
            expected,
        );
    };
    reactions(
        "Laser.get, LaserPub.push -> out.push, compute budget 2ms; compute -> peer.get;",
        &expect![[r#""#]],
    );
    reactions(
        "get -> out.push; push budget 5; compute -> get;",
        &expect![[r#""#]],
    );
    reactions("", &expect![[r#""#]]);
    reactions(
        "pusch -> get; push -> gte; LaserPug.push -> get;",
        &expect![[r#"
            c.cdsl:6:13: error[unknown-operation]: no slot has an operation `pusch` (did you mean `push`?)
            c.cdsl:6:35: error[unknown-operation]: no slot has an operation `gte` (did you mean `get`?)
            c.cdsl:6:40: error[unknown-slot]: the component has no slot `LaserPug` (did you mean `LaserPub`?)
        "#]],
    );
    reactions(
        "out.push -> get; compute -> compute; push -> LaserPub.push;",
        &expect![[r#"
            c.cdsl:6:13: error[bad-reaction]: expected an operation that the component implements or subscribes to, but it publishes `push`; declared here at c.cdsl:3:52 (write what the component receives left of `->`, and what it sends right of it)
            c.cdsl:6:30: error[bad-reaction]: `compute` cannot follow `compute`: it runs with each period (name the messages that it sends)
            c.cdsl:6:58: error[bad-reaction]: expected an operation that the component requires or publishes, but it subscribesTo `push`; declared here at c.cdsl:3:32 (write what the component receives left of `->`, and what it sends right of it)
        "#]],
    );
    reactions(
        "push -> out.push; LaserPub.push -> get; get budget 0; Laser.get budget 101ms;",
        &expect![[r#"
            c.cdsl:6:31: error[repeated-reaction]: `push` has two reactions; the first one at c.cdsl:6:13 (write all that follows into one of them)
            c.cdsl:6:64: error[bad-budget]: `budget` takes a duration of more than 0, such as `2ms`
            c.cdsl:6:67: error[repeated-reaction]: `get` has two reactions; the first one at c.cdsl:6:53 (write all that follows into one of them)
            c.cdsl:6:84: error[budget-over-period]: a budget of 101ms is longer than the period of 100ms: each run that needs it is an overrun (shorten the budget, or lengthen `period`)
        "#]],
    );
    reactions(
        "push -> ; get budget;",
        &expect![[r#"
        c.cdsl:6:21: error[syntax-error]: expected a name, found `;`
        c.cdsl:6:33: error[syntax-error]: expected a duration such as `50ms`, found `;`
    "#]],
    );
    check(
        "subscribesTo LaserPub as one, LaserPub as two;",
        "language rust; reactions { push -> compute; }; reactions { };",
        &expect![[r#"
            c.cdsl:5:48: error[repeated-clause]: duplicate clause `reactions`; first used here at c.cdsl:5:16
        "#]],
    );
}

#[test]
fn a_clause_of_the_component_among_the_communications_says_what_is_missing() {
    check_file(
        "Component my-robot { Communications { }; language rust; };",
        &expect![[r#"
            c.cdsl:1:13: error[syntax-error]: expected `{`, found `-` (a name consists of letters, digits and `_`)
        "#]],
    );
    check_file(
        "Component C { Communications { requires Nowhere; language rust; period 10 Hz; };",
        &expect![[r#"
            c.cdsl:1:41: error[unknown-interface]: unknown interface `Nowhere` (import the file that declares it; `import "Nowhere.idsl";` finds no file)
            c.cdsl:1:50: error[unknown-communication]: expected a communication clause, found `language` (end `Communications` with `};` before `language`)
            c.cdsl:1:75: error[unknown-time-unit]: unknown unit of time `Hz` (10 Hz is a period of `100ms`)
            c.cdsl:1:81: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
}
