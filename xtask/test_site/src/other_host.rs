//! Another host without a second machine or a network: a script replaces ssh and runs its command
//! on this machine, with the folders of the other host.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// `ssh` that runs its command on this machine. While the file `unplugged` exists, it gets no
/// reply, and says so as ssh does, with a carriage return.
const SSH: &str = r#"#!/bin/sh
if [ -e FOLDER/unplugged ]; then
    printf 'ssh: connect to host robot port 22: No route to host\r\n' >&2
    exit 255
fi
while [ "$1" != -- ]; do shift; done
export HOME=FOLDER/away/home XDG_RUNTIME_DIR=FOLDER/away/run XDG_STATE_HOME=FOLDER/away/state
unset XDG_CACHE_HOME RC_SUPERVISOR VIRTUAL_ENV PYTHONPATH
echo "Welcome to robot!"
echo "$$" > FOLDER/ssh.pid
cat | setsid CLOCK sh -c 'echo "$$" > FOLDER/agent.pid; eval "$1"' sh "$3" | cat
"#;

/// Makes the folders of the host below `folder`, and the program for `RC_SSH`.
pub fn ssh(folder: &Path) -> PathBuf {
    ssh_with(folder, "")
}

/// [`ssh`] to a host whose monotonic clock is so many seconds ahead. `None` if the system refuses such
/// a clock.
pub fn ssh_ahead(folder: &Path, seconds: u32) -> Option<PathBuf> {
    let clock = format!("unshare --time --monotonic {seconds} --kill-child --fork");
    let may = Command::new("sh")
        .args(["-c", &format!("{clock} true")])
        .output();
    may.is_ok_and(|ran| ran.status.success())
        .then(|| ssh_with(folder, &clock))
}

fn ssh_with(folder: &Path, clock: &str) -> PathBuf {
    for made in ["away/home", "away/run"] {
        fs::create_dir_all(folder.join(made)).expect("a folder");
    }
    let program = folder.join("ssh");
    let script = SSH.replace("FOLDER", &folder.display().to_string());
    let script = script.replace("CLOCK ", &format!("{clock} "));
    fs::write(&program, script).expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("set");
    program
}
