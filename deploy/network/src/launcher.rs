//! Programs of components in Python: `up --build` builds the extension module of the framework once
//! for a workspace, and writes a launcher for each component, which starts the interpreter. A
//! launcher holds the note of its component as an executable does, so nothing else has to know that
//! the component is in Python.

use crate::error::{Error, cannot, refused};
use crate::model::Profile;
use rc_cdsl::model::Backend;
use rc_codegen::cargo_workspace::Workspace;
use rc_codegen::files::GENERATED;
use rc_codegen::note::Note;
use rc_codegen::{Project, generate, python};
use std::ffi::OsString;
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// The crate of the extension module, its folder in the framework, and its library.
const CRATE: &str = "rc-python";
const FOLDER: &str = "python";
const LIBRARY: &str = "librobocomp_python.so";

/// What is not the variant's own, of a component's folder.
const SHARED: [&str; 2] = ["etc", "src"];

/// The package of a component, which is also the name of its launcher.
pub(crate) fn package(project: &Project) -> String {
    python::names::package(&project.component.name.text)
}

/// The framework that a workspace names by a path, or that it is.
fn framework(root: &Path) -> Result<Option<PathBuf>, Error> {
    if root.join(FOLDER).join("Cargo.toml").exists() && root.join("runtime").exists() {
        return Ok(Some(root.to_path_buf()));
    }
    let workspace = Workspace::of(root).map_err(refused("read the workspace"))?;
    Ok(workspace.and_then(|workspace| workspace.framework()))
}

/// The arguments of cargo that build the extension module into the target folder of the workspace
/// `root`. `None` if the workspace does not name the framework by a path: then `robocomp` is a
/// package of the interpreter.
pub(crate) fn build(
    root: &Path,
    target: &Path,
    profile: Profile,
) -> Result<Option<Vec<OsString>>, Error> {
    let Some(framework) = framework(root)? else {
        return Ok(None);
    };
    let mut args: Vec<OsString> = ["build", "--profile", profile.word(), "--package", CRATE]
        .map(Into::into)
        .to_vec();
    args.extend([
        "--manifest-path".into(),
        framework.join("Cargo.toml").into(),
    ]);
    args.extend(["--target-dir".into(), target.into()]);
    Ok(Some(args))
}

/// A launcher that is not written yet.
#[derive(Debug)]
pub(crate) struct Launcher {
    path: PathBuf,
    text: String,
    /// The folder of a variant with the files of its package.
    staged: Option<(PathBuf, rc_codegen::Files, PathBuf)>,
}

/// The launcher of a component of the workspace `root`, whose program is `path`.
pub(crate) fn of(
    project: &Project,
    root: &Path,
    target: &Path,
    profile: Profile,
    variant: Option<Backend>,
    path: PathBuf,
) -> Result<Launcher, Error> {
    let package = package(project);
    let absolute = |folder: &Path| rc_codegen::paths::absolute(folder);
    let folder = absolute(project.code()).map_err(cannot("find the folder of a component"))?;
    let mut staged = None;
    let (home, middleware) = match variant {
        None => {
            let note = Note::of_generated(&folder).ok().flatten();
            let word = note.map_or_else(String::new, |note| note.middleware);
            (folder.clone(), word)
        }
        Some(middleware) => {
            let place = target
                .join("rc")
                .join(FOLDER)
                .join(middleware.word())
                .join(&package);
            let printed = generate::component(project, middleware, "");
            let (files, found) = printed.map_err(|error| Error::Workspace(error.to_string()))?;
            if let Some(error) = found
                .iter()
                .find(|d| d.severity == rc_diagnostics::Severity::Error)
            {
                return Err(Error::Workspace(error.message.clone()));
            }
            staged = Some((place.clone(), files, folder.clone()));
            (place, middleware.word().to_owned())
        }
    };
    let note = Note {
        component: project.component.name.text.clone(),
        model: format!("{:016x}", project.hash),
        middleware,
    };
    let mut paths = vec![home.join(GENERATED)];
    let mut native = None;
    if let Some(framework) = framework(root)? {
        let framework = absolute(&framework).map_err(cannot("find the framework"))?;
        paths.push(framework.join(FOLDER));
        native = Some(target.join(profile.folder()).join(LIBRARY));
    }
    Ok(Launcher {
        text: text(&package, &folder, &paths, native.as_deref(), &note),
        path,
        staged,
    })
}

