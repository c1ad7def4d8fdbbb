//! Programs of components in Python: `up --build` builds the extension module of the framework once
//! for a workspace, and writes a launcher for each component, which starts the interpreter. A
//! launcher holds the note of its component as an executable does, so nothing else has to know that
//! the component is in Python.

use crate::error::{Error, cannot, refused};
use crate::profile::Profile;
use crate::variant;
use crate::workspaces::Target;
use rc_codegen::cargo_workspace::Workspace;
use rc_codegen::files::GENERATED;
use rc_codegen::note::Note;
use rc_codegen::paths::normal;
use rc_codegen::{Project, generate, python};
use rc_vocabulary::{Middlewares, shell};
use std::ffi::OsString;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// The crate of the extension module, its folder in the framework, and its library.
pub(crate) const CRATE: &str = "rc-python";
const FOLDER: &str = "python";
pub(crate) const LIBRARY: &str = "librobocomp_python.so";

/// The crate of the extension module of components with a tree of InnerModel, and its library.
pub(crate) const TREE_CRATE: &str = "rc-python-innermodel";
pub(crate) const TREE_LIBRARY: &str = "librobocomp_innermodel.so";

/// The crate of the extension module of components with a world, and its library.
pub(crate) const GRAPH_CRATE: &str = "rc-python-graph";
pub(crate) const GRAPH_LIBRARY: &str = "librobocomp_graph.so";

/// The settings of the framework, which cargo finds in that folder alone. With others, it would compile the same
/// libraries in another way, in the place of those that running programs use.
const SETTINGS: &str = ".cargo/config.toml";

/// Parts of a component's folder that its variant shares.
const SHARED: [&str; 2] = ["etc", "src"];

/// Finds the prefix of an installed component, whose launcher is `PREFIX/components/NAME/bin/NAME`,
/// wherever that is.
const PREFIX_OF_SCRIPT: &str =
    "root=$(CDPATH= cd -- \"$(dirname -- \"$0\")/../../..\" && pwd -P) || exit 3\n";

/// The package of a component, which is also the name of its launcher.
pub(crate) fn package(project: &Project) -> String {
    python::names::package(&project.component.name.text)
}

/// Whether a component has a tree of InnerModel.
pub(crate) fn has_tree(project: &Project) -> bool {
    project.component.viewer.is_some()
}

/// The framework that a workspace names by a path, or that it is.
pub(crate) fn framework(root: &Path) -> Result<Option<PathBuf>, Error> {
    if root.join(FOLDER).join("Cargo.toml").exists() && root.join("runtime").exists() {
        return Ok(Some(root.to_path_buf()));
    }
    let workspace = Workspace::of(root).map_err(refused("read the workspace"))?;
    Ok(workspace.and_then(|workspace| workspace.framework()))
}

/// The arguments of cargo that build crates of the framework, the extension module among them, into
/// the target folder of the workspace `root`. `None` if the workspace does not name the framework by
/// a path: then `robocomp` is a package of the interpreter.
pub(crate) fn build(
    root: &Path,
    target: &Target,
    profile: Profile,
    crates: &[&str],
) -> Result<Option<Vec<OsString>>, Error> {
    let Some(framework) = framework(root)? else {
        return Ok(None);
    };
    let mut args: Vec<OsString> = ["build", "--profile", profile.word()]
        .map(Into::into)
        .to_vec();
    args.extend(["--config".into(), framework.join(SETTINGS).into()]);
    for name in crates {
        args.extend(["--package".into(), name.into()]);
    }
    args.extend([
        "--manifest-path".into(),
        framework.join("Cargo.toml").into(),
    ]);
    args.extend(["--target-dir".into(), target.folder.clone().into()]);
    Ok(Some(args))
}

/// A launcher that is not written yet.
#[derive(Debug)]
pub(crate) struct Launcher {
    path: PathBuf,
    text: String,
    /// The folder of a variant with the files of its package.
    staged: Option<(PathBuf, rc_codegen::Files, PathBuf)>,
    /// The virtual environment that the component asks for.
    venv: Option<Venv>,
}

