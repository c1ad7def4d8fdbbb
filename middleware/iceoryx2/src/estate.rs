//! What a network leaves behind, and its removal.

use crate::names;
use rc_middleware::RunDirectory;
use std::io;
use std::path::{Path, PathBuf};

/// Where shared memory lies.
const MEMORY: &str = "/dev/shm";

/// Removes all that iceoryx2 has of the network, whether somebody uses it or not; says how many things there were.
/// Only for a network of which nothing is alive.
pub fn wipe(directory: &RunDirectory) -> io::Result<usize> {
    let found = leftovers(directory);
    let mut failure = None;
    for path in &found {
        let removed = match std::fs::symlink_metadata(path) {
            Ok(metadata) if metadata.is_dir() => std::fs::remove_dir_all(path),
            Ok(_) => std::fs::remove_file(path),
            Err(error) => Err(error),
        };
        match removed {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                failure = failure.or(Some(error));
            }
            _ => {}
        }
    }
    failure.map_or(Ok(found.len()), Err)
}

/// The folder and the shared memory that iceoryx2 has of the network now.
pub fn leftovers(directory: &RunDirectory) -> Vec<PathBuf> {
    let root = directory.middleware(crate::NAME);
    let mut found: Vec<PathBuf> = root.exists().then_some(root).into_iter().collect();
    let prefix = names::prefix(directory);
    let entries = std::fs::read_dir(Path::new(MEMORY)).into_iter().flatten();
    let ours = entries
        .flatten()
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix));
    found.extend(ours.map(|entry| entry.path()));
    found.sort();
    found
}
