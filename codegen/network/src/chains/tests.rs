//! Chains of networks in files: what is found, what is reported, what the plan says.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::ChainReport;
use crate::{Overrides, load};
use expect_test::{Expect, expect};
use rc_codegen::FileLoader;
use rc_diagnostics::{Format, SourceMap, render};
use std::path::Path;

const PARTS: &str = "\
module Parts
{
    interface ScanPub { void newScan(int number); void bumped(int number); };
    interface Drive { void setSpeed(float speed); };
    interface Level { float level(); };
    struct Time { int sec; uint32 nanosec; };
    struct Header { @stamp Time stamp; string frame; };
    struct Mark { string name; bool seen; sequence<double> at; Header header; };
    interface MarkPub { void found(Mark mark); void lost(int number); void several(sequence<Mark> marks); };
};
";

/// The components: communications, and what stands behind `language`.
const COMPONENTS: [(&str, &str, &str); 19] = [
    (
        "finder",
        "publishes MarkPub(ros2) as said;",
        "period 50ms; reactions { compute -> said.found, said.lost, said.several budget 2ms; };",
    ),
    (
        "grasper",
        "subscribesTo MarkPub(ros2) as heard; requires Drive;",
        "period 10ms; reactions { heard.found -> setSpeed budget 1ms; compute budget 1ms; };",
    ),
    ("near", "publishes MarkPub as said;", "period 50ms;"),
    (
        "lidar",
        "publishes ScanPub;",
        "period 50ms; reactions { compute -> newScan budget 2ms; };",
    ),
    (
        "filter",
        "subscribesTo ScanPub as raw; publishes ScanPub as clean;",
        "reactions { raw.newScan -> clean.newScan budget 1ms; compute budget 1ms; };",
    ),
    (
        "avoider",
        "subscribesTo ScanPub as clean; requires Drive optional;",
        "period 50ms;",
    ),
    (
        "direct",
        "subscribesTo ScanPub as clean; requires Drive;",
        "reactions { newScan -> setSpeed budget 2ms; compute budget 1ms; };",
    ),
    (
        "base",
        "implements Drive;",
        "reactions { setSpeed budget 500us; compute budget 500us; };",
    ),
    (
        "echo",
        "subscribesTo ScanPub as heard; publishes ScanPub as said;",
        "reactions { heard.newScan -> said.newScan budget 1ms; };",
    ),
    (
        "slow",
        "subscribesTo ScanPub as clean; requires Drive;",
        "period 100ms; reactions { newScan -> setSpeed budget 60ms; };",
    ),
    (
        "few",
        "subscribesTo ScanPub as clean { depth 1; }; requires Drive;",
        "period 200ms; reactions { newScan -> setSpeed budget 10ms; compute budget 60ms; };",
    ),
    (
        "both",
        "subscribesTo ScanPub as clean, ScanPub as near; requires Drive;",
        "period 50ms;",
    ),
    (
        "deaf",
        "subscribesTo ScanPub as clean; requires Drive;",
        "reactions { };",
    ),
    (
        "fuser",
        "subscribesTo ScanPub as clean, ScanPub as near; requires Drive;",
        "collect clean.newScan, near.newScan within 20ms as view; reactions { view -> setSpeed budget 3ms; compute budget 1ms; };",
    ),
    (
        "hasty",
        "subscribesTo ScanPub as one { fresh 100us; }, ScanPub as two { fresh 50ms; }, ScanPub as three { fresh 51ms; }; requires Level { fresh 99ms; };",
        "",
    ),
    (
        "timed",
        "publishes ScanPub { deadline 40ms; }, ScanPub as slower { deadline 50ms; };",
        "period 50ms; reactions { compute -> ScanPub.newScan, slower.newScan budget 2ms; };",
    ),
    (
        "strict",
        "subscribesTo ScanPub as one { deadline 45ms; }, ScanPub as two { deadline 50ms; };",
        "",
    ),
    ("power", "implements Level { serve latest 100ms; };", ""),
    ("meter", "requires Level { fresh 100ms; };", ""),
];

