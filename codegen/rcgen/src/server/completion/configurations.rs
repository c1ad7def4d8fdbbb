//! Suggestions in the configuration of a component.

use super::languages::settings_of;
use super::{Completion, Item, PROPERTY, STATEMENTS, Target, VALUE, keywords, of, words};
use rc_vocabulary::Middleware;
use std::path::Path;

impl Completion<'_> {
    /// The start of the word at the cursor, and what is allowed there.
    pub(super) fn in_configuration(
        &self,
        target: &Target<'_>,
        cursor: usize,
    ) -> (usize, Vec<Item>) {
        let before = &target.text[..cursor];
        let line = before.rfind('\n').map_or(0, |feed| feed + 1);
        let written = &before[line..];
        let is_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-');
        let word = written.trim_end_matches(is_word);
        let start = line + word.len();
        if written.trim_start().starts_with('#') {
            return (start, Vec::new());
        }
        let Some(cdsl) = &target.names.component else {
            return (start, Vec::new());
        };
        if let Some(header) = written.trim_start().strip_prefix('[') {
            let header = header.trim_start_matches('[');
            // After a table, or in a row of numbers.
            if header.contains([']', '#', ',']) {
                return (start, Vec::new());
            }
            let start = cursor - header.len();
            return (start, self.tables(cdsl));
        }
        let headers = before[..line].lines().filter_map(|line| {
            let line = line.trim();
            let inner = line.strip_prefix('[')?.split(']').next()?;
            Some(inner.trim_start_matches('[').trim().to_owned())
        });
        let table = headers.fold(String::new(), |_, header| header);
        if let Some((key, value)) = written.split_once('=') {
            let value = value.trim_start();
            let start = line + written.len() - value.len();
            let inner = value.strip_prefix('"').unwrap_or(value);
            // After a value, in a comment, or in a table in braces.
            if inner.contains(['"', '#', '{', '=']) {
                return (start, Vec::new());
            }
            let mut items = self.values(cdsl, &table, key.trim());
            // An editor that has closed the quotes keeps them.
            if value.starts_with('"') && target.text[cursor..].starts_with('"') {
                for item in &mut items {
                    item.label = item.label.trim_matches('"').to_owned();
                }
                return (start + 1, items);
            }
            return (start, items);
        }
        let (inner, start) = match word.trim_start() {
            "" => (table, start),
            dotted => (format!("{table}.{}", dotted.trim_end_matches('.')), start),
        };
        (start, self.keys(cdsl, &inner))
    }

    /// The tables of a configuration.
    fn tables(&self, cdsl: &Path) -> Vec<Item> {
        let mut items = of(keywords::of(&STATEMENTS, "toml", ""));
        items.retain(|item| item.label != "middleware");
        for middleware in Middleware::in_files() {
            let label = format!("middleware.{}", middleware.word());
            items.push(Item::new(PROPERTY, label, "The settings of a middleware."));
        }
        for item in self.parameters_of(cdsl) {
            if is_table(&item) {
                let label = format!("parameters.{}", item.label);
                items.push(Item { label, ..item });
            }
        }
        items
    }

    /// The keys of a table.
    fn keys(&self, cdsl: &Path, table: &str) -> Vec<Item> {
        match table.split_once('.').unwrap_or((table, "")) {
            ("", _) => Vec::new(),
            ("bindings", _) => self.slots_of(cdsl, false),
            ("middleware", word) => Middleware::from_file(word).map_or_else(Vec::new, settings_of),
            ("parameters", inner) => {
                let inner = if inner.is_empty() {
                    String::new()
                } else {
                    format!("{inner}.")
                };
                let all = self.parameters_of(cdsl).into_iter();
                let own = all.filter_map(|item| {
                    let label = item.label.strip_prefix(&inner)?.to_owned();
                    (!label.contains('.')).then_some(Item { label, ..item })
                });
                own.collect()
            }
            (table, _) => of(keywords::of(&STATEMENTS, "toml", table)),
        }
    }

    /// The values of a key, as far as there are few of them.
    fn values(&self, cdsl: &Path, table: &str, key: &str) -> Vec<Item> {
        if (table, key) == ("component", "log") {
            let levels = [
                "\"error\"",
                "\"warn\"",
                "\"info\"",
                "\"debug\"",
                "\"trace\"",
            ];
            return words(levels, "The least severe messages that are logged.");
        }
        let all = self.keys(cdsl, table).into_iter();
        let Some(item) = all.into_iter().find(|item| item.label == key) else {
            return Vec::new();
        };
        if !table.starts_with("parameters") {
            return Vec::new();
        }
        let declared = rc_syntax::tokens(&item.detail);
        let declared: Vec<&str> = declared.iter().map(|token| token.text).collect();
        let choices = declared
            .split(|token| *token == "{")
            .nth(1)
            .unwrap_or_default();
        let choices = choices.iter().take_while(|token| **token != "}");
        let choices = choices.filter(|token| **token != ",");
        let is_bool = declared
            .get(1)
            .is_some_and(|ty| ty.eq_ignore_ascii_case("bool"));
        let bools: &[&str] = if is_bool { &["true", "false"] } else { &[] };
        let quoted = |word: &&str| {
            let is_text = word.starts_with(|c: char| c.is_alphabetic());
            if is_text {
                format!("\"{word}\"")
            } else {
                (*word).to_owned()
            }
        };
        let choices = choices.map(quoted);
        let all = choices.chain(bools.iter().map(|word| (*word).to_owned()));
        all.map(|label| Item {
            detail: item.detail.clone(),
            ..Item::new(VALUE, label, item.doc.clone())
        })
        .collect()
    }
}

/// Whether a parameter is a group or a list.
fn is_table(item: &Item) -> bool {
    let word = item.detail.split_whitespace().next().unwrap_or_default();
    matches!(word.to_ascii_lowercase().as_str(), "group" | "list")
}
