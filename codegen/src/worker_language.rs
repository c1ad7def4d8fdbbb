//! The languages that workers are written in.

use rc_cdsl::ast::Clause;
use rc_diagnostics::SourceMap;
use std::path::Path;

/// The language of a worker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WorkerLanguage {
    /// Rust, also of components in languages without templates.
    #[default]
    Rust,
    /// Python.
    Python,
}

impl WorkerLanguage {
    /// Parses the word of the clause `language` of a `.cdsl`.
    pub fn of(word: &str) -> Self {
        match word {
            "python" => Self::Python,
            _ => Self::Rust,
        }
    }

    /// Name in a `.cdsl`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::Python => "python",
        }
    }

    /// The language that a `.cdsl` names; Rust where it cannot be read as one.
    ///
    /// # Errors
    /// The system does not give the file.
    pub fn of_file(path: &Path) -> std::io::Result<Self> {
        let mut sources = SourceMap::new();
        let source = sources.add(path, rc_files::read(path)?);
        let (file, _) = rc_cdsl::parse(&sources, source);
        let clauses = file
            .component
            .into_iter()
            .flat_map(|component| component.clauses);
        let mut words = clauses.filter_map(|(_, clause)| match clause {
            Clause::Language(word) => Some(Self::of(&word.text.to_lowercase())),
            _ => None,
        });
        Ok(words.next().unwrap_or(Self::Rust))
    }

    /// The manifest of a component in this language.
    pub fn manifest(self) -> &'static str {
        match self {
            Self::Rust => "Cargo.toml",
            Self::Python => "pyproject.toml",
        }
    }
}