fn write(folder: &Path) {
    let file = |name: &str, text: &str| std::fs::write(folder.join(name), text).expect("a file");
    file("Parts.idsl", PARTS);
    for (name, communications, rest) in COMPONENTS {
        let text = format!(
            "import \"Parts.idsl\";\nComponent {name}\n{{ Communications {{ {communications} }}; language rust; {rest} }};\n"
        );
        file(&format!("{name}.cdsl"), &text);
    }
}

#[test]
fn components_that_cannot_keep_up_are_reported() {
    let body = "bind slow.clean -> lidar.ScanPub; bind few.clean -> lidar.ScanPub;\n\
                Chain one { from lidar.ScanPub.newScan; to slow.Drive.setSpeed; };\n\
                Chain two { from lidar.ScanPub.newScan; to few.Drive.setSpeed; };";
    check(
        "lidar slow few base",
        body,
        &expect![[r#"
            net.ddsl:1:68: warning[overloaded-component]: `slow` may get more work than it has time (shorten its budgets, send to it less often, or lengthen its period)
            net.ddsl:1:106: warning[short-queue]: 2 messages may wait for `few.clean.newScan`, which keeps 1: the others are lost (write `depth 2;` at its slot)
        "#]],
    );
}

/// Checks the findings of a network of these components, with `body` from line 2 on. Returns its
/// chains as the plan prints them.
fn check(components: &str, body: &str, expected: &Expect) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path());
    let components = components.split_whitespace().map(|name| {
        let (name, of) = name.split_once(':').unwrap_or((name, name));
        format!("Component {name} {{ cdsl \"{of}.cdsl\"; }}; ")
    });
    let text = format!(
        "Deployment net {{ {}\n{body}\n}};\n",
        components.collect::<String>()
    );
    let path = folder.path().join("net.ddsl");
    std::fs::write(&path, text).expect("a file");
    let mut sources = SourceMap::new();
    let loader = FileLoader::new(&[]);
    let (network, found) =
        load(&path, &Overrides::default(), &mut sources, &loader).expect("a file");
    let text = render(&sources, &found, Format::Short);
    let shown = text.replace(&format!("{}/", folder.path().display()), "");
    expected.assert_eq(&shown);
    let reports = ChainReport::all(&network.expect("a network"));
    reports.iter().map(ToString::to_string).collect()
}

const LINE: &str = "bind filter.raw -> lidar.ScanPub; bind avoider.clean -> filter.clean;";

