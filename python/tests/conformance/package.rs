//! The component `every_type` in Python.

use rc_codegen::{FileLoader, Project, generate};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_other_end::{Over, Package};
use rc_test_support::python;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The packages that the package needs in addition to Python.
const NUMPY: &str = "numpy==2.3.4";
/// The component.
const COMPONENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/every_type");

/// Generates the component. `None` without Python 3.11 or `NumPy`: the test is listed as skipped.
pub(crate) fn package(over: Over) -> Option<Package> {
    let test = format!("conformance over {}", over.name());
    let python = python::packages("python-numpy", NUMPY, &test)?;
    let folder = tempfile::tempdir().expect("a folder");
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let cdsl = Path::new(COMPONENT).join("every_type.cdsl");
    let right = |found: Diagnostics| assert!(!found.has_errors(), "{found:?}");
    let (project, found) = Project::load(&cdsl, &mut sources, &loader).expect("a file");
    right(found);
    let project = project.expect("a component");
    let (files, found) = generate::component(&project, over.backend, "").expect("templates");
    right(found);
    files.write(folder.path()).expect("to write");
    for file in ["specific_worker.py", "values.py"] {
        let from = Path::new(COMPONENT).join("src").join(file);
        std::fs::copy(from, folder.path().join("src").join(file)).expect("to copy");
    }
    let description = folder.path().join("generated/every_type/description.json");
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
        .args(["-m", "every_type"]);
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
