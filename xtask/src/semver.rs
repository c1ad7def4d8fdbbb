//! `cargo xtask semver`: compares the public API of the library crates with that of an earlier state,
//! by cargo-semver-checks.

use crate::tools;
use std::process::Command;

const NAME: &str = "cargo-semver-checks";
const VERSION: &str = "0.51.0";
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const USAGE: &str = "usage: cargo xtask semver [--since REVISION] [--package NAME]…";

/// Runs the comparison with a revision of git; with the last tag if none is named. Of the library crates,
/// it compares those that are named; all without names.
///
/// # Errors
/// The revision is missing, or the API has changed in a way that its version forbids.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    let (mut since, mut packages) = (None, Vec::new());
    let (pairs, rest) = words.as_chunks::<2>();
    for pair in pairs {
        match *pair {
            ["--since", revision] => since = Some(revision.to_owned()),
            ["--package", name] => packages.extend(["--package", name]),
            _ => return Err(USAGE.to_owned()),
        }
    }
    if !rest.is_empty() {
        return Err(USAGE.to_owned());
    }
    let since = match since {
        Some(revision) => revision,
        None => last_tag()?,
    };
    let program = match tools::installed(NAME, VERSION) {
        Ok(program) => program,
        Err(why) => {
            println!("skipped: semver: {why}");
            return Ok(());
        }
    };
    // It leaves out the crates whose manifests say `publish = false`.
    if packages.is_empty() {
        packages.push("--workspace");
    }
    let words = [&["semver-checks", "--baseline-rev", &since], &packages[..]].concat();
    println!("+ cargo {}", words.join(" "));
    let status = Command::new(program)
        .args(&words)
        .current_dir(ROOT)
        .status();
    crate::outcome(&words, status)
}

fn last_tag() -> Result<String, String> {
    let output = Command::new("git")
        .args(["describe", "--tags", "--abbrev=0"])
        .current_dir(ROOT)
        .output()
        .map_err(|error| format!("git: {error}"))?;
    if !output.status.success() {
        return Err(format!(
            "this repository has no tag to compare with; name a commit: {USAGE}"
        ));
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}
