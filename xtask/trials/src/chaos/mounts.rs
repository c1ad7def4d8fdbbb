//! A shared memory and a disk for logs that belong to this run alone, and are small: a trouble
//! fills them, and no other program of the machine is harmed.
//!
//! They are mounted in a mount namespace, which a user namespace allows without privileges.

use std::os::unix::fs::MetadataExt as _;
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::Command;

/// Set in the environment of a process in the namespace.
const PRIVATE: &str = "RC_CHAOS_MOUNTS";
/// The shared memory.
pub(super) const MEMORY: &str = "/dev/shm";
/// The disk for logs.
const LOGS: &str = "/dev/shm/rc-chaos-logs";
/// Mounts both, then runs its arguments.
const SCRIPT: &str = "mount -t tmpfs -o size=256m,mode=1777 tmpfs /dev/shm && mkdir -m 700 /dev/shm/rc-chaos-logs && \
     mount -t tmpfs -o size=16m,mode=700 tmpfs /dev/shm/rc-chaos-logs && exec \"$@\"";

/// The folder for logs on a disk of its own, if this process is in the namespace.
pub(super) fn logs() -> Option<&'static Path> {
    // The variable alone may come from a shell, where the trouble would fill the memory of all.
    let device = |path: &str| std::fs::metadata(path).map(|file| file.dev()).ok();
    let is_own = device(LOGS).is_some_and(|logs| device(MEMORY) != Some(logs));
    std::env::var_os(PRIVATE)
        .filter(|_| is_own)
        .map(|_| Path::new(LOGS))
}

/// Starts this program again in the namespace, in place of this process. It returns in the
/// namespace, or with the reason why there is none.
pub(super) fn enter() -> Result<(), String> {
    if logs().is_some() {
        return Ok(());
    }
    let in_namespace = || {
        let mut command = Command::new("unshare");
        let options = "--user --map-root-user --mount --propagation private sh -c";
        command.args(options.split(' ')).args([SCRIPT, "sh"]);
        command
    };
    let attempt = in_namespace().arg("true").output();
    let attempt = attempt.map_err(|error| format!("unshare cannot be started: {error}"))?;
    if !attempt.status.success() {
        let said = String::from_utf8_lossy(&attempt.stderr);
        return Err(said.lines().next().unwrap_or_default().to_owned());
    }
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    let mut command = in_namespace();
    command.arg(own).args(std::env::args_os().skip(1));
    Err(command.env(PRIVATE, "1").exec().to_string())
}
