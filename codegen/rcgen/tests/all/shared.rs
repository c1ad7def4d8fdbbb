//! The crate `interfaces`: components of a workspace share their types.

use crate::folders::{changed, files, rcgen};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use tempfile::TempDir;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
const BASE: &str = "module Base { struct Pose { float x; float y; }; };\n";
const SCAN: &str =
    "import \"Base.idsl\";\nmodule Scan { interface Scans { void scan(Base::Pose from); }; };\n";
const GRIP: &str = "module Grip { interface Gripper { void grip(float force); }; };\n";

fn write(path: &Path, text: &str) {
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(path, text).expect("a file");
}

/// A workspace whose folder of interfaces contains `Base.idsl`, `Scan.idsl` and `Grip.idsl`.
fn workspace() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let (code, _, err) = rcgen(folder.path(), &["init", "robot", "--framework", ROOT]);
    assert_eq!(code, 0, "{err}");
    let robot = folder.path().join("robot");
    for (file, text) in [("Base", BASE), ("Scan", SCAN), ("Grip", GRIP)] {
        write(&robot.join(format!("interfaces/{file}.idsl")), text);
    }
    (folder, robot)
}

/// Writes a component. Returns the path of its description, relative to the workspace.
fn component(robot: &Path, name: &str, import: &str, slots: &str) -> String {
    let path = format!("components/{name}/{name}.cdsl");
    let text = format!(
        "import \"{import}\";\nComponent {name} {{ Communications {{ {slots} }}; language rust; }};\n"
    );
    write(&robot.join(&path), &text);
    path
}

fn succeeds(folder: &Path, args: &[&str]) -> String {
    let (code, out, err) = rcgen(folder, args);
    assert_eq!((code, err.as_str()), (0, ""), "{args:?}\n{out}");
    out
}

/// The modules of the crate.
fn modules(robot: &Path) -> Vec<String> {
    let text = std::fs::read_to_string(robot.join("interfaces/generated/src/lib.rs"));
    let text = text.expect("the root of the crate");
    let modules = text
        .lines()
        .filter_map(|line| line.strip_prefix("pub mod "));
    let modules = modules.map(|line| line.trim_end_matches(';').to_owned());
    modules.collect()
}

fn times(folder: &Path) -> Vec<(PathBuf, SystemTime)> {
    let files = files(folder).into_keys();
    let time = |path: &PathBuf| folder.join(path).metadata().and_then(|m| m.modified());
    files
        .map(|path| (path.clone(), time(&path).expect("a time")))
        .collect()
}

#[test]
fn one_component_adds_its_modules_and_removes_none() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    let b = component(&robot, "b", "Grip.idsl", "implements Gripper;");
    assert_eq!(modules(&robot), [""; 0]);
    let out = succeeds(&robot, &[&a]);
    assert!(
        out.contains("create interfaces/generated/src/scan.rs\n"),
        "{out}"
    );
    assert_eq!(modules(&robot), ["base", "scan"]);
    succeeds(&robot, &[&b]);
    assert_eq!(modules(&robot), ["base", "grip", "scan"]);
    // A path from the component's folder has the same effect.
    let (_, _, err) = rcgen(&robot.join("components/b"), &["b.cdsl", "--check"]);
    assert_eq!(err, "");
    std::fs::remove_dir_all(robot.join("components/a")).expect("a folder");
    succeeds(&robot, &[&b]);
    assert_eq!(modules(&robot), ["base", "grip", "scan"]);
    // After the removal of a type, the crate is out of date.
    let scan = robot.join("interfaces/generated/src/grip.rs");
    std::fs::write(&scan, "").expect("a file");
    let (code, _, err) = rcgen(&robot, &["--check", &b]);
    let stale =
        "components/b/b.cdsl is not up to date: update ../../interfaces/generated/src/grip.rs\n";
    assert!(code == 1 && err.starts_with(stale), "{code} {err}");
}

