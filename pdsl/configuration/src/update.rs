//! A configuration after its `.pdsl` has changed: what is new, what is gone, what has another name, and the text that
//! says so.
//!
//! Nothing that somebody wrote gets lost. What is gone becomes a comment. A value goes to another name only where that
//! can be nothing but another spelling or a slip of the pen; a robot must not move by a guess. So a value also stays, and
//! the configuration stays wrong, where it may be that of a parameter for which a default would hold otherwise.

mod inline;
mod names;
mod text;

use crate::block::inner;
use crate::document::Place;
use crate::model::{Kind, Parameter, Parameters};
use crate::parameters::fits;
use crate::template;
use names::Names;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use std::collections::HashMap;
use std::fmt;
use std::ops::Range;
use text::{Rank, Text, head, heads_in};
use toml_edit::{Document, Item, Table};

/// The words over what became a comment.
const GONE: &str = "No parameter any more (rcgen config --update):";

/// One difference between a configuration and what its `.pdsl` declares.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The parameter, or what was one: `motors[2].max`.
    pub path: String,
    /// The place in the configuration: of a key that is there, or of the table that lacks one.
    pub at: Span,
    /// What is the matter with it.
    pub what: What,
}

/// What is the matter with a parameter of a configuration.
#[derive(Clone, Debug, PartialEq)]
pub enum What {
    /// It is new, and gets this default.
    New(String),
    /// It is new, and somebody has to give it a value.
    Required,
    /// It is called so now.
    Renamed(String),
    /// It is gone; the name that it perhaps has now.
    Gone(Option<String>),
    /// It is no parameter any more, but may be one of these, or another one, which are new and have these defaults; a group
    /// has many.
    Undecided(Vec<(String, Option<String>)>),
    /// Its table stands in braces over several lines, which only a person changes well.
    ByHand,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let path = &self.path;
        match &self.what {
            What::New(default) => write!(f, "add `{path}` = {default}"),
            What::Required => write!(f, "add `{path}`, which must be set"),
            What::Renamed(to) => write!(f, "rename `{path}` to `{to}`"),
            What::Gone(None) => write!(f, "comment out `{path}`, which is no parameter any more"),
            What::Gone(Some(near)) => write!(
                f,
                "comment out `{path}`, which is no parameter any more; is it `{near}` now?"
            ),
            What::Undecided(new) => {
                let names = new.iter();
                let names: Vec<String> = names
                    .map(|(path, default)| match default {
                        Some(default) => format!("`{path}` ({default} by default)"),
                        None => format!("`{path}` or in it"),
                    })
                    .collect();
                write!(
                    f,
                    "leave `{path}` to you: it is no parameter any more; rename it if it is {} now, or take it out",
                    names.join(" or ")
                )
            }
            What::ByHand => write!(
                f,
                "leave `{path}` to you: its braces span several lines, and what it holds is not what is declared"
            ),
        }
    }
}

impl Change {
    /// Whether it is no change, but something that a person has to decide.
    pub fn is_yours(&self) -> bool {
        matches!(self.what, What::Undecided(_) | What::ByHand)
    }
}

/// What [`update`] finds.
#[derive(Clone, Debug, PartialEq)]
pub struct Update {
    /// The differences.
    pub changes: Vec<Change>,
    /// The whole text as it should be.
    pub text: String,
}

/// What has to become of a configuration that was written for another version of `parameters`. Comments, order and
/// layout of what is there stay. An error is a text that is no TOML.
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
        place: Place { source },
        changes: Vec::new(),
    };
    match (root.get("parameters"), parameters) {
        (Some(item), _) => {
            let declared = parameters.map_or(&[][..], |model| &model.parameters);
            let within = Within {
                path: String::new(),
                head: "parameters".to_owned(),
                prefix: "parameters.".to_owned(),
                body: None,
            };
            updater.item(item, declared, &within);
        }
        (None, Some(model)) if !model.parameters.is_empty() => {
            updater.added(&model.parameters, "", updater.place.start());
            updater
                .text
                .insert(updater.text.end(), Rank::Table, &template::root(model));
        }
        (None, _) => {}
    }
    Ok(Update {
        changes: updater.changes,
        text: updater.text.finish(),
    })
}

