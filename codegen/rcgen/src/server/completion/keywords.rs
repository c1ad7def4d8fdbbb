//! The keywords of the languages, by the block in which they are allowed, with their meanings.

mod data;
mod inside;
mod markup;
mod statements;

pub(super) use data::DATA;
pub(super) use inside::INSIDE;
pub(super) use markup::{ATTRIBUTES, ELEMENTS, URDF};
pub(super) use statements::STATEMENTS;

/// A keyword with its meaning.
pub(super) type Keyword = (&'static str, &'static str);

const CONDITION: &[Keyword] = &[
    ("and", "Both conditions hold."),
    ("or", "One of the conditions holds."),
    ("not", "The condition does not hold."),
];

/// The keywords of a place in one of the tables.
pub(super) fn of(
    table: &[(&'static str, &'static str, &'static [Keyword])],
    language: &str,
    place: &str,
) -> &'static [Keyword] {
    let row = table
        .iter()
        .find(|(known, of, _)| *known == language && *of == place);
    row.map_or(&[], |(_, _, keywords)| keywords)
}

/// Whether a word is a keyword somewhere in a language.
pub(super) fn is_known(language: &str, word: &str) -> bool {
    let all = STATEMENTS.iter().chain(&INSIDE).chain(&DATA);
    let mut own = all.filter(|(of, ..)| *of == language);
    let fits = |known: &str| known.eq_ignore_ascii_case(word);
    own.any(|(_, _, keywords)| keywords.iter().any(|(known, _)| fits(known)))
        || ELSEWHERE.iter().any(|known| fits(known))
}

/// Words of older files, and those that the tables of the server have elsewhere.
const ELSEWHERE: [&str; 4] = ["request", "transition", "available", "string"];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Each keyword of the grammars is offered somewhere, and nothing else.
    #[test]
    fn the_keywords_of_the_grammars_are_known() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        for (language, place) in [
            ("idsl", "idsl"),
            ("cdsl", "cdsl"),
            ("ddsl", "ddsl"),
            ("pdsl", "pdsl"),
            ("smdsl", "smdsl"),
            ("gdsl", "graph/language"),
            ("dproto", "prototypes"),
            ("kdsl", "kinematics"),
        ] {
            let read = |file: &str| std::fs::read_to_string(folder.join(file)).expect("a grammar");
            let mut grammar = read(&format!("{place}/src/grammar.pest"));
            if grammar.contains("condition.pest") {
                grammar += &read("pdsl/src/condition.pest");
            }
            let lines = grammar.lines().filter(|line| line.starts_with("kw_"));
            let words = lines.flat_map(|line| {
                let words = line.split('"').skip(1).step_by(2);
                words.filter(|word| word.starts_with(|c: char| c.is_ascii_alphabetic()))
            });
            let words: BTreeSet<String> = words.map(str::to_ascii_lowercase).collect();
            let offered = STATEMENTS.iter().chain(&INSIDE).chain(&DATA);
            let offered = offered.filter(|(of, ..)| *of == language);
            let offered: BTreeSet<String> = offered
                .flat_map(|(_, _, all)| all.iter())
                .map(|(word, _)| word.to_ascii_lowercase())
                .collect();
            let missing: Vec<&String> = words
                .iter()
                .filter(|word| !offered.contains(*word) && !ELSEWHERE.contains(&word.as_str()))
                .collect();
            assert!(missing.is_empty(), "{language}: {missing:?}");
        }
    }
}
