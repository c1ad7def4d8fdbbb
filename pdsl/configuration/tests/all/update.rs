//! Updates of configurations after a change of the `.pdsl` file.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_configuration::model::Parameters;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

pub(crate) const BUS: &str = r#"ComponentParams bus {
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

pub(crate) fn load(text: &str) -> Parameters {
    let mut sources = SourceMap::new();
    let source = sources.add("c.pdsl", text);
    let (model, found) = rc_pdsl::load(&mut sources, &MemoryLoader::default(), source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    model.expect("parameters")
}

/// The reported changes and the new text. Checks that the new text needs no further update.
pub(crate) fn updated(model: &Parameters, toml: &str) -> (Vec<String>, String) {
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

pub(crate) fn update(toml: &str, expected: &Expect) {
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

/// Such a table is left as it is: a key with dots in it has no place of its own.
#[test]
fn inline_tables_with_dotted_keys_are_left_to_the_user() {
    update(
        r#"[parameters]
device = "/dev/x"
rate = 9600
safe_distance = 0.5
serial = "A1"
log = { path = "/var", keep = 3 }
points = []
motors = [{ limits.low = 0.5, name = "left", id = 1 }, { name = "right", id = 2, limits.low = 0.5 }]
"#,
        &expect![[r#"
            leave `motors[0]` to you: its inline table spans several lines and differs from the .pdsl
            leave `motors[1]` to you: its inline table spans several lines and differs from the .pdsl
            -----
            [parameters]
            device = "/dev/x"
            rate = 9600
            safe_distance = 0.5
            serial = "A1"
            log = { path = "/var", keep = 3 }
            points = []
            motors = [{ limits.low = 0.5, name = "left", id = 1 }, { name = "right", id = 2, limits.low = 0.5 }]
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
fn valid_values_and_values_with_other_errors_stay() {
    let model = load(BUS);
    let template =
        rc_configuration::template("bus", std::time::Duration::from_millis(100), Some(&model));
    assert_eq!(updated(&model, &template), (Vec::new(), template));
    let wrong = "[parameters]\ndevice = 5\nrate = 1\nsafe_distance = \"x\"\nserial = 1\nlog = 3\nmotors = { x = 1 }\npoints = 4\n";
    assert_eq!(updated(&model, wrong), (Vec::new(), wrong.to_owned()));
}
