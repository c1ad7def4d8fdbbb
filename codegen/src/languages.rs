//! The description languages, for code that handles all of them alike.

use rc_diagnostics::{Diagnostics, SourceId, SourceMap};
use rc_syntax::Style;
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

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

/// The files named on a command line, each once. A folder is replaced by its `wanted` files, except
/// generated, built and hidden ones.
pub fn files(paths: &[PathBuf], wanted: &dyn Fn(&Path) -> bool) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut seen = BTreeSet::new();
    for path in paths {
        if path.is_dir() {
            walk(path, wanted, &mut files)?;
        } else {
            files.push(path.clone());
        }
    }
    files.retain(|file| {
        let real = file.canonicalize().unwrap_or_else(|_| file.clone());
        seen.insert(real)
    });
    Ok(files)
}

fn walk(folder: &Path, wanted: &dyn Fn(&Path) -> bool, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let named = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", folder.display()));
    let entries = std::fs::read_dir(folder).map_err(named)?;
    let mut entries = entries.collect::<io::Result<Vec<_>>>().map_err(named)?;
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let left_out = name.starts_with('.') || name == "target" || name == "generated";
        let path = entry.path();
        // Links to folders are not followed: they could be cyclic.
        if entry.file_type().map_err(named)?.is_dir() {
            if !left_out {
                walk(&path, wanted, files)?;
            }
        // Hidden files are often backups of editors. Reading a pipe would block.
        } else if !name.starts_with('.') && wanted(&path) && path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}
