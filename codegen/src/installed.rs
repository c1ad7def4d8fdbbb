//! Components that are installed beside workspaces: each has a folder with its description, its
//! configuration and its program, below one prefix.
//!
//! ```text
//! PREFIX/bin                            the tools
//! PREFIX/interfaces                     interfaces, for all workspaces of the machine
//! PREFIX/components/NAME/NAME.cdsl      the description, with the files that it names
//! PREFIX/components/NAME/etc            the configuration
//! PREFIX/components/NAME/bin/NAME       the program
//! PREFIX/components/networks            networks of installed components
//! PREFIX/lib                            the library of components in C++
//! PREFIX/wheels                         the framework for environments of Python
//! ```

use crate::cargo_workspace::Workspace;
use crate::paths::normal;
use crate::{Project, names, python};
use rc_vocabulary::Builder;
use std::path::{Path, PathBuf};

/// The prefix of packages.
pub const PREFIX: &str = "/opt/robocomp";
/// The variable that names another prefix.
pub const VARIABLE: &str = "ROBOCOMP_PREFIX";
/// The folder of components, and that of a workspace.
pub const COMPONENTS: &str = "components";
/// The folder of interfaces.
pub const INTERFACES: &str = "interfaces";
/// The folder of networks, among the components.
const NETWORKS: &str = "networks";
/// The folder of wheels.
const WHEELS: &str = "wheels";
/// The folder of the library of components in C++. Their programs name it relative to their own
/// folder (`cpp/cmake/robocompConfig.cmake`).
pub const LIBRARIES: &str = "lib";
/// The folder of programs, of the prefix and of each component.
pub const PROGRAMS: &str = "bin";

/// Where components are installed: `ROBOCOMP_PREFIX`, else the prefix of this program, else
/// `/opt/robocomp`.
pub fn prefix() -> PathBuf {
    let set = std::env::var_os(VARIABLE).filter(|set| !set.is_empty());
    set.map(PathBuf::from)
        .or_else(own_prefix)
        .unwrap_or_else(|| PREFIX.into())
}

/// The prefix that this program lies in: `PREFIX/bin/rcdeploy`, or for a wheel `bin/rcdeploy` and
/// `share/robocomp` in one environment.
fn own_prefix() -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?;
    let folder = program.parent().filter(|bin| bin.ends_with(PROGRAMS))?;
    let around = folder.parent()?;
    let places = [around.to_path_buf(), around.join("share/robocomp")];
    places
        .into_iter()
        .find(|place| place.join(COMPONENTS).is_dir())
}

/// The program of a component that is installed: its folder has a program and no manifest.
pub fn program(project: &Project) -> Option<PathBuf> {
    let folder = project.folder();
    let program = folder.join(PROGRAMS).join(program_name(project));
    (!folder.join(project.manifest()).exists() && program.is_file()).then_some(program)
}

/// The name of a component's program.
pub fn program_name(project: &Project) -> String {
    let name = &project.component.name.text;
    if project.builder() == Builder::Interpreter {
        python::names::package(name)
    } else {
        names::package(name)
    }
}

/// The path of the component that a network in `folder` names. If it leads to no file, the
/// component of this name: that of the workspace, else the installed one.
pub fn named_component(folder: &Path, named: &str) -> PathBuf {
    let path = normal(&folder.join(named));
    if path.exists() {
        return path;
    }
    let elsewhere = || {
        let workspace = Workspace::of(folder).ok().flatten();
        let roots = workspace.map(|workspace| workspace.root().to_path_buf());
        let place = Path::new(COMPONENTS).join(path.file_stem()?);
        let file = place.join(path.file_name()?);
        let mut all = roots.into_iter().chain([prefix()]);
        all.find_map(|root| Some(root.join(&file)).filter(|path| path.is_file()))
    };
    elsewhere().unwrap_or(path)
}

/// The wheel of the framework that fits this program: an installed one, or one that the folder of
/// the framework has.
pub fn wheel(framework: Option<&Path>) -> Option<PathBuf> {
    let begin = concat!("robocomp-", env!("CARGO_PKG_VERSION"), "-");
    let built = framework.map(|framework| framework.join("target/dist"));
    let mut folders = built.into_iter().chain([prefix().join(WHEELS)]);
    folders.find_map(|folder| {
        let files = folder.read_dir().into_iter().flatten().flatten();
        let mut files = files.map(|file| file.path());
        files.find(|file| {
            let name = file.file_name().and_then(|name| name.to_str());
            let is_ours = name.is_some_and(|name| name.starts_with(begin));
            is_ours && file.extension().is_some_and(|ending| ending == "whl")
        })
    })
}

/// The installed network of a name, or of the file name of a path.
pub fn network(wanted: &Path) -> Option<PathBuf> {
    let file = Path::new(wanted.file_name()?).with_extension("ddsl");
    let place = prefix().join(COMPONENTS).join(NETWORKS);
    Some(place.join(file)).filter(|path| path.is_file())
}
