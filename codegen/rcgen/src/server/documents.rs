//! The texts and files of an editor: open ones, folders, and changes of other programs.

use super::file_key::key;
use super::workers::component_of;
use super::{Server, place, publish_at, send};
use crate::check;
use rc_codegen::source_files::is_left_out;
use serde_json::{Value, json};
use std::io;
use std::path::Path;

/// How the protocol numbers a change of a watched file's text.
const CHANGED: i64 = 2;

impl Server {
    pub(super) fn notice(&mut self, method: &str, parameters: &Value) -> io::Result<()> {
        let document = &parameters["textDocument"];
        let uri = document["uri"].as_str().unwrap_or_default();
        match method {
            "initialized" if self.editor.watches() => send(json!({
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
                if let Some(path) = self.editor.edit(uri, changes, &document["version"]) {
                    self.changed(&path);
                }
                Ok(())
            }
            "textDocument/didClose" => self.close(uri),
            "textDocument/didSave" => {
                if let Some(path) = self.editor.at(uri).map(|open| open.path.clone()) {
                    self.changed(&path);
                }
                Ok(())
            }
            "workspace/didChangeWatchedFiles" => {
                let changes = parameters["changes"].as_array().into_iter().flatten();
                for change in changes {
                    if let Some(path) = change["uri"].as_str().and_then(place::path) {
                        self.changed(&key(&path));
                        // Not its text alone: it was created or deleted.
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

    /// A folder was created or deleted: the files that were read in it, and those that exist now,
    /// are checked.
    fn moved(&mut self, folder: &Path) {
        let moved = key(folder);
        self.folders.forget(&moved);
        self.editor.unlink(&moved, folder);
        for path in self.findings.all() {
            if path.starts_with(&moved) {
                self.changed(&path);
            }
        }
        let inside = self.editor.below_root(&moved);
        let names = inside.into_iter().flat_map(Path::components);
        let mut names = names.map(|name| name.as_os_str().to_string_lossy());
        let left_out = names.any(|name| is_left_out(&name));
        if folder.is_dir() && inside.is_some() && !left_out {
            self.folders.push(folder);
            self.settled = false;
        }
        self.check_all();
    }

    fn open(&mut self, uri: &str, path: &Path, text: &str, version: &Value) {
        let path = key(path);
        let is_new = self.findings.readers(&path).is_empty();
        self.editor.open(uri, &path);
        self.editor.edit(uri, &[json!({ "text": text })], version);
        self.changed(&path);
        // Whether it is a file of InnerModel, its text says.
        if !check::is_wanted(&path) {
            // A network may name a configuration that lies anywhere.
            let is_configuration = path.extension().is_some_and(|ending| ending == "toml");
            if component_of(&path).is_none() && !is_configuration {
                self.editor.close(uri);
                self.editor.take_from_disk(&path);
            }
        } else if is_new {
            // Others may have missed it.
            self.settled = false;
            self.check_all();
        }
    }

    fn close(&mut self, uri: &str) -> io::Result<()> {
        let Some(document) = self.editor.close(uri) else {
            return Ok(());
        };
        self.editor.take_from_disk(&document.path);
        self.changed(&document.path);
        if !document.path.exists() {
            self.check_all();
        }
        // From now on, the findings of the file have its own address.
        if uri == self.editor.address(&document.path) {
            return Ok(());
        }
        publish_at(uri, &Value::Null, &[])
    }

    /// A file has another text: it is checked next, and then what read it, open files first.
    fn changed(&mut self, path: &Path) {
        self.findings.forget(path);
        self.workers.forget(path);
        let mut readers = self.findings.readers(path);
        readers.sort_by_key(|reader| self.editor.document(reader).is_none());
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
    fn check_all(&mut self) {
        for path in self.findings.all() {
            self.waiting.push(&path);
        }
    }
}
