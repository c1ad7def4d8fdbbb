//! The open texts of the editor, and its names of files.

use super::file_key::key;
use super::place::{self, Encoding, Text};
use rc_diagnostics::SourceId;
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// Size limit of an open text in bytes.
const LONGEST: usize = 16 << 20;

/// An open text.
pub(super) struct Document {
    /// The path of its file when it was opened.
    pub(super) path: PathBuf,
    pub(super) text: Text,
    pub(super) version: Value,
}

/// The editor, as it described itself, with its open texts.
#[derive(Default)]
pub(super) struct Editor {
    encoding: Encoding,
    watches: bool,
    versions: bool,
    /// Open texts, by the address that the editor has for them.
    open: BTreeMap<String, Document>,
    /// The folders that the editor opened: how the system names them, and how the editor does.
    roots: Vec<(PathBuf, PathBuf)>,
    /// Links in these folders, by the paths of the files that they lead to.
    links: BTreeMap<PathBuf, PathBuf>,
}

impl Editor {
    /// The editor that sends these parameters of `initialize`.
    pub(super) fn of(parameters: &Value) -> Self {
        let client = &parameters["capabilities"];
        let watching = &client["workspace"]["didChangeWatchedFiles"];
        let folders = parameters["workspaceFolders"].as_array();
        let folders = folders.into_iter().flatten().map(|folder| &folder["uri"]);
        let root = [&parameters["rootUri"]];
        let roots: BTreeMap<PathBuf, PathBuf> = folders
            .chain(root)
            .filter_map(|uri| place::path(uri.as_str()?))
            .map(|path| (key(&path), path))
            .collect();
        Self {
            encoding: Encoding::of(&client["general"]["positionEncodings"]),
            watches: watching["dynamicRegistration"] == true,
            versions: client["workspace"]["workspaceEdit"]["documentChanges"] == true,
            roots: roots.into_iter().collect(),
            ..Self::default()
        }
    }

    /// The unit of its columns.
    pub(super) fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Whether it watches files, if it is asked to.
    pub(super) fn watches(&self) -> bool {
        self.watches
    }

    /// Whether it compares the version of a text with that of its edits.
    pub(super) fn compares_versions(&self) -> bool {
        self.versions
    }

    /// The folders that it opened, as it names them.
    pub(super) fn folders(&self) -> impl Iterator<Item = &Path> {
        self.roots.iter().map(|(_, given)| given.as_path())
    }

    /// The open text at an address.
    pub(super) fn at(&self, uri: &str) -> Option<&Document> {
        self.open.get(uri)
    }

    /// The open text of a file.
    pub(super) fn document(&self, path: &Path) -> Option<&Document> {
        let mut open = self.open.values();
        open.find(|document| document.path == path)
    }

    /// The addresses at which a file is open, each with its version.
    pub(super) fn open_as(&self, path: &Path) -> impl Iterator<Item = (&str, &Value)> {
        let open = self.open.iter().filter(move |(_, one)| one.path == path);
        open.map(|(uri, document)| (uri.as_str(), &document.version))
    }

    /// Opens a text, which is empty until it is edited.
    pub(super) fn open(&mut self, uri: &str, path: &Path) {
        let document = Document {
            path: path.to_path_buf(),
            text: Text::default(),
            version: Value::Null,
        };
        self.open.insert(uri.to_owned(), document);
    }

    /// Closes a text.
    pub(super) fn close(&mut self, uri: &str) -> Option<Document> {
        self.open.remove(uri)
    }

    /// Makes the changes of an open text, one after another: of a range, or of all of it. Returns
    /// its file.
    pub(super) fn edit(
        &mut self,
        uri: &str,
        changes: &[Value],
        version: &Value,
    ) -> Option<PathBuf> {
        let document = self.open.get_mut(uri)?;
        for change in changes {
            let Some(new) = change["text"].as_str() else {
                continue;
            };
            let range = document.text.bytes(self.encoding, &change["range"]);
            // An incomplete range is invalid, not a request to replace the whole text.
            if range.is_none() && !change["range"].is_null() {
                continue;
            }
            let text = match range {
                Some((start, end)) => {
                    let old = document.text.as_str();
                    let text = [&old[..start], new, &old[end..]].concat();
                    // A client cannot make the server allocate memory without a limit.
                    if text.len() > LONGEST {
                        old.to_owned()
                    } else {
                        text
                    }
                }
                None => new.to_owned(),
            };
            // Drops a byte order mark: texts of checks have none, and an edit of the whole text must not
            // count it.
            document.text = Text::new(text);
        }
        document.version = version.clone();
        rc_files::unsaved::set(&document.path, document.text.as_str());
        Some(document.path.clone())
    }

