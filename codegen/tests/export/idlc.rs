//! The compiler of Cyclone DDS, as Debian packs it.

use crate::python::{run, skipped};
use std::path::{Path, PathBuf};
use std::process::Command;

pub(crate) struct Idlc {
    program: PathBuf,
    /// Where its libraries are, unless the system knows.
    libraries: Option<PathBuf>,
}

/// The one of the system, else one below the target folder which is made once: it needs no rights. Where there is no
/// way to it, `test` is listed as skipped.
pub(crate) fn idlc(test: &str) -> Option<Idlc> {
    let system = Idlc {
        program: PathBuf::from("idlc"),
        libraries: None,
    };
    if system.works() {
        return Some(system);
    }
    match install() {
        Ok(idlc) => Some(idlc),
        Err(reason) => {
            skipped(test, &reason);
            None
        }
    }
}

fn install() -> Result<Idlc, String> {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let place = folder.join("cyclonedds-tools");
    let found = unpacked(&place);
    if found.works() {
        return Ok(found);
    }
    // Made under another name, so that what is found is whole.
    let new = folder.join(format!("cyclonedds-tools-{}", std::process::id()));
    let script = "set -e; mkdir \"$0\"; cd \"$0\"
        apt-get download $(apt-get --simulate install cyclonedds-tools | sed -n 's/^Inst \\([^ ]*\\).*/\\1/p')
        for package in *.deb; do dpkg --extract $package .; done";
    let made = run(Path::new("sh"), &["-c", script, &new.display().to_string()]);
    // The script itself is no use in a list.
    let made = made.map_err(|error| {
        let last = error.rsplit("`: ").next().unwrap_or_default();
        format!("apt-get download cyclonedds-tools: {last}")
    });
    let made = made.and_then(|()| {
        if unpacked(&new).works() {
            Ok(())
        } else {
            Err("Debian's cyclonedds-tools hold no idlc that runs here".to_owned())
        }
    });
    if made.is_ok() && std::fs::rename(&new, &place).is_err() {
        // What is there was spoilt, or is another one's.
        let _ = std::fs::remove_dir_all(&place);
        let _ = std::fs::rename(&new, &place);
    }
    let _ = std::fs::remove_dir_all(&new);
    made.map(|()| unpacked(&place))
}

/// The compiler in packages that were unpacked in `folder`.
fn unpacked(folder: &Path) -> Idlc {
    let libraries = folder.join(format!("usr/lib/{}-linux-gnu", std::env::consts::ARCH));
    Idlc {
        program: folder.join("usr/bin/idlc"),
        libraries: Some(libraries),
    }
}

impl Idlc {
    fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        if let Some(libraries) = &self.libraries {
            command.env("LD_LIBRARY_PATH", libraries);
        }
        command
    }

    fn works(&self) -> bool {
        let output = self.command().arg("-v").output();
        output.is_ok_and(|output| output.status.success())
    }

    /// Compiles `file` of `folder`.
    pub(crate) fn compile(&self, folder: &Path, file: &Path) {
        let output = self.command().arg(file).current_dir(folder).output();
        let output = output.expect("idlc");
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        // Annotations that are not found, and names that are not taken, are warnings only.
        let wrong = |line: &&str| {
            !line.contains("Explicit defaults are not supported yet")
                && !line.contains("are not consecutive or not starting from zero")
        };
        let wrong: Vec<&str> = said.lines().filter(wrong).collect();
        assert!(
            output.status.success() && wrong.is_empty(),
            "{}\n{said}",
            file.display()
        );
    }
}
