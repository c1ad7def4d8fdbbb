//! The description languages, for code that handles all of them alike.

use rc_diagnostics::{Diagnostics, SourceId, SourceMap};
use rc_syntax::Style;
use std::path::Path;

/// A description language.
#[derive(Clone, Copy, Debug)]
pub struct Language {
    /// The extension of its files, without the dot.
    pub extension: &'static str,
    /// The formatting options.
    pub style: Style,
    /// Parses one text and returns its diagnostics.
    pub parse: fn(&SourceMap, SourceId) -> Diagnostics,
}

/// All description languages.
pub const LANGUAGES: [Language; 6] = [
    Language {
        extension: "idsl",
        style: rc_idsl::STYLE,
        parse: |sources, source| rc_idsl::parse(sources, source).1,
    },
    Language {
        extension: "cdsl",
        style: rc_cdsl::STYLE,
        parse: |sources, source| rc_cdsl::parse(sources, source).1,
    },
    Language {
        extension: "pdsl",
        style: rc_pdsl::STYLE,
        parse: |sources, source| rc_pdsl::parse(sources, source).1,
    },
    Language {
        extension: "smdsl",
        style: rc_smdsl::STYLE,
        parse: |sources, source| rc_smdsl::parse(sources, source).1,
    },
    Language {
        extension: "ddsl",
        style: rc_ddsl::STYLE,
        parse: |sources, source| rc_ddsl::parse(sources, source).1,
    },
    Language {
        extension: "gdsl",
        style: graph_language::STYLE,
        parse: |sources, source| graph_language::parse(sources, source).1,
    },
];

impl Language {
    /// The language of a file, by its extension.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension().and_then(|e| e.to_str())?;
        LANGUAGES.into_iter().find(|l| l.extension == extension)
    }

    /// Formats a text.
    ///
    /// # Errors
    /// The diagnostics of a text with errors.
    pub fn format(self, sources: &SourceMap, source: SourceId) -> Result<String, Diagnostics> {
        let found = (self.parse)(sources, source);
        if found.has_errors() {
            return Err(found);
        }
        Ok(rc_syntax::format(sources.text(source), self.style))
    }
}
