//! The folders that the editor opened, and the files to check in them.

use super::file_key::key;
use crate::check;
use rc_codegen::source_files::is_left_out;
use std::collections::{BTreeSet, VecDeque};
use std::path::{Path, PathBuf};

/// The most files that are checked although the editor has not opened them.
const MOST_FILES: usize = 2_000;

/// Folders in which files to check are looked for, and the files that were found.
#[derive(Debug, Default)]
pub(super) struct Folders {
    left: VecDeque<PathBuf>,
    found: BTreeSet<PathBuf>,
}

impl Folders {
    /// Whether all folders were looked into.
    pub(super) fn is_empty(&self) -> bool {
        self.left.is_empty()
    }

    /// Looks into no further folder.
    pub(super) fn stop(&mut self) {
        self.left.clear();
    }

    /// Looks into a folder after those that wait.
    pub(super) fn push(&mut self, folder: &Path) {
        self.left.push_back(folder.to_path_buf());
    }

    /// A file was deleted, or perhaps all files of a folder.
    pub(super) fn forget(&mut self, path: &Path) {
        self.found.retain(|found| !found.starts_with(path));
    }

    /// Finds the description files of the next folder, as `rcgen check` does: the path of each, and
    /// where it was found. Unreadable folders are left out.
    pub(super) fn look_into_next(&mut self) -> Vec<(PathBuf, PathBuf)> {
        let folder = self.left.pop_front();
        let entries = folder.and_then(|folder| std::fs::read_dir(folder).ok());
        let mut entries: Vec<_> = entries.into_iter().flatten().flatten().collect();
        entries.sort_by_key(std::fs::DirEntry::file_name);
        let mut new = Vec::new();
        for entry in entries {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let left_out = name.starts_with('.') || is_folder && is_left_out(&name);
            if left_out || self.found.len() >= MOST_FILES {
                continue;
            }
            if is_folder {
                if self.left.len() < MOST_FILES {
                    self.push(&entry.path());
                }
            } else if entry.path().is_file() && check::is_wanted(&entry.path()) {
                let path = key(&entry.path());
                self.found.insert(path.clone());
                new.push((path, entry.path()));
            }
        }
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_languages_are_found_folder_by_folder() {
        let root = tempfile::tempdir().expect("a folder");
        for file in [
            "a.cdsl",
            "b/c.idsl",
            "b/notes.txt",
            "target/d.cdsl",
            ".e/f.cdsl",
        ] {
            let path = root.path().join(file);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
            std::fs::write(path, "").expect("a file");
        }
        let mut folders = Folders::default();
        folders.push(root.path());
        let names = |found: Vec<(PathBuf, PathBuf)>| -> Vec<PathBuf> {
            let below = |path: PathBuf| path.strip_prefix(root.path()).expect("inside").into();
            found.into_iter().map(|(_, path)| below(path)).collect()
        };
        assert_eq!(names(folders.look_into_next()), [Path::new("a.cdsl")]);
        assert!(!folders.is_empty());
        assert_eq!(names(folders.look_into_next()), [Path::new("b/c.idsl")]);
        assert!(folders.is_empty());
        assert!(folders.look_into_next().is_empty());
        assert_eq!(folders.found.len(), 2);
        folders.forget(&key(&root.path().join("b")));
        assert_eq!(folders.found.len(), 1);
    }
}
