//! What is said about `.cdsl` texts: the mistakes that people make, each at its place, and the habits of
//! RoboComp's own files, which are accepted.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

/// Files that tests import.
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

/// What is found in a whole file `c.cdsl`; the slots that are understood.
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

/// What is found in a component that imports `Laser.idsl` and `Pub.idsl`; `comms` begins line 3, `clauses` the
/// line after it.
fn check(comms: &str, clauses: &str, expected: &Expect) -> Vec<String> {
    let text = format!(
        "import \"Laser.idsl\"; import \"Pub.idsl\";\nComponent C {{ Communications {{\n{comms}\n}};\n{clauses}\n}};\n"
    );
    check_file(&text, expected)
}

const USED: &str = "requires Laser; publishes LaserPub;";

#[test]
fn whole_files() {
    check_file(
        "",
        &expect![[r#"
        c.cdsl:1:1: error[empty-file]: this file is empty; it should hold `Component NAME { … };`
    "#]],
    );
    check_file(
        "// nothing",
        &expect![[r#"
        c.cdsl:1:1: error[empty-file]: this file is empty; it should hold `Component NAME { … };`
    "#]],
    );
    check_file(
        "Component C { language rust; Communications { }; }; }",
        &expect![[r#"
            c.cdsl:1:53: error[text-after-end]: there is text after the end; a file holds one `Component NAME { … };`
        "#]],
    );
    check_file(
        "Component C { language rust; Communications { }; };\nComponent D { };",
        &expect![[r#"
            c.cdsl:2:1: error[text-after-end]: there is text after the end; a file holds one `Component NAME { … };`
        "#]],
    );
    check_file(
        "Component C { language rust; Communications { };",
        &expect![[r#"
            c.cdsl:1:49: error[syntax-error]: expected `}` or a clause, found the end of the file
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
        c.cdsl:1:1: error[syntax-error]: expected `Component`, found `Componet`
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
        c.cdsl:1:11: error[missing-clause]: component `C` has no `Communications` clause (add `Communications { };`, with what the component implements, requires, publishes and subscribes to)
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
            c.cdsl:1:8: error[syntax-error]: expected a text in quotes, found `Laser`
        "#]],
    );
}

#[test]
fn a_forgotten_semicolon_is_one_error_where_it_belongs() {
    check(
        "requires Laser // far\npublishes LaserPub { depth 3 }\n",
        "language rust\nperiod 50ms\noptions dsr\ngui Qt(QWidget)\nparameters \"c.pdsl\"\ndependencies { libm \"0.2\" serde \"1\" }\nstatemachine \"x.smdsl\"",
        &expect![[r#"
            c.cdsl:3:15: error[missing-semicolon]: `;` expected here
            c.cdsl:4:29: error[missing-semicolon]: `;` expected here
            c.cdsl:4:31: error[missing-semicolon]: `;` expected here
            c.cdsl:7:14: error[missing-semicolon]: `;` expected here
            c.cdsl:8:12: error[missing-semicolon]: `;` expected here
            c.cdsl:9:1: warning[not-generated-yet]: `options` is read and checked, but nothing is generated for it yet
            c.cdsl:9:12: error[missing-semicolon]: `;` expected here
            c.cdsl:10:1: warning[not-generated-yet]: `gui` is read and checked, but nothing is generated for it yet
            c.cdsl:10:16: error[missing-semicolon]: `;` expected here
            c.cdsl:11:20: error[missing-semicolon]: `;` expected here
            c.cdsl:12:26: error[missing-semicolon]: `;` expected here
            c.cdsl:12:36: error[missing-semicolon]: `;` expected here
            c.cdsl:13:1: warning[not-generated-yet]: `statemachine` is read and checked, but nothing is generated for it yet
            c.cdsl:13:23: error[missing-semicolon]: `;` expected here
        "#]],
    );
    check_file(
        "import \"Laser\"\nComponent C { Communications { requires Laser; }\nlanguage rust }",
        &expect![[r#"
            c.cdsl:1:15: error[missing-semicolon]: `;` expected here
            c.cdsl:3:14: error[missing-semicolon]: `;` expected here
        "#]],
    );
}

#[test]
fn imports_are_found_and_used() {
    check_file(
        "import \"Lasre.idsl\";\nimport \"/opt/robocomp/interfaces/IDSLs/Camera.idsl\";\nComponent C { Communications { requires Laser, Camera; }; language rust; };",
        &expect![[r#"
            c.cdsl:1:8: error[import-not-found]: `Lasre.idsl` was not found; looked in memory (did you mean `Laser.idsl`?)
            c.cdsl:2:8: error[import-not-found]: `Camera.idsl` was not found; looked in memory (name its folder with `-I DIR`, or put the file beside this one)
            c.cdsl:3:41: error[unknown-interface]: unknown interface `Laser` (import it: `import "Laser.idsl";`)
        "#]],
    );
    check_file(
        "import \"Laser.idsl\"; import \"Pub.idsl\"; import \"Types.idsl\"; import \"Both\";\nComponent C { Communications { requires Laser; }; language rust; };",
        &expect![[r#"
            c.cdsl:1:29: warning[unused-import]: nothing of `RoboCompPub` is used here
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
            c.cdsl:1:41: error[unknown-interface]: unknown interface `Laser` (import it: `import "Laser.idsl";`)
        "#]],
    );
}

#[test]
fn interfaces_are_known_and_used_as_they_can_be() {
    check(
        "requires laser, Lasr, Camera;\npublishes LaserPub;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:10: error[unknown-interface]: unknown interface `laser` (did you mean `Laser`?)
            c.cdsl:3:17: error[unknown-interface]: unknown interface `Lasr` (did you mean `Laser`?)
            c.cdsl:3:23: error[unknown-interface]: unknown interface `Camera` (no imported file declares it, and `import "Camera.idsl";` finds no file)
        "#]],
    );
    check(
        "publishes Laser;\nimplements LaserPub;\nrequires Mixed; subscribesTo Mixed;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:11: error[wrong-pattern]: `Laser` cannot be used under `publishes`: its operation `get` returns a value; declared here at Laser.idsl:1:69 (a topic is one way: its operations are void, without `out` and `throws`)
            c.cdsl:5:10: error[wrong-pattern]: `Mixed` cannot be used under `requires`: its operation `one` is marked `publish`; declared here at Pub.idsl:3:33 (operations marked `publish` belong under `publishes` and `subscribesTo`)
            c.cdsl:5:30: error[wrong-pattern]: `Mixed` cannot be used under `subscribesTo`: its operation `two` is marked `command`; declared here at Pub.idsl:3:53 (a topic is one way: its operations are void, without `out` and `throws`)
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
fn communications_that_cannot_be_read() {
    check(
        "provides Laser;\nimplement Laser;\nimplements ;\nrequires Laser LaserPub;\npublishes LaserPub(;\nsubscribesTo LaserPub(iceoryx) { depth 3; };\nLaser;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:1: error[unknown-communication]: `provides` does not begin a communication clause (did you mean `implements`? allowed here: `implements`, `requires`, `publishes`, `subscribesTo`)
            c.cdsl:4:1: error[unknown-communication]: `implement` does not begin a communication clause (did you mean `implements`? allowed here: `implements`, `requires`, `publishes`, `subscribesTo`)
            c.cdsl:5:12: error[syntax-error]: expected a name, found `;`
            c.cdsl:6:16: error[syntax-error]: expected `(`, `,`, `;` or `{`, found `LaserPub`
            c.cdsl:7:20: error[syntax-error]: expected a name, found `;`
            c.cdsl:8:23: error[unknown-middleware]: unknown middleware `iceoryx` (did you mean `iceoryx2`?)
            c.cdsl:9:1: error[unknown-communication]: `Laser` does not begin a communication clause (allowed here: `implements`, `requires`, `publishes`, `subscribesTo`)
        "#]],
    );
    check(
        "requires Laser, ;\npublishes LaserPub, requires Laser;\n§",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:17: error[syntax-error]: expected a name, found `;`
            c.cdsl:4:21: error[syntax-error]: expected a name, found `requires`
            c.cdsl:5:1: error[unknown-communication]: `§` does not begin a communication clause (allowed here: `implements`, `requires`, `publishes`, `subscribesTo`)
        "#]],
    );
    check(
        "implements Laser as ;\nrequires Laser { timeout 3s ;\npublishes LaserPub;",
        "language rust;",
        &expect![[r#"
            c.cdsl:9:1: error[syntax-error]: expected `}` or a clause, found the end of the file
        "#]],
    );
}

#[test]
fn clauses_that_cannot_be_read() {
    check(
        USED,
        "language ;\nlanguage = rust;\nlangauge rust;\ngui;\noptions dsr agmagent;\nparameters c.pdsl;\nperiod fast;\ndependencies { libm = \"0.2\"; };\n§;\nx;",
        &expect![[r#"
            c.cdsl:5:10: error[syntax-error]: expected a name, found `;`
            c.cdsl:6:10: error[syntax-error]: expected a name, found `=`
            c.cdsl:7:1: error[unknown-clause]: `langauge` does not begin a clause of a component (did you mean `language`?)
            c.cdsl:8:4: error[syntax-error]: expected a name, found `;`
            c.cdsl:9:13: error[syntax-error]: expected `,` or `;`, found `agmagent`
            c.cdsl:10:12: error[syntax-error]: expected a text in quotes, found `c`
            c.cdsl:11:8: error[syntax-error]: expected a time such as `50ms`, found `fast`
            c.cdsl:12:21: error[syntax-error]: expected a text in quotes, found `=`
            c.cdsl:13:1: error[unknown-clause]: `§` does not begin a clause of a component (allowed here: `Communications`, `language`, `gui`, `options`, `statemachine`, `parameters`, `dependencies`, `period`)
            c.cdsl:14:1: error[unknown-clause]: `x` does not begin a clause of a component (allowed here: `Communications`, `language`, `gui`, `options`, `statemachine`, `parameters`, `dependencies`, `period`)
        "#]],
    );
    check(
        USED,
        "language rsut;\ngui Qtt (QWidgt);\noptions drs, foo;\nperiod 10us;",
        &expect![[r#"
            c.cdsl:5:10: error[unknown-language]: unknown language `rsut` (did you mean `rust`?)
            c.cdsl:6:1: warning[not-generated-yet]: `gui` is read and checked, but nothing is generated for it yet
            c.cdsl:6:5: error[unknown-gui]: unknown gui `Qtt` (did you mean `Qt`?)
            c.cdsl:6:10: error[unknown-widget]: unknown widget `QWidgt` (did you mean `QWidget`?)
            c.cdsl:7:1: warning[not-generated-yet]: `options` is read and checked, but nothing is generated for it yet
            c.cdsl:7:9: error[unknown-option]: unknown option `drs` (did you mean `dsr`?)
            c.cdsl:7:14: error[unknown-option]: unknown option `foo` (allowed here: `dsr`, `agmagent`, `InnerModelViewer`)
            c.cdsl:8:8: error[bad-period]: a period is a time of at least 100us, as in `50ms`
        "#]],
    );
    check(
        USED,
        "language cpp; gui egui; options dsr; statemachine \"x.smdsl\" visual;",
        &expect![[r#"
            c.cdsl:5:15: warning[not-generated-yet]: `gui` is read and checked, but nothing is generated for it yet
            c.cdsl:5:25: warning[not-generated-yet]: `options` is read and checked, but nothing is generated for it yet
            c.cdsl:5:38: warning[not-generated-yet]: `statemachine` is read and checked, but nothing is generated for it yet
        "#]],
    );
}

#[test]
fn clauses_come_once() {
    check(
        "requires Laser; requires Laser as two; publishes LaserPub;",
        "language rust; Language rust; Communications { }; period 1s; period 2s;",
        &expect![[r#"
            c.cdsl:3:17: error[repeated-clause]: communication clause `requires` is repeated; each stands once; the first one at c.cdsl:3:1
            c.cdsl:5:16: error[repeated-clause]: clause `Language` is repeated; each stands once; the first one at c.cdsl:5:1
            c.cdsl:5:31: error[repeated-clause]: clause `Communications` is repeated; each stands once; the first one at c.cdsl:2:15
            c.cdsl:5:62: error[repeated-clause]: clause `period` is repeated; each stands once; the first one at c.cdsl:5:51
        "#]],
    );
    check(
        "request Laser; requires Laser as two; publishes LaserPub;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:16: error[repeated-clause]: communication clause `requires` is repeated; each stands once; the first one at c.cdsl:3:1
        "#]],
    );
}

#[test]
fn clauses_of_old() {
    check(
        USED,
        "language rust;\nuseQt;\nRoboCompModules RoboCompLaser;\nRoboCompClasses x;\nworker isThread;",
        &expect![[r#"
            c.cdsl:6:1: error[old-clause]: `useQt` is a clause of old; today it is `gui Qt (QWidget);`
            c.cdsl:7:1: error[old-clause]: `RoboCompModules` is a clause of old; today it is `dependencies { NAME "VERSION"; };`, with crates instead of classes
            c.cdsl:8:1: error[old-clause]: `RoboCompClasses` is a clause of old; today it is `dependencies { NAME "VERSION"; };`, with crates instead of classes
            c.cdsl:9:1: error[old-clause]: `worker` is a clause of old; today the worker's loop needs no clause; `period 50ms;` sets how often it runs
        "#]],
    );
}

#[test]
fn slots_are_unique() {
    check(
        "requires Laser as a, Laser as A, Laser;\npublishes LaserPub as laser;",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:22: error[duplicate-slot]: slot `A` exists already; the first one at c.cdsl:3:10 (name one of them: `Laser as other`)
            c.cdsl:4:11: error[duplicate-slot]: slot `laser` exists already; the first one at c.cdsl:3:34 (name one of them: `LaserPub as other`)
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
            c.cdsl:3:23: error[unknown-qos]: `timout` is not a setting of `requires` (did you mean `timeout`?)
            c.cdsl:3:34: error[unknown-qos]: `depth` is not a setting of `requires` (allowed here: `timeout`, `wake`)
            c.cdsl:3:51: error[bad-qos]: `soon` is not a value of `timeout`; allowed is a time such as `500ms`
            c.cdsl:3:57: error[repeated-clause]: setting `timeout` is repeated; each stands once; the first one at c.cdsl:3:43
            c.cdsl:4:40: error[bad-qos]: `reliabel` is not a value of `reliability`; allowed is `reliable` or `best_effort`
            c.cdsl:4:56: error[bad-qos]: the number 0 is not a value of `depth`; allowed is a whole number from 1 to 1000
            c.cdsl:4:70: error[bad-qos]: the text "volatile" is not a value of `durability`; allowed is `volatile` or `transient_local`
            c.cdsl:4:91: error[bad-qos]: `-1ms` is not a value of `deadline`; allowed is a time such as `500ms`
            c.cdsl:4:97: error[unknown-qos]: `timeout` is not a setting of `publishes` (allowed here: `reliability`, `depth`, `durability`, `deadline`, `lifespan`, `liveliness`)
        "#]],
    );
    check(
        "requires Laser { wake 50us; }, Laser as a { wake spin; }, Laser as b { wake spin 20ms; };\nimplements Laser as c { timeout spin 3s; wake spin 0us; };\npublishes LaserPub { wake spin 50us; };\nsubscribesTo LaserPub as d { wake spin 1us; };",
        "language rust;",
        &expect![[r#"
            c.cdsl:3:23: error[bad-qos]: a time is not a value of `wake`; allowed is `spin` and a time from 1us to 10ms
            c.cdsl:3:50: error[bad-qos]: `spin` is not a value of `wake`; allowed is `spin` and a time from 1us to 10ms
            c.cdsl:3:82: error[bad-qos]: `spin 20ms` is not a value of `wake`; allowed is `spin` and a time from 1us to 10ms
            c.cdsl:4:38: error[bad-qos]: `spin 3s` is not a value of `timeout`; allowed is a time such as `500ms`
            c.cdsl:4:52: error[bad-qos]: `spin 0ms` is not a value of `wake`; allowed is `spin` and a time from 1us to 10ms
            c.cdsl:5:22: error[unknown-qos]: `wake` is not a setting of `publishes` (allowed here: `reliability`, `depth`, `durability`, `deadline`, `lifespan`, `liveliness`)
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
fn in_place_is_for_handlers_of_plain_structures() {
    check_file(
        "import \"Pictures.idsl\"; import \"Laser.idsl\"; import \"Pub.idsl\"; Component c { Communications {\n\
         implements Pictures { in_place true; timeout 1s; }, Pictures { in_place false; }, Laser { in_place true; };\n\
         subscribesTo LaserPub { in_place true; depth 2; }, LaserPub { in_place 1; };\n\
         requires Pictures { in_place true; };\n\
         publishes LaserPub { in_place true; }; }; language rust; };",
        &expect![[r#"
            c.cdsl:2:100: error[bad-qos]: no operation of `Laser` has, as its only result, a plain structure with a bounded sequence (plain are numbers, enums, structures of them, `string<N>`, `sequence<T, N>` and arrays)
            c.cdsl:3:34: error[bad-qos]: no operation of `LaserPub` has, as its only parameter, a plain structure with a bounded sequence (plain are numbers, enums, structures of them, `string<N>`, `sequence<T, N>` and arrays)
            c.cdsl:3:72: error[bad-qos]: the number 1 is not a value of `in_place`; allowed is `true` or `false`
            c.cdsl:4:21: error[unknown-qos]: `in_place` is not a setting of `requires` (allowed here: `timeout`, `wake`)
            c.cdsl:5:22: error[unknown-qos]: `in_place` is not a setting of `publishes` (allowed here: `reliability`, `depth`, `durability`, `deadline`, `lifespan`, `liveliness`)
        "#]],
    );
}

#[test]
fn the_habits_of_robocomp_are_accepted() {
    let slots = check_file(
        "\u{feff}import \"/opt/robocomp/interfaces/IDSLs/Laser.idsl\";\r\nimport \"../..//Pub\";\r\n\r\nComponent publish\r\n{\r\n\tCommunications\r\n\t{\r\n\
         \t\timplements Laser(ice), Laser;\trequires Laser;\r\n\t\tpublishes LaserPub;\r\n\t};\r\n\tlanguage Cpp11;\r\n\tgui Qt(QMainWindow);\r\n}",
        &expect![[r#"
            c.cdsl:12:2: warning[not-generated-yet]: `gui` is read and checked, but nothing is generated for it yet
        "#]],
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
fn what_real_files_taught() {
    // A missing file is told once, not at each use of what is in it.
    check_file(
        "import \"Camera.idsl\";\nComponent C { Communications { requires Camera, Camera as other; }; language N++; };",
        &expect![[r#"
            c.cdsl:1:8: error[import-not-found]: `Camera.idsl` was not found; looked in memory (name its folder with `-I DIR`, or put the file beside this one)
            c.cdsl:2:78: error[unknown-language]: unknown language `N++` (allowed here: `rust`, `cpp`, `cpp11`, `python`)
        "#]],
    );
    // The first import is taken, as RoboComp does.
    check_file(
        "import \"Laser.idsl\"; import \"Second.idsl\";\nComponent C { Communications { requires Laser; }; language cpp; gui qt(qwidget); };",
        &expect![[r#"
            c.cdsl:1:29: warning[unused-import]: nothing of `Second` is used here
            c.cdsl:2:41: warning[ambiguous-interface]: interface `Laser` is in several modules; `RoboCompLaser::Laser` is taken, since it is imported first; this one is taken at Laser.idsl:1:56; this one is not at Second.idsl:1:27
            c.cdsl:2:65: warning[not-generated-yet]: `gui` is read and checked, but nothing is generated for it yet
        "#]],
    );
    // What a used interface is made of may be imported, too.
    let slots = check_file(
        "import \"Laser.idsl\"; import \"Both.idsl\";\nComponent C { Communications { requires Both; };; language rust;; }",
        &expect![[""]],
    );
    assert_eq!(slots, ["requires Both"]);
}
