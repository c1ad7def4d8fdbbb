//! Writes the parsers of grammars of tree-sitter: for each `NAME/src/grammar.json` below the first folder,
//! `NAME/parser.c` below the second one.

use std::error::Error;
use std::fs;
use std::path::PathBuf;
use tree_sitter_generate::{OptLevel, PARSER_HEADER, generate_parser_for_grammar};

fn main() -> Result<(), Box<dyn Error>> {
    let folders: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [grammars, parsers] = folders.as_slice() else {
        return Err("usage: generate_parsers GRAMMARS PARSERS".into());
    };
    for entry in fs::read_dir(grammars)? {
        let entry = entry?;
        let Ok(grammar) = fs::read_to_string(entry.path().join("src/grammar.json")) else {
            continue;
        };
        let mut notes = Vec::new();
        let (name, code) =
            generate_parser_for_grammar(&grammar, Some((0, 1, 0)), OptLevel::default(), &mut notes)
                .map_err(|error| format!("{}: {error}", entry.path().display()))?;
        let place = parsers.join(name);
        fs::create_dir_all(place.join("tree_sitter"))?;
        fs::write(place.join("parser.c"), code)?;
        fs::write(place.join("tree_sitter/parser.h"), PARSER_HEADER)?;
    }
    Ok(())
}
