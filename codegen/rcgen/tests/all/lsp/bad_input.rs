//! Files and clients that are not as they should be.

use super::{Editor, GRIP, HAND, spawn};
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;

fn write(folder: &Path, file: &str, text: impl AsRef<[u8]>) {
    std::fs::write(folder.join(file), text).expect("a file");
}

/// The definition of the name in the middle of `implements Grip`.
fn definition(editor: &mut Editor, file: &str) -> Value {
    let parameters = json!({
        "textDocument": { "uri": editor.uri(file) },
        "position": { "line": 6, "character": 21 },
    });
    editor.ask("textDocument/definition", &parameters)
}

#[test]
fn a_file_that_is_not_utf_8_hides_no_other_finding() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "Grip.idsl", [0x6d, 0xff, 0xfe, 0x00]);
    write(folder.path(), "hand.cdsl", HAND);
    write(
        folder.path(),
        "Other.idsl",
        GRIP.replace("float", "flaot").replace("Grip", "Other"),
    );
    let mut editor = Editor::open_folder(folder.path());
    editor.wait_for("hand.cdsl", &[("import-not-found", 0)]);
    editor.wait_for("Other.idsl", &[("unknown-type", 4)]);
    // The editor has another idea of its encoding: its text counts.
    editor.open("Grip.idsl", GRIP);
    editor.wait_for("hand.cdsl", &[]);
    editor.end();
}

#[test]
fn a_file_of_a_megabyte_is_checked_and_completed() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = Editor::open_folder(folder.path());
    let lines = "    // A line of a long file, which says nothing.\n".repeat(21_000);
    let text = GRIP.replace("    interface", &format!("{lines}    interface"));
    assert!(text.len() > 1 << 20);
    editor.open("Grip.idsl", &text);
    editor.change("Grip.idsl", &text.replace("float", "flaot"));
    editor.wait_for("Grip.idsl", &[("unknown-type", 21_004)]);
    let place = json!({
        "textDocument": { "uri": editor.uri("Grip.idsl") },
        "position": { "line": 21_004, "character": 20 },
    });
    let found = editor.ask("textDocument/completion", &place);
    let mut found = found.as_array().expect("a list").iter();
    assert!(found.any(|item| item["label"] == "float"));
    editor.end();
}

#[test]
fn a_circle_of_links_ends() {
    let folder = tempfile::tempdir().expect("a folder");
    let inner = folder.path().join("a/b");
    std::fs::create_dir_all(&inner).expect("a folder");
    for (link, to) in [("up", "../.."), ("self", "."), ("gone", "nowhere")] {
        std::os::unix::fs::symlink(to, inner.join(link)).expect("a link");
    }
    write(&inner, "Grip.idsl", GRIP.replace("float", "flaot"));
    let mut editor = Editor::open_folder(folder.path());
    editor.wait_for("a/b/Grip.idsl", &[("unknown-type", 4)]);
    let symbols = editor.ask("workspace/symbol", &json!({ "query": "press" }));
    assert_eq!(symbols.as_array().map(Vec::len), Some(1), "{symbols}");
    editor.end();
}

#[test]
fn an_import_outside_of_the_workspace_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let (inside, outside) = (folder.path().join("inside"), folder.path().join("outside"));
    for folder in [&inside, &outside] {
        std::fs::create_dir(folder).expect("a folder");
    }
    write(&outside, "Grip.idsl", GRIP);
    let hand = HAND.replace("Grip.idsl", "../outside/Grip.idsl");
    write(&inside, "hand.cdsl", &hand);
    let mut editor = Editor::open_folder(&inside);
    editor.open("hand.cdsl", &hand);
    let found = definition(&mut editor, "hand.cdsl");
    let address = found[0]["uri"].as_str().expect("an address");
    assert!(address.ends_with("/outside/Grip.idsl"), "{found}");
    // Nobody tells of its changes: they count when the component is saved.
    write(
        &outside,
        "Grip.idsl",
        GRIP.replace("interface Grip", "interface Grasp"),
    );
    let document = json!({ "textDocument": { "uri": editor.uri("hand.cdsl") } });
    editor.tell("textDocument/didSave", &document);
    editor.wait_for("hand.cdsl", &[("unknown-interface", 6)]);
    editor.end();
}

