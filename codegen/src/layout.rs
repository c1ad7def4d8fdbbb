//! Where rustfmt would break a line. Generated code is as rustfmt leaves it, without needing rustfmt.
//!
//! The limits are rustfmt's defaults: lines of 100 characters, arguments of a call of 60.

use std::cmp::Ordering;

/// Most characters of a line.
pub const LINE: usize = 100;
const CALL: usize = 60;
/// Arguments and elements up to this length fill lines instead of having one each.
const SHORT: usize = 10;

/// The signature of a function, `HEAD(A, B)TAIL`: on one line if it fits, else one argument a line. `tail` is
/// what is returned, then ` {` or `;`. `indent` counts spaces.
pub fn signature(indent: usize, head: &str, args: &[String], tail: &str) -> String {
    let pad = " ".repeat(indent);
    let one = format!("{head}({}){tail}", args.join(", "));
    if indent + one.len() <= LINE {
        // rustfmt keeps room for ` {` behind what is returned, even where a `;` follows.
        return match tail.strip_suffix(';') {
            Some(result) if !result.is_empty() && indent + one.len() == LINE => {
                let head = format!("{head}({})", args.join(", "));
                format!("{head}\n{pad}{};", result.trim_start())
            }
            _ => one,
        };
    }
    match tail.strip_suffix(" {") {
        // Of its last line it counts the indentation twice.
        Some(result) if indent + ")".len() + tail.len() > LINE - indent => {
            format!("{}\n{pad}{{", broken(indent, head, args, result))
        }
        _ => broken(indent, head, args, tail),
    }
}

/// A call as a statement: like a signature, but its arguments are also short.
pub fn call(indent: usize, head: &str, args: &[String], tail: &str) -> String {
    let width = args.join(", ").len();
    let one = format!("{head}({}){tail}", args.join(", "));
    if width <= CALL && indent + one.len() <= LINE {
        return one;
    }
    if args.iter().all(|arg| arg.len() <= SHORT) {
        let lines = filled(indent + 4, args).join("\n");
        return format!("{head}(\n{lines}\n{}){tail}", " ".repeat(indent));
    }
    broken(indent, head, args, tail)
}

/// `HEAD RESULT<(A, B), ERROR> {` of a function with one parameter, which returns a tuple.
pub fn tuple_result(head: &str, parameter: &str, items: &[String], error: &str) -> String {
    let inner = items.join(", ");
    if items.len() < 2 || inner.len() <= CALL {
        let value = if items.len() == 1 {
            inner
        } else {
            format!("({inner})")
        };
        let tail = format!(" -> Result<{value}, {error}> {{");
        return signature(0, head, &[parameter.to_owned()], &tail);
    }
    let lines: String = items.iter().map(|i| format!("        {i},\n")).collect();
    format!("{head}(\n    {parameter},\n) -> Result<\n    (\n{lines}    ),\n    {error},\n> {{")
}

/// `HEAD = (A, B);` at the left edge.
pub fn tuple_alias(head: &str, items: &[String]) -> String {
    let inner = items.join(", ");
    if inner.len() > CALL {
        broken(0, &format!("{head} = "), items, ";")
    } else if head.len() + inner.len() + 6 <= LINE {
        format!("{head} = ({inner});")
    } else {
        format!("{head} =\n    ({inner});")
    }
}

/// A chain of calls, `base.a().b()`, behind `before` characters of its line and before a comma.
pub fn chain(indent: usize, before: usize, base: &str, calls: &[&str]) -> String {
    let one = format!("{base}{}", calls.concat());
    if one.len() <= CALL && indent + before + one.len() < LINE {
        return one;
    }
    let pad = " ".repeat(indent + 4);
    let lines: String = calls.iter().map(|c| format!("\n{pad}{c}")).collect();
    format!("{base}{lines}")
}

/// `let PATTERN = HEAD(A, B)TAIL`: what does not fit behind the `=` stands below it. A pattern of several names
/// that does not fit has one a line.
pub fn binding(indent: usize, names: &[String], head: &str, args: &[String], tail: &str) -> String {
    let pattern = match names {
        [one] => one.clone(),
        many => format!("({})", many.join(", ")),
    };
    // Of ` =` it counts the space alone.
    if indent + "let  ".len() + pattern.len() > LINE {
        let value = call(indent, &format!(") = {head}"), args, tail);
        let pad = " ".repeat(indent + 4);
        let names: String = names.iter().map(|n| format!("{pad}{n},\n")).collect();
        return format!("let (\n{names}{}{value}", " ".repeat(indent));
    }
    let one = format!("let {pattern} = {head}({}){tail}", args.join(", "));
    // What follows the closing bracket of a method rustfmt counts twice more.
    let times = if head.contains('.') { 2 } else { 0 };
    let again = tail.trim_end_matches(';').len() * times;
    if args.join(", ").len() <= CALL && indent + one.len() + again > LINE {
        let value = format!("{head}({}){tail}", args.join(", "));
        if indent + 4 + value.len() <= LINE {
            return format!("let {pattern} =\n{}{value}", " ".repeat(indent + 4));
        }
    }
    call(indent, &format!("let {pattern} = {head}"), args, tail)
}

