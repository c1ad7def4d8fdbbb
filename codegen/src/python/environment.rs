//! `.venv` of a component in Python: a virtual environment with the packages of its
//! `pyproject.toml`. Made on request only.

use super::interpreter::{self, OWN_ENVIRONMENT, PROGRAM};
use crate::program::end_of;
use pep440_rs::VersionSpecifiers;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use toml_edit::{DocumentMut, Item, TableLike, Value};

/// A file in an environment that is not finished.
const BEGUN: &str = ".begun-by-rcgen";

/// How long Python may take to make an environment.
const PATIENCE: Duration = Duration::from_mins(2);

/// The number of minor versions that are looked for.
const NEWER: u32 = 10;

/// The reason why there is no environment; the text says what to do.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The user's `pyproject.toml` is wrong, or does not fit the interpreter.
    #[error("{0}")]
    Input(String),
    /// A program failed, or the system refused something.
    #[error("{0}")]
    System(String),
}

/// Contents of a `pyproject.toml`.
struct Needs {
    path: PathBuf,
    /// Requirements of packages (PEP 508).
    packages: Vec<String>,
    /// The versions of Python that the component runs on.
    python: VersionSpecifiers,
    /// The oldest one of its `.cdsl`.
    oldest: (u32, u32),
}

impl Needs {
    /// With `dev`, also the packages of the group of this name, which tests and type checkers are.
    fn read(folder: &Path, oldest: (u32, u32), dev: bool) -> Result<Self, Error> {
        let path = folder.join("pyproject.toml");
        let place = path.display();
        let text = rc_files::read(&path).map_err(|e| Error::System(format!("{place}: {e}")))?;
        let manifest: DocumentMut = text
            .parse()
            .map_err(|error: toml_edit::TomlError| Error::Input(format!("{place}: {error}")))?;
        let project = manifest.get("project").and_then(Item::as_table_like);
        let project = project.ok_or_else(|| {
            Error::Input(format!(
                "{place} has no table `project`, as rcgen writes it"
            ))
        })?;
        let list = |table: &dyn TableLike, key: &str| {
            let Some(list) = table.get(key) else {
                return Ok(Vec::new());
            };
            let values = list.as_array().into_iter().flatten();
            let texts: Option<Vec<String>> = values
                .map(|value| Value::as_str(value).filter(|t| !t.trim_start().starts_with('-')))
                .map(|text| text.map(str::to_owned))
                .collect();
            let texts = texts.filter(|_| list.is_array());
            texts.ok_or_else(|| {
                Error::Input(format!(
                    "{place}: `{key}` is not a list of requirements of packages"
                ))
            })
        };
        let mut packages = list(project, "dependencies")?;
        let groups = project.get("optional-dependencies");
        if let Some(groups) = groups.and_then(Item::as_table_like).filter(|_| dev) {
            packages.extend(list(groups, "dev")?);
        }
        let python = project.get("requires-python").and_then(Item::as_str);
        let python = python.map_or(Ok(VersionSpecifiers::empty()), str::parse);
        let python =
            python.map_err(|error| Error::Input(format!("{place}: requires-python: {error}")))?;
        Ok(Self {
            path,
            packages,
            python,
            oldest,
        })
    }

    /// Whether an interpreter can run the component.
    fn check(&self, python: &Path) -> Result<(), Error> {
        let needed = interpreter::needed_by_this(self.oldest);
        let version = interpreter::version(python);
        let version = version.map_err(|error| Error::System(format!("{error}; {needed}")))?;
        let name = python.display();
        let needed = if !interpreter::is_new_enough(&version, self.oldest) {
            needed
        } else if self.python.contains(&version) {
            return Ok(());
        } else {
            let wanted = self.python.to_string();
            format!(
                "{} has `requires-python = \"{wanted}\"`",
                self.path.display()
            )
        };
        let help = if python.ends_with(PROGRAM) {
            "delete this environment"
        } else {
            "`rcgen venv --python` names another one"
        };
        Err(Error::Input(format!(
            "`{name}` is Python {version}; {needed} ({help})"
        )))
    }

    /// The interpreter of a new environment: `python3` of the path, or the first of `python3.N`
    /// there that fits.
    fn interpreter(&self) -> Result<PathBuf, Error> {
        let usual = PathBuf::from(interpreter::IN_PATH);
        let refused = match self.check(&usual) {
            Ok(()) => return Ok(usual),
            Err(refused) => refused,
        };
        let (major, minor) = self.oldest;
        let mut others = (minor..minor + NEWER).map(|minor| format!("python{major}.{minor}"));
        let found =
            others.find_map(|name| in_path(&name).filter(|program| self.check(program).is_ok()));
        found.ok_or(refused)
    }
}

