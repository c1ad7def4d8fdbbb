//! Other names for things, in a workspace with one file of each kind.

use super::workspace::Session;
use expect_test::expect_file;
use serde_json::{Value, json};

impl Session {
    fn position(&self, file: &str, before: &str) -> Value {
        let text = self.text(file);
        let at = text.find(before).expect("a place") + before.len();
        let start = text[..at].rfind('\n').map_or(0, |feed| feed + 1);
        json!({ "line": text[..at].matches('\n').count(), "character": at - start })
    }

    /// Renames the thing behind `before`, and notes each edit and what is told of the code.
    fn renames(&mut self, file: &str, before: &str, new: &str) {
        let parameters = json!({
            "textDocument": { "uri": self.editor.uri(file) },
            "position": self.position(file, before),
            "newName": new,
        });
        let before = before.trim();
        self.log.push_str(&format!("{file} {before}▮ → {new}\n"));
        let answer = self.editor.answer("textDocument/rename", &parameters);
        if let Some(message) = answer["error"]["message"].as_str() {
            let root = self.editor.folder.canonicalize().expect("a folder");
            let message = message.replace(&format!("{}/", root.display()), "");
            self.log.push_str(&format!("    refused: {message}\n\n"));
            return;
        }
        let root = super::uri(&self.editor.folder);
        let changes = answer["result"]["changes"].as_object().expect("changes");
        let mut lines = Vec::new();
        for (uri, edits) in changes {
            let file = uri
                .strip_prefix(&format!("{root}/"))
                .expect("a file inside");
            let text = self.text(file);
            let rows: Vec<&str> = text.lines().collect();
            for edit in edits.as_array().expect("edits") {
                let (start, end) = (&edit["range"]["start"], &edit["range"]["end"]);
                let number = |value: &Value| value.as_u64().expect("a number") as usize;
                let row = rows[number(&start["line"])];
                let (from, to) = (number(&start["character"]), number(&end["character"]));
                let new = edit["newText"].as_str().expect("a text");
                let shown = format!("{}{new}{}", &row[..from], &row[to..]);
                lines.push(format!(
                    "    {file}:{} {}\n",
                    number(&start["line"]) + 1,
                    shown.trim()
                ));
            }
        }
        self.log.extend(lines);
        for told in std::mem::take(&mut self.editor.told) {
            for line in told.lines() {
                self.log.push_str(&format!("    | {line}\n"));
            }
        }
        self.log.push('\n');
    }
}

#[test]
fn a_new_name_is_written_into_all_files() {
    let mut session = Session::new();
    for (file, before, new) in [
        ("interfaces/Units.idsl", "struct Fo", "Push"),
        ("interfaces/Units.idsl", "{ le", "port"),
        ("interfaces/Grip.idsl", "Forces pre", "squeeze"),
        ("interfaces/Grip.idsl", "interface Gr", "Hold"),
        ("brain/brain.cdsl", "as ha", "grippers"),
        ("hand.cdsl", "implements Gr", "fingers"),
        ("hand.cdsl", "Component ha", "palm"),
        ("hand.smdsl", "=> bu", "working"),
        ("hand.pdsl", "        spe", "velocity"),
        ("common.pdsl", "    fin", "digits"),
        ("inner.ddsl", "Group ar", "limb"),
        ("net.ddsl", "Component br", "mind"),
        ("net.ddsl", "hands \"le", "right"),
        ("net.ddsl", "Host ro", "machine"),
        // Refused names.
        ("interfaces/Units.idsl", "struct Fo", "Side"),
        ("interfaces/Units.idsl", "struct Fo", "a b"),
        ("interfaces/Units.idsl", "module Un", "Other"),
        ("hand.pdsl", "group mo", "wheel"),
        ("net.ddsl", "{\n  ", "x"),
    ] {
        session.renames(file, before, new);
    }
    // A refused or an unused answer leaves nothing behind: the findings are those of the files.
    session.editor.wait_for("interfaces/Units.idsl", &[]);
    let prepared = session.editor.ask(
        "textDocument/prepareRename",
        &json!({
            "textDocument": { "uri": session.editor.uri("net.ddsl") },
            "position": session.position("net.ddsl", "motor.sp"),
        }),
    );
    assert_eq!(prepared["placeholder"], "speed");
    let start = session.position("net.ddsl", "motor.");
    assert_eq!(prepared["range"]["start"], start);
    session.editor.end();
    expect_file!["rename/names.txt"].assert_eq(&session.log);
}

