//! Cargo workspaces: what cargo knows of them. It is asked once for each.

use cargo_metadata::{Error, MetadataCommand};
use rc_codegen::cargo_workspace::Workspace;
use std::cell::RefCell;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

/// The target folders of workspaces by their roots, or why cargo does not tell them.
#[derive(Debug, Default)]
pub(crate) struct Workspaces(RefCell<HashMap<PathBuf, Result<PathBuf, String>>>);

impl Workspaces {
    /// The root of the workspace that a package in `folder` belongs to; none where there is none.
    pub(crate) fn root(folder: &Path) -> Option<PathBuf> {
        let workspace = Workspace::of(folder).ok()??;
        Some(workspace.root().to_path_buf())
    }

    /// The folder that cargo builds the workspace `root` into: `CARGO_TARGET_DIR`,
    /// `build.target-dir` of a configuration of cargo, or `target`.
    pub(crate) fn target(&self, root: &Path) -> io::Result<PathBuf> {
        let mut known = self.0.borrow_mut();
        let target = known.entry(root.to_path_buf()).or_insert_with(|| ask(root));
        target.clone().map_err(io::Error::other)
    }
}

fn ask(root: &Path) -> Result<PathBuf, String> {
    let metadata = MetadataCommand::new()
        // Cargo looks for its configuration from here upwards.
        .current_dir(root)
        .manifest_path(root.join("Cargo.toml"))
        .no_deps()
        .exec();
    let (reason, advice) = match metadata {
        Ok(metadata) => return Ok(metadata.target_directory.into_std_path_buf()),
        Err(Error::CargoMetadata { stderr }) => (
            stderr.trim().trim_start_matches("error: ").to_owned(),
            "correct the manifest that it names",
        ),
        Err(Error::Io(error)) => (
            format!("cargo cannot be started: {error}"),
            "install cargo, or name each program with `executable`",
        ),
        Err(error) => (error.to_string(), "is this the cargo of a Rust toolchain?"),
    };
    let root = root.display();
    Err(format!(
        "cargo does not tell where it builds {root}: {reason} ({advice})"
    ))
}
