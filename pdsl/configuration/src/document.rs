//! Access to the values of a TOML document.

use crate::model::Value;
use rc_diagnostics::{SourceId, SourceMap, Span};
use serde_json::Value as Json;
use std::ops::Range;
use toml_edit::{Item, TableLike};

/// Converts ranges of a document into spans of a source.
#[derive(Clone, Copy)]
pub(crate) struct Locator {
    pub(crate) source: SourceId,
}

impl Locator {
    /// For findings without a source.
    pub(crate) fn nowhere() -> Self {
        let source = SourceMap::new().add("", "");
        Self { source }
    }

    /// The span of `range`, or `around` if there is no range.
    pub(crate) fn span(self, range: Option<Range<usize>>, around: Span) -> Span {
        range.map_or(around, |range| {
            Span::new(self.source, range.start, range.end)
        })
    }

    /// The start of the source.
    pub(crate) fn start(self) -> Span {
        Span::new(self.source, 0, 0)
    }
}

/// A single value. `None` for arrays, tables and dates.
pub(crate) fn value(item: &Item) -> Option<Value> {
    match item.as_value()? {
        toml_edit::Value::String(text) => Some(Value::Text(text.value().clone())),
        toml_edit::Value::Integer(value) => Some(Value::Int(*value.value())),
        toml_edit::Value::Float(value) => Some(Value::Float(*value.value())),
        toml_edit::Value::Boolean(value) => Some(Value::Bool(*value.value())),
        toml_edit::Value::Datetime(_)
        | toml_edit::Value::Array(_)
        | toml_edit::Value::InlineTable(_) => None,
    }
}

/// Collects the ranges of all values in `item`.
pub(crate) fn values_in(item: &Item, out: &mut Vec<Range<usize>>) {
    if let Some(table) = item.as_table_like() {
        table.iter().for_each(|(_, item)| values_in(item, out));
    } else if let Some(tables) = item.as_array_of_tables() {
        let items = tables.iter().flat_map(|table| table.iter());
        items.for_each(|(_, item)| values_in(item, out));
    } else {
        out.extend(item.span());
    }
}

/// The ranges of possible secrets in the lines of `shown`, in a text that is not valid TOML:
/// whatever follows `=`, or the whole line if it has no key.
pub(crate) fn values_in_lines(text: &str, shown: Range<usize>) -> Vec<Range<usize>> {
    let start = text[..shown.start].rfind('\n').map_or(0, |feed| feed + 1);
    let end = text[shown.end..].find('\n');
    let end = end.map_or(text.len(), |feed| shown.end + feed);
    let (mut at, mut values) = (start, Vec::new());
    for line in text[start..end].split_inclusive('\n') {
        let before = &text[..at];
        let in_text = ["\"\"\"", "'''"]
            .iter()
            .any(|quotes| before.matches(quotes).count() % 2 == 1);
        let is_key = |key: &&str| {
            let word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
            !in_text && key.trim().chars().all(word)
        };
        let key = line.split_once('=').map(|(key, _)| key).filter(is_key);
        let value = key.map_or(line, |key| line[key.len() + 1..].trim_start());
        values.push(at + line.len() - value.len()..at + line.len());
        at += line.len();
    }
    values
}

/// The keys of a configuration, each with its path from the root and its location. Elements of
/// lists share the path of the list. Empty if the text is not TOML.
#[cfg(feature = "tools")]
pub fn keys(sources: &SourceMap, source: SourceId) -> Vec<(Vec<String>, Span)> {
    let mut out = Vec::new();
    if let Ok(document) = toml_edit::Document::parse(sources.text(source)) {
        keys_of(document.as_table(), &mut Vec::new(), source, &mut out);
    }
    out
}

#[cfg(feature = "tools")]
fn keys_of(
    table: &dyn TableLike,
    path: &mut Vec<String>,
    source: SourceId,
    out: &mut Vec<(Vec<String>, Span)>,
) {
    for (name, item) in table.iter() {
        path.push(name.to_owned());
        let key = table.get_key_value(name).and_then(|(key, _)| key.span());
        out.extend(key.map(|key| (path.clone(), Span::new(source, key.start, key.end))));
        if let Some(table) = item.as_table_like() {
            keys_of(table, path, source, out);
        }
        for (table, _) in tables(item).unwrap_or_default() {
            keys_of(table, path, source, out);
        }
        path.pop();
    }
}

