//! Programs in Python that use the package of a middleware and implement the documented protocol.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The time limit of each step of the installation.
const LIMIT: Duration = Duration::from_mins(2);

/// An interpreter with `package`, in a virtual environment below the target folder that is created
/// once. Without Python, or without access to the package, reports `test` as skipped.
pub(crate) fn interpreter(package: &'static str, test: &str) -> Option<&'static Path> {
    static FOUND: Mutex<BTreeMap<&str, Result<&Path, String>>> = Mutex::new(BTreeMap::new());
    let mut found = FOUND.lock().unwrap_or_else(PoisonError::into_inner);
    let found = found.entry(package).or_insert_with(|| {
        let python = install(package)?;
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

/// Reports a skipped test. `cargo xtask test` repeats the line at its end.
pub(crate) fn skipped(test: &str, reason: &str) {
    let line = format!("skipped: {test}: {reason}\n");
    // Written directly, because the test harness captures the output of successful tests.
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

/// Installs `package`, which has the form `NAME==VERSION`.
fn install(package: &str) -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let place = folder.join(package.replace("==", "-"));
    let python = place.join("bin/python");
    let name = package.split('=').next().unwrap_or(package);
    if run(&python, &["-c", &format!("import {name}")]).is_ok() {
        return Ok(python);
    }
    // Created under another name and renamed, so that an existing environment is complete even with
    // concurrent runs.
    let new = folder.join(format!("python-{}", std::process::id()));
    let path = new.display().to_string();
    let made = run(Path::new("python3"), &["-m", "venv", &path]).and_then(|()| {
        let pip = "-m pip install --quiet --disable-pip-version-check --only-binary :all: --retries 1 --timeout 15";
        let pip: Vec<&str> = pip.split(' ').chain([package]).collect();
        run(&new.join("bin/python"), &pip)
    });
    if made.is_ok() && std::fs::rename(&new, &place).is_err() && place.exists() {
        // The existing environment belongs to a concurrent run, or is damaged.
        let _ = std::fs::remove_dir_all(&place);
        let _ = std::fs::rename(&new, &place);
    }
    let _ = std::fs::remove_dir_all(&new);
    made.map(|()| python)
}

/// Runs one step. The error contains the command and its last output.
pub(crate) fn run(program: &Path, args: &[&str]) -> Result<(), String> {
    let what = format!("{} {}", program.display(), args.join(" "));
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
