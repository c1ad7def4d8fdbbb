//! Imports of `.pdsl` files.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use expect_test::{Expect, expect};
use rc_configuration::model::Parameters;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

/// Checks the diagnostics for `c.pdsl`, which can import `others`.
fn check(text: &str, others: &[(&str, &str)], expected: &Expect) -> Option<Parameters> {
    let mut sources = SourceMap::new();
    let source = sources.add("c.pdsl", text);
    let mut texts = others.to_vec();
    texts.push(("c.pdsl", text));
    let loader = MemoryLoader::new(texts);
    let (model, found) = rc_pdsl::load(&mut sources, &loader, source);
    expected.assert_eq(&render(&sources, &found, Format::Short));
    model
}

fn names(model: Option<Parameters>) -> String {
    let model = model.expect("parameters");
    let names: Vec<String> = model.parameters.into_iter().map(|p| p.name).collect();
    format!("{}: {}", model.name, names.join(" "))
}

#[test]
fn imported_parameters_are_first() {
    let model = check(
        "import \"bus.pdsl\"; import \"../common/log\"\n/// Mine.\nComponentParams C { own int 1; require own < rate \"\"; };",
        &[
            (
                "bus.pdsl",
                "import \"base.pdsl\"; ComponentParams Bus { rate int 9; require base < rate \"\"; };",
            ),
            ("base.pdsl", "ComponentParams Base { base int 1; };"),
            (
                "log.pdsl",
                "import \"base.pdsl\"; ComponentParams Log { level int 1; };",
            ),
        ],
        &expect![[r#"
            c.pdsl:1:42: error[missing-semicolon]: expected `;`
        "#]],
    );
    assert_eq!(model.as_ref().map(|m| m.rules.len()), Some(2));
    assert_eq!(names(model), "C: base rate level own");
}

#[test]
fn unresolved_and_useless_imports_are_reported() {
    check(
        "import \"bsu.pdsl\";\nimport \"lib/nothing\";\nimport \"bus\";\nimport \"bus.pdsl\";\nimport \"empty.pdsl\";\nimport \"broken\";\nComponentParams C { };",
        &[
            ("bus.pdsl", "ComponentParams Bus { rate int 9; };"),
            ("Bsv.idsl", ""),
            ("empty.pdsl", "ComponentParams Empty { };"),
            ("broken.pdsl", "ComponentParam Broken { };"),
        ],
        &expect![[r#"
            c.pdsl:1:8: error[import-not-found]: cannot find `bsu.pdsl`; searched in memory (did you mean `bus.pdsl`?)
            c.pdsl:2:8: error[import-not-found]: cannot find `nothing`; searched in memory (copy the file into one of these folders, or pass its folder with `-I DIR`)
            c.pdsl:4:8: warning[unused-import]: duplicate import `bus.pdsl`; first imported here at c.pdsl:3:8
            c.pdsl:5:8: warning[unused-import]: `empty.pdsl` declares nothing
            broken.pdsl:1:1: error[syntax-error]: expected `ComponentParams`, found `ComponentParam` (did you mean `ComponentParams`?)
        "#]],
    );
}

#[test]
fn a_cycle_of_imports_is_an_error() {
    let model = check(
        "import \"a.pdsl\";\nComponentParams C { c int 1; };",
        &[
            (
                "a.pdsl",
                "import \"b.pdsl\"; ComponentParams A { a int 1; };",
            ),
            (
                "b.pdsl",
                "import \"c.pdsl\"; ComponentParams B { b int 1; };",
            ),
        ],
        &expect![[r#"
            b.pdsl:1:8: error[import-cycle]: cyclic import: c.pdsl → a.pdsl → b.pdsl → c.pdsl
        "#]],
    );
    assert_eq!(names(model), "C: b a c");
    check(
        "import \"c.pdsl\";\nComponentParams C { c int 1; };",
        &[],
        &expect![[r#"
            c.pdsl:1:8: error[import-cycle]: cyclic import: c.pdsl → c.pdsl
        "#]],
    );
}

#[test]
fn a_name_in_two_files_is_reported_with_both_locations() {
    check(
        "import \"a.pdsl\";\nComponentParams C {\n speed int 1;\n Max int 1;\n some_name int 3;\n };",
        &[(
            "a.pdsl",
            "ComponentParams A {\n int speed;\n speed int 1;\n max int 2; someName int 3; require max < Speed \"\"; };",
        )],
        &expect![[r#"
            c.pdsl:3:2: error[duplicate-name]: duplicate parameter `speed`; first declared here at a.pdsl:3:2
            c.pdsl:4:2: error[duplicate-name]: parameter `Max` differs from `max` only in case; first declared here at a.pdsl:4:2
            c.pdsl:5:2: error[name-collision]: parameters `someName` and `some_name` are both `some_name` in generated code; first declared here at a.pdsl:4:13
            a.pdsl:2:6: error[unknown-type]: unknown type `speed` (the name comes first: `speed int`)
            a.pdsl:4:43: error[unknown-parameter]: unknown parameter `Speed` (did you mean `speed`?)
        "#]],
    );
}

#[test]
fn the_depth_of_imports_is_limited() {
    let texts: Vec<(String, String)> = (0..200)
        .map(|i| {
            let text = format!(
                "import \"f{}.pdsl\"; ComponentParams F {{ p{i} int 1; }};",
                i + 1
            );
            (format!("f{i}.pdsl"), text)
        })
        .collect();
    let texts: Vec<(&str, &str)> = texts
        .iter()
        .map(|(n, t)| (n.as_str(), t.as_str()))
        .collect();
    check(
        "import \"f0\"; ComponentParams C { };",
        &texts,
        &expect![[r#"
            f48.pdsl:1:8: error[nested-too-deep]: imports are nested more than 50 levels deep
        "#]],
    );
}
