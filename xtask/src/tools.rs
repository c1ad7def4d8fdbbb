//! Programs of crates.io that commands need. They are installed below the target folder.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The target folder of cargo.
pub(crate) fn target() -> PathBuf {
    // This program is `TARGET/PROFILE/xtask`, or a test in `TARGET/PROFILE/deps`.
    let own = std::env::current_exe().unwrap_or_default();
    let mut folders = own.ancestors().skip(1);
    let profile = folders.find(|folder| !folder.ends_with("deps"));
    let target = profile.and_then(Path::parent);
    target.map_or_else(|| "target".into(), Path::to_path_buf)
}

/// Installs a version of a program, if there is none yet, and returns its path. The error says why
/// that is not possible.
pub(crate) fn installed(name: &str, version: &str) -> Result<PathBuf, String> {
    let root = target().join("tools");
    let program = root.join("bin").join(name);
    if program.exists() {
        return Ok(program);
    }
    let install = ["install", name, "--locked", "--debug", "--version", version];
    println!("+ cargo {} --root {}", install.join(" "), root.display());
    let status = Command::new("cargo")
        .args(install)
        .arg("--root")
        .arg(root)
        .status();
    match status {
        Ok(status) if status.success() => Ok(program),
        Ok(_) => Err(format!("`cargo {}` failed", install.join(" "))),
        Err(error) => Err(format!("cargo cannot be started: {error}")),
    }
}
