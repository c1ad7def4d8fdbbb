//! Diagnostics and models of `.pdsl` texts.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_configuration::model::Parameters;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use std::time::{Duration, Instant};

/// Checks the diagnostics for `body`, which is in a component `C` from line 2 on.
fn check(body: &str, expected: &Expect) -> Parameters {
    check_file(&format!("ComponentParams C {{\n{body}\n}};\n"), expected)
}

fn check_file(text: &str, expected: &Expect) -> Parameters {
    let mut sources = SourceMap::new();
    let source = sources.add("c.pdsl", text);
    let (model, found) = rc_pdsl::load(&mut sources, &MemoryLoader::default(), source);
    expected.assert_eq(&render(&sources, &found, Format::Short));
    model.unwrap_or_default()
}

/// Checks the model of `body` as JSON, one parameter per line, and that there are no diagnostics.
fn model(body: &str, expected: &Expect) {
    let model = check(body, &expect![[""]]);
    let lines: Vec<String> = model
        .parameters
        .iter()
        .map(|p| serde_json::to_string(p).expect("a model is JSON"))
        .collect();
    expected.assert_eq(&format!("{}\n", lines.join("\n")));
    assert_eq!(
        Parameters::from_json(&model.to_json()).expect("its own JSON"),
        model
    );
}

