//! Programs that are not part of a network, of which the file has a `.cdsl`.

use crate::network::network;
use expect_test::{Expect, expect};

/// Ends with `Laser` in a unit.
fn end(unit: &str, communications: &str) -> String {
    format!(
        "[module L {{ struct D {{ @unit(\"{unit}\") float x; }}; interface Laser {{ D get(@unit(\"s\") float at); }};
        interface Other {{ void push(D x); }}; }};]{communications}"
    )
}

/// A network of `a` with `Laser` in metres. The program `other` outside has it in millimetres.
fn outside(communications: [&str; 2], declared: &str, expected: &Expect) -> Vec<String> {
    let [own, other] = [("m", communications[0]), ("mm", communications[1])]
        .map(|(unit, communications)| end(unit, &format!("{communications};")));
    let body = format!("{declared}\nComponent a {{ cdsl \"a\"; }};\n");
    network(&body, &[("a", &own), ("other", &other)], expected)
}

#[test]
fn a_consumer_converts_what_a_program_outside_sends() {
    let text = "external a.Laser at \"their/laser\" { cdsl \"other\"; convert; };";
    let made = outside(["requires Laser", "implements Laser"], text, &expect![[""]]);
    expect![
        "a.Laser with outside `their/laser` converts L::D.x mm ×1/1000 = m, 1 operation a number"
    ]
    .assert_eq(&made.join("\n"));
    let text = text.replace(" convert;", "");
    outside(
        ["requires Laser", "implements Laser"],
        &text,
        &expect![[r#"
        n.ddsl:2:10: error[unit-mismatch]: `a.Laser` has `L::D.x` in m, but `other.Laser` has it in mm; the consumer's declaration at Laser.idsl:1:40; the provider's declaration at Laser.idsl:1:41 (they mean the same quantity (length; mm ×1/1000 = m): `external a.Laser { cdsl "other"; convert; };` converts (1 operation a number))
    "#]],
    );
}

#[test]
fn a_program_outside_gets_an_adaptor() {
    let text = "external a.Laser { cdsl \"other\"; convert; };";
    let made = outside(["implements Laser", "requires Laser"], text, &expect![[""]]);
    expect![[r"
        a_Laser_adaptor.provider -> a.Laser converts L::D.x m ×1000 = mm, 1 operation a number by 0o:f{1000}
        a_Laser_adaptor.consumer with outside ``"]].assert_eq(&made.join("\n"));
    let text = text.replace(" convert;", "");
    outside(
        ["implements Laser", "requires Laser"],
        &text,
        &expect![[r#"
        n.ddsl:2:10: error[unit-mismatch]: `other.Laser` has `L::D.x` in mm, but `a.Laser` has it in m; the consumer's declaration at Laser.idsl:1:41; the provider's declaration at Laser.idsl:1:40 (they mean the same quantity (length; m ×1000 = mm): `external a.Laser { cdsl "other"; convert; };` converts (1 operation a number))
    "#]],
    );
}

#[test]
fn a_process_stands_before_a_program_outside() {
    let text = "external a.Laser at \"x\" { cdsl \"other\"; convert via process; };";
    let made = outside(
        ["requires Laser", "implements Laser(ros2)"],
        text,
        &expect![[""]],
    );
    expect![[r"
        a.Laser -> a_Laser_adaptor.consumer
        a_Laser_adaptor.provider with outside `x` converts L::D.x mm ×1/1000 = m, 1 operation a number"]].assert_eq(&made.join("\n"));
    let text = text.replace(" via process", "");
    outside(
        ["requires Laser", "implements Laser(ros2)"],
        &text,
        &expect![[r#"
            n.ddsl:2:10: error[middleware-mismatch]: `a.Laser` and `other.Laser` use different middleware: `iceoryx2` and `ros2` (give both ends one middleware, or let a process stand between them: `external a.Laser { cdsl "other"; convert via process; };`)
        "#]],
    );
}

#[test]
fn several_programs_outside_get_an_adaptor_each() {
    let text = "external g.Laser at \"one\" { cdsl \"other\"; convert; };
        external g.Laser at \"two\" { cdsl \"other\"; convert; };
        Group g { export Laser; Component a { cdsl \"a\"; }; };";
    let (own, other) = (end("m", "implements Laser;"), end("mm", "requires Laser;"));
    let made = network(text, &[("a", &own), ("other", &other)], &expect![[""]]);
    expect![[r"
        g.a_Laser_adaptor.provider -> g.a.Laser converts L::D.x m ×1000 = mm, 1 operation a number by 0o:f{1000}
        g.a_Laser_adaptor_2.provider -> g.a.Laser converts L::D.x m ×1000 = mm, 1 operation a number by 0o:f{1000}
        g.a_Laser_adaptor.consumer with outside `one`
        g.a_Laser_adaptor_2.consumer with outside `two`"]].assert_eq(&made.join("\n"));
}

#[test]
fn an_address_needs_an_adaptor() {
    // The units are equal: nothing has to be converted.
    let (own, other) = (end("m", "implements Laser;"), end("m", "requires Laser;"));
    network(
        "external a.Laser at \"x\" { cdsl \"other\"; };\nComponent a { cdsl \"a\"; };",
        &[("a", &own), ("other", &other)],
        &expect![[r"
            n.ddsl:2:21: error[missing-clause]: without `convert`, programs outside have the address of `a.Laser` itself, not `x` (add `convert;`, so that an adaptor serves them here, or remove `at`)
        "]],
    );
}

#[test]
fn a_file_that_describes_no_peer_is_refused() {
    let text = "external a.Laser { cdsl \"other\"; convert; };";
    outside(
        ["implements Laser", "implements Laser"],
        text,
        &expect![[r"
        n.ddsl:2:25: error[unknown-slot]: `other` has no slot that requires `L::Laser`, as the peer of `Laser` does; its component at other.cdsl:2:11
    "]],
    );
    let both = "requires Laser as one, Laser as two";
    outside(
        ["implements Laser", both],
        text,
        &expect![[r"
            n.ddsl:2:25: error[ambiguous-slot]: `other` has two slots of which each requires `L::Laser`: `one` and `two`; its component at other.cdsl:2:11 (name a file with one of them)
        "]],
    );
    let frames = text.replace("convert;", "convert { frames tree; };");
    outside(
        ["implements Laser", "requires Laser"],
        &frames,
        &expect![[r"
            n.ddsl:2:51: error[wrong-frames]: a program outside has no slot that knows where frames are (change the frame in a component of the network)
        "]],
    );
    outside(
        ["requires Laser", "implements Laser"],
        &frames,
        &expect![[r"
            n.ddsl:2:51: error[wrong-frames]: `a.Laser` calls, and only samples change their frame; declared here at a.cdsl:2:41 (ask the tree in the component)
        "]],
    );
}

#[test]
fn an_external_slot_has_one_connection() {
    let text = "external a.Laser { cdsl \"other\"; convert; };";
    let both = format!("{text} {text}");
    outside(
        ["requires Laser", "implements Laser"],
        &both,
        &expect![[r"
        n.ddsl:2:55: error[bound-twice]: `a.Laser` is bound already; first bound here at n.ddsl:2:10
    "]],
    );
    let (own, other) = (end("m", "requires Laser;"), end("mm", "implements Laser;"));
    let body = format!(
        "bind a.Laser -> b.Laser {{ convert; }}; {text} Component a {{ cdsl \"a\"; }};\nComponent b {{ cdsl \"other\"; }};"
    );
    network(
        &body,
        &[("a", &own), ("other", &other)],
        &expect![[r"
        n.ddsl:2:48: error[bound-twice]: `a.Laser` is bound already; first bound here at n.ddsl:2:6
    "]],
    );
}

#[test]
fn the_block_of_an_external_slot() {
    for (block, expected) in [
        (
            "convert;",
            expect![[r#"
            n.ddsl:2:18: error[missing-clause]: the block of an external slot has no `cdsl` (name the file that describes the peer: `cdsl "lidar.cdsl";`)
        "#]],
        ),
        (
            "cdsl \"other\"; cdsl \"other\"; convert;",
            expect![[r"
            n.ddsl:2:34: error[repeated-clause]: `cdsl` occurs twice; first here at n.ddsl:2:20
        "]],
        ),
        (
            "cdsl \"other\"; covert;",
            expect![[r#"
            n.ddsl:2:10: error[unit-mismatch]: `a.Laser` has `L::D.x` in m, but `other.Laser` has it in mm; the consumer's declaration at Laser.idsl:1:40; the provider's declaration at Laser.idsl:1:41 (they mean the same quantity (length; mm ×1/1000 = m): `external a.Laser { cdsl "other"; convert; };` converts (1 operation a number))
            n.ddsl:2:34: error[unknown-field]: expected `cdsl` or `convert`, found `covert` (did you mean `convert`?)
        "#]],
        ),
        (
            "cdsl other;",
            expect![[r"
            n.ddsl:2:25: error[syntax-error]: expected a string, found `other`
        "]],
        ),
        (
            "",
            expect![[r#"
            n.ddsl:2:18: error[missing-clause]: the block of an external slot has no `cdsl` (name the file that describes the peer: `cdsl "lidar.cdsl";`)
        "#]],
        ),
    ] {
        let text = format!("external a.Laser {{ {block} }};");
        outside(["requires Laser", "implements Laser"], &text, &expected);
    }
}
