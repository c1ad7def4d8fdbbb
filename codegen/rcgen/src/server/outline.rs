//! The symbols of a file and of all files, foldable ranges, and the ranges around a position.

use super::editor::Editor;
use super::known_files::KnownFiles;
use super::names::{Kind, Names};
use super::place::Text;
use super::structure::{self, Structure};
use serde_json::{Value, json};
use std::path::Path;

/// The most symbols of all files in an answer.
const MOST: usize = 500;

/// The most folds of a file.
const MOST_FOLDS: usize = 5_000;

/// The most positions of a request.
const MOST_POSITIONS: usize = 100;

/// The most symbols of one file.
const MOST_SYMBOLS: usize = 2_000;

/// The greatest nesting of symbols and ranges: both become values that are written by recursion.
const MOST_DEPTH: usize = 32;

/// A symbol of a file.
struct Node {
    name: String,
    detail: String,
    kind: u8,
    /// All of it, and its name, as bytes.
    range: (usize, usize),
    own: (usize, usize),
    children: Vec<Node>,
}

/// The symbols of an open file, as a tree.
pub(super) fn symbols_of(files: &KnownFiles, editor: &Editor, path: &Path) -> Value {
    let Some(document) = editor.document(path) else {
        return Value::Null;
    };
    let text = document.text.as_str();
    let names = files.get(path);
    let names = names.filter(|names| names.text.as_str() == text);
    let mut nodes = names.map_or_else(Vec::new, declared);
    if nodes.is_empty() {
        nodes = blocks(path, text);
    }
    let nodes = tree(nodes);
    let nodes = nodes.iter().map(|node| shown(editor, &document.text, node));
    json!(nodes.collect::<Vec<_>>())
}

fn shown(editor: &Editor, text: &Text, node: &Node) -> Value {
    let range = |(start, end)| editor.range(text, start, end);
    let children = node.children.iter().map(|child| shown(editor, text, child));
    json!({
        "name": node.name,
        "detail": node.detail,
        "kind": node.kind,
        "range": range(node.range),
        "selectionRange": range(node.own),
        "children": children.collect::<Vec<_>>(),
    })
}

/// The symbols of all files whose names have the letters of `query` in their order: those that begin
/// with it first.
pub(super) fn symbols_like(files: &KnownFiles, editor: &Editor, query: &str) -> Value {
    let mut found = Vec::new();
    for (path, names) in files.iter() {
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        for place in names.places.iter().filter(|place| place.declares) {
            let mut symbols = place.symbols.iter();
            let Some(symbol) = symbols.find(|symbol| symbol.kind != Kind::File) else {
                continue;
            };
            let (around, name) = match symbol.name.rsplit_once('.') {
                Some((around, name)) => (format!("{around} in {file}"), name),
                None => (file.to_string(), symbol.name.as_str()),
            };
            let name = name.split('#').next().unwrap_or(name);
            if let Some(rank) = rank(name, query) {
                found.push((rank, name, path, place, around, symbol.kind, names));
            }
        }
    }
    found.sort_by_key(|(rank, name, path, place, ..)| (*rank, *name, *path, place.start));
    let shown = found.iter().take(MOST);
    let shown = shown.map(|(_, name, path, place, around, kind, names)| {
        json!({
            "name": name,
            "kind": number(*kind),
            "containerName": around,
            "location": editor.location(path, &names.text, place.start, place.end),
        })
    });
    json!(shown.collect::<Vec<_>>())
}

/// The folds of an open file.
pub(super) fn folds(editor: &Editor, path: &Path) -> Value {
    let Some(document) = editor.document(path) else {
        return Value::Null;
    };
    let text = document.text.as_str();
    let with_braces = crate::languages::Language::of(path).is_some();
    let mut folds = if with_braces {
        Structure::of(text).folds()
    } else {
        let blocks = structure::blocks(path, text).into_iter();
        blocks.map(|block| (block.start, block.end, None)).collect()
    };
    folds.truncate(MOST_FOLDS);
    let lines = folds.into_iter().filter_map(|(start, end, kind)| {
        let (from, to) = (document.text.line(start), document.text.line(end));
        let mut fold = json!({ "startLine": from, "endLine": to });
        if let Some(kind) = kind {
            fold["kind"] = json!(kind);
        }
        (from < to).then_some(fold)
    });
    json!(lines.collect::<Vec<_>>())
}

/// The ranges around each position of an open file, the shortest first.
pub(super) fn selections(editor: &Editor, path: &Path, positions: &Value) -> Value {
    let Some(document) = editor.document(path) else {
        return Value::Null;
    };
    let text = document.text.as_str();
    let with_braces = crate::languages::Language::of(path).is_some();
    let positions = positions.as_array().map_or(&[][..], Vec::as_slice);
    let structure = Structure::of(text);
    let blocks = structure::blocks(path, text);
    let ranges = positions.iter().take(MOST_POSITIONS).map(|position| {
        let byte = document.text.byte(editor.encoding(), position);
        let byte = byte.unwrap_or(text.len());
        let mut parts = if with_braces {
            structure.around(byte)
        } else {
            let mut parts = vec![(0, text.len())];
            for block in blocks.iter().filter(|b| b.start <= byte && byte <= b.end) {
                parts.extend([(block.start, block.end), block.inside, block.name]);
            }
            parts.push(word(text, byte));
            let line = document.text.bytes_of_line(document.text.line(byte));
            parts.extend(line);
            parts.retain(|(start, end)| *start <= byte && byte <= *end);
            parts
        };
        parts.sort_by_key(|(start, end)| (end - start, *start));
        // Each one contains the one before.
        let mut nested: Vec<(usize, usize)> = Vec::new();
        for (start, end) in parts {
            let fits = nested
                .last()
                .is_none_or(|last| start <= last.0 && last.1 <= end && (start, end) != *last);
            if fits {
                nested.push((start, end));
            }
        }
        nested.truncate(MOST_DEPTH);
        let outwards = nested.into_iter().rev();
        outwards.fold(Value::Null, |parent, (start, end)| {
            let range = editor.range(&document.text, start, end);
            match parent {
                Value::Null => json!({ "range": range }),
                parent => json!({ "range": range, "parent": parent }),
            }
        })
    });
    let whole = document.text.whole(editor.encoding());
    let ranges = ranges.map(|range| match range {
        Value::Null => json!({ "range": whole }),
        range => range,
    });
    json!(ranges.collect::<Vec<_>>())
}