/// An element of a list, with its range.
pub(crate) type Element<'a> = (&'a dyn TableLike, Option<Range<usize>>);

/// The elements of `[[name]]` or of `[{ … }, { … }]`.
pub(crate) fn tables(item: &Item) -> Option<Vec<Element<'_>>> {
    if let Some(tables) = item.as_array_of_tables() {
        return Some(
            tables
                .iter()
                .map(|table| (table as &dyn TableLike, table.span()))
                .collect(),
        );
    }
    item.as_array()?
        .iter()
        .map(|value| {
            value
                .as_inline_table()
                .map(|table| (table as &dyn TableLike, table.span()))
        })
        .collect()
}

/// "the number 5" or "a table", for messages. A secret value is left out.
pub(crate) fn described(item: &Item, secret: bool) -> String {
    match value(item) {
        Some(Value::Text(_)) if secret => "this string".to_owned(),
        Some(Value::Int(_) | Value::Float(_)) if secret => "this number".to_owned(),
        Some(value @ Value::Text(_)) => format!("the string {}", value.to_toml()),
        Some(value @ Value::Bool(_)) => format!("`{}`", value.to_toml()),
        Some(value) => format!("the number {}", value.to_toml()),
        None if item.is_array() => "an array".to_owned(),
        None if item.is_array_of_tables() => "a list of tables".to_owned(),
        None if item.is_table_like() => "a table".to_owned(),
        None => "a date".to_owned(),
    }
}

/// Converts an item into JSON, for readers of tables that this crate does not know.
pub(crate) fn json(item: &Item) -> Json {
    if let Some(table) = item.as_table_like() {
        return Json::Object(
            table
                .iter()
                .map(|(key, item)| (key.to_owned(), json(item)))
                .collect(),
        );
    }
    if let Some(tables) = item.as_array_of_tables() {
        return tables
            .iter()
            .map(|table| json(&Item::Table(table.clone())))
            .collect();
    }
    if let Some(array) = item.as_array() {
        return array
            .iter()
            .map(|value| json(&Item::Value(value.clone())))
            .collect();
    }
    match value(item) {
        Some(value) => value.to_json(),
        None => item
            .as_datetime()
            .map_or(Json::Null, |date| Json::from(date.to_string())),
    }
}

/// Parses a TOML file of a tool.
///
/// # Errors
/// The text is not TOML: what is wrong, with its line and column.
pub fn parse_document(text: &str) -> Result<serde_json::Map<String, Json>, String> {
    let document = toml_edit::Document::parse(text).map_err(|error| error.to_string())?;
    let table = document.as_table().iter();
    Ok(table
        .map(|(key, item)| (key.to_owned(), json(item)))
        .collect())
}

/// Parses a value of a command line as TOML. Any other text is a string.
pub fn parse_argument(text: &str) -> Json {
    match text.parse::<toml_edit::Value>() {
        Ok(value) => json(&Item::Value(value)),
        Err(_) => Json::from(text),
    }
}

/// Converts JSON into TOML, so that one function checks both. `None` for null. JSON has no `nan`
/// and no infinities: where a `number` is expected, strings stand for them.
pub(crate) fn from_json(json: &Json, number: bool) -> Option<Item> {
    value_from_json(json, number).map(Item::Value)
}

fn value_from_json(json: &Json, number: bool) -> Option<toml_edit::Value> {
    Some(match json {
        Json::Null => return None,
        Json::Bool(value) => (*value).into(),
        Json::Number(value) => match value.as_i64() {
            Some(int) => int.into(),
            None => value.as_f64()?.into(),
        },
        Json::String(text) => match text.as_str() {
            "nan" if number => f64::NAN.into(),
            "inf" | "+inf" if number => f64::INFINITY.into(),
            "-inf" if number => f64::NEG_INFINITY.into(),
            text => text.into(),
        },
        Json::Array(values) => {
            let values = values.iter().map(|value| value_from_json(value, number));
            toml_edit::Value::Array(values.collect::<Option<_>>()?)
        }
        Json::Object(_) => toml_edit::InlineTable::new().into(),
    })
}
