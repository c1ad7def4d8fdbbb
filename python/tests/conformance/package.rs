//! The components of the tests in Python.

use rc_codegen::{FileLoader, Project, generate};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_other_end::{Over, Package};
use rc_test_support::python;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The packages that the package needs in addition to Python.
const NUMPY: &str = "numpy==2.3.4";
/// The folder of the components.
const COMPONENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");

/// Generates a component. `None` without Python 3.11 or `NumPy`: the test is listed as skipped.
pub(crate) fn package(name: &str, over: Over) -> Option<Package> {
    let test = format!("{name} over {}", over.name());
    let python = python::packages("python-numpy", NUMPY, &test)?;
    let folder = tempfile::tempdir().expect("a folder");
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let cdsl = Path::new(COMPONENTS)
        .join(name)
        .join(format!("{name}.cdsl"));
    let right = |found: Diagnostics| assert!(!found.has_errors(), "{found:?}");
    let (project, found) = Project::load(&cdsl, &mut sources, &loader).expect("a file");
    right(found);
    let project = project.expect("a component");
    let (files, found) = generate::component(&project, over.backend, "").expect("templates");
    right(found);
    files.write(folder.path()).expect("to write");
    let own = Path::new(COMPONENTS).join(name).join("src");
    for file in std::fs::read_dir(own).expect("a folder") {
        let file = file.expect("a file");
        let to = folder.path().join("src").join(file.file_name());
        std::fs::copy(file.path(), to).expect("to copy");
    }
    let description = folder
        .path()
        .join("generated")
        .join(name)
        .join("description.json");
    let description = std::fs::read_to_string(description).expect("a description");
    let mut description: Value = serde_json::from_str(&description).expect("JSON");
    let generated = folder.path().join("generated");
    let paths = [Path::new(env!("CARGO_MANIFEST_DIR")), &generated];
    let mut command = Command::new(python);
    command
        .current_dir(folder.path())
        .env("PYTHONPATH", std::env::join_paths(paths).expect("paths"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("ROBOCOMP_NATIVE", native())
        .args(["-m", name]);
    Some(Package {
        command,
        slots: description["slots"].take(),
        folder: Some(folder),
    })
}

fn native() -> PathBuf {
    let own = std::env::current_exe().expect("this program");
    own.with_file_name("librobocomp_python.so")
}
