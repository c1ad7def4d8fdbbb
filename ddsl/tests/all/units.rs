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
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` expects `push.x` in m, but `b.Laser` sends it in cm; the consumer's declaration at Laser.idsl:1:57; the provider's declaration at Laser.idsl:1:58 (they mean the same quantity (length; cm ×1/100 = m): `bind a.Laser -> b.Laser { convert; };` converts (1 operation a number))
        "#]],
    );
}

#[test]
fn equal_types_with_other_units_are_refused() {
    check(
        "struct D { @unit(\"m\") float x; }; interface Laser { D get(); };",
        "struct D { @unit(\"mm\") float x; }; interface Laser { D get(); };",
        &expect![[r#"
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `L::D.x` in m, but `b.Laser` has it in mm; the consumer's declaration at Laser.idsl:1:40; the provider's declaration at Laser.idsl:1:41 (they mean the same quantity (length; mm ×1/1000 = m): `bind a.Laser -> b.Laser { convert; };` converts (1 operation a number))
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
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `get.angle` in deg, but `b.Laser` has it in rad; the consumer's declaration at Laser.idsl:5:57; the provider's declaration at Laser.idsl:5:57 (they mean the same quantity (angle; rad ×180/π = deg): `bind a.Laser -> b.Laser { convert; };` converts (2 operations a number))
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `get.mass` in kg, but `b.Laser` has it in g; the consumer's declaration at Laser.idsl:5:86; the provider's declaration at Laser.idsl:5:85 (they mean the same quantity (mass; g ×1/1000 = kg): `bind a.Laser -> b.Laser { convert; };` converts (1 operation a number))
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `L::P.t` in °C, but `b.Laser` has it in K; the consumer's declaration at Laser.idsl:1:41; the provider's declaration at Laser.idsl:1:40 (they mean the same quantity (temperature; K ×1 -5463/20 = °C): `bind a.Laser -> b.Laser { convert; };` converts (1 operation a number))
            n.ddsl:3:11: error[unit-mismatch]: `a.Laser` has `L::Hot.since` in s, but `b.Laser` has it in ms; the consumer's declaration at Laser.idsl:4:44; the provider's declaration at Laser.idsl:4:45 (they mean the same quantity (time; ms ×1/1000 = s): `bind a.Laser -> b.Laser { convert; };` converts (1 operation a number))
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

/// Connects `a` and `b` as [`check_as`] does, by a bind that converts.
fn converting(roles: [&str; 2], ours: &str, theirs: &str, found: &Expect, expected: &Expect) {
    let communications =
        |declarations: &str, role: &str| format!("[module L {{ {declarations} }};]{role} Laser;");
    let (ours, theirs) = (
        communications(ours, roles[0]),
        communications(theirs, roles[1]),
    );
    let bind = "bind a.Laser -> b.Laser { convert; };";
    let connections = connect(&[("a", &ours), ("b", &theirs)], bind, found);
    expected.assert_eq(&connections.join("\n"));
}

const TOPIC: [&str; 2] = ["subscribesTo", "publishes"];
const CALL: [&str; 2] = ["requires", "implements"];

#[test]
fn a_subscriber_converts_what_the_publisher_sends() {
    converting(
        TOPIC,
        "struct P { string name; @unit(\"m\") float x; @unit(\"m\") float y; int id; };
         sequence<P> Ps;
         interface Laser { void push(Ps points, @unit(\"rad\") double angle, int last); void other(int x); };",
        "struct P { string name; @unit(\"mm\") float x; @unit(\"mm\") float y; int id; };
         sequence<P> Ps;
         interface Laser { void push(Ps points, @unit(\"deg\") double angle, int last); void other(int x); };",
        &expect![[r#""#]],
        &expect!["a.Laser -> b.Laser converts L::P.x mm ×1/1000 = m, 1 operation a number; L::P.y mm ×1/1000 = m, 1 operation a number; push.angle deg ×π/180 = rad, 2 operations a number by 0i:[s2f{1/1000}i]d{1/180p1}"],
    );
}

#[test]
fn a_client_converts_requests_one_way_and_replies_the_other() {
    converting(
        CALL,
        "exception Hot { @unit(\"K\") double t; };
         exception Cold { int code; @unit(\"K\") double t; };
         dictionary<string, float> Named;
         interface Laser { @unit(\"m\") float get(@unit(\"m\") int at, @optional @unit(\"s\") double d, @unit(\"kg\") out Named mass) throws Cold, Hot; };",
        "exception Hot { @unit(\"°C\") double t; };
         exception Cold { int code; @unit(\"°C\") double t; };
         dictionary<string, float> Named;
         interface Laser { @unit(\"m\") float get(@unit(\"mm\") int at, @optional @unit(\"ms\") double d, @unit(\"g\") out Named mass) throws Cold, Hot; };",
        &expect![[r#""#]],
        &expect!["a.Laser -> b.Laser converts get.at m ×1000 = mm, 1 operation a number, rounded to whole numbers; get.d s ×1000 = ms, 1 operation a number; get.mass g ×1/1000 = kg, 1 operation a number; L::Cold.t °C ×1 +5463/20 = K, 1 operation a number; L::Hot.t °C ×1 +5463/20 = K, 1 operation a number by 0i:i{1000}[d{1000}],0o:[sf{1/1000}],0e0:id{1+5463/20},0e1:d{1+5463/20}"],
    );
}

#[test]
fn a_value_in_place_has_a_plan_for_its_image() {
    converting(
        TOPIC,
        "struct P { byte id; @unit(\"m\") double x; int n; };
         sequence<P, 8> Ps; struct Scan { string<10> name; Ps points; @unit(\"m\") float ranges[4]; @optional @unit(\"s\") int t; };
         interface Laser { void push(Scan scan); };",
        "struct P { byte id; @unit(\"mm\") double x; int n; };
         sequence<P, 8> Ps; struct Scan { string<10> name; Ps points; @unit(\"mm\") float ranges[4]; @optional @unit(\"ms\") int t; };
         interface Laser { void push(Scan scan); };",
        &expect![[r#""#]],
        &expect!["a.Laser -> b.Laser converts L::P.x mm ×1/1000 = m, 1 operation a number; L::Scan.ranges mm ×1/1000 = m, 1 operation a number; L::Scan.t ms ×1/1000 = s, 1 operation a number, rounded to whole numbers by 0i:s[Bd{1/1000}i]4f{1/1000}[i{1/1000}],0I:16x8<4,24:8xd{1/1000}8x>4f{1/1000}1<0,4:i{1/1000}>"],
    );
}

#[test]
fn what_does_not_convert_stays_an_error() {
    converting(
        TOPIC,
        "struct P { float x; }; interface Laser { void push(@unit(\"m\") float x, @unit(\"m\") P p); };",
        "struct P { float x; }; interface Laser { void push(@unit(\"kg\") float x, @unit(\"mm\") P p); };",
        &expect![[r#"
            n.ddsl:2:6: error[unit-mismatch]: `a.Laser` expects `push.x` in m, but `b.Laser` sends it in kg; the consumer's declaration at Laser.idsl:1:80; the provider's declaration at Laser.idsl:1:81 (m measures length, kg measures mass: connect a provider of the same quantity)
            n.ddsl:2:6: error[unit-mismatch]: `a.Laser` expects `push.p` in m, but `b.Laser` sends it in mm; the consumer's declaration at Laser.idsl:1:96; the provider's declaration at Laser.idsl:1:98 (they mean the same quantity (length; mm ×1/1000 = m), but a unit converts numbers only: give units to the members of its structure)
            n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
        "#]],
        &expect![[r#""#]],
    );
    converting(
        TOPIC,
        "interface Laser { void push(@unit(\"m\") float x); };",
        "interface Laser { void push(@unit(\"metre\") float x); };",
        &expect![[r#"
            n.ddsl:2:27: warning[nothing-to-convert]: `convert` has no effect: both ends mean the same (remove it)
        "#]],
        &expect!["a.Laser -> b.Laser"],
    );
    let mut wide = String::from("struct S0 { @unit(\"m\") float x; };");
    for level in 1..14 {
        let inner = level - 1;
        wide += &format!("struct S{level} {{ S{inner} a; S{inner} b; }};");
    }
    wide += "interface Laser { void push(S13 x); };";
    converting(
        TOPIC,
        &wide,
        &wide.replace("\"m\"", "\"mm\""),
        &expect![[r#"
            n.ddsl:2:27: error[not-convertible]: `a.Laser` has an interface of too many members to convert (a plan has at most 8192 values in 32 levels, and 64 KiB as a text: convert in a component, or divide the interface)
            n.ddsl:4:11: note[no-subscriber]: `b.Laser` has no subscriber
        "#]],
        &expect![[r#""#]],
    );
}

#[test]
fn a_slot_converts_the_samples_of_all_publishers_in_the_same_way() {
    let in_unit = |unit: &str, role: &str| {
        format!(
            "[module L {{ interface Laser {{ void push(@unit(\"{unit}\") float x); }}; }};]{role} Laser;"
        )
    };
    let ours = in_unit("m", "subscribesTo");
    let [one, same, other] = ["mm", "mm", "cm"].map(|unit| in_unit(unit, "publishes"));
    let instances = [("a", &*ours), ("b", &*one), ("c", &*same), ("d", &*other)];
    connect(
        &instances[..3],
        "bind a.Laser -> b.Laser { convert; }; bind a.Laser -> c.Laser { convert; };",
        &expect![[r#""#]],
    );
    connect(
        &instances,
        "bind a.Laser -> b.Laser { convert; }; bind a.Laser -> c.Laser { convert; }; bind a.Laser -> d.Laser { convert; };",
        &expect![[r#"
            n.ddsl:2:82: error[different-conversions]: `a.Laser` receives other units from `d.Laser` than from `b.Laser`: a slot converts all its samples in the same way; the other publisher at n.ddsl:2:6 (subscribe with two slots, or let both publishers have the same units)
        "#]],
    );
}

#[test]
fn a_block_of_a_bind_has_only_convert() {
    let communications = ("a", "requires Laser;");
    connect(
        &[communications, ("b", "implements Laser;")],
        "bind a.Laser -> b.Laser { convrt; };",
        &expect![[r#"
            n.ddsl:2:27: error[unknown-field]: expected `convert`, found `convrt` (did you mean `convert`?)
        "#]],
    );
}