/// Items one after the other, as many a line as fit, each with its comma. Only one that holds all of them may be
/// full.
fn filled(indent: usize, items: &[String]) -> Vec<String> {
    let pad = " ".repeat(indent);
    let one = format!("{pad}{},", items.join(", "));
    if one.len() <= LINE {
        return vec![one];
    }
    let mut lines: Vec<String> = Vec::new();
    for item in items {
        match lines.last_mut() {
            Some(last) if last.len() + item.len() + 2 < LINE => {
                last.push(' ');
                last.push_str(item);
                last.push(',');
            }
            _ => lines.push(format!("{pad}{item},")),
        }
    }
    lines
}

fn broken(indent: usize, head: &str, args: &[String], tail: &str) -> String {
    let pad = " ".repeat(indent);
    let lines: String = args
        .iter()
        .map(|arg| format!("{pad}    {arg},\n"))
        .collect();
    format!("{head}(\n{lines}{pad}){tail}")
}

/// `HEAD = &[A, B];` at the left edge.
pub fn constant(head: &str, items: &[String]) -> String {
    let array = array_in(0, items);
    let one_line = !array.contains('\n');
    if one_line && head.len() + array.len() + " = ;".len() > LINE {
        format!("{head} =\n    {array};")
    } else {
        format!("{head} = {array};")
    }
}

/// An array: on one line up to 60 characters; else short items fill lines and others have a line each.
pub fn array_in(indent: usize, items: &[String]) -> String {
    let one = items.join(", ");
    if one.len() <= CALL {
        return format!("&[{one}]");
    }
    let pad = " ".repeat(indent);
    let lines = if items.iter().all(|item| item.len() <= SHORT) {
        filled(indent + 4, items)
    } else {
        items
            .iter()
            .map(|item| format!("{pad}    {item},"))
            .collect()
    };
    format!("&[\n{}\n{pad}]", lines.join("\n"))
}

/// A documentation comment, one line each.
pub fn doc(lines: &[String]) -> Vec<String> {
    lines
        .iter()
        .map(|line| {
            if line.is_empty() {
                "///".to_owned()
            } else {
                format!("/// {}", line.trim_end())
            }
        })
        .collect()
}

/// The order in which rustfmt has names: numbers in them by their value, `_` before everything else.
pub fn order(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    while let (Some(first), Some(second)) = (a.chars().next(), b.chars().next()) {
        if first.is_ascii_digit() && second.is_ascii_digit() {
            let (left, right) = (digits(a), digits(b));
            let value = |text: &str| text.trim_start_matches('0').to_owned();
            let (x, y) = (value(left), value(right));
            let by_value = x.len().cmp(&y.len()).then_with(|| x.cmp(&y));
            // Of two that are worth the same, the one with more zeros comes first.
            let order = by_value.then_with(|| right.len().cmp(&left.len()));
            if order.is_ne() {
                return order;
            }
            (a, b) = (&a[left.len()..], &b[right.len()..]);
        } else if first == second {
            (a, b) = (&a[first.len_utf8()..], &b[second.len_utf8()..]);
        } else {
            let place = |c: char| (c != '_', c);
            return place(first).cmp(&place(second));
        }
    }
    a.len().cmp(&b.len())
}

fn digits(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_ascii_digit());
    &text[..end.unwrap_or(text.len())]
}

/// `use KRATE::{A, B};` as rustfmt lays it out: as many names a line as fit.
pub fn imports(krate: &str, names: &[String]) -> String {
    if let [one] = names {
        return format!("use {krate}::{one};");
    }
    let line = format!("use {krate}::{{{}}};", names.join(", "));
    // rustfmt keeps two characters free.
    if line.len() + 2 <= LINE {
        return line;
    }
    format!("use {krate}::{{\n{}\n}};", filled(4, names).join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_sorted_as_rustfmt_does() {
        let mut names = [
            "Worker",
            "WorkerError",
            "Worker_",
            "Slot10",
            "Slot9",
            "Slot",
            "Slot09",
        ];
        names.sort_by(|a, b| order(a, b));
        let wanted = [
            "Slot",
            "Slot09",
            "Slot9",
            "Slot10",
            "Worker",
            "Worker_",
            "WorkerError",
        ];
        assert_eq!(names, wanted);
    }
}
