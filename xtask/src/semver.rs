//! `cargo xtask semver`: compares the public API of the library crates with that of an earlier state,
//! by cargo-semver-checks.

use crate::tools;
use std::process::Command;

const NAME: &str = "cargo-semver-checks";
const VERSION: &str = "0.51.0";
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
const USAGE: &str = "usage: cargo xtask semver [--since REVISION]";

/// Runs the comparison with a revision of git; with the last tag if none is named.
///
/// # Errors
/// The tool or the revision is missing, or the API has changed in a way that its version forbids.
pub(crate) fn run(words: &[&str]) -> Result<(), String> {
    let named = match words {
        [] => None,
        ["--since", revision] => Some((*revision).to_owned()),
        _ => return Err(USAGE.to_owned()),
    };
    let since = match named {
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
    let words = ["semver-checks", "--workspace", "--baseline-rev", &since];
    println!("+ cargo {}", words.join(" "));
    let status = Command::new(program).args(words).current_dir(ROOT).status();
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
