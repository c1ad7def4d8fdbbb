//! Where included files, meshes and textures are.

use std::io;
use std::path::{Path, PathBuf};

/// Hands out the files that a text names.
pub trait Loader {
    /// The content of a file.
    fn read(&self, path: &Path) -> io::Result<String>;
    /// Whether there is such a file.
    fn is_file(&self, path: &Path) -> bool;
    /// Folders where a file is looked for by its base name.
    fn search(&self) -> &[PathBuf];
}

/// Where a named file was found.
pub(crate) enum Found {
    /// At the place that the text names.
    There(PathBuf),
    /// By its base name, in another folder.
    Elsewhere(PathBuf),
}

impl Found {
    pub(crate) fn path(self) -> PathBuf {
        match self {
            Self::There(path) | Self::Elsewhere(path) => path,
        }
    }
}

/// Finds the file that a text in `folder` names: as written, then by its base name in the folder
/// and along the search path.
pub(crate) fn find(loader: &dyn Loader, folder: &Path, written: &str) -> Option<Found> {
    if written.is_empty() {
        return None;
    }
    let path = folder.join(written);
    if loader.is_file(&path) {
        return Some(Found::There(path));
    }
    let base = written.rsplit(['/', '\\']).next()?;
    let folders = std::iter::once(folder).chain(loader.search().iter().map(PathBuf::as_path));
    folders
        .map(|folder| folder.join(base))
        .find(|path| loader.is_file(path))
        .map(Found::Elsewhere)
}

/// The folder of a file. Of `world.xml` it is the empty path.
pub(crate) fn folder(path: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).to_path_buf()
}

/// The path of a file as it is written in a file of `folder`, if it is below it.
pub(crate) fn written(path: &Path, folder: &Path) -> String {
    let below = path.strip_prefix(folder).unwrap_or(path);
    below.to_string_lossy().into_owned()
}