#[test]
fn the_whole_workspace_is_the_exact_union() {
    let (_folder, robot) = workspace();
    component(&robot, "a", "Scan.idsl", "publishes Scans;");
    component(&robot, "b", "Laser.idsl", "implements Laser;");
    component(&robot, "c", "Speech.idsl", "requires Speech;");
    succeeds(&robot, &["components/b/b.cdsl", "--middleware", "dds"]);
    succeeds(&robot, &["."]);
    let all = [
        "base",
        "grip",
        "robo_comp_generic_base",
        "robo_comp_laser",
        "robo_comp_speech",
        "scan",
    ];
    assert_eq!(modules(&robot), all);
    // Each keeps its middleware.
    let manifest = std::fs::read_to_string(robot.join("components/b/generated/Cargo.toml"));
    assert!(manifest.expect("a manifest").contains("rc-dds.workspace"));
    succeeds(&robot, &["--check", "."]);
    std::fs::remove_dir_all(robot.join("components/c")).expect("a folder");
    let (code, _, err) = rcgen(&robot, &["--check", "."]);
    assert_eq!(code, 1);
    let stale =
        "the workspace is not up to date: remove interfaces/generated/src/robo_comp_speech.rs\n";
    assert!(err.contains(stale), "{err}");
    succeeds(&robot, &["components"]);
    assert_eq!(modules(&robot), all, "a part of the workspace removes none");
    let out = succeeds(&robot, &["."]);
    let removed = "remove interfaces/generated/src/robo_comp_speech.rs\n";
    assert!(out.contains(removed), "{out}");
    assert_eq!(
        modules(&robot),
        all.map(str::to_owned)
            .iter()
            .filter(|m| *m != "robo_comp_speech")
            .cloned()
            .collect::<Vec<_>>()
    );
}

#[test]
fn unchanged_files_are_not_written() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    let b = component(&robot, "b", "Base.idsl", "");
    succeeds(&robot, &[&a]);
    let before = times(&robot);
    assert_eq!(succeeds(&robot, &[&a]), "");
    assert_eq!(times(&robot), before);
    succeeds(&robot, &[&b]);
    let after = times(&robot);
    let touched: Vec<_> = before.iter().filter(|file| !after.contains(file)).collect();
    assert_eq!(touched, Vec::<&(PathBuf, SystemTime)>::new());
    // Definitions that differ only in comments are equal.
    let text = format!("// as in interfaces/Base.idsl\n{BASE}");
    write(&robot.join("components/b/Base.idsl"), &text);
    succeeds(&robot, &[&b]);
}

#[test]
fn concurrent_runs_lose_no_module() {
    let (_folder, robot) = workspace();
    let components: Vec<String> = (0..8)
        .map(|n| {
            let idsl = format!("module M{n} {{ interface I{n} {{ void f(float x); }}; }};\n");
            write(&robot.join(format!("interfaces/M{n}.idsl")), &idsl);
            component(
                &robot,
                &format!("c{n}"),
                &format!("M{n}.idsl"),
                &format!("requires I{n};"),
            )
        })
        .collect();
    std::thread::scope(|scope| {
        for path in &components {
            scope.spawn(|| succeeds(&robot, &[path]));
        }
    });
    let wanted: Vec<String> = (0..8).map(|n| format!("m{n}")).collect();
    assert_eq!(modules(&robot), wanted);
}

