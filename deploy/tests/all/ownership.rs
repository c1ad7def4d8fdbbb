//! Files that a run as root has left to another user.

use crate::bench::{self, Bench, well};
use std::fs;
use std::os::unix::fs::{PermissionsExt, chown};
use std::path::Path;
use std::process::Command;

/// The user without rights of most systems.
const NOBODY: u32 = 65534;

/// A folder of that user.
fn folder(path: &Path) {
    fs::create_dir_all(path).expect("a folder");
    chown(path, Some(NOBODY), Some(NOBODY)).expect("root may");
}

/// What `up` of that user says about a file of root.
fn told(file: impl FnOnce(&Bench) -> std::path::PathBuf) -> (String, String) {
    let bench = Bench::new();
    let open = fs::Permissions::from_mode(0o755);
    fs::set_permissions(bench.path(""), open).expect("its own folder");
    let plan = bench.write(vec![well("a")]);
    let driver = bench.driver(&["up", &plan, "--json"]);
    for path in ["run", "run/robocomp", "state", "state/robocomp"] {
        folder(&bench.path(path));
    }
    folder(&bench.run_directory());
    folder(bench.log("a").parent().expect("a folder"));
    let path = file(&bench);
    fs::write(&path, "").expect("written");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o600)).expect("set");
    // That user may not be let into the folder of the programs.
    let program = bench.path("driver");
    fs::copy(driver.get_program(), &program).expect("a copy");
    let mut command = Command::new("setpriv");
    let user = format!("--reuid={NOBODY}");
    let group = format!("--regid={NOBODY}");
    command.args([&user, &group, "--clear-groups", "--"]);
    command.arg(program).args(driver.get_args());
    for (name, value) in driver.get_envs() {
        command.env(name, value.unwrap_or_default());
    }
    let ran = command.output().expect("setpriv, of util-linux");
    assert_eq!(ran.status.code(), Some(3), "{ran:?}");
    (bench::text(&ran.stdout), path.display().to_string())
}

#[test]
fn files_of_root_are_named_with_their_owner_and_what_removes_them() {
    if !rustix::process::geteuid().is_root() {
        let test = "files_of_root_are_named_with_their_owner_and_what_removes_them";
        return bench::skipped(test, "only root leaves files of root");
    }
    for file in [
        |bench: &Bench| bench.run_directory().join("rcdeploy.lock"),
        |bench: &Bench| bench.log("a"),
    ] {
        let (told, path) = told(file);
        let advice = format!("{path} belongs to user root (0): `sudo rm -r {path}` removes it");
        assert!(told.contains(&advice), "{told}");
        assert!(told.contains("Permission denied"), "{told}");
    }
}
