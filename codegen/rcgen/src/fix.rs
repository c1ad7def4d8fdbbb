//! Applies the fixes of findings to files.

use rc_diagnostics::{Diagnostics, Edit, SourceMap, fix};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// Which fixes are applied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FixSelection {
    /// Those of which only one is right.
    Certain,
    /// Near names, too.
    Likely,
}

/// A change that was made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The file.
    pub file: PathBuf,
    /// Its line, from 1.
    pub line: usize,
    /// Its column in characters, from 1.
    pub column: usize,
    /// The old text.
    pub old: String,
    /// The new text.
    pub new: String,
}

/// Applies the fixes of `found` in the files that were read. Returns the changes, and the errors of
/// the system, by file. Files that are not description files, and those that have changed since
/// they were read, stay as they are.
pub fn files(
    sources: &SourceMap,
    found: &Diagnostics,
    which: FixSelection,
) -> (Vec<Change>, Vec<(PathBuf, io::Error)>) {
    let (mut changes, mut refused) = (Vec::new(), Vec::new());
    let mut seen = BTreeSet::new();
    for source in sources.ids() {
        let edits = fix::edits(sources, found, source, which == FixSelection::Likely);
        let path = sources.path(source);
        if edits.is_empty() || !crate::check::is_known(path) {
            continue;
        }
        // A text inside `rcgen` has no file.
        let Ok(real) = path.canonicalize() else {
            continue;
        };
        if !seen.insert(real.clone()) {
            continue;
        }
        match write(&real, sources.text(source), &edits) {
            Err(error) => refused.push((path.to_path_buf(), error)),
            Ok(false) => {}
            Ok(true) => changes.extend(edits.into_iter().map(|edit| {
                let at = sources.position(source, edit.span.start);
                let text = sources.text(source);
                Change {
                    file: path.to_path_buf(),
                    line: at.line,
                    column: at.column,
                    old: text[edit.span.start..edit.span.end].to_owned(),
                    new: edit.text,
                }
            })),
        }
    }
    (changes, refused)
}

/// Writes a file with edits, if its content is still `text`. Returns whether it is.
fn write(file: &Path, text: &str, edits: &[Edit]) -> io::Result<bool> {
    let Some(before) = unchanged(file, text)? else {
        return Ok(false);
    };
    let mark = &before[..before.len() - text.len()];
    let after = format!("{mark}{}", fix::edited(text, edits));
    rc_files::replace(file, &before, &after)?;
    Ok(true)
}

/// The content of a file, if it is still `text`, with or without a byte order mark.
fn unchanged(file: &Path, text: &str) -> io::Result<Option<String>> {
    let now = rc_files::read(file)?;
    let same = now.strip_prefix('\u{feff}').unwrap_or(&now) == text;
    Ok(same.then_some(now))
}

/// How many findings can be fixed: certainly, and by a suggestion.
pub fn count(sources: &SourceMap, found: &Diagnostics) -> (usize, usize) {
    let mut counts = (0, 0);
    for diagnostic in found.iter() {
        let fix = diagnostic.fix.as_ref();
        let known = crate::check::is_known(sources.path(diagnostic.span.source));
        match fix.filter(|fix| known && fix.edit(sources, diagnostic.span).is_some()) {
            Some(fix) if fix.certain => counts.0 += 1,
            Some(_) => counts.1 += 1,
            None => {}
        }
    }
    counts
}
