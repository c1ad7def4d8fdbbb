//! Suggestions at a cursor, also in a text with errors. The tokens before the cursor decide the kind,
//! the names of all files the choice.

mod configurations;
mod data;
mod graphs;
mod keywords;
mod languages;
mod markup;
mod networks;
mod solvers;

use super::context::Context;
use super::editor::Editor;
use super::file_key::key;
use super::known_files::KnownFiles;
use super::names::{Kind, Names};
use super::place::Text;
use keywords::{INSIDE, Keyword, STATEMENTS};
use languages::units;
use rc_codegen::{load, paths};
use rc_syntax::Loader;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The most suggestions of an answer.
const MOST: usize = 1_000;

/// How the protocol numbers the kinds of suggestions.
const FUNCTION: u8 = 3;
const VARIABLE: u8 = 6;
const INTERFACE: u8 = 8;
const PROPERTY: u8 = 10;
const UNIT: u8 = 11;
const VALUE: u8 = 12;
const KEYWORD: u8 = 14;
const FILE: u8 = 17;
const STRUCT: u8 = 22;

/// A suggestion.
#[derive(Debug, Default)]
struct Item {
    label: String,
    kind: u8,
    /// A description in one line.
    detail: String,
    /// Its documentation.
    doc: String,
    /// An edit besides: where, and the new text.
    import: Option<(usize, String)>,
}

impl Item {
    fn new(kind: u8, label: impl Into<String>, doc: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            kind,
            doc: doc.into(),
            ..Self::default()
        }
    }
}

/// The text that is completed.
struct Target<'a> {
    path: &'a Path,
    text: &'a str,
    /// Its names, or those that it had when it could be read.
    names: &'a Names,
}

/// Finds suggestions in the known files.
pub(super) struct Completion<'s> {
    pub(super) files: &'s KnownFiles,
    pub(super) editor: &'s Editor,
}

