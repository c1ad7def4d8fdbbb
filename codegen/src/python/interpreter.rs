//! Interpreters of Python for a component, and what they print.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The oldest version that components run on.
pub const OLDEST: (u32, u32) = (3, 11);

/// How long an interpreter may take to read a worker.
const PATIENCE: Duration = Duration::from_secs(20);

/// Why no interpreter can be used; the text says what is needed.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{0}")]
pub struct Unusable(pub String);

/// The interpreter that reads workers: that of the active virtual environment, or `python3` of the
/// path. A program in the folder of a component may be a stranger's; reading needs no packages.
pub(super) fn active() -> PathBuf {
    let active = std::env::var_os("VIRTUAL_ENV").filter(|value| !value.is_empty());
    let active = active.map(|folder| PathBuf::from(folder).join("bin/python"));
    active
        .filter(|python| python.exists())
        .unwrap_or_else(|| "python3".into())
}

/// What is needed, for messages.
pub fn needed() -> String {
    let (major, minor) = OLDEST;
    format!("a component in Python needs Python {major}.{minor} or newer")
}

/// Runs a script of this program with arguments and returns what it printed. The interpreter reads
/// no packages and no files of the current folder.
pub(super) fn run(python: &Path, script: &str, args: &[PathBuf]) -> Result<Vec<u8>, Unusable> {
    let name = python.display();
    let failed = |why: &dyn std::fmt::Display| Unusable(format!("`{name}`: {why}; {}", needed()));
    let mut child = Command::new(python)
        .args(["-I", "-S", "-X", "utf8", "-c", script])
        .args(args)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => {
                Unusable(format!("`{name}` does not exist; {}", needed()))
            }
            _ => failed(&error),
        })?;
    let drain = |pipe: Option<Box<dyn Read + Send>>| {
        std::thread::spawn(move || {
            let mut text = Vec::new();
            if let Some(mut pipe) = pipe {
                // What a broken pipe leaves out is no JSON, which is reported.
                let _ = pipe.read_to_end(&mut text);
            }
            text
        })
    };
    let out = drain(
        child
            .stdout
            .take()
            .map(|pipe| Box::new(pipe) as Box<dyn Read + Send>),
    );
    let said = drain(
        child
            .stderr
            .take()
            .map(|pipe| Box::new(pipe) as Box<dyn Read + Send>),
    );
    let end = Instant::now() + PATIENCE;
    let status = loop {
        match child.try_wait() {
            Ok(Some(status)) => break status,
            Ok(None) if Instant::now() < end => std::thread::sleep(Duration::from_millis(1)),
            Ok(None) => {
                let _ = child.kill();
                let _ = child.wait();
                return Err(failed(&format!("no answer within {PATIENCE:?}")));
            }
            Err(error) => return Err(failed(&error)),
        }
    };
    let (out, said) = (
        out.join().unwrap_or_default(),
        said.join().unwrap_or_default(),
    );
    if status.success() {
        return Ok(out);
    }
    let said = String::from_utf8_lossy(&said);
    let last = said
        .trim_end()
        .lines()
        .last()
        .unwrap_or("it failed")
        .to_owned();
    Err(failed(&rc_diagnostics::foreign::clean(&last)))
}
