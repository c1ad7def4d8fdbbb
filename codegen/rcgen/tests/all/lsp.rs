//! `rcgen lsp`: sessions of an editor, over the pipes of a real process.

mod answers;
mod bad_input;
mod checked;
mod completion;
mod editors;
mod edits;
mod explained;
mod hover;
mod navigation;
mod networks;
mod proxies;
mod rename;
mod workspace;

use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Longer than any answer takes.
pub(crate) const LIMIT: Duration = Duration::from_mins(1);

/// An editor with its server.
pub(crate) struct Editor {
    server: Child,
    input: Option<ChildStdin>,
    messages: Receiver<Value>,
    folder: PathBuf,
    /// The findings of each file.
    shown: BTreeMap<String, Value>,
    /// The messages of the server to its user.
    told: Vec<String>,
    next: u64,
}

impl Drop for Editor {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn spawn() -> Child {
    spawn_with(Command::new(env!("CARGO_BIN_EXE_rcgen")))
}

fn spawn_with(mut command: Command) -> Child {
    command.arg("lsp").stdin(Stdio::piped());
    let spawned = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    spawned.expect("a server")
}

fn uri(path: &Path) -> String {
    format!("file://{}", path.display())
}

impl Editor {
    /// Opens a folder.
    pub(crate) fn open_folder(folder: &Path) -> Self {
        Self::open_with(folder, spawn(), &json!({}))
    }

    /// Opens a folder with capabilities of the editor.
    fn open_with(folder: &Path, mut server: Child, capabilities: &Value) -> Self {
        let mut output = BufReader::new(server.stdout.take().expect("a pipe"));
        let (sender, messages) = channel();
        std::thread::spawn(move || {
            loop {
                let mut header = String::new();
                if output.read_line(&mut header).expect("a line") == 0 {
                    return;
                }
                let length = header.strip_prefix("Content-Length: ").expect("a length");
                let mut body = vec![0; length.trim().parse().expect("a number")];
                let mut line = String::new();
                output.read_line(&mut line).expect("a line");
                output.read_exact(&mut body).expect("a body");
                let message = serde_json::from_slice(&body).expect("JSON");
                if sender.send(message).is_err() {
                    return;
                }
            }
        });
        let mut editor = Self {
            input: server.stdin.take(),
            server,
            messages,
            folder: folder.to_path_buf(),
            shown: BTreeMap::new(),
            told: Vec::new(),
            next: 0,
        };
        let root = uri(&editor.folder);
        let offered = editor.ask(
            "initialize",
            &json!({ "rootUri": root, "capabilities": capabilities, "workspaceFolders": null }),
        );
        assert_eq!(offered["capabilities"]["positionEncoding"], "utf-16");
        editor.tell("initialized", &json!({}));
        editor
    }

    fn send(&mut self, message: &Value) {
        let body = message.to_string();
        let input = self.input.as_mut().expect("a pipe");
        write!(input, "Content-Length: {}\r\n\r\n{body}", body.len()).expect("written");
    }

    fn tell(&mut self, method: &str, parameters: &Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": parameters }));
    }

    /// Asks, and returns the result.
    fn ask(&mut self, method: &str, parameters: &Value) -> Value {
        let answer = self.answer(method, parameters);
        assert!(answer.get("error").is_none(), "{method}: {answer}");
        answer["result"].clone()
    }

    /// Asks, and returns the answer.
    fn answer(&mut self, method: &str, parameters: &Value) -> Value {
        self.next += 1;
        let id = self.next;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": parameters }));
        loop {
            let message = self.messages.recv_timeout(LIMIT).expect("an answer");
            if message["id"] == id {
                return message;
            }
            self.note(&message);
        }
    }

    fn uri(&self, file: &str) -> String {
        uri(&self.folder.join(file))
    }

    /// The findings of a file, as soon as their codes and lines are these.
    pub(crate) fn wait_for(&mut self, file: &str, wanted: &[(&str, u64)]) -> Value {
        let uri = self.uri(file);
        loop {
            let found = self.shown.get(&uri).cloned().unwrap_or(json!([]));
            let all = found.as_array().expect("a list").iter();
            let codes = all.map(|d| (d["code"].as_str(), d["range"]["start"]["line"].as_u64()));
            if codes.eq(wanted.iter().map(|(code, line)| (Some(*code), Some(*line)))) {
                return found;
            }
            let message = self.messages.recv_timeout(LIMIT);
            let message = message.unwrap_or_else(|_| panic!("{file} has still {found}"));
            self.note(&message);
        }
    }