/// Notes about what a configuration leaves to its defaults, one for each table; none where that is all that can be said
/// of it: then it is as short as somebody wants it.
pub fn unset(update: &Update) -> Vec<Diagnostic> {
    let new = |change: &Change| matches!(change.what, What::New(_));
    if update.changes.iter().all(new) {
        return Vec::new();
    }
    let mut tables: Vec<(Span, Vec<String>)> = Vec::new();
    let mut known: HashMap<Span, usize> = HashMap::new();
    for change in &update.changes {
        let new = match &change.what {
            What::New(default) => vec![(&change.path, default)],
            What::Undecided(new) => {
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
        let message = format!("not set, so that defaults hold: {}", texts.join(", "));
        Diagnostic::note("unset-parameter", at, message)
            .help("`rcgen config --update` writes in what is new, and tells what it leaves to you")
    };
    tables.into_iter().map(note).collect()
}

/// Where a table is, and how it is written.
struct Within {
    /// How findings call it.
    path: String,
    /// What its head says, or would say.
    head: String,
    /// What stands before its names where it is written by dots in keys.
    prefix: String,
    /// The head above its keys.
    body: Option<usize>,
}

impl Within {
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
    place: Place,
    changes: Vec<Change>,
}

impl Updater<'_> {
    fn change(&mut self, path: String, at: Span, what: What) {
        self.changes.push(Change { path, at, what });
    }

    /// What is in a table, or in each table of a list.
    fn item(&mut self, item: &Item, parameters: &[Parameter], within: &Within) {
        match item {
            Item::Table(table) => self.table(table, parameters, within),
            Item::ArrayOfTables(tables) => {
                for (index, table) in tables.iter().enumerate() {
                    let path = format!("{}[{index}]", within.path);
                    let head = within.head.clone();
                    let prefix = within.prefix.clone();
                    let body = within.body;
                    let element = Within {
                        path,
                        head,
                        prefix,
                        body,
                    };
                    self.table(table, parameters, &element);
                }
            }
            Item::Value(value) => self.value(value, parameters, &within.path),
            Item::None => {}
        }
    }

    fn table(&mut self, table: &Table, parameters: &[Parameter], within: &Within) {
        let own = head(table).map(|head| head.start);
        let dotted = table.is_dotted();
        let within = &Within {
            path: within.path.clone(),
            head: within.head.clone(),
            prefix: if dotted {
                within.prefix.clone()
            } else {
                String::new()
            },
            body: if dotted { within.body } else { own },
        };
        let around = self.place.start();
        let at = own.map_or_else(
            || self.place.of(table.span(), around),
            |_| self.place.of(head(table), around),
        );
        let names = Names::of(parameters, table, self.place);
        let mut renamed: Vec<(&str, &str)> = Vec::new();
        for (name, item) in table.iter().filter(|(name, _)| !names.knows(name)) {
            let Some(key) = table.key(name).and_then(toml_edit::Key::span) else {
                continue;
            };
            let here = self.place.of(Some(key.clone()), at);
            let path = inner(&within.path, name);
            match names.renamed(name) {
                Some(to) if self.rename(item, key.clone(), within, &to.name) => {
                    let what = What::Renamed(inner(&within.path, &to.name));
                    self.change(path, here, what);
                    renamed.push((&to.name, name));
                    if !is_scalar(to) {
                        self.item(item, members(to), &within.inner(&to.name));
                    }
                }
                _ if !names.perhaps(name).is_empty() => {
                    let new = candidates(names.perhaps(name), &within.path);
                    self.change(path, here, What::Undecided(new));
                }
                _ => {
                    let near = names.near(name).map(|near| inner(&within.path, near));
                    self.change(path, here, What::Gone(near));
                    let mut note = GONE;
                    self.gone(key, item, &mut note);
                }
            }
        }
        let key_of = |parameter: &Parameter| {
            let known = renamed.iter().find(|(to, _)| *to == parameter.name);
            known.map_or(parameter.name.clone(), |(_, from)| (*from).to_owned())
        };
        let decided: Vec<&Parameter> = parameters.iter().filter(|p| names.is_decided(p)).collect();
        self.values(table, &decided, within, at, &key_of);
        // What is new comes behind what it follows in the `.pdsl`.
        let mut before = within.body;
        for parameter in decided.iter().filter(|p| !is_scalar(p)) {
            let Some(item) = table.get(&key_of(parameter)) else {
                let above = first(table).map(|first| self.text.above(first));
                let end = before.map(|head| self.text.end_of(Some(head)));
                let place = end.or(above).unwrap_or_else(|| self.text.end());
                self.new_table(parameter, within, at, (place, before));
                continue;
            };
            if names.knows(&key_of(parameter)) && fits(parameter, item, self.place) {
                let members = members(parameter);
                self.item(item, members, &within.inner(&parameter.name));
            }
            let mut found = Vec::new();
            heads_in(item, &mut found);
            before = found.iter().map(|head| head.start).max().or(before);
        }
    }

    /// The values that a table lacks, each behind what it follows in the `.pdsl`.
    fn values(
        &mut self,
        table: &Table,
        parameters: &[&Parameter],
        within: &Within,
        at: Span,
        key_of: &dyn Fn(&Parameter) -> String,
    ) {
        // A table that is there only by the heads of others gets one, above theirs.
        let mut head = format!("[{}]\n\n", within.head);
        let headless = within.body.is_none() && within.prefix.is_empty();
        let above = first(table).map(|first| self.text.above(first));
        let keys = table.iter().filter(|(_, item)| first_in(item).is_none());
        let ends = keys.filter_map(|(_, item)| item.span());
        let dotted = ends.map(|span| self.text.next_line(span.end)).max();
        let mut place = match (headless, within.prefix.is_empty()) {
            (true, _) => above,
            (false, true) => within.body.map(|head| self.text.next_line(head)),
            (false, false) => dotted,
        };
        for parameter in parameters.iter().filter(|p| is_scalar(p)) {
            if let Some(item) = table.get(&key_of(parameter)) {
                let end = item.span().map(|span| self.text.next_line(span.end));
                place = end.or(place);
                continue;
            }
            let what = new(parameter);
            let name = format!("{}{}", within.prefix, parameter.name);
            // A comment that asks for a value is enough.
            let request = format!("# {name} =");
            let asked =
                what == What::Required && self.text.has_line(within.body, within.body, &request);
            if let (Some(place), false) = (place, asked) {
                let lines = template::scalar(parameter, &name);
                let head = if headless {
                    std::mem::take(&mut head)
                } else {
                    String::new()
                };
                let kind = if headless { Rank::Table } else { Rank::Body };
                self.text.insert(place, kind, &format!("{head}{lines}"));
                self.change(inner(&within.path, &parameter.name), at, what);
            }
        }
    }

    /// A group or a list that is not there, its place, and the last head that comes before it.
    fn new_table(
        &mut self,
        parameter: &Parameter,
        within: &Within,
        at: Span,
        (place, before): (usize, Option<usize>),
    ) {
        let new = within.inner(&parameter.name);
        // A list that may be empty is a comment.
        let example = format!("# [[{}]]", new.head);
        let is_list = matches!(parameter.kind, Kind::List { .. });
        // Of the elements of a list, each has its own; of all else there is one in the file.
        let (from, to) = if within.path.contains('[') {
            (within.body, before)
        } else {
            (None, Some(usize::MAX))
        };
        if is_list && self.text.has_line(from, to, &example) {
            return;
        }
        self.added(std::slice::from_ref(parameter), &within.path, at);
        self.text
            .insert(place, Rank::Table, &template::table(parameter, &new.head));
    }

    /// Notes that these are new, and all that is in them.
    fn added(&mut self, parameters: &[Parameter], path: &str, at: Span) {
        for parameter in parameters {
            let path = inner(path, &parameter.name);
            match &parameter.kind {
                Kind::Group(members) => self.added(members, &path, at),
                Kind::Scalar { .. } | Kind::List { .. } => self.change(path, at, new(parameter)),
            }
        }
    }

    /// Gives a key another name, in all heads where it stands. Heads with quotes, and keys with dots, which may repeat
    /// the name anywhere, are left alone.
    fn rename(&mut self, item: &Item, key: Range<usize>, within: &Within, to: &str) -> bool {
        if is_dotted(item) {
            return false;
        }
        let mut found = Vec::new();
        heads_in(item, &mut found);
        if found.is_empty() && item.is_value() {
            self.text.replace(key, to);
            return true;
        }
        let depth = within.head.split('.').count();
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

    /// Makes comments of what is no parameter any more, with one note over all of it.
    fn gone(&mut self, key: Range<usize>, item: &Item, note: &mut &str) {
        match item {
            Item::Table(table) if table.is_dotted() => {
                for (name, item) in table {
                    if let Some(key) = table.key(name).and_then(toml_edit::Key::span) {
                        self.gone(key, item, note);
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
    let default = |parameter: &Parameter| match new(parameter) {
        What::New(default) => Some(default),
        _ => None,
    };
    let all = parameters.iter();
    all.map(|p| (inner(path, &p.name), default(p))).collect()
}

/// What is said of a value or a list that is new.
fn new(parameter: &Parameter) -> What {
    match (&parameter.kind, &parameter.default) {
        (Kind::List { length, .. }, _) if length.min == 0 => What::New("[]".to_owned()),
        (_, Some(_)) if parameter.secret => What::New("***".to_owned()),
        (_, Some(default)) => What::New(default.to_toml()),
        (_, None) => What::Required,
    }
}

fn is_scalar(parameter: &Parameter) -> bool {
    matches!(parameter.kind, Kind::Scalar { .. })
}

fn is_dotted(item: &Item) -> bool {
    item.as_table().is_some_and(Table::is_dotted)
}

/// The first head in a table.
fn first(table: &Table) -> Option<usize> {
    table.iter().filter_map(|(_, item)| first_in(item)).min()
}

fn first_in(item: &Item) -> Option<usize> {
    let mut found = Vec::new();
    heads_in(item, &mut found);
    found.iter().map(|head| head.start).min()
}

/// The parameters in a group or in each element of a list.
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
