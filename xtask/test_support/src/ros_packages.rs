//! Packages of interfaces that tests build for the wheels of ROS 2.

use crate::{cmake, python};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The wheels of ROS 2 with those that build packages for it, and cmake.
pub struct RosPackages {
    /// The interpreters of both environments.
    ros: &'static Path,
    tools: &'static Path,
    /// The folder of cmake; empty where it is in the path.
    cmake: PathBuf,
}

impl RosPackages {
    /// `None` without one of them: `test` is listed as skipped.
    pub fn new(test: &str) -> Option<Self> {
        let cmake = cmake::folder(test)?;
        let (ros, tools) = (python::ros(test)?, python::ros_build(test)?);
        Some(Self { ros, tools, cmake })
    }

    /// Builds and installs a package, as colcon does.
    pub fn build(&self, package: &Path, place: &Path) {
        self.adapt();
        let (python, installed) = (self.tools.display(), place.display());
        let mut command = self.command("cmake", None);
        command.arg("-S").arg(package).arg("-B").arg(place);
        command.arg("-DBUILD_TESTING=OFF");
        command.arg(format!("-DPython3_EXECUTABLE={python}"));
        command.arg(format!("-DCMAKE_INSTALL_PREFIX={installed}/ros"));
        output(&mut command);
        let mut command = self.command("cmake", None);
        command.arg("--build").arg(place).arg("-j2");
        output(command.args(["--target", "install"]));
    }

    /// Lets the wheels name the folders of Python here, in the place of those of the machine that made
    /// them.
    fn adapt(&self) {
        const THERE: &str = "/opt/python/cp312-cp312";
        let include = "import sysconfig; print(sysconfig.get_path('include'), end='')";
        let include = output(Command::new(self.ros).args(["-c", include]));
        let here = environment(self.ros).display().to_string();
        for package in entries(&environment(self.ros).join("share")) {
            for file in entries(&package.join("cmake")) {
                let Ok(text) = std::fs::read_to_string(&file) else {
                    continue;
                };
                let adapted = text
                    .replace(&format!("{THERE}/include/python3.12"), &include)
                    .replace(THERE, &here);
                if adapted != text {
                    // Other tests read it meanwhile.
                    let own = file.with_extension(format!("{}.new", std::process::id()));
                    std::fs::write(&own, adapted).expect("to write");
                    std::fs::rename(own, &file).expect("to write");
                }
            }
        }
    }

    /// An interpreter that has the package which was built there.
    pub fn python(&self, place: &Path) -> Command {
        let ros = self.ros.display().to_string();
        self.command(&ros, Some(&place.join("ros")))
    }

    /// A program with the environments of both, and with an installed package.
    fn command(&self, program: &str, package: Option<&Path>) -> Command {
        let prefixes = [self.ros, self.tools].map(environment);
        let prefixes: Vec<&Path> = package.into_iter().chain(prefixes).collect();
        let modules = |prefix: &&Path| prefix.join("lib/python3.12/site-packages");
        let joined = |paths: Vec<PathBuf>| std::env::join_paths(paths).expect("paths");
        let folders = [self.cmake.clone()]
            .into_iter()
            .filter(|folder| folder.is_absolute());
        let path = std::env::var_os("PATH").unwrap_or_default();
        let mut command = Command::new(program);
        command
            .env(
                "PATH",
                joined(folders.chain(std::env::split_paths(&path)).collect()),
            )
            .env("PYTHONPATH", joined(prefixes.iter().map(modules).collect()))
            .env(
                "AMENT_PREFIX_PATH",
                joined(prefixes.iter().map(PathBuf::from).collect()),
            )
            .env(
                "CMAKE_PREFIX_PATH",
                joined(prefixes.iter().map(PathBuf::from).collect()),
            )
            .env(
                "LD_LIBRARY_PATH",
                joined(prefixes.iter().map(|one| one.join("lib")).collect()),
            );
        command
    }
}

/// The folder of an environment of Python.
fn environment(python: &Path) -> &Path {
    python.ancestors().nth(2).expect("its folder")
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).collect()
}

/// What a program prints that succeeds.
fn output(command: &mut Command) -> String {
    let output = command.stdin(Stdio::null()).output().expect("to run");
    assert!(output.status.success(), "{command:?}: {output:?}");
    String::from_utf8(output.stdout).expect("text")
}
