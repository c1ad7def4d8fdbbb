//! The template of a configuration, its schema, and secrets in diagnostics.
#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::check::{BUS, PERIOD, load, read};
use expect_test::expect;
use rc_configuration::json_text;
use rc_configuration::model::Parameters;
use rc_diagnostics::{Format, SourceMap, render};
use std::time::Duration;

#[test]
fn the_template_is_a_valid_configuration() {
    expect![[r##"
        #:schema ../generated/config.schema.json
        # The configuration of MotorBus. It was written once and is yours to change.

        # [component]
        # period = "100ms"      # how often it computes
        # log = "info"          # error, warn, info, debug or trace

        [parameters]

        # The serial port.
        # path; a change takes effect at the next start
        device = "/dev/ttyUSB0"

        # int, from 9600 to 1000000, in baud; may be changed while the component runs
        rate = 115200

        # float, from 0 to 10; may be changed while the component runs
        gain = 1.0

        # string, one of "slow", "fast"
        mode = "fast"

        # duration, from 1ms to 2s
        timeout = "50ms"

        # double[], 2 to 3 elements, from -1 to 1
        offsets = [0.0, 0.5]

        # string; secret
        token = "s3cret"

        # int, from 0 to 9999; secret
        pin = 1234

        # bool
        verbose = false

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

        # string[], any number of elements
        tags = []
    "##]]
    .assert_eq(&rc_configuration::template(
        "MotorBus",
        PERIOD,
        Some(&load(BUS)),
    ));
    expect![[r##"
        #:schema ../generated/config.schema.json
        # The configuration of Plain. It was written once and is yours to change.

        # [component]
        # period = "100ms"      # how often it computes
        # log = "info"          # error, warn, info, debug or trace
    "##]]
    .assert_eq(&rc_configuration::template("Plain", PERIOD, None));
}

#[test]
fn the_template_contains_the_defaults() {
    let model = load(
        r#"ComponentParams C {
            a int -3; b long 9007199254740993; c float 0.1; d double 1e300; e string "a\"b\\c\nd";
            f duration 1.5ms; g path "x y"; h bool[] [true, false]; i duration[] [1s, 3us]; j double 2 0: unit "1/s";
            group k { l int 1; list m 2:2 { n string "x"; group o { p int 1; }; }; q int 5; };
            list r 1:3 { s int 1; list t 0:5 { u int; }; };
            list v { w int; group x { y int 1; }; };
            z int 1;
        };"#,
    );
    let text = rc_configuration::template("C", PERIOD, Some(&model));
    let (configuration, _, rendered) = read(&text, Some(&model));
    assert_eq!(rendered, "", "{text}");
    let values = &configuration.parameters;
    assert_eq!(
        (values.text("e"), values.int("b"), values.float("d")),
        ("a\"b\\c\nd".to_owned(), 9_007_199_254_740_993, 1e300)
    );
    assert_eq!(
        values.durations("i"),
        [Duration::from_secs(1), Duration::from_micros(3)]
    );
    assert_eq!(
        (
            values.group("k").list("m").len(),
            values.list("r").len(),
            values.list("v").len()
        ),
        (2, 1, 0)
    );
    // The commented lines are valid TOML, too.
    let uncommented = text
        .replace("# [component]", "[component]")
        .replace("# period", "period")
        .replace("# log", "log");
    let (configuration, _, rendered) = read(&uncommented, Some(&model));
    assert_eq!(
        (rendered.as_str(), configuration.log.as_deref()),
        ("", Some("info"))
    );
}

#[test]
fn no_diagnostic_quotes_a_secret() {
    let text = "[parameters]\npin = 12345678\ntoken = [\"hush \u{e4}\",\n  \"h2\"]\nlog = { keep = true }\n\n[[parameters.motors]]\nname = \"m\"\nid = 1\n";
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", text);
    let (_, found) = rc_configuration::check(&sources, source, Some(&load(BUS)));
    expect![[r#"
        error[out-of-range]: `pin` cannot be this number
         --> config.toml:2:7
          |
        2 | pin = ********
          |       ^^^^^^^^
          |
          = help: allowed is an integer of 32 bits, from 0 to 9999
        error[wrong-type]: `token` cannot be an array
         --> config.toml:3:9
          |
        3 |   token = ***********
          |  _________^
        4 | | *******
          | |_______^
          |
          = help: allowed is a string
        error[wrong-type]: `log.keep` cannot be `true`
         --> config.toml:5:16
          |
        5 | log = { keep = true }
          |                ^^^^
          |
          = help: allowed is an integer of 64 bits
    "#]]
    .assert_eq(&render(&sources, &found, Format::Human));
}

/// All diagnostics, with the quoted lines of the text. None of them may contain a secret.
fn shown(text: &str, model: Option<&Parameters>) -> String {
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", text);
    let (_, found) = rc_configuration::check(&sources, source, model);
    assert!(!found.is_empty(), "{text}");
    [Format::Human, Format::Short, Format::Json]
        .map(|format| render(&sources, &found, format))
        .concat()
}

#[test]
fn no_diagnostic_quotes_a_misplaced_secret() {
    let model = load(
        "ComponentParams C { token string \"\" secret; speed double 1; group link { port int 1; \
         passwd string \"\" secret; }; list users { name string; key string secret; }; };",
    );
    for text in [
        // Under another key.
        "[parameters]\ntokn = \"hunter2\"\n",
        "[parameters]\nTOKEN = ['hunter2']\n",
        "[parameters]\nlink.passwrd = \"hunter2\"\n",
        "[parameters]\nlink = { port = true, passwrd = \"hunter2\" }\n",
        "parameters = { lnk = { passwd = \"hunter2\" } }\n",
        "[parameters]\nusers = [{ name = \"a\", ky = \"hunter2\" }]\n",
        "token = \"hunter2\"\n",
        "[component]\ntoken = \"hunter2\"\n",
        "paramters = { token = \"hunter2\" }\n",
        "paramters.token = \"hunter2\"\n",
        // With a value of another type.
        "[parameters]\ntoken.x = \"hunter2\"\n",
        "[parameters]\nlink = \"hunter2\"\n",
        "[parameters]\nusers = [\"hunter2\"]\n",
        "[parameters]\nspeed = { token = \"hunter2\" }\n",
        "parameters = \"hunter2\"\n",
        "[bindings]\ntoken = [\"hunter2\"]\n",
        "[middleware]\ntoken = \"hunter2\"\n",
        // In a text that is not TOML.
        "[parameters]\ntoken = \"\"\"\nhunter2 = 1\n",
        "[parameters]\nspeed = \"\"\"a\"\"\"\ntoken = \"\"\"\nhunter2 = 1\n",
        "[parameters]\ntoken = \'\'\'\nhunter2 = 1\n",
        "[parameters]\ntoken = hunter2\n",
        "[parameters]\ntoken = \"hunter2\n",
        "[parameters]\ntoken = 'hunter2'\ntoken = 'hunter2'\n",
        "[parameters]\ntoken = 'a'\nlink = { passwd = 'hunter2', passwd = 'hunter2' }\n",
        "[parameters]\ntoken = \"\"\"\nhunter2==\n",
        "[parameters]\ntoken = [\n  hunter2\n]\n",
        "[parameters]\ntoken \"hunter2\"\n",
        "[parameters]\n\"hunter2\n",
        "[parameters]\ntoken = \"a\" hunter2",
        "[parameters]\ntoken = \"hunter2\\q\"",
        "[parameters]\ntoken = 1hunter2",
    ] {
        let said = shown(text, Some(&model));
        assert!(!said.contains("hunter2"), "{text}\n{said}");
        // Without a model, no parameter is known to be secret.
        let said = shown(text, None);
        assert!(!said.contains("hunter2"), "{text}\n{said}");
    }
    expect![[r#"
        error[toml-syntax]: a text needs quotes
         --> config.toml:3:9
          |
        3 | token = *******
          |         ^^^^^^^
        config.toml:3:9: error[toml-syntax]: a text needs quotes
        {"code":"toml-syntax","end":{"column":16,"line":3},"file":"config.toml","help":null,"labels":[],"mend":null,"message":"a text needs quotes","severity":"error","start":{"column":9,"line":3}}
    "#]].assert_eq(&shown("[parameters]\nspeed = 1\ntoken = hunter2\n", Some(&model)));
    // Values that no declaration marks as secret are shown.
    let model = load("ComponentParams C { speed double 1; };");
    for text in [
        "[parameters]\nsped = 20.5\n",
        "[parameters]\nspeed = 20.5m\n",
    ] {
        assert!(shown(text, Some(&model)).contains("20.5"), "{text}");
    }
}

/// An editor completes the settings of middlewares, and choices as they are written; a duration has
/// many spellings, so its choices are not listed.
#[test]
fn a_schema_lists_settings_and_choices() {
    let model = load(
        "ComponentParams P { mode string fast {slow, fast}; pause duration 10ms {10ms, 20ms}; \
         tags string[] []; pair int[2:2] [1, 2]; few int[0:3] []; };",
    );
    let schema = rc_configuration::schema("C", PERIOD, &[], Some(&model));
    let schema: serde_json::Value = serde_json::from_str(&schema).expect("JSON");
    let middlewares = &schema["properties"]["middleware"]["properties"];
    let domain = &middlewares["dds"]["properties"]["domain"];
    assert!(domain["description"].is_string(), "{middlewares}");
    assert_eq!(
        middlewares["ros2"]["properties"]["rosout"]["type"], "boolean",
        "{middlewares}"
    );
    let parameters = &schema["properties"]["parameters"]["properties"];
    let choices = serde_json::json!(["slow", "fast"]);
    assert_eq!(parameters["mode"]["enum"], choices, "{parameters}");
    let lengths = |name: &str| {
        let array = &parameters[name];
        [array.get("minItems"), array.get("maxItems")]
            .map(|limit| limit.and_then(serde_json::Value::as_u64))
    };
    assert_eq!(lengths("tags"), [None, None]);
    assert_eq!(lengths("pair"), [Some(2), Some(2)]);
    assert_eq!(lengths("few"), [None, Some(3)]);
    let pause = &parameters["pause"];
    assert!(pause.is_object() && pause.get("enum").is_none(), "{pause}");
}

/// A value of few tables in one another stands on one line, however long; a deeper one does not.
#[test]
fn deep_json_stands_on_several_lines() {
    let word = "w".repeat(150);
    let flat = serde_json::json!({ "a": { "b": [&word] } });
    assert_eq!(
        json_text(&flat, 9),
        format!("{{\"a\":{{\"b\":[\"{word}\"]}}}}\n")
    );
    let lists = serde_json::json!([[[[&word]]]]);
    assert_eq!(json_text(&lists, 9), format!("[\n  [[[\"{word}\"]]]\n]\n"));
    let deep = serde_json::json!({ "a": [[[[&word]]]] });
    let inner = format!("[[[\"{word}\"]]]");
    assert_eq!(
        json_text(&deep, 9),
        format!("{{\n  \"a\": [\n    {inner}\n  ]\n}}\n")
    );
    let inner = format!("[[[[\"{word}\"]]]]");
    let rows = format!("{{\n  \"a\": {inner}\n}}\n");
    assert_eq!(json_text(&deep, 1), rows);
}
