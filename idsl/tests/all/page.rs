//! Checks the examples on docs/idsl.md.

use rc_diagnostics::{Format, SourceMap, Span, render};
use rc_syntax::MemoryLoader;

const PAGE: &str = include_str!("../../../docs/idsl.md");

#[test]
fn every_file_on_the_page_is_valid() {
    let files: Vec<&str> = PAGE.split("```idsl\n").skip(1).collect();
    assert!(!files.is_empty());
    for text in files {
        let text = text.split("```").next().unwrap_or_default();
        let base = include_str!("../../../components/interfaces/GenericBase.idsl");
        let loader = MemoryLoader::new([("GenericBase.idsl", base)]);
        let mut sources = SourceMap::new();
        let source = sources.add("page.idsl", text);
        let mut session = rc_idsl::Session::new(&mut sources, &loader);
        session.load_source(source, "page.idsl".into(), Span::new(source, 0, 0));
        let found = session.found;
        assert_eq!(render(&sources, &found, Format::Short), "", "{text}");
    }
}