/// The script. Its interpreter is that of the active virtual environment, of `.venv` in the
/// component's folder, or `python3`.
fn text(
    package: &str,
    folder: &Path,
    paths: &[PathBuf],
    native: Option<&Path>,
    note: &Note,
) -> String {
    let paths: Vec<String> = paths
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    let native = native.map_or(String::new(), |native| {
        let native = quoted(&native.display().to_string());
        format!("export ROBOCOMP_NATIVE={native}\n")
    });
    let (folder, paths) = (
        quoted(&folder.display().to_string()),
        quoted(&paths.join(":")),
    );
    let needed = python::interpreter::needed();
    format!(
        "#!/bin/sh\n\
         # Written by rcdeploy: runs the component `{package}`, which is in Python.\n\
         folder={folder}\n\
         if [ -n \"${{VIRTUAL_ENV:-}}\" ] && [ -x \"$VIRTUAL_ENV/bin/python\" ]; then\n    \
         python=$VIRTUAL_ENV/bin/python\n\
         elif [ -x \"$folder/.venv/bin/python\" ]; then\n    \
         python=$folder/.venv/bin/python\n\
         elif command -v python3 >/dev/null; then\n    \
         python=python3\n\
         else\n    \
         echo \"{package}: error: there is no python3 in the path; {needed}\" >&2\n    \
         exit 3\n\
         fi\n\
         export PYTHONPATH={paths}\"${{PYTHONPATH:+:$PYTHONPATH}}\"\n\
         export PYTHONSAFEPATH=1 PYTHONUNBUFFERED=1\n\
         {native}\
         exec \"$python\" -m {package} \"$@\"\n\
         # {}\n",
        note.to_text()
    )
}

/// A text in single quotes of a shell.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}

impl Launcher {
    /// Writes it, and the package of a variant.
    ///
    /// # Errors
    /// The system refuses a file.
    pub(crate) fn write(&self) -> Result<(), Error> {
        let action = || format!("write {}", self.path.display());
        if let Some((place, files, folder)) = &self.staged {
            stage(place, files, folder).map_err(cannot(action()))?;
        }
        write(&self.path, &self.text).map_err(cannot(action()))
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

/// The package for another middleware, with links to what the user owns.
fn stage(place: &Path, files: &rc_codegen::Files, folder: &Path) -> io::Result<()> {
    let mut generated = rc_codegen::Files::default();
    for (path, owner, text) in files.iter() {
        if path.starts_with(GENERATED) {
            generated.add(path, owner, text.to_owned());
        }
    }
    generated.write(place)?;
    for name in SHARED {
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
mod tests {
    use super::*;

    #[test]
    fn a_launcher_is_a_script_with_the_note_of_its_component() {
        let folder = tempfile::tempdir().expect("a folder");
        let note = Note {
            component: "Eyes".to_owned(),
            model: "0".repeat(16),
            middleware: "dds".to_owned(),
        };
        let home = folder.path().join("it's here");
        let bin = home.join(".venv/bin");
        std::fs::create_dir_all(&bin).expect("a folder");
        let script = "#!/bin/sh\necho \"$ROBOCOMP_NATIVE|$PYTHONPATH|$*\"\n";
        write(&bin.join("python"), script).expect("a script");
        let path = folder.path().join("eyes");
        let native = Path::new("/x/lib.so");
        let text = text("eyes", &home, &[home.join(GENERATED)], Some(native), &note);
        write(&path, &text).expect("a launcher");
        assert_eq!(Note::read(&path).expect("a file"), Some(note));
        let output = std::process::Command::new(&path)
            .args(["--name", "a b"])
            .env_remove("VIRTUAL_ENV")
            .env_remove("PYTHONPATH")
            .output()
            .expect("it starts");
        let said = String::from_utf8(output.stdout).expect("a text");
        let generated = home.join(GENERATED);
        let wanted = format!("/x/lib.so|{}|-m eyes --name a b\n", generated.display());
        assert_eq!(said, wanted);
    }
}
