//! The interpreter that the launcher of a component takes: whether it is new enough, and whether it
//! has `NumPy`. At most `python3` of the path runs for that: the files of a virtual environment tell.

use super::interpreter::{self, Unusable};
use crate::project::Project;
use pep440_rs::Version;
use rc_diagnostics::{Diagnostic, Span};
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Files of paths that set up their environment and add no package: of setuptools, of virtualenv.
const HARMLESS: [&str; 2] = ["distutils-precedence.pth", "_virtualenv.pth"];

/// The version of `python3`, or the reason why it is unknown. It is asked once for all components.
#[derive(Debug, Default)]
pub struct InPath(Option<Result<Version, Unusable>>);

/// The next step for the component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// It starts as it is.
    Starts,
    /// It is built, which makes the environment that its `.cdsl` asks for.
    IsBuilt,
}

/// The interpreter that a launcher selects.
enum Selected {
    /// `.venv` of the component.
    Own(PathBuf),
    /// The active virtual environment.
    Active(PathBuf),
    /// `python3` of the path.
    InPath,
}

impl Selected {
    /// In the order of the launcher.
    fn by(folder: &Path) -> Self {
        let own = folder.join(interpreter::OWN_ENVIRONMENT);
        if interpreter::may_run(&own.join(interpreter::PROGRAM)) {
            return Self::Own(own);
        }
        interpreter::active_environment().map_or(Self::InPath, Self::Active)
    }
}

/// Reports, at `place`, an interpreter on which the launcher of a component would fail: it is
/// missing, too old, or has no `NumPy`. If its files leave doubts, the launcher checks.
pub fn check(
    project: &Project,
    place: Span,
    next: Next,
    in_path: &mut InPath,
) -> Option<Diagnostic> {
    let make = format!("`rcgen venv {}`", project.path.display());
    let error =
        |code, message: String, help: String| Diagnostic::error(code, place, message).help(help);
    let oldest = project.oldest_python();
    let needed = interpreter::needed_by_this(oldest);
    let old = |program: &Path, version: &Version, help: String| {
        let program = program.display();
        let message = format!("`{program}` is Python {version}; {needed}");
        let is_old = !interpreter::is_new_enough(version, oldest);
        is_old.then(|| error("old-python", message, help))
    };
    let home = |program: &Path, version: &Version| {
        let home = wrong_home(version)?;
        let message = format!(
            "PYTHONHOME is {}, with which `{}` does not start: it has no library of Python {}.{}",
            rc_diagnostics::foreign::clean(&home.to_string_lossy()),
            program.display(),
            version.release()[0],
            version.release()[1],
        );
        Some(error(
            "no-python",
            message,
            "unset it: `unset PYTHONHOME`".to_owned(),
        ))
    };
    let (environment, help_old, help_numpy) = match Selected::by(project.code()) {
        Selected::InPath => {
            let makes = project.component.python.is_some_and(|python| python.venv);
            if makes && next == Next::IsBuilt {
                return None;
            }
            let program = Path::new(interpreter::IN_PATH);
            let asked = in_path
                .0
                .get_or_insert_with(|| interpreter::version(program));
            return match asked {
                Ok(version) => {
                    let help = format!("with a newer one in the path, {make} makes an environment");
                    old(program, version, help).or_else(|| home(program, version))
                }
                Err(Unusable(reason)) => {
                    let help = "install it, or activate a virtual environment that has it";
                    let message = format!("{reason}; {needed}");
                    Some(error("no-python", message, help.to_owned()))
                }
            };
        }
        Selected::Active(environment) => {
            let program = environment.join(interpreter::PROGRAM);
            let install = format!("`{} -m pip install numpy`", program.display());
            let other = "deactivate this environment, or activate another one".to_owned();
            (environment, other, format!("{install} installs it"))
        }
        Selected::Own(environment) => {
            let anew = format!("delete this environment; {make} makes a new one");
            (environment, anew, format!("{make} installs it"))
        }
    };
    let settings = Settings::read(&environment)?;
    let program = environment.join(interpreter::PROGRAM);
    let numpy = || {
        let message = format!("`{}` has no NumPy", environment.display());
        let lacks = settings.lacks_numpy(&environment)?;
        lacks.then(|| error("no-numpy", message, help_numpy))
    };
    old(&program, &settings.version, help_old)
        .or_else(|| home(&program, &settings.version))
        .or_else(numpy)
}

