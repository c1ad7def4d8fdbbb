//! Writes changed values back into the configuration file, and keeps its comments and its order.

use crate::block::{Block, Content, Field};
use crate::change::ParamChange;
use crate::document::Locator;
use crate::edit::Edit;
use crate::live::LiveParameters;
use crate::model::Value;
use rc_diagnostics::{Diagnostics, SourceMap};
use std::path::Path;
use toml_edit::{DocumentMut, InlineTable, Item, Table, TableLike};

/// Why the values were not written.
#[derive(Debug)]
pub enum SaveError {
    /// The file, or the new text, does not pass the check.
    Invalid(SourceMap, Diagnostics),
    /// Another program changed the file. One line for each conflict.
    Conflicts(Vec<String>),
}

impl LiveParameters {
    /// Writes the values of the next start into `text`, the present contents of the file `path`.
    /// Writes only values that changed since the component read or wrote the file, and keeps all
    /// other edits.
    pub fn save(&self, path: &Path, text: &str) -> Result<String, SaveError> {
        let present = self.read(path, text)?;
        let mut edits = self.edits();
        let conflicts = edits.iter().filter_map(|edit| {
            let conflict = edit.conflict(&present);
            conflict.or_else(|| edit.list_conflict(self, &present))
        });
        let conflicts: Vec<String> = conflicts.collect();
        if !conflicts.is_empty() {
            return Err(SaveError::Conflicts(conflicts));
        }
        edits.retain(|edit| edit.value_in(&present) != Some(&edit.change.new));
        // A new table may become the first one. Comments about the whole file stay above it.
        let (header, rest) = text.split_at(header_length(text));
        // The text is valid, since it was read above.
        let mut document: DocumentMut = rest.parse().unwrap_or_default();
        for edit in &edits {
            edit.write(&mut document);
        }
        let mut new = header.to_owned();
        if rest.is_empty() && !header.is_empty() && !edits.is_empty() {
            let feed = if header.ends_with('\n') { "\n" } else { "\n\n" };
            new.push_str(feed);
        }
        new.push_str(&document.to_string());
        if text.contains("\r\n") && !text.replace("\r\n", "").contains('\n') {
            new = new.replace("\r\n", "\n").replace('\n', "\r\n");
        }
        // Another program's edit may violate a rule together with the new values.
        self.read(path, &new)?;
        Ok(new)
    }

    /// Records that the file has the values of the next start.
    pub fn saved(&mut self) {
        self.saved = self.next.clone();
    }

    fn read(&self, path: &Path, text: &str) -> Result<Block, SaveError> {
        let mut sources = SourceMap::new();
        let source = sources.add(path, text);
        let (configuration, found) = crate::check::check(&sources, source, Some(&self.model));
        if found.has_errors() {
            return Err(SaveError::Invalid(sources, found));
        }
        let (parameters, values) = (&self.model.parameters, &configuration.parameters);
        Ok(Block::of(
            parameters,
            values,
            "",
            Locator::nowhere().start(),
        ))
    }
}

/// The length of the leading comments that describe the whole file: up to their last blank line.
/// Comments after that belong to the first table. A byte order mark belongs to the leading
/// comments.
fn header_length(text: &str) -> usize {
    let (mut at, mut blank) = (0, None);
    for line in text.split_inclusive('\n') {
        let words = line.trim_start_matches('\u{feff}').trim();
        if !words.is_empty() && !words.starts_with('#') {
            let start = text.len() - text.trim_start_matches('\u{feff}').len();
            return blank.unwrap_or(at).max(start);
        }
        at += line.len();
        if words.is_empty() {
            blank = Some(at);
        }
    }
    at
}

/// The first value that differs both from the file as it was read and from the next start.
fn first_difference<'b>(
    saved: &'b Block,
    next: &Block,
    present: &'b Block,
) -> Option<Difference<'b>> {
    let fields = saved.fields.iter().zip(&next.fields).zip(&present.fields);
    for ((saved, next), present) in fields {
        let found = match (&saved.content, &next.content, &present.content) {
            (Some(Content::Group(a)), Some(Content::Group(b)), Some(Content::Group(c))) => {
                first_difference(a, b, c)
            }
            (Some(Content::List(a)), Some(Content::List(b)), Some(Content::List(c))) => {
                if a.len() == c.len() {
                    let mut elements = a.iter().zip(b).zip(c);
                    elements.find_map(|((a, b), c)| first_difference(a, b, c))
                } else {
                    Some(Difference {
                        field: saved,
                        read: format!("{} elements", a.len()),
                        present: format!("{} elements", c.len()),
                    })
                }
            }
            (Some(Content::Value(a)), Some(Content::Value(b)), Some(Content::Value(c))) => {
                (a != c && b != c).then(|| Difference {
                    field: saved,
                    read: a.to_toml(),
                    present: c.to_toml(),
                })
            }
            _ => None,
        };
        if found.is_some() {
            return found;
        }
    }
    None
}

/// A difference between the file as it was read and as it is now.
struct Difference<'b> {
    field: &'b Field,
    read: String,
    present: String,
}

