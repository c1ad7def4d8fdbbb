//! Diagnostics and values of configuration files.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_configuration::Configuration;
use rc_configuration::model::Parameters;
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use serde_json::json;
use std::path::PathBuf;
use std::time::Duration;

/// The motor bus: a list of motors, and one parameter of every kind.
pub(crate) const BUS: &str = r#"ComponentParams MotorBus {
    /// The serial port.
    device path "/dev/ttyUSB0" restart;
    rate int 115200 9600:1000000 unit "baud" T;
    gain float 1.0 0:10 T;
    mode string fast {slow, fast};
    timeout duration 50ms 1ms:2s;
    offsets double[2:3] [0, 0.5] -1:1;
    token string "s3cret" secret;
    pin int 1234 0:9999 secret;
    verbose bool false;
    group log { path path "/tmp"; keep long 7; };
    /// The motors on the bus.
    list motors 1:3 { name string; id int 0:127; max float 1.5; tags string[] []; };
};"#;

/// The period of a component without a `period` clause.
pub(crate) const PERIOD: Duration = Duration::from_millis(100);

pub(crate) fn load(text: &str) -> Parameters {
    let mut sources = SourceMap::new();
    let source = sources.add("c.pdsl", text);
    let (model, found) = rc_pdsl::load(&mut sources, &MemoryLoader::default(), source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    model.expect("parameters")
}

pub(crate) fn read(
    text: &str,
    parameters: Option<&Parameters>,
) -> (Configuration, Diagnostics, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", text);
    let (configuration, found) = rc_configuration::check(&sources, source, parameters);
    let rendered = render(&sources, &found, Format::Short);
    (configuration, found, rendered)
}

pub(crate) fn check(text: &str, expected: &Expect) -> Configuration {
    let (configuration, _, rendered) = read(text, Some(&load(BUS)));
    expected.assert_eq(&rendered);
    configuration
}

#[test]
fn values_and_defaults_are_read() {
    let text = r#"
[component]
period = "20ms"
log = "debug"
[bindings]
laser = "robot/laser"
[middleware.dds]
domain = 7
interfaces = ["eth0", "10.0.0.2"]
peers = []
multicast = false
lease = 0x200
[parameters]
gain = 2
timeout = 100
device = "/dev/x"
log.keep = 3
[[parameters.motors]]
name = "left"
id = 1
[[parameters.motors]]
name = "right"
id = 2
max = 3.5
tags = ["x"]
"#;
    let configuration = check(text, &expect![[""]]);
    assert_eq!(configuration.period, Some(Duration::from_millis(20)));
    assert_eq!(configuration.log.as_deref(), Some("debug"));
    assert_eq!(configuration.bindings["laser"].address, "robot/laser");
    let values = &configuration.parameters;
    assert_eq!(
        (
            values.int("rate"),
            values.float("gain"),
            values.bool("verbose")
        ),
        (115_200, 2.0, false)
    );
    assert_eq!(values.duration("timeout"), Duration::from_millis(100));
    assert_eq!(values.path("device"), PathBuf::from("/dev/x"));
    assert_eq!(values.floats("offsets"), [0.0, 0.5]);
    assert_eq!(values.group("log").int("keep"), 3);
    assert_eq!(values.text("token"), "s3cret");
    let motors = values.list("motors");
    assert_eq!(
        (motors.len(), motors[1].text("name"), motors[1].float("max")),
        (2, "right".to_owned(), 3.5)
    );
    assert_eq!(motors[1].texts("tags"), ["x"]);
    // Accessors return defaults for names that do not exist.
    assert_eq!(
        (
            values.int("nothing"),
            values.group("motors").list("x").len()
        ),
        (0, 0)
    );
    let dds = configuration.middleware["dds"].iter();
    let settings: Vec<_> = dds.map(|(key, set)| (key, set.value.to_string())).collect();
    expect![[r#"
        [("domain", "7"), ("interfaces", "eth0,10.0.0.2"), ("lease", "512ms"), ("multicast", "false"), ("peers", "")]
        {"device":"/dev/x","gain":2.0,"log":{"keep":3,"path":"/tmp"},"mode":"fast","motors":[{"id":1,"max":1.5,"name":"left","tags":[]},{"id":2,"max":3.5,"name":"right","tags":["x"]}],"offsets":[0.0,0.5],"pin":"***","rate":115200,"timeout":"100ms","token":"***","verbose":false}
    "#]].assert_eq(&format!("{settings:?}\n{values:?}\n"));
}

#[test]
fn all_errors_are_reported_together() {
    let text = r#"
[parameters]
rate = 5
gain = "much"
mode = "fasst"
timeout = "soon"
offsets = [0.5]
verbos = true
pin = 123456
token = 7
device = 1979-05-27
[parameters.log]
keep = "x"
kep = 1
[[parameters.motors]]
name = "left"
id = 200
[[parameters.motors]]
id = 1
[[parameters.motors]]
name = "m2"
id = 3
max = true
tags = ["x", 3]
"#;
    check(
        text,
        &expect![[r#"
            config.toml:3:8: error[out-of-range]: `rate` cannot be the number 5 (allowed is an integer of 32 bits, from 9600 to 1000000, in baud)
            config.toml:4:8: error[wrong-type]: `gain` cannot be the string "much" (allowed is a number of 32 bits, from 0 to 10)
            config.toml:5:8: error[invalid-choice]: `mode` cannot be the string "fasst" (allowed is a string, one of "slow", "fast"; did you mean `fast`?)
            config.toml:6:11: error[wrong-type]: `timeout` cannot be the string "soon" (allowed is a duration such as "50ms", or a number of milliseconds, from 1ms to 2s)
            config.toml:7:11: error[wrong-length]: `offsets` has length 1 (allowed are 2 to 3 elements)
            config.toml:8:1: error[unknown-parameter]: unknown parameter `verbos` (did you mean `verbose`?)
            config.toml:9:7: error[out-of-range]: `pin` cannot be this number (allowed is an integer of 32 bits, from 0 to 9999)
            config.toml:10:9: error[wrong-type]: `token` cannot be this number (allowed is a string)
            config.toml:11:10: error[wrong-type]: `device` cannot be a date (allowed is a path as a string)
            config.toml:13:8: error[wrong-type]: `log.keep` cannot be the string "x" (allowed is an integer of 64 bits)
            config.toml:14:1: error[unknown-parameter]: unknown parameter `log.kep` (did you mean `keep`?)
            config.toml:17:6: error[out-of-range]: `motors[0].id` cannot be the number 200 (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:18:1: error[missing-parameter]: `motors[1].name` must be set (allowed is a string)
            config.toml:23:7: error[wrong-type]: `motors[2].max` cannot be `true` (allowed is a number of 32 bits)
            config.toml:24:14: error[wrong-type]: `motors[2].tags[1]` cannot be the number 3 (allowed is a string)
        "#]],
    );
}

#[test]
fn numbers_at_the_limits_of_their_types() {
    let text = "parameters.motors = [{ name = 'a', id = 3000000000 }, { name = 'b', id = 1, max = 1e99 }]\n\
                parameters.gain = nan\nparameters.timeout = -1\nparameters.offsets = [0.1, 2.0, nan, 0.0]\n\
                parameters.log.keep = 9223372036854775807\nparameters.rate = 10000.0";
    check(
        text,
        &expect![[r#"
            config.toml:1:41: error[out-of-range]: `motors[0].id` cannot be the number 3000000000 (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:1:83: error[out-of-range]: `motors[1].max` cannot be the number 1e99 (allowed is a number of 32 bits)
            config.toml:2:19: error[out-of-range]: `gain` cannot be the number nan (allowed is a number of 32 bits, from 0 to 10)
            config.toml:3:22: error[out-of-range]: `timeout` cannot be the number -1 (allowed is a duration such as "50ms", or a number of milliseconds, from 1ms to 2s)
            config.toml:4:22: error[wrong-length]: `offsets` has length 4 (allowed are 2 to 3 elements)
            config.toml:4:28: error[out-of-range]: `offsets[1]` cannot be the number 2.0 (allowed is a number of 64 bits, from -1 to 1)
            config.toml:4:33: error[out-of-range]: `offsets[2]` cannot be the number nan (allowed is a number of 64 bits, from -1 to 1)
            config.toml:6:19: error[wrong-type]: `rate` cannot be the number 10000.0 (allowed is an integer of 32 bits, from 9600 to 1000000, in baud)
        "#]],
    );
}

#[test]
fn a_missing_parameter_is_reported_at_its_table() {
    check(
        "",
        &expect![[r#"
        config.toml:1:1: error[missing-parameter]: `motors` must be set (allowed is a list of tables, 1 to 3 elements)
    "#]],
    );
    check(
        "\n[parameters]\nrate = 10000\n[parameters.log]\n",
        &expect![[r#"
        config.toml:2:1: error[missing-parameter]: `motors` must be set (allowed is a list of tables, 1 to 3 elements)
    "#]],
    );
    check(
        "[parameters]\nmotors = [{}]",
        &expect![[r#"
            config.toml:2:11: error[missing-parameter]: `motors[0].name` must be set (allowed is a string)
            config.toml:2:11: error[missing-parameter]: `motors[0].id` must be set (allowed is an integer of 32 bits, from 0 to 127)
        "#]],
    );
}

#[test]
fn tables_in_place_of_values_are_reported() {
    check(
        "[parameters]\nlog = 3\nmotors = 5\nrate = {}\noffsets = 1",
        &expect![[r#"
            config.toml:2:7: error[wrong-type]: `log` cannot be the number 3 (allowed is a table)
            config.toml:3:10: error[wrong-type]: `motors` cannot be the number 5 (allowed is a list of tables, 1 to 3 elements)
            config.toml:4:8: error[wrong-type]: `rate` cannot be a table (allowed is an integer of 32 bits, from 9600 to 1000000, in baud)
            config.toml:5:11: error[wrong-type]: `offsets` cannot be the number 1 (allowed is an array, 2 to 3 elements, each a number of 64 bits, from -1 to 1)
        "#]],
    );
    check(
        "[parameters]\nmotors = [1, 2]\nlog = [[1]]\n[parameters.gain]\nx = 1",
        &expect![[r#"
        config.toml:2:10: error[wrong-type]: `motors` cannot be an array (allowed is a list of tables, 1 to 3 elements)
        config.toml:3:7: error[wrong-type]: `log` cannot be an array (allowed is a table)
        config.toml:4:1: error[wrong-type]: `gain` cannot be a table (allowed is a number of 32 bits, from 0 to 10)
    "#]],
    );
    check(
        "parameters = 3\ncomponent = []\nbindings = 'x'\nmiddleware = { dds = 1 }",
        &expect![[r#"
            config.toml:1:14: error[wrong-type]: `parameters` cannot be this number (allowed is a table)
            config.toml:2:13: error[wrong-type]: `component` cannot be an array (allowed is a table)
            config.toml:3:12: error[wrong-type]: `bindings` cannot be this string (allowed is a table)
            config.toml:4:22: error[wrong-type]: `middleware.dds` cannot be this number (allowed is a table)
        "#]],
    );
    check(
        "[parameters]\nmotors = []",
        &expect![[r#"
        config.toml:2:10: error[wrong-length]: `motors` has length 0 (allowed are 1 to 3 elements)
    "#]],
    );
    let four = "[[parameters.motors]]\nname = 'x'\nid = 1\n".repeat(4);
    check(
        &four,
        &expect![[r#"
        config.toml:1:1: error[wrong-length]: `motors` has length 4 (allowed are 1 to 3 elements)
    "#]],
    );
}

#[test]
fn settings_of_middlewares_are_checked() {
    let text = "[middleware.dds]\ndomian = 3\ndomain = 233\ninterfaces = \"eth0\"\npeers = [\"10.0.0.2\", 5, \"a:0\"]\n\
                multicast = \"on\"\nlease = \"50ms\"\nqos = 1\n[middleware.iceoryx2]\nsegment = 5\n[middleware.ddss]\nx = 1\n";
    let (configuration, _, rendered) = read(text, None);
    expect![[r#"
        config.toml:2:1: error[unknown-key]: unknown key `middleware.dds.domian` (did you mean `domain`?)
        config.toml:3:10: error[out-of-range]: `middleware.dds.domain` cannot be the number 233 (allowed is an integer from 0 to 232)
        config.toml:4:14: error[wrong-type]: `middleware.dds.interfaces` cannot be the string "eth0" (allowed is an array, each element the name or the address of a network interface, such as "eth0" or "10.0.0.2")
        config.toml:5:22: error[wrong-type]: `middleware.dds.peers[1]` cannot be the number 5 (allowed is the name or the address of a machine, such as "robot.local" or "10.0.0.2:7410")
        config.toml:5:25: error[bad-setting]: `middleware.dds.peers[2]` cannot be the string "a:0" (allowed is the name or the address of a machine, such as "robot.local" or "10.0.0.2:7410")
        config.toml:6:13: error[wrong-type]: `middleware.dds.multicast` cannot be the string "on" (allowed is true or false)
        config.toml:7:9: error[out-of-range]: `middleware.dds.lease` cannot be the string "50ms" (allowed is a duration of at least 100ms, at most a day)
        config.toml:8:1: error[unknown-key]: unknown key `middleware.dds.qos` (there are domain, interfaces, peers, multicast, lease, queue_mib)
        config.toml:10:1: error[unknown-key]: unknown key `middleware.iceoryx2.segment` (there are no settings of iceoryx2 yet)
        config.toml:11:13: error[unknown-middleware]: unknown middleware `ddss` (did you mean `dds`?)
    "#]].assert_eq(&rendered);
    assert_eq!(configuration.middleware["dds"].len(), 0);
    let (_, _, rendered) = read("middleware.dds.lease = \"soon\"", None);
    expect![[r#"
        config.toml:1:24: error[wrong-type]: `middleware.dds.lease` cannot be the string "soon" (allowed is a duration of at least 100ms, at most a day)
    "#]].assert_eq(&rendered);
}

#[test]
fn ros_names_are_checked() {
    let text = "[middleware.ros2]\nnamespace = \"/robot\"\n\
                [middleware.ros2.remap]\n\"LaserPub/newScan\" = \"/scan\"\nBase = \"~/base\"\n";
    let (configuration, _, rendered) = read(text, None);
    assert_eq!(rendered, "");
    let set = &configuration.middleware["ros2"];
    let rules = ["LaserPub/newScan:=/scan", "Base:=~/base"];
    assert_eq!(set["remap"].value.to_string(), rules.join(","));
    let list = format!(
        "[middleware.ros2]\nremap = [\"{}\", \"{}\"]\n",
        rules[0], rules[1]
    );
    let (configuration, _, rendered) = read(&list, None);
    assert_eq!(rendered, "");
    let set = &configuration.middleware["ros2"]["remap"];
    assert_eq!(set.value.to_string(), rules.join(","));
    let text = "[middleware.ros2]\nservice_mapping = \"cyclone\"\nnamespace = \"robot\"\nnode = \"a/b\"\n\
                [middleware.ros2.remap]\nLaser = 1\nBase = \"a b\"\n";
    let (_, _, rendered) = read(text, None);
    expect![[r#"
        config.toml:2:1: error[unknown-key]: unknown key `middleware.ros2.service_mapping` (there are domain, interfaces, lease, queue_mib, namespace, node, remap, qos, use_sim_time, rosout)
        config.toml:3:13: error[bad-setting]: `middleware.ros2.namespace` cannot be the string "robot" (allowed is a namespace of ROS 2, such as "/robot": each `/` is followed by letters, digits and single `_`, no digit first)
        config.toml:4:8: error[bad-setting]: `middleware.ros2.node` cannot be the string "a/b" (allowed is the name of a node, such as "lidar_front": letters, digits and `_`, no digit first)
        config.toml:6:9: error[wrong-type]: `middleware.ros2.remap."Laser"` cannot be the number 1 (allowed is the new name)
        config.toml:7:8: error[bad-setting]: `middleware.ros2.remap."Base"` cannot be the string "a b" (allowed is a rule FROM:=TO, such as "LaserPub/newScan:=/scan": FROM is a slot, SLOT/operation or a name of ROS 2, TO is the new name)
    "#]].assert_eq(&rendered);
}

#[test]
fn ros_qos_overrides_are_checked() {
    let text = "[middleware.ros2.qos.LaserPub]\nreliability = \"best_effort\"\ndeadline = 500\n\
                [middleware.ros2.qos.\"LaserPub/newScan\"]\ndepth = 1\ndeadline = \"none\"\n";
    let (configuration, _, rendered) = read(text, None);
    assert_eq!(rendered, "");
    let rules = [
        "LaserPub.reliability:=best_effort",
        "LaserPub.deadline:=500ms",
        "LaserPub/newScan.depth:=1",
        "LaserPub/newScan.deadline:=none",
    ];
    let set = &configuration.middleware["ros2"]["qos"];
    assert_eq!(set.value.to_string(), rules.join(","));
    let list = format!("[middleware.ros2]\nqos = {rules:?}\n");
    let (configuration, _, rendered) = read(&list, None);
    assert_eq!(rendered, "");
    let set = &configuration.middleware["ros2"]["qos"];
    assert_eq!(set.value.to_string(), rules.join(","));
    let text = "[middleware.ros2.qos]\nLaser = 1\n\
                [middleware.ros2.qos.Base]\ndepth = 0\ndept = 1\nreliability = \"best\"\ndeadline = true\ndurability = 1\n\
                [middleware.ros2.qos.\"/scan\"]\ndepth = 1\n";
    let (_, _, rendered) = read(text, None);
    expect![[r#"
        config.toml:2:9: error[wrong-type]: `middleware.ros2.qos."Laser"` cannot be the number 1 (allowed is a table of reliability, durability, depth, deadline, lifespan, liveliness)
        config.toml:4:9: error[bad-setting]: `middleware.ros2.qos."Base"`: `depth` cannot be `0`; allowed is an integer from 1 to 1000
        config.toml:5:8: error[bad-setting]: `middleware.ros2.qos."Base"`: `dept` is not a quality of service that can be set; did you mean `depth`?
        config.toml:6:15: error[bad-setting]: `middleware.ros2.qos."Base"`: `reliability` cannot be `best`; allowed is reliable or best_effort
        config.toml:7:12: error[wrong-type]: `middleware.ros2.qos."Base".deadline` cannot be `true` (allowed is a duration such as 500ms, at most a day, or none)
        config.toml:8:14: error[wrong-type]: `middleware.ros2.qos."Base".durability` cannot be the number 1 (allowed is volatile or transient_local)
        config.toml:10:9: error[bad-setting]: `middleware.ros2.qos."/scan"`: `/scan` is neither SLOT nor SLOT/operation
    "#]].assert_eq(&rendered);
    let (_, _, rendered) = read("middleware.ros2.qos = [\"Laser.depth=1\"]", None);
    expect![[r#"
        config.toml:1:24: error[bad-setting]: `middleware.ros2.qos[0]` cannot be the string "Laser.depth=1" (allowed is a rule SLOT.POLICY:=VALUE or SLOT/operation.POLICY:=VALUE, such as "LaserPub/newScan.depth:=1", of reliability (reliable, best_effort), durability (volatile, transient_local), depth (1 to 1000), deadline, lifespan and liveliness (a duration, or none))
    "#]].assert_eq(&rendered);
}

#[test]
fn tables_of_the_framework_are_checked() {
    let text = "[component]\nperiod = 0\nlog = \"inf\"\nperoid = 3\n[bindings]\na = 3\nb = \"x\"\n[middlewares.dds]\nx = 1\n";
    let (configuration, _, rendered) = read(text, None);
    expect![[r#"
        config.toml:2:10: error[out-of-range]: `component.period` cannot be the number 0 (allowed is a duration of at least 100us)
        config.toml:3:7: error[invalid-choice]: `component.log` cannot be the string "inf" (did you mean `info`?)
        config.toml:4:1: error[unknown-key]: unknown key `component.peroid` (did you mean `period`?)
        config.toml:6:5: error[wrong-type]: `bindings.a` cannot be this number (allowed is an address as a string)
        config.toml:8:2: error[unknown-key]: unknown key `middlewares` (did you mean `middleware`?)
    "#]].assert_eq(&rendered);
    assert_eq!(configuration.bindings.len(), 1);
    let (_, _, rendered) = read("[component]\nperiod = \"x\"\nlog = 3", None);
    expect![[r#"
        config.toml:2:10: error[wrong-type]: `component.period` cannot be the string "x" (allowed is a duration such as "50ms", or a number of milliseconds)
        config.toml:3:7: error[wrong-type]: `component.log` cannot be the number 3 (allowed is a level as a string)
    "#]].assert_eq(&rendered);
    let (_, _, rendered) = read("[component]\nperiod = -3", None);
    expect![[r#"
        config.toml:2:10: error[out-of-range]: `component.period` cannot be the number -3 (allowed is a duration of at least 100us)
    "#]].assert_eq(&rendered);
    let (_, _, rendered) = read("[parameters]\nx = 3", None);
    expect![[r#"
        config.toml:2:1: error[unknown-parameter]: unknown parameter `x` (there are no parameters here)
    "#]].assert_eq(&rendered);
}

#[test]
fn invalid_toml_is_reported() {
    check(
        "[parameters\nrate = 3",
        &expect![[r#"
        config.toml:1:12: error[toml-syntax]: unclosed table, expected `]`
    "#]],
    );
    check(
        "[parameters]\nrate = 3\nrate = 4",
        &expect![[r#"
            config.toml:2:8: error[out-of-range]: `rate` cannot be the number 3 (allowed is an integer of 32 bits, from 9600 to 1000000, in baud)
            config.toml:3:1: error[toml-syntax]: duplicate key
        "#]],
    );
    check(
        "rate = é",
        &expect![[r#"
        config.toml:1:8: error[toml-syntax]: a text needs quotes
    "#]],
    );
}

#[test]
fn a_text_without_quotes_is_said_to_need_them_and_hides_nothing() {
    check(
        "[parameters]\nport = fast\nbaud = True\nrate = 3\nname = nanny\n",
        &expect![[r#"
            config.toml:2:8: error[toml-syntax]: a text needs quotes
            config.toml:3:8: error[toml-syntax]: a text needs quotes (a bool is `true` or `false`)
            config.toml:4:8: error[out-of-range]: `rate` cannot be the number 3 (allowed is an integer of 32 bits, from 9600 to 1000000, in baud)
            config.toml:5:8: error[toml-syntax]: a text needs quotes
        "#]],
    );
}

#[test]
fn every_line_that_is_no_toml_is_reported_and_says_what_a_number_is() {
    check(
        "[parameters]\nport\nbaud : 3\nrate = 3x\nname = 1,5\ndevice = .5\nmode = \n",
        &expect![[r#"
            config.toml:2:5: error[toml-syntax]: key with no value, expected `=`
            config.toml:3:6: error[toml-syntax]: key with no value, expected `=`
            config.toml:4:8: error[toml-syntax]: this is not a number (a number has no unit here, and a text needs quotes)
            config.toml:5:9: error[toml-syntax]: this is not a number (the decimal point is `.`)
            config.toml:6:10: error[toml-syntax]: this is not a number (digits stand on both sides of the point)
            config.toml:7:8: error[toml-syntax]: expected a value
        "#]],
    );
    check(
        "[component]\nperiod = \"2m\"\n[middleware.dds]\nlease = \"3 sec\"\n[parameters]\ntimeout = \"1d\"\n",
        &expect![[r#"
            config.toml:2:10: error[wrong-type]: `component.period` cannot be the string "2m" (unknown unit; the units are us, ms, s, min and h; allowed is a duration such as "50ms", or a number of milliseconds)
            config.toml:4:9: error[wrong-type]: `middleware.dds.lease` cannot be the string "3 sec" (unknown unit; the units are us, ms, s, min and h; allowed is a duration of at least 100ms, at most a day)
            config.toml:5:1: error[missing-parameter]: `motors` must be set (allowed is a list of tables, 1 to 3 elements)
            config.toml:6:11: error[wrong-type]: `timeout` cannot be the string "1d" (unknown unit; the units are us, ms, s, min and h; allowed is a duration such as "50ms", or a number of milliseconds, from 1ms to 2s)
        "#]],
    );
}

#[test]
fn only_a_number_is_said_to_be_none() {
    check(
        "[parameters]\na = 3 b = 4\nc = 2026-13-01T00:00:00Z\nd = 25:61:00\ne = 10.0.0.2\nf = 10.0.0.2:7000\ng = 3e-2x\n",
        &expect![[r#"
            config.toml:2:9: error[toml-syntax]: unexpected key or value, expected newline, `#`
            config.toml:3:5: error[toml-syntax]: invalid date, expected month between 01 and 12
            config.toml:4:5: error[toml-syntax]: invalid time, expected hour between 00 and 23
            config.toml:5:9: error[toml-syntax]: this is not a number (a text, such as an address, needs quotes)
            config.toml:6:9: error[toml-syntax]: this is not a number (a text, such as an address, needs quotes)
            config.toml:7:9: error[toml-syntax]: this is not a number (a number has no unit here, and a text needs quotes)
        "#]],
    );
    check(
        "[component]\nperiod = '1e3'\n[middleware.dds]\nlease = '1e9s'\n",
        &expect![[r#"
            config.toml:1:1: error[missing-parameter]: `motors` must be set (allowed is a list of tables, 1 to 3 elements)
            config.toml:2:10: error[wrong-type]: `component.period` cannot be the string "1e3" (allowed is a duration such as "50ms", or a number of milliseconds)
            config.toml:4:9: error[out-of-range]: `middleware.dds.lease` cannot be the string "1e9s" (allowed is a duration of at least 100ms, at most a day)
        "#]],
    );
}

#[test]
fn characters_of_word_processors_are_named_by_their_code_points() {
    check(
        "[parameters]\nport = “fast”\nbaud\u{a0}= 3\n",
        &expect![[r#"
            config.toml:2:8: error[stray-character]: unexpected character U+201C (a typographic quote) (write `"`)
            config.toml:3:5: error[stray-character]: unexpected character U+00A0 (a no-break space) (delete it, or write a space)
        "#]],
    );
    check(
        "[parameters]\nport = \"“fast”\"\nrate = 3–4 # “\n",
        &expect![[r#"
            config.toml:2:1: error[unknown-parameter]: unknown parameter `port` (expected one of `device`, `rate`, `gain`, `mode`, `timeout`, `offsets`, `token`, `pin`, `verbose`, `log`, `motors`)
            config.toml:3:9: error[stray-character]: unexpected character U+2013 (a dash) (write `-`)
        "#]],
    );
}

#[test]
fn a_component_without_a_pdsl_file_has_no_parameters() {
    assert_eq!(
        rc_configuration::defaults(None),
        Ok(Configuration::default())
    );
    assert_eq!(
        rc_configuration::defaults(Some(&load(BUS))),
        Err(vec!["motors".to_owned()])
    );
    let model = load("ComponentParams C { a int 3; group g { b string; }; list l { c int; }; };");
    assert_eq!(
        rc_configuration::defaults(Some(&model)),
        Err(vec!["g.b".to_owned()])
    );
    let model = load("ComponentParams C { a int 3; list l { c int; }; };");
    assert_eq!(
        rc_configuration::defaults(Some(&model)).map(|c| c.parameters.int("a")),
        Ok(3)
    );
}

/// A rule about a list that has the wrong length says nothing new.
#[test]
fn arrays_of_every_type_are_read() {
    let model = load(
        r#"ComponentParams P {
            flags bool[] [true]; ints int[] [1]; longs long[] []; floats float[] [];
            pauses duration[] []; texts string[] []; paths path[] [];
        };"#,
    );
    let text = "[parameters]\nflags = [true, false]\nints = [-1, 2]\nlongs = [4294967296]\n\
                floats = [1, 2.5]\npauses = ['1ms', 2]\ntexts = ['a', 'b']\npaths = ['/a']\n";
    let (configuration, _, rendered) = read(text, Some(&model));
    assert_eq!(rendered, "");
    let values = &configuration.parameters;
    assert_eq!(values.bools("flags"), [true, false]);
    assert_eq!(values.ints("ints"), [-1, 2]);
    assert_eq!(values.ints("longs"), [1 << 32]);
    assert_eq!(values.floats("floats"), [1.0, 2.5]);
    assert_eq!(
        values.durations("pauses"),
        [1, 2].map(Duration::from_millis)
    );
    assert_eq!(values.texts("texts"), ["a", "b"]);
    assert_eq!(values.paths("paths"), [PathBuf::from("/a")]);
    let (configuration, _, _) = read("", Some(&model));
    assert_eq!(configuration.parameters.bools("flags"), [true]);
    assert_eq!(configuration.parameters.ints("ints"), [1]);
}

#[test]
fn only_a_duration_with_an_unknown_unit_is_said_to_have_one() {
    let found = |value: &str| {
        let text = format!("[parameters]\ntimeout = {value}\n");
        read(&text, Some(&load(BUS))).2
    };
    for value in ["'2m'", "'3 sec'", "'1.5hours'", "'2d' # no"] {
        assert!(found(value).contains("unknown unit"), "{value}");
    }
    for value in ["'2'", "'fast'", "''", "true", "'5s'"] {
        let found = found(value);
        assert!(found.contains("allowed is"), "{value}: {found}");
        assert!(!found.contains("unknown unit"), "{value}: {found}");
    }
    assert!(!found("'2s'").contains("timeout"));
}

/// Each line that is not TOML is left out, and all is read again: a hostile file has many.
#[test]
fn of_many_lines_that_are_no_toml_some_are_reported() {
    let text = |lines: usize| "a = é\n".repeat(lines);
    let errors = |lines: usize| read(&text(lines), None).1.iter().count();
    assert!(errors(20) >= 20);
    assert_eq!(errors(21), errors(500));
}

#[test]
fn an_argument_is_toml_or_a_text() {
    for (text, expected) in [
        ("1", json!(1)),
        ("1.5", json!(1.5)),
        ("true", json!(true)),
        ("[1, 2]", json!([1, 2])),
        ("'fast'", json!("fast")),
        ("fast", json!("fast")),
        ("/dev/tty", json!("/dev/tty")),
        ("20ms", json!("20ms")),
        ("", json!("")),
    ] {
        assert_eq!(rc_configuration::parse_argument(text), expected, "{text}");
    }
}

#[test]
fn a_list_of_the_wrong_length_breaks_no_rule() {
    let model = load(
        r#"ComponentParams P {
            offsets int[2:3] [1, 2];
            list motors 1:2 { id int 7; };
            require len(offsets) >= 2 "too few offsets";
            require len(motors) <= 2 "too many motors";
        };"#,
    );
    let found = |text: &str| read(text, Some(&model)).2;
    assert_eq!(found("[[parameters.motors]]"), "");
    let short = found("parameters.offsets = [1]\n[[parameters.motors]]");
    assert!(
        short.contains("wrong-length") && !short.contains("too few"),
        "{short}"
    );
    let long = found("[[parameters.motors]]\n[[parameters.motors]]\n[[parameters.motors]]");
    assert!(
        long.contains("wrong-length") && !long.contains("too many"),
        "{long}"
    );
}