/// `convert { frames SLOT; }` names a slot of the consumer, also of one in a group.
#[test]
fn the_slot_that_knows_frames_is_renamed_where_a_connection_names_it() {
    let mut session = Session::new();
    let cloud = "module Cloud\n{\n    interface Cloud { void push(float x); };\n};\n";
    let component = |name: &str, slots: &str| {
        let imports = "import \"Cloud.idsl\";\nimport \"InnerModel.idsl\";\n";
        format!(
            "{imports}Component {name}\n{{\n    Communications\n    {{\n{slots}    }};\n    language rust;\n}};\n"
        )
    };
    let mapper = "        requires InnerModel as world;\n        subscribesTo Cloud;\n";
    let network = "Deployment moving\n{\n    Component tree { cdsl \"tree.cdsl\"; };\n    Component lidar { cdsl \"lidar.cdsl\"; };\n    Component mapper { cdsl \"mapper.cdsl\"; };\n    Group maps\n    {\n        Component inner { cdsl \"mapper.cdsl\"; };\n        export Cloud;\n    };\n    bind mapper.Cloud -> lidar.Cloud { convert { frames world; }; };\n    bind maps.Cloud -> lidar.Cloud { convert { frames world; }; };\n};\n";
    let files = [
        ("interfaces/Cloud.idsl", cloud.to_owned()),
        (
            "tree.cdsl",
            component("tree", "        implements InnerModel;\n"),
        ),
        (
            "lidar.cdsl",
            component("lidar", "        publishes Cloud;\n"),
        ),
        ("mapper.cdsl", component("mapper", mapper)),
        ("moving.ddsl", network.to_owned()),
    ];
    for (file, text) in &files {
        std::fs::write(session.editor.folder.join(file), text).expect("a file");
        session.editor.open(file, text);
    }
    session.renames("mapper.cdsl", "as wor", "map");
    session.renames("moving.ddsl", "{ frames wor", "place");
    session.editor.end();
    expect_file!["rename/frames.txt"].assert_eq(&session.log);
}

#[test]
fn a_part_of_a_text_is_laid_out() {
    let mut session = Session::new();
    let file = "interfaces/Units.idsl";
    let text = "module  Units {\n  struct A { int  a; };\n  struct   B { int  b; };\n};\n";
    session.editor.change(file, text);
    let uri = session.editor.uri(file);
    let apply = |edits: &Value| {
        let mut out = text.to_owned();
        let starts: Vec<usize> = std::iter::once(0)
            .chain(text.match_indices('\n').map(|(at, _)| at + 1))
            .collect();
        let byte = |place: &Value| {
            let number = |value: &Value| value.as_u64().expect("a number") as usize;
            starts[number(&place["line"])] + number(&place["character"])
        };
        for edit in edits.as_array().expect("edits").iter().rev() {
            let range = byte(&edit["range"]["start"])..byte(&edit["range"]["end"]);
            out.replace_range(range, edit["newText"].as_str().expect("a text"));
        }
        out
    };
    let range =
        json!({ "start": { "line": 2, "character": 0 }, "end": { "line": 2, "character": 99 } });
    let edits = session.editor.ask(
        "textDocument/rangeFormatting",
        &json!({ "textDocument": { "uri": uri }, "range": range, "options": {} }),
    );
    let second = "\n    struct B\n    {\n        int b;\n    };";
    assert_eq!(
        apply(&edits),
        format!("module  Units {{\n  struct A {{ int  a; }};{second}\n}};\n")
    );
    let typed = |session: &mut Session, line: usize, character: usize, ch: &str| {
        session.editor.ask(
            "textDocument/onTypeFormatting",
            &json!({
                "textDocument": { "uri": uri },
                "position": { "line": line, "character": character },
                "ch": ch,
                "options": {},
            }),
        )
    };
    // The statement that the `;` ends, and the block that the last `;` ends.
    let edits = typed(&mut session, 1, 20, ";");
    assert_eq!(
        apply(&edits),
        "module  Units {\n  struct A {\n        int a; };\n  struct   B { int  b; };\n};\n"
    );
    let edits = typed(&mut session, 2, 25, ";");
    assert_eq!(
        apply(&edits),
        format!("module  Units {{\n  struct A {{ int  a; }};{second}\n}};\n")
    );
    // Not behind another sign, and not in a text with errors.
    assert_eq!(typed(&mut session, 1, 5, ";"), Value::Null);
    session
        .editor
        .change(file, "module Units { struct A { int a; };");
    assert_eq!(typed(&mut session, 0, 32, ";"), Value::Null);
    session.editor.end();
}

