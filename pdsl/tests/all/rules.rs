//! Rules across parameters: diagnostics for their declarations and for configurations that break
//! them.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_configuration::model::Parameters;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

fn load(body: &str) -> (Parameters, String) {
    let mut sources = SourceMap::new();
    let source = sources.add("c.pdsl", format!("ComponentParams C {{\n{body}\n}};\n"));
    let (model, found) = rc_pdsl::load(&mut sources, &MemoryLoader::default(), source);
    let rendered = render(&sources, &found, Format::Short);
    (model.unwrap_or_default(), rendered)
}

/// Checks the diagnostics for `body`, which is in a component from line 2 on.
fn check(body: &str, expected: &Expect) {
    expected.assert_eq(&load(body).1);
}

/// Checks the diagnostics for a configuration. The declarations must be valid.
fn configure(body: &str, toml: &str, expected: &Expect) {
    let (model, rendered) = load(body);
    assert_eq!(rendered, "");
    // A component reads its rules from JSON.
    let model = Parameters::from_json(&model.to_json()).expect("its own JSON");
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", format!("[parameters]\n{toml}\n"));
    let (_, found) = rc_configuration::check(&sources, source, Some(&model));
    expected.assert_eq(&render(&sources, &found, Format::Short));
}

/// Parameters of a motor bus, with every kind of rule.
const BUS: &str = r#"
    speed double 0 0:;
    limit double 10;
    list motors 1:8 {
        name string;
        id int 0:127;
        min double;
        max double 5;
        require min < max "min must lie below max";
        require max <= limit "no motor may be faster than the bus allows";
    };
    require unique(motors.id) "two motors have one id";
    require max(motors.max) - min(motors.min) <= 12 "the span is too large";
    require len(motors) < 4 or speed <= 1 "many motors must be slow";
"#;

