//! Settings of middlewares, times and values of parameters in a network.
#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::language::check;
use expect_test::expect;
use rc_ddsl::model::Instance;

/// The middleware settings of an instance, in the form of a component's command line.
pub(crate) fn settings(instance: &Instance) -> String {
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
            n.ddsl:4:52: error[repeated-clause]: `middleware dds` comes second here; the middleware of this block at n.ddsl:4:22 (a further one only sets something of it, in braces: write first what the components use)
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
