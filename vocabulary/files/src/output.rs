//! Writes a file that a command makes.

use std::ffi::OsString;
use std::io;
use std::path::Path;

/// Writes a file atomically. A device, a pipe or a mounted file is written directly.
///
/// # Errors
/// The error of the system. The file is unchanged then.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    if path.metadata().is_ok_and(|file| !file.is_file()) {
        return std::fs::write(path, content);
    }
    // A link stays one.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}", std::process::id()));
    let beside = path.with_file_name(name);
    let content = content.as_ref();
    let renamed = std::fs::write(&beside, content).and_then(|()| std::fs::rename(&beside, &path));
    let written = match renamed {
        Err(error) if path.exists() && crate::is_mount(&error) => {
            let _ = std::fs::remove_file(&beside);
            return std::fs::write(&path, content);
        }
        renamed => renamed,
    };
    if written.is_err() {
        let _ = std::fs::remove_file(&beside);
    }
    written
}
