//! A clock of the system that jumps and a disk that is slow, for rcdeploy and its components alone:
//! a library in C, which is compiled here and loaded before the C library (`LD_PRELOAD`). Nobody
//! sets the clock of a machine for a test.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

const SOURCE: &str = include_str!("shim.c");
/// The compiler that a build needs as well.
const COMPILER: &str = "cc";

/// The library, and the file of its two numbers.
pub(super) struct Shim {
    library: PathBuf,
    path: PathBuf,
    numbers: File,
}

impl Shim {
    /// Compiles the library into a folder, or says why there is none.
    pub(super) fn compile(folder: &Path) -> Result<Self, String> {
        let (library, path) = (folder.join("shim.so"), folder.join("shim"));
        let source = folder.join("shim.c");
        std::fs::write(&source, SOURCE).map_err(|e| e.to_string())?;
        let mut compiler = Command::new(COMPILER);
        compiler.args(["-shared", "-fPIC", "-O1", "-o"]);
        let output = compiler.arg(&library).arg(&source).output();
        let output = output.map_err(|e| format!("{COMPILER} cannot be started: {e}"))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            let first = said.lines().next().unwrap_or_default();
            return Err(format!("{COMPILER} cannot compile it: {first}"));
        }
        let numbers = File::create_new(&path).map_err(|e| e.to_string())?;
        let shim = Self {
            library,
            path,
            numbers,
        };
        shim.set_clock(0)
            .and_then(|()| shim.slow_disk(Duration::ZERO))
            .map_err(|e| e.to_string())?;
        Ok(shim)
    }

    /// Lets a program and all that it starts load the library.
    pub(super) fn load_into(&self, command: &mut Command) {
        command
            .env("LD_PRELOAD", &self.library)
            .env("RC_CHAOS_SHIM", &self.path);
    }

    /// Sets the clock of the system so many seconds ahead, or back.
    pub(super) fn set_clock(&self, seconds: i64) -> io::Result<()> {
        self.numbers.write_all_at(&seconds.to_ne_bytes(), 0)
    }

    /// Lets each write to a file take so much longer.
    pub(super) fn slow_disk(&self, pause: Duration) -> io::Result<()> {
        let micros = i64::try_from(pause.as_micros()).unwrap_or(i64::MAX);
        self.numbers.write_all_at(&micros.to_ne_bytes(), 8)
    }
}
