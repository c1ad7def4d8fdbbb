//! Puts files into the layout of their language.

use crate::languages::{LANGUAGES, Language};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceMap, Span};
use std::io;
use std::path::Path;

/// Formats one file; whether it was not in its layout. With `check`, or where the text has errors, which are added
/// to `found`, nothing is written. An error is a file that the system does not give or take.
pub fn file(
    path: &Path,
    check: bool,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<bool> {
    let Some(language) = Language::of(path) else {
        let source = sources.add(path, "");
        let endings = LANGUAGES.map(|l| format!(".{}", l.ending)).join(", ");
        let message = format!("this is none of {endings}");
        let span = Span::new(source, 0, 0);
        found.push(Diagnostic::error("unknown-language", span, message));
        return Ok(false);
    };
    let text = crate::load::read(path)?;
    let source = sources.add(path, text.clone());
    match language.format(sources, source) {
        Err(more) => {
            found.extend(more);
            Ok(false)
        }
        Ok(formatted) if formatted == text => Ok(false),
        Ok(formatted) => {
            if !check {
                rc_files::replace(path, &text, &formatted)?;
            }
            Ok(true)
        }
    }
}
