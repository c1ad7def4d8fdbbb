//! Programs of components in C++: `up --build` builds the library of the framework once for a
//! workspace, and each component by cmake. The build folder is `build` in the folder of the
//! component, where editors find `compile_commands.json`; that of a variant, or with a sanitizer, is in
//! the target folder.

use crate::error::{Error, cannot};
use crate::launcher;
use crate::profile::Profile;
use crate::programs::Built;
use crate::sanitizer::Sanitizer;
use crate::variant;
use crate::workspaces::Target;
use rc_codegen::names;
use std::ffi::OsString;
use std::io::{self, ErrorKind};
use std::os::unix::ffi::OsStrExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The crate of the library, its folder in the framework, and its file.
pub(crate) const CRATE: &str = "rc-cpp";
const FOLDER: &str = "cpp";
pub(crate) const LIBRARY: &str = "librobocomp_cpp.so";

/// Parts of a component's folder that its variant shares.
const SHARED: [&str; 3] = ["CMakeLists.txt", "etc", "src"];

/// The variable that names the toolchain file of the user.
const TOOLCHAIN: &str = "CMAKE_TOOLCHAIN_FILE";

const NEEDED: &str = "a component in C++ needs cmake 3.16 and a compiler of C++17 (g++ 8, clang++ 7) or later; \
                      on Debian and Ubuntu: `apt install cmake g++`";

/// A build by cmake that has not run yet.
#[derive(Debug)]
pub(crate) struct Program {
    component: String,
    /// The folder of its `CMakeLists.txt`.
    folder: PathBuf,
    /// The folder of the build.
    build: PathBuf,
    arguments: Vec<OsString>,
    /// The toolchain file, if the user names one.
    toolchain: Option<PathBuf>,
    /// The folder of a variant with its generated files, and the component's own folder.
    staged: Option<(PathBuf, rc_codegen::Files, PathBuf)>,
    /// The folder of the lock between two builds.
    lock: PathBuf,
}

/// Refuses to build where cmake or a compiler is missing.
///
/// # Errors
/// A program or the toolchain file is missing, or a program is too old; the error says what is needed.
pub(crate) fn check() -> Result<(), Error> {
    let missing = |what: &str| Err(Error::Workspace(format!("{what}; {NEEDED}")));
    match Command::new("cmake").arg("--version").output() {
        Ok(output) if output.status.success() => {}
        Ok(_) => return missing("`cmake --version` fails"),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            return missing("there is no cmake in the path");
        }
        Err(error) => return missing(&format!("cmake cannot be started: {error}")),
    }
    // These name a compiler themselves, and cmake says what is wrong with it.
    if toolchain()?.is_some() || std::env::var_os("CXX").is_some() {
        return Ok(());
    }
    let path = std::env::var_os("PATH").unwrap_or_default();
    let is_there =
        |name: &str| std::env::split_paths(&path).any(|folder| folder.join(name).is_file());
    if ["c++", "g++", "clang++"].into_iter().any(is_there) {
        return Ok(());
    }
    missing("there is no compiler of C++ in the path")
}

/// The toolchain file of the user. cmake before 3.21 does not read the variable.
fn toolchain() -> Result<Option<PathBuf>, Error> {
    let Some(file) = std::env::var_os(TOOLCHAIN).filter(|set| !set.is_empty()) else {
        return Ok(None);
    };
    let path = std::fs::canonicalize(&file);
    path.map(Some).map_err(|error| {
        let file = Path::new(&file).display();
        Error::Workspace(format!("{TOOLCHAIN} names {file}: {error}"))
    })
}

/// Refuses a folder whose path would be several arguments, or several lines of a makefile.
fn check_path(folder: &Path) -> Result<(), Error> {
    if !folder
        .as_os_str()
        .as_bytes()
        .iter()
        .any(|byte| matches!(byte, b';' | b'\n' | b'\r'))
    {
        return Ok(());
    }
    let shown = folder.to_string_lossy();
    Err(Error::Workspace(format!(
        "cmake cannot build in a folder whose path has a `;` or a line feed: {shown:?}"
    )))
}

