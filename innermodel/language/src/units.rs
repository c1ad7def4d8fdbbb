//! The unit of the lengths in a file.

/// The unit of the lengths in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Units {
    Millimetres,
    Metres,
}

impl Units {
    /// The words of a file.
    pub(crate) const WORDS: [(&'static str, Self); 2] =
        [("millimetres", Self::Millimetres), ("metres", Self::Metres)];

    /// A length in millimetres.
    pub(crate) fn length(self, written: f64) -> f64 {
        match self {
            Self::Millimetres => written,
            Self::Metres => written * 1000.0,
        }
    }
}
