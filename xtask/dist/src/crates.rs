//! The library crates as crates.io gets them. `cargo publish --workspace` uploads the same files, in
//! the order in which they depend on each other.

use crate::build::{Build, output, run};
use crate::named;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of the crates, below that of the packages.
pub(crate) const FOLDER: &str = "crates";

/// A command of cargo that needs no connection. Its own index, which cargo lays over that of
/// crates.io, has the crates that are packaged.
fn cargo(build: &Build, arguments: &[&str]) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut cargo = Command::new(cargo);
    cargo.args(arguments).arg("--offline");
    cargo.current_dir(&build.root);
    cargo
}

/// The crates that may be published, with their descriptions: manifests of all others say
/// `publish = false`.
pub(crate) fn described(build: &Build) -> Result<Vec<(String, String)>, String> {
    let mut metadata = cargo(
        build,
        &["metadata", "--no-deps", "--locked", "--format-version", "1"],
    );
    let metadata: Value = serde_json::from_str(&output(&mut metadata)?)
        .map_err(|error| format!("cargo metadata: {error}"))?;
    let packages = metadata["packages"].as_array().into_iter().flatten();
    let public = packages.filter(|package| package["publish"].is_null());
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let mut all: Vec<_> = public
        .map(|package| (text(&package["name"]), text(&package["description"])))
        .collect();
    all.sort();
    Ok(all)
}

/// The names of the crates that may be published.
pub(crate) fn names(build: &Build) -> Result<BTreeSet<String>, String> {
    Ok(described(build)?
        .into_iter()
        .map(|(name, _)| name)
        .collect())
}

/// Packages the crates, below the target folder.
fn package(build: &Build, target: &Path, options: &[&str]) -> Result<(), String> {
    // The version of a package is that of this folder, whether it is committed or not.
    let mut cargo = cargo(build, &["package", "--locked", "--allow-dirty"]);
    cargo.arg("--target-dir").arg(target).args(options);
    for name in names(build)? {
        cargo.args(["--package", &name]);
    }
    if options.is_empty() {
        return run(&mut cargo);
    }
    output(&mut cargo).map(drop)
}

/// Writes the crates into `out`, and returns their paths. `stage` is for what cargo writes beside
/// them.
pub(crate) fn write(build: &Build, stage: &Path, out: &Path) -> Result<Vec<PathBuf>, String> {
    let target = stage.join("crates");
    package(build, &target, &["--no-verify"])?;
    let folder = out.join(FOLDER);
    std::fs::create_dir_all(&folder).map_err(named(&folder))?;
    let mut written = Vec::new();
    for name in names(build)? {
        let file = format!("{name}-{}.crate", build.version);
        let (from, to) = (target.join("package").join(&file), folder.join(&file));
        std::fs::rename(&from, &to).map_err(named(&from))?;
        written.push(to);
    }
    Ok(written)
}

/// Builds each crate from its package, and from the packages of those it depends on.
pub(crate) fn verify(build: &Build) -> Result<(), String> {
    package(build, &build.target, &[])?;
    println!("crates: {} build from their packages", names(build)?.len());
    Ok(())
}

/// Whether a file has the name of a library crate, of this version or another one.
pub(crate) fn is_ours(file: &str, names: &BTreeSet<String>) -> bool {
    let stem = file.strip_suffix(".crate");
    let parts = stem.and_then(|stem| stem.rsplit_once('-'));
    parts.is_some_and(|(name, _)| names.contains(name))
}
