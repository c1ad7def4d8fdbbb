//! The texts and files that an editor tells of: open ones, folders, and what other programs change.

use super::place::{self, Text};
use super::{Document, Server, key, navigation, publish_at, send};
use crate::check;
use rc_codegen::source_files::is_left_out;
use serde_json::{Value, json};
use std::io;
use std::path::Path;

/// How many files of the folders that an editor opens are checked without being asked for.
const MOST_FILES: usize = 2_000;

/// How many bytes an open text has at most.
const LONGEST: usize = 16 << 20;

/// How the protocol numbers a change of a watched file's text.
const CHANGED: i64 = 2;

impl Server {
    pub(super) fn notice(&mut self, method: &str, parameters: &Value) -> io::Result<()> {
        let document = &parameters["textDocument"];
        let uri = document["uri"].as_str().unwrap_or_default();
        match method {
            "initialized" if self.watches => send(json!({
                "id": "watch",
                "method": "client/registerCapability",
                "params": { "registrations": [{
                    "id": "watch",
                    "method": "workspace/didChangeWatchedFiles",
                    "registerOptions": { "watchers": [{
                        "globPattern": format!("**/*.{{{}}}", check::ENDINGS.join(",")),
                    }] },
                }] },
            })),
            "textDocument/didOpen" => {
                if let (Some(path), Some(text)) = (place::path(uri), document["text"].as_str()) {
                    self.open(uri, &path, text, &document["version"]);
                }
                Ok(())
            }
            "textDocument/didChange" => {
                let changes = parameters["contentChanges"].as_array();
                let changes = changes.map_or(&[][..], Vec::as_slice);
                self.edit(uri, changes, &document["version"]);
                Ok(())
            }
            "textDocument/didClose" => self.close(uri),
            "textDocument/didSave" => {
                if let Some(path) = self.open.get(uri).map(|open| open.path.clone()) {
                    self.changed(&path);
                }
                Ok(())
            }
            "workspace/didChangeWatchedFiles" => {
                let changes = parameters["changes"].as_array().into_iter().flatten();
                for change in changes {
                    if let Some(path) = change["uri"].as_str().and_then(place::path) {
                        self.changed(&key(&path));
                        // Not its text alone: it has come or gone.
                        if change["type"] != CHANGED {
                            self.check_all();
                        }
                    }
                }
                Ok(())
            }
            "workspace/didCreateFiles"
            | "workspace/didRenameFiles"
            | "workspace/didDeleteFiles" => {
                for file in parameters["files"].as_array().into_iter().flatten() {
                    let paths = ["uri", "oldUri", "newUri"].map(|name| &file[name]);
                    let paths = paths.into_iter().filter_map(Value::as_str);
                    for path in paths.filter_map(place::path) {
                        self.moved(&path);
                    }
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// A folder has come or gone: what was read in it, and what is there now, is checked.
    fn moved(&mut self, folder: &Path) {
        let moved = key(folder);
        self.found.retain(|path| !path.starts_with(&moved));
        self.links
            .retain(|path, link| !path.starts_with(&moved) && !link.starts_with(folder));
        for path in self.findings.all() {
            if path.starts_with(&moved) {
                self.changed(&path);
            }
        }
        let inside = self
            .roots
            .iter()
            .find_map(|(root, _)| moved.strip_prefix(root).ok());
        let names = inside.into_iter().flat_map(Path::components);
        let mut names = names.map(|name| name.as_os_str().to_string_lossy());
        let left_out = names.any(|name| name.starts_with('.') || is_left_out(&name));
        if folder.is_dir() && inside.is_some() && !left_out {
            self.folders.push_back(folder.to_path_buf());
            self.settled = false;
        }
        self.check_all();
    }

    fn open(&mut self, uri: &str, path: &Path, text: &str, version: &Value) {
        let path = key(path);
        let is_new = self.findings.readers(&path).is_empty();
        let document = Document {
            path: path.clone(),
            text: Text::default(),
            version: Value::Null,
        };
        self.open.insert(uri.to_owned(), document);
        self.edit(uri, &[json!({ "text": text })], version);
        // Whether it is a file of InnerModel, its text says.
        if !check::is_wanted(&path) {
            if navigation::component_of(&path).is_none() {
                self.open.remove(uri);
                self.take_from_disk(&path);
            }
        } else if is_new {
            // Others may have missed it.
            self.settled = false;
            self.check_all();
        }
    }

    /// Makes the changes of an open text, one after another: of a range, or of all of it.
    fn edit(&mut self, uri: &str, changes: &[Value], version: &Value) {
        let Some(document) = self.open.get_mut(uri) else {
            return;
        };
        for change in changes {
            let Some(new) = change["text"].as_str() else {
                continue;
            };
            let range = document.text.bytes(self.encoding, &change["range"]);
            // A range without numbers is none, and no wish to replace the whole text.
            if range.is_none() && !change["range"].is_null() {
                continue;
            }
            let text = match range {
                Some((start, end)) => {
                    let old = document.text.as_str();
                    let text = [&old[..start], new, &old[end..]].concat();
                    // A client without a limit gets no memory without one.
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
        let path = document.path.clone();
        rc_files::unsaved::set(&path, document.text.as_str());
        self.changed(&path);
    }

    fn close(&mut self, uri: &str) -> io::Result<()> {
        let Some(document) = self.open.remove(uri) else {
            return Ok(());
        };
        self.take_from_disk(&document.path);
        self.changed(&document.path);
        if !document.path.exists() {
            self.check_all();
        }
        // From now on, the findings of the file have its own address.
        if uri == self.address(&document.path) {
            return Ok(());
        }
        publish_at(uri, &Value::Null, &[])
    }

    /// The text of a file is that of another address, or the one on disk.
    pub(super) fn take_from_disk(&mut self, path: &Path) {
        let other = self.open.values().find(|open| open.path == path);
        match other {
            Some(other) => rc_files::unsaved::set(path, other.text.as_str()),
            None => rc_files::unsaved::remove(path),
        }
    }

    fn is_open(&self, path: &Path) -> bool {
        self.open.values().any(|open| open.path == path)
    }

    /// A file has another text: it is checked next, and then what read it, open files first.
    fn changed(&mut self, path: &Path) {
        self.findings.forget(path);
        self.workers.retain(|_, worker| !worker.has_read(path));
        let mut readers = self.findings.readers(path);
        readers.sort_by_key(|reader| !self.is_open(reader));
        let is_checked = readers.iter().any(|reader| reader == path);
        if is_checked || check::is_wanted(path) {
            readers.retain(|reader| reader != path);
            readers.insert(0, path.to_path_buf());
            self.dirty.insert(path.to_path_buf());
        }
        for reader in readers.iter().rev() {
            self.waiting.push_front(reader);
        }
    }

    /// All files are checked again, after those that wait.
    pub(super) fn check_all(&mut self) {
        for path in self.findings.all() {
            self.waiting.push(&path);
        }
    }

    /// Finds the description files of a folder, as `rcgen check` does. What cannot be read is left out.
    pub(super) fn look_into(&mut self, folder: &Path) {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut entries: Vec<_> = entries.collect();
        entries.sort_by_key(std::fs::DirEntry::file_name);
        for entry in entries {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let left_out = name.starts_with('.') || is_folder && is_left_out(&name);
            if left_out || self.found.len() >= MOST_FILES {
                continue;
            }
            if is_folder {
                if self.folders.len() < MOST_FILES {
                    self.folders.push_back(entry.path());
                }
            } else if entry.path().is_file() && check::is_wanted(&entry.path()) {
                let path = key(&entry.path());
                self.found.insert(path.clone());
                if self.address_in_roots(&path) != entry.path() {
                    self.links.entry(path.clone()).or_insert(entry.path());
                }
                self.waiting.push(&path);
            }
        }
    }
}
