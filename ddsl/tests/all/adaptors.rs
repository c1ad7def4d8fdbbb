//! Components that convert in a process of their own: `convert via process;`.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::network::{connect, network};
use expect_test::{Expect, expect};

/// A network of a client with `Laser` in metres and a server in millimetres, or of a subscriber and
/// a publisher.
fn converted(roles: [&str; 2], binds: &str, expected: &Expect) -> Vec<String> {
    let interface = if roles[0] == "requires" {
        "D get(@unit(\"s\") float at) throws Late;"
    } else {
        "publish push(D x);"
    };
    let [ours, theirs] = [("m", roles[0]), ("mm", roles[1])].map(|(unit, role)| {
        format!(
            "[module L {{ struct D {{ @unit(\"{unit}\") float x; }}; exception Late {{ @unit(\"{unit}\") float by; }};
            interface Laser {{ {interface} }}; }};]{role} Laser;"
        )
    });
    connect(&[("a", &ours), ("b", &theirs)], binds, expected)
}

#[test]
fn an_adaptor_converts_in_place_of_the_consumer() {
    let made = converted(
        ["subscribesTo", "publishes"],
        "bind a.Laser -> b.Laser { convert via process; };",
        &expect![[""]],
    );
    expect![[r#"
        a.Laser -> a_Laser_adaptor.consumer
        a_Laser_adaptor.provider -> b.Laser converts L::D.x mm ×1/1000 = m, 1 operation a number by 0i:f{1/1000}"#]].assert_eq(&made.join("\n"));
    let made = converted(
        ["requires", "implements"],
        "bind a.Laser -> b.Laser { convert via process { }; };",
        &expect![[""]],
    );
    expect![[r#"
        a.Laser -> a_Laser_adaptor.consumer
        a_Laser_adaptor.provider -> b.Laser converts L::D.x mm ×1/1000 = m, 1 operation a number; L::Late.by mm ×1/1000 = m, 1 operation a number by 0o:f{1/1000},0e0:f{1/1000}"#]].assert_eq(&made.join("\n"));
}

#[test]
fn an_adaptor_is_for_its_consumer_only() {
    let end = |unit: &str, role: &str| {
        format!(
            "[module L {{ interface Laser {{ void push(@unit(\"{unit}\") float x); }}; }};]{role} Laser;"
        )
    };
    let (metres, others) = (end("m", "subscribesTo"), end("mm", "subscribesTo"));
    let made = connect(
        &[
            ("a", &metres),
            ("b", &end("mm", "publishes")),
            ("c", &others),
        ],
        "bind a.Laser -> b.Laser { convert via process; };",
        &expect![[""]],
    );
    expect![[r#"
        a.Laser -> a_Laser_adaptor.consumer
        c.Laser -> b.Laser
        a_Laser_adaptor.provider -> b.Laser converts push.x mm ×1/1000 = m, 1 operation a number by 0i:f{1/1000}"#]].assert_eq(&made.join("\n"));
}

#[test]
fn an_adaptor_connects_two_middlewares() {
    let all = [
        ("a", "subscribesTo Pub; requires Laser;"),
        ("b", "publishes Pub; implements Laser;"),
    ];
    let body = |block: &str| {
        format!(
            "bind a.Pub -> b.Pub{block};\nbind a.Laser -> b.Laser{block};\n
            Group arm {{ export Pub, Laser; Component b {{ cdsl \"b\"; middleware dds; }}; }};
            Component a {{ cdsl \"a\"; middleware iceoryx2; }};",
        )
        .replace("-> b.", "-> arm.")
    };
    network(
        &body(""),
        &all,
        &expect![[r#"
        n.ddsl:2:6: error[middleware-mismatch]: `a.Pub` and `arm.b.Pub` use different middleware: `iceoryx2` and `dds` (give both ends one middleware, or let a process stand between them: `bind a.Pub -> arm.b.Pub { convert via process; };`)
        n.ddsl:3:6: error[middleware-mismatch]: `a.Laser` and `arm.b.Laser` use different middleware: `iceoryx2` and `dds` (give both ends one middleware, or let a process stand between them: `bind a.Laser -> arm.b.Laser { convert via process; };`)
    "#]],
    );
    let made = network(&body(" { convert via process; }"), &all, &expect![[""]]);
    expect![[r#"
        a.Pub -> a_Pub_adaptor.consumer
        a.Laser -> a_Laser_adaptor.consumer
        a_Pub_adaptor.provider -> arm.b.Pub over dds
        a_Laser_adaptor.provider -> arm.b.Laser over dds"#]]
    .assert_eq(&made.join("\n"));
}

#[test]
fn an_adaptor_asks_the_tree_of_its_consumer() {
    let frames = |tree: &str| {
        let block = format!("{{ convert via process {{ frames {tree}; }}; }}");
        format!("bind a.Laser -> b.Laser {block}; bind a.tree -> w.InnerModel;")
    };
    let end = |units: &str, frames: &str, role: &str| {
        format!(
            "[module L {{ struct P {{ float x; float y; float z; @unit(\"ns\") long at; }}; interface Laser {{ void push(P p); }}; }};|||
            import \"Laser.idsl\";
            axes own :: ahead, left, up
            algebraic named :: Scalar{{x, y, z}}
            units own :: qudt, named {{ x = {units}, y = {units}, z = {units} }}
            dproto point :: geometry {{ semantic = Position coord = cartesian algebraic = named
                ddr = :: IDSL{{L::P}} dr = {{ x = x, y = y, z = z }} units = own axes = own
                frames = {{ {frames} }} }}]{role}"
        )
    };
    let all = [
        (
            "a",
            &*end(
                "m",
                "with_respect_to = map",
                "subscribesTo Laser; requires InnerModel as tree;",
            ),
        ),
        (
            "b",
            &*end(
                "mm",
                "with_respect_to = lidar, stamp = member at",
                "publishes Laser;",
            ),
        ),
        ("w", "implements InnerModel;"),
    ];
    let made = connect(&all, &frames("tree"), &expect![[""]]);
    expect![[r#"
        a.Laser -> a_Laser_adaptor.consumer
        a.tree -> w.InnerModel
        a_Laser_adaptor.provider -> b.Laser converts L::P units mm ×1/1000 = m, frames lidar → map at member at; 24 operations a value; float32, in the range of float32, bounded: 6.0e-8 of the value by 0i^lidar>map@0*1:{3f!q?|d@0&1e3;d@1&1e3;d@2&1e3;m^0&$0;m^1&$1;a$3&$4;m^2&$2;a$5&$6;m^4&$0;m^5&$1;a$8&$9;m^6&$2;a$10&$11;m^8&$0;m^9&$1;a$13&$14;m^10&$2;a$15&$16;a$7&^3;a$12&^7;a$17&^11;t$18;t$19;t$20;=$21&$22&$23}
        a_Laser_adaptor.tree -> w.InnerModel"#]].assert_eq(&made.join("\n"));
    connect(
        &all,
        &frames("trea"),
        &expect![[r#"
        n.ddsl:2:56: error[unknown-slot]: `a` has no slot `trea`; its component at a.cdsl:2:11 (did you mean `tree`?)
    "#]],
    );
}

#[test]
fn ends_that_do_not_fit_are_reported_as_without_an_adaptor() {
    let block = "{ convert via process; }";
    let all = [
        ("a", "requires Laser;"),
        ("b", "implements Laser; publishes Pub;"),
    ];
    connect(
        &all,
        &format!("bind a.Laser -> b.Pub {block};"),
        &expect![[r#"
            n.ddsl:2:17: error[wrong-direction]: `a.Laser` needs a slot that implements its interface, but `b.Pub` publishes it; declared here at b.cdsl:2:60
            n.ddsl:4:11: note[no-subscriber]: `b.Pub` has no subscriber
        "#]],
    );
    connect(
        &all,
        &format!("bind b.Laser -> a.Laser {block};"),
        &expect![[r#"
            n.ddsl:2:6: error[wrong-direction]: expected a consumer left of `->`, but `b.Laser` implements its interface; declared here at b.cdsl:2:43 (write the slot that requires or subscribes left of `->`)
            n.ddsl:4:11: note[no-subscriber]: `b.Pub` has no subscriber
        "#]],
    );
    connect(
        &all,
        &format!("bind a.Laser -> b.Laser {block};"),
        &expect![[r#"
            n.ddsl:2:27: warning[nothing-to-convert]: `convert` has no effect: both ends mean the same (remove it)
            n.ddsl:4:11: note[no-subscriber]: `b.Pub` has no subscriber
        "#]],
    );
    connect(
        &all,
        "bind a.Laser -> b.Laser { convert via proces; }; bind a.Laser -> b.Laser { convert via; };",
        &expect![[r#"
            n.ddsl:2:27: warning[nothing-to-convert]: `convert` has no effect: both ends mean the same (remove it)
            n.ddsl:2:39: error[unknown-field]: expected `process`, found `proces` (did you mean `process`?)
            n.ddsl:2:55: error[bound-twice]: `a.Laser` is bound twice to `b.Laser`; first bound here at n.ddsl:2:6
            n.ddsl:2:87: error[syntax-error]: expected a name, found `;`
            n.ddsl:4:11: note[no-subscriber]: `b.Pub` has no subscriber
        "#]],
    );
}
