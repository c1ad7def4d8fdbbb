//! Which schemas of components fit that of a network.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::{misfit, parts};
use expect_test::{Expect, expect};
use rc_cdsl::model::{Access, Write};
use rc_codegen::world::World;
use rc_diagnostics::{Diagnostics, Format, SourceMap, Span, render};
use rc_syntax::{MemoryLoader, Name};
use std::path::Path;

const HOME: &str = r#"import "geometry.gdsl";
Domain home
{
    entity room : Frame { length float unit "m" 0: optional; };
    entity door : Frame { width float unit "m" 0:; opened float 0:1 optional; };
    entity key { name string key; weight float; };
    entity lock { name string key; };
    relation opens { key key; door door; };
    relation mounted { lock lock 1:; door door; };
    require key.weight <= door.width of opens "too heavy";
    query doors() "MATCH (d:door) RETURN d";
};
"#;

/// What is wrong with a component that has this schema and writes this, or everything.
fn check(own: &str, writes: Option<&[&str]>, expected: &Expect) {
    let mut sources = SourceMap::new();
    let names = sources.add("patrol.ddsl", "here there");
    let name = |text: &str, from: usize| Name::new(text, Span::new(names, from, from + 4));
    let (ours, whole) = (name("own.gdsl", 0), name("home.gdsl", 5));
    let loader = MemoryLoader::new([("own.gdsl", own), ("home.gdsl", HOME)]);
    let mut found = Diagnostics::new();
    let mut read = |of: &Name| {
        let from = Path::new("patrol.ddsl");
        let world = World::import(from, of, &mut sources, &loader, &mut found);
        world.expect("a schema")
    };
    let (own, network) = (read(&ours), read(&whole));
    let access = writes.map(|kinds| Access {
        writes: kinds
            .iter()
            .map(|kind| Write {
                kind: Name::new(*kind, ours.span),
                attribute: None,
                stream: None,
                shared: false,
            })
            .collect(),
        reads: Vec::new(),
    });
    let misfit = misfit(&network, access.as_ref(), &own, &sources);
    found.extend(misfit.map(|misfit| misfit.diagnostic("finder", ours.span, whole.span)));
    expected.assert_eq(&render(&sources, &found, Format::Human));
}

fn fits(own: &str, writes: Option<&[&str]>) {
    check(own, writes, &expect![[""]]);
}

#[test]
fn a_part_of_the_schema_fits() {
    fits(HOME, None);
    // With fewer types, attributes, rules and queries, and another name of the domain.
    fits(
        "import \"geometry.gdsl\";\nDomain doors { entity door : Frame { width float unit \"m\" 0:; }; };",
        None,
    );
    // What it inherits is declared as its own.
    fits(
        "Domain doors { entity door { name string; width float unit \"m\" 0:; }; };",
        Some(&["door"]),
    );
    // An edge `RT` is a `Pose` to others, and needs no edge `of`.
    fits(
        "Domain frames { entity Frame { name string; }; entity Pose { }; relation RT { parent Frame; child Frame; \
         pose pose history 2s; tree interpolated; promotes Pose; }; };",
        Some(&["Frame", "RT"]),
    );
    // A component that adds no door need not know what each has.
    fits(
        "Domain doors { entity door { name string; opened float 0:1 optional; }; };",
        Some(&[]),
    );
}

