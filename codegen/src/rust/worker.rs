//! The user's worker: its name, and where rustfmt breaks its lines. `cargo fmt` must leave the
//! worker as rcgen wrote it.

use std::cmp::Ordering;

/// Name of a new component's worker.
pub(crate) const WORKER: &str = "SpecificWorker";

/// Most characters of a line.
const LINE: usize = 100;

/// Spaces before a function of an `impl`.
const INDENT: usize = 4;

/// The signature of a function of an `impl`, `HEAD(A, B)RETURNS {`: on one line if it fits, else
/// one argument a line. The first line comes without its indentation.
pub fn signature(head: &str, args: &[String], returns: &str) -> String {
    let one = format!("{head}({}){returns} {{", args.join(", "));
    if INDENT + one.len() <= LINE {
        return one;
    }
    let pad = " ".repeat(INDENT);
    let args = args.iter().map(|arg| format!("{pad}{pad}{arg},\n"));
    let broken = format!("{head}(\n{}{pad}){returns}", args.collect::<String>());
    // rustfmt counts the indentation of the last line twice.
    if INDENT + ")".len() + returns.len() + " {".len() > LINE - INDENT {
        format!("{broken}\n{pad}{{")
    } else {
        format!("{broken} {{")
    }
}

/// Items one after the other, as many a line as fit, each with its comma. Only a line that holds
/// all of them may be full.
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

/// The order in which rustfmt has names: numbers in them by their value, `_` before everything
/// else.
pub fn order(a: &str, b: &str) -> Ordering {
    let (mut a, mut b) = (a, b);
    while let (Some(first), Some(second)) = (a.chars().next(), b.chars().next()) {
        if first.is_ascii_digit() && second.is_ascii_digit() {
            let (left, right) = (digits(a), digits(b));
            let value = |text: &str| text.trim_start_matches('0').to_owned();
            let (x, y) = (value(left), value(right));
            let by_value = x.len().cmp(&y.len()).then_with(|| x.cmp(&y));
            // Of two with equal values, the one with more zeros comes first.
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
