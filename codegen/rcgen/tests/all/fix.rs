//! `rcgen fix`.

use crate::folders::rcgen;
use rc_diagnostics::{SourceMap, fix};
use rcgen::languages::Language;
use std::path::{Path, PathBuf};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Writes a file and runs a command of `rcgen` on it. Returns its exit code, what it printed, and the file.
fn run(folder: &Path, file: &str, text: &str, words: &[&str]) -> (i32, String, String, String) {
    std::fs::write(folder.join(file), text).expect("a file");
    let words: Vec<&str> = words.iter().copied().chain([file]).collect();
    let (code, out, err) = rcgen(folder, &words);
    let after = std::fs::read_to_string(folder.join(file)).expect("a file");
    (code, out, err, after)
}

#[test]
fn what_can_only_be_meant_is_fixed() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "\u{feff}module M\r\n{\u{a0}struct S { int x\r\n int y }\r\n};\r\n";
    let (code, out, err, after) = run(folder.path(), "m.idsl", text, &["fix"]);
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
    let (code, out, err, after) = run(folder.path(), "n.idsl", text, &["check", "--fix"]);
    assert_eq!((code, out.as_str(), after.as_str()), (1, "", text));
    assert!(
        err.ends_with("`rcgen fix --likely` fixes 1 of these\n"),
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
    let (code, _, err, after) = run(folder, "c.cdsl", text, &["check"]);
    assert_eq!((code, after.as_str()), (1, text));
    assert!(err.contains("`rcgen fix` fixes 1 of these"), "{err}");
    assert!(err.contains("`rcgen fix --likely` fixes"), "{err}");

    let (code, out, err, after) = run(folder, "c.cdsl", text, &["fix", "--likely"]);
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
    let again = rcgen(folder, &["fix", "--likely", "c.cdsl"]);
    assert_eq!(again, (0, String::new(), String::new()));
}

#[test]
fn editors_get_the_edit() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "module M { struct S { strign name }; };";
    let (_, _, err, after) = run(
        folder.path(),
        "m.idsl",
        text,
        &["check", "--format", "json"],
    );
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

#[test]
fn what_is_missing_is_added_and_limits_are_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let write = |file: &str, text: &str| std::fs::write(folder.join(file), text).expect("a file");
    let grip = "module Grip { interface Grip { void press(float f); }; };\n";
    write("Grip.idsl", grip);
    write(
        "hand.pdsl",
        "ComponentParams hand { speed float 1.0 0:2; };\n",
    );
    let header = "// About the file.\n\n";
    let hand = "Component hand { Communications { implements Grip; }; language rust; parameters \"hand.pdsl\"; };\n";
    let (code, out, err, after) = run(
        folder,
        "hand.cdsl",
        &format!("{header}{hand}"),
        &["fix", "--likely"],
    );
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert_eq!(after, format!("{header}import \"Grip.idsl\";\n\n{hand}"));
    assert_eq!(out, "fix hand.cdsl:3:1: add `import \"Grip.idsl\";`\n");
    // A file that is imported already, and has no such interface.
    write("Other.idsl", "module Other { };\n");
    let text = "import \"Other.idsl\";\nComponent c { Communications { requires Other; }; language rust; };\n";
    let (code, out, _, after) = run(folder, "c.cdsl", text, &["fix", "--likely"]);
    assert_eq!((code, out.as_str(), after.as_str()), (1, "", text));

    write(
        "asker.cdsl",
        "import \"Grip.idsl\";\nComponent asker { Communications { requires Grip; }; language rust; };\n",
    );
    let network = "Deployment n\n{\n    Component a { cdsl \"hand.cdsl\"; parameters { speed 7.5; }; };\n    Component b { cdsl \"hand.cdsl\"; };\n    Component c { cdsl \"asker.cdsl\"; };\n};\n";
    write("n.ddsl", network);
    let mut editor = crate::lsp::Editor::open_folder(folder);
    editor.open("n.ddsl", network);
    // The server may check the file once more, because it was just written, and has no fixes meanwhile.
    let start = std::time::Instant::now();
    let fixes = loop {
        editor.wait_for("n.ddsl", &[("out-of-range", 2), ("several-providers", 4)]);
        let fixes = editor.fixes("n.ddsl");
        if !fixes.is_empty() || start.elapsed() > crate::lsp::LIMIT {
            break fixes;
        }
    };
    assert_eq!(
        fixes,
        ["2:55 Write `2.0`", "5:0 Add `bind c.Grip -> a.Grip;`"]
    );
    // A near name of a parameter replaces the name, not the value.
    editor.change("n.ddsl", &network.replace("speed 7.5", "sped 1.5"));
    editor.wait_for(
        "n.ddsl",
        &[("unknown-parameter", 2), ("several-providers", 4)],
    );
    assert_eq!(editor.fixes("n.ddsl")[0], "2:49 Write `speed`");
    editor.end();
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
    described(&Path::new(ROOT).join("graph/language/domains"), &mut files);
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
