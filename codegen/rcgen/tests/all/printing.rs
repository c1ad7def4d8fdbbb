//! How `rcgen` prints: colours, locales, devices that take nothing, and texts of other systems.

use crate::folders::rcgen;
use std::fs::{self, File};
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in files {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    }
    folder
}

fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcgen"));
    command.args(args).current_dir(folder);
    command.env_remove("RC_IDSL_PATH").env_remove("NO_COLOR");
    command
}

/// Exit code and standard error.
fn run(command: &mut Command) -> (i32, String) {
    let output = command.stderr(Stdio::piped()).output().expect("rcgen");
    let err = String::from_utf8(output.stderr).expect("UTF-8");
    (output.status.code().expect("an exit code"), err)
}

#[test]
fn what_cannot_be_printed_is_a_failure() {
    let folder = folder(&[("m.idsl", "module  M { };")]);
    for args in [&["explain"][..], &["fmt", "--check", "m.idsl"], &["--help"]] {
        let full = || File::options().write(true).open("/dev/full").expect("it");
        let (code, err) = run(command(folder.path(), args).stdout(full()));
        assert_eq!(code, 3, "{args:?}: {err}");
        let wanted = "cannot write to standard output: No space left on device";
        assert!(err.contains(wanted), "{args:?}: {err}");
    }
    // A reader that has enough is not a failure.
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let (code, err) = run(command(folder.path(), &["explain"]).stdout(writer));
    assert_eq!((code, err.as_str()), (0, ""));
}

#[test]
fn a_wrong_word_sends_nothing_to_the_terminal() {
    let folder = folder(&[]);
    let (code, err) = run(&mut command(folder.path(), &["--nix\u{1b}[31m\u{202e}"]));
    assert_eq!(code, 2, "{err}");
    assert!(
        err.contains("unexpected argument") && err.contains(r"\u{202e}"),
        "{err}"
    );
    assert!(!err.contains(['\u{1b}', '\u{202e}']), "{err}");
}

#[test]
fn colours_and_ascii_are_chosen() {
    let folder = folder(&[("größe.idsl", "module M { struct S { flaot a; }; };")]);
    let check = |color: &[&str], set: (&str, &str)| {
        let args = [&["check", "größe.idsl"], color].concat();
        let mut command = command(folder.path(), &args);
        run(command.env_remove("LC_ALL").env(set.0, set.1)).1
    };
    let utf8 = ("LC_ALL", "C.UTF-8");
    // Standard error is a pipe.
    assert!(!check(&[], utf8).contains('\u{1b}'));
    assert!(!check(&["--color", "never"], utf8).contains('\u{1b}'));
    assert!(check(&["--color", "always"], utf8).contains("\u{1b}[1m"));
    assert!(check(&[], utf8).contains("größe.idsl:1:23"));
    let ascii = check(&[], ("LC_ALL", "C"));
    assert!(
        ascii.is_ascii() && ascii.contains(r"gr\u{f6}\u{df}e.idsl:1:23"),
        "{ascii}"
    );
    let args = ["check", "größe.idsl", "--format", "json"];
    let json = run(command(folder.path(), &args).env("LC_ALL", "C")).1;
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["file"], "größe.idsl");
}

#[test]
fn a_file_is_one_by_whatever_path_it_is_imported() {
    let files = folder(&[
        ("a/Base.idsl", "module Base { struct B { int x; }; };"),
        (
            "a/Left.idsl",
            "import \"Base.idsl\"; module Left { struct L { Base::B b; }; };",
        ),
        (
            "b/Top.idsl",
            "import \"../a/Left.idsl\"; import \"../b/../a/Base.idsl\"; import \"link/Base.idsl\";\n\
             module Top { struct T { Left::L l; Base::B b; }; };",
        ),
        ("a/Ring.idsl", "import \"../a/Knot.idsl\"; module Ring { };"),
        ("a/Knot.idsl", "import \"../a/Ring.idsl\"; module Knot { };"),
        ("a/base.pdsl", "ComponentParams base { speed float 1.0; };"),
        (
            "a/left.pdsl",
            "import \"base.pdsl\"; ComponentParams left { left int 1; };",
        ),
        (
            "b/top.pdsl",
            "import \"../a/left.pdsl\"; import \"link/base.pdsl\"; ComponentParams top { top int 1; };",
        ),
    ]);
    std::os::unix::fs::symlink("../a", files.path().join("b/link")).expect("a link");
    for (place, top) in [("b", ""), ("", "b/")] {
        for file in ["Top.idsl", "top.pdsl"] {
            let result = rcgen(
                &files.path().join(place),
                &["check", &format!("{top}{file}")],
            );
            assert_eq!(
                result,
                (0, String::new(), String::new()),
                "{file} in {place}"
            );
        }
    }
    let (code, _, err) = rcgen(&files.path().join("a"), &["check", "Ring.idsl"]);
    assert_eq!(code, 1);
    let cycle = "cyclic import: Ring.idsl → Knot.idsl → Ring.idsl";
    assert!(err.contains(cycle) && !err.contains("two files"), "{err}");
}

