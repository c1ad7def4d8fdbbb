//! Runs `rcgen` in the folder of a test, and compares its files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Exit code, standard output and standard error of `rcgen` in `folder`.
pub(crate) fn rcgen(folder: &Path, args: &[&str]) -> (i32, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_rcgen"))
        .args(args)
        .current_dir(folder)
        .env_remove("RC_IDSL_PATH")
        .output()
        .expect("rcgen starts");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("UTF-8");
    let code = output.status.code().expect("an exit code");
    (code, text(output.stdout), text(output.stderr))
}

/// Every file of a folder with its content.
pub(crate) fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                open.push(path);
            } else {
                let inside = path.strip_prefix(folder).expect("inside").to_path_buf();
                all.insert(inside, std::fs::read(&path).expect("a file"));
            }
        }
    }
    all
}

/// The paths of the files that differ, with `/` between folders.
pub(crate) fn changed(
    a: &BTreeMap<PathBuf, Vec<u8>>,
    b: &BTreeMap<PathBuf, Vec<u8>>,
) -> Vec<String> {
    let mut paths: Vec<&PathBuf> = a.keys().chain(b.keys()).collect();
    paths.sort();
    paths.dedup();
    let differing = paths
        .into_iter()
        .filter(|path| a.get(*path) != b.get(*path));
    differing
        .map(|p| p.to_string_lossy().replace('\\', "/"))
        .collect()
}
