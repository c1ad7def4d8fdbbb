//! Writes a file that a command makes.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Writes a file atomically. A device, a pipe or a mounted file is written directly.
///
/// # Errors
/// The error of the system. The file is unchanged then.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    write_with(path, |out| out.write_all(content.as_ref()))
}

/// [`write()`] for what `fill` writes, so that a large file is not in memory. It may run twice.
///
/// # Errors
/// That of `fill` or of the system. The file is unchanged then.
pub fn write_with(
    path: &Path,
    mut fill: impl FnMut(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut filled = |path: &Path| {
        let mut out = BufWriter::new(File::create(path)?);
        fill(&mut out)?;
        out.flush()
    };
    if path.metadata().is_ok_and(|file| !file.is_file()) {
        return filled(path);
    }
    // A link stays one.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{}", std::process::id()));
    let beside = path.with_file_name(name);
    let renamed = filled(&beside).and_then(|()| std::fs::rename(&beside, &path));
    let written = match renamed {
        Err(error) if path.exists() && crate::is_mount(&error) => {
            let _ = std::fs::remove_file(&beside);
            return filled(&path);
        }
        renamed => renamed,
    };
    if written.is_err() {
        let _ = std::fs::remove_file(&beside);
    }
    written
}
