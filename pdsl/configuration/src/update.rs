//! Updates a configuration after a change of its `.pdsl`: adds, renames and removes parameters.
//!
//! The update loses nothing that a user wrote. A removed parameter becomes a comment. A value
//! moves to another name only if that is another spelling or a typing error, because a robot must
//! not move by a guess. If a removed key might be a renamed parameter, it is kept, and the
//! configuration is rejected until the user renames or deletes it.

mod edits;
mod inline;
mod key_matches;

use crate::block::inner;
use crate::document::Locator;
use crate::model::{Kind, Parameter, Parameters};
use crate::parameters::is_valid_value;
use crate::template;
use edits::{InsertionOrder, Text, head, heads_in};
use key_matches::KeyMatches;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use std::collections::HashMap;
use std::fmt;
use std::ops::Range;
use toml_edit::{Document, Item, Table};

/// The comment above removed parameters.
const REMOVED_NOTE: &str = "No longer a parameter (rcgen config --update):";

/// A difference between a configuration and its `.pdsl`.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The path of the parameter, or of the removed key: `motors[2].max`.
    pub path: String,
    /// The location of the key, or of the table that lacks one.
    pub at: Span,
    /// The kind of difference.
    pub kind: ChangeKind,
}

/// The kinds of differences.
#[derive(Clone, Debug, PartialEq)]
pub enum ChangeKind {
    /// A new parameter with this default.
    Added(String),
    /// A new parameter that must be set.
    Required,
    /// The parameter has this new name.
    Renamed(String),
    /// The key is not a parameter; the name that it may have now.
    Removed(Option<String>),
    /// The key is not a parameter, but may be one of these new parameters, each with its default.
    /// A group has no single default.
    Ambiguous(Vec<(String, Option<String>)>),
    /// An inline table spans several lines. A person has to change it.
    Manual,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = &self.path;
        match &self.kind {
            ChangeKind::Added(default) => write!(f, "add `{path}` = {default}"),
            ChangeKind::Required => write!(f, "add `{path}`, which must be set"),
            ChangeKind::Renamed(to) => write!(f, "rename `{path}` to `{to}`"),
            ChangeKind::Removed(None) => {
                write!(f, "comment out `{path}`, which is not a parameter")
            }
            ChangeKind::Removed(Some(near)) => write!(
                f,
                "comment out `{path}`, which is not a parameter; is it `{near}` now?"
            ),
            ChangeKind::Ambiguous(new) => {
                let names = new.iter();
                let names: Vec<String> = names
                    .map(|(path, default)| match default {
                        Some(default) => format!("`{path}` ({default} by default)"),
                        None => format!("`{path}` or in it"),
                    })
                    .collect();
                write!(
                    f,
                    "leave `{path}` to you: it is not a parameter; rename it if it is {} now, or remove it",
                    names.join(" or ")
                )
            }
            ChangeKind::Manual => write!(
                f,
                "leave `{path}` to you: its inline table spans several lines and differs from the .pdsl"
            ),
        }
    }
}

impl Change {
    /// Whether a person has to decide about the difference.
    pub fn needs_decision(&self) -> bool {
        matches!(self.kind, ChangeKind::Ambiguous(_) | ChangeKind::Manual)
    }
}

/// The result of [`update`].
#[derive(Clone, Debug, PartialEq)]
pub struct Update {
    /// The differences.
    pub changes: Vec<Change>,
    /// The updated text.
    pub text: String,
}

/// Updates a configuration that was written for another version of `parameters`. Keeps comments,
/// order and layout. Fails if the text is not valid TOML.
pub fn update(
    sources: &SourceMap,
    source: SourceId,
    parameters: Option<&Parameters>,
) -> Result<Update, Diagnostics> {
    let Ok(document) = Document::parse(sources.text(source)) else {
        return Err(crate::check::check(sources, source, parameters).1);
    };
    let root = document.as_table();
    let mut updater = Updater {
        text: Text::new(sources.text(source), root),
        locator: Locator { source },
        changes: Vec::new(),
    };
    match (root.get("parameters"), parameters) {
        (Some(item), _) => {
            let declared = parameters.map_or(&[][..], |model| &model.parameters);
            let context = TableContext {
                path: String::new(),
                head: "parameters".to_owned(),
                prefix: "parameters.".to_owned(),
                body: None,
            };
            updater.item(item, declared, &context);
        }
        (None, Some(model)) if !model.parameters.is_empty() => {
            updater.added(&model.parameters, "", updater.locator.start());
            updater.text.insert(
                updater.text.end(),
                InsertionOrder::Table,
                &template::root(model),
            );
        }
        (None, _) => {}
    }
    Ok(Update {
        changes: updater.changes,
        text: updater.text.finish(),
    })
}