#[test]
fn a_chain_is_found_and_its_worst_case_told() {
    let body = format!(
        "{LINE}\nChain brake {{ from lidar.ScanPub.newScan; to base.Drive.setSpeed; within 80ms; age 120ms; }};"
    );
    let plan = check("lidar filter avoider base", &body, &expect![[""]]);
    expect![[r#"
        chain brake: lidar.ScanPub.newScan → base.Drive.setSpeed
            at worst 55.6 ms (within 80 ms); data at most 57.6 ms old (age 120 ms)
            filter.raw.newScan: 0.2 ms on the way, 2 ms work
            avoider.clean.newScan: 0.2 ms on the way, 50 ms until `compute`, 2 ms work
            base.Drive.setSpeed: 0.2 ms on the way, 1 ms work
            budgets are assumed: avoider
            transport is assumed
    "#]]
    .assert_eq(&plan);
}

#[test]
fn a_slow_chain_names_its_slowest_part() {
    let body = format!(
        "{LINE}\nChain brake {{ from lidar.ScanPub.newScan; to base.Drive.setSpeed; within 50ms; age 55ms; transport 2ms; }};"
    );
    check(
        "lidar filter avoider base",
        &body,
        &expect![[r#"
            net.ddsl:3:7: warning[slow-chain]: chain `brake` takes 61 ms in the worst case, 11 ms more than `within` allows: filter 4 ms, avoider 54 ms, base 3 ms (50 ms of them are the period of avoider: react in the handler of `clean.newScan`, or halve the period)
            net.ddsl:3:7: warning[stale-chain]: the data of chain `brake` are 63 ms old in the worst case, 8 ms more than `age` allows (an effect uses the newest message, which is as old as the periods of those who send it: shorten them, or react in handlers)
        "#]],
    );
    let body = "bind filter.raw -> lidar.ScanPub; bind direct.clean -> filter.clean;\n\
                Chain brake { from lidar.ScanPub.newScan; to base.Drive.setSpeed; within 2ms; transport 3ms; };";
    check(
        "lidar filter direct base",
        body,
        &expect![[r#"
            net.ddsl:3:7: error[impossible-chain]: chain `brake` cannot be in time: its messages may need 9 ms on their way, and `within` is 2 ms (lengthen `within`, or shorten `transport`)
        "#]],
    );
}

#[test]
fn reactions_in_handlers_wait_for_no_period() {
    let body = "bind filter.raw -> lidar.ScanPub; bind direct.clean -> filter.clean;\n\
                Chain brake { from lidar.ScanPub.newScan; to direct.Drive.setSpeed; within 10ms; };";
    let plan = check("lidar filter direct base", body, &expect![[""]]);
    expect![[r#"
        chain brake: lidar.ScanPub.newScan → direct.Drive.setSpeed
            at worst 5.4 ms (within 10 ms); data at most 5.4 ms old
            filter.raw.newScan: 0.2 ms on the way, 2 ms work
            direct.clean.newScan: 0.2 ms on the way, 3 ms work
            transport is assumed
    "#]]
    .assert_eq(&plan);
}

#[test]
fn several_ways_are_told_apart_by_what_they_pass() {
    let binds = "bind one.raw -> lidar.ScanPub; bind two.raw -> lidar.ScanPub; \
                 bind avoider.clean -> one.clean; bind avoider.clean -> two.clean;";
    let parts = "lidar one:filter two:filter avoider base";
    let chain = "from lidar.ScanPub.newScan; to base.Drive.setSpeed;";
    check(
        parts,
        &format!("{binds}\nChain brake {{ {chain} }};"),
        &expect![[r#"
            net.ddsl:3:7: error[ambiguous-chain]: chain `brake` has several ways (write one of `through one, avoider;`, `through two, avoider;`)
        "#]],
    );
    let plan = check(
        parts,
        &format!("{binds}\nChain brake {{ {chain} through two; }};"),
        &expect![[""]],
    );
    assert!(plan.contains("two.raw.newScan: "), "{plan}");
    check(
        parts,
        &format!("{binds}\nChain brake {{ {chain} through avoider, two; }};"),
        &expect![[r#"
            net.ddsl:3:7: error[broken-chain]: chain `brake`: no way passes what `through` names, in this order; these are not on one way at net.ddsl:3:75 (name components of one way, or leave `through` out)
        "#]],
    );
}

/// The longer way passes everything that the shorter one passes.
#[test]
fn the_shorter_one_of_two_ways_can_be_named() {
    let binds = "bind filter.raw -> lidar.ScanPub; bind both.clean -> filter.clean; bind both.near -> lidar.ScanPub;";
    let chain = "Chain brake { from lidar.ScanPub.newScan; to base.Drive.setSpeed;";
    check(
        "lidar filter both base",
        &format!("{binds}\n{chain} }};"),
        &expect![[r#"
            net.ddsl:3:7: error[ambiguous-chain]: chain `brake` has several ways (write one of `through filter, both;`, `through both;`)
        "#]],
    );
    let plan = check(
        "lidar filter both base",
        &format!("{binds}\n{chain} through both; }};"),
        &expect![[""]],
    );
    assert!(plan.contains("both.near.newScan: "), "{plan}");
}

#[test]
fn chains_that_are_not_there() {
    let chain = |rest: &str| format!("{LINE}\nChain brake {{ {rest} }};");
    check(
        "lidar filter avoider",
        &chain("from lidar.ScanPub.newScan; to filter.clean.bumped;"),
        &expect![[r#"
            net.ddsl:1:110: note[no-provider]: `avoider.Drive` is optional, and no component implements `Parts::Drive`; required here at avoider.cdsl:3:60
            net.ddsl:3:7: error[broken-chain]: chain `brake`: nothing leads from `lidar.ScanPub.newScan` to `filter.clean.bumped` (optional slot `avoider.Drive.setSpeed` is connected to nothing)
        "#]],
    );
    // The passed slot is optional and absent.
    check(
        "lidar filter avoider",
        &chain(
            "from lidar.ScanPub.newScan; through avoider.Drive.setSpeed; to filter.clean.bumped;",
        ),
        &expect![[r#"
            net.ddsl:1:110: note[no-provider]: `avoider.Drive` is optional, and no component implements `Parts::Drive`; required here at avoider.cdsl:3:60
            net.ddsl:3:7: error[broken-chain]: chain `brake`: nothing leads from `lidar.ScanPub.newScan` to `filter.clean.bumped` (optional slot `avoider.Drive.setSpeed` is connected to nothing)
        "#]],
    );
    check(
        "lidar filter avoider base",
        &chain("from lidar.ScanPub.newScan; to lidar.ScanPub.newScan;"),
        &expect![[r#"
            net.ddsl:3:46: error[empty-chain]: chain `brake` ends where it begins; its beginning at net.ddsl:3:20 (name another operation after `from` or `to`)
        "#]],
    );
    check(
        "lidar filter avoider base",
        &chain("from lidar.ScanPub.newScam; to base.Driv.setSpeed;"),
        &expect![[r#"
            net.ddsl:3:34: error[unknown-operation]: `lidar.ScanPub` has no operation `newScam`; its interface at Parts.idsl:3:15 (did you mean `newScan`?)
            net.ddsl:3:51: error[unknown-slot]: `base` has no slot `Driv`; its component at base.cdsl:2:11 (did you mean `Drive`?)
        "#]],
    );
    check(
        "lidar deaf base",
        "bind deaf.clean -> lidar.ScanPub;\nChain brake { from lidar.ScanPub.newScan; to base.Drive.setSpeed; };",
        &expect![[r#"
            net.ddsl:3:7: error[broken-chain]: chain `brake`: nothing leads from `lidar.ScanPub.newScan` to `base.Drive.setSpeed` (its messages get to `deaf`; look at the `reactions` there)
        "#]],
    );
}

#[test]
fn a_cycle_of_handlers_is_reported_without_a_chain() {
    check(
        "one:echo two:echo",
        "bind one.heard -> two.said; bind two.heard -> one.said;",
        &expect![[r#"
            net.ddsl:1:28: error[cycle-without-delay]: a message leads to itself without a delay: one.heard.newScan → two.heard.newScan → one.heard.newScan (let one of these handlers keep the message for `compute` in its `reactions`)
        "#]],
    );
}

#[test]
fn data_from_outside_may_be_of_any_age() {
    let body = "external avoider.clean;\nChain brake { from avoider.clean.newScan; to base.Drive.setSpeed; within 400ms; age 1s; };";
    let plan = check(
        "avoider base",
        body,
        &expect![[r#"
            net.ddsl:3:7: warning[stale-chain]: the data of chain `brake` may be of any age: the rate of its first message is not known (an effect uses the newest message, which is as old as the periods of those who send it: shorten them, or react in handlers)
        "#]],
    );
    assert!(plan.contains("; data of any age"), "{plan}");
}

#[test]
fn a_message_waits_for_those_with_which_it_is_collected() {
    let body = "bind fuser.clean -> lidar.ScanPub; bind fuser.near -> other.ScanPub;\n\
        Chain brake { from lidar.ScanPub.newScan; to base.Drive.setSpeed; within 20ms; };";
    let plan = check(
        "lidar other:lidar fuser base",
        body,
        &expect![[r#"
        net.ddsl:3:7: warning[slow-chain]: chain `brake` takes 28.9 ms in the worst case, 8.9 ms more than `within` allows: fuser 27.2 ms, base 1.7 ms (20 ms of them, `clean.newScan` waits for what it is collected with: shorten `within` of `collect` in fuser)
    "#]],
    );
    expect![[r#"
        chain brake: lidar.ScanPub.newScan → base.Drive.setSpeed
            at worst 28.9 ms (within 20 ms); data at most 28.9 ms old
            fuser.clean.newScan: 0.2 ms on the way, 20 ms until it is collected, 7 ms work
            base.Drive.setSpeed: 0.2 ms on the way, 1.5 ms work
            transport is assumed
    "#]]
    .assert_eq(&plan);
}

#[test]
fn messages_that_are_collected_may_be_longer_on_their_way() {
    let body = "bind fuser.clean -> lidar.ScanPub; bind fuser.near -> other.ScanPub;\n\
        Chain brake { from lidar.ScanPub.newScan; to base.Drive.setSpeed; within 90ms; transport 50us; };";
    let plan = check("lidar other:lidar fuser base", body, &expect![[""]]);
    // The other scan is sent 20 ms later, and takes 0.2 ms.
    assert!(
        plan.contains("fuser.clean.newScan: 0.05 ms on the way, 20.15 ms until it is collected"),
        "{plan}"
    );
}

#[test]
fn values_that_are_never_fresh_or_not_always() {
    let body = "bind hasty.one -> lidar.ScanPub; bind hasty.two -> lidar.ScanPub; bind hasty.three -> lidar.ScanPub;";
    check(
        "lidar hasty power meter",
        body,
        &expect![[r#"
        net.ddsl:1:68: warning[never-fresh]: samples of `hasty.one.newScan` may be too old when they come: they are up to 200us on their way, and fresh for 100us; here at hasty.cdsl:3:33 (lengthen `fresh` in the .cdsl)
        net.ddsl:1:68: warning[always-stale]: the newest sample of `hasty.two.newScan` is too old in every period: it comes every 50ms, and is fresh for 50ms; here at hasty.cdsl:3:66 (lengthen `fresh` to 50200us, or shorten the period of `lidar`)
        net.ddsl:1:68: warning[latest-over-fresh]: the server answers `hasty.Level` with values that are up to 100ms old, and are fresh for 99ms; answers with its last value at power.cdsl:3:31 (shorten `serve latest`, or lengthen `fresh`)
    "#]],
    );
}

#[test]
fn deadlines_that_are_shorter_than_a_period() {
    let body = "bind strict.one -> timed.ScanPub; bind strict.two -> timed.slower;";
    check(
        "timed strict",
        body,
        &expect![[r#"
            net.ddsl:1:68: warning[missed-deadline]: each sample of `strict.one.newScan` misses its deadline: it comes every 50ms, and the deadline is 40ms; here at timed.cdsl:3:30 (lengthen `deadline` to 50ms, or shorten the period of `timed`)
        "#]],
    );
}

/// Messages go through programs outside where the network says so, and their stamps have a place.
#[test]
fn a_chain_passes_programs_outside() {
    let chain = |outside: &str| {
        format!(
            "external grasper.heard at \"b\";\n\
             Chain grasp {{ from finder.said.found; to base.Drive.setSpeed; within 40ms; {outside} }};"
        )
    };
    let plan = check(
        "finder grasper base",
        &chain("external finder.said.found -> grasper.heard.found within 30ms;"),
        &expect![[r#"
            net.ddsl:1:28: note[no-subscriber]: `finder.said` has no subscriber
            net.ddsl:3:7: warning[slow-chain]: chain `grasp` takes 106.2 ms in the worst case, 66.2 ms more than `within` allows: grasper 104 ms, base 2.2 ms (74 ms of them is the work of grasper, whose budgets are assumed: declare them in its `reactions`)
        "#]],
    );
    expect![[r#"
        chain grasp: finder.said.found → base.Drive.setSpeed
            at worst 106.2 ms (within 40 ms); data at most 106.2 ms old
            grasper.heard.found: 30 ms on the way, 74 ms work
            base.Drive.setSpeed: 0.2 ms on the way, 2 ms work
            budgets are assumed: grasper
            transport is assumed
            programs outside send grasper.heard.found for finder.said.found within 30 ms
    "#]]
    .assert_eq(&plan);
    for (outside, expected) in [
        (
            "",
            expect![[r#"
                net.ddsl:1:28: note[no-subscriber]: `finder.said` has no subscriber
                net.ddsl:1:152: note[no-subscriber]: `near.said` has no subscriber
                net.ddsl:3:7: error[broken-chain]: chain `grasp`: nothing leads from `finder.said.found` to `base.Drive.setSpeed` (`finder.said.found` is connected to nothing)
            "#]],
        ),
        (
            "external finder.said.lost -> grasper.heard.found within 30ms;",
            expect![[r#"
                net.ddsl:1:28: note[no-subscriber]: `finder.said` has no subscriber
                net.ddsl:1:152: note[no-subscriber]: `near.said` has no subscriber
                net.ddsl:3:85: error[bad-chain]: `finder.said.lost` cannot be followed through programs outside: no member of it is marked with `@stamp` (mark the time that they copy with `@stamp`, before everything whose length is not known)
            "#]],
        ),
        (
            "external finder.said.several -> grasper.heard.found within 30ms;",
            expect![[r#"
                net.ddsl:1:28: note[no-subscriber]: `finder.said` has no subscriber
                net.ddsl:1:152: note[no-subscriber]: `near.said` has no subscriber
                net.ddsl:3:85: error[bad-chain]: `finder.said.several` cannot be followed through programs outside: each element of `marks` has a stamp of its own, and a message needs one (mark the time that they copy with `@stamp`, before everything whose length is not known)
            "#]],
        ),
        (
            "external grasper.heard.found -> base.Drive.setSpeed within 30ms;",
            expect![[r#"
                net.ddsl:1:28: note[no-subscriber]: `finder.said` has no subscriber
                net.ddsl:1:152: note[no-subscriber]: `near.said` has no subscriber
                net.ddsl:3:85: error[bad-chain]: `grasper.heard.found` is not published (name a topic left of `->` that the component publishes)
                net.ddsl:3:108: error[bad-chain]: `base.Drive.setSpeed` is not subscribed to (name a topic right of `->` that the component subscribes to)
            "#]],
        ),
        (
            "external near.said.found -> grasper.heard.found within 30ms;",
            expect![[r#"
                net.ddsl:1:28: note[no-subscriber]: `finder.said` has no subscriber
                net.ddsl:1:152: note[no-subscriber]: `near.said` has no subscriber
                net.ddsl:3:85: error[bad-chain]: `near.said.found` is on `iceoryx2` (programs outside copy stamps over `dds` and `ros2`: use one of them for this slot)
            "#]],
        ),
        (
            "external finder.said.found -> grasper.heard.fond within 30ms;",
            expect![[r#"
                net.ddsl:1:28: note[no-subscriber]: `finder.said` has no subscriber
                net.ddsl:1:152: note[no-subscriber]: `near.said` has no subscriber
                net.ddsl:3:120: error[unknown-operation]: `grasper.heard` has no operation `fond`; its interface at Parts.idsl:9:15 (did you mean `found`?)
            "#]],
        ),
    ] {
        check("finder grasper base near", &chain(outside), &expected);
    }
}
