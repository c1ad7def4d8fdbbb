//! Which ends a dead process had, remembered for the case that those who clean up after it are killed, too.
//!
//! iceoryx2 keeps a file, a tag, for each end (port) of a node. Its clean-up removes the tag of a dead end first and
//! gives its place in the service free afterwards; where there is no tag, it passes the end over and forgets the node
//! (0.10.0). Who is killed in between leaves a place that nobody frees again: that of a server is the only one. So
//! each tag has a second name while somebody cleans, and one that is gone gets its first name back before the next
//! one does.

use std::fs;
use std::path::{Path, PathBuf};

/// The extension of a tag.
const TAG: &str = "port_tag";

/// Remembers the tags of the dead nodes `dead`, and gives back to them those that somebody had begun to remove.
/// Only while nobody else cleans.
pub(crate) fn back_up(root: &Path, dead: &[u128]) {
    for node in dead {
        let (here, backup) = (of_node(root, *node), backups(root).join(node.to_string()));
        if !here.is_dir() || fs::create_dir_all(&backup).is_err() {
            // What cannot be remembered is cleaned up as iceoryx2 does it.
            continue;
        }
        link_tags(&backup, &here);
        link_tags(&here, &backup);
    }
}

/// Forgets the tags of nodes that are gone.
pub(crate) fn discard_backups(root: &Path) {
    for backup in entries(&backups(root)) {
        let node = backup.file_name().unwrap_or_default();
        if !nodes(root).join(node).exists() {
            // What is left of it harms nobody.
            let _ = fs::remove_dir_all(&backup);
        }
    }
}

/// Gives the tags in `from` a name in `to`, where they have none.
fn link_tags(from: &Path, to: &Path) {
    for tag in entries(from) {
        if tag.extension().is_some_and(|extension| extension == TAG)
            && let Some(name) = tag.file_name()
        {
            // Most have it already.
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