/// One note for each table about the defaults in effect. None if unset parameters are the only
/// difference between the configuration and its `.pdsl`: a user may keep it short.
pub fn unset_parameters(update: &Update) -> Vec<Diagnostic> {
    let new = |change: &Change| matches!(change.kind, ChangeKind::Added(_));
    if update.changes.iter().all(new) {
        return Vec::new();
    }
    let mut tables: Vec<(Span, Vec<String>)> = Vec::new();
    let mut known: HashMap<Span, usize> = HashMap::new();
    for change in &update.changes {
        let new = match &change.kind {
            ChangeKind::Added(default) => vec![(&change.path, default)],
            ChangeKind::Ambiguous(new) => {
                let values = new.iter();
                values
                    .filter_map(|(path, default)| Some((path, default.as_ref()?)))
                    .collect()
            }
            _ => continue,
        };
        for (path, default) in new {
            let index = *known.entry(change.at).or_insert(tables.len());
            if index == tables.len() {
                tables.push((change.at, Vec::new()));
            }
            tables[index].1.push(format!("`{path}` = {default}"));
        }
    }
    let note = |(at, texts): (Span, Vec<String>)| {
        let message = format!("not set, so the defaults apply: {}", texts.join(", "));
        Diagnostic::note("unset-parameter", at, message)
            .help("`rcgen config --update` adds new parameters, and lists the remaining changes")
    };
    tables.into_iter().map(note).collect()
}

/// The context of a table: its path, and its notation.
struct TableContext {
    /// The path in findings.
    path: String,
    /// The header, whether written or not.
    head: String,
    /// The prefix of keys, if the table is written with dotted keys.
    prefix: String,
    /// The position of the header above the keys.
    body: Option<usize>,
}

impl TableContext {
    fn inner(&self, name: &str) -> Self {
        Self {
            path: inner(&self.path, name),
            head: format!("{}.{name}", self.head),
            prefix: format!("{}{name}.", self.prefix),
            body: self.body,
        }
    }
}

struct Updater<'a> {
    text: Text<'a>,
    locator: Locator,
    changes: Vec<Change>,
}