#[test]
fn two_definitions_of_a_module_are_reported_with_both_locations() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Grip.idsl", "requires Gripper;");
    let b = component(&robot, "b", "Grip.idsl", "requires Gripper;");
    succeeds(&robot, &[&a]);
    let other = robot.join("components/b/Grip.idsl");
    write(&other, &GRIP.replace("float", "double"));
    let before = files(&robot);
    for args in [[&b, "--format", "short"], [".", "--format", "short"]] {
        let (code, out, err) = rcgen(&robot, &args);
        assert_eq!((code, out.as_str()), (1, ""), "{err}");
        assert_eq!(err.matches("error[two-definitions]").count(), 1, "{err}");
        let shown = "components/b/Grip.idsl:1:8: error[two-definitions]: the workspace has two definitions of module `Grip`: ";
        assert!(err.starts_with(shown), "{err}");
        assert!(err.contains("interfaces/Grip.idsl:1:8"), "{err}");
        assert_eq!(changed(&before, &files(&robot)), [""; 0]);
    }
    // A changed, moved or removed file does not count as another definition.
    write(
        &robot.join("interfaces/Grip.idsl"),
        &GRIP.replace("float", "int"),
    );
    succeeds(&robot, &[&a]);
    std::fs::rename(
        robot.join("interfaces/Grip.idsl"),
        robot.join("components/a/Grip.idsl"),
    )
    .expect("to move");
    succeeds(&robot, &[&a]);
    std::fs::remove_dir_all(robot.join("components/a")).expect("a folder");
    succeeds(&robot, &[&b]);
}

#[test]
fn a_file_of_the_workspace_overrides_a_bundled_one() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Speech.idsl", "requires Speech;");
    let b = component(&robot, "b", "Speech.idsl", "implements Speech;");
    succeeds(&robot, &[&a]);
    let own = "module RoboCompSpeech { interface Speech { void hush(); }; };\n";
    write(&robot.join("interfaces/Speech.idsl"), own);
    succeeds(&robot, &[&b]);
    let (code, _, err) = rcgen(&robot, &["--check", &a]);
    assert_eq!(code, 1);
    assert!(!err.contains("interfaces/generated/src"), "{err}");
}

#[test]
fn errors_of_one_component_do_not_block_others() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    let b = component(&robot, "b", "Own.idsl", "requires Own;");
    let idsl = robot.join("components/b/Own.idsl");
    write(&idsl, "module Own { interface Own { void f(); }; };\n");
    succeeds(&robot, &[&a, &b]);
    write(&idsl, "module Own { interface Own { void f(; }; };\n");
    succeeds(&robot, &[&a]);
    let c = component(&robot, "c", "Grip.idsl", "requires Gripper;");
    let (code, out, err) = rcgen(&robot, &[".", "--format", "short"]);
    assert_eq!(code, 1);
    assert!(err.contains("components/b/Own.idsl:1:"), "{err}");
    let note = "components/b/b.cdsl is skipped: its files have errors";
    assert!(err.contains(note), "{err}");
    assert!(
        out.contains("create ./components/c/generated/Cargo.toml"),
        "{out}"
    );
    assert_eq!(modules(&robot), ["base", "grip", "own", "scan"]);
    succeeds(&robot, &["--check", &c]);
    // An invalid interface that no component uses does not block others either.
    write(&robot.join("interfaces/Draft.idsl"), "module Draft {");
    assert_eq!(rcgen(&robot, &["."]).0, 1);
    assert_eq!(modules(&robot), ["base", "grip", "own", "scan"]);
    succeeds(&robot, &[&c]);
}

#[test]
fn a_component_in_no_workspace_has_the_crate_in_its_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    write(&folder.join("Base.idsl"), BASE);
    write(&folder.join("Scan.idsl"), SCAN);
    let cdsl = "import \"Scan.idsl\";\nComponent lone { Communications { publishes Scans; }; language rust; };\n";
    write(&folder.join("lone.cdsl"), cdsl);
    succeeds(folder, &["lone.cdsl"]);
    assert_eq!(modules(folder), ["base", "scan"]);
    let manifest = std::fs::read_to_string(folder.join("generated/Cargo.toml"));
    let manifest = manifest.expect("a manifest");
    assert!(
        manifest.contains("interfaces = { path = \"../interfaces/generated\" }"),
        "{manifest}"
    );
    succeeds(folder, &["lone.cdsl", "--out", "elsewhere"]);
    assert_eq!(modules(&folder.join("elsewhere")), ["base", "scan"]);
    write(
        &folder.join("lone.cdsl"),
        &cdsl
            .replace("publishes Scans;", "")
            .replace("Scan.", "Base."),
    );
    succeeds(folder, &["lone.cdsl"]);
    assert_eq!(
        modules(folder),
        ["base"],
        "no other component uses the other one"
    );
}

