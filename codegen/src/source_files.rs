//! The files that a command line names.

use std::collections::BTreeSet;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// The files named on a command line, each once. A folder is replaced by its `wanted` files, except
/// generated, built and hidden ones.
pub fn files(paths: &[PathBuf], wanted: &dyn Fn(&Path) -> bool) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut seen = BTreeSet::new();
    for path in paths {
        if path.is_dir() {
            walk(path, wanted, &mut files)?;
        } else {
            files.push(path.clone());
        }
    }
    files.retain(|file| {
        let real = file.canonicalize().unwrap_or_else(|_| file.clone());
        seen.insert(real)
    });
    Ok(files)
}

/// Whether a folder with this name is hidden or holds what programs have written.
pub fn is_left_out(name: &str) -> bool {
    name.starts_with('.') || matches!(name, "target" | "generated")
}

/// The names of the folders in a folder, without those that are left out. None if there is no such
/// folder.
pub(crate) fn folders(folder: &Path) -> io::Result<Vec<String>> {
    let named = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", folder.display()));
    let mut names = Vec::new();
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Ok(names);
        }
        Err(error) => return Err(named(error)),
    };
    for entry in entries {
        let entry = entry.map_err(named)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if !is_left_out(&name) && entry.file_type().map_err(named)?.is_dir() {
            names.push(name);
        }
    }
    Ok(names)
}

fn walk(folder: &Path, wanted: &dyn Fn(&Path) -> bool, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let named = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", folder.display()));
    let entries = std::fs::read_dir(folder).map_err(named)?;
    let mut entries = entries.collect::<io::Result<Vec<_>>>().map_err(named)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let path = entry.path();
        // Links to folders are not followed: they could be cyclic.
        if entry.file_type().map_err(named)?.is_dir() {
            if !is_left_out(&name) {
                walk(&path, wanted, files)?;
            }
        // Hidden files are often backups of editors. Reading a pipe would block.
        } else if !name.starts_with('.') && wanted(&path) && path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}
