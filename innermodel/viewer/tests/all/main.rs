//! Tests of `rcview` and of the window.

#[path = "../../../../codegen/tests/all/debian.rs"]
mod debian;
mod edited_files;
mod editing;
mod files;
mod pointing;
#[path = "../../../../deploy/tests/all/python.rs"]
mod python;
mod screen;
mod whole;
mod windows;

use std::path::PathBuf;
use std::process::Command;

/// A scene of this repository.
fn scene(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../scenes")
        .join(name)
}

fn rcview() -> Command {
    Command::new(env!("CARGO_BIN_EXE_rcview"))
}
