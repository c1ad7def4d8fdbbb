//! `rcdeploy` finds programs where cargo builds them.

use std::path::Path;
use std::process::Command;

const NETWORK: &str =
    "Deployment target_folder { Component hello { cdsl \"../hello/hello.cdsl\"; }; };\n";

fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("a file");
}

/// What `rcdeploy check` reports of a network in a workspace with this manifest.
fn check(root: &Path, manifest: &str, target: Option<&str>) -> String {
    write(&root.join("Cargo.toml"), manifest);
    write(
        &root.join("hello/Cargo.toml"),
        "[package]\nname = \"hello\"\nversion = \"0.1.0\"\n",
    );
    write(&root.join("hello/src/main.rs"), "fn main() {}\n");
    write(
        &root.join("hello/hello.cdsl"),
        "Component hello { Communications { }; language rust; };\n",
    );
    write(&root.join("deployments/hello.ddsl"), NETWORK);
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
    command.args(["check", "deployments/hello.ddsl", "--format", "short"]);
    command.current_dir(root).env_remove("CARGO_TARGET_DIR");
    command.env_remove("CARGO_BUILD_TARGET_DIR");
    command.envs(target.map(|target| ("CARGO_TARGET_DIR", target)));
    let output = command.output().expect("rcdeploy");
    String::from_utf8(output.stderr).expect("UTF-8")
}

#[test]
fn programs_are_where_cargo_builds_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    // A comment behind the header, and another way to write the table.
    for manifest in [
        "[workspace] # robots\nmembers = [\"hello\"]\n",
        "workspace.members = [\"hello\"]\n",
    ] {
        let program = |target: &str| {
            let path = root.join(target).join("release/hello");
            format!(
                "the executable of `hello`, {}, does not exist",
                path.display()
            )
        };
        let told = check(&root, manifest, None);
        assert!(told.contains(&program("target")), "{told}");
        let told = check(&root, manifest, Some("/elsewhere/built"));
        assert!(told.contains(&program("/elsewhere/built")), "{told}");
        let config = root.join(".cargo/config.toml");
        write(&config, "[build]\ntarget-dir = \"built\"\n");
        let told = check(&root, manifest, None);
        assert!(told.contains(&program("built")), "{told}");
        std::fs::remove_file(config).expect("it was there");
    }
}

#[test]
fn a_workspace_that_cargo_refuses_is_reported_once_with_cargos_words() {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = "[workspace]\nmembers = [\"hello\", \"missing\"]\n";
    let told = check(folder.path(), manifest, None);
    assert_eq!(told.matches("error[cargo-failed]").count(), 1, "{told}");
    assert!(told.contains("missing/Cargo.toml"), "{told}");
    assert!(told.contains("correct the manifest"), "{told}");
}