    /// Keeps findings, and what is told.
    fn note(&mut self, message: &Value) {
        if message["method"] == "window/showMessage" {
            let text = message["params"]["message"].as_str().expect("a text");
            self.told.push(text.to_owned());
        }
        if message["method"] == "textDocument/publishDiagnostics" {
            let published = &message["params"];
            let uri = published["uri"].as_str().expect("an address").to_owned();
            self.shown.insert(uri, published["diagnostics"].clone());
        }
    }

    pub(crate) fn open(&mut self, file: &str, text: &str) {
        let document =
            json!({ "uri": self.uri(file), "languageId": "idsl", "version": 1, "text": text });
        self.tell("textDocument/didOpen", &json!({ "textDocument": document }));
    }

    pub(crate) fn change(&mut self, file: &str, text: &str) {
        let document = json!({ "uri": self.uri(file), "version": 2 });
        let changes = json!([{ "text": text }]);
        self.tell(
            "textDocument/didChange",
            &json!({ "textDocument": document, "contentChanges": changes }),
        );
    }

    /// The quick fixes of an open file: the places of their edits, and their titles.
    pub(crate) fn fixes(&mut self, file: &str) -> Vec<String> {
        let uri = self.uri(file);
        let range = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 9999, "character": 0 } });
        let context = json!({ "diagnostics": [], "only": ["quickfix"] });
        let parameters =
            json!({ "textDocument": { "uri": uri }, "range": range, "context": context });
        let actions = self.ask("textDocument/codeAction", &parameters);
        let actions = actions.as_array().expect("actions").iter();
        let shown = actions.map(|action| {
            let start = &action["edit"]["changes"][&uri][0]["range"]["start"];
            let title = action["title"].as_str().expect("a title");
            format!("{}:{} {title}", start["line"], start["character"])
        });
        shown.collect()
    }

    /// Ends in order.
    pub(crate) fn end(mut self) {
        assert_eq!(self.ask("shutdown", &Value::Null), Value::Null);
        self.tell("exit", &Value::Null);
        let status = self.server.wait().expect("an end");
        assert_eq!(status.code(), Some(0));
    }
}

const GRIP: &str =
    "module Grip\n{\n    interface Grip\n    {\n        void press(float newton);\n    };\n};\n";
const HAND: &str = "import \"Grip.idsl\";\n\nComponent hand\n{\n    Communications\n    {\n        implements Grip;\n    };\n    language rust;\n};\n";

#[test]
fn what_is_typed_is_checked_with_all_that_read_it() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("Grip.idsl"), GRIP).expect("a file");
    std::fs::write(folder.path().join("hand.cdsl"), HAND).expect("a file");
    let mut editor = Editor::open_folder(folder.path());

    // Nothing is saved: the file on disk is right.
    editor.open("Grip.idsl", &GRIP.replace("float", "flaot"));
    let found = editor.wait_for("Grip.idsl", &[("unknown-type", 4)]);
    assert_eq!(
        found[0]["range"]["start"],
        json!({ "line": 4, "character": 19 })
    );
    assert_eq!(found[0]["severity"], 1);
    assert!(
        found[0]["message"]
            .as_str()
            .expect("a text")
            .contains("did you mean `float`?")
    );

    // The component that is not open notices another name.
    editor.change(
        "Grip.idsl",
        &GRIP.replace("interface Grip", "interface Grasp"),
    );
    editor.wait_for("Grip.idsl", &[]);
    let found = editor.wait_for("hand.cdsl", &[("unknown-interface", 6)]);
    assert_eq!(
        found[0]["range"]["start"],
        json!({ "line": 6, "character": 19 })
    );
    editor.change("Grip.idsl", GRIP);
    editor.wait_for("hand.cdsl", &[]);

    // A file that is closed is as on disk.
    editor.change(
        "Grip.idsl",
        "module Grip { interface Grip { void press() }; };\n",
    );
    editor.wait_for("Grip.idsl", &[("missing-semicolon", 0)]);
    let document = json!({ "textDocument": { "uri": editor.uri("Grip.idsl") } });
    editor.tell("textDocument/didClose", &document);
    editor.wait_for("Grip.idsl", &[]);
    editor.end();
}

