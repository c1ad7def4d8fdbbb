//! The colours of a text: what each word of it is.

use super::completion::is_keyword;
use super::editor::Editor;
use super::known_files::KnownFiles;
use super::names::{Kind, Names};
use crate::languages::Language;
use rc_syntax::TokenKind;
use rc_vocabulary::Primitive;
use serde_json::{Value, json};
use std::path::Path;

/// The kinds of words, in the order in which the protocol numbers them here.
pub(super) const KINDS: [&str; 14] = [
    "namespace",
    "type",
    "enumMember",
    "interface",
    "method",
    "class",
    "variable",
    "parameter",
    "property",
    "keyword",
    "string",
    "number",
    "comment",
    "decorator",
];

/// The modifiers, in their order.
pub(super) const MODIFIERS: [&str; 1] = ["declaration"];

/// The most words of a text with colours.
const MOST: usize = 100_000;

/// A word of a text.
struct Word {
    start: usize,
    end: usize,
    kind: usize,
    declares: bool,
}

/// The words of an open file, as the protocol has them: each by its distance to the one before.
pub(super) fn words(files: &KnownFiles, editor: &Editor, path: &Path) -> Value {
    let Some(document) = editor.document(path) else {
        return Value::Null;
    };
    let text = document.text.as_str();
    let names = files.get(path);
    let names = names.filter(|names| names.text.as_str() == text);
    let mut words = names.map_or_else(Vec::new, named);
    if let Some(language) = Language::of(path) {
        lexical(text, language.extension, &mut words);
    }
    words.sort_by_key(|word| (word.start, word.end));
    let mut data = Vec::new();
    let (mut line_before, mut start_before, mut end) = (0, 0, 0);
    for word in words.iter().take(MOST) {
        if word.start < end {
            continue;
        }
        end = word.end;
        // A word that has several lines has several parts: not all editors take more.
        for line in document.text.line(word.start)..=document.text.line(word.end) {
            let Some((first, last)) = document.text.bytes_of_line(line) else {
                continue;
            };
            let (start, stop) = (word.start.max(first), word.end.min(last));
            let count = |from, to| {
                editor
                    .encoding()
                    .count(text.get(from..to).unwrap_or_default())
            };
            if start >= stop {
                continue;
            }
            // Counted from the previous word, because a line may be long.
            let from = if line == line_before {
                start_before.max(first)
            } else {
                first
            };
            let (distance, length) = (count(from, start), count(start, stop));
            let modifiers = usize::from(word.declares);
            data.extend([line - line_before, distance, length, word.kind, modifiers]);
            (line_before, start_before) = (line, start);
        }
    }
    json!({ "data": data })
}

fn number(name: &str) -> usize {
    KINDS.iter().position(|kind| *kind == name).unwrap_or(0)
}

/// The places of names.
fn named(names: &Names) -> Vec<Word> {
    let places = names.places.iter().filter_map(|place| {
        let symbols = place.symbols.iter();
        let mut kinds = symbols.map(|symbol| symbol.kind);
        let kind = match kinds.find(|kind| *kind != Kind::File)? {
            Kind::File => return None,
            Kind::Module | Kind::Network | Kind::Group => "namespace",
            Kind::Constant | Kind::Member | Kind::Slot | Kind::OfGroup | Kind::BesideExport => {
                "property"
            }
            Kind::Type => "type",
            Kind::Interface => "interface",
            Kind::Operation | Kind::OfSlot => "method",
            Kind::Component | Kind::Machine => "class",
            Kind::Parameter | Kind::OfComponent => "parameter",
            Kind::State => "enumMember",
            Kind::Host | Kind::Process | Kind::Instance | Kind::ArrayMember => "variable",
        };
        // A file is named in a string.
        let text = names.text.as_str().get(place.start..place.end)?;
        (!text.starts_with('"')).then_some(Word {
            start: place.start,
            end: place.end,
            kind: number(kind),
            declares: place.declares,
        })
    });
    places.collect()
}

/// Keywords, types of the language, strings, numbers and comments, where no name is.
fn lexical(text: &str, extension: &str, words: &mut Vec<Word>) {
    let mut named: Vec<(usize, usize)> = words.iter().map(|word| (word.start, word.end)).collect();
    named.sort_unstable();
    let mut before = "";
    for token in rc_syntax::tokens(text) {
        let end = token.start + token.text.len();
        let kind = match token.kind {
            TokenKind::Comment => Some("comment"),
            TokenKind::String => Some("string"),
            TokenKind::Word if before == "@" => Some("decorator"),
            TokenKind::Word if token.text.starts_with(|c: char| c.is_ascii_digit()) => {
                Some("number")
            }
            TokenKind::Word if extension == "idsl" && is_type(token.text) => Some("type"),
            TokenKind::Word if is_keyword(extension, token.text) => Some("keyword"),
            TokenKind::Word | TokenKind::Punctuation => None,
        };
        before = token.text;
        let at = named.partition_point(|(_, stop)| *stop <= token.start);
        let is_named = named.get(at).is_some_and(|(start, _)| *start < end);
        if let Some(kind) = kind.filter(|_| !is_named) {
            words.push(Word {
                start: token.start,
                end,
                kind: number(kind),
                declares: false,
            });
        }
    }
}

fn is_type(word: &str) -> bool {
    Primitive::from_idsl(word).is_some() || matches!(word, "string" | "void")
}
