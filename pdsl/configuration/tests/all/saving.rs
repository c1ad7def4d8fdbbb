//! Saving of changed values into the configuration file.
#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::live::{FILE, live, load, of, set};
use expect_test::expect;
use rc_configuration::{LiveParameters, SaveError};
use rc_diagnostics::{Format, render};
use serde_json::json;
use std::path::Path;

#[test]
fn saving_changes_values_only() {
    let mut live = live(FILE);
    set(
        &mut live,
        &[
            ("speed", json!(3)),
            ("gains", json!([1, 2.5, 3])),
            ("mode", json!("fast")),
            ("log.level", json!(0)),
            ("motors[0].max", json!(1.75)),
            ("motors[1].min", json!(0.5)),
            ("device", json!("/dev/x")),
            ("token", json!("n3w")),
        ],
    );
    let text = live.save(Path::new("config.toml"), FILE).expect("saved");
    expect![[r##"
        # The arm.
        [component]
        period = "20ms"   # often

        [parameters]
        speed = 3.0       # rad/s
          # An odd place.
        gains = [
            1.0,   # the first
            2.5,
            3.0,
        ]
        mode = "fast"
        log.level = 0
        device = "/dev/x"
        token = "n3w"

        [[parameters.motors]]  # left
        name = "l"
        max = 1.75 # far

        [[parameters.motors]]
        name = "r"
        min = 0.5
        # The end.
    "##]]
    .assert_eq(&text);
    // The file is valid again, and the next start has the same values.
    let again = self::live(&text);
    let mut expected = live.values().to_json();
    expected["device"] = json!("/dev/x");
    assert_eq!(again.values().to_json(), expected);
    assert_eq!(again.values().text("token"), "n3w");
    live.saved();
    assert!(live.unsaved().is_empty());
    assert_eq!(
        live.save(Path::new("config.toml"), &text).expect("saved"),
        text
    );
}

#[test]
fn files_in_every_notation_are_saved() {
    for (text, expected) in [
        (
            "",
            expect![[r#"
            [parameters]
            speed = 3.0
            name = "a \"b\""
            [[parameters.motors]]
            name = "l"
            max = 4.0

            [parameters.log]
            level = 3
        "#]],
        ),
        (
            "[component]\nlog = \"info\"",
            expect![[r#"
            [component]
            log = "info"

            [parameters]
            speed = 3.0
            name = "a \"b\""
            [[parameters.motors]]
            name = "l"
            max = 4.0

            [parameters.log]
            level = 3
        "#]],
        ),
        (
            "parameters = { speed = 2 }\n",
            expect![[r#"
                parameters = { motors = [{ name = "l", max = 4.0 }], speed = 3.0, name = "a \"b\"", log = { level = 3 } }
            "#]],
        ),
        (
            "parameters.speed = 2.0 # x\n",
            expect![[r#"
            parameters.speed = 3.0 # x
            parameters.name = "a \"b\""
            [[parameters.motors]]
            name = "l"
            max = 4.0

            [parameters.log]
            level = 3
        "#]],
        ),
        (
            "[parameters.log]\nkeep = 3\n# end\n",
            expect![[r#"
            [parameters]
            speed = 3.0
            name = "a \"b\""
            [parameters.log]
            keep = 3
            level = 3
            # end
            [[parameters.motors]]
            name = "l"
            max = 4.0
        "#]],
        ),
        (
            "[parameters]\r\nspeed = 2 # x\r\n[parameters.log]\r\nlevel = 2\r\n",
            expect![[r#"
                [parameters]
                speed = 3.0 # x
                name = "a \"b\""
                [parameters.log]
                level = 3
                [[parameters.motors]]
                name = "l"
                max = 4.0
            "#]],
        ),
        (
            "[parameters]\nmotors = [{ name = \"l\", max = 2.0 }, { name = \"r\" }] # m\nlog = { keep = 3 }\n",
            expect![[r#"
                [parameters]
                motors = [{ name = "l", max = 4.0 }, { name = "r" }] # m
                log = { keep = 3, level = 3 }
                speed = 3.0
                name = "a \"b\""
            "#]],
        ),
    ] {
        let motors = if text.contains("motors") || text.starts_with("parameters =") {
            String::new()
        } else {
            "[[parameters.motors]]\nname = \"l\"\n"
                .replace('\n', if text.contains('\r') { "\r\n" } else { "\n" })
        };
        let inline = text.replace("{ speed", "{ motors = [{ name = \"l\" }], speed");
        let feed = if text.ends_with('\n') || text.is_empty() {
            ""
        } else {
            "\n"
        };
        let text = format!("{inline}{feed}{motors}");
        let mut live = live(&text);
        set(
            &mut live,
            &[
                ("speed", json!(3)),
                ("log.level", json!(3)),
                ("motors[0].max", json!(4)),
                ("name", json!("a \"b\"")),
            ],
        );
        let saved = live.save(Path::new("config.toml"), &text).expect("saved");
        // A string in a source file contains no `\r`.
        let returns = saved.matches("\r\n").count();
        let wanted = if text.contains('\r') {
            saved.lines().count()
        } else {
            0
        };
        assert_eq!(returns, wanted, "{saved:?}");
        expected.assert_eq(&saved.replace("\r\n", "\n"));
        assert_eq!(self::live(&saved).values(), live.values(), "{saved}");
    }
}

#[test]
fn edits_of_other_programs_are_not_overwritten() {
    let mut live = live(FILE);
    set(
        &mut live,
        &[
            ("speed", json!(3)),
            ("token", json!("n3w")),
            ("top", json!(12)),
        ],
    );
    let save = |text: &str| match live.save(Path::new("config.toml"), text) {
        Ok(text) => text,
        Err(SaveError::Conflicts(lines)) => lines.join("\n"),
        Err(SaveError::Invalid(sources, found)) => render(&sources, &found, Format::Short),
    };
    // Another line changed: both edits are kept.
    let other = FILE.replace("level = 2", "level = 3");
    let saved = save(&other);
    assert!(
        saved.contains("level = 3") && saved.contains("speed = 3.0       # rad/s"),
        "{saved}"
    );
    // Two editors changed one line.
    let same = FILE.replace("speed = 2.0 ", "speed = 2.5 ");
    let same = same.replace("log.level", "token = \"theirs\"\nlog.level");
    expect![[r#"
        `speed` was 2.0 when the file was read, is 2.5 in the file now, and 3.0 here
        `token` has another value in the file"#]]
    .assert_eq(&save(&same));
    // Both set one value.
    let agreed = FILE.replace("speed = 2.0 ", "speed = 3 ");
    assert!(save(&agreed).contains("speed = 3    "), "{}", save(&agreed));
    // An error that is in the file already, or that both edits cause together.
    expect![[r#"
        config.toml:12:8: error[invalid-choice]: `mode` cannot be the string "slo" (allowed is a string, one of "slow", "fast"; did you mean `slow`?)
    "#]].assert_eq(&save(&FILE.replace("mode = 'slow'", "mode = 'slo'")));
    let both = FILE.replace("speed = 2.0 ", "limit = 2.5\nspeed = 2.0 ");
    expect![[r#"
        config.toml:7:9: error[rule-broken]: `speed` breaks a rule: it moves too fast; `limit` at config.toml:6:9 (`speed <= limit` does not hold: `speed` is 3.0, `limit` is 2.5)
    "#]].assert_eq(&save(&both));
}

#[test]
fn a_moved_element_of_a_list_is_not_changed() {
    let save = |live: &LiveParameters, text: &str| match live.save(Path::new("config.toml"), text) {
        Ok(text) => text,
        Err(SaveError::Conflicts(lines)) => lines.join("\n"),
        Err(SaveError::Invalid(sources, found)) => render(&sources, &found, Format::Short),
    };
    let [left, right] = [
        "\n[[parameters.motors]]\nname = \"l\"\nmax = 1.5\n",
        "\n[[parameters.motors]]\nname = \"r\"\n",
    ];
    let file = format!("[parameters]\nspeed = 2.0\n{left}{right}");
    let mut live = live(&file);
    set(
        &mut live,
        &[("motors[1].max", json!(3)), ("motors[1].min", json!(0.5))],
    );
    assert_eq!(
        save(&live, &file),
        format!("{file}max = 3.0\nmin = 0.5\n")
            .replace("max = 3.0\nmin = 0.5", "min = 0.5\nmax = 3.0")
    );
    // The elements are swapped.
    expect![[r#"
        `motors[1].name` was "r" when the file was read and is "l" in the file now: `motors[1].min` may belong to another element
        `motors[1].max` was 1.0 when the file was read, is 1.5 in the file now, and 3.0 here"#]].assert_eq(&save(
        &live,
        &format!("[parameters]\nspeed = 2.0\n{right}{left}"),
    ));
    // One element is added, one is removed.
    expect![[r#"
        `motors` had 2 elements when the file was read and has 3 now: `motors[1].min` may belong to another element
        `motors` had 2 elements when the file was read and has 3 now: `motors[1].max` may belong to another element"#]].assert_eq(&save(&live, &format!("{file}{right}")));
    expect![[r#"
        `motors[1].min` is not in the file
        `motors[1].max` is not in the file"#]]
    .assert_eq(&save(&live, &format!("[parameters]\nspeed = 2.0\n{left}")));
    // Another element is in its place.
    expect![[r#"
        `motors[1].name` was "r" when the file was read and is "x" in the file now: `motors[1].min` may belong to another element
        `motors[1].name` was "r" when the file was read and is "x" in the file now: `motors[1].max` may belong to another element"#]].assert_eq(&save(&live, &file.replace("\"r\"", "\"x\"")));
    // Other elements and parameters may change. Values that are equal already cause no conflict.
    let other = file
        .replace("speed = 2.0", "speed = 1.0")
        .replace("1.5", "2.5");
    assert!(save(&live, &other).ends_with("name = \"r\"\nmin = 0.5\nmax = 3.0\n"));
    let agreed = format!("{file}max = 3\n");
    assert_eq!(save(&live, &agreed), format!("{agreed}min = 0.5\n"));
}

#[test]
fn comments_at_the_head_of_the_file_stay_there() {
    let motors = "[[parameters.motors]]\nname = \"l\"\n";
    let values = "[parameters]\nspeed = 3.0\n";
    for (header, about) in [
        ("#:schema ../generated/config.schema.json\n# The arm.\n", ""),
        (
            "#:schema ../generated/config.schema.json\n\n# The arm.\n\n",
            "# Left.\n",
        ),
        ("\u{feff}#:schema x\n\n", ""),
        ("\u{feff}", ""),
        ("\n\n", "# Left.\n"),
        ("", ""),
    ] {
        let text = format!("{header}{about}{motors}");
        let mut live = live(&text);
        set(&mut live, &[("speed", json!(3))]);
        let saved = live.save(Path::new("config.toml"), &text).expect("saved");
        assert_eq!(saved, format!("{header}{values}{about}{motors}"));
    }
    // The file contains comments only.
    let model = load("ComponentParams c { speed double 1 T; };");
    for (text, gap) in [
        ("# All.\n\n# [component]\n", "\n"),
        ("# All.", "\n\n"),
        ("", ""),
    ] {
        let mut live = of(model.clone(), text);
        assert_eq!(live.save(Path::new("c.toml"), text).expect("saved"), text);
        set(&mut live, &[("speed", json!(3))]);
        let saved = live.save(Path::new("c.toml"), text).expect("saved");
        assert_eq!(saved, format!("{text}{gap}{values}"));
    }
    let text = "# All.\r\n\r\n# [component]\r\n";
    let mut live = of(model, text);
    set(&mut live, &[("speed", json!(3))]);
    let saved = live.save(Path::new("c.toml"), text).expect("saved");
    assert_eq!(saved, format!("{text}\r\n[parameters]\r\nspeed = 3.0\r\n"));
}