#[test]
fn findings_are_fixed_explained_and_texts_laid_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = Editor::open_folder(folder.path());
    let document = json!({ "uri": editor.uri("m.idsl") });
    // Characters that take two places of UTF-16, or two bytes.
    let text = "module M { struct S { strign a /* é😀 */\n int b; }; };\n";
    editor.open("m.idsl", text);
    editor.wait_for("m.idsl", &[("unknown-type", 0), ("missing-semicolon", 0)]);

    let whole =
        json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 1, "character": 0 } });
    let actions = |editor: &mut Editor, context: Value| {
        editor.ask(
            "textDocument/codeAction",
            &json!({ "textDocument": document, "range": whole, "context": context }),
        )
    };
    let all = actions(&mut editor, json!({ "diagnostics": [] }));
    let titles: Vec<&str> = all
        .as_array()
        .expect("actions")
        .iter()
        .filter_map(|a| a["title"].as_str())
        .collect();
    assert_eq!(
        titles,
        ["Write `string`", "Add `;`", "Apply all certain fixes"]
    );
    assert_eq!(all[0]["isPreferred"], false);
    assert_eq!(all[1]["isPreferred"], true);
    let edit = &all[1]["edit"]["changes"][editor.uri("m.idsl")][0];
    assert_eq!(edit["newText"], ";");
    assert_eq!(
        edit["range"]["start"],
        json!({ "line": 0, "character": 30 })
    );
    let only = actions(
        &mut editor,
        json!({ "diagnostics": [], "only": ["source.fixAll"] }),
    );
    assert_eq!(only.as_array().expect("actions").len(), 1);
    assert_eq!(
        only[0]["edit"]["changes"][editor.uri("m.idsl")],
        json!([edit])
    );

    let hover = editor.ask(
        "textDocument/hover",
        &json!({ "textDocument": document, "position": { "line": 0, "character": 24 } }),
    );
    let page = hover["contents"]["value"].as_str().expect("a page");
    assert!(page.starts_with("### unknown-type"), "{page}");
    let format = |editor: &mut Editor| {
        editor.ask(
            "textDocument/formatting",
            &json!({ "textDocument": document, "options": { "tabSize": 4, "insertSpaces": true } }),
        )
    };
    // A text with errors stays as it is.
    assert_eq!(format(&mut editor), Value::Null);
    editor.change("m.idsl", "module M { struct S { string a; int b; }; };\n");
    editor.wait_for("m.idsl", &[]);
    let edits = format(&mut editor);
    assert_eq!(
        edits[0]["range"]["end"],
        json!({ "line": 1, "character": 0 })
    );
    let formatted = edits[0]["newText"].as_str().expect("a text").to_owned();
    std::fs::write(folder.path().join("m.idsl"), &formatted).expect("a file");
    crate::rcgen::succeeds(folder.path(), &["fmt", "--check", "m.idsl"]);
    editor.change("m.idsl", &formatted);
    assert_eq!(format(&mut editor), json!([]));

    let unknown = editor.answer(
        "textDocument/unheardOf",
        &json!({ "textDocument": document }),
    );
    assert_eq!(unknown["error"]["code"], -32601);
    editor.end();
}

#[test]
fn what_others_miss_is_found_when_it_appears() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("hand.cdsl"), HAND).expect("a file");
    let mut editor = Editor::open_folder(folder.path());
    editor.wait_for("hand.cdsl", &[("import-not-found", 0)]);
    // It is not on disk yet.
    editor.open("Grip.idsl", GRIP);
    editor.wait_for("hand.cdsl", &[]);
    let document = json!({ "textDocument": { "uri": editor.uri("Grip.idsl") } });
    editor.tell("textDocument/didClose", &document);
    editor.wait_for("hand.cdsl", &[("import-not-found", 0)]);
    // Another program makes it.
    std::fs::write(folder.path().join("Grip.idsl"), GRIP).expect("a file");
    let created = json!({ "uri": editor.uri("Grip.idsl"), "type": 1 });
    editor.tell(
        "workspace/didChangeWatchedFiles",
        &json!({ "changes": [created] }),
    );
    editor.wait_for("hand.cdsl", &[]);
    editor.end();
}

#[test]
fn findings_of_a_workspace_behind_a_link_have_its_addresses() {
    let folder = tempfile::tempdir().expect("a folder");
    let real = folder.path().join("real");
    let other = folder.path().join("other");
    for folder in [&real, &other] {
        std::fs::create_dir(folder).expect("a folder");
    }
    let wrong = GRIP.replace("float", "flaot");
    std::fs::write(real.join("Grip.idsl"), &wrong).expect("a file");
    std::fs::write(other.join("Linked.idsl"), &wrong).expect("a file");
    let link = folder.path().join("link");
    std::os::unix::fs::symlink(&real, &link).expect("a link");
    let linked = real.join("Near.idsl");
    std::os::unix::fs::symlink(other.join("Linked.idsl"), linked).expect("a link");
    let mut editor = Editor::open_folder(&link);
    editor.wait_for("Grip.idsl", &[("unknown-type", 4)]);
    editor.wait_for("Near.idsl", &[("unknown-type", 4)]);
    editor.end();
}

