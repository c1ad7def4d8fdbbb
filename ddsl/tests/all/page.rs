//! docs/ddsl.md lists every diagnostic.

use std::path::Path;

const PAGE: &str = include_str!("../../../docs/ddsl.md");

#[test]
fn every_diagnostic_is_on_the_page() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src");
    let mut codes = Vec::new();
    let files = |folder: &Path| {
        let entries = std::fs::read_dir(folder).expect("the sources").flatten();
        entries.map(|entry| entry.path()).collect::<Vec<_>>()
    };
    let mut left = files(Path::new(folder));
    while let Some(path) = left.pop() {
        if path.is_dir() {
            left.extend(files(&path));
            continue;
        }
        let text = std::fs::read_to_string(path).expect("a source");
        for kind in ["error", "warning", "note"] {
            let call = format!("Diagnostic::{kind}(");
            let made = text.split(&call).skip(1);
            // Other calls have a code of another place: `refusal.code()`.
            let quoted = made.filter_map(|rest| rest.trim_start().strip_prefix('"'));
            codes.extend(quoted.filter_map(|rest| Some(rest.split('"').next()?.to_owned())));
        }
    }
    assert!(codes.len() > 30, "{codes:?}");
    for code in codes {
        assert!(
            PAGE.contains(&format!("`{code}`")),
            "{code} is not on the page"
        );
    }
}
