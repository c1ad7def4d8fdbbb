//! Parameters that a component no longer has, and those with a new name.

use super::update::{BUS, load, update, updated};
use expect_test::expect;
use rc_diagnostics::SourceMap;

#[test]
fn removed_parameters_become_comments() {
    update(
        r#"[parameters]
device = "/dev/x"
rate = 9600
old = [
    1,   # one
    2,
]
safe_distance = 0.7
serial = "A1"
older.a = 1
older.b = "x"

[parameters.oldest]
c = 1

[parameters.oldest.inner]
d = 1

# Logs.
[parameters.log]
path = "/var"
keep = 1

[[parameters.motors]]
name = "left"
id = 1
max = 1.0
acceleration = 4.0
limits = { low = 0.0, middle = 0.5, high = 1.0 }
"#,
        &expect![[r#"
            comment out `old`, which is not a parameter
            comment out `older`, which is not a parameter
            comment out `oldest`, which is not a parameter
            comment out `motors[0].acceleration`, which is not a parameter
            comment out `motors[0].limits.middle`, which is not a parameter
            add `points` = []
            -----
            [parameters]
            device = "/dev/x"
            rate = 9600
            # No longer a parameter (rcgen config --update):
            # old = [
            #     1,   # one
            #     2,
            # ]
            safe_distance = 0.7
            serial = "A1"
            # No longer a parameter (rcgen config --update):
            # older.a = 1
            # older.b = "x"

            # No longer a parameter (rcgen config --update):
            # [parameters.oldest]
            # c = 1

            # [parameters.oldest.inner]
            # d = 1

            # Logs.
            [parameters.log]
            path = "/var"
            keep = 1

            [[parameters.motors]]
            name = "left"
            id = 1
            max = 1.0
            # No longer a parameter (rcgen config --update):
            # acceleration = 4.0
            # No longer a parameter (rcgen config --update):
            # motors[0].limits.middle = 0.5
            limits = { low = 0.0, high = 1.0 }

            # Points to pass.
            # list, any number of elements
            # [[parameters.points]]
            #
            # # double
            # x = 0.0
        "#]],
    );
}

#[test]
fn a_value_moves_to_a_new_name_only_if_the_rename_is_certain() {
    update(
        r#"[parameters]
divice = "/dev/x"
rate = 9600
saef_distance = 0.7
Serial = "A1"

[parameters.logs]
path = "/var"
kept = 1

[[parameters.motor]]
name = "left"
id = 1
max = 1.0
[parameters.motor.limits]
low = 0.1
height = 2.0
[[parameters.motor]]
name = "right"
id = 2
min = 1.0
limits = { low = 0.1, High = 0.2 }
"#,
        &expect![[r#"
            leave `divice` to you: it is not a parameter; rename it if it is `device` ("/dev/ttyUSB0" by default) now, or remove it
            rename `saef_distance` to `safe_distance`
            rename `Serial` to `serial`
            leave `logs` to you: it is not a parameter; rename it if it is `log` or in it now, or remove it
            rename `motor` to `motors`
            leave `motors[0].limits.height` to you: it is not a parameter; rename it if it is `motors[0].limits.high` (1.0 by default) now, or remove it
            leave `motors[1].min` to you: it is not a parameter; rename it if it is `motors[1].max` (1.5 by default) now, or remove it
            rename `motors[1].limits.High` to `motors[1].limits.high`
            add `points` = []
            -----
            [parameters]
            divice = "/dev/x"
            rate = 9600
            safe_distance = 0.7
            serial = "A1"

            [parameters.logs]
            path = "/var"
            kept = 1

            [[parameters.motors]]
            name = "left"
            id = 1
            max = 1.0
            [parameters.motors.limits]
            low = 0.1
            height = 2.0
            [[parameters.motors]]
            name = "right"
            id = 2
            min = 1.0
            limits = { low = 0.1, high = 0.2 }

            # Points to pass.
            # list, any number of elements
            # [[parameters.points]]
            #
            # # double
            # x = 0.0
        "#]],
    );
}

/// A parameter that a renamed key has taken is not a candidate for another key.
#[test]
fn a_parameter_that_is_taken_is_offered_to_no_other_key() {
    let model =
        load("ComponentParams c { safe_distance double 0.5; max_speed double 300 0:1000; };");
    let (changes, _) = updated(&model, "[parameters]\nsaef_distance = 0.7\nspeed = 2.0\n");
    assert_eq!(
        changes,
        [
            "rename `saef_distance` to `safe_distance`",
            "leave `speed` to you: it is not a parameter; rename it if it is `max_speed` \
             (300.0 by default) now, or remove it",
        ]
    );
    let (changes, _) = updated(
        &model,
        "[parameters]\nmax_speed = 1\nsaef_distance = 0.7\ndistance = 2.0\n",
    );
    assert_eq!(
        changes,
        [
            "rename `saef_distance` to `safe_distance`",
            "comment out `distance`, which is not a parameter",
        ]
    );
}

#[test]
fn an_ambiguous_rename_is_left_to_the_user() {
    let model = load(
        "ComponentParams c { max_speed double 300 0:1000; name string \"\"; \
         group limits { low double 0; force double 5; }; list points { x double 0; }; \
         list joints { vmax double 1; vmin double 0; }; };",
    );
    let notes = |lines: &str| {
        let toml = format!("[parameters]\n{lines}");
        let (changes, text) = updated(&model, &toml);
        let mut sources = SourceMap::new();
        let source = sources.add("config.toml", text.as_str());
        let (_, found) = rc_configuration::check(&sources, source, Some(&model));
        assert!(found.has_errors(), "{text}");
        changes
    };
    let left = |from: &str, to: &str| {
        format!(
            "leave `{from}` to you: it is not a parameter; rename it if it is {to} now, or remove it"
        )
    };
    let rest = "max_speed = 5\nname = ''\n";
    let all = format!("{rest}joints = []\npoints = []\n");
    let limits = "limits = { low = 1, force = 2 }\n";
    let speed = "`max_speed` (300.0 by default)";
    for (lines, expected) in [
        // Renamed.
        (
            format!("speed = 20.0 # slow!\nname = ''\njoints = []\npoints = []\n{limits}"),
            vec![left("speed", speed)],
        ),
        // Moved into a group.
        (
            format!("force = 2.5\n{all}"),
            vec![left("force", "`limits` or in it")],
        ),
        // Moved into a group and a list.
        (
            format!("bounds = {{ low = 3 }}\n{all}"),
            vec![left("bounds", "`limits` or in it")],
        ),
        (
            format!("way = [{{ x = 3 }}]\njoints = []\n{rest}{limits}"),
            vec![left("way", "`points` ([] by default)")],
        ),
        // In an inline table.
        (
            format!(
                "joints = [{{ most = 3.0 }}, {{most='a', vmin=1}}]\npoints = []\n{rest}{limits}"
            ),
            vec![
                left(
                    "joints[0].most",
                    "`joints[0].vmax` (1.0 by default) or `joints[0].vmin` (0.0 by default)",
                ),
                "comment out `joints[1].most`, which is not a parameter".to_owned(),
                "add `joints[1].vmax` = 1.0".to_owned(),
            ],
        ),
        // Several of each kind.
        (
            format!("speed = 20.0\naccel = 3\nlabel = 'x'\njoints = []\npoints = []\n{limits}"),
            vec![
                left("speed", speed),
                left("accel", speed),
                left("label", "`name` (\"\" by default)"),
            ],
        ),
    ] {
        assert_eq!(notes(&lines), expected, "{lines}");
    }
    // A value that fits no new parameter becomes a comment.
    let (_, text) = updated(&model, "[parameters]\nspeed = 2000.0\nname = 'x'\n");
    assert!(
        text.contains("# speed = 2000.0") && text.contains("max_speed = 300.0"),
        "{text}"
    );
}

/// Lines of configurations, valid and invalid.
const LINES: [&str; 34] = [
    "[parameters]",
    "[parameters.log]",
    "[parameters.old]",
    "[parameters.old.inner]",
    "[[parameters.motors]]",
    "[[parameters.motors]]",
    "[parameters.motors.limits]",
    "[parameters.motors.limits.deep]",
    "[parameters.motors.worn]",
    "[[parameters.points]]",
    "[[parameters.gone]]",
    "[component]",
    "device = '/x' # here",
    "rate = 9600",
    "serial = \"A\"",
    "id = 1",
    "name = 'n'",
    "max = 2.5",
    "low = 0.1",
    "x = 1.5",
    "path = '/p'",
    "old = [\n  1, # one\n  2 ]",
    "text = '''\na\n[b]\n'''",
    "log.path = '/v'",
    "log.lost = 5",
    "log = { path = '/v', keep = 3, lost = 4 }",
    "motors = [\n  { id = 1, bad = 2 },\n  # two\n  { name = 'x', id = 3 } ]",
    "limits = { low = 1.0, more = 2.0 }",
    "limits.low = 1.0",
    "older.a.b = 1",
    "parameters.device = 'z'",
    "parameters.log.keep = 9",
    "# A comment.",
    "",
];

#[test]
fn every_line_stays_or_becomes_a_comment() {
    let model = load(BUS);
    let (mut updates, mut changes) = (0, 0);
    for n in 1..=800_u64 {
        arbtest::arbtest(|u| {
            let mut toml = String::new();
            for _ in 0..u.int_in_range(1..=14)? {
                toml.push_str(u.choose(&LINES)?);
                toml.push('\n');
            }
            let mut sources = SourceMap::new();
            let source = sources.add("config.toml", toml.as_str());
            if rc_configuration::update(&sources, source, Some(&model)).is_err() {
                return Ok(());
            }
            let (said, text) = updated(&model, &toml);
            updates += 1;
            changes += said.len();
            let source = sources.add("config.toml", text.as_str());
            let (_, found) = rc_configuration::check(&sources, source, Some(&model));
            // A key that may be a renamed parameter stays invalid until the user decides.
            let left = |d: &&rc_diagnostics::Diagnostic| {
                let path = d.message.strip_prefix("unknown parameter ");
                path.is_none_or(|path| {
                    let line = format!("leave {path} to you: it is not a parameter; ");
                    !said.iter().any(|change| change.starts_with(&line))
                })
            };
            let bad = ["toml-syntax", "unknown-parameter"];
            let bad = found.iter().filter(|d| bad.contains(&d.code)).find(left);
            assert!(bad.is_none(), "{bad:?}\n{toml}\n-----\n{text}");
            // Inline tables are printed again. Their numbers stay.
            for line in toml.lines().filter(|line| !line.contains('{')) {
                let kept = |now: &str| now == line || now.strip_prefix("# ") == Some(line);
                assert!(text.lines().any(kept), "{line}\n{toml}\n-----\n{text}");
            }
            let numbers = |text: &str| text.matches(|c: char| c.is_ascii_digit()).count();
            assert!(numbers(&text) >= numbers(&toml), "{toml}\n-----\n{text}");
            Ok(())
        })
        .seed(n << 32 | 256)
        .run();
    }
    assert!(updates > 200 && changes > 1000, "{updates} {changes}");
}
