//! Tests of `rcview` and of the window.

mod edited_files;
mod editing;
mod files;
mod pointing;
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
