//! Changes of parameters at run time, and saving them to the configuration file.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_configuration::LiveParameters;
use rc_configuration::model::Parameters;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use serde_json::{Value, json};
use std::path::Path;

const ARM: &str = r#"ComponentParams arm {
    /// How fast it moves.
    speed float 1.0 0:10 T unit "rad/s";
    limit float 5.0 0:20 T;
    name string "left" T;
    mode string slow {slow, fast} T;
    period duration 100ms 1ms:2s T;
    count int 3 0:9 T;
    serial long 1 T;
    verbose bool false T;
    gains double[2:4] [1, 2] 0:100 T;
    tags string[] [] T;
    device path "/dev/ttyUSB0" restart;
    top float 10 restart;
    token string "s3cret" secret T;
    pin int 1234 0:9999 secret T;
    fixed int 1;
    group log { level int 1 0:3 T; keep int 7; };
    list motors 1:3 {
        name string;
        min double 0 T;
        max double 1 T;
        require min < max "min must lie below max";
    };
    list spare { id int T; };
    require speed <= limit "it moves too fast";
    require limit <= top "the limit is above the top";
    require token != "open" "a token is needed";
};"#;

pub(crate) const FILE: &str = r#"# The arm.
[component]
period = "20ms"   # often

[parameters]
speed = 2.0       # rad/s
  # An odd place.
gains = [
    1.0,   # the first
    2.0,
]
mode = 'slow'
log.level = 2

[[parameters.motors]]  # left
name = "l"
max = 1.5 # far

[[parameters.motors]]
name = "r"
# The end.
"#;