/// Makes `.venv` in the folder of a component, without packages, or takes the one that is there.
/// `oldest` is the oldest version of Python that the component runs on.
///
/// # Errors
/// [`Error`]: no interpreter fits, or the one of the environment does not.
pub fn make_empty(folder: &Path, oldest: (u32, u32)) -> Result<(), Error> {
    let needs = Needs::read(folder, oldest, false)?;
    create(&needs, &folder.join(OWN_ENVIRONMENT), None)
}

fn create(needs: &Needs, place: &Path, python: Option<&Path>) -> Result<(), Error> {
    let (own, begun) = (place.join(PROGRAM), place.join(BEGUN));
    let system = |error: std::io::Error| Error::System(format!("{}: {error}", place.display()));
    if begun.exists() {
        std::fs::remove_dir_all(place).map_err(system)?;
    } else if own.exists() {
        return needs.check(&own);
    } else if place.exists() {
        let place = place.display();
        return Err(Error::Input(format!(
            "{place} is not a virtual environment: delete it, or give it another name"
        )));
    }
    let python = match python {
        Some(python) => {
            needs.check(python)?;
            python.to_path_buf()
        }
        None => needs.interpreter()?,
    };
    std::fs::create_dir(place).map_err(system)?;
    let outcome = std::fs::write(&begun, "").map_err(system);
    let outcome = outcome.and_then(|()| fill(&python, place, None, PATIENCE));
    match outcome {
        Ok(()) => std::fs::remove_file(&begun).map_err(system),
        Err(error) => {
            // The next call removes what cannot be removed now.
            let _ = std::fs::remove_dir_all(place);
            Err(error)
        }
    }
}

/// Runs the module `venv`, which prints to both outputs why it fails.
pub(super) fn fill<'o>(
    python: &Path,
    place: &Path,
    options: impl IntoIterator<Item = &'o str>,
    patience: Duration,
) -> Result<(), Error> {
    let mut command = Command::new(python);
    command.args(["-m", "venv"]).args(options).arg(place);
    let what = format!("{} -m venv {}", python.display(), place.display());
    let ended = end_of(patience, &mut command, Stdio::null());
    let ended = ended.map_err(|why| Error::System(format!("`{what}` {why}")))?;
    if ended.is_success {
        return Ok(());
    }
    let said = [ended.out, ended.said].concat();
    let said = String::from_utf8_lossy(&said);
    let words: Vec<&str> = said.split_whitespace().collect();
    let said = rc_diagnostics::foreign::clean(&words.join(" "));
    Err(Error::System(format!("`{what}` failed: {said}")))
}

/// Makes `.venv` in the folder of a component, or takes the one that is there, and installs the
/// packages that its `pyproject.toml` names: by `uv` where it is in the path, else by `pip`. Their
/// output is that of this program. `python` is the interpreter of a new environment. The wheel of
/// the framework is installed, too, so that editors and type checkers find it; it replaces one of
/// the same version.
///
/// # Errors
/// [`Error`]; an environment that was begun is completed by the next call.
pub fn make(
    folder: &Path,
    oldest: (u32, u32),
    python: Option<&Path>,
    dev: bool,
    wheel: Option<&Path>,
) -> Result<PathBuf, Error> {
    let needs = Needs::read(folder, oldest, dev)?;
    let place = folder.join(OWN_ENVIRONMENT);
    let own = place.join(PROGRAM);
    let uv = in_path("uv");
    create(&needs, &place, python)?;
    let mut install: Vec<OsString> = match &uv {
        Some(_) => ["pip", "install", "--python"].map(Into::into).to_vec(),
        None => ["-m", "pip", "install", "--disable-pip-version-check"]
            .map(Into::into)
            .to_vec(),
    };
    install.extend(uv.is_some().then(|| own.clone().into_os_string()));
    let program = uv.as_deref().unwrap_or(&own);
    if !needs.packages.is_empty() {
        let mut install = install.clone();
        install.push("--".into());
        install.extend(needs.packages.iter().map(Into::into));
        run(program, &install)?;
    }
    if let Some(wheel) = wheel {
        // Relative names could be those of packages.
        let wheel = std::path::absolute(wheel);
        let wheel = wheel.map_err(|error| Error::System(error.to_string()))?;
        install.extend(["--no-deps", "--force-reinstall", "--"].map(Into::into));
        install.push(wheel.into());
        run(program, &install)?;
    }
    Ok(place)
}

/// A program of the path.
pub(super) fn in_path(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let mut all = std::env::split_paths(&path).map(|folder| folder.join(name));
    all.find(|program| interpreter::may_run(program))
}

fn run(program: &Path, args: &[impl AsRef<OsStr>]) -> Result<(), Error> {
    let status = Command::new(program)
        .args(args)
        .stdin(Stdio::null())
        .status();
    let words = args.iter().map(|arg| arg.as_ref().to_string_lossy());
    let what = format!(
        "{} {}",
        program.display(),
        words.collect::<Vec<_>>().join(" ")
    );
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(Error::System(format!("`{what}` failed: {status}"))),
        Err(error) => Err(Error::System(format!("`{what}`: {error}"))),
    }
}