/// Chains, closed files that change unseen, and files with mistakes name things, too.
#[test]
fn nothing_that_names_a_thing_is_passed_by() {
    let mut session = Session::new();
    let write = |session: &Session, file: &str, text: &str| {
        std::fs::write(session.editor.folder.join(file), text).expect("a file");
    };
    let chain = "    Chain c { from third.Grip.press; to brain.spare.press; within 1s; };\n};\n";
    let network = session.text("net.ddsl");
    let network = network.trim_end().strip_suffix("};").expect("an end");
    let network = format!("{network}{chain}");
    write(&session, "net.ddsl", &network);
    session.editor.change("net.ddsl", &network);
    session.renames("interfaces/Grip.idsl", "Forces pre", "squeeze");
    let renamed = "Chain c { from third.Grip.squeeze; to brain.spare.press; within 1s; };";
    assert!(session.log.contains(renamed), "{}", session.log);
    session.renames("hand.cdsl", "implements Gr", "fingers");
    let renamed = "Chain c { from third.fingers.press; to brain.spare.press; within 1s; };";
    assert!(session.log.contains(renamed), "{}", session.log);

    let uri = session.editor.uri("hand.cdsl");
    let closed = json!({ "textDocument": { "uri": uri } });
    session.editor.tell("textDocument/didClose", &closed);
    let _ = session
        .editor
        .ask("workspace/symbol", &json!({ "query": "hand" }));
    let text = format!("// One line more.\n{}", session.text("hand.cdsl"));
    write(&session, "hand.cdsl", &text);
    session.log.clear();
    session.renames("interfaces/Grip.idsl", "interface Gr", "Hold");
    assert!(session.log.contains("implements Hold"), "{}", session.log);

    let broken =
        "import \"../interfaces/Grip.idsl\";\nComponent brain { Communications { requires Grip";
    session.editor.change("brain/brain.cdsl", broken);
    session.log.clear();
    session.renames("interfaces/Grip.idsl", "interface Gr", "Hold");
    let refused = "refused: brain/brain.cdsl has `Grip` and a mistake";
    assert!(session.log.contains(refused), "{}", session.log);

    // Deep nesting does not end the server.
    session.editor.open("deep.cdsl", &"a{".repeat(50_000));
    let document = json!({ "uri": session.editor.uri("deep.cdsl") });
    let symbols = json!({ "textDocument": document });
    let symbols = session.editor.ask("textDocument/documentSymbol", &symbols);
    assert!(symbols.is_array(), "{symbols}");
    let positions =
        json!({ "textDocument": document, "positions": [{ "line": 0, "character": 99_000 }] });
    let ranges = session
        .editor
        .ask("textDocument/selectionRange", &positions);
    assert!(ranges[0]["range"].is_object(), "{ranges}");
    session.editor.end();
}
