//! The manifests of the workspace: what cargo warns about, and what it compiles in vain.

use crate::quiet;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The packages of this workspace, as cargo describes them.
fn packages() -> Vec<Value> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--offline", "--format-version=1"])
        .current_dir(root)
        .output()
        .expect("cargo starts");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{error}");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    metadata["packages"].as_array().expect("packages").clone()
}

fn path(value: &Value) -> PathBuf {
    PathBuf::from(value.as_str().expect("a path"))
}

/// All files of Rust of a folder.
fn sources(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, all);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            all.push(path);
        }
    }
}

/// Newer versions of cargo warn about each manifest without the table.
#[test]
fn every_manifest_says_which_lints_it_inherits() {
    let _quiet = quiet();
    let mut without = Vec::new();
    for package in packages() {
        let manifest = path(&package["manifest_path"]);
        let text = fs::read_to_string(&manifest).expect("a manifest");
        if !text.lines().any(|line| line.starts_with("[lints")) {
            without.push(manifest);
        }
    }
    assert_eq!(without, Vec::<PathBuf>::new());
}

/// Cargo links a program of tests for each target, unless it has `test = false`. Without tests, it
/// compiles the crate a second time in vain; with `test = false`, it runs no test in it.
#[test]
fn targets_have_tests_or_say_that_they_have_none() {
    let _quiet = quiet();
    let (mut in_vain, mut not_run) = (Vec::new(), Vec::new());
    for package in packages() {
        let name = package["name"].as_str().expect("a name").to_owned();
        // The macro of one writes tests of others; a test of the other would lack the symbols of an
        // interpreter.
        if ["rc-conformance", "rc-python"].contains(&&*name) {
            continue;
        }
        for target in package["targets"].as_array().expect("targets") {
            let (root, kind) = (path(&target["src_path"]), target["kind"][0].clone());
            let is_generated = name.ends_with("_generated") || name == "interfaces";
            let mut files = Vec::new();
            match kind.as_str() {
                Some("lib" | "cdylib" | "rlib") => {
                    sources(root.parent().expect("a folder"), &mut files);
                    files.retain(|file| !file.ends_with("src/main.rs"));
                }
                // A program without a library has modules of its own.
                Some("bin")
                    if !root.with_file_name("lib.rs").exists() && root.ends_with("main.rs") =>
                {
                    sources(root.parent().expect("a folder"), &mut files);
                }
                Some("bin") => files.push(root.clone()),
                _ => continue,
            }
            let has_tests = files.iter().any(|file| {
                let text = fs::read_to_string(file).expect("a source");
                text.lines().any(|line| line.trim() == "#[test]")
            });
            let is_tested = target["test"].as_bool().expect("a flag");
            if is_tested && (is_generated || !has_tests) {
                in_vain.push(root);
            } else if !is_tested && has_tests {
                not_run.push(root);
            }
        }
    }
    assert_eq!(in_vain, Vec::<PathBuf>::new(), "give them `test = false`");
    assert_eq!(not_run, Vec::<PathBuf>::new(), "remove `test = false`");
}

/// Whether a comment of a text has an example of Rust.
fn has_example(text: &str) -> bool {
    let mut is_open = false;
    for line in text.lines().map(str::trim) {
        let comment = ["///", "//!"]
            .iter()
            .find_map(|sign| line.strip_prefix(sign));
        let fence = comment.and_then(|comment| comment.trim().strip_prefix("```"));
        let is_rust = |tag: &str| {
            let known = ["", "rust", "no_run", "should_panic", "compile_fail"];
            tag.split(',').all(|word| known.contains(&word.trim()))
        };
        match (comment, fence) {
            (Some(_), Some(tag)) if !is_open && is_rust(tag) => return true,
            (Some(_), Some(_)) => is_open = !is_open,
            (Some(_), None) => {}
            (None, _) => is_open = false,
        }
    }
    false
}

/// Examples run crate after crate, and rustdoc reads each crate for it, unless it has `doctest = false`.
#[test]
fn libraries_have_examples_or_say_that_they_have_none() {
    let _quiet = quiet();
    let (mut in_vain, mut not_run) = (Vec::new(), Vec::new());
    for package in packages() {
        for target in package["targets"].as_array().expect("targets") {
            if !matches!(target["kind"][0].as_str(), Some("lib" | "rlib")) {
                continue;
            }
            let root = path(&target["src_path"]);
            let mut files = Vec::new();
            sources(root.parent().expect("a folder"), &mut files);
            // The examples of this one are in files of others.
            let is_of_others = package["name"] == "front_pages";
            let has_examples = is_of_others
                || files
                    .iter()
                    .any(|file| has_example(&fs::read_to_string(file).expect("a source")));
            match (target["doctest"].as_bool(), has_examples) {
                (Some(true), false) => in_vain.push(root),
                (Some(false), true) => not_run.push(root),
                _ => {}
            }
        }
    }
    assert_eq!(
        in_vain,
        Vec::<PathBuf>::new(),
        "give them `doctest = false`"
    );
    assert_eq!(not_run, Vec::<PathBuf>::new(), "remove `doctest = false`");
}

/// A build script that looks for an interpreter runs again with each other search path, and cargo then
/// compiles pyo3 and the extension modules again.
#[test]
fn extension_modules_are_built_without_an_interpreter() {
    let own = std::env::current_exe().expect("this program");
    let builds = own.ancestors().nth(2).expect("the profile").join("build");
    let scripts = fs::read_dir(builds).expect("a folder").flatten();
    let scripts =
        scripts.filter(|entry| entry.file_name().to_string_lossy().starts_with("pyo3-ffi-"));
    let outputs = scripts.map(|entry| entry.path().join("output"));
    // Those of earlier versions, other profiles and wheels may look for one.
    let mut said = outputs.filter_map(|path| fs::read_to_string(path).ok());
    let looks = ["PATH", "VIRTUAL_ENV", "PYO3_PYTHON"]
        .map(|variable| format!("cargo:rerun-if-env-changed={variable}"));
    let without = said.find(|said| {
        !said
            .lines()
            .any(|line| looks.iter().any(|look| look == line))
    });
    without.expect("a build of the extension modules, which `cargo xtask test` makes first");
}
