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
    /// C++: a project of cmake, which links `librobocomp_cpp.so`.
    Cpp,
}

/// How the program of a component comes about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Builder {
    /// cargo builds it: as a member of its workspace, over the crate of interfaces that all members
    /// share. Other components have their types in a package of their own.
    Cargo,
    /// cmake builds it.
    Cmake,
    /// A launcher starts the interpreter of the machine, which only its own machine has.
    Interpreter,
}

/// Requirements of components of a language in addition to their program, for messages about hosts
/// and containers that lack them.
#[derive(Debug)]
pub struct Needs {
    /// Parts that a process has once, for one component.
    pub own: &'static str,
    /// The code of a finding about components that share a process.
    pub shared: &'static str,
    /// The code of the finding that refuses components on other hosts. `None`: it is copied there.
    pub elsewhere: Option<&'static str>,
    /// Missing parts of the image of a container.
    pub missing: &'static str,
}

static PYTHON_NEEDS: Needs = Needs {
    own: "an interpreter",
    shared: "process-interpreter",
    elsewhere: None,
    missing: "no interpreter and no packages",
};

static CPP_NEEDS: Needs = Needs {
    own: "a program",
    shared: "process-program",
    elsewhere: Some("cpp-elsewhere"),
    missing: "no library of robocomp",
};

words!(Language);

impl Language {
    /// All of them, in the order in which messages list them.
    pub const ALL: [Self; 3] = [Self::Rust, Self::Python, Self::Cpp];

    /// The word for it, in files and in JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::Rust => "rust",
            Self::Python => "python",
            Self::Cpp => "cpp",
        }
    }

    /// The words that a `.cdsl` may have, in lower case. RoboComp's files have several for C++.
    pub const WORDS: [(&'static str, Self); 6] = [
        ("rust", Self::Rust),
        ("cpp", Self::Cpp),
        ("python", Self::Python),
        ("cpp11", Self::Cpp),
        ("cpp17", Self::Cpp),
        ("c++", Self::Cpp),
    ];

    /// The language that a word of a `.cdsl` names.
    pub fn from_file(word: &str) -> Option<Self> {
        let mut words = Self::WORDS.into_iter();
        words
            .find(|(known, _)| known.eq_ignore_ascii_case(word))
            .map(|(_, language)| language)
    }

    /// How the program of a component comes about.
    pub fn builder(self) -> Builder {
        match self {
            Self::Rust => Builder::Cargo,
            Self::Python => Builder::Interpreter,
            Self::Cpp => Builder::Cmake,
        }
    }

    /// Whether cargo builds it.
    pub fn is_built_by_cargo(self) -> bool {
        self.builder() == Builder::Cargo
    }

    /// Whether it runs by an interpreter of the machine.
    pub fn has_interpreter(self) -> bool {
        self.builder() == Builder::Interpreter
    }

    /// The name, for messages.
    pub fn title(self) -> &'static str {
        match self {
            Self::Rust => "Rust",
            Self::Python => "Python",
            Self::Cpp => "C++",
        }
    }

    /// Requirements of components in addition to their program. `None` if cargo links everything.
    pub fn needs(self) -> Option<&'static Needs> {
        match self {
            Self::Rust => None,
            Self::Python => Some(&PYTHON_NEEDS),
            Self::Cpp => Some(&CPP_NEEDS),
        }
    }

    /// The manifest of a component.
    pub fn manifest(self) -> &'static str {
        match self {
            Self::Rust => "Cargo.toml",
            Self::Python => "pyproject.toml",
            Self::Cpp => "CMakeLists.txt",
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
        for word in ["cpp11", "CPP17", "c++"] {
            assert_eq!(Language::from_file(word), Some(Language::Cpp));
        }
        assert_eq!(Language::from_file("anything"), None);
    }
}
