//! The language server: `rcgen lsp`, over standard input and output.
//!
//! An editor sees what `rcgen check` and `rcgen fmt` say: [`crate::check`] reads each file through
//! [`rc_files::unsaved`], which holds the texts that are open. A change checks its file first, then
//! each file that read it; a further message goes first.

mod findings;
mod place;
mod wire;

use crate::format::is_formatted;
use crate::languages::Language;
use crate::{check, explain, innermodel};
use findings::{Findings, Place};
use place::Encoding;
use rc_codegen::FileLoader;
use rc_diagnostics::{Diagnostics, SourceMap};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

/// How many files of the folders that an editor opens are checked without being asked for.
const MOST_FILES: usize = 2_000;

/// How many messages wait; each has a limit.
const MESSAGES: usize = 4;

/// Codes of errors, as the protocol numbers them.
const METHOD_NOT_FOUND: i64 = -32601;
const NOT_INITIALIZED: i64 = -32002;
const INVALID_REQUEST: i64 = -32600;

/// Serves an editor until it says `exit` or closes the input. Returns whether it said so in order.
///
/// # Errors
/// The input is none of the protocol, or the output is closed.
pub fn run(include: &[PathBuf]) -> io::Result<bool> {
    let (sender, messages) = sync_channel(MESSAGES);
    // It ends with the process: nothing can interrupt a read.
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

#[derive(Default)]
struct Server {
    stage: Stage,
    include: Vec<PathBuf>,
    encoding: Encoding,
    /// Open texts: the address that the editor has for the path, and the text.
    open: BTreeMap<PathBuf, (String, String)>,
    findings: Findings,
    /// Files to check, and the same as a set.
    waiting: VecDeque<PathBuf>,
}

impl Server {
    fn serve(&mut self, messages: &Receiver<io::Result<Value>>) -> io::Result<bool> {
        loop {
            let message = if self.waiting.is_empty() {
                messages.recv().ok()
            } else {
                match messages.try_recv() {
                    Ok(message) => Some(message),
                    Err(TryRecvError::Disconnected) => None,
                    Err(TryRecvError::Empty) => {
                        self.check_next()?;
                        continue;
                    }
                }
            };
            let Some(message) = message.transpose()? else {
                return Ok(false);
            };
            if message["method"] == "exit" {
                return Ok(self.stage == Stage::ShutDown);
            }
            self.take(&message)?;
        }
    }

    fn take(&mut self, message: &Value) -> io::Result<()> {
        // An answer to a request: this server asks nothing.
        let Some(method) = message["method"].as_str() else {
            return Ok(());
        };
        let parameters = &message["params"];
        let Some(id) = message.get("id") else {
            if self.stage == Stage::Initialized {
                self.notice(method, parameters);
            }
            return Ok(());
        };
        let answer = match (self.stage, method) {
            (Stage::New, "initialize") => Ok(self.initialize(parameters)),
            (Stage::New, _) => Err((NOT_INITIALIZED, "initialize comes first".to_owned())),
            (Stage::Initialized, "shutdown") => {
                self.stage = Stage::ShutDown;
                self.waiting.clear();
                Ok(Value::Null)
            }
            (Stage::Initialized, _) => self.request(method, parameters),
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
        self.encoding = Encoding::of(&parameters["capabilities"]["general"]["positionEncodings"]);
        let folders = parameters["workspaceFolders"].as_array();
        let folders = folders.into_iter().flatten().map(|folder| &folder["uri"]);
        let root = [&parameters["rootUri"]];
        let mut roots: Vec<PathBuf> = folders
            .chain(root)
            .filter_map(|uri| place::path(uri.as_str()?))
            .collect();
        roots.dedup();
        self.look_around(&roots);
        json!({
            "capabilities": {
                "positionEncoding": self.encoding.word(),
                "textDocumentSync": { "openClose": true, "change": 1, "save": true },
                "documentFormattingProvider": true,
                "codeActionProvider": { "codeActionKinds": ["quickfix", "source.fixAll"] },
                "hoverProvider": true,
            },
            "serverInfo": { "name": "rcgen", "version": env!("CARGO_PKG_VERSION") },
        })
    }

    /// Checks the description files of the folders that the editor has opened.
    fn look_around(&mut self, roots: &[PathBuf]) {
        for root in roots {
            let (mut sources, mut found) = (SourceMap::new(), Diagnostics::new());
            let files = check::files(std::slice::from_ref(root), &mut sources, &mut found);
            let left = MOST_FILES.saturating_sub(self.waiting.len());
            for file in files.unwrap_or_default().into_iter().take(left) {
                self.wait_for(&file);
            }
        }
    }

    fn notice(&mut self, method: &str, parameters: &Value) {
        let document = &parameters["textDocument"];
        let uri = document["uri"].as_str();
        let path = uri.and_then(place::path);
        match (method, path) {
            ("textDocument/didOpen", Some(path)) => {
                let text = document["text"].as_str();
                self.edit(&path, uri, text);
            }
            ("textDocument/didChange", Some(path)) => {
                // Each change has the whole text: this server offers nothing else.
                let last = parameters["contentChanges"]
                    .as_array()
                    .and_then(|all| all.last());
                let text = last.and_then(|change| change["text"].as_str());
                self.edit(&path, uri, text);
            }
            ("textDocument/didClose", Some(path)) => {
                self.open.remove(&key(&path));
                rc_files::unsaved::remove(&path);
                self.changed(&path);
            }
            ("textDocument/didSave", Some(path)) => self.changed(&path),
            ("workspace/didChangeWatchedFiles", _) => {
                let changes = parameters["changes"].as_array().into_iter().flatten();
                let uris = changes.filter_map(|change| change["uri"].as_str());
                for path in uris.filter_map(place::path).collect::<Vec<_>>() {
                    self.changed(&path);
                }
            }
            _ => {}
        }
    }

    fn edit(&mut self, path: &Path, uri: Option<&str>, text: Option<&str>) {
        let (Some(uri), Some(text)) = (uri, text) else {
            return;
        };
        if !is_known(path) {
            return;
        }
        self.open
            .insert(key(path), (uri.to_owned(), text.to_owned()));
        rc_files::unsaved::set(path, text);
        self.changed(path);
    }

    /// A file has another text: it is checked next, and then what read it, open files first.
    fn changed(&mut self, path: &Path) {
        let path = key(path);
        let mut readers = self.findings.readers(&path);
        readers.sort_by_key(|reader| !self.open.contains_key(reader));
        if is_known(&path) {
            readers.retain(|reader| *reader != path);
            readers.insert(0, path);
        }
        let first: BTreeSet<&PathBuf> = readers.iter().collect();
        self.waiting.retain(|waiting| !first.contains(waiting));
        for reader in readers.into_iter().rev() {
            self.waiting.push_front(reader);
        }
    }

    fn wait_for(&mut self, path: &Path) {
        let path = key(path);
        if !self.waiting.contains(&path) {
            self.waiting.push_back(path);
        }
    }

    fn check_next(&mut self) -> io::Result<()> {
        let Some(path) = self.waiting.pop_front() else {
            return Ok(());
        };
        let mut sources = SourceMap::new();
        let mut found = Diagnostics::new();
        let loader = FileLoader::new(&self.include);
        let include = &self.include;
        // A file that is gone, or no text, has no findings of its own.
        let _ = check::file(&path, false, &mut sources, &loader, include, &mut found);
        let changed = self
            .findings
            .checked(&path, &sources, &found, self.encoding);
        for target in changed {
            let diagnostics = self.findings.of(&target);
            let uri = self.uri(&target);
            send(json!({
                "method": "textDocument/publishDiagnostics",
                "params": { "uri": uri, "diagnostics": diagnostics },
            }))?;
        }
        Ok(())
    }

    /// The address of a file, as the editor wrote it.
    fn uri(&self, path: &Path) -> String {
        let open = self.open.get(path).map(|(uri, _)| uri.clone());
        open.unwrap_or_else(|| place::uri(path))
    }

    fn request(&self, method: &str, parameters: &Value) -> Result<Value, (i64, String)> {
        let uri = parameters["textDocument"]["uri"].as_str();
        let path = uri.and_then(place::path).map(|path| key(&path));
        Ok(match (method, path) {
            ("textDocument/formatting", Some(path)) => self.format(&path),
            ("textDocument/codeAction", Some(path)) => {
                self.actions(&path, &parameters["range"], &parameters["context"])
            }
            ("textDocument/hover", Some(path)) => self.hover(&path, &parameters["position"]),
            ("textDocument/formatting" | "textDocument/codeAction" | "textDocument/hover", _) => {
                Value::Null
            }
            _ => return Err((METHOD_NOT_FOUND, format!("`{method}` is not offered"))),
        })
    }

    /// The edit that lays out an open file. Nothing if it has errors, as with `rcgen fmt`.
    fn format(&self, path: &Path) -> Value {
        let Some((_, text)) = self.open.get(path).filter(|_| is_formatted(path)) else {
            return Value::Null;
        };
        let mut sources = SourceMap::new();
        let source = sources.add(path, text.as_str());
        let formatted = match Language::of(path) {
            Some(language) => language.format(&sources, source),
            None => innermodel::format(&sources, source)
                .map(|formatted| rc_syntax::with_ends_of(text, formatted)),
        };
        match formatted {
            Ok(formatted) if formatted == *text => json!([]),
            Ok(formatted) => {
                json!([{ "range": self.encoding.whole(text), "newText": formatted }])
            }
            Err(_) => Value::Null,
        }
    }

    /// The mends of the findings in a range, and one for all that are certain.
    fn actions(&self, path: &Path, range: &Value, context: &Value) -> Value {
        let uri = self.uri(path);
        let kinds = context["only"].as_array();
        let wanted = |kind: &str| {
            let starts = |only: &Value| only.as_str().is_some_and(|only| kind.starts_with(only));
            kinds.is_none_or(|kinds| kinds.iter().any(starts))
        };
        let edit = |edits: Vec<Value>| json!({ "changes": { uri.as_str(): edits } });
        let mut actions = Vec::new();
        let mut certain: Vec<Value> = Vec::new();
        for (diagnostic, mend) in self.findings.mends(path) {
            if mend.certain && !certain.contains(&mend.edit) {
                certain.push(mend.edit.clone());
            }
            if wanted("quickfix") && Place::meet(&diagnostic["range"], range) {
                actions.push(json!({
                    "title": mend.title,
                    "kind": "quickfix",
                    "diagnostics": [diagnostic],
                    "isPreferred": mend.certain,
                    "edit": edit(vec![mend.edit.clone()]),
                }));
            }
        }
        if wanted("source.fixAll") && !certain.is_empty() {
            actions.push(json!({
                "title": "Mend what can only be meant",
                "kind": "source.fixAll",
                "edit": edit(certain),
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

/// Whether a file is one that is checked. Other `.json` and `.toml` files are other programs'.
fn is_known(path: &Path) -> bool {
    check::is_wanted(path)
}

/// One path for all that lead to a file.
fn key(path: &Path) -> PathBuf {
    rc_files::unsaved::key(path)
}

fn send(message: Value) -> io::Result<()> {
    wire::write(&mut io::stdout().lock(), message)
}
