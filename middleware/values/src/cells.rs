//! Values as cells of a table.

use crate::value::Value;
use rc_diagnostics::foreign::clean_to;

/// The numbers and texts of a value, each with its path. A sequence is one cell, as JSON.
pub fn cells(path: &str, value: &Value) -> Vec<(String, String)> {
    let mut found = Vec::new();
    flatten(path, value, &mut found);
    found
}

fn flatten(path: &str, value: &Value, found: &mut Vec<(String, String)>) {
    match value {
        Value::Struct(ty, values) => {
            for (member, value) in ty.members.iter().zip(values) {
                let dot = if path.is_empty() { "" } else { "." };
                flatten(&format!("{path}{dot}{}", member.name), value, found);
            }
        }
        Value::Numbers(_) | Value::Sequence(_) | Value::Map(_) => {
            let text = serde_json::to_string(value).unwrap_or_default();
            found.push((path.to_owned(), text));
        }
        other => found.push((path.to_owned(), other.plain())),
    }
}

/// The columns of a table in CSV: those of its first value. An optional structure may be missing in
/// some values.
///
/// ```
/// let cell = |name: &str, text: &str| (name.to_owned(), text.to_owned());
/// let first = [cell("pose.x", "1"), cell("name", "a")];
/// let mut columns = rc_values::Columns::new("time", &first);
/// assert_eq!(columns.header(), "time,pose.x,name\n");
/// assert_eq!(columns.row("5", &first), "5,1,a\n");
/// assert_eq!(columns.row("6", &[cell("pose", "null"), cell("name", "b")]), "6,,b\n");
/// assert_eq!(columns.missing(&[cell("pose.y", "2")]), Some("pose.y"));
/// ```
pub struct Columns {
    names: Vec<String>,
    header: String,
    /// Whether [`Columns::missing`] has found a cell.
    is_reported: bool,
}

impl Columns {
    /// The columns of a value, behind others with the names `before`.
    pub fn new(before: &str, first: &[(String, String)]) -> Self {
        let names: Vec<String> = first.iter().map(|(name, _)| name.clone()).collect();
        Self {
            header: line(before, names.iter().map(String::as_str)),
            names,
            is_reported: false,
        }
    }

    /// The line of the names.
    pub fn header(&self) -> &str {
        &self.header
    }

    /// The line of a value. `before` is the text of the columns before.
    pub fn row(&self, before: &str, found: &[(String, String)]) -> String {
        let cell = |name: &String| {
            let cell = found.iter().find(|(found, _)| found == name);
            cell.map_or("", |(_, cell)| cell)
        };
        line(before, self.names.iter().map(cell))
    }

    /// The name of a cell that has no column, once.
    pub fn missing<'c>(&mut self, found: &'c [(String, String)]) -> Option<&'c str> {
        if self.is_reported {
            return None;
        }
        // A structure that is missing has a cell of its own, in place of those of its members.
        let is_part = |column: &str, name: &str| {
            let rest = column.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let has = |name: &str| self.names.iter().any(|column| is_part(column, name));
        let (name, _) = found.iter().find(|(name, _)| !has(name))?;
        self.is_reported = true;
        Some(name)
    }
}

fn line<'c>(before: &str, cells: impl Iterator<Item = &'c str>) -> String {
    let cells = cells.map(|cell| format!(",{}", csv_cell(cell)));
    format!("{before}{}\n", cells.collect::<String>())
}

/// A cell of CSV: in quotes where it needs them (RFC 4180), with control characters shown.
///
/// ```
/// assert_eq!(rc_values::csv_cell("a \"b\", c"), "\"a \"\"b\"\", c\"");
/// assert_eq!(rc_values::csv_cell("a\n\u{1b}[2J"), "a\\n\\u{1b}[2J");
/// ```
pub fn csv_cell(text: &str) -> String {
    let text = clean_to(text, usize::MAX);
    if text.contains(['"', ',']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text
    }
}
