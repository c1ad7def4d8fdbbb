//! Updates of configurations after a change of the `.pdsl` file.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_configuration::model::Parameters;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

const BUS: &str = r#"ComponentParams bus {
    /// The serial port.
    device path "/dev/ttyUSB0";
    rate int 115200 9600:1000000 unit "baud" T;
    safe_distance double 0.5 unit "m";
    serial string;
    /// Where it logs.
    group log { path path "/tmp"; keep long 7; };
    /// The motors on the bus.
    list motors 1:3 {
        name string; id int 0:127; max float 1.5;
        group limits { low double 0.0; high double 1.0; };
    };
    /// Points to pass.
    list points { x double 0.0; };
};"#;

fn load(text: &str) -> Parameters {
    let mut sources = SourceMap::new();
    let source = sources.add("c.pdsl", text);
    let (model, found) = rc_pdsl::load(&mut sources, &MemoryLoader::default(), source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    model.expect("parameters")
}

/// The reported changes and the new text. Checks that the new text needs no further update.
fn updated(model: &Parameters, toml: &str) -> (Vec<String>, String) {
    let once = |toml: &str| {
        let mut sources = SourceMap::new();
        let source = sources.add("config.toml", toml);
        let update = rc_configuration::update(&sources, source, Some(model)).expect("TOML");
        let changes = update.changes.iter().map(ToString::to_string);
        (changes.collect::<Vec<_>>(), update.text)
    };
    let (changes, text) = once(toml);
    let (again, same) = once(&text);
    let by_hand = |change: &String| change.contains("to you");
    assert!(
        again.iter().all(by_hand),
        "{again:?}\n{toml}\n-----\n{text}"
    );
    assert_eq!(same, text);
    (changes, text)
}

fn update(toml: &str, expected: &Expect) {
    let (changes, text) = updated(&load(BUS), toml);
    expected.assert_eq(&format!("{}\n-----\n{text}", changes.join("\n")));
}

#[test]
fn new_parameters_are_added_in_order_with_their_comments() {
    update(
        r#"# My robot.
[component]
period = "20ms"

[parameters]
device = "/dev/x"   # the left one
safe_distance = 0.7

# This one is loose.
[[parameters.motors]]
name = "left"
id = 1

[[parameters.motors]]
name = "right"
id = 2
max = 3.5 # strong
[parameters.motors.limits]
low = 0.25
"#,
        &expect![[r#"
            add `rate` = 115200
            add `serial`, which must be set
            add `log.path` = "/tmp"
            add `log.keep` = 7
            add `motors[0].max` = 1.5
            add `motors[0].limits.low` = 0.0
            add `motors[0].limits.high` = 1.0
            add `motors[1].limits.high` = 1.0
            add `points` = []
            -----
            # My robot.
            [component]
            period = "20ms"

            [parameters]
            device = "/dev/x"   # the left one

            # int, from 9600 to 1000000, in baud; may be changed while the component runs
            rate = 115200

            safe_distance = 0.7

            # string
            # serial =     # must be set

            # Where it logs.
            [parameters.log]

            # path
            path = "/tmp"

            # long
            keep = 7

            # This one is loose.
            [[parameters.motors]]
            name = "left"
            id = 1

            # float
            max = 1.5

            [parameters.motors.limits]

            # double
            low = 0.0

            # double
            high = 1.0

            [[parameters.motors]]
            name = "right"
            id = 2
            max = 3.5 # strong
            [parameters.motors.limits]
            low = 0.25

            # double
            high = 1.0

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

#[test]
fn dotted_keys_and_inline_tables_are_updated() {
    update(
        r#"parameters.device = "/dev/x"
parameters.log.path = "/var" # here
parameters.motors = [
    # The left one.
    { name = "left", id = 1 },
    { name = "right", id = 2, max = 2.0, min = 0.1, limits = { high = 3.0 } },
]
"#,
        &expect![[r#"
            add `rate` = 115200
            add `safe_distance` = 0.5
            add `serial`, which must be set
            add `log.keep` = 7
            add `motors[0].max` = 1.5
            comment out `motors[1].min`, which is not a parameter
            add `motors[1].limits.low` = 0.0
            add `points` = []
            -----
            parameters.device = "/dev/x"

            # int, from 9600 to 1000000, in baud; may be changed while the component runs
            parameters.rate = 115200

            # double, in m
            parameters.safe_distance = 0.5

            # string
            # parameters.serial =     # must be set

            parameters.log.path = "/var" # here

            # long
            parameters.log.keep = 7

            parameters.motors = [
                # The left one.
                { name = "left", id = 1, max = 1.5 },
            # No longer a parameter (rcgen config --update):
            # motors[1].min = 0.1
                { name = "right", id = 2, max = 2.0, limits = { low = 0.0, high = 3.0 } },
            ]

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
fn tables_without_values_are_updated() {
    update(
        "[parameters.log]\npath = \"/var\"\n",
        &expect![[r#"
        add `device` = "/dev/ttyUSB0"
        add `rate` = 115200
        add `safe_distance` = 0.5
        add `serial`, which must be set
        add `log.keep` = 7
        add `motors`, which must be set
        add `points` = []
        -----
        [parameters]

        # The serial port.
        # path
        device = "/dev/ttyUSB0"

        # int, from 9600 to 1000000, in baud; may be changed while the component runs
        rate = 115200

        # double, in m
        safe_distance = 0.5

        # string
        # serial =     # must be set

        [parameters.log]
        path = "/var"

        # long
        keep = 7

        # The motors on the bus.
        # list, 1 to 3 elements
        [[parameters.motors]]

        # string
        # name =     # must be set

        # int, from 0 to 127
        # id =     # must be set

        # float
        max = 1.5

        [parameters.motors.limits]

        # double
        low = 0.0

        # double
        high = 1.0

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
fn comments_at_the_head_of_the_file_stay_there() {
    let model = load("ComponentParams c { a int 1; list l { x int 2; }; };");
    let (_, text) = updated(
        &model,
        "#:schema x.json\n# Mine.\n[[parameters.l]]\nx = 1\n",
    );
    expect![[r#"
        #:schema x.json
        # Mine.

        [parameters]

        # int
        a = 1

        [[parameters.l]]
        x = 1
    "#]]
    .assert_eq(&text);
    let (_, text) = updated(
        &model,
        "#:schema x.json\n\n# Left.\n[[parameters.l]]\nx = 1\n",
    );
    expect![[r#"
        #:schema x.json

        [parameters]

        # int
        a = 1

        # Left.
        [[parameters.l]]
        x = 1
    "#]]
    .assert_eq(&text);
}

#[test]
fn files_and_components_without_parameters() {
    update(
        "[component]\nlog = \"warn\"",
        &expect![[r#"
        add `device` = "/dev/ttyUSB0"
        add `rate` = 115200
        add `safe_distance` = 0.5
        add `serial`, which must be set
        add `log.path` = "/tmp"
        add `log.keep` = 7
        add `motors`, which must be set
        add `points` = []
        -----
        [component]
        log = "warn"

        [parameters]

        # The serial port.
        # path
        device = "/dev/ttyUSB0"

        # int, from 9600 to 1000000, in baud; may be changed while the component runs
        rate = 115200

        # double, in m
        safe_distance = 0.5

        # string
        # serial =     # must be set

        # Where it logs.
        [parameters.log]

        # path
        path = "/tmp"

        # long
        keep = 7

        # The motors on the bus.
        # list, 1 to 3 elements
        [[parameters.motors]]

        # string
        # name =     # must be set

        # int, from 0 to 127
        # id =     # must be set

        # float
        max = 1.5

        [parameters.motors.limits]

        # double
        low = 0.0

        # double
        high = 1.0

        # Points to pass.
        # list, any number of elements
        # [[parameters.points]]
        #
        # # double
        # x = 0.0
    "#]],
    );
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", "[parameters]\nx = 1\n");
    let update = rc_configuration::update(&sources, source, None).expect("TOML");
    assert_eq!(
        update.text,
        "[parameters]\n# No longer a parameter (rcgen config --update):\n# x = 1\n"
    );
    let source = sources.add("config.toml", "x = = 1");
    let found = rc_configuration::update(&sources, source, None).expect_err("no TOML");
    assert!(found.iter().any(|d| d.code == "toml-syntax"));
}

#[test]
fn line_ends_and_multi_line_inline_tables_are_kept() {
    let model = load("ComponentParams c { a int 1; b int 2; };");
    let (_, text) = updated(&model, "[parameters]\r\na = 3\r\nc = 4\r\n");
    assert_eq!(text.matches('\n').count(), text.matches("\r\n").count());
    let (changes, text) = updated(&model, "parameters = { a = 1,\n  c = 4 }\n");
    expect!["leave `c` to you: it is not a parameter; rename it if it is `b` (2 by default) now, or remove it"]
        .assert_eq(&changes.join("\n"));
    assert_eq!(text, "parameters = { a = 1,\n  c = 4 }\n");
    let (changes, text) = updated(&model, "parameters = { a = 1,\n  c = 'x' }\n");
    assert!(
        changes[0].starts_with("leave `` to you: its inline table"),
        "{changes:?}"
    );
    assert_eq!(text, "parameters = { a = 1,\n  c = 'x' }\n");
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

#[test]
fn valid_values_and_values_with_other_errors_stay() {
    let model = load(BUS);
    let template =
        rc_configuration::template("bus", std::time::Duration::from_millis(100), Some(&model));
    assert_eq!(updated(&model, &template), (Vec::new(), template));
    let wrong = "[parameters]\ndevice = 5\nrate = 1\nsafe_distance = \"x\"\nserial = 1\nlog = 3\nmotors = { x = 1 }\npoints = 4\n";
    assert_eq!(updated(&model, wrong), (Vec::new(), wrong.to_owned()));
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
            // Inline tables are printed anew. Their numbers stay.
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