impl Updater<'_> {
    fn change(&mut self, path: String, at: Span, kind: ChangeKind) {
        self.changes.push(Change { path, at, kind });
    }

    /// Updates a table, or each table of a list.
    fn item(&mut self, item: &Item, parameters: &[Parameter], context: &TableContext) {
        match item {
            Item::Table(table) => self.table(table, parameters, context),
            Item::ArrayOfTables(tables) => {
                for (index, table) in tables.iter().enumerate() {
                    let path = format!("{}[{index}]", context.path);
                    let head = context.head.clone();
                    let prefix = context.prefix.clone();
                    let body = context.body;
                    let element = TableContext {
                        path,
                        head,
                        prefix,
                        body,
                    };
                    self.table(table, parameters, &element);
                }
            }
            Item::Value(value) => self.value(value, parameters, &context.path),
            Item::None => {}
        }
    }

    fn table(&mut self, table: &Table, parameters: &[Parameter], context: &TableContext) {
        let own = head(table).map(|head| head.start);
        let dotted = table.is_dotted();
        let context = &TableContext {
            path: context.path.clone(),
            head: context.head.clone(),
            prefix: if dotted {
                context.prefix.clone()
            } else {
                String::new()
            },
            body: if dotted { context.body } else { own },
        };
        let around = self.locator.start();
        let at = own.map_or_else(
            || self.locator.span(table.span(), around),
            |_| self.locator.span(head(table), around),
        );
        let names = KeyMatches::of(parameters, table, self.locator);
        let mut renamed: Vec<(&str, &str)> = Vec::new();
        for (name, item) in table.iter().filter(|(name, _)| !names.is_parameter(name)) {
            let Some(key) = table.key(name).and_then(toml_edit::Key::span) else {
                continue;
            };
            let here = self.locator.span(Some(key.clone()), at);
            let path = inner(&context.path, name);
            match names.renamed(name) {
                Some(to) if self.rename(item, key.clone(), context, &to.name) => {
                    let kind = ChangeKind::Renamed(inner(&context.path, &to.name));
                    self.change(path, here, kind);
                    renamed.push((&to.name, name));
                    if !is_scalar(to) {
                        self.item(item, members(to), &context.inner(&to.name));
                    }
                }
                _ if !names.candidates(name).is_empty() => {
                    let new = candidates(names.candidates(name), &context.path);
                    self.change(path, here, ChangeKind::Ambiguous(new));
                }
                _ => {
                    let near = names.nearest(name).map(|near| inner(&context.path, near));
                    self.change(path, here, ChangeKind::Removed(near));
                    let mut note = REMOVED_NOTE;
                    self.remove(key, item, &mut note);
                }
            }
        }
        let key_of = |parameter: &Parameter| {
            let known = renamed.iter().find(|(to, _)| *to == parameter.name);
            known.map_or(parameter.name.clone(), |(_, from)| (*from).to_owned())
        };
        let decided: Vec<&Parameter> = parameters
            .iter()
            .filter(|p| names.is_unambiguous(p))
            .collect();
        self.values(table, &decided, context, at, &key_of);
        // A new table follows its predecessor in the `.pdsl`.
        let mut before = context.body;
        for parameter in decided.iter().filter(|p| !is_scalar(p)) {
            let Some(item) = table.get(&key_of(parameter)) else {
                let above = first(table).map(|first| self.text.above(first));
                let end = before.map(|head| self.text.end_of(Some(head)));
                let place = end.or(above).unwrap_or_else(|| self.text.end());
                self.new_table(parameter, context, at, (place, before));
                continue;
            };
            if names.is_parameter(&key_of(parameter))
                && is_valid_value(parameter, item, self.locator)
            {
                let members = members(parameter);
                self.item(item, members, &context.inner(&parameter.name));
            }
            let mut found = Vec::new();
            heads_in(item, &mut found);
            before = found.iter().map(|head| head.start).max().or(before);
        }
    }

    /// Adds missing values, each after its predecessor in the `.pdsl`.
    fn values(
        &mut self,
        table: &Table,
        parameters: &[&Parameter],
        context: &TableContext,
        at: Span,
        key_of: &dyn Fn(&Parameter) -> String,
    ) {
        // A table that exists only by headers of inner tables gets a header above theirs.
        let mut head = format!("[{}]\n\n", context.head);
        let headless = context.body.is_none() && context.prefix.is_empty();
        let above = first(table).map(|first| self.text.above(first));
        let keys = table.iter().filter(|(_, item)| first_in(item).is_none());
        let ends = keys.filter_map(|(_, item)| item.span());
        let dotted = ends.map(|span| self.text.next_line(span.end)).max();
        let mut place = match (headless, context.prefix.is_empty()) {
            (true, _) => above,
            (false, true) => context.body.map(|head| self.text.next_line(head)),
            (false, false) => dotted,
        };
        for parameter in parameters.iter().filter(|p| is_scalar(p)) {
            if let Some(item) = table.get(&key_of(parameter)) {
                let end = item.span().map(|span| self.text.next_line(span.end));
                place = end.or(place);
                continue;
            }
            let kind = added_kind(parameter);
            let name = format!("{}{}", context.prefix, parameter.name);
            // A comment that requests the value is enough.
            let request = format!("# {name} =");
            let asked = kind == ChangeKind::Required
                && self.text.has_line(context.body, context.body, &request);
            if let (Some(place), false) = (place, asked) {
                let lines = template::scalar(parameter, &name);
                let head = if headless {
                    std::mem::take(&mut head)
                } else {
                    String::new()
                };
                let order = if headless {
                    InsertionOrder::Table
                } else {
                    InsertionOrder::Body
                };
                self.text.insert(place, order, &format!("{head}{lines}"));
                self.change(inner(&context.path, &parameter.name), at, kind);
            }
        }
    }

    /// Adds a group or a list at `place`, after the last header `before`.
    fn new_table(
        &mut self,
        parameter: &Parameter,
        context: &TableContext,
        at: Span,
        (place, before): (usize, Option<usize>),
    ) {
        let new = context.inner(&parameter.name);
        // A list that may be empty is a comment.
        let example = format!("# [[{}]]", new.head);
        let is_list = matches!(parameter.kind, Kind::List { .. });
        // Each element of a list has its own tables; any other table is unique in the file.
        let (from, to) = if context.path.contains('[') {
            (context.body, before)
        } else {
            (None, Some(usize::MAX))
        };
        if is_list && self.text.has_line(from, to, &example) {
            return;
        }
        self.added(std::slice::from_ref(parameter), &context.path, at);
        self.text.insert(
            place,
            InsertionOrder::Table,
            &template::table(parameter, &new.head),
        );
    }

    /// Records these parameters, and all in them, as added.
    fn added(&mut self, parameters: &[Parameter], path: &str, at: Span) {
        for parameter in parameters {
            let path = inner(path, &parameter.name);
            match &parameter.kind {
                Kind::Group(members) => self.added(members, &path, at),
                Kind::Scalar { .. } | Kind::List { .. } => {
                    self.change(path, at, added_kind(parameter));
                }
            }
        }
    }

    /// Renames a key in all headers. Leaves headers with quotes and dotted keys, which may repeat
    /// the name anywhere, unchanged and returns `false`.
    fn rename(&mut self, item: &Item, key: Range<usize>, context: &TableContext, to: &str) -> bool {
        if is_dotted(item) {
            return false;
        }
        let mut found = Vec::new();
        heads_in(item, &mut found);
        if found.is_empty() && item.is_value() {
            self.text.replace(key, to);
            return true;
        }
        let depth = context.head.split('.').count();
        let mut edits = Vec::new();
        for head in found {
            let words = self.text.slice(head.clone());
            let name = words.trim_matches(['[', ']']);
            let mut parts: Vec<&str> = name.split('.').map(str::trim).collect();
            if words.contains(['"', '\'']) || parts.len() <= depth {
                return false;
            }
            parts[depth] = to;
            edits.push((head, words.replace(name, &parts.join("."))));
        }
        for (head, words) in edits {
            self.text.replace(head, words);
        }
        true
    }

    /// Turns a removed key into comments, below one note.
    fn remove(&mut self, key: Range<usize>, item: &Item, note: &mut &str) {
        match item {
            Item::Table(table) if table.is_dotted() => {
                for (name, item) in table {
                    if let Some(key) = table.key(name).and_then(toml_edit::Key::span) {
                        self.remove(key, item, note);
                    }
                }
            }
            Item::Table(_) | Item::ArrayOfTables(_) => {
                let mut found = Vec::new();
                heads_in(item, &mut found);
                for head in found {
                    let end = self.text.end_of(Some(head.start));
                    self.text.comment_out(head.start..end, std::mem::take(note));
                }
            }
            Item::Value(_) | Item::None => {
                let end = item.span().map_or(key.end, |span| span.end);
                let end = self.text.next_line(end);
                self.text.comment_out(key.start..end, std::mem::take(note));
            }
        }
    }
}

