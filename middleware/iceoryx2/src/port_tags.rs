//! Backups of port tags, in case the process that cleans up after a dead node is killed, too.
//!
//! iceoryx2 keeps a file, the tag, for each port of a node. Its clean-up (0.10.0) removes the tag
//! of a dead port first and frees the port's place in the service afterwards. It skips a port
//! without a tag. A process that is killed in between leaves a place that nobody frees again, and a
//! service has only one place for a server. Each tag therefore has a second hard link during a
//! clean-up, from which the next clean-up restores it.

use std::fs;
use std::path::{Path, PathBuf};

/// File extension of a tag.
const TAG: &str = "port_tag";

/// Backs up the tags of the nodes `dead`, and restores those that an interrupted clean-up has
/// removed. The caller holds the clean-up lock.
pub(crate) fn back_up(root: &Path, dead: &[u128]) {
    for node in dead {
        let (here, backup) = (of_node(root, *node), backups(root).join(node.to_string()));
        if !here.is_dir() || fs::create_dir_all(&backup).is_err() {
            // Without a backup iceoryx2 cleans up in its own way.
            continue;
        }
        link_tags(&backup, &here);
        link_tags(&here, &backup);
    }
}

/// Removes the backups of nodes that no longer exist.
pub(crate) fn discard_backups(root: &Path) {
    for backup in entries(&backups(root)) {
        let node = backup.file_name().unwrap_or_default();
        if !nodes(root).join(node).exists() {
            // A backup that stays is harmless.
            let _ = fs::remove_dir_all(&backup);
        }
    }
}

/// Links the tags in `from` into `to`.
fn link_tags(from: &Path, to: &Path) {
    for tag in entries(from) {
        if tag.extension().is_some_and(|extension| extension == TAG)
            && let Some(name) = tag.file_name()
        {
            // Most are linked already.
            let _ = fs::hard_link(&tag, to.join(name));
        }
    }
}

fn nodes(root: &Path) -> PathBuf {
    root.join("nodes")
}

fn of_node(root: &Path, node: u128) -> PathBuf {
    nodes(root).join(node.to_string())
}

fn backups(root: &Path) -> PathBuf {
    root.join("tags")
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).collect()
}
