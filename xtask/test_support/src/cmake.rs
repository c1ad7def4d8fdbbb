//! cmake for tests of components in C++: that of the path, or the wheel of `PyPI`.

use crate::python;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The package, where the path has none.
const PACKAGE: &str = "cmake==3.31.6";

/// The folder to put before the path of a test that builds C++; empty where the path has cmake.
/// Without it, or without a compiler, `test` is listed as skipped.
pub fn folder(test: &str) -> Option<PathBuf> {
    let runs = |program: &str| {
        let output = Command::new(program).arg("--version").output();
        output.is_ok_and(|output| output.status.success())
    };
    if !["c++", "g++", "clang++"].into_iter().any(runs) {
        python::skipped(test, "there is no compiler of C++ in the path");
        return None;
    }
    if runs("cmake") {
        return Some(PathBuf::new());
    }
    let python = python::interpreter(PACKAGE, test)?;
    python.parent().map(Path::to_path_buf)
}
