//! Formats files.

use crate::graphs;
use crate::innermodel;
use crate::languages::{LANGUAGES, Language};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use std::io;
use std::path::Path;

/// The formatted text of a file. `None` for a file without a layout.
///
/// # Errors
/// The diagnostics of a text with errors.
pub fn laid_out(
    path: &Path,
    sources: &SourceMap,
    source: SourceId,
) -> Option<Result<String, Diagnostics>> {
    if let Some(language) = Language::of(path) {
        return Some(language.format(sources, source));
    }
    if is_graph(path) {
        return Some(graphs::format(sources, source));
    }
    if is_ilk(path) {
        return Some(rc_kinematics::ilk::format(sources, source));
    }
    let formatted = is_xml(path).then(|| innermodel::format(sources, source))?;
    Some(formatted.map(|formatted| rc_syntax::with_ends_of(sources.text(source), formatted)))
}

/// Formats one file. Returns whether its text changes. Does not write the file with `check`, or if
/// the text has errors, which are added to `found`.
///
/// # Errors
/// The system cannot read or write the file.
pub fn file(
    path: &Path,
    check: bool,
    sources: &mut SourceMap,
    found: &mut Diagnostics,
) -> io::Result<bool> {
    if Language::of(path).is_none() && !is_xml(path) && !is_graph(path) && !is_ilk(path) {
        if !path.exists() {
            return Err(rc_codegen::paths::missing(path));
        }
        let source = sources.add(path, "");
        let extensions = LANGUAGES.map(|l| format!(".{}", l.extension)).join(", ");
        let message =
            format!("expected a file with one of the extensions {extensions}, .ilk, .graph, .xml");
        let span = Span::new(source, 0, 0);
        found.push(Diagnostic::error("unknown-language", span, message));
        return Ok(false);
    }
    let text = rc_files::read(path)?;
    let source = sources.add(path, text.clone());
    match laid_out(path, sources, source) {
        None => Ok(false),
        Some(Err(more)) => {
            found.extend(more);
            Ok(false)
        }
        Some(Ok(formatted)) if formatted == text => Ok(false),
        Some(Ok(formatted)) => {
            if !check {
                rc_files::replace(path, &text, &formatted)?;
            }
            Ok(true)
        }
    }
}

/// Whether `rcgen fmt` lays out a file that it finds in a folder.
pub fn is_formatted(path: &Path) -> bool {
    let is_ours = Language::of(path).is_some() || is_graph(path) || is_ilk(path);
    is_ours || is_xml(path) && innermodel::is_wanted(path)
}

fn is_graph(path: &Path) -> bool {
    path.extension() == Some("graph".as_ref())
}

fn is_ilk(path: &Path) -> bool {
    path.extension() == Some("ilk".as_ref())
}

fn is_xml(path: &Path) -> bool {
    path.extension() == Some("xml".as_ref())
}
