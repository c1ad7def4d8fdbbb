//! The file that defines a module of the IDSL, and the hash of its text.

use rc_diagnostics::SourceMap;
use rc_idsl::Library;
use rc_syntax::Trivia;
use std::path::PathBuf;

/// The file of a module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Path of the `.idsl` file.
    pub path: PathBuf,
    /// The hash of its text without comments and white space.
    pub hash: String,
}

impl Origin {
    /// The files of the modules of a library, in their order.
    pub fn all(library: &Library, sources: &SourceMap) -> Vec<Self> {
        let modules = library.modules.iter().map(|module| module.source);
        modules
            .map(|source| Self {
                path: sources.path(source).to_path_buf(),
                hash: hash(sources.text(source)),
            })
            .collect()
    }
}

/// The hash of a definition: that of its text without comments and white space.
pub(crate) fn hash(text: &str) -> String {
    let text = Trivia::new(text).significant();
    format!("{:016x}", rc_idsl::canonical::hash(&text))
}
