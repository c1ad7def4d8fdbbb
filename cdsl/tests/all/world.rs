//! The clause `world`: what a component writes and reads of a shared graph.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_cdsl::model::World;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use std::time::Duration;

/// Checks the diagnostics for a component with these clauses, on line 3.
fn check(clauses: &str, expected: &Expect) -> Option<World> {
    let text = format!("Component C {{ Communications {{ }}; language rust;\n\n{clauses}\n}};\n");
    let mut sources = SourceMap::new();
    let source = sources.add("c.cdsl", text.as_str());
    let meet = include_str!("../../../components/interfaces/World.idsl");
    let loader = MemoryLoader::new([("World.idsl", meet)]);
    let (component, found) = rc_cdsl::load(&mut sources, &loader, source);
    expected.assert_eq(&render(&sources, &found, Format::Short));
    component?.world
}

#[test]
fn a_world_has_its_schema_its_name_and_what_the_component_does() {
    let world = check(
        "World \"home.gdsl\" as g { writes door, door.pose stream 20ms shared, RT shared; reads room, robot; Writes wall.x STREAM; };",
        &expect![[r#""#]],
    );
    let world = world.expect("a world");
    let schema = world.schema.expect("a schema");
    assert_eq!((&*schema.text, &*world.name.text), ("home.gdsl", "g"));
    let access = world.access.expect("a block");
    let writes: Vec<_> = access
        .writes
        .iter()
        .map(|write| (write.path(), write.stream, write.shared))
        .collect();
    assert_eq!(
        writes,
        [
            ("door".to_owned(), None, false),
            (
                "door.pose".to_owned(),
                Some(Duration::from_millis(20)),
                true
            ),
            ("RT".to_owned(), None, true),
            ("wall.x".to_owned(), Some(Duration::ZERO), false),
        ]
    );
    let reads: Vec<&str> = access.reads.iter().map(|kind| &*kind.text).collect();
    assert_eq!(reads, ["room", "robot"]);
    let everything = check("world \"home.gdsl\" as g;", &expect![[r#""#]]);
    assert_eq!(everything.expect("a world").access, None);
    // An empty block is nothing, not everything.
    let nothing = check("world \"home.gdsl\" as g { }", &expect![[r#""#]]);
    assert_eq!(
        nothing.expect("a world").access,
        Some(rc_cdsl::model::Access::default())
    );
}

#[test]
fn a_world_of_any_network_has_slots_of_the_worker() {
    let text = "Component C { Communications { }; language rust; world Any as any { writes Frame shared; }; };";
    let mut sources = SourceMap::new();
    let source = sources.add("c.cdsl", text);
    let meet = include_str!("../../../components/interfaces/World.idsl");
    let loader = MemoryLoader::new([("World.idsl", meet)]);
    let (component, found) = rc_cdsl::load(&mut sources, &loader, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    let component = component.expect("a component");
    let slots = component.slots.iter();
    let slots: Vec<_> = slots.map(|slot| (&*slot.name, slot.of_world)).collect();
    let names = ["any", "any_stream", "any_peers", "any_streams"];
    assert_eq!(slots, names.map(|name| (name, false)));
    let world = component.world.expect("a world");
    assert_eq!((world.schema, &*world.name.text), (None, "any"));
    assert_eq!(world.access.expect("a block").writes.len(), 1);
}

/// Another module may have an interface of this name.
#[test]
fn slots_of_a_world_without_its_clause_are_reported() {
    let meet = include_str!("../../../components/interfaces/World.idsl");
    let other = "module Maps { interface World { void change(int of); }; };";
    let in_rust = expect![[r#"
        c.cdsl:2:42: warning[undeclared-world]: `World` is a slot of a world, and the component has no clause `world` (write `world any as g;` in place of the slots of `World.idsl`)
    "#]];
    let in_python = expect![[r#"
        c.cdsl:2:42: warning[undeclared-world]: `World` is a slot of a world, and the component has no clause `world` (write `world "FILE.gdsl" as g;` in place of the slots of `World.idsl`)
    "#]];
    for (module, language, expected) in [
        (meet, "rust", in_rust),
        (meet, "python", in_python),
        (meet, "cpp", expect![[""]]),
        (other, "rust", expect![[""]]),
    ] {
        let text = format!(
            "import \"World.idsl\";\nComponent C {{ Communications {{ publishes World; }}; language {language}; }};"
        );
        let mut sources = SourceMap::new();
        let source = sources.add("c.cdsl", text);
        let loader = MemoryLoader::new([("World.idsl", module)]);
        let (_, found) = rc_cdsl::load(&mut sources, &loader, source);
        expected.assert_eq(&render(&sources, &found, Format::Short));
    }
}

#[test]
fn words_of_a_world_are_names_elsewhere() {
    let world = check(
        "world \"home.gdsl\" as world { writes stream, shared.reads shared; };",
        &expect![[r#""#]],
    );
    let access = world.expect("a world").access.expect("a block");
    let paths: Vec<String> = access
        .writes
        .iter()
        .map(rc_cdsl::model::Write::path)
        .collect();
    assert_eq!(paths, ["stream", "shared.reads"]);
}

#[test]
fn what_does_not_fit_is_reported() {
    check(
        "world \"a.gdsl\" as g { writes door stream; reads door.width, room shared, wall stream 5ms; };",
        &expect![[r#"
            c.cdsl:3:35: error[bad-world-access]: `door` is a type, but attributes are streamed (name the attribute: `door.ATTRIBUTE stream`)
            c.cdsl:3:54: error[bad-world-access]: `width` is an attribute, but types are read (write `reads door;`)
            c.cdsl:3:66: error[bad-world-access]: `shared` belongs to what a component writes (remove the word)
            c.cdsl:3:79: error[bad-world-access]: `stream` belongs to what a component writes (remove the word)
        "#]],
    );
    check(
        "world \"a.gdsl\" as g { writes door, door shared; reads room, room; writes wall.x stream stream; };",
        &expect![[r#"
            c.cdsl:3:36: error[repeated-clause]: `writes` names this twice; first named here at c.cdsl:3:30
            c.cdsl:3:61: error[repeated-clause]: `reads` names this twice; first named here at c.cdsl:3:55
            c.cdsl:3:88: error[repeated-clause]: `stream` occurs twice
        "#]],
    );
    check(
        "world \"a.gdsl\" as g { writes wall.x stream fast; };",
        &expect![[r#"
            c.cdsl:3:44: error[syntax-error]: expected `,`, `;`, `shared`, `stream` or a duration such as `50ms`, found `fast`
        "#]],
    );
    check(
        "world \"a.gdsl\" as g { wirtes wall; };\nworld \"~/b.gdsl\" as h;",
        &expect![[r#"
            c.cdsl:3:23: error[unknown-clause]: expected `writes` or `reads`, found `wirtes` (did you mean `writes`?)
            c.cdsl:4:1: error[repeated-clause]: duplicate clause `world`; first used here at c.cdsl:3:1
            c.cdsl:4:7: error[home-in-path]: `~/b.gdsl` begins with `~`, which only a shell expands (write the path from this file, or an absolute one)
        "#]],
    );
    check(
        "world all as g;",
        &expect![[r#"
            c.cdsl:3:7: error[syntax-error]: expected `any` or a string, found `all`
        "#]],
    );
    check(
        "world \"a.gdsl\" { };",
        &expect![[r#"
        c.cdsl:3:16: error[syntax-error]: expected `as`, found `{`
    "#]],
    );
    check(
        "world \"a.gdsl\" as g { writes ; };",
        &expect![[r#"
        c.cdsl:3:30: error[syntax-error]: expected a name, found `;`
    "#]],
    );
    check(
        "world \"a.gdsl\" as g { writes wall.x stream -3ms; };",
        &expect![[r#"
            c.cdsl:3:44: error[bad-world-access]: expected the least time between two values, such as `20ms`
        "#]],
    );
}

#[test]
fn another_file_of_the_name_is_no_world() {
    let text = "Component C { Communications { }; language rust;\n\nworld \"a.gdsl\" as g;\n};\n";
    let mut sources = SourceMap::new();
    let source = sources.add("c.cdsl", text);
    let loader = MemoryLoader::new([("World.idsl", "module Maps { interface World { }; };")]);
    let (_, found) = rc_cdsl::load(&mut sources, &loader, source);
    expect![[r#"
        c.cdsl:3:7: error[unknown-interface]: a world needs the `World.idsl` that comes with the tools, and another file has this name; its module at World.idsl:1:8 (rename that file)
    "#]].assert_eq(&render(&sources, &found, Format::Short));
}

#[test]
fn the_option_dsr_is_a_world_with_the_types_of_dsr() {
    let world = check("options DSR;", &expect![[r#""#]]).expect("a world");
    let schema = world.schema.expect("a schema");
    let names = (&*schema.text, &*world.name.text);
    assert_eq!((names, world.access), (("dsr.gdsl", "g"), None));
    check(
        "world \"dsr.gdsl\" as g; options dsr;",
        &expect![[r#"
            c.cdsl:3:32: error[repeated-clause]: duplicate clause `world`; first used here at c.cdsl:3:1
        "#]],
    );
}