/// `.venv` of a component with `python "3.12" venv;`.
#[derive(Debug)]
struct Venv {
    folder: PathBuf,
    oldest: (u32, u32),
    /// The folder of the lock between two builds.
    lock: PathBuf,
}

/// Where the parts of a component are that its launcher names. The paths are absolute.
pub(crate) struct Places {
    /// The folder of the component, with `.venv`.
    pub(crate) folder: PathBuf,
    /// The folder of its worker and its generated package, which for a variant is another one.
    pub(crate) home: PathBuf,
    /// The folder of the package `robocomp`, unless that is one of the interpreter.
    pub(crate) framework: Option<PathBuf>,
    /// The extension modules, each with the variable that names it.
    pub(crate) native: Vec<(&'static str, PathBuf)>,
}

impl Places {
    /// The places of a component of the workspace `root`.
    pub(crate) fn of(
        project: &Project,
        root: &Path,
        target: &Target,
        profile: Profile,
        variant: Option<Middlewares>,
    ) -> Result<Self, Error> {
        let absolute = |folder: &Path| rc_codegen::paths::absolute(folder);
        let folder = absolute(project.code()).map_err(cannot("find the folder of a component"))?;
        let home = variant.map_or_else(
            || folder.clone(),
            |middleware| {
                let variants = target.folder.join("rc").join(FOLDER);
                variants.join(middleware.to_string()).join(package(project))
            },
        );
        let framework = framework(root)?.map(|framework| absolute(&framework.join(FOLDER)));
        let framework = framework
            .transpose()
            .map_err(cannot("find the framework"))?;
        let mut native = vec![("ROBOCOMP_NATIVE", LIBRARY)];
        if has_tree(project) {
            native.push(("ROBOCOMP_INNERMODEL", TREE_LIBRARY));
        }
        if project.world.is_some() {
            native.push(("ROBOCOMP_GRAPH", GRAPH_LIBRARY));
        }
        native.retain(|_| framework.is_some());
        let built = target.programs(profile);
        let native = native.into_iter();
        Ok(Self {
            native: native
                .map(|(name, library)| (name, built.join(library)))
                .collect(),
            folder,
            home,
            framework,
        })
    }

    /// The places of an installed component: `robocomp` is a package of its interpreter.
    pub(crate) fn installed(project: &Project) -> Result<Self, Error> {
        let folder = rc_codegen::paths::absolute(project.folder());
        let folder = folder.map_err(cannot("find the folder of a component"))?;
        Ok(Self {
            home: folder.clone(),
            folder,
            framework: None,
            native: Vec::new(),
        })
    }

