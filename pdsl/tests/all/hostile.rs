//! Hostile texts: parsing them ends, and in bounded time.

use arbtest::arbitrary::{Result, Unstructured};
use arbtest::arbtest;
use rc_configuration::model::Parameters;
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_syntax::MemoryLoader;
use std::fmt::Write;

fn load(text: &str) -> (Option<Parameters>, Diagnostics) {
    let mut sources = SourceMap::new();
    let source = sources.add("c.pdsl", text);
    rc_pdsl::load(&mut sources, &MemoryLoader::default(), source)
}

fn configure(model: &Parameters, toml: &str) -> Diagnostics {
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", toml);
    rc_configuration::check(&sources, source, Some(model)).1
}

fn codes(found: &Diagnostics) -> Vec<&'static str> {
    found.iter().map(|d| d.code).collect()
}

/// The codes of the diagnostics for a component with an `int a`, a `bool b` and one rule.
fn rule(condition: &str) -> Vec<&'static str> {
    let text = format!("ComponentParams C {{ a int 1; b bool true; require {condition} \"\"; }};");
    let (model, found) = load(&text);
    let model = model.unwrap_or_default();
    let again = Parameters::from_json(&model.to_json()).expect("its own JSON");
    assert_eq!(again, model);
    codes(&configure(&again, "parameters.a = 2"));
    codes(&found)
}

#[test]
fn long_chains_of_operators_are_parsed() {
    let many = 20_000;
    for condition in [
        format!("{} b", "not ".repeat(many)),
        format!("{}b", "!".repeat(2)).replace('!', "not "),
        format!("a < {} 5", "- ".repeat(many)),
        format!("{} a == {}", "a + ".repeat(many), many + 1),
        format!("{} a == 1", "a * ".repeat(many)),
        format!("{} b", "b and ".repeat(many)),
        format!("{} b", "a == 1 or not b or ".repeat(many / 2)),
    ] {
        assert_eq!(rule(&condition), [""; 0], "{}", &condition[..20]);
    }
}

#[test]
fn nesting_is_limited() {
    for (open, inner, close) in [
        ("(", "b", ")"),
        ("not (", "b", ")"),
        ("b and not (b or b and not ", "b", ")"),
    ] {
        let nested = |depth| format!("{}{inner}{}", open.repeat(depth), close.repeat(depth));
        let found = rule(&nested(98));
        assert!(!found.contains(&"nested-too-deep"), "{found:?}");
        assert_eq!(rule(&nested(101)), ["nested-too-deep"]);
    }
    let sums = |depth: usize| {
        format!(
            "{}1{} > 0",
            "(a - - (a * ".repeat(depth),
            "))".repeat(depth)
        )
    };
    assert_eq!(rule(&sums(49)), [""; 0]);
    assert_eq!(rule(&sums(51)), ["nested-too-deep"]);
}

#[test]
fn unclosed_brackets_are_parsed() {
    for text in [
        "ComponentParams C { group g { ".repeat(60),
        format!(
            "ComponentParams C {{ {}",
            "group g { list l { x int ".repeat(45)
        ),
        format!("ComponentParams C {{ require {}", "(".repeat(90)),
        format!("ComponentParams C {{ require {} ; }};", "a < (".repeat(45)),
        format!("ComponentParams C {{ a int[] {} ; }};", "[".repeat(90)),
        format!("ComponentParams C {{ a int {} ; }};", "{".repeat(90)),
    ] {
        assert!(load(&text).1.has_errors(), "{text}");
    }
}

#[test]
fn large_files_are_parsed() {
    let many = 4000;
    let mut text = String::from("ComponentParams C {\n");
    let mut toml = String::from("[parameters]\n");
    for i in 0..many {
        let _ = writeln!(text, "/// {i}\np{i} int {i} 0:{many} T unit \"m\"; // x");
        let _ = writeln!(text, "require p{i} >= 0 \"p{i}\";");
        let _ = writeln!(toml, "p{i} = {}", i + 1);
    }
    text.push_str("list m { id int; require id >= 0 \"\"; };\nrequire unique(m.id) \"\";\n};\n");
    for i in 0..many {
        let _ = writeln!(toml, "[[parameters.m]]\nid = {i}");
    }
    let (model, found) = load(&text);
    assert_eq!(codes(&found), [""; 0]);
    let model = model.expect("parameters");
    assert_eq!(codes(&configure(&model, &toml)), [""; 0]);
    let toml = toml.replace("id = 7\n", "id = 8\n");
    assert_eq!(codes(&configure(&model, &toml)), ["rule-broken"]);
    let toml = "a.".repeat(1000) + "b = 1\n" + &"[".repeat(1000);
    assert_eq!(codes(&configure(&model, &toml)), ["toml-syntax"]);
}

const WORDS: [&str; 60] = [
    "ComponentParams",
    "import",
    "group",
    "list",
    "require",
    "int",
    "long",
    "float",
    "double",
    "string",
    "duration",
    "path",
    "bool",
    "T",
    "F",
    "unit",
    "restart",
    "secret",
    "and",
    "or",
    "not",
    "min",
    "max",
    "len",
    "unique",
    "a",
    "b",
    "c.d",
    "{",
    "}",
    "(",
    ")",
    "[",
    "]",
    ";",
    ":",
    ",",
    ".",
    "=",
    "==",
    "<",
    ">=",
    "!",
    "&&",
    "+",
    "-",
    "*",
    "/",
    "\"",
    "\"x\"",
    "1",
    "-2.5",
    "9999999999999999999",
    "5ms",
    "1e400s",
    "true",
    "//",
    "/*",
    "*/",
    "\n",
];

/// Tries `property` with random inputs of growing length, the same in every run.
fn try_all(property: fn(&mut Unstructured<'_>) -> Result<()>) {
    for n in 1..=400_u64 {
        arbtest(property).seed(n << 32 | (4 * n)).run();
    }
}

#[test]
fn random_sequences_of_words_are_parsed() {
    try_all(|u| {
        let mut text = String::new();
        if u.arbitrary()? {
            text.push_str("ComponentParams C { a int 1; b bool true; list c { d duration; ");
        }
        while !u.is_empty() {
            text.push_str(u.choose(&WORDS)?);
            if u.ratio(3, 4)? {
                text.push(' ');
            }
        }
        let (model, _) = load(&text);
        configure(&model.unwrap_or_default(), &text);
        Ok(())
    });
}

#[test]
fn random_texts_are_parsed() {
    try_all(|u| {
        let text: String = u.arbitrary()?;
        load(&text);
        load(&format!("ComponentParams C {{ a int; require a {text}"));
        configure(&Parameters::default(), &text);
        Ok(())
    });
}