impl Completion<'_> {
    /// The suggestions at a position of an open file.
    pub(super) fn at(&self, path: &Path, position: &Value) -> Value {
        let Some(document) = self.editor.document(path) else {
            return Value::Null;
        };
        let Some(cursor) = document.text.byte(self.editor.encoding(), position) else {
            return Value::Null;
        };
        let text = document.text.as_str();
        let none = Names::default();
        let target = Target {
            path,
            text,
            names: self.files.readable(path).unwrap_or(&none),
        };
        let ending = path
            .extension()
            .and_then(|e| e.to_str())
            .unwrap_or_default();
        let answer = match ending {
            "toml" => Some(self.in_configuration(&target, cursor)),
            "scxml" | "xml" | "urdf" => self.in_markup(&target, cursor, ending),
            "graph" => graphs::in_graph(self, &target, cursor),
            "ilk" => solvers::in_ilk(text, cursor),
            _ => self.in_statement(&target, cursor, ending),
        };
        let Some((start, mut items)) = answer else {
            return Value::Null;
        };
        let mut seen = BTreeSet::new();
        items.retain(|item| !item.label.is_empty() && seen.insert(item.label.clone()));
        items.truncate(MOST);
        let range = self.editor.range(&document.text, start, cursor);
        let items = items.into_iter().enumerate();
        let items: Vec<Value> = items
            .map(|(at, item)| self.shown(&document.text, &range, at, item))
            .collect();
        json!(items)
    }

    /// The start of the word at the cursor, and what is allowed there, in a language of statements.
    fn in_statement(
        &self,
        target: &Target<'_>,
        cursor: usize,
        ending: &str,
    ) -> Option<(usize, Vec<Item>)> {
        let context = Context::at(target.text, cursor)?;
        let items = match ending {
            "idsl" => self.in_interfaces(target, &context),
            "cdsl" => self.in_component(target, &context),
            "ddsl" => self.in_network(target, &context),
            "pdsl" => self.in_parameters(target, &context),
            "smdsl" => in_machine(target, &context),
            "gdsl" => self.in_schema(target, &context),
            "dproto" => self.in_prototypes(target, &context),
            "kdsl" => self.in_solvers(target, &context),
            _ => Vec::new(),
        };
        Some((context.start, items))
    }

    fn shown(&self, text: &Text, range: &Value, at: usize, item: Item) -> Value {
        let mut value = json!({
            "label": item.label,
            "kind": item.kind,
            "sortText": format!("{at:04}"),
            "textEdit": { "range": range, "newText": item.label },
        });
        if !item.detail.is_empty() {
            value["detail"] = json!(item.detail);
        }
        if !item.doc.is_empty() {
            value["documentation"] = json!({ "kind": "markdown", "value": item.doc });
        }
        if let Some((at, new)) = item.import {
            let range = self.editor.range(text, at, at);
            value["additionalTextEdits"] = json!([{ "range": range, "newText": new }]);
        }
        value
    }

    /// Files below the folder of the text: what continues the path `written`, and folders.
    fn paths(&self, target: &Target<'_>, written: &str, endings: &[&str]) -> Vec<Item> {
        let Some(own) = target.path.parent() else {
            return Vec::new();
        };
        let folder = written.rfind('/').map_or("", |at| &written[..=at]);
        let entries = std::fs::read_dir(own.join(folder))
            .into_iter()
            .flatten()
            .flatten();
        let found = entries.take(MOST).filter_map(|entry| {
            let name = entry.file_name().into_string().ok()?;
            let path = entry.path();
            let wanted = path.extension().and_then(|e| e.to_str());
            let is_wanted = wanted.is_some_and(|e| endings.contains(&e)) && path.is_file();
            // A text imports no copy of itself.
            let is_file = is_wanted && key(&path) != *target.path;
            let is_folder = path.is_dir() && !name.starts_with('.');
            let label = match (is_file, is_folder) {
                (true, _) => format!("{folder}{name}"),
                (_, true) => format!("{folder}{name}/"),
                _ => return None,
            };
            Some(Item::new(FILE, label, ""))
        });
        // A component has a folder of its own, whose name nobody likes to type.
        let known = endings
            .iter()
            .flat_map(|ending| self.files.with_ending(ending));
        let known = known.filter(|(path, _)| *path != target.path);
        let known = known.map(|(path, _)| {
            let label = paths::relative(own, path).display().to_string();
            Item::new(FILE, label, "")
        });
        let mut items: Vec<Item> = found.chain(known).collect();
        items.sort_by(|a, b| a.label.cmp(&b.label));
        items
    }
}

/// Whether a word is a keyword of a language.
pub(super) fn is_keyword(language: &str, word: &str) -> bool {
    keywords::is_known(language, word)
}

fn in_machine(target: &Target<'_>, context: &Context<'_>) -> Vec<Item> {
    let states = || items_of(target.names, Kind::State, VALUE);
    match (context.around().as_slice(), context.last()) {
        ([], ":") => states(),
        ([], _) if context.word() == ":" => of(keywords::of(&INSIDE, "smdsl", ":")),
        ([_], "") => of(keywords::of(&STATEMENTS, "smdsl", "machine")),
        ([_, inner], _) if inner.starts_with("transition") => states(),
        _ => Vec::new(),
    }
}

/// Keywords as suggestions.
fn of(keywords: &[Keyword]) -> Vec<Item> {
    let keywords = keywords.iter();
    keywords
        .map(|(word, doc)| Item::new(KEYWORD, *word, *doc))
        .collect()
}

/// The declarations of a kind in a file.
fn items_of(names: &Names, kind: Kind, of: u8) -> Vec<Item> {
    let declared = names.declarations(kind).into_iter();
    declared
        .map(|(name, detail, doc)| Item {
            label: name,
            kind: of,
            detail,
            doc,
            import: None,
        })
        .collect()
}

/// Words with their meaning.
fn words<'a>(words: impl IntoIterator<Item = &'a str>, doc: &str) -> Vec<Item> {
    let words = words.into_iter();
    words.map(|word| Item::new(VALUE, word, doc)).collect()
}
