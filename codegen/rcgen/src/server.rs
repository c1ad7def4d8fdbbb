//! The language server: `rcgen lsp`, over standard input and output.
//!
//! An editor sees what `rcgen check` and `rcgen fmt` say: [`crate::check`] reads each file through
//! [`rc_files::unsaved`], which holds the texts that are open. A change checks its file first, then
//! each file that read it; a further message goes first. What a request needs is checked before it
//! is answered, so no edit has a place of an earlier text.

mod completion;
mod context;
mod findings;
mod names;
mod navigation;
mod place;
mod queue;
mod wire;

use crate::format::laid_out;
use crate::{check, explain};
use findings::{Findings, Place};
use names::Names;
use place::Encoding;
use queue::Queue;
use rc_codegen::FileLoader;
use rc_codegen::source_files::is_left_out;
use rc_diagnostics::{Diagnostics, SourceId, SourceMap};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

/// How many files of the folders that an editor opens are checked without being asked for.
const MOST_FILES: usize = 2_000;

/// How many messages wait; each has a limit.
const MESSAGES: usize = 4;

/// After how many messages a file is checked, although further ones wait.
const MESSAGES_BETWEEN: usize = 32;

/// The requests that are answered.
const REQUESTS: [&str; 8] = [
    "textDocument/completion",
    "textDocument/formatting",
    "textDocument/codeAction",
    "textDocument/hover",
    "textDocument/definition",
    "textDocument/implementation",
    "textDocument/references",
    "textDocument/documentHighlight",
];

/// Those that are about all files.
const OF_ALL_FILES: [&str; 3] = [
    "textDocument/definition",
    "textDocument/implementation",
    "textDocument/references",
];

/// How the protocol numbers a change of a watched file's text.
const CHANGED: i64 = 2;

/// Codes of errors, as the protocol numbers them.
const PARSE_ERROR: i64 = -32700;
const METHOD_NOT_FOUND: i64 = -32601;
const NOT_INITIALIZED: i64 = -32002;
const INVALID_REQUEST: i64 = -32600;

/// Serves an editor until it says `exit` or closes the input. Returns whether it said
/// `shutdown` before.
///
/// # Errors
/// The input is none of the protocol, or the output is closed.
pub fn run(include: &[PathBuf]) -> io::Result<bool> {
    let (sender, messages) = sync_channel(MESSAGES);
    // The thread ends with the process: nothing can interrupt a read.
    std::thread::spawn(move || {
        let mut input = BufReader::new(io::stdin());
        loop {
            let message = wire::read(&mut input).transpose();
            let is_last = !matches!(message, Some(Ok(_)));
            let Some(message) = message else { return };
            if sender.send(message).is_err() || is_last {
                return;
            }
        }
    });
    let mut server = Server {
        include: include.to_vec(),
        ..Server::default()
    };
    let ended = server.serve(&messages);
    rc_files::unsaved::clear();
    ended
}

/// Where the conversation is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stage {
    #[default]
    New,
    Initialized,
    ShutDown,
}

/// An open text.
struct Document {
    /// The path of its file when it was opened.
    path: PathBuf,
    text: String,
    version: Value,
}

#[derive(Default)]
struct Server {
    stage: Stage,
    include: Vec<PathBuf>,
    encoding: Encoding,
    /// Whether the editor watches files, if it is asked to.
    watches: bool,
    /// Open texts, by the address that the editor has for them.
    open: BTreeMap<String, Document>,
    findings: Findings,
    /// The names of all checked files.
    names: BTreeMap<PathBuf, Names>,
    /// Those that a file had when it could be read, where it cannot be read now.
    last: BTreeMap<PathBuf, Names>,
    /// Those of other files, for the time of one request.
    elsewhere: BTreeMap<PathBuf, Names>,
    /// Files to check.
    waiting: Queue,
    /// Those of them whose own text has changed.
    dirty: BTreeSet<PathBuf>,
    /// The folders that the editor opened: how the system names them, and how the editor does.
    roots: Vec<(PathBuf, PathBuf)>,
    /// Whether all files of the folders were checked once.
    settled: bool,
    /// How a link in these folders names a file, where it has another path.
    links: BTreeMap<PathBuf, PathBuf>,
    /// Folders in which files to check are looked for, and how many files were found.
    folders: VecDeque<PathBuf>,
    files: usize,
}