#[test]
fn the_line_form_of_robocomp_is_accepted() {
    model(
        "device string \"\" T;\nstartValue int 169 0:1000 T;\nid int 0:127;\nname string T;\nfixed Bool true F;",
        &expect![[r#"
            {"name":"device","kind":{"scalar":{"type":"string"}},"default":{"text":""},"editable":true}
            {"name":"startValue","kind":{"scalar":{"type":"int"}},"default":{"int":169},"range":{"min":{"int":0},"max":{"int":1000}},"editable":true}
            {"name":"id","kind":{"scalar":{"type":"int"}},"range":{"min":{"int":0},"max":{"int":127}}}
            {"name":"name","kind":{"scalar":{"type":"string"}},"editable":true}
            {"name":"fixed","kind":{"scalar":{"type":"bool"}},"default":{"bool":true}}
        "#]],
    );
}

#[test]
fn every_type_default_and_limit_reaches_the_model() {
    model(
        r#"a long -9007199254740993 :9007199254740993;
        b float 1 0.5:; c double 1e-3 -1:1 unit "m/s" T restart;
        d duration 50ms 1ms:2s; e duration 20; f path "/dev/ttyUSB0" secret;
        g int[2:4] [1, 2] 0:9; h string[] ["x"]; i string[] []; j float[3:3];
        mode string fast {slow, fast, "very fast"}; k int {1, 2}; l int :;"#,
        &expect![[r#"
            {"name":"a","kind":{"scalar":{"type":"long"}},"range":{"min":{"int":-9007199254740993},"max":{"int":9007199254740993}}}
            {"name":"b","kind":{"scalar":{"type":"float"}},"default":{"float":1.0},"range":{"min":{"float":0.5}}}
            {"name":"c","kind":{"scalar":{"type":"double"}},"default":{"float":0.001},"range":{"min":{"float":-1.0},"max":{"float":1.0}},"unit":"m/s","editable":true,"restart":true}
            {"name":"d","kind":{"scalar":{"type":"duration"}},"default":{"duration":50000000},"range":{"min":{"duration":1000000},"max":{"duration":2000000000}}}
            {"name":"e","kind":{"scalar":{"type":"duration"}},"default":{"duration":20000000}}
            {"name":"f","kind":{"scalar":{"type":"path"}},"default":{"text":"/dev/ttyUSB0"},"secret":true}
            {"name":"g","kind":{"scalar":{"type":"int","array":{"min":2,"max":4}}},"default":{"array":[{"int":1},{"int":2}]},"range":{"min":{"int":0},"max":{"int":9}}}
            {"name":"h","kind":{"scalar":{"type":"string","array":{"min":0}}},"default":{"array":[{"text":"x"}]}}
            {"name":"i","kind":{"scalar":{"type":"string","array":{"min":0}}},"default":{"array":[]}}
            {"name":"j","kind":{"scalar":{"type":"float","array":{"min":3,"max":3}}}}
            {"name":"mode","kind":{"scalar":{"type":"string"}},"default":{"text":"fast"},"choices":[{"text":"slow"},{"text":"fast"},{"text":"very fast"}]}
            {"name":"k","kind":{"scalar":{"type":"int"}},"choices":[{"int":1},{"int":2}]}
            {"name":"l","kind":{"scalar":{"type":"int"}}}
        "#]],
    );
}

#[test]
fn keywords_are_valid_names() {
    model(
        "T int 3; unit string unit {unit, T}; group int {1, 2}; list path \"x\"; require string \"x\";\n\
         group path { group group { list int 3; }; }\nlist duration 1:2 { min int 0; }\nlen int 4; secret bool secret;",
        &expect![[r#"
            {"name":"T","kind":{"scalar":{"type":"int"}},"default":{"int":3}}
            {"name":"unit","kind":{"scalar":{"type":"string"}},"default":{"text":"unit"},"choices":[{"text":"unit"},{"text":"T"}]}
            {"name":"group","kind":{"scalar":{"type":"int"}},"choices":[{"int":1},{"int":2}]}
            {"name":"list","kind":{"scalar":{"type":"path"}},"default":{"text":"x"}}
            {"name":"require","kind":{"scalar":{"type":"string"}},"default":{"text":"x"}}
            {"name":"path","kind":{"group":[{"name":"group","kind":{"group":[{"name":"list","kind":{"scalar":{"type":"int"}},"default":{"int":3}}]}}]}}
            {"name":"duration","kind":{"list":{"length":{"min":1,"max":2},"parameters":[{"name":"min","kind":{"scalar":{"type":"int"}},"default":{"int":0}}]}}}
            {"name":"len","kind":{"scalar":{"type":"int"}},"default":{"int":4}}
            {"name":"secret","kind":{"scalar":{"type":"bool"}},"secret":true}
        "#]],
    );
}

#[test]
fn documentation_groups_and_lists_reach_the_model() {
    let text = "/// The bus.\n/// Two lines.\ngroup bus { /** The port. */ port path; }\n\
                /// The motors.\nlist motors 1:8 { name string; max float 1.0; };";
    model(
        text,
        &expect![[r#"
        {"name":"bus","doc":["The bus.","Two lines."],"kind":{"group":[{"name":"port","kind":{"scalar":{"type":"path"}}}]}}
        {"name":"motors","doc":["The motors."],"kind":{"list":{"length":{"min":1,"max":8},"parameters":[{"name":"name","kind":{"scalar":{"type":"string"}}},{"name":"max","kind":{"scalar":{"type":"float"}},"default":{"float":1.0}}]}}}
    "#]],
    );
}

#[test]
fn a_syntax_error_does_not_hide_later_errors() {
    check(
        "a int 3 TT;\nb int 4\nc string;\nd int 0:5 7;\nrequire a < \"x\";\nrequire a == 1;\nlist m 1 { };\n\
         e int[1] 3;\nf string \"open;\ng int q;\nh string T unit;\n§;\ni int 5;",
        &expect![[r#"
            c.pdsl:2:9: error[syntax-error]: expected `;`, a flag or choices, found `TT`
            c.pdsl:3:8: error[missing-semicolon]: expected `;`
            c.pdsl:5:11: error[syntax-error]: expected `;` or a flag, found `7`
            c.pdsl:6:16: error[syntax-error]: expected a string or an operator, found `;`
            c.pdsl:7:15: error[syntax-error]: expected a string or an operator, found `;`
            c.pdsl:8:10: error[syntax-error]: expected `:`, found `{`
            c.pdsl:9:10: error[syntax-error]: expected `;`, a flag, a range or choices, found `3` (the length of an array is a range: `e int[1:1]`)
            c.pdsl:10:10: error[syntax-error]: expected `;`, a default, a flag or choices, found `"`
            c.pdsl:11:7: error[bad-default]: `q` cannot be the default of `int` (allowed is an integer of 32 bits)
            c.pdsl:12:16: error[syntax-error]: expected a string, found `;`
            c.pdsl:13:1: error[syntax-error]: expected a name, found `§`
        "#]],
    );
}

#[test]
fn a_missing_semicolon_is_one_error() {
    check(
        "a int 3\nb bool true\nc string\ngroup g { d int 1 T }\ne int 2 // two",
        &expect![[r#"
            c.pdsl:2:8: error[missing-semicolon]: expected `;`
            c.pdsl:3:12: error[missing-semicolon]: expected `;`
            c.pdsl:4:9: error[missing-semicolon]: expected `;`
            c.pdsl:5:20: error[missing-semicolon]: expected `;`
            c.pdsl:6:8: error[missing-semicolon]: expected `;`
        "#]],
    );
}

#[test]
fn errors_outside_declarations() {
    check_file(
        "",
        &expect![[r#"
            c.pdsl:1:1: error[empty-file]: expected `ComponentParams NAME { … };`, found an empty file
        "#]],
    );
    check_file("componentparams C { a int 1; }", &expect![[""]]);
    check_file(
        "Component C { a int 1; };",
        &expect![[r#"
        c.pdsl:1:1: error[syntax-error]: expected `ComponentParams`, found `Component`
    "#]],
    );
    check_file(
        "ComponentParams C { a int 1; }; b int 2;",
        &expect![[r#"
            c.pdsl:1:33: error[text-after-end]: unexpected text: a file contains one `ComponentParams NAME { … };`
        "#]],
    );
    check_file(
        "ComponentParams C { a int 1;",
        &expect![[r#"
            c.pdsl:1:29: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
    check_file(
        &format!("ComponentParams C {{ {} }};", "group g {".repeat(200)),
        &expect![[r#"
            c.pdsl:1:920: error[nested-too-deep]: brackets are nested more than 100 levels deep
        "#]],
    );
}

#[test]
fn names_are_unique_regardless_of_case() {
    check(
        "a int 1;\na int 2;\nA string;\ngroup a { a int 1; };\nlist b { };",
        &expect![[r#"
            c.pdsl:3:1: error[duplicate-name]: duplicate parameter `a`; first declared here at c.pdsl:2:1
            c.pdsl:4:1: error[duplicate-name]: parameter `A` differs from `a` only in case; first declared here at c.pdsl:2:1
            c.pdsl:5:7: error[duplicate-name]: duplicate parameter `a`; first declared here at c.pdsl:2:1
        "#]],
    );
}

#[test]
fn unknown_types_are_reported() {
    check(
        "a itn 1;\nb colour;\nc LONG 1;",
        &expect![[r#"
            c.pdsl:2:3: error[unknown-type]: unknown type `itn` (did you mean `int`?)
            c.pdsl:3:3: error[unknown-type]: unknown type `colour` (expected one of `bool`, `int`, `long`, `float`, `double`, `string`, `duration`, `path`)
        "#]],
    );
}

#[test]
fn defaults_fit_their_type_range_and_choices() {
    check(
        "a int 200 0:127;\nb int \"x\";\nc int 3000000000;\nd bool 1;\ne string fast;\nf string fsat {fast, slow};\n\
         g int 3 {1, 2};\nh float[2:3] [1.0];\ni float[] 1.0;\nj int [1];\nk int[] [1, 200, true] 0:127;\n\
         l duration \"soon\";\nm duration 5s :1s;\nn float 1e99;\no double 1e999 :1e400;\np path \"~/maps\";\nq path[] [\"a\", \"~\"];",
        &expect![[r#"
            c.pdsl:2:7: error[default-out-of-range]: the default 200 is outside the range; the range at c.pdsl:2:11 (allowed is from 0 to 127)
            c.pdsl:3:7: error[bad-default]: the string "x" cannot be the default of `int` (allowed is an integer of 32 bits)
            c.pdsl:4:7: error[bad-default]: the number 3000000000 cannot be the default of `int` (allowed is an integer of 32 bits)
            c.pdsl:5:8: error[bad-default]: the number 1 cannot be the default of `bool` (allowed is `true` or `false`)
            c.pdsl:6:10: error[bad-default]: `fast` cannot be the default of `string` (allowed is a string)
            c.pdsl:7:10: error[default-not-a-choice]: the default "fsat" is not one of the choices (allowed is a string, one of "fast", "slow"; did you mean `fast`?)
            c.pdsl:8:7: error[default-not-a-choice]: the default 3 is not one of the choices (allowed is an integer of 32 bits, one of 1, 2)
            c.pdsl:9:14: error[bad-default]: the default has length 1; allowed are 2 to 3 elements
            c.pdsl:10:11: error[bad-default]: expected the default of an array in brackets, found the number 1.0
            c.pdsl:11:7: error[bad-default]: only an array has a list of values as default (an array is declared with `int[]`, or with the range of its length: `int[3:3]`)
            c.pdsl:12:13: error[default-out-of-range]: the default 200 is outside the range; the range at c.pdsl:12:24 (allowed is from 0 to 127)
            c.pdsl:12:18: error[bad-default]: `true` cannot be the default of `int` (allowed is an integer of 32 bits)
            c.pdsl:13:12: error[bad-default]: the string "soon" cannot be the default of `duration` (allowed is a duration such as "50ms", or a number of milliseconds)
            c.pdsl:14:12: error[bad-range]: this range is empty: its end is below its start
            c.pdsl:15:9: error[bad-default]: the number 1e99 cannot be the default of `float` (allowed is a number of 32 bits)
            c.pdsl:16:10: error[bad-range]: a number that is too large cannot limit `double`; allowed is a number of 64 bits
            c.pdsl:16:17: error[bad-range]: a number that is too large cannot limit `double`; allowed is a number of 64 bits
            c.pdsl:17:8: error[home-in-path]: `~/maps` begins with `~`, which only a shell expands (write the path from this file, or an absolute one)
            c.pdsl:18:16: error[home-in-path]: `~` begins with `~`, which only a shell expands (write the path from this file, or an absolute one)
        "#]],
    );
}

#[test]
fn ranges_and_lengths_are_checked() {
    check(
        "a int 9:1;\nb string \"x\" 0:5;\nc int 0.5:3;\nd int 0:3000000000;\ne duration 1s:1ms;\nf int[4:2];\n\
         g int[-1:2];\nh int[0:0];\nlist i 1.5:2 { };\nj bool 0:1;\nk int {1, two, 1};",
        &expect![[r#"
            c.pdsl:2:7: error[bad-range]: this range is empty: its end is below its start
            c.pdsl:3:14: error[bad-range]: only numbers and durations have a range; this is of type `string`
            c.pdsl:4:7: error[bad-range]: the number 0.5 cannot limit `int`; allowed is an integer of 32 bits
            c.pdsl:5:9: error[bad-range]: the number 3000000000 cannot limit `int`; allowed is an integer of 32 bits
            c.pdsl:6:12: error[bad-range]: this range is empty: its end is below its start
            c.pdsl:7:7: error[bad-length]: the minimum length 4 is above the maximum 2
            c.pdsl:8:7: error[bad-length]: a length is an integer from 0 to 4294967295
            c.pdsl:9:9: error[bad-length]: the maximum length is 0
            c.pdsl:10:8: error[bad-length]: a length is an integer from 0 to 4294967295
            c.pdsl:11:8: error[bad-range]: only numbers and durations have a range; this is of type `bool`
            c.pdsl:12:11: error[bad-choice]: `two` is not of type `int`; allowed is an integer of 32 bits
            c.pdsl:12:16: error[bad-choice]: duplicate choice the number 1; first used here at c.pdsl:12:8
        "#]],
    );
}

#[test]
fn repeated_flags_are_reported() {
    check(
        "a int 1 T F;\nb int 1 T T;\nc int 1 unit \"m\" T unit \"s\";\nd int 1 t Restart SECRET;",
        &expect![[r#"
            c.pdsl:2:11: error[repeated-flag]: a parameter is either `T`, changeable while the component runs, or `F`, fixed; first used here at c.pdsl:2:9
            c.pdsl:3:11: error[repeated-flag]: duplicate flag; first used here at c.pdsl:3:9
            c.pdsl:4:20: error[repeated-flag]: duplicate flag; first used here at c.pdsl:4:9
        "#]],
    );
}

#[test]
fn only_numbers_can_have_a_unit() {
    check(
        "a bool true unit \"m\";\nb string \"\" unit \"m\";\nc duration 1s T unit \"s\";\nd float[] [] unit \"m\";",
        &expect![[r#"
            c.pdsl:2:13: error[bad-unit]: only numbers have a unit; this is of type `bool`
            c.pdsl:3:13: error[bad-unit]: only numbers have a unit; this is of type `string`
            c.pdsl:4:17: error[bad-unit]: only numbers have a unit; this is of type `duration`
        "#]],
    );
}

#[test]
fn files_and_their_elements_are_checked() {
    check(
        "f path \"a.xml\" reads \"innermodel\";\nfs path[] [] reads \"search\";\na int reads \"file\";\n\
         b path reads \"inermodel\";\nlist l { j string element \"joint\" of f; };\nc string element \"joint\" of fs;\n\
         d string element \"joynt\" of f;\ne path element \"node\" of f;\ng path reads \"file\" reads \"file\";\n\
         reads string \"element\"; element string \"of\"; of path reads \"planar_map\";",
        &expect![[r#"
            c.pdsl:4:7: error[bad-file-kind]: only a `path` names a file; this is of type `int`
            c.pdsl:5:14: error[bad-file-kind]: unknown kind of files `inermodel` (did you mean `innermodel`?)
            c.pdsl:7:29: error[bad-element]: `fs` names no InnerModel file (expected a parameter outside of groups, as in `inner_model path "arm.xml" reads "innermodel";`)
            c.pdsl:8:18: error[bad-element]: unknown kind of elements `joynt` (did you mean `joint`?)
            c.pdsl:9:8: error[bad-element]: only a `string` names an element; this is of type `path`
            c.pdsl:10:21: error[repeated-flag]: duplicate flag; first used here at c.pdsl:10:8
        "#]],
    );
}

#[test]
fn names_are_distinct_in_generated_code() {
    check(
        "maxSpeed int 1;\nmax_speed int 2;\ngroup MaxSpeed { x int 1; };\nlist max__speed { x2 int 1; x_2 int 1; type int 1; type_ int 1; };\n_ int 1; __ int 1;",
        &expect![[r#"
            c.pdsl:3:1: error[name-collision]: parameters `maxSpeed` and `max_speed` are both `max_speed` in generated code; first declared here at c.pdsl:2:1
            c.pdsl:4:7: error[duplicate-name]: parameter `MaxSpeed` differs from `maxSpeed` only in case; first declared here at c.pdsl:2:1
            c.pdsl:5:6: error[name-collision]: parameters `maxSpeed` and `max__speed` are both `max_speed` in generated code; first declared here at c.pdsl:2:1
            c.pdsl:5:52: error[name-collision]: parameters `type` and `type_` are both `type` in generated code; first declared here at c.pdsl:5:40
        "#]],
    );
}

#[test]
fn numbers_outside_their_type_are_reported() {
    check(
        "a int 2147483648;\nb int -2147483649:0;\nc long 9223372036854775808;\nd long -9223372036854775808 :9223372036854775807;\n\
         e long 0:99999999999999999999;\nf int 0xFFFFFFFF;\ng long 0xFFFFFFFFFFFFFFFF;\nh float -1e39:1e39;\ni duration 1e30s;\nj duration -1s;\n\
         k double nan;\nl int {1, 3000000000};\nm int[] [1, 3000000000];\nn int 1.0;\no duration -5;\np double 1e999 {1e999};",
        &expect![[r#"
            c.pdsl:2:7: error[bad-default]: the number 2147483648 cannot be the default of `int` (allowed is an integer of 32 bits)
            c.pdsl:3:7: error[bad-range]: the number -2147483649 cannot limit `int`; allowed is an integer of 32 bits
            c.pdsl:4:8: error[bad-default]: the number 9223372036854775808 cannot be the default of `long` (allowed is an integer of 64 bits)
            c.pdsl:6:10: error[bad-range]: the number 99999999999999999999 cannot limit `long`; allowed is an integer of 64 bits
            c.pdsl:7:7: error[bad-default]: the number 4294967295 cannot be the default of `int` (allowed is an integer of 32 bits)
            c.pdsl:8:8: error[bad-default]: the number 18446744073709551615 cannot be the default of `long` (allowed is an integer of 64 bits)
            c.pdsl:9:9: error[bad-range]: the number -1e39 cannot limit `float`; allowed is a number of 32 bits
            c.pdsl:9:15: error[bad-range]: the number 1e39 cannot limit `float`; allowed is a number of 32 bits
            c.pdsl:10:12: error[bad-default]: a duration that is too long cannot be the default of `duration` (allowed is a duration such as "50ms", or a number of milliseconds)
            c.pdsl:11:12: error[bad-default]: `-1s` cannot be the default of `duration` (allowed is a duration such as "50ms", or a number of milliseconds)
            c.pdsl:12:10: error[bad-default]: `nan` cannot be the default of `double` (allowed is a number of 64 bits)
            c.pdsl:13:11: error[bad-choice]: the number 3000000000 is not of type `int`; allowed is an integer of 32 bits
            c.pdsl:14:13: error[bad-default]: the number 3000000000 cannot be the default of `int` (allowed is an integer of 32 bits)
            c.pdsl:15:7: error[bad-default]: the number 1.0 cannot be the default of `int` (allowed is an integer of 32 bits)
            c.pdsl:16:12: error[bad-default]: the number -5 cannot be the default of `duration` (allowed is a duration such as "50ms", or a number of milliseconds)
            c.pdsl:17:10: error[bad-default]: a number that is too large cannot be the default of `double` (allowed is a number of 64 bits)
            c.pdsl:17:17: error[bad-choice]: a number that is too large is not of type `double`; allowed is a number of 64 bits
        "#]],
    );
}

#[test]
fn choices_are_checked() {
    check(
        "a int {};\nb string x {};\nlist path { port int 1; };\nlist path2 {};\nc bool true {true};\nd int 1 {1, 2,};",
        &expect![[r#"
            c.pdsl:2:7: error[bad-choice]: expected at least one choice
            c.pdsl:3:10: error[bad-default]: `x` cannot be the default of `string` (allowed is a string)
            c.pdsl:3:12: error[bad-choice]: expected at least one choice
            c.pdsl:7:15: error[syntax-error]: expected a value, found `}`
        "#]],
    );
}

#[test]
fn the_nesting_of_blocks_is_limited() {
    let nested = |depth: usize| {
        let open: String = (0..depth).map(|i| format!("list l{i} 1:2 {{ ")).collect();
        format!(
            "{open} x int[1:3] [1, 2] 0:9; require max(x) < 9 \"\"; {}",
            "};".repeat(depth)
        )
    };
    let model = check(&nested(20), &expect![[""]]);
    assert_eq!(
        Parameters::from_json(&model.to_json()).expect("its own JSON"),
        model
    );
    check(
        &nested(21),
        &expect![[r#"
            c.pdsl:2:296: error[nested-too-deep]: groups and lists are nested more than 20 levels deep
        "#]],
    );
}

#[test]
fn a_file_without_its_last_brace_hides_no_other_error() {
    check_file(
        "ComponentParams C {\n  a itn 3;\n  group g {\n    b int 3:1;\n    c int 4;\n",
        &expect![[r#"
            c.pdsl:2:5: error[unknown-type]: unknown type `itn` (did you mean `int`?)
            c.pdsl:4:11: error[bad-range]: this range is empty: its end is below its start
            c.pdsl:6:1: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
    check_file(
        "ComponentParams C {\n  a int 3 T;\n  a float 2;\n  b int",
        &expect![[r#"
            c.pdsl:3:3: error[duplicate-name]: duplicate parameter `a`; first declared here at c.pdsl:2:3
            c.pdsl:4:8: error[syntax-error]: expected `;`, a default, a flag or choices, found the end of the file
        "#]],
    );
    check_file(
        "ComponentParams C",
        &expect![[r#"
        c.pdsl:1:18: error[syntax-error]: expected `{`, found the end of the file
    "#]],
    );
}

#[test]
fn habits_of_other_languages_get_the_way_to_write_it_here() {
    check(
        "a: float = 0.5;\nb float = 0.5 0:1;\nfloat c 0.5;\nd float 1 [0:3];\ne boolean true;\nf float64 1;\npath g \"x\";\nh duration 5 Hz;\ni float 0.5 0:1 m/s;\nj int 5 kg;\nk float[3] [1, 2, 3];\nl enum {a, b};\nm int 10 Hz;\nn float[3];",
        &expect![[r#"
            c.pdsl:2:2: error[syntax-error]: expected a name, found `:` (a declaration has no `:`, as in `a float 0.5;`)
            c.pdsl:3:9: error[syntax-error]: expected `;`, a default, a flag or choices, found `=` (the default follows the type: `b float VALUE;`)
            c.pdsl:4:7: error[unknown-type]: unknown type `c` (the name comes first: `c float`)
            c.pdsl:5:11: error[syntax-error]: expected `;`, a flag or choices, found `[` (a range has no brackets, as in `0:1`)
            c.pdsl:6:3: error[unknown-type]: unknown type `boolean` (did you mean `bool`?)
            c.pdsl:7:3: error[unknown-type]: unknown type `float64` (did you mean `double`?)
            c.pdsl:8:6: error[unknown-type]: unknown type `g` (the name comes first: `g path`)
            c.pdsl:9:14: error[unknown-time-unit]: unknown unit of time `Hz` (5 Hz is a period of `200ms`)
            c.pdsl:10:17: error[unknown-time-unit]: unknown unit of time `m` (a unit follows the default and the range: `unit "m/s"`)
            c.pdsl:11:9: error[syntax-error]: expected `;`, a flag or choices, found `kg` (a unit follows the default and the range: `unit "kg"`)
            c.pdsl:12:12: error[syntax-error]: expected `;`, a flag or choices, found `[` (the length of an array is a range: `k float[3:3]`)
            c.pdsl:13:3: error[unknown-type]: unknown type `enum` (did you mean `string`?)
            c.pdsl:14:10: error[unknown-time-unit]: unknown unit of time `Hz` (a unit follows the default and the range: `unit "Hz"`)
            c.pdsl:15:8: error[bad-default]: only an array has a list of values as default (an array is declared with `float[]`, or with the range of its length: `float[3:3]`)
        "#]],
    );
}

#[test]
fn the_order_of_c_and_misspelt_flags_are_not_taken_for_something_else() {
    check(
        "float a = 0.5;\nint b: 3;\nc =3;\nd int 3 secert;\ne int 3 TF;\nf int 3 ft;\ng float 1 0:3 rad;\nh float 1 [0, 3];\ni float 1 0..3;",
        &expect![[r#"
            c.pdsl:2:9: error[syntax-error]: expected `;`, a default, a flag or choices, found `=` (the name comes first, then the type and the default: `a float VALUE;`)
            c.pdsl:3:5: error[unknown-type]: unknown type `b` (the name comes first: `b int`)
            c.pdsl:4:3: error[syntax-error]: expected a name, found `=` (the type and the default follow the name: `c TYPE VALUE;`)
            c.pdsl:5:9: error[syntax-error]: expected `;`, a flag or choices, found `secert` (did you mean `secret`?)
            c.pdsl:6:9: error[syntax-error]: expected `;`, a flag or choices, found `TF`
            c.pdsl:7:9: error[syntax-error]: expected `;`, a flag or choices, found `ft` (a unit follows the default and the range: `unit "ft"`)
            c.pdsl:8:15: error[syntax-error]: expected `;` or a flag, found `rad` (a unit follows the default and the range: `unit "rad"`)
            c.pdsl:9:11: error[syntax-error]: expected `;`, a flag or choices, found `[` (a range has no brackets, as in `0:1`)
            c.pdsl:10:11: error[syntax-error]: expected `;`, a flag, a range or choices, found `0` (a range has a colon, as in `0:1`)
        "#]],
    );
}

/// Each unit that is none is explained by the declaration around it, which may be long.
#[test]
fn many_errors_in_one_declaration_take_time_in_proportion() {
    let time = |count: usize| {
        let text = format!("ComponentParams C {{ a int {} }};", "1 sec\n".repeat(count));
        let mut sources = SourceMap::new();
        let source = sources.add("c.pdsl", text);
        let started = Instant::now();
        let (_, found) = rc_pdsl::parse(&sources, source);
        assert!(found.into_iter().count() >= count);
        started.elapsed()
    };
    let (short, long) = (time(2500), time(20_000));
    assert!(
        long < short * 30 + Duration::from_millis(200),
        "2,500 errors {short:?}, 20,000 errors {long:?}"
    );
}
