//! Files of `InnerModel` among other files.

use innermodel_language::Loader;
use rc_diagnostics::{Diagnostics, SourceId, SourceMap};
use std::io;
use std::path::{Path, PathBuf};

/// The disk. A file that is not where a text says is looked for by its base name in some folders.
pub struct Folders<'f> {
    /// These folders.
    pub search: &'f [PathBuf],
}

impl Loader for Folders<'_> {
    fn read(&self, path: &Path) -> io::Result<String> {
        rc_files::read(path)
    }

    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn search(&self) -> &[PathBuf] {
        self.search
    }
}

/// Whether a file of a folder is wanted: other programs have files with the ending `xml`, too.
pub(crate) fn is_wanted(path: &Path) -> bool {
    if path.extension() != Some("xml".as_ref()) {
        return true;
    }
    rc_files::read(path).is_ok_and(|text| innermodel_language::is_innermodel(&text))
}

/// Lays out a text, unless it has errors.
pub(crate) fn format(sources: &SourceMap, source: SourceId) -> Result<String, Diagnostics> {
    let found = innermodel_language::parse(sources, source);
    if found.has_errors() {
        return Err(found);
    }
    Ok(innermodel_language::format(sources.text(source)))
}
