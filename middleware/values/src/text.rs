//! Values as text for people: a line for each member, with its unit.

use crate::numbers::Numbers;
use crate::value::{Value, word};
use rc_diagnostics::foreign::{clean_to, escape_to};

/// How a value is printed.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    /// The most elements of a sequence that are shown.
    pub elements: usize,
    /// The most characters of a text that are shown.
    pub characters: usize,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            elements: 8,
            characters: 256,
        }
    }
}

impl Value {
    /// The value as text. It ends with a line break; texts inside are cleaned.
    pub fn text(&self, style: &Style) -> String {
        let mut out = String::new();
        match self {
            Self::Struct(..) => members(self, 0, style, &mut out),
            other => line_or_block(other, None, 0, style, &mut out),
        }
        if out.is_empty() {
            out.push_str("{}\n");
        }
        out
    }
}

fn members(value: &Value, indent: usize, style: &Style, out: &mut String) {
    let Value::Struct(ty, values) = value else {
        return;
    };
    for (member, value) in ty.members.iter().zip(values) {
        pad(indent, out);
        out.push_str(&clean_to(&member.name, style.characters));
        out.push(':');
        if is_line(value) {
            out.push(' ');
        }
        line_or_block(value, member.unit.as_deref(), indent, style, out);
    }
}

/// Whether a value takes one line.
fn is_line(value: &Value) -> bool {
    match value {
        Value::Struct(_, values) => values.is_empty(),
        Value::Sequence(items) => items
            .iter()
            .all(|item| matches!(item, Value::Text(_) | Value::Enum(..))),
        Value::Map(pairs) => pairs.is_empty(),
        _ => true,
    }
}

/// Prints the rest of a line, or a block below it.
fn line_or_block(
    value: &Value,
    unit: Option<&str>,
    indent: usize,
    style: &Style,
    out: &mut String,
) {
    if is_line(value) {
        out.push_str(&line(value, style));
        let has_unit = !matches!(value, Value::Missing);
        if let Some(unit) = unit.filter(|_| has_unit) {
            out.push(' ');
            out.push_str(&clean_to(unit, style.characters));
        }
        out.push('\n');
        return;
    }
    match value {
        Value::Struct(..) => {
            out.push('\n');
            members(value, indent + 1, style, out);
        }
        Value::Sequence(items) => {
            out.push_str(&format!(" {} elements\n", items.len()));
            for item in items.iter().take(style.elements) {
                pad(indent + 1, out);
                out.push_str("- ");
                let mut block = String::new();
                match item {
                    Value::Struct(_, values) if !values.is_empty() => {
                        members(item, indent + 2, style, &mut block);
                        out.push_str(block.trim_start());
                    }
                    other => line_or_block(other, unit, indent + 1, style, out),
                }
            }
            more(items.len(), indent, style, out);
        }
        Value::Map(pairs) => {
            out.push_str(&format!(" {} entries\n", pairs.len()));
            for (key, item) in pairs.iter().take(style.elements) {
                pad(indent + 1, out);
                out.push_str(&line(key, style));
                out.push(':');
                if is_line(item) {
                    out.push(' ');
                }
                line_or_block(item, None, indent + 1, style, out);
            }
            more(pairs.len(), indent, style, out);
        }
        _ => {}
    }
}

fn more(count: usize, indent: usize, style: &Style, out: &mut String) {
    if count > style.elements {
        pad(indent + 1, out);
        out.push_str(&format!("… {} more\n", count - style.elements));
    }
}

fn line(value: &Value, style: &Style) -> String {
    match value {
        Value::Text(text) => format!("\"{}\"", escape_to(text, style.characters)),
        Value::F32(number) => float(f64::from(*number), number.to_string()),
        Value::F64(number) => float(*number, number.to_string()),
        Value::Numbers(numbers) => of_numbers(numbers, style),
        Value::Sequence(items) => {
            let shown = items
                .iter()
                .take(style.elements)
                .map(|item| line(item, style));
            list(&shown.collect::<Vec<_>>(), items.len())
        }
        Value::Missing => "missing".to_owned(),
        Value::Struct(..) | Value::Map(_) => "{}".to_owned(),
        other => clean_to(&other.plain(), style.characters),
    }
}

fn float(number: f64, text: String) -> String {
    word(number).map_or(text, str::to_owned)
}

fn of_numbers(numbers: &Numbers, style: &Style) -> String {
    let shown = (0..numbers.len().min(style.elements)).filter_map(|at| numbers.get(at));
    let shown: Vec<String> = shown.map(|value| line(&value, style)).collect();
    list(&shown, numbers.len())
}

fn list(shown: &[String], count: usize) -> String {
    let items = shown.join(", ");
    if shown.len() < count {
        format!("[{items}, … {} more]", count - shown.len())
    } else {
        format!("[{items}]")
    }
}

fn pad(indent: usize, out: &mut String) {
    out.extend(std::iter::repeat_n("  ", indent));
}