#[test]
fn two_clients_of_one_workspace_share_what_is_saved() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "Grip.idsl", GRIP);
    write(folder.path(), "hand.cdsl", HAND);
    let mut both = [0, 1].map(|_| Editor::open_folder(folder.path()));
    let other = GRIP.replace("interface Grip", "interface Grasp");
    both[0].open("Grip.idsl", &other);
    both[0].wait_for("hand.cdsl", &[("unknown-interface", 6)]);
    // The text of one client is not that of the other one.
    both[1].open("hand.cdsl", HAND);
    both[1].wait_for("hand.cdsl", &[]);
    assert!(!definition(&mut both[1], "hand.cdsl").is_null());
    write(folder.path(), "Grip.idsl", &other);
    let changed = json!({ "uri": both[1].uri("Grip.idsl"), "type": 2 });
    both[1].tell(
        "workspace/didChangeWatchedFiles",
        &json!({ "changes": [changed] }),
    );
    both[1].wait_for("hand.cdsl", &[("unknown-interface", 6)]);
    for editor in both {
        editor.end();
    }
}

#[test]
fn a_request_for_a_closed_file_is_answered_and_an_edit_of_it_ignored() {
    let folder = tempfile::tempdir().expect("a folder");
    write(folder.path(), "Grip.idsl", GRIP);
    write(folder.path(), "hand.cdsl", HAND);
    let mut editor = Editor::open_folder(folder.path());
    let document = json!({ "textDocument": { "uri": editor.uri("hand.cdsl") } });
    for _ in 0..2 {
        assert_eq!(definition(&mut editor, "hand.cdsl"), Value::Null);
        let formatted = editor.ask("textDocument/formatting", &document);
        assert_eq!(formatted, Value::Null);
        editor.change("hand.cdsl", "nothing of a component");
        editor.tell("textDocument/didClose", &document);
        editor.ask("workspace/symbol", &json!({ "query": "" }));
        editor.wait_for("hand.cdsl", &[]);
    }
    editor.open("hand.cdsl", HAND);
    assert!(!definition(&mut editor, "hand.cdsl").is_null());
    editor.end();
}

#[test]
fn an_edit_out_of_range_is_cut_off_or_ignored() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = Editor::open_folder(folder.path());
    editor.open("Grip.idsl", GRIP);
    let place = |line: i64, character: i64| json!({ "line": line, "character": character });
    for (start, end, text) in [
        // Behind the text, and behind a line.
        (place(9999, 0), place(9999, 1), "// the end"),
        (place(4, 9999), place(4, 9999), " // of the line"),
        (place(-1, 0), place(0, 0), "{"),
        (place(0, -5), place(0, 0), "{"),
        (place(4, 19), place(4, 24), "flaot"),
    ] {
        let document = json!({ "uri": editor.uri("Grip.idsl"), "version": 2 });
        let change = json!({ "range": { "start": start, "end": end }, "text": text });
        editor.tell(
            "textDocument/didChange",
            &json!({ "textDocument": document, "contentChanges": [change] }),
        );
    }
    editor.wait_for("Grip.idsl", &[("unknown-type", 4)]);
    editor.end();
}

/// An old component is shown as it is, without a wall of errors.
#[test]
fn a_component_of_robocomp_has_hints() {
    let folder = tempfile::tempdir().expect("a folder");
    let asked = GRIP.replace("void press", "int press");
    write(folder.path(), "Grip.idsl", asked);
    let old = "import \"/robocomp/interfaces/IDSLs/Grip.idsl\";\nimport \"/robocomp/interfaces/IDSLs/Nowhere.idsl\";\nComponent viewer\n{\n\tCommunications\n\t{\n\t\tsubscribesTo Grip;\n\t};\n\tlanguage Cpp11;\n};\n";
    write(folder.path(), "viewer.cdsl", old);
    let mut editor = Editor::open_folder(folder.path());
    let expected = [("import-not-found", 1), ("wrong-pattern", 6)];
    let severities = |found: Value| -> Vec<u64> {
        let all = found.as_array().expect("a list").iter();
        all.filter_map(|one| one["severity"].as_u64()).collect()
    };
    let found = editor.wait_for("viewer.cdsl", &expected);
    assert_eq!(severities(found), [3, 2]);
    // Generated code makes it a component of this project.
    std::fs::create_dir(folder.path().join("generated")).expect("a folder");
    editor.open("viewer.cdsl", &format!("{old}// Taken over.\n"));
    // All files are checked before this answer.
    editor.ask("workspace/symbol", &json!({ "query": "" }));
    let found = editor.wait_for("viewer.cdsl", &expected);
    assert_eq!(severities(found), [1, 1]);
    editor.end();
}

