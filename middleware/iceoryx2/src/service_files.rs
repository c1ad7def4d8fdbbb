//! The files and shared memory that iceoryx2 has of one network, and their removal.

use crate::names::{self, Storage};
use rc_middleware::RunDirectory;
use std::fs::Metadata;
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

/// The folder of shared memory.
pub(crate) const MEMORY: &str = "/dev/shm";

/// Removes all files and shared memory that iceoryx2 has of the network, whether a process uses
/// them or not. Returns their number. Call it only when no process of the network is alive. An
/// error names the first path that cannot be removed; the others are removed all the same.
///
/// The next process that joins chooses another prefix, so that files of another user, which this
/// one cannot remove, are not in its way.
pub fn wipe(directory: &RunDirectory) -> io::Result<usize> {
    let found = leftovers(directory);
    let mut failure = None;
    for path in found.iter().chain([&names::file(directory)]) {
        let removed = match std::fs::symlink_metadata(path) {
            Ok(metadata) if metadata.is_dir() => std::fs::remove_dir_all(path),
            Ok(_) => std::fs::remove_file(path),
            Err(error) => Err(error),
        };
        match removed {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                let text = format!("{} cannot be removed: {error}", path.display());
                failure = failure.or(Some(io::Error::new(error.kind(), text)));
            }
            _ => {}
        }
    }
    failure.map_or(Ok(found.len()), Err)
}

/// The root folder and the shared memory that iceoryx2 has of the network now, sorted; also under
/// the prefixes of earlier runs.
pub fn leftovers(directory: &RunDirectory) -> Vec<PathBuf> {
    let root = directory.middleware(crate::NAME);
    let mut found: Vec<PathBuf> = root.exists().then_some(root).into_iter().collect();
    let own = rustix::process::getuid().as_raw();
    let start = names::start(directory);
    let ours = with_prefix(Path::new(MEMORY), &start);
    let ours = ours.filter(|(_, metadata)| metadata.uid() == own);
    found.extend(ours.map(|(path, _)| path));
    found.sort();
    found
}

/// The shared memory of a network that this process uses and that has no name any more.
pub(crate) fn unlinked(prefix: &str) -> Vec<PathBuf> {
    // proc_pid_maps(5): the path is last, and followed by this where its file was removed.
    const REMOVED: &str = " (deleted)";
    let start = format!("{MEMORY}/{prefix}");
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let paths = maps.lines().filter_map(|line| {
        let path = &line[line.find(&start)?..];
        path.strip_suffix(REMOVED).map(PathBuf::from)
    });
    let mut paths: Vec<PathBuf> = paths.collect();
    paths.sort();
    paths.dedup();
    paths
}

/// Files of other users of the machine that block this network.
pub(crate) fn foreign(place: &Storage) -> Vec<String> {
    let own = rustix::process::getuid().as_raw();
    with_prefix(Path::new(MEMORY), &place.prefix)
        .filter(|(_, metadata)| metadata.uid() != own)
        .map(|(path, metadata)| {
            let owner = rc_middleware::user_name(metadata.uid());
            format!("{} belongs to user {owner}", path.display())
        })
        .collect()
}

/// The entries of `folder` whose names begin with `prefix`.
pub(crate) fn with_prefix(
    folder: &Path,
    prefix: &str,
) -> impl Iterator<Item = (PathBuf, Metadata)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    entries
        .flatten()
        .filter(move |entry| entry.file_name().to_string_lossy().starts_with(prefix))
        .filter_map(|entry| Some((entry.path(), entry.metadata().ok()?)))
}
