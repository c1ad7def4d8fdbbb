//! The explain pages as files: an editor opens the link of a finding without a network.

use super::place;
use crate::explain;
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The pages that findings have named so far.
#[derive(Debug, Default)]
pub(super) struct Explained {
    /// Folder of the pages. `None` if the editor knows no links, or there is no folder for caches.
    folder: Option<PathBuf>,
    /// The address of the page of each code. `None` if there is no page, or it cannot be written.
    known: HashMap<String, Option<String>>,
}

impl Explained {
    /// Pages for the editor that sends these parameters of `initialize`.
    pub(super) fn of(parameters: &Value) -> Self {
        let findings = &parameters["capabilities"]["textDocument"]["publishDiagnostics"];
        let shows_links = findings["codeDescriptionSupport"] == true;
        Self {
            folder: shows_links.then(folder).flatten(),
            known: HashMap::new(),
        }
    }

    /// Links a finding to the page of its code.
    pub(super) fn link(&mut self, finding: &mut Value) {
        let (Some(folder), Some(code)) = (&self.folder, finding["code"].as_str()) else {
            return;
        };
        let known = self.known.entry(code.to_owned());
        if let Some(address) = known.or_insert_with_key(|code| page(folder, code)) {
            finding["codeDescription"] = json!({ "href": address });
        }
    }
}

/// The folder for caches of the user, with a folder of this program.
fn folder() -> Option<PathBuf> {
    let of = |name: &str| std::env::var_os(name).map(PathBuf::from);
    let absolute = |path: &PathBuf| path.is_absolute();
    let caches = of("XDG_CACHE_HOME").filter(absolute);
    let caches = caches.or_else(|| Some(of("HOME").filter(absolute)?.join(".cache")))?;
    Some(caches.join("robocomp/explain"))
}

/// Writes the page of a code, unless another server has written the same one. Returns its address.
fn page(folder: &Path, code: &str) -> Option<String> {
    let page = explain::pages()
        .into_iter()
        .find(|page| page.code == code)?;
    let text = format!("# {}\n\n{}\n", page.code, page.text);
    let path = folder.join(format!("{}.md", page.code));
    if rc_files::read(&path).ok().as_ref() != Some(&text) {
        std::fs::create_dir_all(folder).ok()?;
        rc_files::write(&path, text).ok()?;
    }
    Some(place::uri(&path))
}
