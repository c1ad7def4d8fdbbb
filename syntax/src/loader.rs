//! How an imported text is found. The languages do no input or output of their own.

use rc_diagnostics::{Diagnostic, Span};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A text that was found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportedFile {
    /// Where; two imports of the same file give the same path.
    pub path: PathBuf,
    /// What is in it.
    pub text: String,
}

/// A text that was not found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportError {
    /// The places that were looked at, in order.
    pub searched: Vec<String>,
    /// The base names that exist in those places, for a suggestion.
    pub known: Vec<String>,
    /// Why a file that exists could not be read.
    pub refused: Option<String>,
}

impl ImportError {
    /// The finding at `span`, where an import says `wanted`; `ending` is that of the language's files.
    pub fn diagnostic(&self, wanted: &str, ending: &str, span: Span) -> Diagnostic {
        let error = |message| Diagnostic::error("import-not-found", span, message);
        if let Some(why) = &self.refused {
            return error(format!("`{wanted}` cannot be read: {why}"));
        }
        let base = wanted.rsplit('/').next().unwrap_or(wanted);
        let error = error(format!(
            "`{base}` was not found; looked in {}",
            self.searched.join(", ")
        ));
        // The ending that all have in common makes nothing nearer, and other languages' files cannot be meant.
        let suffix = format!(".{ending}");
        let known = self.known.iter().filter_map(|k| k.strip_suffix(&suffix));
        let wanted = base.strip_suffix(&suffix).unwrap_or(base);
        error.help(match rc_diagnostics::nearest(wanted, known) {
            Some(near) => format!("did you mean `{near}{suffix}`?"),
            None => "name its folder with `-I DIR`, or put the file beside this one".to_owned(),
        })
    }
}

/// Hands texts to the languages.
pub trait Loader {
    /// Finds what the file `from` calls `wanted`; `ending` (`idsl`) is added where `wanted` has none.
    fn find(&self, from: &Path, wanted: &str, ending: &str) -> Result<ImportedFile, ImportError>;
}

/// Texts that exist only in memory, for tests and editors.
#[derive(Clone, Debug, Default)]
pub struct MemoryLoader(BTreeMap<String, String>);

impl MemoryLoader {
    /// A loader that knows these base names.
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
    fn find(&self, _from: &Path, wanted: &str, ending: &str) -> Result<ImportedFile, ImportError> {
        let base = wanted.rsplit('/').next().unwrap_or(wanted);
        let suffix = format!(".{ending}");
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
