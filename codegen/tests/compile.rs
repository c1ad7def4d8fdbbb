//! Generated code compiles, without a warning, and is as rustfmt leaves it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const RCGEN: &str = env!("CARGO_BIN_EXE_rcgen");
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

fn run(command: &mut Command) -> Output {
    let output = command.output().expect("a program that starts");
    let (out, err) = (
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr),
    );
    assert!(output.status.success(), "{command:?}\n{out}\n{err}");
    output
}

/// `cargo` in a workspace, with the target folder that this test was built in, so that nothing is built twice.
fn cargo(workspace: &Path, args: &[&str]) {
    let target = Path::new(RCGEN)
        .ancestors()
        .nth(2)
        .expect("target/debug/rcgen");
    run(Command::new(env!("CARGO"))
        .args(args)
        .current_dir(workspace)
        .env("CARGO_TARGET_DIR", target));
}

/// One component with every construct of the languages.
#[test]
fn everything_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let workspace = folder.path().join("robot");
    run(Command::new(RCGEN)
        .args(["init", "--framework", ROOT])
        .arg(&workspace));
    let component = workspace.join("components/everything");
    std::fs::create_dir(&component).expect("a folder");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/compile");
    for entry in std::fs::read_dir(fixtures).expect("the fixtures") {
        let path = entry.expect("a fixture").path();
        let text = std::fs::read_to_string(&path).expect("a text");
        let root = Path::new(ROOT).canonicalize().expect("this project");
        let text = text.replace("FRAMEWORK", &root.to_string_lossy());
        std::fs::write(component.join(path.file_name().expect("a name")), text).expect("a file");
    }
    // The versions that this project is built with are in the cache.
    std::fs::copy(
        Path::new(ROOT).join("Cargo.lock"),
        workspace.join("Cargo.lock"),
    )
    .expect("a copy");
    run(Command::new(RCGEN).arg(component.join("everything.cdsl")));
    for package in ["everything", "everything_generated"] {
        cargo(&workspace, &["fmt", "--check", "-p", package]);
    }
    let packages = ["-p", "everything", "-p", "everything_generated"];
    let mut clippy = vec!["clippy", "--offline", "-q", "-j1"];
    clippy.extend(packages);
    clippy.extend(["--", "-D", "warnings"]);
    cargo(&workspace, &clippy);
}

/// What is committed is what would be generated.
#[test]
fn committed_components_are_fresh() {
    let folders = std::fs::read_dir(Path::new(ROOT).join("components")).expect("components");
    let files = folders
        .flatten()
        .filter_map(|folder| std::fs::read_dir(folder.path()).ok());
    let files: Vec<PathBuf> = files.flatten().flatten().map(|file| file.path()).collect();
    let cdsl: Vec<&PathBuf> = files
        .iter()
        .filter(|path| path.extension().is_some_and(|e| e == "cdsl"))
        .collect();
    assert!(cdsl.len() >= 5, "{cdsl:?}");
    for path in cdsl {
        run(Command::new(RCGEN).arg("--check").arg(path));
    }
}
