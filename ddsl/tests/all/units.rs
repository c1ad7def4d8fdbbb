//! Units of the two ends of a connection, whose files differ.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::network::connect;
use expect_test::{Expect, expect};

/// Connects a client and a server of `Laser`, or its subscriber and publisher. Their `.idsl` files
/// have these declarations.
fn check_as(roles: [&str; 2], ours: &str, theirs: &str, expected: &Expect) {
    let communications =
        |declarations: &str, role: &str| format!("[module L {{ {declarations} }};]{role} Laser;");
    let (ours, theirs) = (
        communications(ours, roles[0]),
        communications(theirs, roles[1]),
    );
    connect(&[("a", &ours), ("b", &theirs)], "", expected);
}

fn check(ours: &str, theirs: &str, expected: &Expect) {
    check_as(["requires", "implements"], ours, theirs, expected);
}

#[test]
fn a_subscriber_learns_what_the_publisher_sends() {
    check_as(
        ["subscribesTo", "publishes"],
        "interface Laser { void push(@unit(\"m\") float x); };",
        "interface Laser { void push(@unit(\"cm\") float x); };",
        &expect![[r#"
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` expects `push.x` in m, but `b.Laser` sends it in cm; the consumer's declaration at Laser.idsl:1:57; the provider's declaration at Laser.idsl:1:58 (they mean the same quantity (length; cm ×1/100 = m): let both import one file, and convert in a component)
        "#]],
    );
}

#[test]
fn equal_types_with_other_units_are_refused() {
    check(
        "struct D { @unit(\"m\") float x; }; interface Laser { D get(); };",
        "struct D { @unit(\"mm\") float x; }; interface Laser { D get(); };",
        &expect![[r#"
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `L::D.x` in m, but `b.Laser` has it in mm; the consumer's declaration at Laser.idsl:1:40; the provider's declaration at Laser.idsl:1:41 (they mean the same quantity (length; mm ×1/1000 = m): let both import one file, and convert in a component)
        "#]],
    );
    check(
        "struct D { @unit(\"rad/s\") float x; }; interface Laser { D get(); };",
        "struct D { @unit(\"1/s\") float x; }; interface Laser { D get(); };",
        &expect![[r#"
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `L::D.x` in rad/s, but `b.Laser` has it in 1/s; the consumer's declaration at Laser.idsl:1:44; the provider's declaration at Laser.idsl:1:42 (rad/s measures time^-1·angle, 1/s measures time^-1: connect a provider of the same quantity)
        "#]],
    );
}

#[test]
fn units_are_found_in_every_place() {
    check(
        "struct P { @unit(\"°C\") float t; };
         sequence<P> Ps;
         dictionary<string, Ps> Named;
         exception Hot { @unit(\"s\") double since; };
         interface Laser { Named get(@unit(\"deg\") float angle, @unit(\"kg\") out float mass) throws Hot; };",
        "struct P { @unit(\"K\") float t; };
         sequence<P> Ps;
         dictionary<string, Ps> Named;
         exception Hot { @unit(\"ms\") double since; };
         interface Laser { Named get(@unit(\"rad\") float angle, @unit(\"g\") out float mass) throws Hot; };",
        &expect![[r#"
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `get.angle` in deg, but `b.Laser` has it in rad; the consumer's declaration at Laser.idsl:5:57; the provider's declaration at Laser.idsl:5:57 (they mean the same quantity (angle; rad ×180/π = deg): let both import one file, and convert in a component)
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `get.mass` in kg, but `b.Laser` has it in g; the consumer's declaration at Laser.idsl:5:86; the provider's declaration at Laser.idsl:5:85 (they mean the same quantity (mass; g ×1/1000 = kg): let both import one file, and convert in a component)
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `L::P.t` in °C, but `b.Laser` has it in K; the consumer's declaration at Laser.idsl:1:41; the provider's declaration at Laser.idsl:1:40 (they mean the same quantity (temperature; K ×1 -5463/20 = °C): let both import one file, and convert in a component)
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `L::Hot.since` in s, but `b.Laser` has it in ms; the consumer's declaration at Laser.idsl:4:44; the provider's declaration at Laser.idsl:4:45 (they mean the same quantity (time; ms ×1/1000 = s): let both import one file, and convert in a component)
        "#]],
    );
}

#[test]
fn equal_units_may_be_written_in_different_ways() {
    check(
        "struct D { @unit(\"m/s^2\") float x; @unit(\"furlong\") float y; float z; }; interface Laser { D get(); };",
        "struct D { @unit(\"m*s^-2\") float x; @unit(\"furlong\") float y; float z; }; interface Laser { D get(); };",
        &expect![[""]],
    );
}

#[test]
fn units_without_a_meaning_must_be_equal_texts() {
    check(
        "struct D { @unit(\"furlong\") float x; }; interface Laser { D get(); };",
        "struct D { @unit(\"m\") float x; }; interface Laser { D get(); };",
        &expect![[r#"
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `L::D.x` in furlong, but `b.Laser` has it in m; the consumer's declaration at Laser.idsl:1:46; the provider's declaration at Laser.idsl:1:40 (units that are not in the table must be equal as texts)
        "#]],
    );
}

#[test]
fn a_unit_that_one_file_leaves_out_is_a_warning() {
    check(
        "struct D { float x; }; interface Laser { D get(); };",
        "struct D { @unit(\"mm\") float x; }; interface Laser { D get(); };",
        &expect![[r#"
            n.ddsl:3:11: warning[unit-missing]: `b.Laser` has `L::D.x` in mm, but `a.Laser` says no unit; the consumer's declaration at Laser.idsl:1:29; the provider's declaration at Laser.idsl:1:41 (if it is in mm, write `@unit("mm")` in the other file, too)
        "#]],
    );
}
