//! Checks the examples on docs/smdsl.md.

use rc_diagnostics::{Format, SourceMap, render};

const PAGE: &str = include_str!("../../../docs/smdsl.md");

/// The code blocks of the page that contain whole files of a language.
fn files(language: &str) -> Vec<&'static str> {
    let begin = format!("```{language}\n");
    let blocks = PAGE.split(begin.as_str()).skip(1);
    blocks.filter_map(|b| b.split("```").next()).collect()
}

#[test]
fn every_file_on_the_page_is_valid() {
    for language in ["smdsl", "scxml"] {
        let files = files(language);
        assert!(!files.is_empty(), "{language}");
        for text in files {
            let mut sources = SourceMap::new();
            let source = sources.add(format!("page.{language}"), text);
            let (machine, found) = rc_smdsl::load(&sources, source);
            assert_eq!(render(&sources, &found, Format::Short), "", "{text}");
            assert!(machine.is_some());
        }
    }
}

#[test]
fn every_diagnostic_is_on_the_page() {
    let sources = [
        include_str!("../../src/check.rs"),
        include_str!("../../src/parse.rs"),
        include_str!("../../src/resolve.rs"),
        include_str!("../../src/scxml.rs"),
        include_str!("../../src/scxml/xml.rs"),
        include_str!("../../src/builder.rs"),
    ];
    let quoted = sources.iter().flat_map(|s| s.split('"').skip(1).step_by(2));
    let codes = quoted.filter(|text| {
        text.contains('-') && text.bytes().all(|b| b == b'-' || b.is_ascii_lowercase())
    });
    let missing: Vec<&str> = codes
        .filter(|code| !PAGE.contains(&format!("`{code}`")))
        .collect();
    assert_eq!(missing, [""; 0]);
}