impl Server {
    fn serve(
        &mut self,
        messages: &Receiver<io::Result<Result<Value, String>>>,
    ) -> io::Result<bool> {
        let mut taken = 0;
        loop {
            let busy = !self.waiting.is_empty() || !self.folders.is_empty();
            self.settled |= !busy;
            let message = if !busy {
                messages.recv().ok()
            } else if taken >= MESSAGES_BETWEEN {
                // A client that never stops to write gets its findings, too.
                taken = 0;
                self.work()?;
                continue;
            } else {
                match messages.try_recv() {
                    Ok(message) => Some(message),
                    Err(TryRecvError::Disconnected) => None,
                    Err(TryRecvError::Empty) => {
                        taken = 0;
                        self.work()?;
                        continue;
                    }
                }
            };
            taken += 1;
            let Some(message) = message.transpose()? else {
                return Ok(false);
            };
            let message = match message {
                Ok(message) => message,
                Err(reason) => {
                    let error = json!({ "code": PARSE_ERROR, "message": reason });
                    send(json!({ "id": null, "error": error }))?;
                    continue;
                }
            };
            if message["method"] == "exit" {
                return Ok(self.stage == Stage::ShutDown);
            }
            self.take(&message)?;
        }
    }

    fn take(&mut self, message: &Value) -> io::Result<()> {
        // An answer to a request of this server, which needs none.
        let Some(method) = message["method"].as_str() else {
            return Ok(());
        };
        let parameters = &message["params"];
        let Some(id) = message.get("id") else {
            return match self.stage {
                Stage::Initialized => self.notice(method, parameters),
                Stage::New | Stage::ShutDown => Ok(()),
            };
        };
        let answer = match (self.stage, method) {
            (Stage::New, "initialize") => Ok(self.initialize(parameters)),
            (Stage::New, _) => Err((NOT_INITIALIZED, "initialize comes first".to_owned())),
            (Stage::Initialized, "initialize") => {
                Err((INVALID_REQUEST, "the server is initialized".to_owned()))
            }
            (Stage::Initialized, "shutdown") => {
                self.stage = Stage::ShutDown;
                self.waiting.clear();
                self.dirty.clear();
                self.folders.clear();
                Ok(Value::Null)
            }
            (Stage::Initialized, _) => self.request(method, parameters)?,
            (Stage::ShutDown, _) => Err((INVALID_REQUEST, "the server was shut down".to_owned())),
        };
        send(match answer {
            Ok(result) => json!({ "id": id, "result": result }),
            Err((code, message)) => {
                json!({ "id": id, "error": { "code": code, "message": message } })
            }
        })
    }

    fn initialize(&mut self, parameters: &Value) -> Value {
        self.stage = Stage::Initialized;
        let client = &parameters["capabilities"];
        self.encoding = Encoding::of(&client["general"]["positionEncodings"]);
        let watching = &client["workspace"]["didChangeWatchedFiles"];
        self.watches = watching["dynamicRegistration"] == true;
        let folders = parameters["workspaceFolders"].as_array();
        let folders = folders.into_iter().flatten().map(|folder| &folder["uri"]);
        let root = [&parameters["rootUri"]];
        let roots = folders.chain(root);
        let roots: BTreeMap<PathBuf, PathBuf> = roots
            .filter_map(|uri| place::path(uri.as_str()?))
            .map(|path| (key(&path), path))
            .collect();
        self.folders = roots.values().cloned().collect();
        self.roots = roots.into_iter().collect();
        self.settled = false;
        // Of a folder that comes, moves or goes, a watcher of files hears nothing.
        let folders_only = json!({ "filters": [
            { "scheme": "file", "pattern": { "glob": "**/*", "matches": "folder" } },
        ] });
        json!({
            "capabilities": {
                "positionEncoding": self.encoding.word(),
                "textDocumentSync": { "openClose": true, "change": 1, "save": true },
                "documentFormattingProvider": true,
                "codeActionProvider": { "codeActionKinds": ["quickfix", "source.fixAll"] },
                "hoverProvider": true,
                "completionProvider": { "triggerCharacters": [".", "\"", ":", "@", "/"] },
                "definitionProvider": true,
                "implementationProvider": true,
                "referencesProvider": true,
                "documentHighlightProvider": true,
                "workspace": { "fileOperations": {
                    "didCreate": folders_only,
                    "didRename": folders_only,
                    "didDelete": folders_only,
                } },
            },
            "serverInfo": { "name": "rcgen", "version": env!("CARGO_PKG_VERSION") },
        })
    }

