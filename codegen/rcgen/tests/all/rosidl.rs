//! The tools of ROS 2 for interface packages, from Debian packages.

use rc_test_support::debian;
use rc_test_support::python::skipped;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The interpreter of Debian, which its packages require.
const PYTHON: &str = "/usr/bin/python3";
const PACKAGES: &str = "rosidl-tools python3-rosidl python3-catkin-pkg python3-empy";

pub(crate) struct Rosidl {
    /// The folder of its modules, unless they are installed.
    modules: Option<PathBuf>,
}

/// The installed tools, or tools unpacked below the target folder. Without either, reports `test`
/// as skipped.
pub(crate) fn rosidl(test: &str) -> Option<Rosidl> {
    match debian::provided(PACKAGES, &|place| tools(place).works()) {
        Ok(place) => Some(tools(place.as_deref())),
        Err(reason) => {
            skipped(test, &reason);
            None
        }
    }
}

/// The tools of the system, or in packages unpacked in `place`.
fn tools(place: Option<&Path>) -> Rosidl {
    Rosidl {
        modules: place.map(|place| place.join("usr/lib/python3/dist-packages")),
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

    /// The output of `packages.py` for the packages in `folders`.
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