#[test]
fn a_rule_is_compiled_to_steps() {
    let text = "a int 1 T; b int 2; s string fast {fast, slow};\n\
        require a  <= b * 2 /* why */ and not not not (a == -3 or len(m) > 5) \"a is too large\";\n\
        list m { x int 1; require x > a - 1 and s == fast \"x is too small\"; }\nrequire UNIQUE(m.x) AND - - -a < - 0.5 \"twice\"";
    let (model, rendered) = load(text);
    expect![[r#"
        c.pdsl:5:47: error[missing-semicolon]: expected `;`
    "#]]
    .assert_eq(&rendered);
    let rules: Vec<String> = model
        .rules
        .iter()
        .map(|rule| serde_json::to_string(rule).expect("a rule is JSON"))
        .collect();
    expect![[r#"
        {"condition":[{"parameter":{"path":["a"]}},{"parameter":{"path":["b"]}},{"value":{"int":2}},"multiply",{"compare":"<="},{"parameter":{"path":["a"]}},{"value":{"int":-3}},{"compare":"=="},{"call":["len",{"path":["m"]}]},{"value":{"int":5}},{"compare":">"},"or","not","and"],"text":"a <= b * 2 and not not not (a == -3 or len(m) > 5)","message":"a is too large"}
        {"scope":["m"],"condition":[{"parameter":{"level":1,"path":["x"]}},{"parameter":{"path":["a"]}},{"value":{"int":1}},"subtract",{"compare":">"},{"parameter":{"path":["s"]}},{"value":{"text":"fast"}},{"compare":"=="},"and"],"text":"x > a - 1 and s == fast","message":"x is too small"}
        {"condition":[{"call":["unique",{"path":["m","x"]}]},{"parameter":{"path":["a"]}},"negate",{"value":{"float":0.5}},"negate",{"compare":"<"},"and"],"text":"UNIQUE(m.x) AND - - -a < - 0.5","message":"twice"}"#]].assert_eq(&rules.join("\n"));
}

#[test]
fn unknown_names_are_reported() {
    check(
        "speed int 1; group g { x int 1; };\nlist motors { max int 1; list joints { angle int; }; require mx > 0 \"\"; };\n\
         require sped > 0 \"\";\nrequire g.y > 0 and speed.x > 0 \"\";\nrequire max(motor.max) > 0 or max(motors.maxx) > 0 \"\";\n\
         require average(motors.max) > 0 \"\";\nrequire colour == 3 \"\";",
        &expect![[r#"
            c.pdsl:3:62: error[unknown-parameter]: unknown parameter `mx` (did you mean `max`?)
            c.pdsl:4:9: error[unknown-parameter]: unknown parameter `sped` (did you mean `speed`?)
            c.pdsl:5:11: error[unknown-parameter]: unknown parameter `g.y` (expected `x`)
            c.pdsl:5:27: error[unknown-parameter]: `speed` is one value; there is no `x` in it
            c.pdsl:6:13: error[unknown-parameter]: unknown parameter `motor` (did you mean `motors`?)
            c.pdsl:6:42: error[unknown-parameter]: unknown parameter `motors.maxx` (did you mean `max`?)
            c.pdsl:7:9: error[unknown-function]: unknown function `average` (expected one of `min`, `max`, `len`, `unique`)
            c.pdsl:8:9: error[unknown-parameter]: unknown parameter `colour` (expected one of `speed`, `g`, `motors`)
        "#]],
    );
}

#[test]
fn types_of_operands_are_checked() {
    check(
        "i int 1; d double 1; s string \"\"; t duration 1s; b bool true; p path \"\"; l long 1;\n\
         require s < i \"\";\nrequire s + \"x\" == s \"\";\nrequire i \"\";\nrequire t > 100 \"\";\nrequire s < p \"\";\n\
         require b > true \"\";\nrequire not i \"\";\nrequire i and b or d \"\";\nrequire t * t > 1s \"\";\nrequire 1 / t > 1 \"\";\n\
         require t + 1 > 1s \"\";\nrequire -s == s and -b \"\";\nrequire (i < 3) + 1 > 2 \"\";\nrequire b == 1 \"\";\nrequire i == \"1\" and d == 1s \"\";",
        &expect![[r#"
            c.pdsl:3:9: error[condition-type]: a string cannot be compared with a number
            c.pdsl:4:9: error[condition-type]: a string cannot be computed with
            c.pdsl:4:13: error[condition-type]: a string cannot be computed with
            c.pdsl:5:9: error[condition-type]: this is a number, not a condition (compare it with something: `a < b`)
            c.pdsl:6:9: error[condition-type]: a duration cannot be compared with a number (a duration needs a unit here: `100ms`)
            c.pdsl:7:9: error[condition-type]: a string has no order (only `==` and `!=` compare it)
            c.pdsl:8:9: error[condition-type]: `true` or `false` has no order (only `==` and `!=` compare it)
            c.pdsl:9:13: error[condition-type]: this is a number, not a condition (compare it with something: `a < b`)
            c.pdsl:10:9: error[condition-type]: this is a number, not a condition (compare it with something: `a < b`)
            c.pdsl:10:20: error[condition-type]: this is a number, not a condition (compare it with something: `a < b`)
            c.pdsl:11:9: error[condition-type]: a duration cannot be multiplied with a duration
            c.pdsl:12:9: error[condition-type]: a number cannot be divided by a duration
            c.pdsl:13:9: error[condition-type]: a duration and a number cannot be added (a duration needs a unit here: `100ms`)
            c.pdsl:14:10: error[condition-type]: a string cannot be computed with
            c.pdsl:14:22: error[condition-type]: `true` or `false` cannot be computed with
            c.pdsl:15:9: error[condition-type]: `true` or `false` cannot be computed with
            c.pdsl:16:9: error[condition-type]: `true` or `false` cannot be compared with a number
            c.pdsl:17:9: error[condition-type]: a number cannot be compared with a string
            c.pdsl:17:22: error[condition-type]: a number cannot be compared with a duration (a duration needs a unit here: `100ms`)
        "#]],
    );
    // Valid rules that hold for the defaults.
    check(
        "i int 1; d double 2; s string \"x\"; t duration 1s; b bool true; p path \"x\"; l long 1;\n\
         require i < d and l >= i and s == p and b and b == true and b == (i == 1) \"\";\n\
         require t * 2 > 1500ms and 2 * t >= 2 s and t / 2 == 500ms and t / 500ms == 2 and t - 2s == -1s \"\";\n\
         require i * 5 / 2 == 2.5 and i / 2 == 0.5 and 4 / d == 2 and i - - 1 == 2 and i --1 == 2 and -i == -1 \"\";",
        &expect![[""]],
    );
}

#[test]
fn lists_are_used_through_functions() {
    check(
        "i int 1; a int[] [1]; g string[] []; group q { z int 1; };\nlist m { x int 1; s string \"\"; tags string[] []; list n { y int 1; }; };\n\
         require m.x > 0 \"\";\nrequire m.s == \"x\" \"\";\nrequire a > 0 \"\";\nrequire m > 0 and q == 1 \"\";\nrequire len(i) > 0 \"\";\n\
         require unique(i) \"\";\nrequire len(m.x) > 0 \"\";\nrequire min(m) > 0 and unique(m) \"\";\nrequire min(m.s) > 0 and max(g) > 1 \"\";\n\
         require len(q) > 0 and unique(q) \"\";\nrequire unique(m.x) > 1 \"\";\nrequire len(m) \"\";",
        &expect![[r#"
            c.pdsl:4:9: error[condition-type]: `m.x` has a value for every element of `m` (write `min(m.x)` or `max(m.x)`, or put the rule into the list)
            c.pdsl:5:9: error[condition-type]: `m.s` has a value for every element of `m` (write `unique(m.s)`, or put the rule into the list)
            c.pdsl:6:9: error[condition-type]: `a` has a value for every element of `a` (write `min(a)` or `max(a)`)
            c.pdsl:7:9: error[condition-type]: `m` is a list and has no value (name one of the parameters in it)
            c.pdsl:7:19: error[condition-type]: `q` is a group and has no value (name one of the parameters in it)
            c.pdsl:8:13: error[condition-type]: `len` takes a list; `i` is one value (a list, an array, or a parameter in the elements of a list)
            c.pdsl:9:16: error[condition-type]: `unique` takes a list; `i` is one value (a list, an array, or a parameter in the elements of a list)
            c.pdsl:10:13: error[condition-type]: `m.x` is one value in each element (write `len(m)`)
            c.pdsl:11:13: error[condition-type]: `m` is a list of structures (name one of their parameters: `min(m.…)`)
            c.pdsl:11:31: error[condition-type]: `m` is a list of structures (name one of their parameters: `unique(m.…)`)
            c.pdsl:12:13: error[condition-type]: `min` takes numbers or durations; `m.s` is of type `string` (only numbers and durations have an order)
            c.pdsl:12:30: error[condition-type]: `max` takes numbers or durations; `g` is of type `string` (only numbers and durations have an order)
            c.pdsl:13:13: error[condition-type]: `len` takes a list; `q` is a group (a list, an array, or a parameter in the elements of a list)
            c.pdsl:13:31: error[condition-type]: `unique` takes a list; `q` is a group (a list, an array, or a parameter in the elements of a list)
            c.pdsl:14:9: error[condition-type]: `true` or `false` cannot be compared with a number
            c.pdsl:15:9: error[condition-type]: this is a number, not a condition (compare it with something: `a < b`)
        "#]],
    );
    check(
        "a int[] [1]; g string[] []; list m { x int 1; tags string[] []; list n { y duration 1s; }; require len(tags) < 3 and len(n) <= 1 \"\"; };\n\
         require unique(a) and unique(m.tags) and max(a) == 1 and min(m.n.y) > 1ms and len(m.n) < 9 and len(g) == 0 and len(m.tags) == 0 \"\";",
        &expect![[""]],
    );
}

#[test]
fn choices_are_compared_with_their_names() {
    check(
        "mode string fast {fast, slow, \"very slow\"}; k int 1 {1, 2}; t duration 1s {1s, 2s}; x string \"\";\n\
         require mode == fsat \"\";\nrequire mode != \"slwo\" or fast == mode \"\";\nrequire k == 3 \"\";\nrequire x == fast \"\";\n\
         require mode == \"very slow\" or slow != mode or k == 1 or k < 7 or t == 1000ms \"\";\nrequire t != 3s \"\";",
        &expect![[r#"
            c.pdsl:3:17: error[bad-choice]: `fsat` is not one of the choices of `mode` (did you mean `fast`?)
            c.pdsl:4:17: error[bad-choice]: the string "slwo" is not one of the choices of `mode` (did you mean `slow`?)
            c.pdsl:5:14: error[bad-choice]: the number 3 is not one of the choices of `k` (allowed is an integer of 32 bits, one of 1, 2)
            c.pdsl:6:14: error[unknown-parameter]: unknown parameter `fast` (expected one of `mode`, `k`, `t`, `x`)
            c.pdsl:8:14: error[bad-choice]: the duration 3s is not one of the choices of `t` (allowed is a duration such as "50ms", or a number of milliseconds, one of "1s", "2s")
        "#]],
    );
}

#[test]
fn trivial_conditions_are_reported() {
    check(
        "a int 1;\nrequire 1 < 2 \"\";\nrequire true \"\";\nrequire a > 0 and (3 == 4 or a < 5) \"\";\nrequire a > 0 or not false \"\";\n\
         require 1 / 0 > a \"\";\nrequire 1 / 0 > 1 \"\";\nrequire a > 99999999999999999999999 or a < 1e999 \"\";",
        &expect![[r#"
            c.pdsl:3:9: error[constant-condition]: no parameter is named here: it always holds
            c.pdsl:4:9: error[constant-condition]: no parameter is named here: it always holds
            c.pdsl:5:20: error[constant-condition]: no parameter is named here: it never holds
            c.pdsl:6:22: error[constant-condition]: no parameter is named here: it never holds
            c.pdsl:7:9: error[default-breaks-rule]: the defaults break this rule: `1 / 0 > a` divides by zero: `a` is 1 by default
            c.pdsl:8:9: error[constant-condition]: no parameter is named here: it cannot be computed
            c.pdsl:9:44: error[condition-type]: this number is too large
        "#]],
    );
}

#[test]
fn operators_of_c_are_explained() {
    check(
        "a int 1; b bool true;\nrequire a = 1 && b || !b \"\";\nrequire a != 2 \"\";",
        &expect![[r#"
            c.pdsl:3:11: error[foreign-operator]: `=` is written `==` here
            c.pdsl:3:15: error[foreign-operator]: `&&` is written `and` here
            c.pdsl:3:20: error[foreign-operator]: `||` is written `or` here
            c.pdsl:3:23: error[foreign-operator]: `!` is written `not` here
        "#]],
    );
}

#[test]
fn syntax_errors_are_reported() {
    check(
        "a int 1;\nrequire a < ;\nrequire a < 1;\nrequire 0 < a < 2 \"\";\nrequire (a < 1 \"\";\nrequire a ** 2 > 1 \"\";\n\
         require min(a, a) > 1 \"\";\nrequire and \"\";\nrequire a > 1 \"\" T;\nrequire \"\";\nrequire a. > 1 \"\";\nrequire len() > 1 \"\";\nrequire a == not (a > 1) \"\";\nrequire - not a > 1 \"\";",
        &expect![[r#"
            c.pdsl:3:13: error[syntax-error]: expected a value, found `;`
            c.pdsl:4:14: error[syntax-error]: expected a string or an operator, found `;`
            c.pdsl:5:15: error[syntax-error]: `<` after `<`: two values are compared (three values are compared like this: `a < b and b < c`)
            c.pdsl:6:16: error[syntax-error]: expected `)` or an operator, found `"`
            c.pdsl:7:12: error[syntax-error]: expected a value, found `*`
            c.pdsl:8:14: error[syntax-error]: expected `)`, found `,`
            c.pdsl:9:9: error[syntax-error]: expected a value, found `and`
            c.pdsl:10:18: error[syntax-error]: expected `;`, found `T`
            c.pdsl:11:11: error[syntax-error]: expected a string or an operator, found `;`
            c.pdsl:12:12: error[syntax-error]: expected a name, found `>`
            c.pdsl:13:13: error[syntax-error]: expected a name, found `)`
            c.pdsl:14:14: error[syntax-error]: `not` comes before a whole condition (put brackets around it: `a == (not b)`)
            c.pdsl:15:11: error[syntax-error]: `not` comes before a whole condition (put brackets around it: `a == (not b)`)
        "#]],
    );
}

#[test]
fn a_rule_about_an_invalid_parameter_causes_no_further_error() {
    check(
        "a itn 1; group g { b colour; };\nlist m { c itn; require c > 0 and a > 0 \"\"; };\nrequire a > 0 and g.b > 0 and max(m.c) > 0 \"\";\nrequire a > 0 and x > 0 \"\";",
        &expect![[r#"
            c.pdsl:2:3: error[unknown-type]: unknown type `itn` (did you mean `int`?)
            c.pdsl:2:22: error[unknown-type]: unknown type `colour` (expected one of `bool`, `int`, `long`, `float`, `double`, `string`, `duration`, `path`)
            c.pdsl:3:12: error[unknown-type]: unknown type `itn` (did you mean `int`?)
            c.pdsl:5:19: error[unknown-parameter]: unknown parameter `x` (expected one of `g`, `m`)
        "#]],
    );
}

#[test]
fn defaults_must_satisfy_the_rules() {
    check(
        "a int 5; b int 3; c int; list m { x int 1; y int 0; require x < y \"\"; };\n\
         require a < b \"\";\nrequire a < c \"\";\nrequire len(m) > 0 \"\";\nrequire b / (a - 5) > 1 \"\";\nrequire len(m) == 0 or max(m.x) > 7 \"\";",
        &expect![[r#"
            c.pdsl:2:61: error[default-breaks-rule]: the defaults break this rule: `x < y` does not hold: `m[0].x` is 1 by default, `m[0].y` is 0 by default
            c.pdsl:3:9: error[default-breaks-rule]: the defaults break this rule: `a < b` does not hold: `a` is 5 by default, `b` is 3 by default
            c.pdsl:5:9: error[default-breaks-rule]: the defaults break this rule: `len(m) > 0` does not hold: `m` has length 0 by default
            c.pdsl:6:9: error[default-breaks-rule]: the defaults break this rule: `b / (a - 5) > 1` divides by zero: `b` is 3 by default, `a` is 5 by default
        "#]],
    );
}

#[test]
fn a_broken_rule_names_its_values() {
    configure(
        BUS,
        "limit = 6\n[[motors]]\nname = 'a'\nid = 1\nmin = 0\n\n[[motors]]\nname = 'b'\nid = 2\nmin = -9\nmax = -10\n\n\
         [[motors]]\nname = 'c'\nmin = 9\nid = 1\n[[motors]]\nname = 'd'\nid = 4\nmax = 7\nmin = 0\n"
            .replace("[[motors]]", "[[parameters.motors]]")
            .as_str(),
        &expect![[r#"
            config.toml:11:7: error[rule-broken]: `motors[1].min` breaks a rule: min must lie below max; `motors[1].max` at config.toml:12:7 (`min < max` does not hold: `motors[1].min` is -9.0, `motors[1].max` is -10.0)
            config.toml:16:7: error[rule-broken]: `motors[2].min` breaks a rule: min must lie below max (`min < max` does not hold: `motors[2].min` is 9.0, `motors[2].max` is 5.0 by default)
            config.toml:17:6: error[rule-broken]: `motors[2].id` breaks a rule: two motors have one id; `motors[0].id` at config.toml:5:6 (`unique(motors.id)` does not hold: `motors[2].id` is 1, `motors[0].id` is 1)
            config.toml:21:7: error[rule-broken]: `motors[3].max` breaks a rule: no motor may be faster than the bus allows; `limit` at config.toml:2:9 (`max <= limit` does not hold: `motors[3].max` is 7.0, `limit` is 6.0)
            config.toml:21:7: error[rule-broken]: `motors[3].max` breaks a rule: the span is too large; `motors[1].min` at config.toml:11:7 (`max(motors.max) - min(motors.min) <= 12` does not hold: `motors[3].max` is 7.0, `motors[1].min` is -9.0)
        "#]],
    );
    configure(
        BUS,
        "speed = 2\nmotors = [{name = 'a', id = 1, min = 0}, {name = 'a', id = 2, min = 0}, {name = 'a', id = 3, min = 0},\n\
         {name = 'a', id = 4, min = 0}]",
        &expect![[r#"
            config.toml:3:10: error[rule-broken]: `motors` breaks a rule: many motors must be slow; `speed` at config.toml:2:9 (`len(motors) < 4 or speed <= 1` does not hold: `motors` has length 4, `speed` is 2.0)
        "#]],
    );
    configure(
        BUS,
        "motors = [{name = 'a', id = 1, min = 0}]",
        &expect![[""]],
    );
}

#[test]
fn all_errors_are_reported_and_rules_about_invalid_values_are_skipped() {
    configure(
        BUS,
        "lmit = 3\nspeed = -1\nmotors = [{name = 'a', id = 200, min = 0, max = 20}, {name = 3, id = 200, max = -1},\n\
         {name = 'x', id = 3, min = 7, max = 5},\n{name = 'y', id = 3, min = 1, max = 2}, {}, {}, {}, {}, {}]",
        &expect![[r#"
            config.toml:2:1: error[unknown-parameter]: unknown parameter `lmit` (did you mean `limit`?)
            config.toml:3:9: error[out-of-range]: `speed` cannot be the number -1 (allowed is a number of 64 bits, at least 0)
            config.toml:4:10: error[wrong-length]: `motors` has length 9 (allowed are 1 to 8 elements)
            config.toml:4:29: error[out-of-range]: `motors[0].id` cannot be the number 200 (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:4:49: error[rule-broken]: `motors[0].max` breaks a rule: no motor may be faster than the bus allows (`max <= limit` does not hold: `motors[0].max` is 20.0, `limit` is 10.0 by default)
            config.toml:4:54: error[missing-parameter]: `motors[1].min` must be set (allowed is a number of 64 bits)
            config.toml:4:62: error[wrong-type]: `motors[1].name` cannot be the number 3 (allowed is a string)
            config.toml:4:70: error[out-of-range]: `motors[1].id` cannot be the number 200 (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:5:28: error[rule-broken]: `motors[2].min` breaks a rule: min must lie below max; `motors[2].max` at config.toml:5:37 (`min < max` does not hold: `motors[2].min` is 7.0, `motors[2].max` is 5.0)
            config.toml:6:41: error[missing-parameter]: `motors[4].name` must be set (allowed is a string)
            config.toml:6:41: error[missing-parameter]: `motors[4].id` must be set (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:6:41: error[missing-parameter]: `motors[4].min` must be set (allowed is a number of 64 bits)
            config.toml:6:45: error[missing-parameter]: `motors[5].name` must be set (allowed is a string)
            config.toml:6:45: error[missing-parameter]: `motors[5].id` must be set (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:6:45: error[missing-parameter]: `motors[5].min` must be set (allowed is a number of 64 bits)
            config.toml:6:49: error[missing-parameter]: `motors[6].name` must be set (allowed is a string)
            config.toml:6:49: error[missing-parameter]: `motors[6].id` must be set (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:6:49: error[missing-parameter]: `motors[6].min` must be set (allowed is a number of 64 bits)
            config.toml:6:53: error[missing-parameter]: `motors[7].name` must be set (allowed is a string)
            config.toml:6:53: error[missing-parameter]: `motors[7].id` must be set (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:6:53: error[missing-parameter]: `motors[7].min` must be set (allowed is a number of 64 bits)
            config.toml:6:57: error[missing-parameter]: `motors[8].name` must be set (allowed is a string)
            config.toml:6:57: error[missing-parameter]: `motors[8].id` must be set (allowed is an integer of 32 bits, from 0 to 127)
            config.toml:6:57: error[missing-parameter]: `motors[8].min` must be set (allowed is a number of 64 bits)
        "#]],
    );
}

#[test]
fn a_rule_about_an_array_with_an_invalid_element_is_skipped() {
    let body = "a int[0:3] [1] 0:9; b int 3;\nrequire max(a) < b \"too large\";\nrequire unique(a) \"twice\";\nrequire len(a) < b \"too many\";";
    configure(
        body,
        "a = [1, 2, 10]",
        &expect![[r#"
            config.toml:2:12: error[out-of-range]: `a[2]` cannot be the number 10 (allowed is an integer of 32 bits, from 0 to 9)
        "#]],
    );
    configure(
        body,
        "a = [1, 2, 1]",
        &expect![[r#"
        config.toml:2:5: error[rule-broken]: `a` breaks a rule: too many (`len(a) < b` does not hold: `a` has length 3, `b` is 3 by default)
        config.toml:2:12: error[rule-broken]: `a[2]` breaks a rule: twice; `a[0]` at config.toml:2:6 (`unique(a)` does not hold: `a[2]` is 1, `a[0]` is 1)
    "#]],
    );
    configure(
        body,
        "a = [\n1,\n5]\nb = 4",
        &expect![[r#"
        config.toml:4:1: error[rule-broken]: `a[1]` breaks a rule: too large; `b` at config.toml:5:5 (`max(a) < b` does not hold: `a[1]` is 5, `b` is 4)
    "#]],
    );
    configure(
        body,
        "a = [5, 5, 10]",
        &expect![[r#"
            config.toml:2:12: error[out-of-range]: `a[2]` cannot be the number 10 (allowed is an integer of 32 bits, from 0 to 9)
        "#]],
    );
    configure(
        body,
        "a = [5, 5, 5, 5]",
        &expect![[r#"
        config.toml:2:5: error[wrong-length]: `a` has length 4 (allowed are 0 to 3 elements)
    "#]],
    );
    configure(body, "a = []", &expect![[""]]);
}

#[test]
fn integers_are_compared_exactly() {
    let body = "a long 9007199254740993; b long 9007199254740994; d double 9007199254740994;\nrequire a < b \"a\";\n\
                require a < d \"b\";\nrequire a * a * 2 >= b \"c\";\nrequire 10 / a < 1 or a == 0 \"d\";";
    configure(body, "a = 9007199254740993", &expect![[""]]);
    configure(
        body,
        "a = 9007199254740993\nb = 9007199254740993\nd = 9007199254740992.0",
        &expect![[r#"
            config.toml:2:5: error[rule-broken]: `a` breaks a rule: a; `b` at config.toml:3:5 (`a < b` does not hold: `a` is 9007199254740993, `b` is 9007199254740993)
            config.toml:2:5: error[rule-broken]: `a` breaks a rule: b; `d` at config.toml:4:5 (`a < d` does not hold: `a` is 9007199254740993, `d` is 9007199254740992.0)
        "#]],
    );
    configure(
        body,
        "a = 0\n b = 1",
        &expect![[r#"
        config.toml:2:5: error[rule-broken]: `a` breaks a rule: c; `b` at config.toml:3:6 (`a * a * 2 >= b` does not hold: `a` is 0, `b` is 1)
    "#]],
    );
    let body = "a long 2; b long 1; d double 1;\nrequire a * a * a * a > b \"a\";\nrequire a / b > 0 \"b\";\nrequire d * 2 > 1 \"c\";\nrequire a - b < 9 and -a < 9 \"d\";";
    configure(
        body,
        "a = -9223372036854775808\nb = -1\nd = nan",
        &expect![[r#"
            config.toml:2:5: error[rule-broken]: `a` breaks a rule: a; `b` at config.toml:3:5 (`a * a * a * a > b` gives a number that is too large: `a` is -9223372036854775808, `b` is -1)
            config.toml:2:5: error[rule-broken]: `a` breaks a rule: d; `b` at config.toml:3:5 (`a - b < 9 and -a < 9` does not hold: `a` is -9223372036854775808, `b` is -1)
            config.toml:4:5: error[rule-broken]: `d` breaks a rule: c (`d * 2 > 1` cannot be computed with nan, which is not a number: `d` is nan)
        "#]],
    );
    configure(
        body,
        "b = 0\nd = inf",
        &expect![[r#"
        config.toml:2:5: error[rule-broken]: `b` breaks a rule: b (`a / b > 0` divides by zero: `a` is 2 by default, `b` is 0)
    "#]],
    );
}

#[test]
fn durations_strings_and_choices_are_compared() {
    let body = "slow duration 1s; fast duration 100ms; mode string auto {auto, manual}; dev path \"/dev/a\"; other path \"/dev/b\"; on bool true;\n\
                require fast * 2 < slow \"the slow one is too fast\";\nrequire mode != manual or on \"manual must be on\";\nrequire dev != other \"two devices are one\";";
    configure(
        body,
        "slow = 200\nmode = 'manual'\non = false\ndev = '/dev/b'",
        &expect![[r#"
            config.toml:2:8: error[rule-broken]: `slow` breaks a rule: the slow one is too fast (`fast * 2 < slow` does not hold: `fast` is "100ms" by default, `slow` is "200ms")
            config.toml:3:8: error[rule-broken]: `mode` breaks a rule: manual must be on; `on` at config.toml:4:6 (`mode != manual or on` does not hold: `mode` is "manual", `on` is false)
            config.toml:5:7: error[rule-broken]: `dev` breaks a rule: two devices are one (`dev != other` does not hold: `dev` is "/dev/b", `other` is "/dev/b" by default)
        "#]],
    );
    configure(
        body,
        "slow = '0.21s'\nmode = 'manual'\ndev = '/dev/c'",
        &expect![[""]],
    );
}

#[test]
fn no_diagnostic_shows_a_secret() {
    configure(
        "pin int 1 secret; code int[] [2] secret; low int 0;\nrequire pin > low and max(code) > low \"the pin is too simple\";",
        "low = 5",
        &expect![[r#"
            config.toml:2:7: error[rule-broken]: `low` breaks a rule: the pin is too simple (`pin > low and max(code) > low` does not hold: `pin` is secret by default, `low` is 5, `code[0]` is secret by default)
        "#]],
    );
}

#[test]
fn the_minimum_of_an_empty_list_breaks_no_rule() {
    let body = "a int 1; list m { x int 1; };\nrequire max(m.x) < 3 and a < 5 \"one\";\nrequire a == 1 or not (min(m.x) > 3) \"two\";";
    configure(body, "", &expect![[""]]);
    configure(
        body,
        "a = 7",
        &expect![[r#"
        config.toml:2:5: error[rule-broken]: `a` breaks a rule: one (`max(m.x) < 3 and a < 5` does not hold: `m` is empty by default, `a` is 7)
    "#]],
    );
    configure(
        body,
        "a = 2\nm = [{ x = 4 }, { x = 5 }]",
        &expect![[r#"
            config.toml:2:5: error[rule-broken]: `a` breaks a rule: two; `m[0].x` at config.toml:3:12 (`a == 1 or not (min(m.x) > 3)` does not hold: `a` is 2, `m[0].x` is 4)
            config.toml:3:23: error[rule-broken]: `m[1].x` breaks a rule: one; `a` at config.toml:2:5 (`max(m.x) < 3 and a < 5` does not hold: `m[1].x` is 5, `a` is 2)
        "#]],
    );
}

#[test]
fn rules_apply_in_groups_and_in_nested_lists() {
    configure(
        "top int 3;\ngroup g {\n bottom int 0;\n list arms {\n  reach int 1;\n  list joints { min int 0; max int 1;\n   require min < max \"joint\";\n   require max <= reach and reach <= top and bottom <= min \"reach\";\n  };\n  require len(joints) < 3 \"joints\";\n };\n require len(arms.joints) < 4 and unique(arms.joints.max) \"all\";\n};",
        "[[parameters.g.arms]]\njoints = [{}, { min = 2 }]\n[[parameters.g.arms]]\nreach = 9\njoints = [{ max = 2 },\n{ max = 3 }, { max = 4 }]",
        &expect![[r#"
            config.toml:2:1: error[rule-broken]: `g.arms` breaks a rule: all (`len(arms.joints) < 4 and unique(arms.joints.max)` does not hold: `g.arms` has 5 `joints` in all, `g.arms[0].joints[1].max` is 1 by default, `g.arms[0].joints[0].max` is 1 by default)
            config.toml:3:23: error[rule-broken]: `g.arms[0].joints[1].min` breaks a rule: joint (`min < max` does not hold: `g.arms[0].joints[1].min` is 2, `g.arms[0].joints[1].max` is 1 by default)
            config.toml:6:10: error[rule-broken]: `g.arms[1].joints` breaks a rule: joints (`len(joints) < 3` does not hold: `g.arms[1].joints` has length 3)
            config.toml:6:19: error[rule-broken]: `g.arms[1].joints[0].max` breaks a rule: reach; `g.arms[1].reach` at config.toml:5:9 (`max <= reach and reach <= top and bottom <= min` does not hold: `g.arms[1].joints[0].max` is 2, `g.arms[1].reach` is 9, `top` is 3 by default, `g.bottom` is 0 by default, `g.arms[1].joints[0].min` is 0 by default)
            config.toml:7:9: error[rule-broken]: `g.arms[1].joints[1].max` breaks a rule: reach; `g.arms[1].reach` at config.toml:5:9 (`max <= reach and reach <= top and bottom <= min` does not hold: `g.arms[1].joints[1].max` is 3, `g.arms[1].reach` is 9, `top` is 3 by default, `g.bottom` is 0 by default, `g.arms[1].joints[1].min` is 0 by default)
            config.toml:7:22: error[rule-broken]: `g.arms[1].joints[2].max` breaks a rule: reach; `g.arms[1].reach` at config.toml:5:9 (`max <= reach and reach <= top and bottom <= min` does not hold: `g.arms[1].joints[2].max` is 4, `g.arms[1].reach` is 9, `top` is 3 by default, `g.bottom` is 0 by default, `g.arms[1].joints[2].min` is 0 by default)
        "#]],
    );
}