    /// The folders in which the interpreter looks for packages.
    fn paths(&self) -> Vec<PathBuf> {
        let generated = self.home.join(GENERATED);
        [generated]
            .into_iter()
            .chain(self.framework.clone())
            .collect()
    }
}

/// The launcher of a component of the workspace `root`, whose program is `path`.
pub(crate) fn of(
    project: &Project,
    root: &Path,
    target: &Target,
    profile: Profile,
    variant: Option<Middlewares>,
    path: PathBuf,
) -> Result<Launcher, Error> {
    let package = package(project);
    let places = Places::of(project, root, target, profile, variant)?;
    let mut staged = None;
    let middleware = match variant {
        None => {
            let note = Note::of_generated(&places.folder).ok().flatten();
            note.map_or_else(String::new, |note| note.middleware)
        }
        Some(middleware) => {
            let files = printed(project, middleware)?;
            staged = Some((places.home.clone(), files, places.folder.clone()));
            middleware.to_string()
        }
    };
    let note = Note {
        component: project.component.name.text.clone(),
        model: format!("{:016x}", project.hash),
        middleware,
    };
    let oldest = project.oldest_python();
    let asks = project.component.python.is_some_and(|python| python.venv);
    let lock = target
        .folder
        .join("rc")
        .join(FOLDER)
        .join("venv")
        .join(&package);
    Ok(Launcher {
        text: text(
            &package,
            &path,
            &places.folder,
            &places.paths(),
            &places.native,
            oldest,
            &note,
        )?,
        path,
        staged,
        venv: asks.then_some(Venv {
            folder: places.folder,
            oldest,
            lock,
        }),
    })
}

/// The launcher of a component that is installed into `folder`, a path below the prefix.
pub(crate) fn installed(project: &Project, folder: &Path, note: &Note) -> Result<String, Error> {
    let folder = Path::new("/").join(folder);
    let paths = [folder.join(GENERATED)];
    let oldest = project.oldest_python();
    let package = package(project);
    script(
        &package,
        PREFIX_OF_SCRIPT,
        &folder,
        &paths,
        &[],
        oldest,
        note,
    )
}

/// The files of a variant.
pub(crate) fn printed(
    project: &Project,
    middleware: Middlewares,
) -> Result<rc_codegen::Files, Error> {
    let printed = generate::component(project, middleware, "");
    let (files, found) = printed.map_err(|error| Error::Workspace(error.to_string()))?;
    let mut errors = found
        .iter()
        .filter(|d| d.severity == rc_diagnostics::Severity::Error);
    match errors.next() {
        Some(error) => Err(Error::Workspace(error.message.clone())),
        None => Ok(files),
    }
}

/// A path as a script and the environment of a process can name it.
fn named(path: &Path) -> Result<&str, Error> {
    path.to_str().ok_or_else(|| {
        let path = path.display();
        Error::Workspace(format!(
            "a component in Python cannot run in {path}: this path is not UTF-8"
        ))
    })
}

/// The text of a path in a list of paths, which colons separate.
fn listed(path: &Path) -> Result<&str, Error> {
    let name = named(path)?;
    if name.contains(':') {
        return Err(Error::Workspace(format!(
            "a component in Python cannot run in {name}: PYTHONPATH cannot hold a path with a colon"
        )));
    }
    Ok(name)
}

/// The script of a component in a workspace.
///
/// On another machine the script and all files that it names are copies, each below one folder at
/// its own path. So its own path, `place`, identifies that folder.
fn text(
    package: &str,
    place: &Path,
    folder: &Path,
    paths: &[PathBuf],
    native: &[(&str, PathBuf)],
    oldest: (u32, u32),
    note: &Note,
) -> Result<String, Error> {
    let place = shell::word(named(&normal(place))?);
    let root = format!(
        "case $0 in\n\
         *{place}) root=${{0%{place}}} ;;\n\
         *) root= ;;\n\
         esac\n"
    );
    script(package, &root, folder, paths, native, oldest, note)
}

/// The script, with the lines that set `root`, the folder in front of all paths. Its interpreter is
/// that of `.venv` in the component's folder, of the active virtual environment, or `python3`. A
/// foreign PYTHONPATH comes after the packages of an environment, which were chosen for the
/// component. An interpreter that does not start or cannot import the framework is a failed start,
/// in one line.
fn script(
    package: &str,
    root: &str,
    folder: &Path,
    paths: &[PathBuf],
    native: &[(&str, PathBuf)],
    (major, minor): (u32, u32),
    note: &Note,
) -> Result<String, Error> {
    let below = |path: &str| format!("\"$root\"{}", shell::word(path));
    let paths = paths.iter().map(|path| Ok(below(listed(path)?)));
    let paths = paths.collect::<Result<Vec<String>, Error>>()?.join(":");
    let native = native.iter().map(|(name, path)| {
        let path = below(named(path)?);
        Ok(format!("export {name}={path}\n"))
    });
    let native: String = native.collect::<Result<_, Error>>()?;
    let folder = below(named(folder)?);
    let needed = python::interpreter::needed_by_this((major, minor));
    Ok(format!(
        "#!/bin/sh\n\
         # Written by rcdeploy: runs the component `{package}`, which is in Python.\n\
         {root}\
         folder={folder}\n\
         before= behind=${{PYTHONPATH:-}}\n\
         if [ -x \"$folder/.venv/bin/python\" ]; then\n    \
         python=$folder/.venv/bin/python\n\
         elif [ -n \"${{VIRTUAL_ENV:-}}\" ] && [ -x \"$VIRTUAL_ENV/bin/python\" ]; then\n    \
         python=$VIRTUAL_ENV/bin/python\n\
         elif command -v python3 >/dev/null; then\n    \
         python=python3\n    \
         before=$behind\n    \
         behind=\n\
         else\n    \
         echo \"{package}: error: there is no python3 in the path; {needed}\" >&2\n    \
         exit 3\n\
         fi\n\
         if [ -n \"${{PYTHONHOME:-}}\" ] && ! \"$python\" -S -c \"\" 2>/dev/null; then\n    \
         echo \"{package}: error: PYTHONHOME is $PYTHONHOME, with which $python does not start; unset it\" >&2\n    \
         exit 3\n\
         fi\n\
         export PYTHONPATH={paths}\"${{before:+:$before}}\" ROBOCOMP_BEHIND=\"$behind\"\n\
         export PYTHONSAFEPATH=1 PYTHONUNBUFFERED=1 ROBOCOMP_LAUNCHER=\"$0\"\n\
         {native}\
         exec \"$python\" -c 'import os, sys\n\
         if sys.version_info < ({major}, {minor}):\n    \
         sys.stderr.write(\"{package}: error: %s is Python %d.%d; {needed}\\n\" % ((sys.executable,) + sys.version_info[:2]))\n    \
         sys.exit(3)\n\
         behind = os.environ.pop(\"ROBOCOMP_BEHIND\", \"\")\n\
         if behind:\n    \
         sys.path.extend(behind.split(os.pathsep))\n    \
         os.environ[\"PYTHONPATH\"] += os.pathsep + behind\n\
         try:\n    \
         import robocomp\n\
         except ImportError as error:\n    \
         sys.stderr.write(\"{package}: error: %s\\n\" % error)\n    \
         sys.exit(3)\n\
         import runpy\n\
         runpy.run_module(\"{package}\", run_name=\"__main__\", alter_sys=True)' \"$@\"\n\
         # {}\n",
        note.to_text()
    ))
}

impl Launcher {
    /// Writes it, the package of a variant, and the virtual environment that its component asks for,
    /// without packages.
    ///
    /// # Errors
    /// The system refuses a file.
    pub(crate) fn write(&self) -> Result<(), Error> {
        if let Some((place, files, folder)) = &self.staged {
            stage(place, files, folder)?;
        }
        if let Some(venv) = &self.venv {
            venv.make()?;
        }
        let action = format!("write {}", self.path.display());
        write(&self.path, &self.text).map_err(cannot(action))
    }
}

impl Venv {
    /// Waits for another `up` of the workspace, which may make the same one.
    fn make(&self) -> Result<(), Error> {
        let _held = variant::lock_folder(&self.lock, variant::PATIENCE)?;
        let made = python::environment::make_empty(&self.folder, self.oldest);
        made.map_err(|error| Error::Workspace(error.to_string()))
    }
}

fn write(path: &Path, text: &str) -> io::Result<()> {
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent)?;
    }
    // A process that starts it reads the old script to its end, or the new one.
    let new = path.with_extension(format!("{}.new", std::process::id()));
    std::fs::write(&new, text)?;
    std::fs::set_permissions(&new, std::fs::Permissions::from_mode(0o755))?;
    std::fs::rename(&new, path)
}

/// The package for another middleware, with links to the files of the user. Waits for another `up`
/// of the workspace, which may write the same one.
fn stage(place: &Path, files: &rc_codegen::Files, folder: &Path) -> Result<(), Error> {
    let _held = variant::lock_folder(place, variant::PATIENCE)?;
    renew(place, files, folder, &SHARED).map_err(cannot(format!("write {}", place.display())))
}

/// Writes the generated files of a variant, with links to the files that it shares with its
/// component.
pub(crate) fn renew(
    place: &Path,
    files: &rc_codegen::Files,
    folder: &Path,
    shared: &[&str],
) -> io::Result<()> {
    let mut generated = rc_codegen::Files::default();
    for (path, owner, text) in files.iter() {
        if path.starts_with(GENERATED) {
            generated.add(path, owner, text.to_owned());
        }
    }
    generated.write(place)?;
    for name in shared {
        let link = place.join(name);
        let there = folder.join(name);
        if std::fs::read_link(&link).is_ok_and(|target| target == there) {
            continue;
        }
        match std::fs::remove_file(&link) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => std::os::unix::fs::symlink(&there, &link)?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
