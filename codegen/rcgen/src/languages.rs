//! The description languages, for code that handles all of them alike.

use rc_diagnostics::{Diagnostics, SourceId, SourceMap};
use std::path::Path;

/// A description language.
#[derive(Clone, Copy, Debug)]
pub struct Language {
    /// The extension of its files, without the dot.
    pub extension: &'static str,
    /// Prints one text in the style of its language.
    pub print: fn(&str) -> String,
    /// Parses one text and returns its diagnostics.
    pub parse: fn(&SourceMap, SourceId) -> Diagnostics,
}

/// All description languages.
pub const LANGUAGES: [Language; 8] = [
    Language {
        extension: "idsl",
        print: |text| rc_syntax::format(text, rc_idsl::STYLE),
        parse: |sources, source| rc_idsl::parse(sources, source).1,
    },
    Language {
        extension: "cdsl",
        print: |text| rc_syntax::format(text, rc_cdsl::STYLE),
        parse: |sources, source| rc_cdsl::parse(sources, source).1,
    },
    Language {
        extension: "pdsl",
        print: |text| rc_syntax::format(text, rc_pdsl::STYLE),
        parse: |sources, source| rc_pdsl::parse(sources, source).1,
    },
    Language {
        extension: "smdsl",
        print: |text| rc_syntax::format(text, rc_smdsl::STYLE),
        parse: |sources, source| rc_smdsl::parse(sources, source).1,
    },
    Language {
        extension: "ddsl",
        print: |text| rc_syntax::format(text, rc_ddsl::STYLE),
        parse: |sources, source| rc_ddsl::parse(sources, source).1,
    },
    Language {
        extension: "gdsl",
        print: |text| rc_syntax::format(text, graph_language::STYLE),
        parse: |sources, source| graph_language::parse(sources, source).1,
    },
    Language {
        extension: "dproto",
        print: rc_prototypes::format,
        parse: |sources, source| rc_prototypes::parse(sources, source).1,
    },
    Language {
        extension: "kdsl",
        print: |text| rc_syntax::format(text, rc_kinematics::STYLE),
        parse: |sources, source| rc_kinematics::parse(sources, source).1,
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
        Ok((self.print)(sources.text(source)))
    }
}
