//! `rcdeploy` finds programs where cargo builds them.

use rc_cdsl::model::Middleware;
use rc_codegen::{FileLoader, Project, generation};
use rc_diagnostics::SourceMap;
use std::path::Path;
use std::process::Command;

const NETWORK: &str =
    "Deployment target_folder { Component hello { cdsl \"../hello/hello.cdsl\"; }; };\n";

fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("a file");
}

/// `rcdeploy` in a workspace with this manifest and one component, which is not built.
fn rcdeploy(root: &Path, manifest: &str, args: &[&str]) -> Command {
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
    command.args(args).arg("deployments/hello.ddsl");
    command.current_dir(root).env_remove("CARGO_TARGET_DIR");
    command.env_remove("CARGO_BUILD_TARGET_DIR");
    command.env_remove("CARGO_BUILD_TARGET");
    command
}

const CHECK: [&str; 3] = ["check", "--format", "short"];

fn report(command: &mut Command) -> String {
    let output = command.output().expect("rcdeploy");
    String::from_utf8(output.stderr).expect("UTF-8")
}

/// The output of `rcdeploy check` for a network in a workspace with this manifest.
fn check(root: &Path, manifest: &str, target: Option<&str>) -> String {
    let mut command = rcdeploy(root, manifest, &CHECK);
    report(command.envs(target.map(|target| ("CARGO_TARGET_DIR", target))))
}

#[test]
fn programs_are_found_where_cargo_builds_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    // A comment after the header, and the table in another notation.
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
        let report = check(&root, manifest, None);
        assert!(report.contains(&program("target")), "{report}");
        let report = check(&root, manifest, Some("/elsewhere/built"));
        assert!(report.contains(&program("/elsewhere/built")), "{report}");
        // Relative to where cargo was started, which is where rcdeploy is.
        let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
        command.args(CHECK).arg("hello.ddsl");
        command.current_dir(root.join("deployments"));
        command
            .env("CARGO_TARGET_DIR", "built")
            .env_remove("CARGO_BUILD_TARGET_DIR");
        let said = super::target_folder::report(&mut command);
        let built = root.join("deployments/built/release/hello");
        assert!(said.contains(&built.display().to_string()), "{said}");
        let config = root.join(".cargo/config.toml");
        write(&config, "[build]\ntarget-dir = \"built\"\n");
        let report = check(&root, manifest, None);
        assert!(report.contains(&program("built")), "{report}");
        // A platform that the user has set is a folder more, and the variable comes first.
        let platform = "[build]\ntarget = \"robot-unknown-linux-gnu\"\n";
        write(&config, platform);
        let report = check(&root, manifest, None);
        assert!(
            report.contains(&program("target/robot-unknown-linux-gnu")),
            "{report}"
        );
        let mut command = rcdeploy(&root, manifest, &CHECK);
        let report =
            super::target_folder::report(command.env("CARGO_BUILD_TARGET", "specs/arm.json"));
        assert!(report.contains(&program("target/arm")), "{report}");
        std::fs::remove_file(config).expect("it was there");
    }
}

#[test]
fn a_workspace_that_cargo_rejects_is_reported_once_with_its_message() {
    let folder = tempfile::tempdir().expect("a folder");
    let manifest = "[workspace]\nmembers = [\"hello\", \"missing\"]\n";
    let report = check(folder.path(), manifest, None);
    assert_eq!(report.matches("error[cargo-failed]").count(), 1, "{report}");
    assert!(report.contains("missing/Cargo.toml"), "{report}");
    assert!(report.contains("correct the manifest"), "{report}");
}

/// A description may lie apart from the package that `rcgen --out` generated from it.
#[test]
fn a_component_that_was_generated_elsewhere_is_found_in_its_workspace() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    let manifest =
        "[workspace]\nmembers = [\"parts/*\"]\n[workspace.dependencies]\nrc-runtime = \"0.1\"\n";
    write(&root.join("Cargo.toml"), manifest);
    let (cdsl, out) = (root.join("models/hello.cdsl"), root.join("parts/hello"));
    let text = "Component hello { Communications { }; language rust; };\n";
    write(&cdsl, text);
    let generate = || {
        let mut sources = SourceMap::new();
        let project = Project::load(&cdsl, &mut sources, &FileLoader::default());
        let project = project.expect("a file").0.expect("a component");
        let found = generation::generate(&project, out.clone(), Middleware::Iceoryx2, &mut sources);
        assert!(!found.expect("to write").has_errors());
    };
    generate();
    write(
        &root.join("deployments/hello.ddsl"),
        &NETWORK.replace("../hello", "../models"),
    );
    let rcdeploy = |args: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rcdeploy"));
        command.args(args).arg("deployments/hello.ddsl");
        // A robot has no cargo.
        command.current_dir(&root).env("CARGO", "/nowhere/cargo");
        command
            .env_remove("CARGO_TARGET_DIR")
            .output()
            .expect("rcdeploy")
    };
    let report = |args: &[&str]| String::from_utf8(rcdeploy(args).stderr).expect("UTF-8");
    // The program is missing, and nothing else.
    let missing = report(&CHECK);
    assert_eq!(missing.matches("error[").count(), 1, "{missing}");
    let program = root.join("target/release/hello");
    assert!(
        missing.contains(&program.display().to_string()),
        "{missing}"
    );
    let plan = rcdeploy(&["plan", "--unbuilt", "--format", "json"]);
    let plan = String::from_utf8(plan.stdout).expect("UTF-8");
    let configuration = out.join("etc/config.toml");
    assert!(
        plan.contains(&configuration.display().to_string()),
        "{plan}"
    );
    // `up --build` generates a changed model there, and builds there.
    write(&cdsl, &text.replace("language", "period 20ms; language"));
    let stale = report(&CHECK);
    assert!(stale.contains("error[stale-generated]"), "{stale}");
    let option = format!(" --out {}`", out.display());
    assert!(stale.contains(&option), "{stale}");
    let built = report(&["up", "--build"]);
    assert!(built.contains("cargo cannot be started"), "{built}");
    assert!(!root.join("models/generated").exists());
    assert!(!report(&CHECK).contains("stale-generated"));
}

