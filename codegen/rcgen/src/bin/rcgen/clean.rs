//! `rcgen clean`: removes generated code.

use crate::command_line::Generate;
use crate::generation::{folder_of, groups, here_or, shown};
use crate::reports::{Failure, print_line, system, tell};
use rc_codegen::files::{self, GENERATED};
use std::path::{Path, PathBuf};

/// Removes the folders `generated` of components, and that of the interfaces where the whole
/// workspace is named.
pub(crate) fn clean(paths: Vec<PathBuf>, dry_run: bool) -> Result<(), Failure> {
    let args = Generate {
        files: here_or(paths)?,
        ..Generate::default()
    };
    for group in groups(&args)?.into_values() {
        for file in &group.files {
            remove(&folder_of(file, &args), dry_run)?;
        }
        // A component in no workspace has them for itself.
        if group.whole || group.interfaces.workspace().is_none() {
            remove(&shown(group.interfaces.folder()), dry_run)?;
        }
    }
    Ok(())
}

fn remove(folder: &Path, dry_run: bool) -> Result<(), Failure> {
    let generated = folder.join(GENERATED);
    if !generated.exists() {
        return Ok(());
    }
    if !files::is_generated(&generated) {
        tell(format_args!(
            "{} was not written by rcgen, and stays",
            generated.display()
        ));
        return Ok(());
    }
    print_line(format_args!("remove {}", generated.display()));
    if dry_run {
        return Ok(());
    }
    std::fs::remove_dir_all(&generated).map_err(system)
}
