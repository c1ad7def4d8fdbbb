//! Interpreters of Python for a component, and their output.

use crate::program::end_of;
use pep440_rs::Version;
use rc_cdsl::model::OLDEST_PYTHON;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// How long an interpreter may take to read a worker.
const PATIENCE: Duration = Duration::from_secs(20);

/// The virtual environment of a component, in its folder.
pub(super) const OWN_ENVIRONMENT: &str = ".venv";

/// The interpreter of a virtual environment.
pub(super) const PROGRAM: &str = "bin/python";

/// The interpreter of the path.
pub(super) const IN_PATH: &str = "python3";

/// Why no interpreter can be used.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct Unusable(pub String);

/// The active virtual environment.
pub(super) fn active_environment() -> Option<PathBuf> {
    let active = std::env::var_os("VIRTUAL_ENV").filter(|value| !value.is_empty());
    let active = active.map(PathBuf::from);
    active.filter(|folder| may_run(&folder.join(PROGRAM)))
}

/// The interpreter that reads workers: that of the active virtual environment, or `python3` of the
/// path. A program in the folder of a component could be foreign code; reading needs no packages.
pub(super) fn active() -> PathBuf {
    active_environment().map_or_else(|| IN_PATH.into(), |folder| folder.join(PROGRAM))
}

/// Whether a path is a program.
pub(super) fn may_run(path: &Path) -> bool {
    let is_program =
        |file: std::fs::Metadata| file.is_file() && file.permissions().mode() & 0o111 != 0;
    path.metadata().is_ok_and(is_program)
}

/// The needed version, for messages about one component.
pub fn needed_by_this((major, minor): (u32, u32)) -> String {
    format!("this component needs Python {major}.{minor} or newer")
}

/// The needed version, for messages where the component is unknown.
pub(super) fn needed() -> String {
    let (major, minor) = OLDEST_PYTHON;
    format!("a component in Python needs Python {major}.{minor} or newer")
}

/// Whether a version is not older than the oldest that is needed.
pub(super) fn is_new_enough(version: &Version, (major, minor): (u32, u32)) -> bool {
    *version >= Version::new([u64::from(major), u64::from(minor)])
}

/// The version of an interpreter, which says it.
pub(super) fn version(python: &Path) -> Result<Version, Unusable> {
    version_within(PATIENCE, python)
}

/// As [`version`], with a limit for the answer.
pub(super) fn version_within(patience: Duration, python: &Path) -> Result<Version, Unusable> {
    const SCRIPT: &str = "import sys; print('%d.%d.%d' % sys.version_info[:3])";
    let said = run_for(patience, python, SCRIPT, &[])?;
    let said = String::from_utf8_lossy(&said);
    let said = said.trim();
    said.parse().map_err(|_| {
        let said = rc_diagnostics::foreign::clean(said);
        Unusable(format!(
            "`{}` is not Python: it printed `{said}`",
            python.display()
        ))
    })
}

/// Runs a script of this program with arguments and returns what it printed. The interpreter reads
/// no packages and no files of the current folder.
pub(super) fn run(python: &Path, script: &str, args: &[PathBuf]) -> Result<Vec<u8>, Unusable> {
    run_for(PATIENCE, python, script, args)
}

fn run_for(
    patience: Duration,
    python: &Path,
    script: &str,
    args: &[PathBuf],
) -> Result<Vec<u8>, Unusable> {
    let mut command = Command::new(python);
    command.args(["-I", "-S", "-X", "utf8", "-c", script]);
    let ended = end_of(patience, command.args(args), Stdio::null());
    let failed = |why: &str| Unusable(format!("`{}` {why}", python.display()));
    let ended = ended.map_err(|why| failed(&why))?;
    if ended.is_success {
        return Ok(ended.out);
    }
    let said = String::from_utf8_lossy(&ended.said);
    let last = said.trim_end().lines().last().unwrap_or("no reason");
    let last = rc_diagnostics::foreign::clean(last);
    Err(failed(&format!("failed: {last}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Why a script fails.
    fn mistake(patience: Duration, script: &str) -> String {
        let error = run_for(patience, Path::new("python3"), script, &[]);
        error.expect_err("a mistake").to_string()
    }

    #[test]
    fn a_program_that_prints_without_end_is_stopped() {
        let script = "import sys\nwhile True: sys.stdout.write('x' * 65536)";
        let said = mistake(Duration::from_mins(1), script);
        assert!(said.contains("prints more than 16 MiB"), "{said}");
    }

    #[test]
    fn a_pipe_that_stays_open_ends_the_wait() {
        let script = "import subprocess; subprocess.Popen(['sleep', '40'])";
        let said = mistake(Duration::from_secs(4), script);
        assert!(
            said.contains("another program keeps its output open"),
            "{said}"
        );
    }
}
