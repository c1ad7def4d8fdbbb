//! Diagnostics and models of `.ddsl` texts without their components.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::settings::settings;
use expect_test::{Expect, expect};
use rc_ddsl::Deployment;
use rc_ddsl::model::{InstanceOrGroup, Restart};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::{MemoryLoader, Name};

/// Checks the diagnostics for `n.ddsl`, which can import `others`.
fn check_files(text: &str, others: &[(&str, &str)], expected: &Expect) -> Option<Deployment> {
    let mut sources = SourceMap::new();
    let source = sources.add("n.ddsl", text);
    let all = others.iter().copied().chain([("n.ddsl", text)]);
    let loader = MemoryLoader::new(all);
    let (deployment, found) = rc_ddsl::load(&mut sources, &loader, source);
    expected.assert_eq(&render(&sources, &found, Format::Short));
    deployment
}

/// Checks the diagnostics for a whole file `n.ddsl`.
fn check_file(text: &str, expected: &Expect) {
    check_files(text, &[], expected);
}

/// Checks the diagnostics for `body`, which is in a deployment from line 2 on.
pub(crate) fn check(body: &str, expected: &Expect) -> Deployment {
    let text = format!("Deployment n {{\n{body}\n}};\n");
    check_files(&text, &[], expected).expect("a deployment")
}

