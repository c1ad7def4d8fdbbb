//! A workspace with the component that exchanges bytes with a Python program.

use rc_test_support::share_builds;
use std::path::Path;
use std::process::Command;

const RCGEN: &str = env!("CARGO_BIN_EXE_rcgen");
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Generates the component of `fixtures` in `folder` and runs its test. The test reads the Python
/// program's `samples` and writes the component's bytes to `ours`.
pub(crate) fn check(folder: &Path, fixtures: &Path, samples: &Path, ours: &Path) {
    let workspace = folder.join("robot");
    let component = workspace.join("components/exported");
    run(Command::new(RCGEN)
        .args(["init", "--framework", ROOT])
        .arg(&workspace));
    let copy = |from: &Path, to: &Path| {
        std::fs::copy(from, to).expect("a copy");
    };
    share_builds(&workspace, Path::new("components/features"));
    std::fs::create_dir_all(component.join("tests")).expect("a folder");
    for file in ["Exported.idsl", "exported.cdsl"] {
        copy(&fixtures.join(file), &component.join(file));
    }
    copy(
        &fixtures.join("checks.rs"),
        &component.join("tests/checks.rs"),
    );
    let cdsl = component.join("exported.cdsl");
    run(Command::new(RCGEN)
        .arg(cdsl)
        .args(["--middleware", "local"]));
    let manifest = component.join("Cargo.toml");
    let text = std::fs::read_to_string(&manifest).expect("a manifest");
    // The last table of a new component is that of the dependencies of its tests.
    assert!(text.contains("[dev-dependencies]"), "{text}");
    let text = text + "rc-local.workspace = true\nrc-runtime.workspace = true\n";
    std::fs::write(manifest, text).expect("to write");
    // The target folder of this test run, so that nothing is built twice.
    let target = Path::new(RCGEN)
        .ancestors()
        .nth(2)
        .expect("target/debug/rcgen");
    run(Command::new(env!("CARGO"))
        .args([
            "test",
            "--workspace",
            "--offline",
            "-q",
            "-j1",
            "--test",
            "checks",
        ])
        .current_dir(&workspace)
        .env("CARGO_TARGET_DIR", target)
        .env("EXPORTED_SAMPLES", samples)
        .env("EXPORTED_OURS", ours));
}

fn run(command: &mut Command) {
    let output = command.output().expect("a program that starts");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert!(output.status.success(), "{command:?}\n{said}");
}