/// The declarations of a file with their ranges.
fn declared(names: &Names) -> Vec<Node> {
    let text = names.text.as_str();
    let structure = Structure::of(text);
    let places = names.places.iter().filter(|place| place.declares);
    places
        .filter_map(|place| {
            let mut symbols = place.symbols.iter();
            let symbol = symbols.next()?;
            let commas = match symbol.kind {
                Kind::Slot | Kind::State | Kind::ArrayMember => true,
                Kind::Member => structure.is_in(place.start, "enum"),
                _ => false,
            };
            let (start, end) = structure.declaration(place.start, commas);
            let slot = names.slots.iter().find(|slot| slot.name == symbol.name);
            let slot = slot.filter(|_| symbol.kind == Kind::Slot);
            Some(Node {
                name: text.get(place.start..place.end)?.to_owned(),
                detail: slot.map_or(String::new(), |slot| {
                    format!("{} {}", slot.role.word(), slot.interface)
                }),
                kind: number(symbol.kind),
                range: (start.min(place.start), end.max(place.end)),
                own: (place.start, place.end),
                children: Vec::new(),
            })
        })
        .collect()
}

/// The blocks of a file whose names are not known.
fn blocks(path: &Path, text: &str) -> Vec<Node> {
    let blocks = structure::blocks(path, text).into_iter();
    blocks
        .filter_map(|block| {
            let name = text.get(block.name.0..block.name.1)?;
            let head = text.get(block.start..block.name.0)?;
            let head = head.split_whitespace().next();
            Some(Node {
                name: name.to_owned(),
                detail: head
                    .filter(|word| word.starts_with(char::is_alphabetic))
                    .unwrap_or_default()
                    .to_owned(),
                kind: OBJECT,
                range: (block.start, block.end),
                own: block.name,
                children: Vec::new(),
            })
        })
        .collect()
}

/// Puts each node into the one that contains it.
fn tree(mut nodes: Vec<Node>) -> Vec<Node> {
    nodes.sort_by_key(|node| (node.range.0, std::cmp::Reverse(node.range.1)));
    nodes.truncate(MOST_SYMBOLS);
    let mut roots: Vec<Node> = Vec::new();
    let mut open: Vec<Node> = Vec::new();
    let close = |open: &mut Vec<Node>, roots: &mut Vec<Node>| {
        let Some(node) = open.pop() else { return };
        match open.last_mut() {
            Some(parent) => parent.children.push(node),
            None => roots.push(node),
        }
    };
    for node in nodes {
        let inside = |outer: &Node| outer.range != node.range && node.range.1 <= outer.range.1;
        while open.last().is_some_and(|last| !inside(last)) {
            close(&mut open, &mut roots);
        }
        if open.len() >= MOST_DEPTH {
            close(&mut open, &mut roots);
        }
        open.push(node);
    }
    while !open.is_empty() {
        close(&mut open, &mut roots);
    }
    roots
}

/// How the protocol numbers a kind of symbols.
const OBJECT: u8 = 19;

fn number(kind: Kind) -> u8 {
    match kind {
        Kind::Module | Kind::Group => 2,
        Kind::Network => 3,
        Kind::Component | Kind::Machine | Kind::File => 5,
        Kind::Operation | Kind::OfSlot => 6,
        Kind::Slot | Kind::OfGroup | Kind::BesideExport => 7,
        Kind::Member => 8,
        Kind::Interface => 11,
        Kind::Parameter | Kind::OfComponent | Kind::Host | Kind::Process => 13,
        Kind::Constant => 14,
        Kind::Instance => OBJECT,
        Kind::ArrayMember => 20,
        Kind::State => 22,
        Kind::Type => 23,
    }
}

/// How well a name fits a query: 0 if it begins with it, 1 if it contains it, 2 if it has its letters in
/// their order. `None` if it does not.
fn rank(name: &str, query: &str) -> Option<u8> {
    let (name, query) = (name.to_lowercase(), query.to_lowercase());
    if name.starts_with(&query) {
        return Some(0);
    }
    if name.contains(&query) {
        return Some(1);
    }
    let mut letters = name.chars();
    let all = query
        .chars()
        .all(|wanted| letters.any(|letter| letter == wanted));
    all.then_some(2)
}

/// The word around a byte.
fn word(text: &str, byte: usize) -> (usize, usize) {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let before = text[..byte].trim_end_matches(is_word).len();
    let behind = text.len() - text[byte..].trim_start_matches(is_word).len();
    (before, behind)
}

#[cfg(test)]
mod tests {
    use super::rank;

    #[test]
    fn a_name_fits_a_query_by_its_letters() {
        assert_eq!(rank("LaserScan", "las"), Some(0));
        assert_eq!(rank("LaserScan", "scan"), Some(1));
        assert_eq!(rank("LaserScan", "lsc"), Some(2));
        assert_eq!(rank("LaserScan", "nal"), None);
        assert_eq!(rank("x", ""), Some(0));
    }
}
