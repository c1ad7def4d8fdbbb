//! The file of this program, from which the supervisor starts others of its kind.

use std::fs::metadata;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// This program, also if another file has its path now: a build may have replaced it.
pub(crate) const OWN: &str = "/proc/self/exe";

/// The path of this program; [`OWN`] if the file there is another one by now.
///
/// # Errors
/// The system does not name this program.
pub(crate) fn own_program() -> io::Result<PathBuf> {
    let path = std::env::current_exe()?;
    let own = metadata(OWN)?;
    let same = |there: std::fs::Metadata| (there.dev(), there.ino()) == (own.dev(), own.ino());
    Ok(if metadata(&path).is_ok_and(same) {
        path
    } else {
        Path::new(OWN).to_path_buf()
    })
}