/// Parameters of the table `path` with their defaults.
fn candidates(parameters: &[&Parameter], path: &str) -> Vec<(String, Option<String>)> {
    let default = |parameter: &Parameter| match added_kind(parameter) {
        ChangeKind::Added(default) => Some(default),
        _ => None,
    };
    let all = parameters.iter();
    all.map(|p| (inner(path, &p.name), default(p))).collect()
}

/// The kind of difference for a new value or list.
fn added_kind(parameter: &Parameter) -> ChangeKind {
    match (&parameter.kind, &parameter.default) {
        (Kind::List { length, .. }, _) if length.min == 0 => ChangeKind::Added("[]".to_owned()),
        (_, Some(_)) if parameter.secret => ChangeKind::Added("***".to_owned()),
        (_, Some(default)) => ChangeKind::Added(default.to_toml()),
        (_, None) => ChangeKind::Required,
    }
}

fn is_scalar(parameter: &Parameter) -> bool {
    matches!(parameter.kind, Kind::Scalar { .. })
}

fn is_dotted(item: &Item) -> bool {
    item.as_table().is_some_and(Table::is_dotted)
}

/// The position of the first header in a table.
fn first(table: &Table) -> Option<usize> {
    table.iter().filter_map(|(_, item)| first_in(item)).min()
}

fn first_in(item: &Item) -> Option<usize> {
    let mut found = Vec::new();
    heads_in(item, &mut found);
    found.iter().map(|head| head.start).min()
}

/// The parameters of a group, or of each element of a list.
fn members(parameter: &Parameter) -> &[Parameter] {
    match &parameter.kind {
        Kind::Scalar { .. } => &[],
        Kind::Group(members)
        | Kind::List {
            parameters: members,
            ..
        } => members,
    }
}
