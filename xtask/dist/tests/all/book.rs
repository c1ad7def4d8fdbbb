//! The book: its pages are written, and their links lead somewhere. `cargo xtask book` adds the API.

use std::fs;
use std::process::Command;

#[test]
fn the_book_is_written_and_its_links_lead_somewhere() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("book");
    let output = Command::new(env!("CARGO_BIN_EXE_dist"))
        .args(["book", "--no-api", "--out"])
        .arg(&out)
        .output()
        .expect("a program that starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let page = fs::read_to_string(out.join("protocol/files.html")).expect("a page");
    for part in [
        "<link rel=\"stylesheet\" href=\"../style.css\">",
        "aria-current=\"page\"",
        ">Next: ",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let index = fs::read_to_string(out.join("index.html")).expect("a page");
    assert!(index.contains("href=\"first-component.html\""), "{index}");
    let search = fs::read_to_string(out.join("search.js")).expect("a script");
    assert!(search.contains("\"concepts.html#"), "{search}");
}
