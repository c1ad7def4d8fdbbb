//! A display without a monitor: Xvfb of Debian.

use crate::debian::unpacked;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A running display. Dropping it ends it.
pub(crate) struct Screen {
    server: Child,
    /// The value of the variable `DISPLAY`.
    pub(crate) name: String,
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

impl Screen {
    /// Starts a display that no other process uses. The error is the reason why there is none.
    pub(crate) fn new() -> Result<Self, String> {
        let folder = unpacked("xvfb", &|folder| Self::start(folder).is_ok())?;
        Self::start(&folder)
    }

    fn start(folder: &Path) -> Result<Self, String> {
        let programs = folder.join("usr/bin");
        let libraries = std::fs::read_dir(folder.join("usr/lib")).map_err(|e| e.to_string())?;
        let libraries = libraries.flatten().map(|entry| entry.path());
        let libraries = std::env::join_paths(libraries).map_err(|e| e.to_string())?;
        // The server starts xkbcomp in /usr/bin, where it need not be installed. This copy starts
        // it in its working directory.
        let (server, own) = (programs.join("Xvfb"), programs.join("Xvfb-here"));
        if !own.exists() {
            let mut bytes = std::fs::read(&server).map_err(|e| e.to_string())?;
            let path = b"\0/usr/bin\0";
            let at = bytes.windows(path.len()).position(|window| window == path);
            if let Some(at) = at {
                bytes[at..at + path.len()].copy_from_slice(b"\0.\0\0\0\0\0\0\0\0");
            }
            let new = programs.join(format!("Xvfb-{}", std::process::id()));
            std::fs::copy(&server, &new).map_err(|e| e.to_string())?;
            std::fs::write(&new, bytes).map_err(|e| e.to_string())?;
            std::fs::rename(&new, &own).map_err(|e| e.to_string())?;
        }
        let mut server = Command::new(&own);
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
            .current_dir(&programs)
            .env("LD_LIBRARY_PATH", libraries)
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
