//! Diagnostics and models of `.ddsl` texts without their components.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_ddsl::Deployment;
use rc_ddsl::model::{Instance, InstanceOrGroup, Restart};
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
fn check(body: &str, expected: &Expect) -> Deployment {
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
            n.ddsl:2:1: error[syntax-error]: expected `}` or a declaration, found the end of the file
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
            n.ddsl:5:8: error[syntax-error]: expected `.`, found `-`
            n.ddsl:6:14: error[syntax-error]: expected `->` or `.`, found `=`
            n.ddsl:7:12: error[unknown-middleware]: unknown middleware `iceorix2` (did you mean `iceoryx2`?)
            n.ddsl:8:8: error[syntax-error]: expected a number, found `x`
            n.ddsl:9:1: error[unknown-field]: expected a declaration of a deployment, found `§` (expected one of `Component`, `Host`, `Group`, `bind`, `external`, `middleware`, `domain`, `time`, `record`)
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
            n.ddsl:2:33: error[repeated-clause]: `middleware dds` comes second here; the middleware of what stands here at n.ddsl:2:12 (a further one only sets something of it, in braces: write first what the components use)
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

/// The middleware settings of an instance, in the form of a component's command line.
fn settings(instance: &Instance) -> String {
    let settings = instance.settings.iter();
    let texts = settings.map(|s| format!("{}.{}={}", s.middleware.word(), s.key, s.value));
    texts.collect::<Vec<_>>().join(" ")
}

#[test]
fn settings_of_middlewares_apply_to_their_block() {
    let deployment = check(
        "middleware iceoryx2; middleware dds { domain 7; interfaces \"eth0\"; peers \"10.0.0.2\", \"10.0.0.3:7410\"; multicast off; lease 500ms; queue_mib 64; };\n\
         Component a { cdsl \"a\"; };\nComponent b { cdsl \"b\"; middleware dds { Lease 2s; MULTICAST true; }; domain 3; };\n\
         Group g { middleware dds { peers \"10.0.0.9\"; } Component c { cdsl \"c\"; }; Group h { domain 8; Component d { cdsl \"d\"; middleware ros2; }; }; };",
        &expect![""],
    );
    let flat = deployment.instances.iter();
    let flat = flat.map(|i| format!("{} {:?} {}", i.path, i.middleware, settings(i)));
    expect![[r#"
        a Iceoryx2 dds.domain=7 dds.interfaces=eth0 dds.peers=10.0.0.2,10.0.0.3:7410 dds.multicast=false dds.lease=500ms dds.queue_mib=64
        b Dds dds.interfaces=eth0 dds.peers=10.0.0.2,10.0.0.3:7410 dds.queue_mib=64 dds.lease=2s dds.multicast=true dds.domain=3 ros2.domain=3
        g.c Dds dds.domain=7 dds.interfaces=eth0 dds.multicast=false dds.lease=500ms dds.queue_mib=64 dds.peers=10.0.0.9
        g.h.d Ros2 dds.interfaces=eth0 dds.multicast=false dds.lease=500ms dds.queue_mib=64 dds.peers=10.0.0.9 dds.domain=8 ros2.domain=8"#]].assert_eq(&flat.collect::<Vec<_>>().join("\n"));
    check(
        "middleware dds { domian 7; lease 50ms; interfaces 5; peers \"a b\", \"c\"; multicast maybe; lease 1s; domain 1, 2; };\n\
         domain 3;\nGroup g { middleware iceoryx2 { x 1; }; middleware dds; Component c { cdsl \"c\"; middleware dds { lease; lease 1s 2s; § 1; multicast off lease 1s; }; middleware dds { domain 1; }; middleware { }; }; };\nComponent z { cdsl \"z\"; domain x; };",
        &expect![[r#"
            n.ddsl:2:18: error[unknown-key]: `domian` cannot be set of dds (did you mean `domain`?)
            n.ddsl:2:34: error[out-of-range]: `lease` cannot be `50ms` (allowed is a duration of at least 100ms, at most a day)
            n.ddsl:2:51: error[bad-setting]: `interfaces` cannot be the number 5 (allowed is the name or the address of a network interface, such as "eth0" or "10.0.0.2")
            n.ddsl:2:60: error[bad-setting]: `peers` cannot be the string "a b" (allowed is the name or the address of a machine, such as "robot.local" or "10.0.0.2:7410")
            n.ddsl:2:82: error[bad-setting]: `multicast` cannot be `maybe` (allowed is `on` or `off`)
            n.ddsl:2:89: error[repeated-clause]: duplicate setting `lease`; first used here at n.ddsl:2:28
            n.ddsl:2:109: error[bad-setting]: `domain` takes one value
            n.ddsl:3:1: error[repeated-clause]: duplicate setting `domain`; first used here at n.ddsl:2:99
            n.ddsl:4:33: error[unknown-key]: `x` cannot be set of iceoryx2 (there are no settings of iceoryx2 yet)
            n.ddsl:4:52: error[repeated-clause]: `middleware dds` comes second here; the middleware of what stands here at n.ddsl:4:22 (a further one only sets something of it, in braces: write first what the components use)
            n.ddsl:4:103: error[syntax-error]: expected a value, found `;`
            n.ddsl:4:114: error[syntax-error]: expected `,` or `;`, found `2s`
            n.ddsl:4:118: error[unknown-field]: expected a setting of a middleware, found `§` (expected one of `domain`, `interfaces`, `peers`, `multicast`, `lease`, `queue_mib`, `namespace`, `node`, `remap`, `qos`, `use_sim_time`, `rosout`)
            n.ddsl:4:136: error[missing-semicolon]: expected `;`
            n.ddsl:4:161: error[repeated-clause]: duplicate clause `middleware`; first used here at n.ddsl:4:92
            n.ddsl:4:191: error[syntax-error]: expected a name, found `{`
            n.ddsl:5:32: error[syntax-error]: expected a number, found `x`
        "#]],
    );
}

#[test]
fn ros_settings_are_checked() {
    let deployment = check(
        "middleware ros2 { namespace \"/robot\"; };\n\
         Component a { cdsl \"a\"; middleware ros2 { node \"lidar\"; remap \"LaserPub/newScan:=/scan\", \"Base:=~/b\"; qos \"LaserPub.depth:=1\", \"Base/a.deadline:=0.5s\"; }; };",
        &expect![""],
    );
    let flat: Vec<String> = deployment.instances.iter().map(settings).collect();
    expect!["ros2.namespace=/robot ros2.node=lidar ros2.remap=LaserPub/newScan:=/scan,Base:=~/b ros2.qos=LaserPub.depth:=1,Base/a.deadline:=500ms"].assert_eq(&flat.join("\n"));
    check(
        "middleware ros2 { service_mapping cyclone; namespace \"robot\"; node 7; remap \"Laser=/scan\"; nod \"x\"; qos \"/scan.depth:=1\"; };\n\
         Component a { cdsl \"a\"; };",
        &expect![[r#"
            n.ddsl:2:19: error[unknown-key]: `service_mapping` cannot be set of ros2 (there are domain, interfaces, lease, queue_mib, namespace, node, remap, qos, use_sim_time, rosout)
            n.ddsl:2:54: error[bad-setting]: `namespace` cannot be the string "robot" (allowed is a namespace of ROS 2, such as "/robot": each `/` is followed by letters, digits and single `_`, no digit first)
            n.ddsl:2:68: error[bad-setting]: `node` cannot be the number 7 (allowed is the name of a node, such as "lidar_front": letters, digits and `_`, no digit first)
            n.ddsl:2:77: error[bad-setting]: `remap` cannot be the string "Laser=/scan" (allowed is a rule FROM:=TO, such as "LaserPub/newScan:=/scan": FROM is a slot, SLOT/operation or a name of ROS 2, TO is the new name)
            n.ddsl:2:92: error[unknown-key]: `nod` cannot be set of ros2 (did you mean `node`?)
            n.ddsl:2:105: error[bad-setting]: `qos` cannot be the string "/scan.depth:=1" (allowed is a rule SLOT.POLICY:=VALUE or SLOT/operation.POLICY:=VALUE, such as "LaserPub/newScan.depth:=1", of reliability (reliable, best_effort), durability (volatile, transient_local), depth (1 to 1000), deadline, lifespan and liveliness (a duration, or none))
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
fn values_of_settings_are_checked() {
    check(
        "domain 233;\nComponent a { cdsl \"a\"; cpu 1, 1024, -1, 1.5; priority 0; restart allways; ready 2min; stop 1441min; };\n\
         Component b { cdsl \"b\"; priority 100; restart on_failure hung 1s max 0 within 0s backoff 0; env { A \"1\"; B \"2\"; A \"3\"; }; };\n\
         Component c { cdsl \"c\"; restart never max 3 within 1s; priority 1; priority 2; };\nComponent d { cdsl \"d\"; restart NEVER hung 9s; };\n\
         Group g { domain 1; domain 2; middleware ros; middleware rso2; Component e { cdsl \"e\"; }; };",
        &expect![[r#"
            n.ddsl:2:8: error[out-of-range]: `domain` cannot be the number 233 (allowed is an integer from 0 to 232)
            n.ddsl:3:32: error[out-of-range]: expected a processor number from 0 to 1023, found the number 1024
            n.ddsl:3:38: error[out-of-range]: expected a processor number from 0 to 1023, found the number -1
            n.ddsl:3:42: error[out-of-range]: expected a processor number from 0 to 1023, found the number 1.5
            n.ddsl:3:56: error[out-of-range]: expected a priority from 1 to 99, found the number 0
            n.ddsl:3:67: error[unknown-restart]: unknown restart policy `allways` (did you mean `always`?)
            n.ddsl:3:93: error[bad-time]: `stop` takes a duration such as `5s`, at most one day
            n.ddsl:4:34: error[out-of-range]: expected a priority from 1 to 99, found the number 100
            n.ddsl:4:63: error[bad-time]: `hung` takes a duration of at least two seconds: a component counts as hung after that time
            n.ddsl:4:70: error[out-of-range]: expected a number of restarts from 1 to 1000, found the number 0
            n.ddsl:4:79: error[bad-time]: `within` takes a duration such as `5s`, at most one day
            n.ddsl:4:90: error[bad-time]: `backoff` takes a duration such as `5s`, at most one day
            n.ddsl:4:113: error[repeated-clause]: duplicate variable `A`; first used here at n.ddsl:4:99
            n.ddsl:5:33: warning[restart-without-effect]: `hung`, `max` and `backoff` have no effect with the policy `never`
            n.ddsl:5:68: error[repeated-clause]: duplicate field `priority`; first used here at n.ddsl:5:56
            n.ddsl:6:33: warning[restart-without-effect]: `hung`, `max` and `backoff` have no effect with the policy `never`
            n.ddsl:7:21: error[repeated-clause]: duplicate setting `domain`; first used here at n.ddsl:7:11
            n.ddsl:7:58: error[unknown-middleware]: unknown middleware `rso2` (did you mean `ros2`?)
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
fn the_time_of_a_network() {
    let network = check(
        "time simulated by world.sim;\nComponent a { cdsl \"a\"; TIME System; };\n\
         Group world { Component sim { cdsl \"s\"; }; };",
        &expect![[""]],
    );
    assert_eq!(network.time.map(|(source, _)| source), Some(1));
    assert!(network.instances[0].system_time.is_some());
    assert!(network.instances[1].system_time.is_none());
}

#[test]
fn a_time_that_is_wrong() {
    check(
        "time simulated by smi;\ntime simulated by sim;\nComponent sim { cdsl \"s\"; time system; time system; };\n\
         Group g { time simulated by sim; Component a { cdsl \"a\"; }; };",
        &expect![[r#"
            n.ddsl:2:19: error[unknown-instance]: unknown component or group `smi` (did you mean `sim`?)
            n.ddsl:3:1: error[repeated-clause]: duplicate clause `time`; first used here at n.ddsl:2:1
            n.ddsl:4:40: error[repeated-clause]: duplicate field `time`; first used here at n.ddsl:4:27
            n.ddsl:5:11: error[misplaced-time]: `time` holds for the whole network, not for a group; the group at n.ddsl:5:7 (move it into the block of the deployment)
        "#]],
    );
    check(
        "time simulated by g;\nGroup g { Component a { cdsl \"a\"; }; };",
        &expect![[r#"
            n.ddsl:2:19: error[not-a-time-source]: `g` is a group; a component publishes time; the group at n.ddsl:3:7 (write `time simulated by g.NAME;`)
        "#]],
    );
    check(
        "time simulated by a.b;\nComponent a { cdsl \"a\"; };\ntime simulated;\ntime;\nComponent time { cdsl \"t\"; time simulated; };",
        &expect![[r#"
            n.ddsl:2:21: error[not-a-group]: expected a group, found component `a` (write `a.SLOT`, or `a.ARRAY.MEMBER` for a slot array)
            n.ddsl:4:15: error[syntax-error]: expected `by`, found `;`
            n.ddsl:5:5: error[syntax-error]: expected `simulated by NAME`, found `;`
            n.ddsl:6:33: error[syntax-error]: expected `system`, found `simulated`
        "#]],
    );
}

#[test]
fn values_of_parameters() {
    let deployment = check(
        "Component a { cdsl \"a\"; parameters { speed 300; motors[2].max -4.5; gains [1, 0.5]; none []; mode fast; name \"left\"; timeout 20ms; }; };",
        &expect![[""]],
    );
    let paths = deployment.instances[0].parameters.iter();
    let paths: Vec<&str> = paths.map(|p| p.path.text.as_str()).collect();
    assert_eq!(
        paths,
        [
            "speed",
            "motors[2].max",
            "gains",
            "none",
            "mode",
            "name",
            "timeout"
        ]
    );
    check(
        "Component a { cdsl \"a\"; parameters { speed 300; speed = 4; motors [1; x 1 2; speed 5; }; };",
        &expect![[r#"
            n.ddsl:2:55: error[syntax-error]: expected `[` or a value, found `=`
            n.ddsl:2:69: error[syntax-error]: expected `,` or `]`, found `;`
            n.ddsl:2:75: error[syntax-error]: expected `;`, found `2`
            n.ddsl:2:78: error[repeated-clause]: duplicate parameter `speed`; first used here at n.ddsl:2:38
        "#]],
    );
    check(
        "Component a { cdsl \"a\"; parameters speed 300; };",
        &expect![[r#"
            n.ddsl:2:36: error[syntax-error]: expected `{`, found `speed`
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
            n.ddsl:5:18: error[unknown-field]: expected a declaration of a deployment, found `to` (expected one of `Component`, `Host`, `Group`, `bind`, `external`, `middleware`, `domain`, `time`, `record`)
            n.ddsl:6:21: error[bad-address]: `robot laser` is not an address: names of letters, digits, `_` and `-`, joined by `/`, as in `default/Laser`
        "#]],
    );
}
