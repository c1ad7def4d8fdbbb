//! Links of findings to their pages, which an editor opens without a network.

use super::{Editor, spawn_with};
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

const WRONG: &str = "module M { struct S { strign a; }; };\n";

/// A server whose caches are in a folder.
fn editor(folder: &Path, caches: &Path, capabilities: &Value) -> Editor {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rcgen"));
    command.env("XDG_CACHE_HOME", caches);
    Editor::open_with(folder, spawn_with(command), capabilities)
}

#[test]
fn a_finding_leads_to_its_page_on_disk() {
    let folder = tempfile::tempdir().expect("a folder");
    let caches = tempfile::tempdir().expect("a folder");
    let links =
        json!({ "textDocument": { "publishDiagnostics": { "codeDescriptionSupport": true } } });
    let mut other = editor(folder.path(), caches.path(), &json!({}));
    other.open("m.idsl", WRONG);
    let found = other.wait_for("m.idsl", &[("unknown-type", 0)]);
    // An editor that knows no links gets none, and nothing is written.
    assert_eq!(found[0].get("codeDescription"), None);
    other.end();
    let pages = caches.path().join("robocomp/explain");
    assert!(!pages.exists());

    let page = pages.join("unknown-type.md");
    let address = format!("file://{}", page.display());
    let told = crate::rcgen::succeeds(folder.path(), &["explain", "unknown-type"]);
    let expected = format!("# {told}");
    // A page of an older version is replaced.
    for before in [None, Some("older"), Some(expected.as_str())] {
        if let Some(before) = before {
            std::fs::write(&page, before).expect("a file");
        }
        let mut editor = editor(folder.path(), caches.path(), &links);
        editor.open("m.idsl", WRONG);
        let found = editor.wait_for("m.idsl", &[("unknown-type", 0)]);
        assert_eq!(found[0]["codeDescription"]["href"], address.as_str());
        assert_eq!(std::fs::read_to_string(&page).expect("a page"), expected);
        // The fix of a finding with a link is found, too.
        assert_eq!(editor.fixes("m.idsl"), ["0:22 Write `string`"]);
        editor.end();
    }
    let all = std::fs::read_dir(&pages).expect("a folder").count();
    assert_eq!(all, 1, "half-written pages");
}

#[test]
fn a_folder_for_caches_that_takes_no_pages_hides_no_finding() {
    let folder = tempfile::tempdir().expect("a folder");
    let caches = folder.path().join("no-folder");
    std::fs::write(&caches, "").expect("a file");
    let links =
        json!({ "textDocument": { "publishDiagnostics": { "codeDescriptionSupport": true } } });
    let mut editor = editor(folder.path(), &caches, &links);
    editor.open("m.idsl", WRONG);
    let found = editor.wait_for("m.idsl", &[("unknown-type", 0)]);
    assert_eq!(found[0].get("codeDescription"), None);
    editor.end();
}
