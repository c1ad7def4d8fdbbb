//! The grammars for tree-sitter in `editors/tree-sitter`: they are made from the languages' own grammars, and
//! accept the same texts.

mod convert;

use crate::grammar::lay_out;
use crate::random::Random;
use crate::{grammar_of, spoil};
use convert::TreeSitter;
use expect_test::expect_file;
use rc_diagnostics::SourceMap;
use rc_test_support::python::{self, skipped};
use rcgen::languages::{LANGUAGES, Language};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Random texts of each language: half of them with mistakes.
const TEXTS: u64 = 300;

/// The rules in which the parser must follow several ways, because a `;` ends a declaration or is one, or a
/// value may be what comes behind it.
fn conflicts(language: &str) -> &'static [&'static [&'static str]] {
    match language {
        "pdsl" => &[&["type_ref"], &["literal", "range"]],
        "smdsl" => &[
            &["states"],
            &["initial"],
            &["end"],
            &["transitions"],
            &["transition"],
        ],
        "gdsl" => &[
            &["entity"],
            &["relation"],
            &["tree"],
            &["composed_by"],
            &["range"],
            &["member"],
            &["promotes"],
            &["query"],
            &["require"],
        ],
        "kdsl" => &[
            &["grounding"],
            &["ring"],
            &["posture"],
            &["solver"],
            &["point"],
            &["whole"],
            &["setting"],
            &["mount"],
            &["holding"],
            &["pair"],
            &["coordinate"],
            &["motion"],
            &["payload"],
            &["inverse"],
            &["gravity"],
        ],
        "dproto" => &[&["import"]],
        _ => &[],
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn the_grammars_of_tree_sitter_are_those_of_the_languages() {
    for language in LANGUAGES {
        let name = language.extension;
        let folder = root().join("editors/tree-sitter").join(name);
        let grammar = grammar_of(language);
        let made = TreeSitter::of(&grammar);
        for (file, text) in [
            ("src/grammar.json", made.json(name, conflicts(name))),
            ("queries/highlights.scm", made.highlights()),
            ("queries/folds.scm", made.folds()),
            ("queries/indents.scm", made.indents()),
        ] {
            expect_file![folder.join(file)].assert_eq(&text);
        }
    }
}

/// The code of the first error of a text, as its language alone reads it.
fn refused(language: Language, file: &Path, text: &str) -> Option<&'static str> {
    let mut sources = SourceMap::new();
    let source = sources.add(file, text);
    let found = (language.parse)(&sources, source);
    let error = rc_diagnostics::Severity::Error;
    let mut all = found.iter().filter(|one| one.severity == error);
    all.next().map(|one| one.code)
}

/// The description files below a folder.
fn described(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        let name = name.to_string_lossy();
        if path.is_dir() && !name.starts_with('.') && name != "target" && name != "node_modules" {
            described(&path, files);
        } else if Language::of(&path).is_some() {
            files.push(path);
        }
    }
}

/// Needs the parsers in C that `cargo xtask soak editor` generates.
#[test]
fn tree_sitter_accepts_what_the_languages_accept() {
    let test = "tree_sitter_accepts_what_the_languages_accept";
    let Some(parsers) = std::env::var_os("RC_TREE_SITTER") else {
        return skipped(test, "`cargo xtask soak editor` runs it");
    };
    let package = "tree-sitter==0.25.2";
    let Some(python) = python::packages("tree-sitter", package, test) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let mut texts: Vec<(Language, PathBuf, String)> = Vec::new();
    let mut files = Vec::new();
    described(&root(), &mut files);
    for file in files {
        let language = Language::of(&file).expect("a language");
        // Tests have files that are no texts.
        if let Ok(text) = std::fs::read_to_string(&file) {
            texts.push((language, file, text));
        }
    }
    let own = texts.len();
    for language in LANGUAGES {
        let grammar = grammar_of(language);
        for seed in 0..TEXTS {
            let mut random = Random::new(seed);
            let words = grammar.words(&mut random);
            let text = if seed % 2 == 0 {
                lay_out(&words, &mut random)
            } else {
                String::from_utf8_lossy(&spoil(words, &[], &mut random)).into_owned()
            };
            let file = folder.path().join(format!("{seed}.{}", language.extension));
            std::fs::write(&file, &text).expect("a file");
            texts.push((language, file, text));
        }
    }
    let list: Vec<String> = texts
        .iter()
        .map(|(_, file, _)| file.display().to_string())
        .collect();
    let listed = folder.path().join("list");
    std::fs::write(&listed, list.join("\n")).expect("a list");
    let script = root().join("codegen/rcgen/tests/languages/tree_sitter/parse.py");
    let output = Command::new(python)
        .arg(script)
        .args([Path::new(&parsers), &root().join("editors/tree-sitter")])
        .args([&listed, folder.path()])
        .output()
        .expect("Python");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let accepted = String::from_utf8(output.stdout).expect("a text");
    let accepted: Vec<bool> = accepted.lines().map(|line| line == "yes").collect();
    assert_eq!(accepted.len(), texts.len());

    let mut exceptions: BTreeMap<&str, (usize, BTreeSet<&str>)> = BTreeMap::new();
    for (number, ((language, file, text), accepts)) in texts.iter().zip(accepted).enumerate() {
        let (by_tree_sitter, by_language) = exceptions.entry(language.extension).or_default();
        match (refused(*language, file, text), accepts) {
            (None, false) => {
                assert!(number >= own, "{}", file.display());
                *by_tree_sitter += 1;
            }
            (Some(code), true) => {
                by_language.insert(code);
            }
            _ => {}
        }
    }
    let mut told = String::new();
    for (language, (by_tree_sitter, by_language)) in exceptions {
        let codes: Vec<&str> = by_language.into_iter().collect();
        let _ = writeln!(
            told,
            ".{language}: tree-sitter alone refuses {by_tree_sitter} texts, the language alone some with: {}",
            codes.join(", ")
        );
    }
    expect_file!["exceptions.txt"].assert_eq(&told);
}
