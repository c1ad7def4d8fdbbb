//! Paths of files: without links or detours, from one folder to another, in errors.

use std::io;
use std::path::{Path, PathBuf};

/// `a/./b/../c` as `a/c`, so that one file has one path; links are left alone.
pub fn normal(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(out.components().next_back(), Some(Component::Normal(_))) =>
            {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

/// The path of a folder without links, also where its last parts do not exist yet.
///
/// # Errors
/// There is no current folder.
pub fn absolute(folder: &Path) -> io::Result<PathBuf> {
    // The folder of a file without one is the current folder.
    let folder = std::env::current_dir()?.join(folder);
    let folder = normal(&folder);
    for there in folder.ancestors() {
        if let Ok(real) = there.canonicalize() {
            let missing = folder.strip_prefix(there).unwrap_or(Path::new(""));
            // To join an empty path would add a `/`.
            return Ok(if missing.as_os_str().is_empty() {
                real
            } else {
                real.join(missing)
            });
        }
    }
    Ok(folder)
}

/// The path that leads from the folder `from` to `to`; both are absolute.
pub fn relative(from: &Path, to: &Path) -> PathBuf {
    let shared = from.iter().zip(to).take_while(|(a, b)| a == b).count();
    let up = from.iter().skip(shared).map(|_| "..".as_ref());
    up.chain(to.iter().skip(shared)).collect()
}

/// The error about a path that does not exist, with the most likely one.
pub fn missing(path: &Path) -> io::Error {
    let near = rc_files::nearest_path(path);
    let hint = near.map(|near| format!("; did you mean `{}`?", near.display()));
    let message = "there is no such file or folder".to_owned() + &hint.unwrap_or_default();
    io::Error::new(io::ErrorKind::NotFound, message)
}

/// An error with the path that it is about.
pub(crate) fn named(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}
