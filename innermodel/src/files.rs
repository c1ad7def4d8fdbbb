//! Reads files from the disk.

use crate::error::Error;
use innermodel_language::{Document, Loader};
use rc_diagnostics::{Diagnostics, Format, Severity, SourceMap, render};
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error as ThisError;

/// Error of a file that gives no tree.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum LoadError {
    /// The system cannot read the file.
    #[error("{path}: {error}")]
    Unreadable {
        /// The file.
        path: String,
        /// Why.
        error: io::Error,
    },
    /// The file is wrong. The text has each finding with its line.
    #[error("{0}")]
    Wrong(String),
    /// The document was made by hand, and is none that a file could say.
    #[error(transparent)]
    Tree(#[from] Error),
}

/// Files of the disk. A file that is not where a text says is looked for by its base name in some
/// folders.
#[derive(Clone, Debug, Default)]
pub struct Folders {
    search: Vec<PathBuf>,
}

impl Folders {
    /// Looks into these folders, in their order.
    pub fn new(search: impl IntoIterator<Item = PathBuf>) -> Self {
        Self {
            search: search.into_iter().collect(),
        }
    }
}

impl Loader for Folders {
    fn read(&self, path: &Path) -> io::Result<String> {
        rc_files::read(path)
    }

    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn search(&self) -> &[PathBuf] {
        &self.search
    }
}

/// Reads a file with all that it includes. The text has the warnings, if there are any.
pub fn read(path: &Path, folders: &Folders) -> Result<(Document, String), LoadError> {
    let text = rc_files::read(path).map_err(|error| LoadError::Unreadable {
        path: path.display().to_string(),
        error,
    })?;
    load(&text, path, folders)
}

/// Reads a text of another program as if it were in the file `place`: meshes that it names are
/// looked for from there. It cannot include files. The second text has the warnings, if there are
/// any.
pub fn read_text(
    text: &str,
    place: &Path,
    folders: &Folders,
) -> Result<(Document, String), LoadError> {
    struct FolderLoader<'f>(&'f Folders);
    impl Loader for FolderLoader<'_> {
        fn read(&self, _: &Path) -> io::Result<String> {
            let kind = io::ErrorKind::PermissionDenied;
            Err(io::Error::new(kind, "this text includes no files"))
        }

        fn is_file(&self, path: &Path) -> bool {
            self.0.is_file(path)
        }

        fn search(&self) -> &[PathBuf] {
            self.0.search()
        }
    }
    load(text, place, &FolderLoader(folders))
}

/// No file.
struct Nothing;

impl Loader for Nothing {
    fn read(&self, _: &Path) -> io::Result<String> {
        Err(io::ErrorKind::NotFound.into())
    }

    fn is_file(&self, _: &Path) -> bool {
        false
    }

    fn search(&self) -> &[PathBuf] {
        &[]
    }
}

/// Reads a text that includes no file.
pub(crate) fn parse(text: &str) -> Result<(Document, String), LoadError> {
    load(text, Path::new("text.xml"), &Nothing)
}

/// The reason why a file cannot have an element, if there is one.
pub(crate) fn problem(element: &str) -> Option<String> {
    let mut sources = SourceMap::new();
    let text = format!("<innerModel>{element}</innerModel>");
    let source = sources.add("element.xml", text);
    let (_, found) = innermodel_language::load(&mut sources, &Nothing, source);
    let mut errors = found
        .iter()
        .filter(|found| found.severity == Severity::Error);
    errors.next().map(|error| error.message.clone())
}

fn load(text: &str, place: &Path, loader: &dyn Loader) -> Result<(Document, String), LoadError> {
    let mut sources = SourceMap::new();
    let source = sources.add(place, text);
    let (document, found) = innermodel_language::load(&mut sources, loader, source);
    checked(document, &found, &sources)
}

fn checked(
    document: Document,
    found: &Diagnostics,
    sources: &SourceMap,
) -> Result<(Document, String), LoadError> {
    let text = render(sources, found, Format::Short);
    if found.has_errors() {
        return Err(LoadError::Wrong(text));
    }
    Ok((document, text))
}