#[test]
fn an_older_workspace_is_upgraded() {
    let (_folder, robot) = workspace();
    let path = robot.join("Cargo.toml");
    let manifest = std::fs::read_to_string(&path).expect("a manifest");
    let old: String = manifest
        .lines()
        .filter(|line| !line.starts_with("rc-middleware") && !line.starts_with("interfaces"))
        .map(|line| line.replace(", \"interfaces/generated\"", "") + " # mine\n")
        .collect();
    std::fs::write(&path, old.replace("\n # mine\n", "\n\n")).expect("a file");
    std::fs::remove_dir_all(robot.join("interfaces/generated")).expect("a folder");
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    let out = succeeds(&robot, &[&a]);
    assert!(out.contains("update Cargo.toml\n"), "{out}");
    let new = std::fs::read_to_string(&path).expect("a manifest");
    let added: Vec<&str> = new
        .lines()
        .filter(|line| !line.ends_with("# mine") && !line.trim().is_empty())
        .collect();
    let wanted = |name| manifest.lines().find(|line| line.starts_with(name));
    let wanted = ["rc-middleware", "interfaces"].map(|name| wanted(name).expect("a line"));
    assert_eq!(added, wanted);
    assert_eq!(succeeds(&robot, &[&a]), "");
    std::fs::write(
        &path,
        old.replace("\n # mine\n", "\n\n").replace('\n', "\r\n"),
    )
    .expect("a file");
    succeeds(&robot, &[&a]);
    let crlf = std::fs::read_to_string(&path).expect("a manifest");
    assert_eq!(crlf, new.replace('\n', "\r\n"));
}

#[test]
fn the_workspace_sets_the_folder_of_interfaces() {
    let (_folder, robot) = workspace();
    let path = robot.join("Cargo.toml");
    let manifest = std::fs::read_to_string(&path).expect("a manifest");
    let named = "[workspace.metadata.robocomp] # here\ninterfaces = \"idl/all\"\n";
    std::fs::write(&path, manifest + named).expect("a file");
    std::fs::create_dir(robot.join("idl")).expect("a folder");
    std::fs::rename(robot.join("interfaces"), robot.join("idl/all")).expect("to move");
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    succeeds(&robot, &[&a]);
    assert!(robot.join("idl/all/generated/src/scan.rs").exists());
    assert!(!robot.join("interfaces").exists());
    let manifest = std::fs::read_to_string(robot.join("components/a/generated/Cargo.toml"));
    let manifest = manifest.expect("a manifest");
    assert!(
        manifest.contains("path = \"../../../idl/all/generated\""),
        "{manifest}"
    );
}

#[test]
fn a_write_error_leaves_both_crates_unchanged() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    succeeds(&robot, &[&a]);
    write(
        &robot.join("interfaces/Scan.idsl"),
        &SCAN.replace("from", "to"),
    );
    // A folder in the place of a file makes writing fail.
    let taken = robot.join("components/a/generated/src/context.rs.rcgen-new");
    std::fs::create_dir(&taken).expect("a folder");
    write(&robot.join("components/a/generated/src/context.rs"), "");
    let before = files(&robot);
    let (code, _, err) = rcgen(&robot, &[&a]);
    assert_eq!(code, 3, "{err}");
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
}

/// Only a file is the worker that the user keeps.
#[test]
fn a_folder_in_the_place_of_the_worker_is_an_error() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    succeeds(&robot, &[&a]);
    let worker = robot.join("components/a/src/specific_worker.rs");
    std::fs::remove_file(&worker).expect("a file");
    std::fs::create_dir(&worker).expect("a folder");
    let (code, out, err) = rcgen(&robot, &[&a]);
    assert_eq!(code, 3, "{out}{err}");
    assert!(err.contains("src/specific_worker.rs: "), "{err}");
}

