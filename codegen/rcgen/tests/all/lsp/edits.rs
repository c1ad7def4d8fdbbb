//! Random edits in all files of a workspace: after them, the findings are those of a server that has never
//! seen other texts.

use super::Editor;
use super::workspace::{Session, files};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Rounds of edits, and edits of each. The environment may ask for more rounds.
const ROUNDS: usize = 4;
const EDITS: usize = 25;

/// The inserted text.
const PIECES: [&str; 16] = [
    "{",
    "}",
    ";",
    "\"",
    "//",
    "/*",
    "x",
    "é",
    "\r",
    "import \"Grip.idsl\";",
    "bind a.b -> c.d;",
    "as y",
    "Component z { cdsl \"hand.cdsl\"; };",
    "😀",
    ".",
    "optional",
];

/// A generator of numbers, xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit.max(1) as u64) as usize
    }
}

/// A position as the protocol counts it: lines, and units of UTF-16.
fn position(text: &str, at: usize) -> Value {
    let before = &text[..at];
    let ends = |text: &str| {
        let both = text.matches("\r\n").count();
        text.matches(['\r', '\n']).count() - both
    };
    let start = before.rfind(['\r', '\n']).map_or(0, |feed| feed + 1);
    let character = before[start..].encode_utf16().count();
    json!({ "line": ends(before), "character": character })
}

/// The findings of all files that have any.
fn findings(editor: &Editor) -> BTreeMap<String, Vec<String>> {
    let shown = editor.shown.iter();
    let shown = shown.filter(|(_, found)| found.as_array().is_some_and(|all| !all.is_empty()));
    shown
        .map(|(uri, found)| {
            let all = found.as_array().expect("a list").iter();
            let mut all: Vec<String> = all.map(Value::to_string).collect();
            all.sort();
            (uri.clone(), all)
        })
        .collect()
}

/// The findings of a server that opens these texts.
fn from_scratch(
    session: &Session,
    texts: &BTreeMap<String, String>,
) -> BTreeMap<String, Vec<String>> {
    let mut editor = Editor::open_folder(&session.editor.folder);
    for (file, text) in texts {
        editor.open(file, text);
    }
    editor.ask("workspace/symbol", &json!({ "query": "" }));
    // Hints of a network need its connections.
    let range =
        json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 9, "character": 0 } });
    for file in ["inner.ddsl", "net.ddsl"] {
        let document = json!({ "uri": editor.uri(file) });
        editor.ask(
            "textDocument/inlayHint",
            &json!({ "textDocument": document, "range": range }),
        );
    }
    let found = findings(&editor);
    editor.end();
    found
}

#[test]
fn after_random_edits_the_findings_are_those_of_the_texts() {
    let rounds = std::env::var("RC_FUZZ_ROUNDS")
        .ok()
        .and_then(|rounds| rounds.parse().ok());
    let seed = std::env::var("RC_FUZZ_SEED")
        .ok()
        .and_then(|seed| seed.parse().ok());
    let mut random = Random(seed.unwrap_or(0x9e37_79b9_7f4a_7c15_u64).max(1));
    let mut session = Session::new();
    let mut texts: BTreeMap<String, String> = files()
        .into_iter()
        .map(|file| (file.clone(), session.text(&file)))
        .collect();
    let names: Vec<String> = texts.keys().cloned().collect();
    let mut seen = 0;
    for round in 0..rounds.unwrap_or(ROUNDS) {
        for _ in 0..EDITS {
            let file = &names[random.below(names.len())];
            let text = texts.get_mut(file).expect("a text");
            // A text that has become strange begins again.
            if random.below(12) == 0 {
                *text = session.text(file);
                session.editor.change(file, text);
                continue;
            }
            let places: Vec<usize> = text
                .char_indices()
                .map(|(at, _)| at)
                .chain([text.len()])
                .collect();
            let at = random.below(places.len());
            let to = (at + random.below(4)).min(places.len() - 1);
            let (start, end) = (places[at], places[to]);
            // A client counts no place between the two signs of one end of a line.
            let splits = |at: usize| text[..at].ends_with('\r') && text[at..].starts_with('\n');
            if splits(start) || splits(end) {
                continue;
            }
            let new = PIECES[random.below(PIECES.len())];
            let range = json!({ "start": position(text, start), "end": position(text, end) });
            text.replace_range(start..end, new);
            let document = json!({ "uri": session.editor.uri(file), "version": 2 });
            session.editor.tell(
                "textDocument/didChange",
                &json!({
                    "textDocument": document,
                    "contentChanges": [{ "range": range, "text": new }],
                }),
            );
        }
        let wanted = from_scratch(&session, &texts);
        seen += wanted.len();
        session
            .editor
            .ask("workspace/symbol", &json!({ "query": "" }));
        while findings(&session.editor) != wanted {
            let message = session.editor.messages.recv_timeout(super::LIMIT);
            let message = message.unwrap_or_else(|_| {
                panic!(
                    "round {round}: {:#?}\nbut {wanted:#?}",
                    findings(&session.editor)
                )
            });
            session.editor.note(&message);
        }
    }
    assert!(seen > 0, "no edit was wrong");
    session.editor.end();
}
