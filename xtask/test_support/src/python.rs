//! Environments of Python with packages from `PyPI`, below the target folder.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::{File, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// For each step of the installation.
const LIMIT: Duration = Duration::from_mins(5);

/// Returns an interpreter that has `package`, written as `NAME==VERSION`. Without Python, or
/// without a way to the package, `test` is listed as skipped.
pub fn interpreter(package: &'static str, test: &str) -> Option<&'static Path> {
    let name = package.replace("==", "-");
    environment(&name, package, &[], || Ok("python3".into()), test)
}

/// ROS 2 Jazzy with Fast DDS, of the wheels for Python 3.12: rclpy and the standard interfaces.
const ROS_JAZZY: &str = include_str!("ros_jazzy.txt");
const ROS_JAZZY_BUILD: &str = include_str!("ros_jazzy_build.txt");

/// Returns an interpreter that has rclpy. Without Python 3.12, or without a way to the wheels,
/// `test` is listed as skipped.
pub fn ros(test: &str) -> Option<&'static Path> {
    wheels("ros-jazzy", ROS_JAZZY, test)
}

/// Returns an interpreter with what builds packages of interfaces for the environment of [`ros`]:
/// packages of cmake, and generators of code.
pub fn ros_build(test: &str) -> Option<&'static Path> {
    wheels("ros-jazzy-build", ROS_JAZZY_BUILD, test)
}

