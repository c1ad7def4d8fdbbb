//! Checks the examples on docs/ddsl.md, and that the page lists every diagnostic.

use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

const PAGE: &str = include_str!("../../../docs/ddsl.md");

/// The examples on the page, in order.
fn examples() -> Vec<&'static str> {
    let blocks = PAGE.split("```ddsl\n").skip(1);
    blocks
        .map(|block| block.split("```").next().unwrap_or_default())
        .collect()
}

#[test]
fn every_example_is_valid() {
    let (files, parts): (Vec<&str>, Vec<&str>) = examples()
        .into_iter()
        .partition(|e| e.contains("Deployment "));
    assert!(files.len() >= 3 && parts.len() >= 3);
    // The first line of an imported file is a comment with its name.
    let named = files.iter().filter_map(|text| {
        let (first, _) = text.split_once('\n')?;
        Some((first.strip_prefix("// ")?, *text))
    });
    let loader = MemoryLoader::new(named);
    for text in &files {
        let mut sources = SourceMap::new();
        let source = sources.add("page.ddsl", *text);
        let (deployment, found) = rc_ddsl::load(&mut sources, &loader, source);
        assert_eq!(render(&sources, &found, Format::Short), "", "{text}");
        assert!(deployment.is_some());
    }
    for text in parts {
        let mut sources = SourceMap::new();
        let source = sources.add("page.ddsl", format!("Deployment page {{\n{text}}};"));
        let (_, found) = rc_ddsl::parse(&sources, source);
        assert_eq!(render(&sources, &found, Format::Short), "", "{text}");
    }
}

#[test]
fn every_diagnostic_is_on_the_page() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src");
    let mut codes = Vec::new();
    for entry in std::fs::read_dir(folder).expect("the sources").flatten() {
        let text = std::fs::read_to_string(entry.path()).expect("a source");
        for kind in ["error", "warning", "note"] {
            let call = format!("Diagnostic::{kind}(");
            let made = text.split(&call).skip(1);
            codes.extend(made.filter_map(|rest| Some(rest.split('"').nth(1)?.to_owned())));
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
