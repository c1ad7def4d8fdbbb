//! The language server: `rcgen lsp`, over standard input and output.
//!
//! An editor sees what `rcgen check` and `rcgen fmt` report: [`crate::check`] reads each file
//! through [`rc_files::unsaved`], which holds the texts that are open. A change first checks its
//! file, then each file that read it; a further message has priority. Before a request is answered,
//! everything that it needs is checked, so no edit refers to an earlier text.
//!
//! `Server` takes messages and decides the order of checks. Its parts own their state: `Editor`
//! the open texts, `Folders` the files to find, `KnownFiles` the names, `Findings` the
//! diagnostics, `Explained` their pages, `Networks` the connections, `Workers` the code. Answers read the parts.

mod actions;
mod completion;
mod context;
mod documents;
mod editor;
mod explained;
mod file_key;
mod findings;
mod folders;
mod hints;
mod hover;
mod json_place;
mod known_files;
mod layout;
mod markup;
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
mod workers;

use editor::Editor;
use explained::Explained;
use findings::{Findings, Phase};
use folders::Folders;
use known_files::KnownFiles;
use networks::{Networks, Wiring};
use queue::Queue;
use rc_ddsl::Deployment;
use rc_diagnostics::SourceMap;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use workers::Workers;

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
        files: KnownFiles::new(include),
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
    editor: Editor,
    findings: Findings,
    explained: Explained,
    files: KnownFiles,
    workers: Workers,
    networks: Networks,
    folders: Folders,
    /// Files to check.
    waiting: Queue,
    /// Of these, the files whose own text has changed.
    dirty: BTreeSet<PathBuf>,
    /// Whether all files of the folders were checked once.
    settled: bool,
}

impl Server {
    fn serve(
        &mut self,
        messages: &Receiver<io::Result<Result<Value, String>>>,
    ) -> io::Result<bool> {
        let mut taken = 0;
        loop {
            self.settled |= self.waiting.is_empty() && self.folders.is_empty();
            let busy = !self.settled || !self.waiting.is_empty() || self.networks.is_waiting();
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
                self.folders.stop();
                self.networks.stop();
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
        self.editor = Editor::of(parameters);
        self.explained = Explained::of(parameters);
        for folder in self.editor.folders() {
            self.folders.push(folder);
        }
        self.settled = false;
        requests::capabilities(self.editor.encoding())
    }

    /// Checks a file, or else looks into a folder, or else reads a component of a network.
    fn work(&mut self) -> io::Result<()> {
        if let Some(path) = self.waiting.pop() {
            return self.check(&path);
        }
        if self.folders.is_empty() {
            return self.wire();
        }
        for (path, found) in self.folders.look_into_next() {
            self.editor.link(&path, &found);
            self.waiting.push(&path);
        }
        Ok(())
    }

    /// Reads the next component of a network. After the last one, checks the network.
    fn wire(&mut self) -> io::Result<()> {
        let Some((path, checked)) = self.networks.read_next(&self.files.loader()) else {
            return Ok(());
        };
        let files = self.editor.addressed(&checked.keys);
        let check = (path.as_path(), Phase::Network);
        let encoding = self.editor.encoding();
        let sources = &checked.sources;
        let changed = self
            .findings
            .checked(check, sources, &files, &checked.found, encoding);
        self.findings.also_reads(&path, checked.files);
        self.networks.put(&path, checked.wired);
        for target in changed {
            self.publish(&target)?;
        }
        Ok(())
    }

    /// Makes the connections of all networks known, unless they were known a moment ago.
    fn know_networks(&mut self) -> io::Result<()> {
        if !self.networks.are_known() {
            while self.networks.is_waiting() {
                self.wire()?;
            }
        }
        Ok(())
    }

    fn check(&mut self, path: &Path) -> io::Result<()> {
        self.dirty.remove(path);
        let looked = self.files.look_at(path);
        let files = self.editor.addressed(&looked.keys);
        let check = (path, Phase::File);
        let (sources, found) = (&looked.sources, &looked.found);
        let encoding = self.editor.encoding();
        let mut changed = self
            .findings
            .checked(check, sources, &files, found, encoding);
        let names = looked.names;
        // A network that no other one imports any more has connections of its own.
        let before = self.files.get(path).map(|names| names.networks.clone());
        let parts = before.unwrap_or_default().into_iter();
        let parts: Vec<PathBuf> = parts
            .filter(|part| !names.networks.contains(part))
            .collect();
        if looked.keys.is_empty() {
            self.files.remove(path);
            self.folders.forget(path);
        } else {
            self.files.put(path, names);
        }
        if path.extension().is_some_and(|ending| ending == "ddsl") {
            changed.extend(self.begin_wiring(path, looked.network, looked.sources));
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

    /// The text of a network was checked: the network itself is checked as soon as nothing else waits.
    /// One that cannot be parsed, or that is a part of another one, has no findings of its own. Returns
    /// the files whose findings changed.
    fn begin_wiring(
        &mut self,
        path: &Path,
        network: Option<Box<Deployment>>,
        sources: SourceMap,
    ) -> BTreeSet<PathBuf> {
        let parts = self.files.get(path).map(|names| names.networks.clone());
        let mut unconnected = parts.unwrap_or_default();
        let mut all = self.files.iter();
        let is_part =
            all.any(|(own, names)| own != path && names.networks.iter().any(|part| part == path));
        match network.filter(|_| !is_part) {
            Some(deployment) => {
                let wiring = Wiring::new(path, sources, *deployment);
                self.networks.begin(wiring);
            }
            None => unconnected.push(path.to_path_buf()),
        }
        let mut changed = BTreeSet::new();
        for network in unconnected {
            self.networks.forget(&network);
            changed.extend(self.findings.unchecked(&network));
        }
        changed
    }

    fn publish(&mut self, path: &Path) -> io::Result<()> {
        let mut diagnostics = self.findings.of(path);
        for finding in &mut diagnostics {
            self.explained.link(finding);
        }
        let mut is_open = false;
        for (uri, version) in self.editor.open_as(path) {
            is_open = true;
            publish_at(uri, version, &diagnostics)?;
        }
        if is_open {
            return Ok(());
        }
        publish_at(&self.editor.address(path), &Value::Null, &diagnostics)
    }
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
