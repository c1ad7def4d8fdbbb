//! Tests of the language.

#![expect(
    clippy::needless_raw_string_hashes,
    reason = "`expect_test` writes them"
)]

mod findings;
mod layout;
mod loading;
mod random;
mod real_files;
mod rewriting;

use innermodel_language::{Document, Loader, load};
use rc_diagnostics::{Diagnostics, Format, SourceMap, render};
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

/// Texts by their paths.
#[derive(Default)]
struct Texts {
    texts: HashMap<PathBuf, String>,
    search: Vec<PathBuf>,
}

impl Texts {
    fn of(texts: &[(&str, &str)]) -> Self {
        let texts = texts
            .iter()
            .map(|(path, text)| (path.into(), (*text).to_owned()));
        Self {
            texts: texts.collect(),
            search: Vec::new(),
        }
    }
}

impl Loader for Texts {
    fn read(&self, path: &Path) -> io::Result<String> {
        let text = self.texts.get(path).cloned();
        text.ok_or_else(|| io::ErrorKind::NotFound.into())
    }

    fn is_file(&self, path: &Path) -> bool {
        self.texts.contains_key(path)
    }

    fn search(&self) -> &[PathBuf] {
        &self.search
    }
}

/// Files of the disk.
struct Disk;

impl Loader for Disk {
    fn read(&self, path: &Path) -> io::Result<String> {
        rc_files::read(path)
    }

    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn search(&self) -> &[PathBuf] {
        &[]
    }
}

/// Loads a text of a loader, and renders what was found.
fn loaded(loader: &dyn Loader, path: &Path, text: &str) -> (Document, Diagnostics, String) {
    let mut sources = SourceMap::new();
    let source = sources.add(path, text);
    let (document, found) = load(&mut sources, loader, source);
    let output = render(&sources, &found, Format::Short);
    (document, found, output)
}

/// Loads a text without errors.
fn right(text: &str) -> Document {
    let (document, found, output) = loaded(&Texts::default(), Path::new("world.xml"), text);
    assert!(!found.has_errors(), "{output}");
    document
}

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let files = std::fs::read_dir(folder).expect("the folder of scenes");
    let files = files.map(|entry| entry.expect("an entry").path());
    let mut files: Vec<PathBuf> = files
        .filter(|p| p.extension() == Some("xml".as_ref()))
        .collect();
    files.sort();
    files
}