/// PYTHONHOME, if it names a folder without the library of this version: then no interpreter
/// starts. Only the files tell: `rcgen` runs interpreters without this variable.
fn wrong_home(version: &Version) -> Option<OsString> {
    let home = std::env::var_os("PYTHONHOME").filter(|home| !home.is_empty())?;
    // Python takes the first of two folders for its library.
    let prefix = std::env::split_paths(&home).next()?;
    let (major, minor) = (version.release()[0], version.release()[1]);
    let library = |folder: &str| {
        let folder = prefix.join(folder);
        folder.join(format!("python{major}.{minor}/os.py")).exists()
            || folder.join(format!("python{major}{minor}.zip")).exists()
    };
    (!["lib", "lib64"].into_iter().any(library)).then_some(home)
}

/// The contents of `pyvenv.cfg` about a virtual environment.
pub(super) struct Settings {
    version: Version,
    /// Whether it has the packages of the interpreter that it was made with.
    pub(super) is_open: bool,
}

impl Settings {
    /// `None` for a folder that is not a virtual environment, or does not say its version.
    pub(super) fn read(environment: &Path) -> Option<Self> {
        let text = rc_files::read(&environment.join("pyvenv.cfg")).ok()?;
        let pairs = text.lines().filter_map(|line| line.split_once('='));
        let value = |wanted: &str| {
            let of = pairs.clone().find(|(key, _)| key.trim() == wanted);
            of.map(|(_, value)| value.trim().to_ascii_lowercase())
        };
        // `venv` writes the first, `virtualenv` and `uv` the second, as `3.12.1.final.0`.
        let version = value("version").or_else(|| value("version_info"))?;
        let numbers: Option<Vec<u64>> =
            version.split('.').take(2).map(|n| n.parse().ok()).collect();
        let numbers = numbers.filter(|numbers| numbers.len() == 2)?;
        Some(Self {
            version: Version::new(numbers),
            is_open: value("include-system-site-packages").is_some_and(|value| value == "true"),
        })
    }

    /// Major and minor version.
    pub(super) fn numbers(&self) -> (u64, u64) {
        let release = self.version.release();
        (release[0], release[1])
    }

    /// Whether an interpreter of the environment cannot find `NumPy`. `None` if only it can tell.
    fn lacks_numpy(&self, environment: &Path) -> Option<bool> {
        if self.is_open {
            return None;
        }
        let (major, minor) = self.numbers();
        let packages = format!("lib/python{major}.{minor}/site-packages");
        for entry in environment.join(packages).read_dir().ok()? {
            let name = entry.ok()?.file_name();
            let name = name.to_str()?;
            // Also what an installation from sources leaves.
            if name
                .trim_start_matches("__editable__.")
                .starts_with("numpy")
            {
                return Some(false);
            }
            let adds_paths = Path::new(name).extension().is_some_and(|end| end == "pth");
            if adds_paths && !HARMLESS.contains(&name) {
                return None;
            }
        }
        let more = std::env::var_os("PYTHONPATH").unwrap_or_default();
        // A variable without text names no folder; `split_paths` makes an empty path of it.
        for folder in std::env::split_paths(&more).filter(|_| !more.is_empty()) {
            match folder.join("numpy").metadata() {
                Ok(_) => return Some(false),
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                // An archive, or a folder that cannot be read.
                Err(_) => return None,
            }
        }
        Some(true)
    }
}