#[test]
fn an_unreadable_index_removes_no_module() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    let b = component(&robot, "b", "Grip.idsl", "implements Gripper;");
    succeeds(&robot, &[&a, &b]);
    write(
        &robot.join("interfaces/generated/Cargo.toml"),
        "<<<<<<< mine\n",
    );
    let before = files(&robot);
    let (code, out, err) = rcgen(&robot, &[&b]);
    let wanted =
        "interfaces/generated/Cargo.toml is not TOML; generate the whole workspace: rcgen .\n";
    assert!(
        code == 1 && out.is_empty() && err.ends_with(wanted),
        "{code} {err}"
    );
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
    succeeds(&robot, &["."]);
    assert_eq!(modules(&robot), ["base", "grip", "scan"]);
}

#[test]
fn a_component_is_not_in_the_folder_of_the_interfaces() {
    let (_folder, robot) = workspace();
    let text = "Component c { Communications { }; language rust; };";
    write(&robot.join("interfaces/c.cdsl"), text);
    let before = files(&robot);
    let (code, _, err) = rcgen(&robot, &["interfaces/c.cdsl"]);
    let wanted = "interfaces/c.cdsl: a component cannot be in the folder of the interfaces";
    assert!(code == 2 && err.contains(wanted), "{code} {err}");
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
}

#[test]
fn two_modules_with_one_name_in_rust_collide() {
    let (_folder, robot) = workspace();
    let idsl = |name: &str| {
        let text = format!("module {name} {{ interface I{name} {{ void f(); }}; }};\n");
        write(&robot.join(format!("interfaces/{name}.idsl")), &text);
    };
    idsl("FooBar");
    idsl("Foo_Bar");
    idsl("Lib");
    let (code, _, err) = rcgen(&robot, &[".", "--format", "short"]);
    let wanted = "interfaces/Foo_Bar.idsl:1:8: error[name-collision]: modules `FooBar` and `Foo_Bar` are both `foo_bar` in Rust";
    assert!(code == 1 && err.contains(wanted), "{code} {err}");
    std::fs::remove_file(robot.join("interfaces/Foo_Bar.idsl")).expect("it was there");
    succeeds(&robot, &["."]);
    assert_eq!(modules(&robot), ["base", "foo_bar", "grip", "lib_", "scan"]);
}

#[test]
fn a_module_is_regenerated_after_a_change_of_its_imports() {
    let (_folder, robot) = workspace();
    let a = component(&robot, "a", "Scan.idsl", "publishes Scans;");
    let b = component(&robot, "b", "Base.idsl", "");
    succeeds(&robot, &[&a, &b]);
    write(
        &robot.join("interfaces/Base.idsl"),
        &BASE.replace("float y", "double y"),
    );
    let out = succeeds(&robot, &[&b]);
    for module in ["base", "scan"] {
        let line = format!("update interfaces/generated/src/{module}.rs\n");
        assert!(out.contains(&line), "{out}");
    }
    let out = succeeds(&robot, &[&a]);
    assert!(!out.contains("interfaces/generated"), "{out}");
    write(&robot.join("interfaces/Base.idsl"), BASE);
    write(&robot.join("interfaces/Scan.idsl"), "module Scan {");
    let before = files(&robot);
    let (code, _, err) = rcgen(&robot, &[&b]);
    let wanted = "a module that `Scan` imports changed, and rcgen cannot print it again";
    assert!(code == 1 && err.contains(wanted), "{code} {err}");
    assert_eq!(changed(&before, &files(&robot)), [""; 0]);
}

#[test]
fn a_component_outside_all_members_is_reported() {
    let (_folder, robot) = workspace();
    let text = "Component far { Communications { }; language rust; };";
    write(&robot.join("elsewhere/far/far.cdsl"), text);
    let (code, _, err) = rcgen(&robot, &["."]);
    let wanted = "./elsewhere/far is not a member of the workspace; add it to `members`\n";
    assert_eq!((code, err.as_str()), (0, wanted));
    assert!(!robot.join("elsewhere/far/generated").exists());
}