impl Edit<'_> {
    /// The conflict if the file has neither the old nor the new value.
    fn conflict(&self, present: &Block) -> Option<String> {
        let ParamChange {
            path,
            old,
            new,
            secret,
        } = &self.change;
        let Some(there) = self.value_in(present) else {
            return Some(format!("`{path}` is not in the file"));
        };
        if there == old || there == new {
            return None;
        }
        if *secret {
            return Some(format!("`{path}` has another value in the file"));
        }
        let [old, new, there] = [old, new, there].map(Value::to_toml);
        Some(format!(
            "`{path}` was {old} when the file was read, is {there} in the file now, and {new} here"
        ))
    }

    /// The conflict if the list around the value changed. Elements are identified by their index
    /// only, so the value might go to another element.
    fn list_conflict(&self, live: &LiveParameters, present: &Block) -> Option<String> {
        let path = &self.change.path;
        if self.value_in(present) == Some(&self.change.new) {
            return None;
        }
        let (mut saved, mut next, mut present) = (&live.saved, &live.next, present);
        for (name, element) in &self.steps {
            let contents = [saved, next, present].map(|block| {
                let field = block.field(name);
                field.and_then(|field| field.content.as_ref())
            });
            (saved, next, present) = match (contents, element) {
                (
                    [
                        Some(Content::Group(a)),
                        Some(Content::Group(b)),
                        Some(Content::Group(c)),
                    ],
                    _,
                ) => (a, b, c),
                (
                    [
                        Some(Content::List(a)),
                        Some(Content::List(b)),
                        Some(Content::List(c)),
                    ],
                    Some(at),
                ) => {
                    if a.len() != c.len() {
                        let list = path.split_once('[').map_or(path.as_str(), |(list, _)| list);
                        return Some(format!(
                            "`{list}` had {} elements when the file was read and has {} now: `{path}` may belong to another element",
                            a.len(),
                            c.len()
                        ));
                    }
                    let Difference {
                        field,
                        read,
                        present,
                    } = first_difference(a.get(*at)?, b.get(*at)?, c.get(*at)?)?;
                    let other = &field.path;
                    return Some(if field.secret {
                        format!(
                            "`{other}` has another value in the file: `{path}` may belong to another element"
                        )
                    } else {
                        format!(
                            "`{other}` was {read} when the file was read and is {present} in the file now: `{path}` may belong to another element"
                        )
                    });
                }
                _ => return None,
            };
        }
        None
    }

    fn write(&self, document: &mut DocumentMut) {
        if !document.contains_key("parameters") {
            document.insert("parameters", Item::Table(Table::new()));
        }
        let mut place = document.get_mut("parameters").and_then(table_of);
        let last = self.steps.len().saturating_sub(1);
        for (name, element) in &self.steps[..last] {
            place = place.and_then(|place| inner(place, name, *element));
        }
        // The check of the new text reports an unexpected structure.
        let Some((table, in_line)) = place else {
            return;
        };
        let name = self.parameter.name.as_str();
        let Ok(new) = self.change.new.to_toml().parse::<toml_edit::Value>() else {
            return;
        };
        if let Some(old) = table.get_mut(name).and_then(Item::as_value_mut) {
            replace(old, new);
        } else {
            if in_line {
                trim_last_suffix(table);
            }
            table.insert(name, Item::Value(new));
        }
    }
}

/// A table, and whether it is an inline table.
type TableAt<'t> = (&'t mut dyn TableLike, bool);

fn table_of(item: &mut Item) -> Option<TableAt<'_>> {
    let in_line = item.is_inline_table();
    Some((item.as_table_like_mut()?, in_line))
}

/// The table `name` in another table, which is created if it is missing; or one of its elements.
fn inner<'t>(
    (table, in_line): TableAt<'t>,
    name: &str,
    element: Option<usize>,
) -> Option<TableAt<'t>> {
    let Some(at) = element else {
        if !table.contains_key(name) {
            let new = if in_line {
                trim_last_suffix(table);
                Item::Value(InlineTable::new().into())
            } else {
                Item::Table(Table::new())
            };
            table.insert(name, new);
        }
        return table.get_mut(name).and_then(table_of);
    };
    match table.get_mut(name)? {
        Item::ArrayOfTables(tables) => tables.get_mut(at).map(|table| (table as _, false)),
        item => {
            let table = item.as_array_mut()?.get_mut(at)?.as_inline_table_mut()?;
            Some((table, true))
        }
    }
}

/// Removes the space between the last value of an inline table and its brace, before a comma is
/// added.
fn trim_last_suffix(table: &mut dyn TableLike) {
    let last = table.iter_mut().last().map(|(_, item)| item);
    if let Some(value) = last.and_then(Item::as_value_mut) {
        value.decor_mut().set_suffix("");
    }
}

/// Replaces `old` by `new`, and keeps comments and line breaks around it.
fn replace(old: &mut toml_edit::Value, mut new: toml_edit::Value) {
    if let (Some(there), Some(wanted)) = (old.as_array_mut(), new.as_array()) {
        while there.len() > wanted.len() {
            there.remove(there.len() - 1);
        }
        let kept = there.len();
        for (old, new) in there.iter_mut().zip(wanted) {
            replace(old, new.clone());
        }
        for value in wanted.iter().skip(kept) {
            // A new element is laid out as the one before it. An array that was empty stays on
            // its line.
            let before = there.len().checked_sub(1).and_then(|at| there.get(at));
            let prefix = before.and_then(|value| value.decor().prefix()?.as_str());
            // The line break and the indentation, without a comment.
            let prefix = prefix.map(|text| &text[text.rfind('\n').unwrap_or(0)..]);
            let prefix = prefix.map(str::to_owned).filter(|_| there.len() > 1);
            let mut value = value.clone();
            if let Some(prefix) = prefix {
                value.decor_mut().set_prefix(prefix);
                there.push_formatted(value);
            } else {
                there.push(value);
            }
        }
        return;
    }
    *new.decor_mut() = old.decor().clone();
    *old = new;
}
