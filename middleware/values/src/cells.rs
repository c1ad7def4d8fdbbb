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
