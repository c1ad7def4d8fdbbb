//! Sanitizers of compilers of C++, with which a program is built as a variant.

/// A sanitizer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sanitizer {
    /// Errors of memory.
    Address,
    /// Undefined behaviour.
    Undefined,
    /// Races of threads.
    Thread,
}

impl Sanitizer {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Address, Self::Undefined, Self::Thread];

    /// The name for the compiler's `-fsanitize`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Address => "address",
            Self::Undefined => "undefined",
            Self::Thread => "thread",
        }
    }

    /// The environment of a program. The runtime keeps descriptions as long as it runs, which would be
    /// leaks.
    pub fn environment(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Address => &[("ASAN_OPTIONS", "detect_leaks=0")],
            Self::Undefined => &[("UBSAN_OPTIONS", "print_stacktrace=1")],
            Self::Thread => &[],
        }
    }
}

impl std::str::FromStr for Sanitizer {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut all = Self::ALL.into_iter();
        all.find(|one| one.word() == text).ok_or_else(|| {
            let words = Self::ALL.map(Self::word).join(", ");
            format!("`{text}` is not a sanitizer; there are {words}")
        })
    }
}
