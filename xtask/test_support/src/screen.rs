//! A display without a monitor: Xvfb of Debian.

use crate::debian::provided;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A running display. Dropping it ends it.
pub struct Screen {
    server: Child,
    /// The value of the variable `DISPLAY`.
    pub name: String,
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Screen {
    /// Starts a display that no other process uses.
    ///
    /// # Errors
    /// The reason why there is none.
    pub fn new() -> Result<Self, String> {
        let place = provided("xvfb", &|place| Self::start(place).is_ok())?;
        Self::start(place.as_deref())
    }

    /// The process of the server.
    pub fn process(&self) -> u32 {
        self.server.id()
    }

    /// Starts the server of the system, or one unpacked in `place`.
    fn start(place: Option<&Path>) -> Result<Self, String> {
        match place {
            Some(place) => Self::run(&mut unpacked(place)?),
            None => Self::run(&mut Command::new("Xvfb")),
        }
    }

    fn run(server: &mut Command) -> Result<Self, String> {
        server
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1024x768x24",
                "-nolisten",
                "tcp",
                "-noreset",
            ])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        let mut server = server.spawn().map_err(|e| e.to_string())?;
        let mut number = String::new();
        let output = server.stdout.take().ok_or("no output")?;
        // The server prints its number when it is ready, or ends.
        let read = BufReader::new(output).read_line(&mut number);
        let screen = Self {
            server,
            name: format!(":{}", number.trim()),
        };
        match read {
            Ok(_) if !number.trim().is_empty() => Ok(screen),
            _ => Err("Xvfb does not start".to_owned()),
        }
    }
}

/// The server in packages unpacked in `place`.
fn unpacked(place: &Path) -> Result<Command, String> {
    let programs = place.join("usr/bin");
    let failed = |error: std::io::Error| error.to_string();
    // Libraries that the system has are not unpacked.
    let libraries = std::fs::read_dir(place.join("usr/lib"));
    let libraries = libraries.into_iter().flatten().flatten();
    let libraries = std::env::join_paths(libraries.map(|entry| entry.path()));
    let libraries = libraries.map_err(|error| error.to_string())?;
    // The server starts xkbcomp in /usr/bin. If it is not installed there, it is unpacked, and a
    // copy of the server starts it in its working directory.
    let mut server = programs.join("Xvfb");
    if programs.join("xkbcomp").exists() {
        let own = programs.join("Xvfb-here");
        if !own.exists() {
            let mut bytes = std::fs::read(&server).map_err(failed)?;
            let path = b"\0/usr/bin\0";
            let at = bytes.windows(path.len()).position(|window| window == path);
            if let Some(at) = at {
                bytes[at..at + path.len()].copy_from_slice(b"\0.\0\0\0\0\0\0\0\0");
            }
            let new = programs.join(format!("Xvfb-{}", std::process::id()));
            std::fs::copy(&server, &new).map_err(failed)?;
            std::fs::write(&new, bytes).map_err(failed)?;
            std::fs::rename(&new, &own).map_err(failed)?;
        }
        server = own;
    }
    let mut command = Command::new(server);
    command
        .current_dir(programs)
        .env("LD_LIBRARY_PATH", libraries);
    Ok(command)
}
