//! Texts that an editor has not saved yet. On this thread, [`read`](crate::read) returns them
//! instead of the files on disk.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

thread_local! {
    static TEXTS: RefCell<BTreeMap<PathBuf, String>> = const { RefCell::new(BTreeMap::new()) };
}

/// One path for all paths that lead to a file, also to one that is not on disk yet.
pub fn key(path: &Path) -> PathBuf {
    if let Ok(real) = path.canonicalize() {
        return real;
    }
    let folder = path.parent().and_then(|folder| folder.canonicalize().ok());
    match (folder, path.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => path.to_path_buf(),
    }
}

/// Sets the text of a file.
pub fn set(path: &Path, text: &str) {
    TEXTS.with_borrow_mut(|texts| texts.insert(key(path), text.to_owned()));
}

/// The file has the text on disk again.
pub fn remove(path: &Path) {
    TEXTS.with_borrow_mut(|texts| texts.remove(&key(path)));
}

/// All files have the texts on disk again.
pub fn clear() {
    TEXTS.with_borrow_mut(BTreeMap::clear);
}

/// Whether a file has a text, here or on disk.
pub fn exists(path: &Path) -> bool {
    TEXTS.with_borrow(|texts| texts.contains_key(&key(path))) || path.is_file()
}

/// The text of a file, if one is set.
pub(crate) fn get(path: &Path) -> Option<String> {
    TEXTS.with_borrow(|texts| {
        let any = !texts.is_empty();
        any.then(|| texts.get(&key(path)).cloned())?
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unsaved_text_is_read_until_it_is_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let (saved, new) = (folder.path().join("a"), folder.path().join("b"));
        std::fs::write(&saved, "on disk").expect("a file");
        set(&saved, "typed");
        set(&new, "new");
        let detour = folder.path().join("./a");
        assert_eq!(crate::read(&detour).expect("a text"), "typed");
        assert_eq!(crate::read(&new).expect("a text"), "new");
        remove(&detour);
        assert_eq!(crate::read(&saved).expect("a text"), "on disk");
        clear();
        assert!(crate::read(&new).is_err());
    }
}
