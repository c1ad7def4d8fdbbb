//! Values that have one word each, in files, in JSON and in messages.

/// Derives the reading and listing of words, and the word as the form in JSON, from the constant
/// `ALL` and the function `word` of a closed set of values.
macro_rules! words {
    ($ty:ty) => {
        impl $ty {
            /// The value that a word names exactly.
            pub fn from_word(word: &str) -> Option<Self> {
                Self::ALL.into_iter().find(|one| one.word() == word)
            }

            /// All words, in the order in which messages list them.
            pub fn words() -> impl Iterator<Item = &'static str> + Clone {
                Self::ALL.into_iter().map(Self::word)
            }
        }

        impl std::fmt::Display for $ty {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.word())
            }
        }

        impl serde::Serialize for $ty {
            fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
                to.serialize_str(self.word())
            }
        }

        impl<'de> serde::Deserialize<'de> for $ty {
            fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                let word = <std::borrow::Cow<'de, str>>::deserialize(from)?;
                Self::from_word(&word).ok_or_else(|| $crate::word::unknown(&word, Self::words()))
            }
        }
    };
}
pub(crate) use words;

/// The error for a word of JSON that names no value.
pub(crate) fn unknown<E: serde::de::Error>(
    word: &str,
    all: impl IntoIterator<Item = &'static str>,
) -> E {
    let word = rc_diagnostics::foreign::clean(word);
    E::custom(format!("`{word}` is not one of {}", listed(all, "and")))
}

/// Words as a sentence lists them.
///
/// ```
/// assert_eq!(rc_vocabulary::listed(["a", "b", "c"], "and"), "a, b and c");
/// ```
pub fn listed(words: impl IntoIterator<Item = &'static str>, joint: &str) -> String {
    let words: Vec<&str> = words.into_iter().collect();
    match words.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} {joint} {last}", first.join(", ")),
        few => few.concat(),
    }
}
