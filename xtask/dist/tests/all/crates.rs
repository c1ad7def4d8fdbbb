//! The library crates as crates.io gets them: each has what its manifest promises, and all files that
//! its sources name. `cargo xtask dist --check` also builds them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Literals behind these words are paths: those of macros start at the source, those of grammars at
/// `src`.
const WORDS: [(&str, bool); 3] = [
    ("include_str!(\"", true),
    ("include_bytes!(\"", true),
    ("#[grammar = \"", false),
];

fn sources(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        // Tests are not compiled where the crate is used.
        let is_test = path.file_stem().is_some_and(|stem| stem == "tests");
        if path.is_dir() && !is_test {
            sources(&path, all);
        } else if path.extension().is_some_and(|e| e == "rs") && !is_test {
            all.push(path);
        }
    }
}

/// The files that sources name, and that are not in the unpacked crate.
fn missing(krate: &Path) -> Vec<String> {
    let mut all = Vec::new();
    sources(&krate.join("src"), &mut all);
    let mut missing = Vec::new();
    for source in all {
        let text = fs::read_to_string(&source).expect("a source");
        // Without spaces: a macro may have its argument in the next line.
        let text: String = text
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
            .replace("( \"", "(\"");
        for (word, from_source) in WORDS {
            for rest in text.split(word).skip(1) {
                let name = rest.split('"').next().unwrap_or_default();
                let folder = krate.join("src");
                let base = if from_source {
                    source.parent().unwrap_or(&folder)
                } else {
                    &folder
                };
                let place = base.join(name).canonicalize();
                let is_there = place.is_ok_and(|place| place.starts_with(krate));
                if !is_there {
                    missing.push(format!("{}: {name}", source.display()));
                }
            }
        }
    }
    missing
}

#[test]
fn every_library_crate_can_be_published() {
    let folder = tempfile::tempdir().expect("a folder");
    let root = folder.path().canonicalize().expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_dist"))
        .args(["--only", "crates", "--maintainer", "Nobody <n@debian.org>"])
        .arg("--out")
        .arg(root.join("out"))
        .output()
        .expect("a program that starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let sums = fs::read_to_string(root.join("out/SHA256SUMS")).expect("sums");
    let mut names = Vec::new();
    let mut faults = Vec::new();
    for line in sums.lines() {
        let (_, file) = line.split_once("  ").expect("a name");
        let unpacked = Command::new("tar")
            .arg("-xzf")
            .arg(root.join("out").join(file))
            .current_dir(&root)
            .status()
            .expect("tar");
        assert!(unpacked.success(), "{file}");
        let stem = file.trim_start_matches("crates/");
        let krate = root.join(stem.trim_end_matches(".crate"));
        faults.extend(missing(&krate));
        let manifest = fs::read_to_string(krate.join("Cargo.toml")).expect("a manifest");
        for field in ["description = \"", "license = \"", "version = \""] {
            if !manifest.lines().any(|line| line.starts_with(field)) {
                faults.push(format!("{file}: no {field}…\""));
            }
        }
        // A path leads nowhere in a published crate.
        let is_target = |line: &str| {
            [".rs\"", "\"build.rs\""]
                .iter()
                .any(|end| line.ends_with(end))
        };
        let paths = manifest.lines().filter(|line| line.starts_with("path = "));
        faults.extend(
            paths
                .filter(|line| !is_target(line))
                .map(|line| format!("{file}: {line}")),
        );
        names.push(stem.to_owned());
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    for name in ["rc-runtime-", "innermodel-", "property-graph-"] {
        assert!(
            names.iter().any(|krate| krate.starts_with(name)),
            "{names:?}"
        );
    }
}
