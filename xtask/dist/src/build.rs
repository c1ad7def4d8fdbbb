//! The build that packages are made of.

use crate::selection::{Component, LIBRARY, Language, Selection};
use crate::tree;
use rc_vocabulary::shell;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A profile of cargo.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Profile {
    Release,
    Dev,
}

impl Profile {
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Release => "release",
            Self::Dev => "dev",
        }
    }
}

/// Where the sources are in programs of packages, whatever the folder of the build.
const SOURCES: &str = "/usr/src/robocomp";
const CRATES: &str = "/usr/src/crates";
/// Where generated sources are: the target folder may be outside of the folder of the project.
const GENERATED: &str = "/usr/src/robocomp/target";

/// The build.
pub(crate) struct Build {
    /// The folder of this project.
    pub(crate) root: PathBuf,
    pub(crate) profile: Profile,
    /// The target folder.
    pub(crate) target: PathBuf,
    /// The version of all packages.
    pub(crate) version: String,
    /// The time of the last commit, in seconds since 1970.
    pub(crate) time: u64,
}

impl Build {
    pub(crate) fn new(profile: Profile, built: bool) -> Result<Self, String> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let root = root.canonicalize().map_err(|error| error.to_string())?;
        let set = std::env::var("SOURCE_DATE_EPOCH").ok();
        let time = match set {
            Some(set) => set,
            None => output(
                Command::new("git")
                    .args(["log", "-1", "--format=%ct"])
                    .current_dir(&root),
            )?,
        };
        let time = time.trim().parse();
        let time = time.map_err(|_| "SOURCE_DATE_EPOCH is not a number of seconds".to_owned())?;
        // This program lies in TARGET/debug. Programs with other paths of sources have a target
        // folder of their own, so that they are not built again and again.
        let own = std::env::current_exe().map_err(|error| error.to_string())?;
        let own = own.ancestors().nth(2).ok_or("there is no target folder")?;
        let target = match profile {
            Profile::Release if !built => own.join("packages"),
            _ => own.to_path_buf(),
        };
        Ok(Self {
            root,
            profile,
            target,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            time,
        })
    }

    /// The same build of a copy of the sources, with a target folder of its own.
    pub(crate) fn of(&self, root: &Path) -> Self {
        Self {
            root: root.to_path_buf(),
            profile: self.profile,
            target: root.join("target/packages"),
            version: self.version.clone(),
            time: self.time,
        }
    }

    /// The name and the address of whoever is responsible for the packages, by the variables of
    /// Debian's tools, else by the last commit.
    pub(crate) fn maintainer(&self) -> Result<String, String> {
        let variable = |name| std::env::var(name).ok().filter(|text| !text.is_empty());
        if let (Some(name), Some(mail)) = (variable("DEBFULLNAME"), variable("DEBEMAIL")) {
            return Ok(format!("{name} <{mail}>"));
        }
        let mut author = Command::new("git");
        author
            .args(["log", "-1", "--format=%an <%ae>"])
            .current_dir(&self.root);
        Ok(output(&mut author)?.trim().to_owned())
    }

    /// The folder of programs and libraries.
    pub(crate) fn programs(&self) -> PathBuf {
        self.target.join(match self.profile {
            Profile::Release => "release",
            Profile::Dev => "debug",
        })
    }

    /// Builds the programs and the extension modules of the selected packages.
    pub(crate) fn run(&self, selected: &Selection) -> Result<(), String> {
        if !selected.has_programs() {
            return Ok(());
        }
        if self.profile == Profile::Release {
            let wrapper = self.wrapper();
            tree::write(&wrapper, wrapper_script(&self.root)?.as_bytes())?;
            tree::set_mode(&wrapper, true)?;
        }
        let mut programs: Vec<String> =
            selected.tools.iter().map(|&tool| tool.to_owned()).collect();
        programs.extend(selected.of(Language::Rust).map(|one| one.name.clone()));
        // Describes components.
        programs.push("rcgen".to_owned());
        if selected.wheel {
            programs.extend(["rcdeploy", "rcforward"].map(str::to_owned));
        }
        programs.sort();
        programs.dedup();
        let mut cargo = self.cargo("--workspace");
        for program in &programs {
            cargo.args(["--bin", program]);
        }
        run(&mut cargo)?;
        if selected.wheel || selected.python {
            let mut cargo = self.cargo("--lib");
            for (name, ..) in crate::wheel::MODULES {
                cargo.args(["--package", name]);
            }
            run(&mut cargo)?;
        }
        if selected.has_cpp() {
            run(self.cargo("--lib").args(["--package", LIBRARY.1]))?;
        }
        for component in selected.of(Language::Cpp) {
            self.run_cmake(component)?;
        }
        Ok(())
    }

    /// Builds the program of a component in C++, which finds the library where both are installed.
    fn run_cmake(&self, component: &Component) -> Result<(), String> {
        let build = self.target.join("cmake").join(&component.name);
        let kind = match self.profile {
            Profile::Release => "RelWithDebInfo",
            Profile::Dev => "Debug",
        };
        let mut configure = Command::new("cmake");
        configure
            .args(["--log-level=WARNING", "-S"])
            .arg(component.folder(self))
            .arg("-B")
            .arg(&build)
            .arg(format!("-DCMAKE_BUILD_TYPE={kind}"))
            .arg("-DCMAKE_BUILD_WITH_INSTALL_RPATH=ON");
        for (name, place) in [
            ("robocomp_DIR", self.root.join("cpp/cmake")),
            ("ROBOCOMP_LIBRARY", self.programs().join(LIBRARY.2)),
            ("ROBOCOMP_PROGRAMS", self.programs()),
            ("ROBOCOMP_FOLDER", component.place()),
        ] {
            configure.arg(format!("-D{name}={}", place.display()));
        }
        if self.profile == Profile::Release {
            self.without_paths(&mut configure);
        }
        run(&mut configure)?;
        let mut make = Command::new("cmake");
        let jobs = std::env::var("CARGO_BUILD_JOBS").ok();
        let jobs = jobs.unwrap_or_else(|| {
            std::thread::available_parallelism()
                .map_or(1, usize::from)
                .to_string()
        });
        make.arg("--build").arg(&build).args(["--parallel", &jobs]);
        run(&mut make)
    }

    /// Sources have the same paths in all programs of C and C++, whatever the folder of the build.
    fn without_paths(&self, command: &mut Command) {
        let flags = self.folders().map(|(from, to)| {
            let from = from.display();
            format!("-ffile-prefix-map={from}={to}")
        });
        let flags = flags.join(" ");
        command
            .env("CFLAGS", &flags)
            .env("CXXFLAGS", &flags)
            .env("SOURCE_DATE_EPOCH", self.time.to_string());
    }

    /// The folders of sources, with their names in programs.
    fn folders(&self) -> [(PathBuf, &'static str); 3] {
        let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
        let home = home
            .or_else(|| Some(PathBuf::from(std::env::var_os("HOME")?).join(".cargo")))
            .unwrap_or_default();
        [
            (home.join("registry/src"), CRATES),
            (self.root.clone(), SOURCES),
            // Below the one above, most often: the last one that fits counts.
            (self.target.clone(), GENERATED),
        ]
    }

    /// The program that starts the compiler.
    fn wrapper(&self) -> PathBuf {
        self.target.join("rustc")
    }

    fn cargo(&self, selects: &str) -> Command {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut cargo = Command::new(cargo);
        cargo.args([
            "build",
            "--locked",
            "--profile",
            self.profile.word(),
            selects,
        ]);
        cargo.current_dir(&self.root);
        if self.profile == Profile::Dev {
            return cargo;
        }
        let rust = self.folders().map(|(from, to)| {
            let from = from.display();
            format!("--remap-path-prefix={from}={to}")
        });
        self.without_paths(&mut cargo);
        cargo
            .args(["--target-dir".as_ref(), self.target.as_os_str()])
            .env("CARGO_ENCODED_RUSTFLAGS", rust.join("\u{1f}"))
            .env("ROBOCOMP_PACKAGED", "1")
            .env("RUSTC_WRAPPER", self.wrapper());
        cargo
    }
}