pub(crate) fn load(text: &str) -> Parameters {
    let mut sources = SourceMap::new();
    let source = sources.add("arm.pdsl", text);
    let (model, found) = rc_pdsl::load(&mut sources, &MemoryLoader::default(), source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    model.expect("parameters")
}

pub(crate) fn live(text: &str) -> LiveParameters {
    of(load(ARM), text)
}

pub(crate) fn of(model: Parameters, text: &str) -> LiveParameters {
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", text);
    let (configuration, found) = rc_configuration::check(&sources, source, Some(&model));
    assert_eq!(render(&sources, &found, Format::Short), "");
    LiveParameters::new(model, &configuration.parameters)
}

/// All diagnostics about the changes.
fn try_all(
    live: &LiveParameters,
    changes: &[(&str, Value)],
) -> Result<rc_configuration::CheckedChanges, String> {
    let changes = changes.iter().map(|(path, value)| (*path, value));
    live.check(changes).map_err(|found| {
        let lines = found.iter().map(|d| {
            let help = d.help.as_deref().unwrap_or_default();
            format!("{}: {} ({help})\n", d.code, d.message)
        });
        lines.collect()
    })
}

fn refused(live: &LiveParameters, changes: &[(&str, Value)], expected: &Expect) {
    let lines = try_all(live, changes).err();
    expected.assert_eq(&lines.expect("a refusal"));
}

pub(crate) fn set(live: &mut LiveParameters, changes: &[(&str, Value)]) -> String {
    let accepted = try_all(live, changes).unwrap_or_else(|lines| panic!("{lines}"));
    let lines = accepted.changes.iter().map(|c| format!("{c}\n"));
    let later = accepted.pending.iter().map(|c| format!("{c}, later\n"));
    let lines: String = lines.chain(later).collect();
    live.apply(accepted);
    lines
}

pub(crate) fn value(live: &LiveParameters, path: &str) -> Value {
    let listed = live.list(&[path]).expect("a parameter");
    assert_eq!(listed.len(), 1, "{listed:?}");
    listed[0].value.clone()
}

#[test]
fn values_of_every_type_are_accepted() {
    let mut live = live(FILE);
    let changed = set(
        &mut live,
        &[
            ("speed", json!(3)),
            ("name", json!("right")),
            ("mode", json!("fast")),
            ("period", json!("200ms")),
            ("count", json!(4)),
            ("serial", json!(9_007_199_254_740_993_i64)),
            ("verbose", json!(true)),
            ("gains", json!([1, 2.5, 3])),
            ("tags", json!(["a"])),
            ("log.level", json!(3)),
            ("motors[1].max", json!(1.2)),
            ("token", json!("other")),
            // The parameter has this value already.
            ("limit", json!(5)),
        ],
    );
    expect![[r#"
        speed: 2.0 -> 3.0
        name: "left" -> "right"
        mode: "slow" -> "fast"
        period: "100ms" -> "200ms"
        count: 3 -> 4
        serial: 1 -> 9007199254740993
        verbose: false -> true
        gains: [1.0, 2.0] -> [1.0, 2.5, 3.0]
        tags: [] -> ["a"]
        log.level: 2 -> 3
        motors[1].max: 1.0 -> 1.2
        token: *** -> ***
    "#]]
    .assert_eq(&changed);
    let values = live.values();
    assert_eq!(
        (values.float("speed"), values.text("token")),
        (3.0, "other".to_owned())
    );
    assert_eq!(values.list("motors")[1].float("max"), 1.2);
    assert_eq!(values.duration("period").as_millis(), 200);
    // A path may also name an element of an array.
    assert_eq!(
        set(&mut live, &[("gains[2]", json!(9))]),
        "gains[2]: 3.0 -> 9.0\n"
    );
    assert_eq!(value(&live, "gains"), json!([1.0, 2.5, 9.0]));
    assert_eq!(value(&live, "gains[2]"), json!(9.0));
    // A duration may also be a number of milliseconds.
    assert_eq!(
        set(&mut live, &[("period", json!(50))]),
        "period: \"200ms\" -> \"50ms\"\n"
    );
}

#[test]
fn all_errors_are_reported_together_and_no_change_is_applied() {
    let live = live(FILE);
    refused(
        &live,
        &[
            ("sped", json!(1)),
            ("speed", json!(99)),
            ("name", json!(5)),
            ("mode", json!("fasst")),
            ("period", json!("soon")),
            ("count", json!(null)),
            ("verbose", json!({})),
            ("gains", json!([1])),
            ("gains[0]", json!(-1)),
            ("tags", json!(["a", 1])),
            ("fixed", json!(2)),
            ("log", json!(2)),
            ("log.levl", json!(2)),
            ("motors.max", json!(2)),
            ("motors[0]", json!({})),
            ("motors[7].max", json!(2)),
            ("motors[0].max.x", json!(2)),
            ("speed[0]", json!(2)),
            ("spare[0].id", json!(2)),
            ("motors[x].max", json!(2)),
            ("", json!(2)),
            ("pin", json!(123_456)),
            ("token", json!(["hush"])),
            ("limit", json!(6)),
        ],
        &expect![[r#"
            unknown-parameter: unknown parameter `sped` (did you mean `speed`?)
            out-of-range: `speed` cannot be the number 99 (allowed is a number of 32 bits, from 0 to 10, in rad/s)
            wrong-type: `name` cannot be the number 5 (allowed is a string)
            invalid-choice: `mode` cannot be the string "fasst" (allowed is a string, one of "slow", "fast"; did you mean `fast`?)
            wrong-type: `period` cannot be the string "soon" (allowed is a duration such as "50ms", or a number of milliseconds, from 1ms to 2s)
            wrong-type: `count` cannot be null (allowed is an integer of 32 bits, from 0 to 9)
            wrong-type: `verbose` cannot be a table (allowed is `true` or `false`)
            wrong-length: `gains` has length 1 (allowed are 2 to 4 elements)
            out-of-range: `gains[0]` cannot be the number -1 (allowed is a number of 64 bits, from 0 to 100)
            repeated-change: `gains[0]` is changed twice (give each parameter one value)
            wrong-type: `tags[1]` cannot be the number 1 (allowed is a string)
            fixed-parameter: `fixed` is fixed when the component starts (change it in the configuration file and restart the component, or mark it `T` or `restart` in the .pdsl of `arm` and generate again)
            wrong-type: `log` cannot be changed as a whole (name a parameter in it, as in `log.level`)
            unknown-parameter: unknown parameter `log.levl` (did you mean `level`?)
            unknown-parameter: `motors` is a list (name one of its elements: `motors[0]`)
            wrong-type: `motors[0]` cannot be changed as a whole (name a parameter in it, as in `motors[0].name`)
            unknown-parameter: there is no `motors[7]` (allowed are `motors[0]` to `motors[1]`)
            unknown-parameter: `motors[0].max` has no parts (it is a number of 64 bits)
            unknown-parameter: `speed` has no elements (it is a number of 32 bits, from 0 to 10, in rad/s)
            unknown-parameter: there is no `spare[0]` (`spare` is empty)
            unknown-parameter: `motors[x].max` is not the path of a parameter (a path looks like `safe_distance` or `motors[2].max`)
            unknown-parameter: `` is not the path of a parameter (a path looks like `safe_distance` or `motors[2].max`)
            out-of-range: `pin` cannot be this number (allowed is an integer of 32 bits, from 0 to 9999)
            wrong-type: `token` cannot be an array (allowed is a string)
        "#]],
    );
    assert_eq!(value(&live, "limit"), json!(5.0));
}

#[test]
fn a_list_or_an_element_of_one_is_not_changed_as_a_whole() {
    let live = live(FILE);
    let help = |path: &str, within: &str| {
        let lines = try_all(&live, &[(path, json!(1))]).err();
        let lines = lines.expect(path);
        let expected = format!(
            "wrong-type: `{path}` cannot be changed as a whole (name a parameter in it, as in `{within}`)\n"
        );
        assert_eq!(lines, expected);
    };
    help("motors", "motors[0].name");
    help("motors[1]", "motors[1].name");
    help("log", "log.level");
}

#[test]
fn rules_are_checked_after_all_changes_of_a_request() {
    let mut live = live(FILE);
    refused(
        &live,
        &[("speed", json!(6))],
        &expect![[r#"
        rule-broken: `speed` breaks a rule: it moves too fast (`speed <= limit` does not hold: `speed` is 6.0, `limit` is 5.0)
    "#]],
    );
    refused(
        &live,
        &[("limit", json!(1)), ("motors[0].min", json!(1.5))],
        &expect![[r#"
            rule-broken: `motors[0].min` breaks a rule: min must lie below max (`min < max` does not hold: `motors[0].min` is 1.5, `motors[0].max` is 1.5)
            rule-broken: `limit` breaks a rule: it moves too fast (`speed <= limit` does not hold: `speed` is 2.0, `limit` is 1.0)
        "#]],
    );
    refused(
        &live,
        &[("token", json!("open"))],
        &expect![[r#"
        rule-broken: `token` breaks a rule: a token is needed (`token != "open"` does not hold: `token` is secret)
    "#]],
    );
    set(&mut live, &[("speed", json!(6)), ("limit", json!(7))]);
    refused(
        &live,
        &[("gains", json!([1, 2])), ("gains[0]", json!(3))],
        &expect![[r#"
            repeated-change: `gains[0]` is changed twice (give each parameter one value)
        "#]],
    );
}

#[test]
fn broken_rules_are_reported_with_the_other_errors() {
    // The rules about `speed` and `motors[1]` are not checked, because these values are invalid.
    refused(
        &live(FILE),
        &[
            ("speed", json!(9999)),
            ("limit", json!(1)),
            ("motors[0].min", json!(3)),
            ("motors[1].min", json!("x")),
            ("motors[1].max", json!(-3)),
        ],
        &expect![[r#"
            out-of-range: `speed` cannot be the number 9999 (allowed is a number of 32 bits, from 0 to 10, in rad/s)
            wrong-type: `motors[1].min` cannot be the string "x" (allowed is a number of 64 bits)
            rule-broken: `motors[0].min` breaks a rule: min must lie below max (`min < max` does not hold: `motors[0].min` is 3.0, `motors[0].max` is 1.5)
        "#]],
    );
    refused(
        &live(FILE),
        &[("sped", json!(1)), ("speed", json!(6)), ("fixed", json!(2))],
        &expect![[r#"
            unknown-parameter: unknown parameter `sped` (did you mean `speed`?)
            fixed-parameter: `fixed` is fixed when the component starts (change it in the configuration file and restart the component, or mark it `T` or `restart` in the .pdsl of `arm` and generate again)
            rule-broken: `speed` breaks a rule: it moves too fast (`speed <= limit` does not hold: `speed` is 6.0, `limit` is 5.0)
        "#]],
    );
}

#[test]
fn restart_parameters_are_pending_and_checked_against_running_and_next_values() {
    let mut live = live(FILE);
    // A larger `top` is not in effect yet.
    assert_eq!(
        set(&mut live, &[("top", json!(15))]),
        "top: 10.0 -> 15.0, later\n"
    );
    refused(
        &live,
        &[("limit", json!(12))],
        &expect![[r#"
        rule-broken: `limit` breaks a rule: the limit is above the top (`limit <= top` does not hold: `limit` is 12.0, `top` is 10.0)
    "#]],
    );
    // A smaller `top` would be in effect at the next start.
    refused(
        &live,
        &[("top", json!(4))],
        &expect![[r#"
        rule-broken: `top` breaks a rule: the limit is above the top (`limit <= top` does not hold: `limit` is 5.0, `top` is 4.0, at the next start)
    "#]],
    );
    let listed = &live.list(&["top"]).expect("the parameter")[0];
    assert_eq!(
        (&listed.value, &listed.pending),
        (&json!(10.0), &Some(json!(15.0)))
    );
    assert_eq!(live.values().float("top"), 10.0);
    set(&mut live, &[("top", json!(10))]);
    assert_eq!(live.list(&["top"]).expect("the parameter")[0].pending, None);
    assert!(live.unsaved().is_empty());
}

#[test]
fn the_list_contains_the_allowed_values() {
    let live = live(FILE);
    let all = live.list(&[]).expect("all");
    let paths: Vec<&str> = all.iter().map(|p| p.path.as_str()).collect();
    assert_eq!(paths.len(), 23, "{paths:?}");
    let some = live.list(&["log", "motors[1]", "token"]).expect("some");
    let lines: String = some
        .iter()
        .map(|p| serde_json::to_string(p).expect("JSON") + "\n")
        .collect();
    expect![[r#"
        {"path":"log.level","value":2,"default":1,"allowed":"int, from 0 to 3","editable":true,"restart":false,"secret":false}
        {"path":"log.keep","value":7,"default":7,"allowed":"int","editable":false,"restart":false,"secret":false}
        {"path":"motors[1].name","value":"r","allowed":"string","editable":false,"restart":false,"secret":false}
        {"path":"motors[1].min","value":0.0,"default":0.0,"allowed":"double","editable":true,"restart":false,"secret":false}
        {"path":"motors[1].max","value":1.0,"default":1.0,"allowed":"double","editable":true,"restart":false,"secret":false}
        {"path":"token","value":"***","default":"***","allowed":"string","editable":true,"restart":false,"secret":true}
    "#]].assert_eq(&lines);
    assert!(live.list(&["spare"]).expect("nothing is in it").is_empty());
    let unknown = live
        .list(&["log.levl", "moters"])
        .expect_err("two mistakes");
    assert_eq!(unknown.iter().count(), 2);
    // JSON has no such numbers.
    let mut live = live;
    set(&mut live, &[("motors[0].max", json!("inf"))]);
    assert_eq!(value(&live, "motors[0].max"), json!("inf"));
}

#[test]
fn nan_and_infinities_are_values() {
    let model = load(
        "ComponentParams C { x double 1 T; y float 1 restart; z double[] [] T; speed double 1 T; };",
    );
    let file = "[parameters]\nx = nan\ny = -nan\nz = [nan, inf]\n";
    let mut live = of(model, file);
    let said = set(
        &mut live,
        &[
            ("speed", json!(5)),
            ("x", json!("nan")),
            ("y", json!("nan")),
            ("z", json!(["nan", "inf"])),
        ],
    );
    assert_eq!(said, "speed: 1.0 -> 5.0\n");
    assert!(
        live.list(&[])
            .expect("all")
            .iter()
            .all(|p| p.pending.is_none())
    );
    let save = |live: &LiveParameters, text: &str| {
        live.save(Path::new("config.toml"), text).expect("saved")
    };
    let saved = save(&live, file);
    assert_eq!(saved, format!("{file}speed = 5.0\n"));
    live.saved();
    set(&mut live, &[("x", json!("-inf")), ("z[1]", json!("nan"))]);
    let saved = save(&live, &saved);
    assert_eq!(
        saved,
        "[parameters]\nx = -inf\ny = -nan\nz = [nan, nan]\nspeed = 5.0\n"
    );
    live.saved();
    set(&mut live, &[("x", json!("nan"))]);
    assert!(save(&live, &saved).contains("x = nan\n"));
}
