//! What tests need that the machine may lack: it is fetched, or the test is listed as skipped.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// For each step of an installation.
const LIMIT: Duration = Duration::from_secs(120);

/// Says that a test could not be run; `cargo xtask test` repeats it at its end.
pub(crate) fn skipped(test: &str, reason: &str) {
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

/// Runs one step; an error says what it was and the last that it printed.
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
