//! Workspaces of tests that share the compiled crates of this one.

use std::path::{Path, PathBuf};

/// Lets a workspace of a test find the crates of crates.io that this workspace has compiled: it
/// gets the same versions and profile, and the member `member` with all dependencies of the table
/// of this workspace. With `--workspace`, cargo then chooses the same features. The member has a
/// program only, so cargo compiles its dependencies only if they are needed elsewhere.
///
/// # Panics
///
/// A file of either workspace cannot be read or written.
pub fn share_builds(workspace: &Path, member: &Path) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .find(|folder| folder.join("Cargo.lock").exists())
        .expect("this workspace");
    std::fs::copy(root.join("Cargo.lock"), workspace.join("Cargo.lock")).expect("a copy");
    let ours = std::fs::read_to_string(root.join("Cargo.toml")).expect("a manifest");
    let manifest = workspace.join("Cargo.toml");
    let theirs = std::fs::read_to_string(&manifest).expect("a manifest");
    let before = theirs.split("[profile.").next().unwrap_or_default();
    let (_, profile) = ours.split_once("[profile.dev]\n").expect("a profile");
    let text = format!("{before}[profile.dev]\n{profile}");
    std::fs::write(&manifest, text).expect("to write");
    let (_, table) = ours
        .split_once("[workspace.dependencies]\n")
        .expect("a table");
    let table = table.split("\n[").next().unwrap_or_default();
    let crates = table.lines().filter(|line| !line.contains("{ path = "));
    let crates: String = crates.map(|line| format!("{line}\n")).collect();
    let write = |file: &str, text: &str| {
        let path = workspace.join(member).join(file);
        let folder = path.parent().map(PathBuf::from).expect("a folder");
        std::fs::create_dir_all(folder).expect("a folder");
        std::fs::write(path, text).expect("to write");
    };
    let package = "[package]\nname = \"test-features\"\nversion = \"0.0.0\"\nedition = \"2024\"\n";
    write(
        "Cargo.toml",
        &format!("{package}\n[dependencies]\n{crates}"),
    );
    write("src/main.rs", "fn main() {}\n");
}
