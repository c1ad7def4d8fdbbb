//! Type checkers of Python on generated packages.

use crate::folders::rcgen;
use rc_test_support::python;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Copies a component of `tests/compile` as one in Python, and generates it. Returns its package.
fn in_python(name: &str, folder: &Path) -> PathBuf {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/compile");
    let own = folder.join(name);
    fs::create_dir(&own).expect("a folder");
    for entry in fs::read_dir(fixtures.join(name)).expect("the fixtures") {
        let path = entry.expect("a fixture").path();
        let mut text = fs::read_to_string(&path).expect("a text");
        if path.extension().is_some_and(|ending| ending == "cdsl") {
            for (from, to) in [
                ("language rust", "language python"),
                ("LANGUAGE Rust", "language python"),
                // A crate is not for Python.
                ("planar_map \"FRAMEWORK/components/planar_map\";", ""),
                ("asynchronous true; ", ""),
                (" asynchronous true;", ""),
                // The context has this name itself.
                ("SUBSCRIBESTO State,", "SUBSCRIBESTO State as changed,"),
            ] {
                text = text.replace(from, to);
            }
        }
        // The context has the tree of the option `InnerModelViewer`.
        let begin = "ComponentParams everything\n{\n";
        let viewer = "    viewer bool false T;\n    inner_model path \"\";\n";
        text = text.replace(begin, &format!("{begin}{viewer}"));
        fs::write(own.join(path.file_name().expect("a name")), text).expect("a file");
    }
    let (code, _, err) = rcgen(&own, &[&format!("{name}.cdsl")]);
    assert_eq!(code, 0, "{err}");
    own
}

/// mypy and pyright in their strict modes, and ruff, have nothing to say about generated packages,
/// new workers and new tests.
#[test]
fn type_checkers_are_content() {
    const CHECKERS: &str = include_str!("../python/checkers.txt");
    let test = "type_checkers_are_content";
    let Some(interpreter) = python::packages("python-checkers", CHECKERS, test) else {
        return;
    };
    let bin = interpreter.parent().expect("a folder of programs");
    let folder = tempfile::tempdir().expect("a folder");
    let framework = Path::new(ROOT)
        .join("python")
        .canonicalize()
        .expect("the framework");
    let framework = framework.to_string_lossy();
    for name in ["everything", "awkward", "arm", "shelf", "aged"] {
        let component = in_python(name, folder.path());
        let run = |program: &str, args: &[&str]| {
            let mut command = Command::new(bin.join(program));
            command
                .args(args)
                .current_dir(&component)
                .env("MYPYPATH", format!("{framework}:generated:src"));
            let output = command.output().expect("it starts");
            let out = String::from_utf8_lossy(&output.stdout);
            let err = String::from_utf8_lossy(&output.stderr);
            assert!(
                output.status.success(),
                "{program}: {}\n{out}{err}",
                component.display()
            );
        };
        run("ruff", &["check", "--quiet", "."]);
        run("ruff", &["format", "--quiet", "--check", "src", "tests"]);
        run(
            "mypy",
            &["--strict", "--explicit-package-bases", "generated", "src"],
        );
        let project = format!(
            "{{\"include\": [\"generated\", \"src\"], \"typeCheckingMode\": \"strict\", \"extraPaths\": [\"{framework}\", \"generated\", \"src\"]}}"
        );
        fs::write(component.join("pyrightconfig.json"), project).expect("a file");
        let python = interpreter.to_string_lossy();
        run("pyright", &["--pythonpath", &python]);
    }
}
