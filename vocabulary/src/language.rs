//! The programming languages of workers.

use crate::word::words;

/// A language that components are generated in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Language {
    /// Rust: a package of cargo.
    #[default]
    Rust,
    /// Python: a package of pip, which runs on the extension `robocomp`.
    Python,
}

words!(Language);

impl Language {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 2] = [Self::Rust, Self::Python];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::Python => "python",
        }
    }

    /// The words that a `.cdsl` may have, in lower case. RoboComp's files have some for which
    /// nothing is generated.
    pub const WORDS: [(&'static str, Option<Self>); 4] = [
        ("rust", Some(Self::Rust)),
        ("cpp", None),
        ("cpp11", None),
        ("python", Some(Self::Python)),
    ];

    /// The language that a word of a `.cdsl` names. `None` if nothing is generated in it.
    pub fn from_file(word: &str) -> Option<Self> {
        let mut words = Self::WORDS.into_iter();
        words
            .find(|(known, _)| known.eq_ignore_ascii_case(word))
            .and_then(|(_, language)| language)
    }

    /// Whether cargo builds it: as a member of its workspace, over the crate of interfaces that all
    /// members share. Other components have their types in a package of their own, and a launcher.
    pub fn is_built_by_cargo(self) -> bool {
        match self {
            Self::Rust => true,
            Self::Python => false,
        }
    }

    /// Whether it runs by an interpreter of the machine, which only its own machine has.
    pub fn has_interpreter(self) -> bool {
        match self {
            Self::Rust => false,
            Self::Python => true,
        }
    }

    /// The manifest of a component.
    pub fn manifest(self) -> &'static str {
        match self {
            Self::Rust => "Cargo.toml",
            Self::Python => "pyproject.toml",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_words_of_a_language_select_one() {
        for language in Language::ALL {
            assert_eq!(Language::from_file(language.word()), Some(language));
        }
        assert_eq!(Language::from_file("Python"), Some(Language::Python));
        assert_eq!(Language::from_file("cpp11"), None);
        assert_eq!(Language::from_file("anything"), None);
    }
}