/// Returns an interpreter of the environment `name`, which has the wheels of a list for Python 3.12,
/// and no others. Without Python 3.12, or without a way to the wheels, `test` is listed as skipped.
pub fn wheels(name: &str, requirements: &'static str, test: &str) -> Option<&'static Path> {
    // The lists are complete. Wheels of ROS 2 also depend on tools that no test needs.
    environment(name, requirements, &["--no-deps"], python_3_12, test)
}

/// Returns an interpreter that has the packages of a list, in the syntax of a file of pip. Without
/// Python, or without a way to the packages, `test` is listed as skipped.
pub fn packages(name: &str, requirements: &'static str, test: &str) -> Option<&'static Path> {
    environment(name, requirements, &[], || Ok("python3".into()), test)
}

/// Takes the files with these endings out of the only archive of a folder. Arguments: the folder, the
/// endings.
const UNPACK: &str = "\
import pathlib, sys, tarfile
folder, *endings = sys.argv[1:]
[archive] = pathlib.Path(folder).glob('*.tar.gz')
with tarfile.open(archive) as archive:
    wanted = [m for m in archive.getmembers() if m.isfile() and m.name.endswith(tuple(endings))]
    archive.extractall(folder, wanted, filter='data')
";

/// Returns a folder with the files of the sources of `package` that have these endings; the package is
/// written as `NAME==VERSION`. It is not built, but pip asks its build backend for its metadata, which
/// runs code of the package. Without Python 3.12, or without a way to the package, `test` is listed as
/// skipped.
pub fn sources(package: &str, endings: &[&str], test: &str) -> Option<PathBuf> {
    match unpacked(package, endings) {
        Ok(place) => Some(place),
        Err(reason) => {
            skipped(test, &reason);
            None
        }
    }
}

fn unpacked(package: &str, endings: &[&str]) -> Result<PathBuf, String> {
    let folder = folder()?;
    let endings_of = endings
        .concat()
        .replace(|c: char| !c.is_alphanumeric(), "-");
    let name = format!("{}{endings_of}", package.replace("==", "-"));
    let place = folder.join(format!("{name}-sources"));
    let _lock = lock(&folder.join(format!("{name}-sources.lock")))?;
    if place.exists() {
        return Ok(place);
    }
    // Unpacked under another name and renamed, so that an existing folder is complete.
    let new = folder.join(format!("{name}-{}", std::process::id()));
    let text = new.display().to_string();
    let python = python_3_12()?;
    let pip = "-m pip download --quiet --disable-pip-version-check --no-deps --retries 1 --timeout 15 --dest";
    // What the package needs to be built may come as wheels.
    let own = package.split("==").next().unwrap_or(package);
    let pip = pip.split(' ');
    let pip: Vec<&str> = pip
        .chain([text.as_str(), "--no-binary", own, package])
        .collect();
    let unpack: Vec<&str> = ["-c", UNPACK, text.as_str()]
        .into_iter()
        .chain(endings.iter().copied())
        .collect();
    let made = run(&python, &pip).and_then(|()| run(&python, &unpack));
    let made = made.and_then(|()| {
        std::fs::rename(&new, &place).map_err(|error| format!("{}: {error}", place.display()))
    });
    let _ = std::fs::remove_dir_all(&new);
    made.map(|()| place)
}

/// Returns an interpreter of the environment `name` with packages, for programs that are not tests.
///
/// # Errors
/// There is no Python, or no way to the packages.
pub fn installed(name: &str, requirements: &str) -> Result<PathBuf, String> {
    install(name, requirements, &[], || Ok("python3".into()))
}

/// Returns an interpreter that has pip. Other environments have none of their own, and it installs
/// into them with `pip --python`.
///
/// # Errors
/// There is no Python, or it cannot make an environment.
pub fn pip() -> Result<PathBuf, String> {
    let folder = folder()?;
    let place = folder.join("pip");
    let python = place.join("bin/python");
    let _lock = lock(&folder.join("pip.lock"))?;
    let pip = |words: &str| run(&python, &words.split(' ').collect::<Vec<_>>());
    // That of Python 3.10 installs into no other environment.
    let knows_others = "-m pip --python . --help";
    if pip(knows_others).is_err() {
        make(&place, "python3".as_ref(), &[])?;
        if pip(knows_others).is_err() {
            pip(
                "-m pip install --quiet --disable-pip-version-check --retries 1 --timeout 15 pip>=23",
            )?;
        }
    }
    Ok(python)
}

/// The environment `name` with `requirements`, in the syntax of a file of pip, and more options of
/// its installation.
fn environment(
    name: &str,
    requirements: &str,
    options: &[&str],
    base: impl FnOnce() -> Result<PathBuf, String>,
    test: &str,
) -> Option<&'static Path> {
    static FOUND: Mutex<BTreeMap<String, Result<&Path, String>>> = Mutex::new(BTreeMap::new());
    let mut found = FOUND.lock().unwrap_or_else(PoisonError::into_inner);
    let found = found.entry(name.to_owned()).or_insert_with(|| {
        let python = install(name, requirements, options, base)?;
        Ok(Box::leak(python.into_boxed_path()))
    });
    match found {
        Ok(python) => Some(python),
        Err(reason) => {
            skipped(test, reason);
            None
        }
    }
}

/// Finds Python 3.12 in the path, or among the versions of pyenv.
fn python_3_12() -> Result<PathBuf, String> {
    let pyenv = std::env::var_os("PYENV_ROOT").map(PathBuf::from);
    let pyenv = pyenv.or_else(|| Some(Path::new(&std::env::var_os("HOME")?).join(".pyenv")));
    let versions = pyenv.and_then(|root| std::fs::read_dir(root.join("versions")).ok());
    let versions = versions.into_iter().flatten().flatten();
    let versions = versions.map(|version| version.path().join("bin/python"));
    let in_path = ["python3.12", "python3"].map(PathBuf::from);
    let check = "import sys; sys.exit(sys.version_info[:2] != (3, 12))";
    let mut all = in_path.into_iter().chain(versions);
    all.find(|python| run(python, &["-c", check]).is_ok())
        .ok_or_else(|| "there is no Python 3.12 in the path and none of pyenv".to_owned())
}

/// Lists a test that could not be run; `cargo xtask test` repeats the line at its end.
///
/// # Panics
///
/// The file that `cargo xtask test` names is not writable.
pub fn skipped(test: &str, reason: &str) {
    let line = format!("skipped: {test}: {reason}\n");
    // Past the test harness, which keeps what successful tests print to itself.
    let _ = std::io::stderr().write_all(line.as_bytes());
    if let Some(list) = std::env::var_os("RC_TEST_SKIPPED") {
        let list = std::fs::File::options()
            .append(true)
            .create(true)
            .open(list);
        list.and_then(|mut list| list.write_all(line.as_bytes()))
            .expect("the list of skipped tests");
    }
}

/// Loads the packages, so that Python compiles what tests will load: a small part of them.
const COMPILE: &str = r"
import importlib, importlib.metadata, sys
sys.dont_write_bytecode = False
for distribution in importlib.metadata.distributions():
    for name in (distribution.read_text('top_level.txt') or distribution.metadata['Name']).split():
        try:
            importlib.import_module(name)
        except BaseException:
            pass
";

/// Makes an environment, or finds it complete. An installation that was killed begins again.
fn install(
    name: &str,
    requirements: &str,
    options: &[&str],
    base: impl FnOnce() -> Result<PathBuf, String>,
) -> Result<PathBuf, String> {
    let folder = folder()?;
    let place = folder.join(name);
    let python = place.join("bin/python");
    let complete = place.join("complete.txt");
    // Other programs of the test run install the same. The lock ends with its process.
    let _lock = lock(&folder.join(format!("{name}.lock")))?;
    let is_complete = std::fs::read_to_string(&complete).is_ok_and(|text| text == requirements);
    if is_complete && run(&python, &["-c", ""]).is_ok() {
        return Ok(python);
    }
    make(&place, &base()?, &["--without-pip"])?;
    let list = place.join("requirements.txt");
    std::fs::write(&list, requirements).map_err(failed(&list))?;
    let install = "install --no-compile --quiet --disable-pip-version-check --only-binary :all: --retries 1 --timeout 15";
    let install = install.split(' ').chain(options.iter().copied());
    let install = install.chain(["-r"]).map(OsStr::new);
    let begin = ["-m", "pip", "--python"].map(OsStr::new);
    let arguments = begin.into_iter().chain([python.as_ref()]);
    let arguments = arguments.chain(install).chain([list.as_ref()]);
    run(&pip()?, &arguments.collect::<Vec<_>>())?;
    // Not each of them can be loaded without more.
    let _ = run(&python, &["-c", COMPILE]);
    std::fs::rename(&list, &complete).map_err(failed(&complete))?;
    Ok(python)
}

/// The folder of environments. Cargo makes it only for tests.
fn folder() -> Result<PathBuf, String> {
    let folder = crate::folder()?;
    std::fs::create_dir_all(&folder).map_err(failed(&folder))?;
    Ok(folder)
}

/// Makes an environment in `place`, in place of what is there.
fn make(place: &Path, base: &Path, options: &[&str]) -> Result<(), String> {
    if place.exists() {
        std::fs::remove_dir_all(place).map_err(failed(place))?;
    }
    let options = ["-m", "venv"].iter().chain(options).map(OsStr::new);
    run(base, &options.chain([place.as_ref()]).collect::<Vec<_>>())
}

/// The message about a file.
fn failed(what: &Path) -> impl Fn(std::io::Error) -> String {
    let what = what.display().to_string();
    move |error| format!("{what}: {error}")
}

/// Locks a file for as long as the result lives.
fn lock(path: &Path) -> Result<File, String> {
    let file = File::create(path).map_err(failed(path))?;
    let end = Instant::now() + 2 * LIMIT;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(file),
            Err(TryLockError::WouldBlock) if Instant::now() < end => {
                std::thread::sleep(Duration::from_millis(50));
            }
            Err(TryLockError::WouldBlock) => {
                return Err(format!("{}: another installation holds it", path.display()));
            }
            Err(TryLockError::Error(error)) => return Err(failed(path)(error)),
        }
    }
}

/// Runs a program for at most five minutes.
///
/// # Errors
///
/// The command, and the last line that it printed to standard error.
pub fn run(program: &Path, args: &[impl AsRef<OsStr>]) -> Result<(), String> {
    let words = args.iter().map(|arg| arg.as_ref().to_string_lossy());
    let words = words.collect::<Vec<_>>().join(" ");
    let what = format!("{} {words}", program.display());
    let mut child = Command::new(program)
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| format!("`{what}`: {error}"))?;
    let end = Instant::now() + LIMIT;
    while child
        .try_wait()
        .map_err(|e| format!("`{what}`: {e}"))?
        .is_none()
    {
        if Instant::now() > end {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("`{what}` took more than {LIMIT:?}"));
        }
        std::thread::sleep(Duration::from_millis(10));
    }
    let output = child
        .wait_with_output()
        .map_err(|e| format!("`{what}`: {e}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.trim_end().lines().last().unwrap_or("it failed");
    if output.status.success() {
        Ok(())
    } else {
        Err(format!("`{what}`: {last}"))
    }
}