/// A script that starts the compiler. A program in Rust names the folder of its component, which no flag of
/// the compiler changes; an installed one finds its own.
fn wrapper_script(root: &Path) -> Result<String, String> {
    let root = root
        .to_str()
        .ok_or("the folder of the project is not UTF-8")?;
    let root = shell::word(root);
    Ok(format!(
        "#!/bin/sh\nroot={root}\ncase \"$CARGO_MANIFEST_DIR\" in\n\"$root\"/*/generated)\n    \
         export CARGO_MANIFEST_DIR=\"{SOURCES}${{CARGO_MANIFEST_DIR#\"$root\"}}\" ;;\nesac\nexec \"$@\"\n"
    ))
}

/// Runs a command that prints for itself.
pub(crate) fn run(command: &mut Command) -> Result<(), String> {
    let status = command.status();
    let status = status.map_err(|error| format!("{}: {error}", name(command)))?;
    if status.success() {
        Ok(())
    } else {
        Err(format!("{command:?} failed"))
    }
}

/// Runs a command, and returns its output.
pub(crate) fn output(command: &mut Command) -> Result<String, String> {
    let output = command.output();
    let output = output.map_err(|error| format!("{}: {error}", name(command)))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{command:?} failed: {}", said.trim()));
    }
    String::from_utf8(output.stdout).map_err(|error| format!("{}: {error}", name(command)))
}

fn name(command: &Command) -> String {
    command.get_program().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_of_a_component_is_that_of_the_sources_in_each_build() {
        let folder = |root: &str, package: &str| {
            let script = wrapper_script(Path::new(root)).expect("a path in UTF-8");
            let mut shell = Command::new("sh");
            shell.args(["-c", &script, "sh", "printenv", "CARGO_MANIFEST_DIR"]);
            shell.env("CARGO_MANIFEST_DIR", format!("{root}/{package}"));
            output(&mut shell).expect("a folder")
        };
        for root in ["/home/me/robocomp", "/tmp/a robot's * (2)"] {
            let generated = folder(root, "components/avoider/generated");
            assert_eq!(
                generated,
                "/usr/src/robocomp/components/avoider/generated\n"
            );
            let other = folder(root, "components/avoider");
            assert_eq!(other, format!("{root}/components/avoider\n"));
        }
    }
}
