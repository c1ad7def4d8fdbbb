//! Checks what docs/pdsl.md shows of configurations.

use rc_configuration::LiveParameters;
use rc_configuration::model::Parameters;
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;

const PAGE: &str = include_str!("../../../docs/pdsl.md");

/// The fenced code blocks with the tag `language`.
fn blocks(language: &str) -> Vec<&'static str> {
    let mut all = Vec::new();
    let mut fences = PAGE.split("```").skip(1);
    while let (Some(block), _) = (fences.next(), fences.next()) {
        let (mark, text) = block.split_once('\n').expect("a line with the mark");
        if mark.split(',').next() == Some(language) {
            all.push(text);
        }
    }
    all
}

fn load(text: &str) -> Parameters {
    let mut sources = SourceMap::new();
    let source = sources.add("page.pdsl", text);
    let (model, found) = rc_pdsl::load(&mut sources, &MemoryLoader::default(), source);
    assert_eq!(render(&sources, &found, Format::Short), "", "{text}");
    model.expect("parameters")
}

#[test]
fn the_configuration_on_the_page_breaks_the_rules_as_shown() {
    let model = load(blocks("pdsl")[0]);
    let mut sources = SourceMap::new();
    let source = sources.add("config.toml", blocks("toml")[0]);
    let (_, found) = rc_configuration::check(&sources, source, Some(&model));
    let rendered = render(&sources, &found, Format::Short);
    let shown = blocks("text").pop().expect("the messages");
    for (shown, said) in shown.lines().zip(rendered.lines()) {
        for part in shown.split(" … ") {
            assert!(said.contains(part), "{part}\n{said}");
        }
    }
    assert_eq!(
        shown.lines().count(),
        rendered.lines().count(),
        "{rendered}"
    );
}

#[test]
fn the_change_on_the_page_is_accepted() {
    let model = load(blocks("pdsl")[0]);
    let mut sources = SourceMap::new();
    let text = blocks("toml")[0].replace("id = 1\nmin = 2.0", "id = 2\nmin = 0.5");
    let source = sources.add("config.toml", text);
    let (configuration, found) = rc_configuration::check(&sources, source, Some(&model));
    assert_eq!(render(&sources, &found, Format::Short), "");
    let live = LiveParameters::new(model, &configuration.parameters);
    let words = blocks("console")[0].split_whitespace();
    let changes: Vec<_> = words.filter_map(|word| word.split_once('=')).collect();
    let changes: Vec<_> = changes
        .iter()
        .map(|(path, value)| (*path, rc_configuration::parse_argument(value)))
        .collect();
    let accepted = live.check(changes.iter().map(|(path, value)| (*path, value)));
    let accepted = accepted.expect("what the page shows");
    assert_eq!((accepted.changes.len(), accepted.pending.len()), (2, 1));
}
