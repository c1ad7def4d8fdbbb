//! `rcgen check --fix`.

use crate::folders::rcgen;
use rc_diagnostics::{SourceMap, fix};
use rcgen::languages::Language;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Writes a file and runs `rcgen check` with some words. Returns its exit code, what it printed, and
/// the file.
fn check(folder: &Path, file: &str, text: &str, words: &[&str]) -> (i32, String, String, String) {
    std::fs::write(folder.join(file), text).expect("a file");
    let words: Vec<&str> = ["check", file].iter().chain(words).copied().collect();
    let (code, out, err) = rcgen(folder, &words);
    let after = std::fs::read_to_string(folder.join(file)).expect("a file");
    (code, out, err, after)
}

#[test]
fn what_can_only_be_meant_is_fixed() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "\u{feff}module M\r\n{\u{a0}struct S { int x\r\n int y }\r\n};\r\n";
    let (code, out, err, after) = check(folder.path(), "m.idsl", text, &["--fix"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    let fixed = "\u{feff}module M\r\n{ struct S { int x;\r\n int y; }\r\n};\r\n";
    assert_eq!(after, fixed);
    // The character is an error of its own: what is missing shows only without it.
    assert_eq!(
        out.lines().collect::<Vec<_>>(),
        [
            "fix m.idsl:2:2: `U+00A0` becomes ` `",
            "fix m.idsl:2:19: add `;`",
            "fix m.idsl:3:7: add `;`",
        ]
    );
    // A suggestion is none of these.
    let text = "module M { struct S { strign name; }; };";
    let (code, out, err, after) = check(folder.path(), "n.idsl", text, &["--fix"]);
    assert_eq!((code, out.as_str(), after.as_str()), (1, "", text));
    assert!(
        err.ends_with("`rcgen check --fix=likely` fixes 1 of these\n"),
        "{err}"
    );
}

#[test]
fn near_names_are_fixed_on_demand_in_every_file_that_was_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let grip = "module Grip { struct Force { flaot newton; }; interface Grip { void press(Force f); }; };\n";
    std::fs::write(folder.join("Grip.idsl"), grip).expect("a file");
    let text = "import \"Grip.idsl\";\nimport \"Laser.idsl\";\n\
                Component c { Communications { requires Lasr; implements Girp }; langauge rust; };\n";
    let (code, _, err, after) = check(folder, "c.cdsl", text, &[]);
    assert_eq!((code, after.as_str()), (1, text));
    assert!(
        err.contains("`rcgen check --fix` fixes 1 of these"),
        "{err}"
    );
    assert!(err.contains("`rcgen check --fix=likely` fixes"), "{err}");

    let (code, out, err, after) = check(folder, "c.cdsl", text, &["--fix=likely"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(
        after.ends_with("requires Laser; implements Grip; }; language rust; };\n"),
        "{after}"
    );
    assert!(
        out.contains("fix c.cdsl:3:41: `Lasr` becomes `Laser`"),
        "{out}"
    );
    let grip = std::fs::read_to_string(folder.join("Grip.idsl")).expect("a file");
    assert!(grip.contains("{ float newton; }"), "{grip}");
    // Nothing is left to do.
    let again = rcgen(folder, &["check", "c.cdsl", "--fix=likely"]);
    assert_eq!(again, (0, String::new(), String::new()));
}

#[test]
fn editors_get_the_edit() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "module M { struct S { strign name }; };";
    let (_, _, err, after) = check(folder.path(), "m.idsl", text, &["--format", "json"]);
    assert_eq!(after, text);
    let edits: Vec<serde_json::Value> = err
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    let fix = |at: usize| &edits[at]["mend"];
    assert_eq!(fix(0)["text"], "string");
    assert_eq!(fix(0)["certain"], false);
    assert_eq!(fix(0)["start"]["column"], 23);
    assert_eq!(fix(0)["end"]["column"], 29);
    assert_eq!(fix(1)["text"], ";");
    assert_eq!(fix(1)["certain"], true);
    assert_eq!(fix(1)["start"], fix(1)["end"]);
}

/// The description files below a folder of this repository.
fn described(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            described(&path, files);
        } else if Language::of(&path).is_some() {
            files.push(path);
        }
    }
}

/// Each of the first semicolons of every file is deleted once.
#[test]
fn a_missing_semicolon_comes_back() {
    let mut files = Vec::new();
    described(&Path::new(ROOT).join("components"), &mut files);
    described(&Path::new(ROOT).join("graph/domains"), &mut files);
    let (mut fixed, mut texts) = (0, 0);
    for file in files {
        let language = Language::of(&file).expect("a language");
        let text = std::fs::read_to_string(&file).expect("a file");
        for (at, _) in text.match_indices(';').take(12) {
            let without = format!("{}{}", &text[..at], &text[at + 1..]);
            let mut sources = SourceMap::new();
            let source = sources.add(&file, &*without);
            let found = (language.parse)(&sources, source);
            texts += 1;
            let only = |d: &rc_diagnostics::Diagnostic| d.code == "missing-semicolon";
            if !found.has_errors() || !found.iter().all(only) {
                continue;
            }
            let after = fix::edited(&without, &fix::edits(&sources, &found, source, false));
            let source = sources.add(&file, &*after);
            let left = (language.parse)(&sources, source);
            assert!(!left.has_errors(), "{}: {after}", file.display());
            fixed += 1;
        }
    }
    // Others are in comments, or their absence reads as something else.
    assert!(fixed * 2 > texts, "{fixed} of {texts}");
}

#[test]
fn a_file_that_cannot_be_written_stays_as_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "module M { struct S { int x } };";
    let file = folder.path().join("m.idsl");
    std::fs::write(&file, text).expect("a file");
    let mut permissions = std::fs::metadata(&file).expect("a file").permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&file, permissions).expect("permissions");
    let (code, out, err) = rcgen(folder.path(), &["check", "m.idsl", "--fix"]);
    assert_eq!((code, out.as_str()), (3, ""));
    assert!(err.contains("m.idsl: the file is read-only"), "{err}");
    assert_eq!(std::fs::read_to_string(&file).expect("a file"), text);
}
