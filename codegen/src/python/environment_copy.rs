//! `.venv` of a component on another machine: its packages are copies, its interpreter is one of
//! that machine.

use super::component_interpreter::Settings;
use super::environment::{Error, fill, in_path};
use super::interpreter::{self, OWN_ENVIRONMENT, PROGRAM};
use pep440_rs::Version;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long Python may take to make an environment without packages. A supervisor waits for that.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long an interpreter may take to print its version.
const VERSION_PATIENCE: Duration = Duration::from_secs(5);

/// The virtual environment of a component.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Environment {
    /// Its folder.
    pub folder: PathBuf,
    /// Major and minor version of its interpreter.
    pub python: (u64, u64),
    /// Whether it has the packages of the interpreter that it was made with.
    pub is_open: bool,
}

impl Environment {
    /// The environment of a component in `folder`. `None` if there is none, or its files do not say
    /// its version.
    pub fn of(folder: &Path) -> Option<Self> {
        let folder = folder.join(OWN_ENVIRONMENT);
        if !interpreter::may_run(&folder.join(PROGRAM)) {
            return None;
        }
        let settings = Settings::read(&folder)?;
        Some(Self {
            python: settings.numbers(),
            is_open: settings.is_open,
            folder,
        })
    }

    /// The folder of its packages.
    pub fn packages(&self) -> PathBuf {
        let (major, minor) = self.python;
        self.folder
            .join(format!("lib/python{major}.{minor}/site-packages"))
    }

    /// Gives a folder with copies of the packages an interpreter of this machine, which has the
    /// same version: packages are built for one. `step` is called before each step that may take
    /// seconds.
    ///
    /// # Errors
    /// [`Error`]: this machine has no such interpreter, or it makes no environment; or an error of
    /// `step`.
    pub fn complete(&self, step: &mut dyn FnMut() -> io::Result<()>) -> Result<(), Error> {
        let mut step =
            || step().map_err(|error| Error::System(format!("no process waits any more: {error}")));
        let (major, minor) = self.python;
        let own = self.folder.join(PROGRAM);
        let made = Settings::read(&self.folder);
        let is_same =
            made.is_some_and(|made| made.numbers() == self.python && made.is_open == self.is_open);
        if is_same {
            step()?;
            if self.has_version(&own) {
                return Ok(());
            }
        }
        let names = [format!("python{major}.{minor}"), "python3".to_owned()];
        let mut found = None;
        for python in names.iter().filter_map(|name| in_path(name)) {
            step()?;
            if self.has_version(&python) {
                found = Some(python);
                break;
            }
        }
        let python = found.ok_or_else(|| {
            Error::Input(format!(
                "there is no Python {major}.{minor} in the path; the packages in {} are built for it; install it",
                self.folder.display()
            ))
        })?;
        // `venv` keeps links that exist, also to an interpreter that was removed.
        let bin = self.folder.join("bin");
        match std::fs::remove_dir_all(&bin) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                let place = bin.display();
                return Err(Error::System(format!("{place}: {error}")));
            }
            _ => {}
        }
        let open = self.is_open.then_some("--system-site-packages");
        let options = ["--without-pip"].into_iter().chain(open);
        step()?;
        fill(&python, &self.folder, options, PATIENCE)
    }

    fn has_version(&self, python: &Path) -> bool {
        let (major, minor) = self.python;
        let release = |version: Version| {
            version
                .release()
                .iter()
                .take(2)
                .copied()
                .collect::<Vec<_>>()
        };
        let said = interpreter::version_within(VERSION_PATIENCE, python);
        said.is_ok_and(|version| release(version) == [major, minor])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    /// An environment that this machine's `python3` has made.
    fn made(folder: &Path) -> Environment {
        let made = Command::new("python3")
            .args(["-m", "venv", "--without-pip"])
            .arg(folder.join(OWN_ENVIRONMENT))
            .status();
        assert!(made.is_ok_and(|status| status.success()));
        Environment::of(folder).expect("an environment")
    }

    #[test]
    fn copied_packages_get_an_interpreter() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(Environment::of(folder.path()), None);
        let here = made(folder.path());
        let there = Environment {
            folder: folder.path().join("there"),
            ..here.clone()
        };
        std::fs::create_dir_all(there.packages()).expect("a folder");
        std::fs::write(there.packages().join("copied.py"), "place = 'there'\n").expect("a file");
        // The remains of an interpreter that was removed.
        std::fs::create_dir(there.folder.join("bin")).expect("a folder");
        let gone = there.folder.join(PROGRAM);
        std::os::unix::fs::symlink("/nowhere/python", &gone).expect("a link");
        // The second time, only its own interpreter is asked.
        for most in [3, 1] {
            let mut steps = 0;
            let completed = there.complete(&mut || {
                steps += 1;
                Ok(())
            });
            completed.expect("an environment");
            assert!((1..=most).contains(&steps), "{steps}");
            let output = Command::new(&gone)
                .args(["-c", "import copied; print(copied.place)"])
                .output()
                .expect("it runs");
            assert_eq!(String::from_utf8_lossy(&output.stdout), "there\n");
        }
        let other = Environment {
            python: (3, 999),
            ..there
        };
        let error = other.complete(&mut || Ok(())).expect_err("no such version");
        let start = "there is no Python 3.999 in the path; the packages in ";
        assert!(error.to_string().starts_with(start), "{error}");
        let lost = here.complete(&mut || Err(io::ErrorKind::BrokenPipe.into()));
        assert!(matches!(lost, Err(Error::System(_))), "{lost:?}");
    }
}