#[test]
fn errors_outside_declarations() {
    check_file(
        "",
        &expect![[r#"
            n.ddsl:1:1: error[empty-file]: expected `Deployment NAME { … };`, found an empty file
        "#]],
    );
    check_file("Deployment n { };", &expect![[""]]);
    check_file(
        "Deployment { };",
        &expect![[r#"
        n.ddsl:1:12: error[syntax-error]: expected a name, found `{`
    "#]],
    );
    check_file(
        "Component a { };",
        &expect![[r#"
        n.ddsl:1:1: error[syntax-error]: expected `Deployment`, found `Component`
    "#]],
    );
    check_file(
        "Deployment n { Component a { cdsl \"a\"; };\n",
        &expect![[r#"
            n.ddsl:2:1: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
    check_file(
        "Deployment n\n Component a { cdsl \"a\"; };\n};",
        &expect![[r#"
            n.ddsl:2:2: error[syntax-error]: expected `{`, found `Component`
        "#]],
    );
    check_file(
        "Deployment n { };\nDeployment m { };",
        &expect![[r#"
            n.ddsl:2:1: error[text-after-end]: unexpected text: a file contains one `Deployment NAME { … };`
        "#]],
    );
}

#[test]
fn a_missing_semicolon_is_one_error_at_its_location() {
    check(
        "middleware iceoryx2\nComponent a { cdsl \"a.cdsl\"\nafter b // first\nready 5s\nargs \"x\", \"y\"\nenv { A \"1\" B \"2\" }\n}\n\
         Component b { cdsl \"b.cdsl\" config \"c.toml\" }\nbind a.Laser -> b.Laser",
        &expect![[r#"
            n.ddsl:2:20: error[missing-semicolon]: expected `;`
            n.ddsl:3:28: error[missing-semicolon]: expected `;`
            n.ddsl:4:8: error[missing-semicolon]: expected `;`
            n.ddsl:5:9: error[missing-semicolon]: expected `;`
            n.ddsl:6:14: error[missing-semicolon]: expected `;`
            n.ddsl:7:12: error[missing-semicolon]: expected `;`
            n.ddsl:7:18: error[missing-semicolon]: expected `;`
            n.ddsl:9:28: error[missing-semicolon]: expected `;`
            n.ddsl:9:44: error[missing-semicolon]: expected `;`
            n.ddsl:10:24: error[missing-semicolon]: expected `;`
        "#]],
    );
}

#[test]
fn a_syntax_error_does_not_hide_later_errors() {
    check(
        "Component a { cdls \"a.cdsl\"; cdsl a.cdsl; after ; after \"b\"; ready soon; stop 0s; env A \"1\"; env { A = \"1\"; }; args x; restart always max 3; };\n\
         Compnent b { cdsl \"b\"; };\nbind a.Laser b.Laser;\nbind a -> b;\nbind a.Laser => b.Laser;\nmiddleware iceorix2;\ndomain x;\n§;\nComponent c cdsl \"c\"; };",
        &expect![[r#"
            n.ddsl:2:15: error[unknown-field]: expected a field of a component, found `cdls` (did you mean `cdsl`?)
            n.ddsl:2:35: error[syntax-error]: expected a string, found `a`
            n.ddsl:2:49: error[syntax-error]: expected a name, found `;`
            n.ddsl:2:57: error[syntax-error]: expected a name, found `"`
            n.ddsl:2:68: error[syntax-error]: expected a duration such as `5s`, found `soon`
            n.ddsl:2:79: error[bad-time]: `stop` takes a duration such as `5s`, at most one day
            n.ddsl:2:87: error[syntax-error]: expected `{`, found `A`
            n.ddsl:2:102: error[syntax-error]: expected a string, found `=`
            n.ddsl:2:117: error[syntax-error]: expected a string, found `x`
            n.ddsl:2:140: error[syntax-error]: expected `within`, found `;`
            n.ddsl:3:1: error[unknown-field]: expected a declaration of a deployment, found `Compnent` (did you mean `Component`?)
            n.ddsl:4:14: error[syntax-error]: expected `->` or `.`, found `b`
            n.ddsl:5:8: error[syntax-error]: expected `.`, found `-` (name the slots, too: `bind CONSUMER.SLOT -> PROVIDER.SLOT;`)
            n.ddsl:6:14: error[syntax-error]: expected `->` or `.`, found `=`
            n.ddsl:7:12: error[unknown-middleware]: unknown middleware `iceorix2` (did you mean `iceoryx2`?)
            n.ddsl:8:8: error[syntax-error]: expected a number, found `x`
            n.ddsl:9:1: error[unknown-field]: expected a declaration of a deployment, found `§` (expected one of `Component`, `Process`, `Host`, `Group`, `bind`, `external`, `middleware`, `domain`, `time`, `record`, `Chain`, `World`, `require`)
            n.ddsl:10:13: error[syntax-error]: expected `{`, found `cdsl`
            n.ddsl:11:1: error[text-after-end]: unexpected text: a file contains one `Deployment NAME { … };`
        "#]],
    );
}

#[test]
fn unknown_and_repeated_names_are_reported() {
    check(
        "middleware iceoryx2; middleware dds;\nComponent a { cdsl \"a\"; cdsl \"b\"; after bb, c; };\nComponent A { cdsl \"a\"; };\nComponent bbb { };\n\
         Component rcdeploy { cdsl \"a\"; };\nbind a.Laser -> bb.Laser;\nbind x.Laser -> a.b.Laser;",
        &expect![[r#"
            n.ddsl:2:33: error[repeated-clause]: `middleware dds` comes second here; the middleware of this block at n.ddsl:2:12 (a further one only sets something of it, in braces: write first what the components use)
            n.ddsl:3:25: error[repeated-clause]: duplicate field `cdsl`; first used here at n.ddsl:3:15
            n.ddsl:3:41: error[unknown-instance]: unknown component or group `bb` (did you mean `bbb`?)
            n.ddsl:3:45: error[unknown-instance]: unknown component or group `c` (expected one of `A`, `a`, `bbb`, `rcdeploy`)
            n.ddsl:4:11: error[duplicate-name]: duplicate name `A`; first declared here at n.ddsl:3:11 (choose names that differ in more than case)
            n.ddsl:5:11: error[missing-clause]: component `bbb` has no field `cdsl` (add `cdsl "PATH/NAME.cdsl";`, relative to this file)
            n.ddsl:6:11: error[reserved-name]: the name `rcdeploy` is reserved for the supervisor
            n.ddsl:7:17: error[unknown-instance]: unknown component or group `bb` (did you mean `bbb`?)
            n.ddsl:8:6: error[unknown-instance]: unknown component or group `x` (expected one of `A`, `a`, `bbb`, `rcdeploy`)
        "#]],
    );
}

#[test]
fn cycles_of_after_are_reported() {
    check(
        "Component a { cdsl \"a\"; after b; };\nComponent b { cdsl \"b\"; after c; };\nComponent c { cdsl \"c\"; after a; };\nComponent d { cdsl \"d\"; after d; };\nComponent e { cdsl \"d\"; after a; };",
        &expect![[r#"
            n.ddsl:4:31: error[after-cycle]: cyclic start order: a after b after c after a; also here at n.ddsl:2:31; also here at n.ddsl:3:31
            n.ddsl:5:31: error[after-cycle]: cyclic start order: d after d
        "#]],
    );
}

#[test]
fn every_construct_reaches_the_model() {
    let deployment = check(
        "middleware dds; domain 7;\n\
         /// The robot's computer.\nHost robot { address \"10.0.0.2\"; user \"pi\"; workspace \"/home/pi\"; };\n\
         /// Moves.\nComponent base { cdsl \"a/b.cdsl\"; executable \"bin/b\"; config \"b.toml\"; host robot; endpoint \"10.0.0.2:7000\"; after arm;\n\
         restart on_failure hung 5s max 3 within 1min backoff 250ms; ready 5s; stop 1500; env { A \"1\"; a \"2\"; }; args \"--x\", \"y\"; cpu 0, 3; priority 99; };\n\
         Component idle { cdsl \"i\"; host localhost; restart always; };\n\
         Group arm { middleware iceoryx2; Group left { domain 8; Component motor { cdsl \"m\"; after other; }; export Motor; }; Component other { cdsl \"o\"; }; };",
        &expect![[""]],
    );
    let text = |name: &Option<Name>| name.as_ref().map(|n| n.text.clone()).unwrap_or_default();
    let host = &deployment.hosts[0];
    assert_eq!(host.doc, ["The robot's computer."]);
    assert_eq!(host.address.text, "10.0.0.2");
    assert_eq!(
        (text(&host.user), text(&host.workspace)),
        ("pi".into(), "/home/pi".into())
    );
    assert!(!host.is_local());

    let base = &deployment.instances[0];
    assert_eq!(base.doc, ["Moves."]);
    let files = [&base.cdsl, &base.executable, &base.config].map(text);
    assert_eq!(files, ["a/b.cdsl", "bin/b", "b.toml"]);
    assert_eq!(base.host.map(|(host, _)| host), Some(0));
    let endpoint = base.endpoint.map(|(address, _)| address.to_string());
    assert_eq!(endpoint.as_deref(), Some("10.0.0.2:7000"));
    assert_eq!(base.after[0].0, InstanceOrGroup::Group(0));
    assert_eq!(
        (base.ready.as_millis(), base.stop.as_millis()),
        (5000, 1500)
    );
    let env = base
        .env
        .iter()
        .map(|(name, value)| (name.text.as_str(), value.text.as_str()));
    assert_eq!(env.collect::<Vec<_>>(), [("A", "1"), ("a", "2")]);
    let args = base.args.iter().map(|a| a.text.as_str());
    assert_eq!(args.collect::<Vec<_>>(), ["--x", "y"]);
    assert_eq!(
        (base.cpu.as_slice(), base.priority.map(|(p, _)| p)),
        (&[0, 3][..], Some(99))
    );

    let flat = deployment.instances.iter().map(|i| {
        let Restart {
            policy,
            hung,
            limit,
            backoff,
        } = i.restart;
        format!(
            "{} {:?} {} {:?}, restart {policy:?} {hung:?} {limit:?} {backoff:?}",
            i.path,
            i.middleware,
            settings(i),
            i.group
        )
    });
    expect![[r#"
        base Dds dds.domain=7 ros2.domain=7 None, restart OnFailure Some(5s) Some((3, 60s)) 250ms
        idle Dds dds.domain=7 ros2.domain=7 None, restart Always None None 500ms
        arm.left.motor Iceoryx2 dds.domain=8 ros2.domain=8 Some(1), restart Never None None 500ms
        arm.other Iceoryx2 dds.domain=7 ros2.domain=7 Some(0), restart Never None None 500ms"#]]
    .assert_eq(&flat.collect::<Vec<_>>().join("\n"));
    let groups = deployment.groups.iter().map(|g| {
        let exports: Vec<&str> = g.exports.iter().map(|e| e.text.as_str()).collect();
        format!(
            "{} in {:?}: {:?}, exports {exports:?}",
            g.path, g.parent, g.instances
        )
    });
    expect![[r#"
        arm in None: 2..4, exports []
        arm.left in Some(0): 2..3, exports ["Motor"]"#]]
    .assert_eq(&groups.collect::<Vec<_>>().join("\n"));
}

#[test]
fn names_are_unique_in_a_block() {
    check(
        "Component a { cdsl \"a\"; };\nGroup A { Component a { cdsl \"a\"; }; };\nComponent a { cdsl \"a\"; };\n\
         Host h { address \"h\"; };\nHost H { address \"h\"; };\nHost a { address \"h\"; };\nHost localhost { address \"x\"; };\n\
         Group g { Component a { cdsl \"a\"; }; Component a { cdsl \"a\"; }; export X, Y, X; export Z; };\n\
         Group rcdeploy { Component rcdeploy { cdsl \"a\"; }; };",
        &expect![[r#"
            n.ddsl:3:7: error[duplicate-name]: duplicate name `A`; first declared here at n.ddsl:2:11 (choose names that differ in more than case)
            n.ddsl:4:11: error[duplicate-name]: duplicate name `a`; first declared here at n.ddsl:2:11
            n.ddsl:6:6: error[duplicate-name]: duplicate name `H`; first declared here at n.ddsl:5:6 (choose names that differ in more than case)
            n.ddsl:8:6: error[reserved-name]: the host name `localhost` is reserved for this machine
            n.ddsl:9:48: error[duplicate-name]: duplicate name `a`; first declared here at n.ddsl:9:21
            n.ddsl:9:78: error[duplicate-name]: duplicate export `X`; first exported here at n.ddsl:9:72
            n.ddsl:9:81: error[repeated-clause]: duplicate clause `export`; first used here at n.ddsl:9:65
            n.ddsl:10:7: error[reserved-name]: the name `rcdeploy` is reserved for the supervisor
        "#]],
    );
}

#[test]
fn the_length_of_names_is_limited() {
    let long = "a".repeat(40);
    check_file(
        &format!(
            "Deployment {long}{long} {{ Group {long} {{ Component {long} {{ cdsl \"a\"; }}; }}; }};"
        ),
        &expect![[r#"
            n.ddsl:1:12: error[name-too-long]: the name of network `aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa` has 80 bytes, but the maximum is 64
            n.ddsl:1:154: error[name-too-long]: the name of component `aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa.aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa` has 81 bytes, but the maximum is 64
        "#]],
    );
}

#[test]
fn unknown_and_incomplete_hosts_are_reported() {
    check(
        "Component a { cdsl \"a\"; host robot; };\nComponent b { cdsl \"b\"; host localhst; };",
        &expect![[r#"
            n.ddsl:2:30: error[unknown-host]: unknown host `robot` (declare it: `Host robot { address "10.0.0.2"; };`)
            n.ddsl:3:30: error[unknown-host]: unknown host `localhst` (did you mean `localhost`?)
        "#]],
    );
    check(
        "Host h { };\nHost robot { address \"10.0.0.2\"; address \"10.0.0.3\"; usr \"pi\"; };\nHost bad { address \"10 0 0 2\"; };\nHost open { user \"pi\" };\n\
         Component a { cdsl \"a\"; host robt; };\nComponent b { cdsl \"b\"; host g; };\nComponent c { cdsl \"c\"; host bad; };\n\
         Group g { Host robot { address \"x\"; }; Component a { cdsl \"a\"; host robot; }; Component b { cdsl \"b\"; host open; }; };\n\
         Component d { cdsl \"d\"; host inner; };\nGroup i { Host inner { address \"i\"; }; Component a { cdsl \"a\"; host localhst; }; };",
        &expect![[r#"
            n.ddsl:2:6: error[missing-clause]: host `h` has no field `address` (add `address "10.0.0.2";`)
            n.ddsl:3:34: error[repeated-clause]: duplicate field `address`; first used here at n.ddsl:3:14
            n.ddsl:3:54: error[unknown-field]: expected a field of a host, found `usr` (did you mean `user`?)
            n.ddsl:4:20: error[bad-host-address]: invalid address `10 0 0 2` (write a host name or an IP address: `robot.local` or `10.0.0.2`)
            n.ddsl:5:6: error[missing-clause]: host `open` has no field `address` (add `address "10.0.0.2";`)
            n.ddsl:5:22: error[missing-semicolon]: expected `;`
            n.ddsl:6:30: error[unknown-host]: unknown host `robt` (did you mean `robot`?)
            n.ddsl:7:30: error[unknown-host]: unknown host `g` (expected one of `bad`, `h`, `localhost`, `open`, `robot`)
            n.ddsl:10:30: error[unknown-host]: unknown host `inner` (expected one of `bad`, `h`, `localhost`, `open`, `robot`)
            n.ddsl:11:69: error[unknown-host]: unknown host `localhst` (did you mean `localhost`?)
        "#]],
    );
    check(
        "Host used { address \"u\"; };\nHost h { address \"h\"; };\nComponent a { cdsl \"a\"; host used; };",
        &expect![[r#"
            n.ddsl:3:6: warning[unused-host]: no component runs on host `h`
        "#]],
    );
    // A file that declares only hosts is meant for import.
    check("Host h { address \"h\"; };", &expect![[""]]);
}

#[test]
fn an_address_with_more_in_it_explains_itself() {
    check(
        "Host a { address \"10.0.0.2:22\"; };\nHost b { address \"pi@h\"; };\nHost c { address \"[::1]\"; };\n\
         Host d { address \"[fe80::1%eth0]:2222\"; };\nHost e { address \"::1\"; };\nHost f { address \"fe80::1%eth0\"; };\n\
         Host g { address \"ssh://h\"; };",
        &expect![[r#"
            n.ddsl:2:18: error[bad-host-address]: invalid address `10.0.0.2:22` (write `address "10.0.0.2";`, and the port into ~/.ssh/config, from which `rcdeploy` and ssh have it: `Host 10.0.0.2` and below it `Port 22`)
            n.ddsl:3:18: error[bad-host-address]: invalid address `pi@h` (write the user as a field of its own: `address "h"; user "pi";`)
            n.ddsl:4:18: error[bad-host-address]: invalid address `[::1]` (write it without brackets: `address "::1";`)
            n.ddsl:5:18: error[bad-host-address]: invalid address `[fe80::1%eth0]:2222` (write `address "fe80::1%eth0";`, and the port into ~/.ssh/config, from which `rcdeploy` and ssh have it: `Host fe80::1%eth0` and below it `Port 2222`)
            n.ddsl:8:18: error[bad-host-address]: invalid address `ssh://h` (write a host name or an IP address: `robot.local` or `10.0.0.2`)
        "#]],
    );
}

#[test]
fn options_that_rcdeploy_sets_are_no_arguments() {
    check(
        "Component a { cdsl \"a\"; args \"--log\", \"debug\", \"--network\", \"other\", \"--name=b\"; };\n\
         Component b { cdsl \"b\"; args \"--bind=Laser=other/Laser\", \"--set\", \"speed=1\", \"--record\", \"a.mcap\", \"--check\"; };\n\
         Component c { cdsl \"c\"; args \"--member\", \"camera\", \"-h\", \"-V\", \"--frames\"; };\n\
         Component d { cdsl \"d\"; args \"--ros-args\", \"-r\", \"__node:=front\", \"--\"; };",
        &expect![[r#"
            n.ddsl:2:48: error[reserved-argument]: `--network` cannot be in `args`: `rcdeploy` sets it (a component is in the network of its `Deployment`)
            n.ddsl:2:70: error[reserved-argument]: `--name` cannot be in `args`: `rcdeploy` sets it (its name is the one after `Component`)
            n.ddsl:3:30: error[reserved-argument]: `--bind` cannot be in `args`: `rcdeploy` sets it (write `bind COMPONENT.SLOT -> COMPONENT.SLOT;`)
            n.ddsl:3:58: error[reserved-argument]: `--set` cannot be in `args`: `rcdeploy` sets it (write `parameters { NAME VALUE; };`)
            n.ddsl:3:100: error[reserved-argument]: `--check` cannot be in `args`: a network runs its components (the component would not run)
            n.ddsl:4:30: error[reserved-argument]: `--member` cannot be in `args`: `rcdeploy` sets it (write a `Component` with the same `process`)
            n.ddsl:4:52: error[reserved-argument]: `-h` cannot be in `args`: a network runs its components (the component would not run)
            n.ddsl:4:58: error[reserved-argument]: `-V` cannot be in `args`: a network runs its components (the component would not run)
            n.ddsl:4:64: error[reserved-argument]: `--frames` cannot be in `args`: `rcdeploy` sets it (write `bind … { convert { frames SLOT; }; };`)
        "#]],
    );
}

#[test]
fn endpoints_are_checked_and_unique_on_a_host() {
    check(
        "Host one { address \"10.0.0.2\"; };\nHost same { address \"10.0.0.2\"; };\nHost here { address \"127.0.0.1\"; };\n\
         Component a { cdsl \"a\"; endpoint \"0.0.0.0:7000\"; };\nComponent b { cdsl \"a\"; endpoint \"[::1]:7000\"; host here; };\n\
         Component c { cdsl \"a\"; endpoint \"10.0.0.2:7000\"; host one; };\nGroup g { Component d { cdsl \"a\"; endpoint \"10.0.0.2:7000\"; host same; }; };\n\
         Component e { cdsl \"a\"; endpoint \"robot:7000\"; };\nComponent f { cdsl \"a\"; endpoint \"10.0.0.2\"; };\nComponent g1 { cdsl \"a\"; endpoint \"10.0.0.2:70000\"; };\nComponent h { cdsl \"a\"; endpoint \"10.0.0.2:0\"; };",
        &expect![[r#"
            n.ddsl:6:34: error[port-used-twice]: port 7000 is used twice on localhost; first used here at n.ddsl:5:34
            n.ddsl:8:44: error[port-used-twice]: port 7000 is used twice on 10.0.0.2; first used here at n.ddsl:7:34
            n.ddsl:9:34: error[bad-endpoint]: invalid endpoint `robot:7000` (write an IP address and a port from 1 to 65535: `10.0.0.2:7000` or `[::1]:7000`)
            n.ddsl:10:34: error[bad-endpoint]: invalid endpoint `10.0.0.2` (write an IP address and a port from 1 to 65535: `10.0.0.2:7000` or `[::1]:7000`)
            n.ddsl:11:35: error[bad-endpoint]: invalid endpoint `10.0.0.2:70000` (write an IP address and a port from 1 to 65535: `10.0.0.2:7000` or `[::1]:7000`)
            n.ddsl:12:34: error[bad-endpoint]: invalid endpoint `10.0.0.2:0` (write an IP address and a port from 1 to 65535: `10.0.0.2:7000` or `[::1]:7000`)
        "#]],
    );
}

#[test]
fn an_empty_group_causes_a_warning() {
    check(
        "Group g { };\nGroup h { Group i { }; };\nGroup j { Component a { cdsl \"a\"; }; };\nGroup k { Componnt a { cdsl \"a\"; }; };",
        &expect![[r#"
            n.ddsl:2:7: warning[empty-group]: group `g` has no components
            n.ddsl:3:7: warning[empty-group]: group `h` has no components
            n.ddsl:3:17: warning[empty-group]: group `i` has no components
            n.ddsl:5:11: error[unknown-field]: expected a declaration of a group, found `Componnt` (did you mean `Component`?)
        "#]],
    );
}

#[test]
fn paths_into_groups_need_exports() {
    check(
        "Component out { cdsl \"a\"; };\nGroup arm { export Goal;\n\
         Group left { export Goal, Pose; Component motor { cdsl \"m\"; }; bind motor.Goal -> out.Goal; bind motor.Goal -> twin.Goal; bind arm.left.motor.Hidden -> left.Goal; };\n\
         Component twin { cdsl \"m\"; }; bind twin.Goal -> left.Pose; bind twin.Goal -> left.motor.Hidden; };\n\
         bind out.Goal -> arm.Goal;\nbind out.Goal -> arm.left.motor.Goal;\n\
         bind out.Pose -> arm.left.motor.Pose;\nbind out.Pose -> arm.left.Pose;\nbind out.Pose -> arm.Pose;\nbind out.Pose -> arm.Gaol;\n\
         bind out.Goal -> arm.lft.Goal;\nbind out.Goal -> out.motor.Goal;\nbind motor.Goal -> left.Goal;\nGroup none { Component x { cdsl \"x\"; }; };\nbind out.Goal -> none.Goal;",
        &expect![[r#"
            n.ddsl:5:83: error[not-exported]: `motor` is inside group `arm.left`, which does not export `Hidden`; the group at n.ddsl:4:7 (write `export Goal, Pose, Hidden;` in group `arm.left`)
            n.ddsl:8:22: error[not-exported]: `left` is inside group `arm`, which does not export `Pose`; the group at n.ddsl:3:7 (write `export Goal, Pose;` in group `arm`)
            n.ddsl:9:22: error[not-exported]: `left` is inside group `arm`, which does not export `Pose`; the group at n.ddsl:3:7 (write `export Goal, Pose;` in group `arm`)
            n.ddsl:10:22: error[not-exported]: group `arm` does not export `Pose`; the group at n.ddsl:3:7 (write `export Goal, Pose;` in group `arm`)
            n.ddsl:11:22: error[not-exported]: group `arm` does not export `Gaol`; the group at n.ddsl:3:7 (did you mean `Goal`?)
            n.ddsl:12:22: error[unknown-instance]: group `arm` has no component or group `lft` (did you mean `left`?)
            n.ddsl:14:6: error[unknown-instance]: unknown component or group `motor` (expected one of `arm`, `none`, `out`)
            n.ddsl:14:20: error[unknown-instance]: unknown component or group `left` (expected one of `arm`, `none`, `out`)
            n.ddsl:16:23: error[not-exported]: group `none` does not export `Goal`; the group at n.ddsl:15:7 (write `export Goal;` in group `none`)
        "#]],
    );
}

#[test]
fn after_a_group_waits_for_all_its_components() {
    let deployment = check(
        "Component a { cdsl \"a\"; after g; };\nGroup g { Component b { cdsl \"b\"; after c, h; }; Group h { Component d { cdsl \"d\"; }; }; };\nComponent c { cdsl \"c\"; after d; };",
        &expect![[r#"
            n.ddsl:4:31: error[unknown-instance]: unknown component or group `d` (expected one of `a`, `c`, `g`)
        "#]],
    );
    let (place, _) = deployment.instances[0].after[0];
    assert_eq!(deployment.instances_of(place), 1..3);
    check(
        "Component a { cdsl \"a\"; after g; };\nGroup g { Component b { cdsl \"b\"; }; Group h { Component c { cdsl \"c\"; after a; }; }; };\nGroup own { Component x { cdsl \"x\"; after own; }; };",
        &expect![[r#"
            n.ddsl:3:78: error[after-cycle]: cyclic start order: a after g contains g.h contains g.h.c after a; also here at n.ddsl:2:31
            n.ddsl:4:43: error[after-cycle]: cyclic start order: own.x after own contains own.x
        "#]],
    );
}

#[test]
fn imports_are_merged() {
    let robots = "Deployment robots {\n Host robot { address \"10.0.0.2\"; }; Host spare { address \"10.0.0.3\"; };\n Component base { cdsl \"b\"; host robot; };\n middleware ros2;\n};";
    let arms = "import \"robots.ddsl\";\nDeployment arms { Group arm { export Goal; Component motor { cdsl \"m\"; host robot; after base; }; }; };";
    let deployment = check_files(
        "import \"lib/robots\";\nimport \"arms.ddsl\";\nDeployment n { Component a { cdsl \"a\"; host robot; after arm; }; bind a.Goal -> arm.Goal; domain 3; };",
        &[("robots.ddsl", robots), ("arms.ddsl", arms)],
        &expect![[""]],
    )
    .expect("a deployment");
    let flat: Vec<String> = deployment
        .instances
        .iter()
        .map(|i| format!("{} {:?} {}", i.path, i.middleware, settings(i)))
        .collect();
    expect![[r#"
        base Ros2 dds.domain=3 ros2.domain=3
        arm.motor Iceoryx2 dds.domain=3 ros2.domain=3
        a Iceoryx2 dds.domain=3 ros2.domain=3"#]]
    .assert_eq(&flat.join("\n"));
    check_files(
        "import \"robots.ddsl\";\nimport \"robts.ddsl\";\nDeployment n { Component Base { cdsl \"a\"; }; Host robot { address \"x\"; }; };",
        &[("robots.ddsl", robots)],
        &expect![[r#"
            n.ddsl:2:8: error[import-not-found]: cannot find `robts.ddsl`; searched in memory (did you mean `robots.ddsl`?)
            n.ddsl:3:26: error[duplicate-name]: duplicate name `Base`; first declared here at robots.ddsl:3:12 (choose names that differ in more than case)
            n.ddsl:3:51: error[duplicate-name]: duplicate name `robot`; first declared here at robots.ddsl:2:7
        "#]],
    );
}

#[test]
fn an_unknown_field_lists_all_that_are_allowed() {
    check_files(
        "Deployment n {\nComponent a { cdsl \"a\"; colour \"red\"; }; };",
        &[],
        &expect![[r#"
            n.ddsl:2:25: error[unknown-field]: expected a field of a component, found `colour` (expected one of `cdsl`, `executable`, `config`, `host`, `process`, `endpoint`, `after`, `restart`, `ready`, `stop`, `env`, `args`, `cpu`, `priority`, `parameters`, `slots`, `middleware`, `domain`, `time`, `record`)
        "#]],
    );
}

#[test]
fn cycles_of_imports_are_reported() {
    check_files(
        "import \"b.ddsl\";\nDeployment n { Component a { cdsl \"a\"; }; };",
        &[
            ("b.ddsl", "import \"c.ddsl\";\nDeployment b { };"),
            (
                "c.ddsl",
                "import \"n.ddsl\";\nimport \"c.ddsl\";\nDeployment c { cmponent };",
            ),
        ],
        &expect![[r#"
            c.ddsl:1:8: error[import-cycle]: cyclic import: n.ddsl → b.ddsl → c.ddsl → n.ddsl
            c.ddsl:2:8: error[import-cycle]: cyclic import: c.ddsl → c.ddsl
            c.ddsl:3:16: error[unknown-field]: expected a declaration of a deployment, found `cmponent` (did you mean `Component`?)
        "#]],
    );
}

#[test]
fn external_slots() {
    let deployment = check(
        "Component a { cdsl \"a\"; };\nGroup g { Component b { cdsl \"b\"; }; external b.Laser; };\nexternal a.Laser, a.Pub at \"robot/Pub\";",
        &expect![[""]],
    );
    let externals = deployment.externals.iter();
    let externals: Vec<_> = externals
        .map(|e| {
            (
                e.slot.slot.text.as_str(),
                e.address.as_ref().map(|a| a.text.as_str()),
            )
        })
        .collect();
    assert_eq!(
        externals,
        [
            ("Laser", None),
            ("Laser", Some("robot/Pub")),
            ("Pub", Some("robot/Pub"))
        ]
    );
    check(
        "Component a { cdsl \"a\"; };\nexternal b.Laser;\nexternal a;\nexternal a.Laser to \"x\";\nexternal a.Laser at \"robot laser\";",
        &expect![[r#"
            n.ddsl:3:10: error[unknown-instance]: unknown component or group `b` (expected `a`)
            n.ddsl:4:11: error[syntax-error]: expected `.`, found `;`
            n.ddsl:5:17: error[missing-semicolon]: expected `;`
            n.ddsl:5:18: error[unknown-field]: expected a declaration of a deployment, found `to` (expected one of `Component`, `Process`, `Host`, `Group`, `bind`, `external`, `middleware`, `domain`, `time`, `record`, `Chain`, `World`, `require`)
            n.ddsl:6:21: error[bad-address]: `robot laser` is not an address: names of letters, digits, `_` and `-`, joined by `/`, as in `default/Laser`
        "#]],
    );
}

/// A network, a group and its proxy have none: the message says where to write it.
#[test]
fn exact_recordings_are_of_components() {
    check(
        "record { exact; };\nGroup g { record { exact; }; Component a { cdsl \"a\"; record { exact; }; }; export A; proxy; };",
        &expect![[r#"
            n.ddsl:2:10: error[misplaced-record]: `record` with `exact` records a component, not a network, a group or a proxy (write `record { exact; };` in each component to record; behind a proxy, in those inside)
            n.ddsl:3:20: error[misplaced-record]: `record` with `exact` records a component, not a network, a group or a proxy (write `record { exact; };` in each component to record; behind a proxy, in those inside)
        "#]],
    );
}

/// Also of a group that begins with another one with a proxy, or with a component in a process.
#[test]
fn a_proxy_is_on_the_host_of_the_first_component() {
    let text = r#"Deployment n
    {
        Host far { address "robot"; };
        Group outer
        {
            Group inner { Component a { cdsl "a.cdsl"; host far; }; export A; proxy; };
            export A;
            proxy;
        };
        Group other
        {
            Process p { host far; Component b { cdsl "b.cdsl"; }; Component c { cdsl "b.cdsl"; }; };
            export B;
            proxy;
        };
    };"#;
    let mut sources = SourceMap::new();
    let source = sources.add("n.ddsl", text);
    let (deployment, found) = rc_ddsl::load(&mut sources, &MemoryLoader::default(), source);
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    let deployment = deployment.expect("a network");
    let hosts = deployment.instances.iter();
    let hosts = hosts.map(|one| format!("{} {}", one.path, one.host.is_some()));
    let hosts: Vec<String> = hosts.collect();
    assert_eq!(
        hosts,
        [
            "outer true",
            "outer.inner true",
            "outer.inner.a true",
            "other true",
            "other.b true",
            "other.c true"
        ]
    );
}

#[test]
fn a_host_says_its_processor_and_where_its_programs_are_built() {
    check(
        "Host a { address \"a\"; arch arm64; build there jobs 2 nice 10; };\nHost b { address \"b\"; arch aarch64; build remote; };\n\
         Host c { address \"c\"; arch amd46; build here jobs 0 nice 20; build there; };\nHost d { address \"d\"; arch \"arm64\"; build there nice 1 jobs 2; };\n\
         Component a { cdsl \"a\"; host a; };",
        &expect![[r#"
            n.ddsl:3:28: error[unknown-arch]: unknown processor architecture `aarch64` (did you mean `arm64`?)
            n.ddsl:3:43: error[unknown-build-place]: programs are built `here` or `there`, not `remote` (expected one of `here`, `there`)
            n.ddsl:4:28: error[unknown-arch]: unknown processor architecture `amd46` (did you mean `amd64`?)
            n.ddsl:4:51: error[out-of-range]: expected a number of jobs from 1 to 1024, found the number 0
            n.ddsl:4:58: error[out-of-range]: expected a niceness from 0 to 19, found the number 20
            n.ddsl:4:62: error[repeated-clause]: duplicate field `build`; first used here at n.ddsl:4:35
            n.ddsl:5:28: error[syntax-error]: expected a name, found `"`
            n.ddsl:5:56: error[syntax-error]: unexpected `jobs`
        "#]],
    );
}
