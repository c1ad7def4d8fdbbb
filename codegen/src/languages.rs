//! The languages, for what treats all of them alike.

use rc_diagnostics::{Diagnostics, SourceId, SourceMap};
use rc_syntax::Style;
use std::io;
use std::path::{Path, PathBuf};

/// One language of description files.
#[derive(Clone, Copy, Debug)]
pub struct Language {
    /// The ending of its files, without the dot.
    pub ending: &'static str,
    /// The layout of its texts.
    pub style: Style,
    /// What is wrong with one text, looked at alone.
    pub parse: fn(&SourceMap, SourceId) -> Diagnostics,
}

/// All of them.
pub const LANGUAGES: [Language; 5] = [
    Language {
        ending: "idsl",
        style: rc_idsl::STYLE,
        parse: |sources, source| rc_idsl::parse(sources, source).1,
    },
    Language {
        ending: "cdsl",
        style: rc_cdsl::STYLE,
        parse: |sources, source| rc_cdsl::parse(sources, source).1,
    },
    Language {
        ending: "pdsl",
        style: rc_pdsl::STYLE,
        parse: |sources, source| rc_pdsl::parse(sources, source).1,
    },
    Language {
        ending: "smdsl",
        style: rc_smdsl::STYLE,
        parse: |sources, source| rc_smdsl::parse(sources, source).1,
    },
    Language {
        ending: "ddsl",
        style: rc_ddsl::STYLE,
        parse: |sources, source| rc_ddsl::parse(sources, source).1,
    },
];

impl Language {
    /// The language of a file, by its ending.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension().and_then(|e| e.to_str())?;
        LANGUAGES.into_iter().find(|l| l.ending == ending)
    }

    /// The text in our layout, or what is wrong with it.
    pub fn format(self, sources: &SourceMap, source: SourceId) -> Result<String, Diagnostics> {
        let found = (self.parse)(sources, source);
        if found.has_errors() {
            return Err(found);
        }
        Ok(rc_syntax::format(sources.text(source), self.style))
    }
}

/// The files that a command line names: files as they are, folders as the files in them that are wanted, but not
/// what is generated, built or hidden.
pub fn files(paths: &[PathBuf], wanted: &dyn Fn(&Path) -> bool) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            walk(path, wanted, &mut files)?;
        } else {
            files.push(path.clone());
        }
    }
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
        // A link to a folder is not followed: it could lead in a circle.
        if entry.file_type().map_err(named)?.is_dir() {
            if !left_out {
                walk(&path, wanted, files)?;
            }
        // Editors leave hidden files beside those that they hold; a pipe would be waited for.
        } else if !name.starts_with('.') && wanted(&path) && path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}
