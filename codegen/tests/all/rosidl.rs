//! The tools of ROS 2 that read interface packages, as Debian packs them.

use crate::debian;
use crate::python::skipped;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Debian's own, for which the packages are made.
const PYTHON: &str = "/usr/bin/python3";
const PACKAGES: &str = "rosidl-tools python3-rosidl python3-catkin-pkg python3-empy";

pub(crate) struct Rosidl {
    /// Where its modules are, unless the system knows.
    modules: Option<PathBuf>,
}

/// Those of the system, else some below the target folder. Where there is no way to them, `test` is listed as skipped.
pub(crate) fn rosidl(test: &str) -> Option<Rosidl> {
    let system = Rosidl { modules: None };
    if system.works() {
        return Some(system);
    }
    match debian::unpacked(PACKAGES, &|folder| unpacked(folder).works()) {
        Ok(folder) => Some(unpacked(&folder)),
        Err(reason) => {
            skipped(test, &reason);
            None
        }
    }
}

/// The modules in packages that were unpacked in `folder`.
fn unpacked(folder: &Path) -> Rosidl {
    Rosidl {
        modules: Some(folder.join("usr/lib/python3/dist-packages")),
    }
}

impl Rosidl {
    fn python(&self) -> Command {
        let mut command = Command::new(PYTHON);
        if let Some(modules) = &self.modules {
            command.env("PYTHONPATH", modules);
        }
        command
    }

    fn works(&self) -> bool {
        let import = "import rosidl_cli, rosidl_adapter, rosidl_parser.parser, catkin_pkg, em";
        let mut command = self.python();
        let output = command.args(["-c", import]).stderr(Stdio::null()).status();
        output.is_ok_and(|status| status.success())
    }

    /// What `packages.py` finds in the packages in each of `folders`, line by line.
    pub(crate) fn read(&self, folders: &[PathBuf]) -> String {
        let out = tempfile::tempdir().expect("a folder");
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ros/packages.py");
        let mut command = self.python();
        let output = command.arg(script).arg(out.path()).args(folders).output();
        let output = output.expect("Python");
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said);
        assert!(output.status.success(), "{said}");
        std::fs::read_to_string(out.path().join("found")).expect("what was found")
    }
}