#[test]
fn findings_follow_a_folder_that_is_renamed() {
    let folder = tempfile::tempdir().expect("a folder");
    let (old, new) = (folder.path().join("old"), folder.path().join("new"));
    std::fs::create_dir(&old).expect("a folder");
    std::fs::write(old.join("Grip.idsl"), GRIP.replace("float", "flaot")).expect("a file");
    let mut editor = Editor::open_folder(folder.path());
    editor.wait_for("old/Grip.idsl", &[("unknown-type", 4)]);
    std::fs::rename(&old, &new).expect("renamed");
    let renamed = json!({ "oldUri": editor.uri("old"), "newUri": editor.uri("new") });
    editor.tell("workspace/didRenameFiles", &json!({ "files": [renamed] }));
    editor.wait_for("old/Grip.idsl", &[]);
    editor.wait_for("new/Grip.idsl", &[("unknown-type", 4)]);
    editor.end();
}

#[test]
fn an_edit_has_the_place_of_the_last_text() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = Editor::open_folder(folder.path());
    editor.open("m.idsl", "module M { struct S { int a }; };\n");
    let document = json!({ "uri": editor.uri("m.idsl") });
    for lines in 1..20 {
        let text = format!(
            "{}module M {{ struct S {{ int a }}; }};\n",
            "\n".repeat(lines)
        );
        editor.change("m.idsl", &text);
        let range = json!({
            "start": { "line": 0, "character": 0 },
            "end": { "line": 99, "character": 0 },
        });
        let context = json!({ "diagnostics": [], "only": ["source.fixAll"] });
        let all = editor.ask(
            "textDocument/codeAction",
            &json!({ "textDocument": document, "range": range, "context": context }),
        );
        let edits = &all[0]["edit"]["changes"][editor.uri("m.idsl")];
        assert_eq!(edits[0]["range"]["start"]["line"], lines);
    }
    editor.end();
}

#[test]
fn an_empty_text_of_innermodel_may_be_undone() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = Editor::open_folder(folder.path());
    let text = "<innerModel>\n<transform id=\"a\"/>\n</innerModel>\n";
    editor.open("w.xml", text);
    editor.change("w.xml", "");
    editor.change("w.xml", &text.replace("transform", "transfrom"));
    editor.wait_for("w.xml", &[("unknown-tag", 1)]);
    editor.end();
}

/// After each of many random edits, the findings are those of `rcgen check` of the text.
#[test]
fn after_any_edits_the_findings_are_those_of_the_command() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = Editor::open_folder(folder.path());
    // The command reads another folder: the server has the text from the editor only.
    let other = tempfile::tempdir().expect("a folder");
    let file = other.path().join("Grip.idsl");
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = |below: usize| {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random % below as u64) as usize
    };
    let mut text = GRIP.to_owned();
    editor.open("Grip.idsl", &text);
    for _ in 0..60 {
        let at = next(text.chars().count());
        let mut characters: Vec<char> = text.chars().collect();
        match next(3) {
            0 => drop(characters.remove(at)),
            1 => characters.insert(at, ['{', ';', 'x', '"', 'é', '\r', '\u{a0}', '@'][next(8)]),
            _ => characters.swap(at, 0),
        }
        text = characters.into_iter().collect();
        if text.len() < 40 {
            GRIP.clone_into(&mut text);
        }
        editor.change("Grip.idsl", &text);
        std::fs::write(&file, &text).expect("a file");
        let (_, _, err) =
            crate::folders::rcgen(other.path(), &["check", "Grip.idsl", "--format", "json"]);
        let wanted: Vec<Value> = err
            .lines()
            .map(|line| serde_json::from_str(line).expect("JSON"))
            .collect();
        let line = |finding: &Value| finding["start"]["line"].as_u64().expect("a line") - 1;
        let wanted: Vec<(&str, u64)> = wanted
            .iter()
            .map(|finding| (finding["code"].as_str().expect("a code"), line(finding)))
            .collect();
        editor.wait_for("Grip.idsl", &wanted);
    }
    editor.end();
}