#[test]
fn ends_of_lines_of_other_systems_are_kept() {
    let text = "module M\r\n{\r\n    // of a\r\n    struct S\r\n    {\r\n        int a;\r\n    };\r\n};\r\n";
    let cr = "module M { struct S { int a; // of a\rint b; }; };";
    let folder = folder(&[
        ("M.idsl", text),
        ("Cr.idsl", cr),
        (
            "w.xml",
            "<innerModel>\r\n  <transform id=\"a\"/>\r\n</innerModel>\r\n",
        ),
    ]);
    let folder = folder.path();
    for file in ["M.idsl", "w.xml"] {
        rcgen(folder, &["fmt", file]);
        let once = fs::read_to_string(folder.join(file)).expect("a file");
        assert_eq!(
            once.matches('\n').count(),
            once.matches("\r\n").count(),
            "{once:?}"
        );
        assert_eq!(rcgen(folder, &["fmt", "--check", file]).0, 0, "{file}");
    }
    assert_eq!(
        fs::read_to_string(folder.join("M.idsl")).expect("a file"),
        text
    );
    let (code, _, err) = rcgen(folder, &["fmt", "Cr.idsl"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let formatted = fs::read_to_string(folder.join("Cr.idsl")).expect("a file");
    assert!(
        formatted.contains("int a; // of a\n        int b;\n"),
        "{formatted}"
    );
}

#[test]
fn generated_code_with_other_ends_of_lines_is_up_to_date() {
    let cdsl = "Component c { Communications { }; language rust; };";
    let folder = folder(&[("c.cdsl", cdsl)]);
    let folder = folder.path();
    assert_eq!(rcgen(folder, &["c.cdsl"]).0, 0);
    let mut open = vec![folder.join("generated")];
    while let Some(path) = open.pop() {
        if path.is_dir() {
            open.extend(
                fs::read_dir(&path)
                    .expect("a folder")
                    .flatten()
                    .map(|e| e.path()),
            );
        } else {
            let text = fs::read_to_string(&path).expect("a text");
            fs::write(&path, text.replace('\n', "\r\n")).expect("to write");
        }
    }
    let (code, _, err) = rcgen(folder, &["c.cdsl", "--check"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let lib = folder.join("generated/src/lib.rs");
    let text = fs::read_to_string(&lib).expect("a text");
    fs::write(&lib, text + "// more\r\n").expect("to write");
    assert_eq!(rcgen(folder, &["c.cdsl", "--check"]).0, 1);
}

#[test]
fn what_is_not_there_is_said_to_be_missing() {
    let folder = folder(&[]);
    for args in [["check", "nodir"], ["fmt", "nodir"], ["check", "none.cdsl"]] {
        let (code, _, err) = rcgen(folder.path(), &args);
        assert_eq!(code, 3, "{args:?}: {err}");
        let missing = err.contains("there is no such file") || err.contains("No such file");
        assert!(missing && err.contains(args[1]), "{err}");
        assert!(!err.contains("did you mean"), "{err}");
    }
    fs::create_dir(folder.path().join("robots")).expect("a folder");
    for command in ["check", "fmt"] {
        let (code, _, err) = rcgen(folder.path(), &[command, "robts"]);
        assert_eq!(code, 3, "{command}: {err}");
        assert!(err.contains("did you mean `robots`?"), "{command}: {err}");
    }
}
