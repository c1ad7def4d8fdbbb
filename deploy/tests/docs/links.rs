//! Links lead somewhere, those of the book to its own pages, and SUMMARY.md lists every page.

use crate::markdown::{ROOT, all, book};
use std::collections::BTreeSet;
use std::path::Path;

#[test]
fn no_link_is_dead() {
    let pages = all();
    let mut dead = Vec::new();
    let mut count = 0;
    for page in &pages {
        for (line, target) in page.links() {
            if target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            count += 1;
            let (file, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let path = match file {
                "" => Path::new(ROOT).join(&page.path),
                file => page.folder().join(file),
            };
            let there = path.canonicalize();
            let other = pages.iter().find(|other| {
                let other = Path::new(ROOT).join(&other.path).canonicalize();
                matches!((&there, other), (Ok(a), Ok(b)) if *a == b)
            });
            let found = match (anchor, other) {
                ("", _) => there.is_ok(),
                (anchor, Some(other)) => other.anchors().iter().any(|a| a == anchor),
                _ => false,
            };
            // The book holds the folder `docs` only.
            let book = Path::new(ROOT).join("docs").canonicalize();
            let is_in_book = page.path.starts_with("docs/");
            let leaves =
                matches!((&there, &book), (Ok(there), Ok(book)) if !there.starts_with(book));
            let found = found && !(is_in_book && leaves);
            if !found {
                dead.push(format!("{}:{line}: {target}", page.path));
            }
        }
    }
    assert!(dead.is_empty(), "dead links:\n{}", dead.join("\n"));
    assert!(count > 50, "only {count} links were found");
}

#[test]
fn the_summary_lists_every_page_once() {
    let listed: Vec<String> = book().into_iter().map(|page| page.path).collect();
    let unique: BTreeSet<&String> = listed.iter().collect();
    assert_eq!(unique.len(), listed.len(), "{listed:?}");
    for folder in ["docs", "docs/decisions", "docs/protocol"] {
        let entries = std::fs::read_dir(Path::new(ROOT).join(folder)).expect("the folder");
        for entry in entries {
            let name = entry.expect("an entry").file_name();
            let path = format!("{folder}/{}", name.to_string_lossy());
            let ending = Path::new(&path).extension();
            let is_page = ending == Some("md".as_ref()) && path != "docs/SUMMARY.md";
            assert!(
                !is_page || listed.contains(&path),
                "docs/SUMMARY.md does not list {path}"
            );
        }
    }
}
