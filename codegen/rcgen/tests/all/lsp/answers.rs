//! One answer of each request about a whole file, in a workspace with one file of each kind.

use super::workspace::Session;
use expect_test::expect_file;
use serde_json::{Value, json};

const ALL: [&str; 10] = [
    "interfaces/Units.idsl",
    "interfaces/Grip.idsl",
    "hand.cdsl",
    "brain/brain.cdsl",
    "hand.smdsl",
    "hand.pdsl",
    "etc/config.toml",
    "inner.ddsl",
    "net.ddsl",
    "src/specific_worker.rs",
];

fn whole() -> Value {
    json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 9999, "character": 0 } })
}

impl Session {
    fn of_file(&mut self, request: &str, file: &str) -> Value {
        let parameters = json!({
            "textDocument": { "uri": self.editor.uri(file) },
            "range": whole(),
        });
        let method = format!("textDocument/{request}");
        self.editor.ask(&method, &parameters)
    }

    /// The part of a file's text in a range, in one line.
    fn part(&self, file: &str, range: &Value) -> String {
        let text = self.text(file);
        let lines: Vec<&str> = text.split('\n').collect();
        let byte = |position: &Value| {
            let number = |value: &Value| value.as_u64().expect("a number") as usize;
            let before = &lines[..number(&position["line"])];
            let start: usize = before.iter().map(|line| line.len() + 1).sum();
            start + number(&position["character"])
        };
        let part = &text[byte(&range["start"])..byte(&range["end"])];
        part.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    fn tree(&mut self, file: &str, symbols: &Value, depth: usize) {
        for symbol in symbols.as_array().expect("symbols") {
            let selected = self.part(file, &symbol["selectionRange"]);
            assert_eq!(symbol["name"], selected);
            let whole = self.part(file, &symbol["range"]);
            let detail = symbol["detail"].as_str().expect("a detail");
            let line = format!(
                "{}{} ({}) {detail} | {whole}",
                "    ".repeat(depth),
                symbol["name"].as_str().expect("a name"),
                symbol["kind"],
            );
            self.log.push_str(&format!("{}\n", line.trim_end()));
            self.tree(file, &symbol["children"], depth + 1);
        }
    }
}

#[test]
fn the_symbols_of_a_file_are_a_tree() {
    let mut session = Session::new();
    for file in ALL {
        let symbols = session.of_file("documentSymbol", file);
        session.log.push_str(&format!("# {file}\n"));
        session.tree(file, &symbols, 1);
    }
    // A broken text has the symbols of its blocks.
    session
        .editor
        .change("net.ddsl", "Deployment x { Component a { cdsl \"");
    let symbols = session.of_file("documentSymbol", "net.ddsl");
    assert_eq!(symbols[0]["name"], "x");
    assert_eq!(symbols[0]["children"][0]["name"], "a");
    session.editor.end();
    expect_file!["answers/symbols.txt"].assert_eq(&session.log);
}

#[test]
fn symbols_of_all_files_are_found_by_their_letters() {
    let mut session = Session::new();
    for query in ["gr", "force", "ha", "mtr", "nothing"] {
        let found = session
            .editor
            .ask("workspace/symbol", &json!({ "query": query }));
        session.log.push_str(&format!("{query}\n"));
        for symbol in found.as_array().expect("symbols") {
            let (name, kind) = (&symbol["name"], &symbol["kind"]);
            let around = symbol["containerName"].as_str().expect("a text");
            let line = &symbol["location"]["range"]["start"]["line"];
            session
                .log
                .push_str(&format!("    {name} ({kind}) {around}:{line}\n"));
        }
    }
    session.editor.end();
    expect_file!["answers/workspace.txt"].assert_eq(&session.log);
}

#[test]
fn blocks_comments_and_imports_fold() {
    let mut session = Session::new();
    let text = "// a\n// b\nimport \"Grip.idsl\";\nimport \"Units.idsl\";\n/* c\n*/\nComponent x\n{\n    Communications { requires Grip;\n    };\n    language rust;\n};\n";
    session.editor.change("brain/brain.cdsl", text);
    for file in ["brain/brain.cdsl", "hand.smdsl", "etc/config.toml"] {
        let folds = session.of_file("foldingRange", file);
        session.log.push_str(&format!("# {file}\n"));
        for fold in folds.as_array().expect("folds") {
            let (from, to) = (&fold["startLine"], &fold["endLine"]);
            let kind = fold["kind"].as_str().unwrap_or("block");
            session.log.push_str(&format!("    {from}-{to} {kind}\n"));
        }
    }
    session.editor.end();
    expect_file!["answers/folds.txt"].assert_eq(&session.log);
}

#[test]
fn a_selection_grows_from_the_word_to_the_file() {
    let mut session = Session::new();
    for (file, line, character) in [
        ("interfaces/Grip.idsl", 7, 30),
        ("hand.cdsl", 6, 21),
        ("net.ddsl", 15, 11),
        ("etc/config.toml", 7, 1),
    ] {
        let parameters = json!({
            "textDocument": { "uri": session.editor.uri(file) },
            "positions": [{ "line": line, "character": character }],
        });
        let answer = session
            .editor
            .ask("textDocument/selectionRange", &parameters);
        session.log.push_str(&format!("# {file}\n"));
        let mut range = &answer[0];
        while range.is_object() {
            let part = session.part(file, &range["range"]);
            let short: String = part.chars().take(70).collect();
            session.log.push_str(&format!("    {short}\n"));
            range = &range["parent"];
        }
    }
    session.editor.end();
    expect_file!["answers/selections.txt"].assert_eq(&session.log);
}

#[test]
fn each_word_has_its_colour() {
    let mut session = Session::new();
    let kinds = [
        "namespace",
        "type",
        "enumMember",
        "interface",
        "method",
        "class",
        "variable",
        "parameter",
        "property",
        "keyword",
        "string",
        "number",
        "comment",
        "decorator",
    ];
    for file in ALL {
        let answer = session.of_file("semanticTokens/full", file);
        let text = session.text(file);
        let lines: Vec<&str> = text.split('\n').collect();
        let data = answer["data"].as_array().expect("numbers");
        let number = |value: &Value| value.as_u64().expect("a number") as usize;
        let (mut line, mut character) = (0, 0);
        session.log.push_str(&format!("# {file}\n"));
        for word in data.chunks(5) {
            let forward = number(&word[0]);
            line += forward;
            let before = if forward == 0 { character } else { 0 };
            character = before + number(&word[1]);
            let shown = &lines[line][character..character + number(&word[2])];
            let mark = if word[4] == 1 { " declared" } else { "" };
            let kind = kinds[number(&word[3])];
            session
                .log
                .push_str(&format!("    {} {shown} {kind}{mark}\n", line + 1));
        }
    }
    session.editor.end();
    expect_file!["answers/colours.txt"].assert_eq(&session.log);
}

#[test]
fn what_a_text_does_not_say_stands_beside_it() {
    let mut session = Session::new();
    let units = session.text("interfaces/Units.idsl");
    let aliases = "    sequence<Force, 4> Forces;\n    dictionary<string, Side> Sides;\n";
    let holder = "    struct Hold\n    {\n        Forces forces;\n        Sides sides;\n    };\n";
    let units = units.replace("    exception", &format!("{aliases}{holder}    exception"));
    let path = session.editor.folder.join("interfaces/Units.idsl");
    std::fs::write(path, &units).expect("a file");
    session.editor.change("interfaces/Units.idsl", &units);
    for file in ALL {
        let hints = session.of_file("inlayHint", file);
        session.log.push_str(&format!("# {file}\n"));
        for hint in hints.as_array().into_iter().flatten() {
            let line = hint["position"]["line"].as_u64().expect("a line") as usize;
            let written = session.text(file);
            let written = written
                .split('\n')
                .nth(line)
                .expect("a line")
                .trim()
                .to_owned();
            let label = hint["label"].as_str().expect("a label");
            session.log.push_str(&format!("    {written} | {label}\n"));
        }
        let lenses = session.of_file("codeLens", file);
        for lens in lenses.as_array().into_iter().flatten() {
            let named = session.part(file, &lens["range"]);
            let title = lens["command"]["title"].as_str().expect("a title");
            let command = lens["command"]["command"].as_str().expect("a command");
            session
                .log
                .push_str(&format!("    {named} [{title}] {command}\n"));
        }
    }
    // A handler is deleted, and not saved.
    let worker = session.text("src/specific_worker.rs");
    let without = worker.replace("    fn open(&mut self) {}\n", "");
    session.editor.change("src/specific_worker.rs", &without);
    let lenses = session.of_file("codeLens", "hand.cdsl");
    let titles = lenses.as_array().expect("lenses").iter();
    let titles: Vec<&Value> = titles.map(|lens| &lens["command"]["title"]).collect();
    assert_eq!(
        titles,
        ["Generate", "2 networks use this", "1 handler missing"]
    );
    let name = &lenses[0]["range"];
    let mut asked = |range: &Value| {
        let parameters = json!({
            "textDocument": { "uri": session.editor.uri("hand.cdsl") },
            "range": range,
            "context": { "diagnostics": [], "only": ["quickfix"] },
        });
        let actions = session.editor.ask("textDocument/codeAction", &parameters);
        let actions = actions.as_array().expect("actions").iter();
        let commands = actions.map(|action| action["command"].clone());
        commands.collect::<Vec<_>>()
    };
    let elsewhere = json!({ "line": 0, "character": 0 });
    assert!(asked(&json!({ "start": elsewhere, "end": elsewhere })).is_empty());
    let commands = asked(name);
    let stubs = json!({
        "title": "Print the stubs of 1 missing handler",
        "command": "rcgen.missing",
        "arguments": [session.editor.uri("hand.cdsl")],
    });
    assert_eq!(commands, [stubs]);
    session.editor.end();
    expect_file!["answers/hints.txt"].assert_eq(&session.log);
}

#[test]
fn bind_says_what_it_takes() {
    let mut session = Session::new();
    for typed in [
        "bind ",
        "bind brain.hands.left -> ",
        "bind brain.spare -> arm.",
        "host ",
    ] {
        let text = session.text("net.ddsl");
        let old = "bind brain.hands.left -> arm.Grip;";
        let line = text
            .lines()
            .position(|line| line.contains(old))
            .expect("a line");
        session.editor.change("net.ddsl", &text.replace(old, typed));
        let parameters = json!({
            "textDocument": { "uri": session.editor.uri("net.ddsl") },
            "position": { "line": line, "character": typed.len() + 4 },
        });
        let answer = session
            .editor
            .ask("textDocument/signatureHelp", &parameters);
        session.log.push_str(&format!("{typed}▮\n"));
        let signature = &answer["signatures"][0];
        if let Some(label) = signature["label"].as_str() {
            let active = answer["activeParameter"].as_u64().expect("a number") as usize;
            let part = &signature["parameters"][active]["label"];
            let number = |value: &Value| value.as_u64().expect("a number") as usize;
            let active = &label[number(&part[0])..number(&part[1])];
            session.log.push_str(&format!("    {label} | {active}\n"));
            let doc = signature["documentation"]["value"]
                .as_str()
                .expect("a text");
            for line in doc.lines() {
                session.log.push_str(&format!("    {line}\n"));
            }
        }
    }
    session.editor.end();
    expect_file!["answers/signature.txt"].assert_eq(&session.log);
}

#[test]
fn a_configuration_that_lacks_parameters_is_updated_by_a_command() {
    let mut session = Session::new();
    let file = "etc/config.toml";
    let text = "[parameters]\nfingers = 4\nspead = 0.5\n";
    session.editor.change(file, text);
    let uri = session.editor.uri(file);
    let mut ask = |line: u64| {
        let at = json!({ "line": line, "character": 1 });
        let parameters = json!({
            "textDocument": { "uri": uri },
            "range": { "start": at, "end": at },
            "context": { "diagnostics": [] },
        });
        let actions = session.editor.ask("textDocument/codeAction", &parameters);
        let actions = actions.as_array().expect("actions").clone();
        let commands = actions.into_iter().map(|action| action["command"].clone());
        commands
            .filter(|command| !command.is_null())
            .collect::<Vec<_>>()
    };
    let expected = json!({
        "title": "Update the configuration",
        "command": "rcgen.updateConfiguration",
        "arguments": [uri],
    });
    assert_eq!(ask(0), [expected]);
    assert_eq!(ask(1), Vec::<Value>::new());
    session.editor.end();
}