#[test]
fn hostile_input_ends_the_server_without_a_panic() {
    let deep = format!("Content-Length: 100000\r\n\r\n{}", "[".repeat(100_000));
    for input in [
        "Content-Length: 99999999999999\r\n\r\n{}",
        "Content-Length: 18446744073709551616\r\n\r\n",
        "Content-Length: 20000000\r\n\r\n",
        "Content-Length: x\r\n\r\n",
        "\r\n\r\n",
        "GET / HTTP/1.1\r\n\r\n",
        "Content-Length: 5\r\n\r\n{}",
        &"a".repeat(100_000),
    ] {
        let mut server = spawn();
        let mut pipe = server.stdin.take().expect("a pipe");
        // It may have ended before all is written.
        let _ = pipe.write_all(input.as_bytes());
        drop(pipe);
        let output = server.wait_with_output().expect("an end");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{text}");
        assert!(text.starts_with("rcgen: error: "), "{text}");
    }
    // A message that is not JSON, or too long, is answered; the next message is read.
    let long = "a".repeat(17 << 20);
    let exit = "Content-Length: 17\r\n\r\n{\"method\":\"exit\"}";
    for input in [
        deep,
        format!("Content-Length: {}\r\n\r\n{long}", long.len()),
    ] {
        let mut server = spawn();
        let mut pipe = server.stdin.take().expect("a pipe");
        pipe.write_all(input.as_bytes()).expect("written");
        pipe.write_all(exit.as_bytes()).expect("written");
        let output = server.wait_with_output().expect("an end");
        assert_eq!(output.status.code(), Some(1));
        let answer = String::from_utf8_lossy(&output.stdout);
        assert!(answer.contains("-32700"), "{answer}");
    }
    // Messages of any shape, before and after the start.
    let folder = tempfile::tempdir().expect("a folder");
    let mut editor = Editor::open_folder(folder.path());
    for message in [
        json!([]),
        json!(7),
        json!({ "method": 7 }),
        json!({ "method": "textDocument/didOpen" }),
        json!({ "method": "textDocument/didOpen", "params": { "textDocument": { "uri": "file:///%", "text": "" } } }),
        json!({ "method": "textDocument/didChange", "params": { "textDocument": { "uri": "file:///a.idsl" }, "contentChanges": [] } }),
        json!({ "method": "textDocument/didClose", "params": { "textDocument": { "uri": "file:///never/opened.idsl" } } }),
    ] {
        editor.send(&message);
    }
    let range = json!({ "start": { "line": u64::MAX, "character": -1 }, "end": {} });
    editor.open("Grip.idsl", GRIP);
    editor.open("hand.cdsl", HAND);
    let places = [
        json!(7),
        json!({ "line": u64::MAX, "character": u64::MAX }),
        json!({ "line": 4, "character": u64::MAX }),
        json!({ "line": -1, "character": 0.5 }),
        json!({ "line": 9999, "character": 0 }),
    ];
    for (file, place) in ["Grip.idsl", "hand.cdsl", "closed.idsl"]
        .iter()
        .flat_map(|file| places.iter().map(move |place| (file, place)))
    {
        let wrong = json!({
            "textDocument": { "uri": editor.uri(file) },
            "range": range,
            "position": place,
            "positions": [place],
            "newName": "x",
            "ch": ";",
        });
        for method in [
            "codeAction",
            "codeLens",
            "completion",
            "definition",
            "documentHighlight",
            "documentSymbol",
            "foldingRange",
            "formatting",
            "hover",
            "implementation",
            "inlayHint",
            "onTypeFormatting",
            "rangeFormatting",
            "references",
            "selectionRange",
            "semanticTokens/full",
            "signatureHelp",
        ] {
            editor.ask(&format!("textDocument/{method}"), &wrong);
        }
        let changes = json!([
            { "range": { "start": place, "end": place }, "text": "" },
            { "range": { "start": { "line": 9, "character": 1 }, "end": { "line": 2, "character": 9 } }, "text": "" },
            { "range": range },
            { "text": GRIP },
        ]);
        let document = json!({ "uri": editor.uri(file), "version": 3 });
        editor.tell(
            "textDocument/didChange",
            &json!({ "textDocument": document, "contentChanges": changes }),
        );
    }
    assert_eq!(
        editor.answer("initialize", &json!({}))["error"]["code"],
        -32600
    );
    editor.end();
}
