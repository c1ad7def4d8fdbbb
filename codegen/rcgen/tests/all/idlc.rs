//! The compiler of Cyclone DDS from a Debian package.

use rc_test_support::debian;
use rc_test_support::python::skipped;
use std::path::{Path, PathBuf};
use std::process::Command;

pub(crate) struct Idlc {
    program: PathBuf,
    /// The folder of its libraries, unless they are installed.
    libraries: Option<PathBuf>,
}

/// The installed compiler, or one unpacked below the target folder, which needs no root
/// permissions. Without either, reports `test` as skipped.
pub(crate) fn idlc(test: &str) -> Option<Idlc> {
    match debian::provided("cyclonedds-tools", &|place| compiler(place).works()) {
        Ok(place) => Some(compiler(place.as_deref())),
        Err(reason) => {
            skipped(test, &reason);
            None
        }
    }
}

/// The compiler of the system, or in packages unpacked in `place`.
fn compiler(place: Option<&Path>) -> Idlc {
    let libraries = format!("usr/lib/{}-linux-gnu", std::env::consts::ARCH);
    Idlc {
        program: place.map_or("idlc".into(), |place| place.join("usr/bin/idlc")),
        libraries: place.map(|place| place.join(libraries)),
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
        // The compiler only warns about unknown annotations and rejected names.
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