    fn notice(&mut self, method: &str, parameters: &Value) -> io::Result<()> {
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
                // Each change has the whole text: this server offers nothing else.
                let changes = parameters["contentChanges"].as_array();
                let last = changes.and_then(|all| all.last());
                if let Some(text) = last.and_then(|change| change["text"].as_str()) {
                    self.edit(uri, text, &document["version"]);
                }
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
        let gone = key(folder);
        for path in self.findings.all() {
            if path.starts_with(&gone) {
                self.changed(&path);
            }
        }
        if folder.is_dir() {
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
            text: String::new(),
            version: Value::Null,
        };
        self.open.insert(uri.to_owned(), document);
        self.edit(uri, text, version);
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

    fn edit(&mut self, uri: &str, text: &str, version: &Value) {
        let Some(document) = self.open.get_mut(uri) else {
            return;
        };
        // Texts of checks have none, and an edit of the whole text must not count it.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        text.clone_into(&mut document.text);
        document.version = version.clone();
        let path = document.path.clone();
        rc_files::unsaved::set(&path, text);
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
    fn take_from_disk(&mut self, path: &Path) {
        let other = self.open.values().find(|open| open.path == path);
        match other {
            Some(other) => rc_files::unsaved::set(path, &other.text),
            None => rc_files::unsaved::remove(path),
        }
    }

    fn is_open(&self, path: &Path) -> bool {
        self.open.values().any(|open| open.path == path)
    }

    /// A file has another text: it is checked next, and then what read it, open files first.
    fn changed(&mut self, path: &Path) {
        self.findings.forget(path);
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
    fn check_all(&mut self) {
        for path in self.findings.all() {
            self.waiting.push(&path);
        }
    }

    /// Checks a file, or else looks into a folder.
    fn work(&mut self) -> io::Result<()> {
        if let Some(path) = self.waiting.pop() {
            return self.check(&path);
        }
        if let Some(folder) = self.folders.pop_front() {
            self.look_into(&folder);
        }
        Ok(())
    }

    /// Finds the description files of a folder, as `rcgen check` does. What cannot be read is left out.
    fn look_into(&mut self, folder: &Path) {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let mut entries: Vec<_> = entries.collect();
        entries.sort_by_key(std::fs::DirEntry::file_name);
        for entry in entries {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            let left_out = name.starts_with('.') || is_folder && is_left_out(&name);
            if left_out || self.files >= MOST_FILES {
                continue;
            }
            if is_folder {
                if self.folders.len() < MOST_FILES {
                    self.folders.push_back(entry.path());
                }
            } else if entry.path().is_file() && check::is_wanted(&entry.path()) {
                self.files += 1;
                let path = key(&entry.path());
                if self.address_in_roots(&path) != entry.path() {
                    self.links.entry(path.clone()).or_insert(entry.path());
                }
                self.waiting.push(&path);
            }
        }
    }

    /// Reads a file with all that it names. A file that is gone, or no text, has no findings and no
    /// names.
    fn look_at(&self, path: &Path) -> (Names, SourceMap, HashMap<SourceId, PathBuf>, Diagnostics) {
        let mut sources = SourceMap::new();
        let mut found = Diagnostics::new();
        let loader = FileLoader::new(&self.include);
        let include = &self.include;
        let model = check::file(path, false, &mut sources, &loader, include, &mut found);
        let model = model.ok().flatten();
        let keys = sources.ids().map(|id| (id, key(sources.path(id))));
        let keys = keys.collect();
        let names = Names::of(path, &sources, &keys, model.as_ref(), &loader);
        (names, sources, keys, found)
    }

    fn check(&mut self, path: &Path) -> io::Result<()> {
        self.dirty.remove(path);
        let (names, sources, keys, found) = self.look_at(path);
        let files = keys.iter();
        let files = files.map(|(id, path)| (*id, (path.clone(), self.address(path))));
        let files = files.collect();
        let mut changed = self
            .findings
            .checked(path, &sources, &files, &found, self.encoding);
        if keys.is_empty() {
            self.names.remove(path);
            self.last.remove(path);
        } else {
            let readable = !names.places.is_empty();
            let before = self.names.insert(path.to_path_buf(), names);
            let before = before.filter(|names| !readable && !names.places.is_empty());
            if readable {
                self.last.remove(path);
            } else if let Some(before) = before {
                self.last.insert(path.to_path_buf(), before);
            }
        }
        // It was forgotten when it changed.
        changed.insert(path.to_path_buf());
        for target in changed {
            self.publish(&target)?;
        }
        Ok(())
    }

    fn publish(&self, path: &Path) -> io::Result<()> {
        let diagnostics = self.findings.of(path);
        let mut is_open = false;
        for (uri, document) in &self.open {
            if document.path == path {
                is_open = true;
                publish_at(uri, &document.version, &diagnostics)?;
            }
        }
        if is_open {
            return Ok(());
        }
        publish_at(&self.address(path), &Value::Null, &diagnostics)
    }

    /// The address of a file for the editor: that of its open text, or where it is in the folders that
    /// the editor opened.
    fn address(&self, path: &Path) -> String {
        let mut open = self.open.iter();
        if let Some((uri, _)) = open.find(|(_, document)| document.path == path) {
            return uri.clone();
        }
        match self.links.get(path) {
            Some(link) => place::uri(link),
            None => place::uri(&self.address_in_roots(path)),
        }
    }

    /// The path of a file below a folder as the editor named the folder.
    fn address_in_roots(&self, path: &Path) -> PathBuf {
        let below = self.roots.iter().find_map(|(real, given)| {
            let rest = path.strip_prefix(real).ok()?;
            Some(given.join(rest))
        });
        below.unwrap_or_else(|| path.to_path_buf())
    }

    /// Answers a request. What it is about is checked first.
    fn request(
        &mut self,
        method: &str,
        parameters: &Value,
    ) -> io::Result<Result<Value, (i64, String)>> {
        if !REQUESTS.contains(&method) {
            return Ok(Err((
                METHOD_NOT_FOUND,
                format!("`{method}` is not offered"),
            )));
        }
        let uri = parameters["textDocument"]["uri"]
            .as_str()
            .unwrap_or_default();
        let Some(path) = self.open.get(uri).map(|open| open.path.clone()) else {
            return Ok(Ok(Value::Null));
        };
        self.elsewhere.clear();
        self.dirty.insert(path.clone());
        for path in std::mem::take(&mut self.dirty) {
            if self.waiting.remove(&path) {
                self.check(&path)?;
            }
        }
        // What is suggested needs the names of other files, but not those of the last moment.
        let suggests = method == "textDocument/completion" && !self.settled;
        if suggests || OF_ALL_FILES.contains(&method) {
            while !self.waiting.is_empty() || !self.folders.is_empty() {
                self.work()?;
            }
            self.settled = true;
        }
        let position = &parameters["position"];
        Ok(Ok(match method {
            "textDocument/formatting" => self.format(uri),
            "textDocument/codeAction" => {
                self.actions(uri, &path, &parameters["range"], &parameters["context"])
            }
            "textDocument/completion" => self.completion(&path, position),
            "textDocument/definition" => self.definition(&path, position),
            "textDocument/implementation" => self.implementation(&path, position),
            "textDocument/references" => {
                let declared = parameters["context"]["includeDeclaration"] != false;
                self.references(&path, position, declared)
            }
            "textDocument/documentHighlight" => self.highlights(&path, position),
            _ => self.hover(&path, position),
        }))
    }

    /// The edit that lays out an open file. Nothing if it has errors, as with `rcgen fmt`.
    fn format(&self, uri: &str) -> Value {
        let Some(Document { path, text, .. }) = self.open.get(uri) else {
            return Value::Null;
        };
        let mut sources = SourceMap::new();
        let source = sources.add(path, text.as_str());
        match laid_out(path, &sources, source) {
            Some(Ok(formatted)) if formatted == *text => json!([]),
            Some(Ok(formatted)) => {
                json!([{ "range": self.encoding.whole(text), "newText": formatted }])
            }
            Some(Err(_)) | None => Value::Null,
        }
    }

    /// The mends of the findings in a range, and one for all that are certain.
    fn actions(&self, uri: &str, path: &Path, range: &Value, context: &Value) -> Value {
        let kinds = context["only"].as_array();
        let wanted = |kind: &str| {
            let holds = |only: &str| {
                let rest = kind.strip_prefix(only);
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            kinds.is_none_or(|kinds| kinds.iter().filter_map(Value::as_str).any(holds))
        };
        let edit = |edits: Vec<Value>| json!({ "changes": { uri: edits } });
        let mut actions = Vec::new();
        let mut certain = Vec::new();
        for (diagnostic, mend) in self.findings.mends(path) {
            if mend.certain {
                certain.push(mend.edit.clone());
            }
            if wanted("quickfix") && Place::meet(&diagnostic["range"], range) {
                actions.push(json!({
                    "title": mend.title,
                    "kind": "quickfix",
                    "diagnostics": [diagnostic],
                    "isPreferred": mend.certain,
                    "edit": edit(vec![mend.edit]),
                }));
            }
        }
        if wanted("source.fixAll") && !certain.is_empty() {
            actions.push(json!({
                "title": "Make all certain mends",
                "kind": "source.fixAll",
                "edit": edit(findings::together(certain)),
            }));
        }
        json!(actions)
    }

    /// The page of the finding at a position.
    fn hover(&self, path: &Path, position: &Value) -> Value {
        let here = json!({ "start": position, "end": position });
        let at = self.findings.of(path).into_iter();
        let at = at.filter(|diagnostic| Place::meet(&diagnostic["range"], &here));
        let mut pages = Vec::new();
        let all = explain::pages();
        for diagnostic in at {
            let page = all.iter().find(|page| diagnostic["code"] == page.code);
            if let Some(page) = page {
                let text = format!("### {}\n\n{}", page.code, page.text);
                if !pages.contains(&text) {
                    pages.push(text);
                }
            }
        }
        if pages.is_empty() {
            return Value::Null;
        }
        json!({ "contents": { "kind": "markdown", "value": pages.join("\n\n") } })
    }
}

/// One path for all that lead to a file.
fn key(path: &Path) -> PathBuf {
    rc_files::unsaved::key(path)
}

/// Publishes the findings of a file, of a version of its text if it is open.
fn publish_at(uri: &str, version: &Value, diagnostics: &[Value]) -> io::Result<()> {
    let mut parameters = json!({ "uri": uri, "diagnostics": diagnostics });
    if !version.is_null() {
        parameters["version"] = version.clone();
    }
    send(json!({ "method": "textDocument/publishDiagnostics", "params": parameters }))
}

fn send(message: Value) -> io::Result<()> {
    wire::write(&mut io::stdout().lock(), message)
}
