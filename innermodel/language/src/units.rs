//! The unit of the lengths in a file.

use rc_diagnostics::Name;
use rc_xml::XmlSource;
use roxmltree::Node;

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

    /// The unit that a file has of its own. The error is a word that names none.
    pub(crate) fn of(text: XmlSource<'_>, root: Node<'_, '_>) -> Result<Option<Self>, Name> {
        let Some(value) = text.attribute(root, "units") else {
            return Ok(None);
        };
        let known = Self::WORDS.iter().find(|(word, _)| *word == value.text);
        known.map(|(_, units)| Some(*units)).ok_or(value)
    }

    /// A length in millimetres.
    pub(crate) fn length(self, written: f64) -> f64 {
        match self {
            Self::Millimetres => written,
            Self::Metres => written * 1000.0,
        }
    }
}
