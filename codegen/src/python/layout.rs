//! Where lines break: as the formatter of ruff breaks them.

/// Characters of a line.
const LINE: usize = 88;

/// `head(arguments)tail`, on as few lines as fit; `indent` is the depth of the first one.
pub(crate) fn call(indent: usize, head: &str, arguments: &[String], tail: &str) -> String {
    let margin = " ".repeat(indent);
    let all = arguments.join(", ");
    let width = |text: &str| text.chars().count();
    if indent + width(head) + width(&all) + width(tail) + 2 <= LINE || arguments.is_empty() {
        return format!("{head}({all}){tail}");
    }
    if indent + 4 + width(&all) <= LINE {
        return format!("{head}(\n{margin}    {all}\n{margin}){tail}");
    }
    let lines: String = arguments
        .iter()
        .map(|argument| format!("{margin}    {argument},\n"))
        .collect();
    format!("{head}(\n{lines}{margin}){tail}")
}

/// Whether a text mentions a name that ends with a dot.
pub(crate) fn mentions(texts: &[&str], word: &str) -> bool {
    let starts = |text: &str, at: usize| {
        let mut chars = text[..at].chars();
        chars
            .next_back()
            .is_none_or(|c| !(c.is_alphanumeric() || c == '_'))
    };
    texts
        .iter()
        .any(|text| text.match_indices(word).any(|(at, _)| starts(text, at)))
}

/// `from MODULE import A, B`.
pub(crate) fn import(module: &str, names: &[String]) -> String {
    let line = format!("from {module} import {}", names.join(", "));
    if line.chars().count() <= LINE {
        return line;
    }
    let lines: String = names.iter().map(|name| format!("    {name},\n")).collect();
    format!("from {module} import (\n{lines})")
}

/// Sorts the names of one import as ruff does: constants, classes, then the rest, capitals aside.
pub(crate) fn sort(names: &mut Vec<String>) {
    names.sort_by_key(|name| (rank(name), natural(&name.to_lowercase()), natural(name)));
    names.dedup();
}

/// Sorts the names of `__all__` as ruff does: capitals come first.
pub(crate) fn sort_all(names: &mut Vec<String>) {
    names.sort_by_key(|name| (rank(name), natural(name)));
    names.dedup();
}

/// Constants are first, then classes.
fn rank(name: &str) -> (bool, bool) {
    let shouts = name.len() > 1 && !name.chars().any(char::is_lowercase);
    (!shouts, !name.starts_with(char::is_uppercase))
}

/// A name as a list that compares numbers by their values.
fn natural(name: &str) -> Vec<(String, u64)> {
    let mut parts = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let at = rest
            .find(|c: char| c.is_ascii_digit())
            .unwrap_or(rest.len());
        let (text, behind) = rest.split_at(at);
        let end = behind
            .find(|c: char| !c.is_ascii_digit())
            .unwrap_or(behind.len());
        let (number, behind) = behind.split_at(end);
        parts.push((text.to_owned(), number.parse().unwrap_or_default()));
        rest = behind;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_break_as_ruff_breaks_them() {
        let words = |count: usize| vec!["argument: int".to_owned(); count];
        assert_eq!(
            call(4, "def f", &words(2), ":"),
            "def f(argument: int, argument: int):"
        );
        let wide = call(4, "def a_rather_long_name", &words(4), " -> None:");
        assert_eq!(wide.lines().count(), 3, "{wide}");
        let tall = call(4, "def f", &words(7), " -> None:");
        assert_eq!(tall.lines().count(), 9, "{tall}");
        let mut names = ["foo", "Bar", "Baz", "LIMIT"].map(str::to_owned).to_vec();
        sort(&mut names);
        assert_eq!(names, ["LIMIT", "Bar", "Baz", "foo"]);
        let mut names = ["All", "AVery", "Slot10", "Slot9"]
            .map(str::to_owned)
            .to_vec();
        sort(&mut names);
        assert_eq!(names, ["All", "AVery", "Slot9", "Slot10"]);
        sort_all(&mut names);
        assert_eq!(names, ["AVery", "All", "Slot9", "Slot10"]);
    }
}
