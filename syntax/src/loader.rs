//! How imports are found. The language crates perform no input or output of their own.

use rc_diagnostics::{Diagnostic, Span};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// A file that a [`Loader`] found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportedFile {
    /// The path, as the import leads to it.
    pub path: PathBuf,
    /// The content.
    pub text: String,
}

/// Why an import failed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportError {
    /// The searched locations, in order.
    pub searched: Vec<String>,
    /// The file names in these locations, for a suggestion.
    pub known: Vec<String>,
    /// The error, if the file exists but cannot be read.
    pub refused: Option<String>,
}

impl ImportError {
    /// The diagnostic for the import of `wanted` at `span`. `extension` is that of the language.
    pub fn diagnostic(&self, wanted: &str, extension: &str, span: Span) -> Diagnostic {
        let error = |message| Diagnostic::error("import-not-found", span, message);
        if let Some(why) = &self.refused {
            return error(format!("cannot read `{wanted}`: {why}"));
        }
        if let Some(home) = home_in_path(wanted, span) {
            return home;
        }
        let base = wanted.rsplit('/').next().unwrap_or(wanted);
        let error = error(format!(
            "cannot find `{base}`; searched in {}",
            self.searched.join(", ")
        ));
        // Compare without the extension that all candidates share; skip files of other languages.
        let suffix = format!(".{extension}");
        let known = self.known.iter().filter_map(|k| k.strip_suffix(&suffix));
        let wanted = base.strip_suffix(&suffix).unwrap_or(base);
        error.help(match rc_diagnostics::nearest(wanted, known) {
            Some(near) => format!("did you mean `{near}{suffix}`?"),
            None => "copy the file into one of these folders, or pass its folder with `-I DIR`"
                .to_owned(),
        })
    }
}

/// The error about a path of a description that begins with `~`. `None` if it does not.
pub fn home_in_path(path: &str, span: Span) -> Option<Diagnostic> {
    if path != "~" && !path.starts_with("~/") {
        return None;
    }
    let message = format!("`{path}` begins with `~`, which only a shell expands");
    let diagnostic = Diagnostic::error("home-in-path", span, message);
    Some(diagnostic.help("write the path from this file, or an absolute one"))
}

/// Finds and reads imported files.
pub trait Loader {
    /// Finds the file that `from` imports as `wanted`. If `wanted` has no extension, `extension`
    /// (`idsl`) is appended.
    fn find(&self, from: &Path, wanted: &str, extension: &str)
    -> Result<ImportedFile, ImportError>;

    /// One path for all paths that lead to the file at `path`.
    fn identity(&self, path: &Path) -> PathBuf {
        path.to_path_buf()
    }
}

/// A loader of files in the folder of the file that imports them. It reads with this function.
pub struct Beside(pub fn(&Path) -> io::Result<String>);

impl Loader for Beside {
    fn find(
        &self,
        from: &Path,
        wanted: &str,
        extension: &str,
    ) -> Result<ImportedFile, ImportError> {
        let folder = from.parent().unwrap_or(Path::new(""));
        let mut path = folder.join(wanted);
        if path.extension().is_none() {
            path.set_extension(extension);
        }
        match (self.0)(&path) {
            Ok(text) => Ok(ImportedFile { path, text }),
            Err(error) => Err(ImportError {
                searched: vec![folder.display().to_string()],
                known: Vec::new(),
                refused: (error.kind() != io::ErrorKind::NotFound).then(|| error.to_string()),
            }),
        }
    }
}

/// A loader of texts in memory, for tests and editors.
#[derive(Clone, Debug, Default)]
pub struct MemoryLoader(BTreeMap<String, String>);

impl MemoryLoader {
    /// A loader for pairs of file name and text.
    pub fn new<'a>(texts: impl IntoIterator<Item = (&'a str, &'a str)>) -> Self {
        Self(
            texts
                .into_iter()
                .map(|(name, text)| (name.to_owned(), text.to_owned()))
                .collect(),
        )
    }
}

impl Loader for MemoryLoader {
    fn find(
        &self,
        _from: &Path,
        wanted: &str,
        extension: &str,
    ) -> Result<ImportedFile, ImportError> {
        let base = wanted.rsplit('/').next().unwrap_or(wanted);
        let suffix = format!(".{extension}");
        let base = if base.ends_with(&suffix) {
            base.to_owned()
        } else {
            format!("{base}{suffix}")
        };
        match self.0.get(&base) {
            Some(text) => Ok(ImportedFile {
                path: PathBuf::from(base),
                text: text.clone(),
            }),
            None => Err(ImportError {
                searched: vec!["memory".to_owned()],
                known: self.0.keys().cloned().collect(),
                refused: None,
            }),
        }
    }
}
