//! Members of slot arrays in networks.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::network::{connect, network};
use expect_test::expect;

const RIG: (&str, &str) = (
    "rig",
    "implements Laser[] as lasers; publishes Pub[] as poses;",
);
const GUARD: (&str, &str) = ("guard", "requires Laser;");
const FUSION: (&str, &str) = (
    "fusion",
    "requires Laser[] as scanners; subscribesTo Pub[] as heard;",
);

#[test]
fn members_are_slots_of_their_instance() {
    let connections = network(
        "Component rig { cdsl \"rig\"; slots { lasers \"front\", \"back\"; poses \"base\"; } };\n\
         Component guard { cdsl \"guard\"; };\n\
         Component fusion { cdsl \"fusion\"; slots { scanners \"a\", \"b\"; heard \"pose\"; } };\n\
         bind guard.Laser -> rig.lasers.front;\n\
         bind fusion.scanners.a -> rig.lasers.back;\n\
         bind fusion.scanners.b -> rig.lasers.front;\n\
         bind fusion.heard.pose -> rig.poses.base;\n",
        &[RIG, GUARD, FUSION],
        &expect![[""]],
    );
    expect![[r#"
        guard.Laser -> rig.lasers.front
        fusion.scanners.a -> rig.lasers.back
        fusion.scanners.b -> rig.lasers.front
        fusion.heard.pose -> rig.poses.base"#]]
    .assert_eq(&connections.join("\n"));
    // The only provider needs no bind.
    let connections = network(
        "Component rig { cdsl \"rig\"; slots { lasers \"front\"; } };\nComponent guard { cdsl \"guard\"; };\n",
        &[RIG, GUARD],
        &expect![[""]],
    );
    expect!["guard.Laser -> rig.lasers.front"].assert_eq(&connections.join("\n"));
    // Several do.
    network(
        "Component rig { cdsl \"rig\"; slots { lasers \"front\", \"back\"; } };\nComponent guard { cdsl \"guard\"; };\n",
        &[RIG, GUARD],
        &expect![[r#"
            n.ddsl:3:11: error[several-providers]: several providers for `guard.Laser`: `rig.lasers.front`, `rig.lasers.back` (choose one: `bind guard.Laser -> rig.lasers.front;`)
        "#]],
    );
    // An array that nobody lists has no members.
    connect(&[RIG, FUSION], "", &expect![[""]]);
}

#[test]
fn lists_that_are_wrong_are_reported() {
    let long = "a".repeat(65);
    let many: Vec<String> = (0..129).map(|number| format!("\"m{number}\"")).collect();
    network(
        &format!(
            "Component rig {{ cdsl \"rig\"; slots {{ lasers \"front\", \"Front\", \"back\", \"back\", \"a-b\", \"{long}\"; poses \"x\"; poses \"y\"; }} }};\n\
             Component guard {{ cdsl \"guard\"; slots {{ Laser \"front\"; lasers \"front\"; }} }};\n\
             Component fusion {{ cdsl \"fusion\"; slots {{ scaners \"a\"; heard {}; }} }};\n",
            many.join(", ")
        ),
        &[RIG, GUARD, FUSION],
        &expect![[r#"
            n.ddsl:2:53: error[duplicate-member]: duplicate member `Front` of `lasers`; first listed here at n.ddsl:2:44 (choose names that differ in more than case)
            n.ddsl:2:70: error[duplicate-member]: duplicate member `back` of `lasers`; first listed here at n.ddsl:2:62
            n.ddsl:2:78: error[bad-member]: `a-b` cannot be a member of `lasers` (the name of a member has a letter, then letters, digits and single `_`, none at the end)
            n.ddsl:2:85: error[bad-member]: `aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa` cannot be a member of `lasers` (the name of a member has at most 64 bytes, and this one has 65)
            n.ddsl:2:165: error[duplicate-name]: duplicate array `poses`; first listed here at n.ddsl:2:154 (list all members of an array in one line)
            n.ddsl:3:11: error[several-providers]: several providers for `guard.Laser`: `rig.lasers.front`, `rig.lasers.back` (choose one: `bind guard.Laser -> rig.lasers.front;`)
            n.ddsl:3:41: error[not-an-array]: `Laser` is one slot, not an array; declared here at guard.cdsl:2:45 (declare it as `Laser[] as Laser`)
            n.ddsl:3:56: error[unknown-slot]: `guard` has no slot array `lasers`; its component at guard.cdsl:2:11
            n.ddsl:4:43: error[unknown-slot]: `fusion` has no slot array `scaners`; its component at fusion.cdsl:2:11 (did you mean `scanners`?)
            n.ddsl:4:976: error[bad-member]: `heard` has 129 members, but the maximum is 128
        "#]],
    );
    network(
        "Component rig { cdsl \"rig\"; slots { lasers; front \"x\" } };\n\
         Component other { cdsl \"rig\"; slots { lasers front; } };\n",
        &[RIG],
        &expect![[r#"
            n.ddsl:2:43: error[syntax-error]: expected a string, found `;`
            n.ddsl:2:45: error[unknown-slot]: `rig` has no slot array `front`; its component at rig.cdsl:2:11 (expected one of `lasers`, `poses`)
            n.ddsl:2:54: error[missing-semicolon]: expected `;`
            n.ddsl:3:46: error[syntax-error]: expected a string, found `front`
        "#]],
    );
    let (group, array) = ("g".repeat(40), "lasers".repeat(20));
    network(
        &format!(
            "Group {group} {{ Component rig {{ cdsl \"rig\"; slots {{ {array} \"a\", \"{}\"; }} }}; }};\n",
            "m".repeat(64)
        ),
        &[("rig", &format!("implements Laser[] as {array};"))],
        &expect![[r#"
            n.ddsl:2:212: error[name-too-long]: the address `n/gggggggggggggggggggggggggggggggggggggggg.rig/laserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslaserslasers/mmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmmm` has more than 200 characters (choose shorter names)
        "#]],
    );
}

#[test]
fn paths_that_name_no_member_are_reported() {
    network(
        "Component rig { cdsl \"rig\"; slots { lasers \"front\", \"back\"; } };\n\
         Component guard { cdsl \"guard\"; };\n\
         bind guard.Laser -> rig.lasers.frnt;\n\
         bind guard.Laser -> rig.lasers.left;\n\
         bind guard.Laser -> rig.lasers;\n\
         bind guard.Laser -> rig.laser.front;\n\
         bind guard.Laser.x -> rig.lasers.front;\n\
         bind guard.Laser -> rig.a.lasers.front;\n\
         external rig.lasers.front, guard.Laser.front;\n",
        &[RIG, GUARD],
        &expect![[r#"
            n.ddsl:4:25: error[unknown-member]: `rig` lists no member `frnt` of `lasers`; the component at n.ddsl:2:11 (did you mean `front`?)
            n.ddsl:5:25: error[unknown-member]: `rig` lists no member `left` of `lasers`; the component at n.ddsl:2:11 (list it there: `slots { lasers "front", "back", "left"; }`)
            n.ddsl:6:25: error[unknown-slot]: `rig.lasers` is a slot array, not a slot (name one of its members: `rig.lasers.front`)
            n.ddsl:7:25: error[not-a-group]: expected a group or a slot array, found component `rig`; it has no slot array `laser` at n.ddsl:2:11 (did you mean `lasers`?)
            n.ddsl:8:12: error[not-a-group]: expected a group or a slot array, found component `guard`; it has no slot array `Laser` at n.ddsl:3:11 (write `guard.SLOT`)
            n.ddsl:9:25: error[not-a-group]: expected a group, found component `rig` (write `rig.SLOT`, or `rig.ARRAY.MEMBER` for a slot array)
            n.ddsl:10:10: error[wrong-direction]: expected a consumer after `external`, but `rig.lasers.front` implements its interface; declared here at rig.cdsl:2:45 (remove it: peers outside the network need no declaration to use this slot over its middleware, unless values are converted for them: `{ cdsl "FILE"; convert; }`)
            n.ddsl:10:34: error[not-a-group]: expected a group or a slot array, found component `guard`; it has no slot array `Laser` at n.ddsl:3:11 (write `guard.SLOT`)
        "#]],
    );
}

#[test]
fn groups_export_arrays_with_their_members() {
    let connections = network(
        "Group body { Group head { Component rig { cdsl \"rig\"; slots { lasers \"front\", \"back\"; } }; export lasers; }; export lasers; };\n\
         Component guard { cdsl \"guard\"; };\n\
         bind guard.Laser -> body.lasers.front;\n",
        &[RIG, GUARD],
        &expect![[""]],
    );
    expect!["guard.Laser -> body.head.rig.lasers.front"].assert_eq(&connections.join("\n"));
    let connections = network(
        "Group head { Component rig { cdsl \"rig\"; slots { lasers \"front\", \"back\"; } }; export lasers; };\n\
         Component guard { cdsl \"guard\"; };\n\
         bind guard.Laser -> head.rig.lasers.back;\n",
        &[RIG, GUARD],
        &expect![[""]],
    );
    expect!["guard.Laser -> head.rig.lasers.back"].assert_eq(&connections.join("\n"));
    // Not exported, not listed, and one that might be a component.
    network(
        "Group head { Component rig { cdsl \"rig\"; slots { lasers \"front\", \"back\"; } }; };\n\
         Group tail { Component rig { cdsl \"rig\"; slots { lasers \"front\"; } }; export lasers; };\n\
         Group foot { Component rig { cdsl \"rig\"; slots { lasers \"front\"; } }; Component lasers { cdsl \"one\"; }; export lasers, front; };\n\
         Component guard { cdsl \"guard\"; };\n\
         bind guard.Laser -> head.lasers.front;\n\
         bind guard.Laser -> head.rig.lasers.front;\n\
         bind guard.Laser -> tail.lasers.left;\n\
         bind guard.Laser -> foot.lasers.front;\n",
        &[RIG, GUARD, ("one", "implements Laser as front;")],
        &expect![[r#"
            n.ddsl:6:26: error[unknown-instance]: group `head` has no component or group `lasers` (expected `rig`)
            n.ddsl:7:26: error[not-exported]: `rig` is inside group `head`, which does not export `lasers`; the group at n.ddsl:2:7 (write `export lasers;` in group `head`)
            n.ddsl:8:26: error[unknown-member]: group `tail` has no slot `lasers.left` (name a member that `slots { … }` of a component inside lists)
            n.ddsl:9:26: error[ambiguous-slot]: `lasers.front` could mean a member of the exported slot `lasers`, or a slot of the component `lasers`; the export at n.ddsl:4:112; the component at n.ddsl:4:81 (give one of them another name)
        "#]],
    );
}