/// The build of a component of the workspace `root`, whose program is `path`.
pub(crate) fn of(
    built: &Built<'_>,
    root: &Path,
    target: &Target,
    profile: Profile,
    path: &Path,
) -> Result<Program, Error> {
    let project = built.project;
    let absolute = |path: &Path| rc_codegen::paths::absolute(path);
    let name = &project.component.name.text;
    let Some(framework) = launcher::framework(root)? else {
        return Err(Error::Workspace(format!(
            "`{name}` is in C++: the workspace {} has to name the framework by a path, whose library it builds",
            root.display()
        )));
    };
    let own = absolute(project.code()).map_err(cannot("find the folder of a component"))?;
    let folders = absolute(&target.folder).map_err(cannot("find the target folder"))?;
    let folders = folders.join("rc").join(FOLDER);
    let package = names::package(name);
    for path in [&own, &folders] {
        check_path(path)?;
    }
    let (mut folder, mut staged) = (own.clone(), None);
    if let Some(middleware) = built.variant {
        // One folder for all: only their descriptions differ, so each compiles little after the first.
        folder = folders.join("variants").join(&package);
        staged = Some((folder.clone(), launcher::printed(project, middleware)?, own));
    }
    let build = match built.sanitizer {
        None => folder.join("build"),
        Some(sanitizer) => {
            let name = if staged.is_some() { "variants" } else { "own" };
            folders.join(sanitizer.word()).join(name).join(&package)
        }
    };
    let framework = absolute(&framework).map_err(cannot("find the framework"))?;
    let programs = absolute(&target.programs(profile));
    let programs = programs.map_err(cannot("find the target folder"))?;
    let kind = match profile {
        Profile::Dev => "Debug",
        Profile::Release => "RelWithDebInfo",
    };
    let set = |name: &str, value: &Path| {
        let mut option = OsString::from(format!("-D{name}="));
        option.push(value);
        option
    };
    let mut arguments = vec![
        set("CMAKE_BUILD_TYPE", Path::new(kind)),
        set("CMAKE_EXPORT_COMPILE_COMMANDS", Path::new("ON")),
        set("robocomp_DIR", &framework.join(FOLDER).join("cmake")),
        set("ROBOCOMP_LIBRARY", &programs.join(LIBRARY)),
        set("ROBOCOMP_PROGRAMS", &programs),
        set(
            "ROBOCOMP_PROGRAM",
            Path::new(path.file_name().unwrap_or_default()),
        ),
        set(
            "ROBOCOMP_SANITIZER",
            Path::new(built.sanitizer.map_or("", Sanitizer::word)),
        ),
    ];
    let toolchain = toolchain()?;
    arguments.extend(toolchain.iter().map(|file| set(TOOLCHAIN, file)));
    Ok(Program {
        component: name.clone(),
        build,
        folder,
        arguments,
        toolchain,
        staged,
        lock: folders.join("lock").join(&package),
    })
}

impl Program {
    /// Writes the files of a variant, and runs cmake. Waits for another `up` of the workspace that
    /// builds the same component.
    ///
    /// # Errors
    /// cmake fails, after it has printed why.
    pub(crate) fn build(&self) -> Result<(), Error> {
        let _held = variant::lock_folder(&self.lock, variant::PATIENCE)?;
        if let Some((place, files, folder)) = &self.staged {
            launcher::renew(place, files, folder, &SHARED)
                .map_err(cannot(format!("write {}", place.display())))?;
        }
        if let Some(toolchain) = &self.toolchain {
            forget_other_toolchain(&self.build, toolchain)
                .map_err(cannot(format!("clear {}", self.build.display())))?;
        }
        let mut configure = Command::new("cmake");
        configure
            .args(["--log-level=WARNING", "-S"])
            .arg(&self.folder);
        configure.arg("-B").arg(&self.build).args(&self.arguments);
        self.run(configure)?;
        let jobs = std::thread::available_parallelism().map_or(1, usize::from);
        let mut build = Command::new("cmake");
        build.arg("--build").arg(&self.build);
        build.args(["--parallel", &jobs.to_string()]);
        self.run(build)
    }

    fn run(&self, mut command: Command) -> Result<(), Error> {
        // It asks nothing.
        let status = command.stdin(Stdio::null()).status();
        let status = status.map_err(cannot("start cmake".to_owned()))?;
        if status.success() {
            return Ok(());
        }
        Err(Error::Workspace(format!(
            "cmake could not build {}",
            self.component
        )))
    }
}

/// Clears a build folder of another toolchain file: cmake keeps the compiler of its first run.
fn forget_other_toolchain(build: &Path, wanted: &Path) -> io::Result<()> {
    let cache = build.join("CMakeCache.txt");
    let text = match std::fs::read(&cache) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        read => read?,
    };
    let entry = [TOOLCHAIN.as_bytes(), b":"].concat();
    let mut lines = text.split(|byte| *byte == b'\n');
    let own = lines.find(|line| line.starts_with(&entry));
    let own = own.and_then(|line| line.splitn(2, |byte| *byte == b'=').nth(1));
    if own == Some(wanted.as_os_str().as_bytes()) {
        return Ok(());
    }
    // The cache at last: it tells the next run that a clearing was interrupted.
    match std::fs::remove_dir_all(build.join("CMakeFiles")) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => std::fs::remove_file(cache),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_cmake_would_split_is_refused() {
        for good in ["/robot/a component", "/robot/gé $HOME"] {
            assert!(check_path(Path::new(good)).is_ok(), "{good}");
        }
        for bad in ["/robot/a;b", "/robot/a\nb", "/robot/a\rb"] {
            let refused = check_path(Path::new(bad)).expect_err("a refusal");
            let said = refused.to_string();
            assert!(said.contains(&format!("{bad:?}")), "{said}");
        }
    }

    #[test]
    fn a_build_folder_of_another_toolchain_file_is_cleared() {
        let folder = tempfile::tempdir().expect("a folder");
        let build = folder.path();
        let (cache, files) = (build.join("CMakeCache.txt"), build.join("CMakeFiles"));
        let wanted = Path::new("/tools/a=b.cmake");
        let is_kept = |text: &str| {
            std::fs::create_dir_all(&files).expect("a folder");
            std::fs::write(&cache, text).expect("a file");
            forget_other_toolchain(build, wanted).expect("to look");
            assert_eq!(cache.exists(), files.exists());
            cache.exists()
        };
        let of =
            |file: &str| format!("A:STRING=1\nCMAKE_TOOLCHAIN_FILE:FILEPATH={file}\nB:BOOL=ON\n");
        assert!(is_kept(&of("/tools/a=b.cmake")));
        assert!(!is_kept(&of("/tools/a")));
        assert!(!is_kept("A:STRING=1\n"));
        // There is nothing yet.
        forget_other_toolchain(build, wanted).expect("to look");
    }
}
