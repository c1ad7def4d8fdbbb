//! Chains of `.ddsl` texts, without their components.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::language::check;
use expect_test::expect;

const PARTS: &str =
    "Component lidar { cdsl \"l\"; }; Group arm { Component motor { cdsl \"m\"; }; };";

#[test]
fn a_chain_reaches_the_model() {
    let body = format!(
        "{PARTS}\n/// Stops.\nChain brake {{ from lidar.Pub.scan; through arm.motor, lidar.lasers.front.get; \
         to arm.motor.Motor.set; within 80ms; age 1s; transport 200us; late fire arm.motor brake; }};\n\
         Group leg {{ Component m {{ cdsl \"m\"; }}; Chain brake {{ to lidar.Pub.scan; from m.A.b; }}; }};"
    );
    let deployment = check(&body, &expect![[r#""#]]);
    let mut lines = String::new();
    for chain in &deployment.chains {
        let point = |point: &rc_ddsl::model::ChainPoint| {
            let at = &deployment.instances[point.instance].path;
            let operation = point.operation.as_ref();
            operation.map_or(at.clone(), |(slot, of)| {
                format!("{at} {} {}", slot.text, of.text)
            })
        };
        let through: Vec<String> = chain.through.iter().map(point).collect();
        lines += &format!(
            "{} {:?}: {} | {} | {} | {:?} {:?} {:?} {}\n",
            chain.path,
            chain.doc,
            point(&chain.from),
            through.join(", "),
            point(&chain.to),
            chain.within,
            chain.age,
            chain.transport,
            match &chain.late {
                rc_ddsl::model::Late::Fire(at, event) => format!("fire {at} {}", event.text),
                other => format!("{other:?}"),
            }
        );
    }
    expect![[r#"
        brake ["Stops."]: lidar Pub scan | arm.motor, lidar lasers.front get | arm.motor Motor set | Some(80ms) Some(1s) Some(200µs) fire 1 brake
        leg.brake []: leg.m A b |  | lidar Pub scan | None None None Warn
    "#]].assert_eq(&lines);
}

#[test]
fn mistakes_of_chains() {
    let chain = |rest: &str| format!("{PARTS}\nChain brake {{ {rest} }};");
    check(
        &chain("from lidar.Pub.scan;"),
        &expect![[r#"
        n.ddsl:3:7: error[missing-clause]: chain `brake` has no field `to` (add `to COMPONENT.SLOT.OPERATION;`)
    "#]],
    );
    check(
        &chain("from lidar.Pub; to arm.motor; through arm, lidar.a.b.c.d;"),
        &expect![[r#"
            n.ddsl:3:20: error[bad-chain]: expected COMPONENT.SLOT.OPERATION, found `lidar.Pub` (name the operation whose message counts, such as `lidar.LaserPub.scan`)
            n.ddsl:3:34: error[bad-chain]: expected COMPONENT.SLOT.OPERATION, found `arm.motor` (name the operation whose message counts, such as `lidar.LaserPub.scan`)
            n.ddsl:3:53: error[bad-chain]: expected COMPONENT or COMPONENT.SLOT.OPERATION, found `arm` (name the operation whose message counts, such as `lidar.LaserPub.scan`)
            n.ddsl:3:58: error[bad-chain]: expected COMPONENT or COMPONENT.SLOT.OPERATION, found `lidar.a.b.c.d` (name the operation whose message counts, such as `lidar.LaserPub.scan`)
        "#]],
    );
    check(
        &chain("from lida.Pub.scan; to arm.moter.Motor.set; within 0; age 1;"),
        &expect![[r#"
            n.ddsl:3:20: error[unknown-instance]: unknown component or group `lida` (did you mean `lidar`?)
            n.ddsl:3:42: error[unknown-instance]: group `arm` has no component or group `moter` (did you mean `motor`?)
            n.ddsl:3:66: error[bad-time]: `within` takes a duration such as `5s`, at most one day
        "#]],
    );
    check(
        &chain(
            "from lidar.Pub.scan; from lidar.Pub.other; to arm.motor.M.set; wihtin 3ms; within ms;",
        ),
        &expect![[r#"
            n.ddsl:3:36: error[repeated-clause]: duplicate field `from`; first used here at n.ddsl:3:15
            n.ddsl:3:78: error[unknown-field]: expected a field of a chain, found `wihtin` (did you mean `within`?)
            n.ddsl:3:97: error[syntax-error]: expected a duration such as `5s`, found `ms`
        "#]],
    );
    check(
        &format!(
            "{}\n{}",
            chain("from lidar.A.a; to lidar.B.b;"),
            "Chain Brake { from lidar.A.a; to lidar.B.b; };"
        ),
        &expect![[r#"
            n.ddsl:4:7: error[duplicate-name]: duplicate name `Brake`; first declared here at n.ddsl:3:7
        "#]],
    );
    check(
        &chain("from lidar.A.a; to lidar.B.b; late stop lidar;"),
        &expect![[r#"
            n.ddsl:3:45: error[bad-chain]: chain `brake` has no limit, so it is never late (add `within 80ms;` or `age 120ms;`)
        "#]],
    );
    check(
        &chain("from lidar.A.a; to lidar.B.b; within 1s; late explode;"),
        &expect![[r#"
            n.ddsl:3:61: error[bad-chain]: `late` has no action `explode` (expected one of `warn`, `event`, `stop`, `emergency`, `fire`)
        "#]],
    );
    check(
        &chain("from lidar.A.a; to lidar.B.b; within 1s; late stop;"),
        &expect![[r#"
            n.ddsl:3:61: error[bad-chain]: `late stop` is written as `late stop COMPONENT;`
        "#]],
    );
    check(
        &chain("from lidar.A.a; to lidar.B.b; age 1s; late fire lidar;"),
        &expect![[r#"
            n.ddsl:3:58: error[bad-chain]: `late fire` is written as `late fire COMPONENT EVENT;`
        "#]],
    );
    check(
        &chain("from lidar.A.a; to lidar.B.b; within 1s; late emergency arm;"),
        &expect![[r#"
            n.ddsl:3:61: error[bad-chain]: `arm` is not a component (write `late emergency COMPONENT;`)
        "#]],
    );
    check(
        &chain("from lidar.A.a; to lidar.B.b; within 1s; late stop lidr;"),
        &expect![[r#"
            n.ddsl:3:66: error[unknown-instance]: unknown component or group `lidr` (did you mean `lidar`?)
        "#]],
    );
    check(
        &chain("from lidar.A.a; to lidar.B.b; within 1s; late warn arm.motor;"),
        &expect![[r#"
            n.ddsl:3:61: error[bad-chain]: `late warn` is written as `late warn;`
        "#]],
    );
}
