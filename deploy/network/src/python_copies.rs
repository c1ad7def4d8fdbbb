//! Files of a component in Python that another machine needs: its worker and its generated package,
//! the package of the framework with its extension module, and the packages of its environment.

use crate::error::{Error, cannot};
use crate::launcher::Places;
use crate::plan::Package;
use rc_codegen::files::GENERATED;
use rc_codegen::python::environment_copy::Environment;
use std::io;
use std::path::{Path, PathBuf};

/// Most files of one component.
const MOST: usize = 100_000;

/// What Python writes beside the modules that it reads.
const COMPILED: &str = "__pycache__";

/// The files that a component needs, and the folders that hold nothing else there.
pub(crate) fn of(places: &Places) -> Result<(Vec<PathBuf>, Package), Error> {
    let environment = Environment::of(&places.folder);
    let mut folders = vec![places.home.join(GENERATED), places.home.join("src")];
    folders.extend(
        places
            .framework
            .iter()
            .map(|python| python.join("robocomp")),
    );
    folders.extend(environment.iter().map(Environment::packages));
    let native = places.native.iter().map(|(_, path)| path);
    let mut files: Vec<PathBuf> = native.cloned().collect();
    for folder in &folders {
        add(folder, &mut Vec::new(), &mut files)
            .map_err(cannot(format!("list the files in {}", folder.display())))?;
    }
    Ok((
        files,
        Package {
            folders,
            environment,
        },
    ))
}

/// Adds the files below a folder. `above` are the folders that hold it, without links: one that
/// contains itself is read once.
fn add(folder: &Path, above: &mut Vec<PathBuf>, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let real = match folder.canonicalize() {
        Ok(real) => real,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    };
    if above.contains(&real) {
        return Ok(());
    }
    above.push(real);
    for entry in folder.read_dir()? {
        let entry = entry?;
        let path = entry.path();
        let kind = match path.metadata() {
            Ok(file) => file.file_type(),
            // A link that leads nowhere.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(error),
        };
        if kind.is_dir() && entry.file_name() != COMPILED {
            add(&path, above, files)?;
        } else if kind.is_file() {
            files.push(path);
        }
        if files.len() > MOST {
            let message = format!("a component has at most {MOST} files for another machine");
            return Err(io::Error::other(message));
        }
    }
    above.pop();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn all_that_python_reads_is_listed_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, "").expect("a file");
        };
        for name in [
            "eyes/src/specific_worker.py",
            "eyes/src/__pycache__/specific_worker.pyc",
            "eyes/generated/eyes/__init__.py",
            "eyes/tests/test_worker.py",
            "shared/lens.py",
            "framework/python/robocomp/__init__.py",
            "framework/python/Cargo.toml",
            "eyes/.venv/lib/python3.12/site-packages/numpy/core.so",
        ] {
            write(name);
        }
        let eyes = folder.path().join("eyes");
        let link = |to: &str, name: &str| symlink(folder.path().join(to), eyes.join(name));
        link("shared", "src/shared").expect("a link");
        link("eyes/src", "src/again").expect("a link");
        link("nowhere", "src/nowhere").expect("a link");
        let mut places = Places {
            folder: eyes.clone(),
            home: eyes.clone(),
            framework: Some(folder.path().join("framework/python")),
            native: vec![("ROBOCOMP_NATIVE", folder.path().join("lib.so"))],
        };
        let listed = |places: &Places| {
            let (files, package) = of(places).expect("to list");
            let relative = |path: &PathBuf| {
                let path = path.strip_prefix(folder.path()).expect("a path");
                path.display().to_string()
            };
            let mut files: Vec<String> = files.iter().map(relative).collect();
            files.sort();
            (files, package)
        };
        let own = [
            "eyes/generated/eyes/__init__.py",
            "eyes/src/shared/lens.py",
            "eyes/src/specific_worker.py",
            "framework/python/robocomp/__init__.py",
            "lib.so",
        ];
        let (files, package) = listed(&places);
        assert_eq!(files, own);
        assert_eq!(package.environment, None);

        let venv = eyes.join(".venv");
        std::fs::create_dir(venv.join("bin")).expect("a folder");
        symlink("/bin/sh", venv.join("bin/python")).expect("a link");
        std::fs::write(venv.join("pyvenv.cfg"), "version = 3.12.1\n").expect("a file");
        (places.framework, places.native) = (None, Vec::new());
        let (files, package) = listed(&places);
        assert_eq!(
            files[0],
            "eyes/.venv/lib/python3.12/site-packages/numpy/core.so"
        );
        assert_eq!(files[1..], own[..3]);
        let environment = package.environment.expect("it is there");
        assert_eq!(environment.python, (3, 12));
        assert_eq!(package.folders.last(), Some(&environment.packages()));
    }
}
