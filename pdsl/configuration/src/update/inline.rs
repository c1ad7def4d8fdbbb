//! Updates inline tables, which have no room for comments: `{ id = 1, max = 2.0 }`.

use super::key_matches::KeyMatches;
use super::{Change, ChangeKind, REMOVED_NOTE, Updater, added_kind, candidates};
use crate::block::inner;
use crate::model::{Kind, Parameter};
use toml_edit::{InlineTable, TableLike, Value};

impl Updater<'_> {
    /// Updates an inline table, or each one in an array.
    pub(super) fn value(&mut self, value: &Value, parameters: &[Parameter], path: &str) {
        let mut all = Vec::new();
        match value {
            Value::InlineTable(table) => all.push((table, path.to_owned())),
            Value::Array(array) => {
                let tables = array.iter().enumerate();
                all.extend(tables.filter_map(|(index, value)| {
                    Some((value.as_inline_table()?, format!("{path}[{index}]")))
                }));
            }
            _ => {}
        }
        for (table, path) in all {
            let (Some(span), known) = (table.span(), self.changes.len()) else {
                continue;
            };
            let mut gone = String::new();
            let text = self.inline(table, parameters, &path, &mut gone);
            if self.changes[known..].iter().all(Change::needs_decision) {
                continue;
            }
            let Some(text) = text.filter(|_| !self.text.slice(span.clone()).contains('\n')) else {
                self.changes.truncate(known);
                let at = self.locator.span(Some(span), self.locator.start());
                self.change(path, at, ChangeKind::Manual);
                continue;
            };
            if !gone.is_empty() {
                let line = self.text.line(span.start);
                self.text
                    .replace(line..line, format!("# {REMOVED_NOTE}\n{gone}"));
            }
            self.text.replace(span, text);
        }
    }

    /// The updated text of a table. Appends removed keys to `gone`. `None` if the notation is not
    /// supported.
    fn inline(
        &mut self,
        table: &InlineTable,
        parameters: &[Parameter],
        path: &str,
        gone: &mut String,
    ) -> Option<String> {
        let at = self.locator.span(table.span(), self.locator.start());
        let names = KeyMatches::of(parameters, table, self.locator);
        let mut simple = true;
        // Each entry with the index of its parameter.
        let mut entries: Vec<(usize, String)> = Vec::new();
        for (name, value) in table {
            let spans = TableLike::key(table, name).and_then(toml_edit::Key::span);
            let (Some(key), Some(span)) = (spans, value.span()) else {
                return None;
            };
            simple &= !value.as_inline_table().is_some_and(InlineTable::is_dotted);
            let here = self.locator.span(Some(key.clone()), at);
            let raw = self.text.slice(span);
            let known = names.is_parameter(name).then_some(name);
            let renamed = names.renamed(name).map(|p| p.name.as_str());
            let Some(to) = known.or(renamed) else {
                if !names.candidates(name).is_empty() {
                    let new = candidates(names.candidates(name), path);
                    self.change(inner(path, name), here, ChangeKind::Ambiguous(new));
                    entries.push((usize::MAX, format!("{} = {raw}", self.text.slice(key))));
                    continue;
                }
                let near = names.nearest(name).map(|near| inner(path, near));
                self.change(inner(path, name), here, ChangeKind::Removed(near));
                gone.push_str(&format!("# {} = {raw}\n", inner(path, name)));
                continue;
            };
            if known.is_none() {
                let kind = ChangeKind::Renamed(inner(path, to));
                self.change(inner(path, name), here, kind);
            }
            let index = parameters.iter().position(|p| p.name == to)?;
            let new = match (value, &parameters[index].kind) {
                (Value::InlineTable(table), Kind::Group(members)) => {
                    self.inline(table, members, &inner(path, to), gone)
                }
                _ => Some(raw.to_owned()),
            };
            let key = if known.is_some() {
                self.text.slice(key)
            } else {
                to
            };
            entries.push((index, format!("{key} = {}", new?)));
        }
        for (index, parameter) in parameters.iter().enumerate() {
            if table.contains_key(&parameter.name)
                || entries.iter().any(|(known, _)| *known == index)
                || !names.is_unambiguous(parameter)
            {
                continue;
            }
            let path = inner(path, &parameter.name);
            // The checker reports a missing required parameter: there is no room for a comment. A
            // missing group has its defaults.
            if let Some(default) = &parameter.default {
                let text = format!("{} = {}", parameter.name, default.to_toml());
                let place = entries.iter().rposition(|(known, _)| *known < index);
                entries.insert(place.map_or(0, |at| at + 1), (index, text));
                self.change(path, at, added_kind(parameter));
            }
        }
        let texts: Vec<String> = entries.into_iter().map(|(_, text)| text).collect();
        if texts.is_empty() {
            return simple.then(|| "{}".to_owned());
        }
        simple.then(|| format!("{{ {} }}", texts.join(", ")))
    }
}