#[test]
fn another_declaration_does_not_fit() {
    check(
        "Domain doors\n{\n    entity door { name string; width float unit \"mm\" 0:; };\n};",
        None,
        &expect![[r#"
            error[world-schema]: the world of `finder` does not fit: the component declares `door.width` as `float unit "mm" 0:`, and the network as `float unit "m" 0:`
             --> own.gdsl:3:32
              |
            3 |     entity door { name string; width float unit "mm" 0:; };
              |                                ^^^^^
              |
             ::: home.gdsl:5:27
              |
            5 |     entity door : Frame { width float unit "m" 0:; opened float 0:1 optional; };
              |                           ^^^^^ the schema of the network
              |
              = help: correct one of them, or remove it from the file of the component: it may declare a part of what the network declares
        "#]],
    );
    check(
        "Domain doors\n{\n    entity door { name string; width float unit \"m\" 0:; colour string; };\n    entity window { };\n};",
        None,
        &expect![[r#"
            error[world-schema]: the world of `finder` does not fit: the component declares `door.colour`, and the network does not; 1 more differ
             --> own.gdsl:3:57
              |
            3 |     entity door { name string; width float unit "m" 0:; colour string; };
              |                                                         ^^^^^^
              |
             ::: patrol.ddsl:1:6
              |
            1 | here there
              |      ^^^^ the schema of the network
              |
              = help: correct one of them, or remove it from the file of the component: it may declare a part of what the network declares
        "#]],
    );
    check(
        "import \"geometry.gdsl\";\nDomain doors { entity Way { }; entity door : Way { width float unit \"m\" 0:; }; };",
        None,
        &expect![[r#"
            error[world-schema]: the world of `finder` does not fit: the component declares `Way`, and the network does not; 1 more differ
             --> own.gdsl:2:23
              |
            2 | Domain doors { entity Way { }; entity door : Way { width float unit "m" 0:; }; };
              |                       ^^^
              |
             ::: patrol.ddsl:1:6
              |
            1 | here there
              |      ^^^^ the schema of the network
              |
              = help: correct one of them, or remove it from the file of the component: it may declare a part of what the network declares
        "#]],
    );
    check(
        "Domain doors open { };",
        None,
        &expect![[r#"
        error[world-schema]: the world of `finder` does not fit: the component declares `Domain … open`, and the network does not
         --> own.gdsl:1:8
          |
        1 | Domain doors open { };
          |        ^^^^^
          |
         ::: home.gdsl:2:8
          |
        2 | Domain home
          |        ^^^^ the schema of the network
          |
          = help: correct one of them, or remove it from the file of the component: it may declare a part of what the network declares
    "#]],
    );
    check(
        "Domain keys\n{\n    entity key { name string key; weight float; };\n    entity door { width float unit \"m\" 0:; };\n    relation opens { key key; door door; };\n    require key.weight < door.width of opens \"too heavy\";\n};",
        Some(&[]),
        &expect![[r#"
            error[world-schema]: the world of `finder` does not fit: the component declares `require key.weight < door.width of opens`, and the network does not
             --> own.gdsl:6:46
              |
            6 |     require key.weight < door.width of opens "too heavy";
              |                                              ^^^^^^^^^^^
              |
             ::: patrol.ddsl:1:6
              |
            1 | here there
              |      ^^^^ the schema of the network
              |
              = help: correct one of them, or remove it from the file of the component: it may declare a part of what the network declares
        "#]],
    );
    check(
        "Domain doors\n{\n    entity door { };\n    query doors() \"MATCH (d:door) RETURN d.name\";\n};",
        Some(&[]),
        &expect![[r#"
            error[world-schema]: the world of `finder` does not fit: the component declares `query doors` as `() "MATCH (d:door) RETURN d.name"`, and the network as `() "MATCH (d:door) RETURN d"`
              --> own.gdsl:4:11
               |
             4 |     query doors() "MATCH (d:door) RETURN d.name";
               |           ^^^^^
               |
              ::: home.gdsl:11:11
               |
            11 |     query doors() "MATCH (d:door) RETURN d";
               |           ^^^^^ the schema of the network
               |
               = help: correct one of them, or remove it from the file of the component: it may declare a part of what the network declares
        "#]],
    );
}

/// The graph of the network would refuse such an element.
#[test]
fn a_component_knows_what_each_element_has_that_it_adds() {
    check(
        "Domain doors\n{\n    entity door { name string; };\n};",
        Some(&["door"]),
        &expect![[r#"
            error[world-schema]: the world of `finder` does not fit: the component may add a `door`, and does not declare `door.width`, which the network requires
             --> own.gdsl:3:12
              |
            3 |     entity door { name string; };
              |            ^^^^
              |
             ::: home.gdsl:5:27
              |
            5 |     entity door : Frame { width float unit "m" 0:; opened float 0:1 optional; };
              |                           ^^^^^ the schema of the network
              |
              = help: declare `width float unit "m" 0:;` there, or make it `optional`
        "#]],
    );
    check(
        "Domain locks\n{\n    entity lock { name string key; };\n};",
        None,
        &expect![[r#"
            error[world-schema]: the world of `finder` does not fit: the component may add a `lock`, and does not declare `mounted`, which the network requires
             --> own.gdsl:3:12
              |
            3 |     entity lock { name string key; };
              |            ^^^^
              |
             ::: home.gdsl:9:14
              |
            9 |     relation mounted { lock lock 1:; door door; };
              |              ^^^^^^^ the schema of the network
              |
              = help: declare `relation mounted` there, or name what the component writes
        "#]],
    );
}

#[test]
fn a_long_schema_has_several_options() {
    assert_eq!(parts("", 4), [""; 0]);
    assert_eq!(parts("room", 4), ["room"]);
    assert_eq!(parts("roomé door", 5), ["room", "é do", "or"]);
}
