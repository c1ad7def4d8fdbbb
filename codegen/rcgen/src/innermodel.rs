//! Files of `InnerModel` among other files.

use innermodel_language::{Kind, Loader};
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

/// The disk. A file that is not where a text says is looked for by its base name in some folders.
pub struct Folders<'f> {
    /// These folders.
    pub search: &'f [PathBuf],
}

impl Loader for Folders<'_> {
    fn read(&self, path: &Path) -> io::Result<String> {
        rc_files::read(path)
    }

    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn search(&self) -> &[PathBuf] {
        self.search
    }
}

/// Whether a file of a folder is wanted: other programs have files with the ending `xml`, too.
pub(crate) fn is_wanted(path: &Path) -> bool {
    if path.extension() != Some("xml".as_ref()) {
        return true;
    }
    rc_files::read(path).is_ok_and(|text| innermodel_language::is_innermodel(&text))
}

/// Lays out a text, unless it has errors.
pub(crate) fn format(sources: &SourceMap, source: SourceId) -> Result<String, Diagnostics> {
    let found = innermodel_language::parse(sources, source);
    if found.has_errors() {
        return Err(found);
    }
    Ok(innermodel_language::format(sources.text(source)))
}

/// All that is wrong with a file and with the meshes that it names.
pub(crate) fn check(sources: &mut SourceMap, source: SourceId, search: &[PathBuf]) -> Diagnostics {
    let (document, mut found) = innermodel_language::load(sources, &Folders { search }, source);
    let mut known: BTreeMap<&Path, Option<String>> = BTreeMap::new();
    for node in &document.nodes {
        let Kind::Mesh(mesh) = &node.kind else {
            continue;
        };
        let Some(path) = &mesh.path else { continue };
        let problem = known.entry(path).or_insert_with(|| {
            let read = innermodel_mesh::read(path);
            read.err().map(|error| error.to_string())
        });
        if let Some(problem) = problem {
            let message = format!("`{}` has no body: `{}`: {problem}", node.id, mesh.file);
            found.push(Diagnostic::warning("unreadable-mesh", node.span, message));
        }
    }
    found
}
