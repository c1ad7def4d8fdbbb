//! Documentation as docstrings, with units and ranges.

use super::names;
use crate::view::documentation;
use crate::view::library::Operation;
use crate::view::members::Member;

/// A docstring whose further lines are indented; none without lines.
pub(crate) fn docstring(indent: usize, lines: &[String]) -> String {
    let escaped = lines.iter().map(|line| escaped(line.trim_end()));
    let lines: Vec<String> = escaped.collect();
    let margin = " ".repeat(indent);
    match trimmed(&lines) {
        [] => String::new(),
        [line] => format!("\"\"\"{line}\"\"\""),
        [first, rest @ ..] => {
            let rest = rest.iter().map(|line| {
                if line.is_empty() {
                    "\n".to_owned()
                } else {
                    format!("\n{margin}{line}")
                }
            });
            let rest: String = rest.collect();
            format!("\"\"\"{first}{rest}\n{margin}\"\"\"")
        }
    }
}

/// A line in a docstring: no quote ends it, a backslash is one, and characters that no source may
/// contain become escapes.
fn escaped(line: &str) -> String {
    let mut out = String::with_capacity(line.len());
    for c in line.chars() {
        match c {
            '\\' | '"' => out.extend(['\\', c]),
            '\t' => out.push(c),
            c if c.is_control() => out.push_str(&hexadecimal(c)),
            c => out.push(c),
        }
    }
    out
}

fn hexadecimal(c: char) -> String {
    format!("\\x{:02x}", u32::from(c))
}

/// A docstring of `lines`, or of `otherwise` if there is no documentation.
pub(crate) fn docstring_or(indent: usize, lines: &[String], otherwise: String) -> String {
    let text = docstring(indent, lines);
    if text.is_empty() {
        docstring(indent, &[otherwise])
    } else {
        text
    }
}

/// Lines without empty ones around them.
fn trimmed(lines: &[String]) -> &[String] {
    let is_text = |line: &String| !line.is_empty();
    let first = lines.iter().position(is_text);
    let last = lines.iter().rposition(is_text);
    match (first, last) {
        (Some(first), Some(last)) => &lines[first..=last],
        _ => &[],
    }
}

/// The documentation of a member with its unit and its range.
pub(super) fn of_member(member: &Member) -> String {
    docstring(4, &documentation::of_member(member))
}

/// The documentation of an operation with the units and ranges of its parameters.
pub(super) fn of_operation(operation: &Operation) -> String {
    let doc = documentation::of_operation(operation, names::parameter);
    docstring_or(8, &doc, format!("The operation `{}`.", operation.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_documentation_ends_its_docstring() {
        let lines = ["Says \"no\" to C:\\n\u{0}\u{b}.", "\u{1b}[2J\u{85}é\t|  "].map(str::to_owned);
        let wanted = r#""""Says \"no\" to C:\\n\x00\x0b.
\x1b[2J\x85é	|
""""#;
        assert_eq!(docstring(0, &lines), wanted);
    }
}
