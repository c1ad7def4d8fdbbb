//! The language server: `rcgen lsp`, over standard input and output.
//!
//! An editor sees what `rcgen check` and `rcgen fmt` say: [`crate::check`] reads each file through
//! [`rc_files::unsaved`], which holds the texts that are open. A change checks its file first, then
//! each file that read it; a further message goes first. What a request needs is checked before it
//! is answered, so no edit has a place of an earlier text.

mod actions;
mod completion;
mod context;
mod documents;
mod findings;
mod hints;
mod hover;
mod layout;
mod names;
mod navigation;
mod networks;
mod outline;
mod place;
mod queue;
mod rename;
mod requests;
mod signature;
mod structure;
mod tokens;
mod wire;

use crate::check::{self, Model};
use findings::{Findings, Phase};
use names::Names;
use networks::{Wired, Wiring};
use place::{Encoding, Text};
use queue::Queue;
use rc_codegen::FileLoader;
use rc_ddsl::Deployment;
use rc_diagnostics::{Diagnostics, Severity, SourceId, SourceMap};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap, VecDeque};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::SystemTime;

/// How many messages wait; each has a limit.
const MESSAGES: usize = 4;

/// After how many messages a file is checked, although further ones wait.
const MESSAGES_BETWEEN: usize = 32;

/// Codes of errors, as the protocol numbers them.
const PARSE_ERROR: i64 = -32700;
const METHOD_NOT_FOUND: i64 = -32601;
const NOT_INITIALIZED: i64 = -32002;
const INVALID_REQUEST: i64 = -32600;
const INVALID_PARAMETERS: i64 = -32602;
const REQUEST_FAILED: i64 = -32803;

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
    text: Text,
    version: Value,
}

/// What is known of a file that was read.
struct Looked {
    names: Names,
    sources: SourceMap,
    /// The file of each source.
    keys: HashMap<SourceId, PathBuf>,
    found: Diagnostics,
    network: Option<Box<Deployment>>,
}

#[derive(Default)]
struct Server {
    stage: Stage,
    include: Vec<PathBuf>,
    encoding: Encoding,
    /// Whether the editor watches files, if it is asked to.
    watches: bool,
    /// Whether the editor compares the version of a text with that of its edits.
    versions: bool,
    /// Open texts, by the address that the editor has for them.
    open: BTreeMap<String, Document>,
    findings: Findings,
    /// The names of all checked files.
    names: BTreeMap<PathBuf, Names>,
    /// Those that a file had when it could be read, where it cannot be read now.
    last: BTreeMap<PathBuf, Names>,
    /// Those of files outside of the folders, and when each had changed last.
    elsewhere: BTreeMap<PathBuf, (Option<SystemTime>, Names)>,
    /// The pieces of workers, by the `.cdsl`.
    workers: BTreeMap<PathBuf, navigation::Worker>,
    /// Networks whose components are being read, and what was found last.
    wirings: VecDeque<Wiring>,
    wired: BTreeMap<PathBuf, Wired>,
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
    /// Folders in which files to check are looked for, and the files that were found.
    folders: VecDeque<PathBuf>,
    found: BTreeSet<PathBuf>,
}

impl Server {
    fn serve(
        &mut self,
        messages: &Receiver<io::Result<Result<Value, String>>>,
    ) -> io::Result<bool> {
        let mut taken = 0;
        loop {
            self.settled |= self.waiting.is_empty() && self.folders.is_empty();
            let busy = !self.settled || !self.waiting.is_empty() || !self.wirings.is_empty();
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
                self.wirings.clear();
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
        self.versions = client["workspace"]["workspaceEdit"]["documentChanges"] == true;
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
        requests::capabilities(self.encoding)
    }

    /// Checks a file, or else looks into a folder, or else reads a component of a network.
    fn work(&mut self) -> io::Result<()> {
        if let Some(path) = self.waiting.pop() {
            return self.check(&path);
        }
        if let Some(folder) = self.folders.pop_front() {
            self.look_into(&folder);
            return Ok(());
        }
        self.wire()
    }

    /// Reads a file with all that it names. A file that is gone, or no text, has no findings and no
    /// names.
    fn look_at(&self, path: &Path) -> Looked {
        let mut sources = SourceMap::new();
        let mut found = Diagnostics::new();
        let loader = FileLoader::new(&self.include);
        let include = &self.include;
        let model = check::file(path, false, &mut sources, &loader, include, &mut found);
        let model = model.ok().flatten();
        let mut known = Keys::default();
        let ids = sources.ids();
        let keys = ids.map(|id| (id, known.of(sources.path(id)))).collect();
        let mut names = Names::of(path, &sources, &keys, known, model.as_ref(), &loader);
        names.has_mistake = found.iter().any(|one| {
            one.severity == Severity::Error
                && keys.get(&one.span.source).is_some_and(|key| key == path)
        });
        let network = match model {
            Some(Model::Network(network)) => Some(network),
            _ => None,
        };
        Looked {
            names,
            sources,
            keys,
            found,
            network,
        }
    }

    fn check(&mut self, path: &Path) -> io::Result<()> {
        self.dirty.remove(path);
        let looked = self.look_at(path);
        let files = self.addressed(&looked.keys);
        let check = (path, Phase::File);
        let (sources, found) = (&looked.sources, &looked.found);
        let mut changed = self
            .findings
            .checked(check, sources, &files, found, self.encoding);
        let names = looked.names;
        // A network that no other one imports any more has connections of its own.
        let before = self.names.get(path).map(|names| names.networks.clone());
        let parts = before.unwrap_or_default().into_iter();
        let parts: Vec<PathBuf> = parts
            .filter(|part| !names.networks.contains(part))
            .collect();
        if looked.keys.is_empty() {
            self.names.remove(path);
            self.last.remove(path);
            self.found.remove(path);
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
        if path.extension().is_some_and(|ending| ending == "ddsl") {
            let network = looked.network.filter(|_| !found.has_errors());
            changed.extend(self.begin_wiring(path, network, looked.sources));
        }
        for part in parts {
            self.waiting.push(&part);
        }
        // It was forgotten when it changed.
        changed.insert(path.to_path_buf());
        for target in changed {
            self.publish(&target)?;
        }
        Ok(())
    }

    /// The files of sources, each with its address.
    fn addressed(&self, keys: &HashMap<SourceId, PathBuf>) -> HashMap<SourceId, (PathBuf, String)> {
        let files = keys.iter();
        files
            .map(|(id, path)| (*id, (path.clone(), self.address(path))))
            .collect()
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
}

/// The keys of paths, as of one check: the system is asked once for each.
#[derive(Debug, Default)]
struct Keys(HashMap<PathBuf, PathBuf>);

impl Keys {
    fn of(&mut self, path: &Path) -> PathBuf {
        if let Some(known) = self.0.get(path) {
            return known.clone();
        }
        let key = key(path);
        self.0.insert(path.to_path_buf(), key.clone());
        key
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
