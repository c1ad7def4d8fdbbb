//! One path for all that lead to a file.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The keys of paths, as of one check: the system is asked once for each.
#[derive(Debug, Default)]
pub(super) struct Keys(HashMap<PathBuf, PathBuf>);

impl Keys {
    pub(super) fn of(&mut self, path: &Path) -> PathBuf {
        if let Some(known) = self.0.get(path) {
            return known.clone();
        }
        let key = key(path);
        self.0.insert(path.to_path_buf(), key.clone());
        key
    }
}

/// One path for all that lead to a file.
pub(super) fn key(path: &Path) -> PathBuf {
    rc_files::unsaved::key(path)
}