#[test]
fn a_plan_from_descriptions_does_not_run_cargo() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    let manifest = "[workspace]\nmembers = [\"hello\", \"missing\"]\n";
    for (target, program) in [
        (None, root.join("target/release/hello")),
        (Some("/elsewhere"), "/elsewhere/release/hello".into()),
    ] {
        let args = ["plan", "--unbuilt", "--format", "json"];
        let mut command = rcdeploy(&root, manifest, &args);
        command.envs(target.map(|target| ("CARGO_TARGET_DIR", target)));
        let output = command.output().expect("rcdeploy");
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let plan = String::from_utf8(output.stdout).expect("UTF-8");
        assert!(plan.contains(&program.display().to_string()), "{plan}");
    }
}

#[test]
fn without_cargo_programs_are_in_the_usual_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    let manifest = "[workspace]\nmembers = [\"hello\"]\n";
    let mut command = rcdeploy(&root, manifest, &CHECK);
    let report = report(command.env("CARGO", root.join("no/cargo")));
    let program = root.join("target/release/hello");
    let missing = format!(
        "the executable of `hello`, {}, does not exist",
        program.display()
    );
    assert!(report.contains(&missing), "{report}");
}

/// As in a workspace of `rcgen init --shared-target`, started by a timer or a service.
#[test]
fn without_cargo_programs_are_where_its_configuration_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    write(
        &root.join(".cargo/config.toml"),
        "[build]\ntarget-dir = \"../shared\"\n",
    );
    let mut command = rcdeploy(&root, "[workspace]\nmembers = [\"hello\"]\n", &CHECK);
    let report = report(command.env("CARGO", root.join("no/cargo")));
    let program = root.join("../shared/release/hello");
    assert!(report.contains(&program.display().to_string()), "{report}");
}

#[test]
fn a_manifest_that_is_not_toml_is_reported_with_its_location() {
    let folder = tempfile::tempdir().expect("a folder");
    let report = check(folder.path(), "[workspace\n", None);
    assert!(report.contains("error[cargo-failed]"), "{report}");
    assert!(report.contains("Cargo.toml: TOML parse error"), "{report}");
    assert!(!report.contains("is in no cargo workspace"), "{report}");
}

/// Commands that do not need the programs reject the same manifests, with the exit code for invalid
/// input.
#[test]
fn every_command_rejects_an_invalid_manifest_as_input_error() {
    let folder = tempfile::tempdir().expect("a folder");
    for manifest in [
        "[workspace\n",
        "[workspace]\nmembers = [\"hello\", \"missing\"]\n",
    ] {
        let export = ["export", "--to", "systemd", "--out", "units"];
        let output = rcdeploy(folder.path(), manifest, &export).output();
        let output = output.expect("rcdeploy");
        let report = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{report}");
        assert!(report.contains("error[cargo-failed]: "), "{report}");
        assert!(report.contains("Cargo.toml"), "{report}");
        assert!(report.contains("--> deployments/hello.ddsl:1:"), "{report}");
    }
    let output = rcdeploy(folder.path(), "[workspace\n", &["plan", "--unbuilt"]).output();
    let output = output.expect("rcdeploy");
    let report = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{report}");
    assert!(report.contains("error[cargo-failed]: "), "{report}");
    assert!(report.contains("--> deployments/hello.ddsl:1:"), "{report}");
}

/// Before, the units named no program.
#[test]
fn an_export_refuses_a_component_in_no_workspace() {
    let folder = tempfile::tempdir().expect("a folder");
    for engine in ["systemd", "compose", "kubernetes"] {
        let export = ["export", "--to", engine, "--image", "robot", "--out", "out"];
        let output = rcdeploy(folder.path(), "[package]\nname = \"other\"\n", &export).output();
        let output = output.expect("rcdeploy");
        let report = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{report}");
        assert!(
            report.contains("hello.cdsl is in no cargo workspace"),
            "{report}"
        );
        assert!(!folder.path().join("out").exists());
    }
}