    /// The text of a file is that of another address, or the one on disk.
    pub(super) fn take_from_disk(&self, path: &Path) {
        let other = self.open.values().find(|open| open.path == path);
        match other {
            Some(other) => rc_files::unsaved::set(path, other.text.as_str()),
            None => rc_files::unsaved::remove(path),
        }
    }

    /// The path of a file below the folder that contains it. `None`: the editor opened no such folder.
    pub(super) fn below_root<'p>(&self, path: &'p Path) -> Option<&'p Path> {
        let mut roots = self.roots.iter();
        roots.find_map(|(root, _)| path.strip_prefix(root).ok())
    }

    /// A link in the folders leads to a file with another path. The first one counts.
    pub(super) fn link(&mut self, path: &Path, link: &Path) {
        if self.address_in_roots(path) != link {
            let links = &mut self.links;
            links
                .entry(path.to_path_buf())
                .or_insert(link.to_path_buf());
        }
    }

    /// Forgets links into a folder, or in it.
    pub(super) fn unlink(&mut self, real: &Path, given: &Path) {
        self.links
            .retain(|path, link| !path.starts_with(real) && !link.starts_with(given));
    }

    /// The address of a file for the editor: that of its open text, or where it is in the folders that
    /// the editor opened.
    pub(super) fn address(&self, path: &Path) -> String {
        let mut open = self.open.iter();
        if let Some((uri, _)) = open.find(|(_, document)| document.path == path) {
            return uri.clone();
        }
        match self.links.get(path) {
            Some(link) => place::uri(link),
            None => place::uri(&self.address_in_roots(path)),
        }
    }

    /// The files of sources, each with its address.
    pub(super) fn addressed(
        &self,
        keys: &HashMap<SourceId, PathBuf>,
    ) -> HashMap<SourceId, (PathBuf, String)> {
        let files = keys.iter();
        files
            .map(|(id, path)| (*id, (path.clone(), self.address(path))))
            .collect()
    }

    /// The path of a file below a folder as the editor named the folder.
    fn address_in_roots(&self, path: &Path) -> PathBuf {
        let below = self.roots.iter().find_map(|(real, given)| {
            let rest = path.strip_prefix(real).ok()?;
            Some(given.join(rest))
        });
        below.unwrap_or_else(|| path.to_path_buf())
    }

    /// The range of bytes of a text, as the protocol has it.
    pub(super) fn range(&self, text: &Text, start: usize, end: usize) -> Value {
        text.range(self.encoding, start, end)
    }

    /// A range of a file with its address.
    pub(super) fn location(&self, path: &Path, text: &Text, start: usize, end: usize) -> Value {
        json!({ "uri": self.address(path), "range": self.range(text, start, end) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_text_has_the_address_of_the_editor() {
        let folder = tempfile::tempdir().expect("a folder");
        let given = folder.path().join("given");
        std::fs::create_dir(folder.path().join("real")).expect("a folder");
        std::os::unix::fs::symlink("real", &given).expect("a link");
        let parameters = json!({ "rootUri": place::uri(&given) });
        let mut editor = Editor::of(&parameters);
        let (path, elsewhere) = (key(&given.join("a.cdsl")), Path::new("/elsewhere/a.cdsl"));
        assert_eq!(editor.below_root(&path), Some(Path::new("a.cdsl")));
        assert_eq!(editor.below_root(elsewhere), None);
        assert_eq!(editor.address(&path), place::uri(&given.join("a.cdsl")));
        let uri = "file:///another/name.cdsl";
        editor.open(uri, &path);
        assert_eq!(editor.address(&path), uri);
        let range = json!({
            "start": { "line": 0, "character": 1 },
            "end": { "line": 0, "character": 2 },
        });
        let changes = [
            json!({ "text": "abc" }),
            json!({ "text": "x", "range": range }),
        ];
        assert_eq!(editor.edit(uri, &changes, &json!(7)), Some(path.clone()));
        let text = |editor: &Editor| {
            editor
                .document(&path)
                .map(|one| one.text.as_str().to_owned())
        };
        assert_eq!(text(&editor).as_deref(), Some("axc"));
        let open: Vec<_> = editor.open_as(&path).collect();
        assert_eq!(open, [(uri, &json!(7))]);
        editor.close(uri);
        editor.take_from_disk(&path);
        assert_eq!(
            (text(&editor), editor.edit(uri, &changes, &json!(8))),
            (None, None)
        );
    }
}
