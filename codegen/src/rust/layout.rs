//! The layout of generated Rust: the lines of the templates, indented by their brackets, with an
//! empty line between items and between functions. Long lines are broken after commas.

use std::borrow::Cow;

/// Most characters of a line that can be broken.
const LINE: usize = 120;

/// A list that is not longer stays on its line.
const SHORTEST: usize = 24;

/// A bracket that nothing closes or opens.
#[derive(Debug, thiserror::Error)]
#[error("line {line}: brackets do not match near `{text}`")]
pub(super) struct Unbalanced {
    line: usize,
    text: String,
}

/// Lays out a file.
pub(super) fn file(text: &str) -> Result<String, Unbalanced> {
    let mut out = String::with_capacity(text.len() + text.len() / 2);
    // The open brackets, and by how much each one indents: those of one line do so once.
    let mut open: Vec<usize> = Vec::new();
    // The end of a raw string over several lines.
    let mut raw: Option<String> = None;
    let mut before = Before::Start;
    for (at, line) in text.lines().enumerate() {
        if let Some(end) = &raw {
            out.push_str(line);
            out.push('\n');
            if line.contains(end.as_str()) {
                raw = None;
            }
            continue;
        }
        let line = line.trim();
        if line.is_empty() {
            continue;
        }
        let unbalanced = || Unbalanced {
            line: at + 1,
            text: line.to_owned(),
        };
        let scan = Scan::of(line);
        let left = open.len().checked_sub(scan.closed);
        open.truncate(left.ok_or_else(unbalanced)?);
        let here = open.iter().sum();
        let kind = Kind::of(line);
        if kind.begins(before) {
            out.push('\n');
        }
        before = Before::of(line, kind, before);
        let code = &line[..scan.code];
        if scan.raw.is_none() && !line.starts_with("//") {
            write(&tidy(code), here, &mut out);
            out.push_str(&line[scan.code..]);
        } else {
            indent(here, &mut out);
            out.push_str(line);
        }
        out.push('\n');
        open.extend((0..scan.opened).map(|at| usize::from(at == 0)));
        raw = scan.raw;
    }
    if open.is_empty() {
        Ok(out)
    } else {
        Err(Unbalanced {
            line: text.lines().count(),
            text: "the end".to_owned(),
        })
    }
}

/// The beginning of a line.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// An import, or an export of a name.
    Use,
    Export,
    /// A module in a file of its own.
    Module,
    /// Documentation, an attribute or an item.
    Item,
    /// The comment at the beginning of a file, and documentation of the file.
    File,
    Other,
}

impl Kind {
    fn of(line: &str) -> Self {
        const ITEMS: [&str; 12] = [
            "///",
            "#[",
            "pub ",
            "pub(",
            "impl",
            "fn ",
            "const ",
            "static ",
            "trait ",
            "struct ",
            "type ",
            "macro_rules! ",
        ];
        let begins = |words: &[&str]| words.iter().any(|word| line.starts_with(word));
        if begins(&["// ", "//!"]) {
            Self::File
        } else if begins(&["use "]) {
            Self::Use
        } else if begins(&["pub use "]) {
            Self::Export
        } else if begins(&["mod ", "pub mod ", "pub(crate) mod "]) && line.ends_with(';') {
            Self::Module
        } else if begins(&ITEMS) || begins(&["rc_"]) && line.contains("!(") {
            Self::Item
        } else {
            Self::Other
        }
    }

    /// Whether an empty line comes first.
    fn begins(self, before: Before) -> bool {
        match before {
            Before::Start | Before::Open | Before::Attached => false,
            Before::File => self != Self::File,
            // Declarations without documentation have no empty lines between them.
            Before::Declaration => self != Self::Other,
            Before::End(kind) => self != Self::Other && self != kind,
        }
    }
}

/// The kind of the previous line.
#[derive(Clone, Copy, PartialEq)]
enum Before {
    Start,
    /// The comment of the file.
    File,
    /// Documentation or an attribute, which belongs to the next line.
    Attached,
    /// The begin of a block, or the middle of something.
    Open,
    /// The end of an item or a statement.
    Declaration,
    /// The end of one of a group.
    End(Kind),
}

impl Before {
    fn of(line: &str, kind: Kind, before: Self) -> Self {
        if kind == Kind::File {
            return Self::File;
        }
        if line.starts_with("///") || line.starts_with("#[") && line.ends_with(']') {
            return Self::Attached;
        }
        if !line.ends_with('}') && !line.ends_with(';') && line != ")]" {
            return Self::Open;
        }
        match kind {
            Kind::Use | Kind::Export | Kind::Module => Self::End(kind),
            Kind::Item if line.starts_with("fn ") && before != Self::Attached => Self::End(kind),
            Kind::Item | Kind::File | Kind::Other => Self::Declaration,
        }
    }
}

/// The brackets of a line.
struct Scan {
    /// Brackets at its begin that close some of earlier lines.
    closed: usize,
    /// Brackets that it leaves open.
    opened: usize,
    /// Where its comment begins.
    code: usize,
    /// The end of a raw string that it begins and does not end.
    raw: Option<String>,
}

impl Scan {
    fn of(line: &str) -> Self {
        let mut scan = Self {
            closed: 0,
            opened: 0,
            code: line.len(),
            raw: None,
        };
        let mut at = 0;
        while at < line.len() {
            let rest = &line[at..];
            if rest.starts_with("//") {
                scan.code = at;
                break;
            }
            match literal(rest) {
                Literal::None => {}
                Literal::Ends(length) => {
                    at += length;
                    continue;
                }
                Literal::Raw(end) => {
                    scan.raw = Some(end);
                    break;
                }
            }
            match rest.as_bytes()[0] {
                b'(' | b'[' | b'{' => scan.opened += 1,
                b')' | b']' | b'}' if scan.opened > 0 => scan.opened -= 1,
                b')' | b']' | b'}' => scan.closed += 1,
                _ => {}
            }
            at += rest.chars().next().map_or(1, char::len_utf8);
        }
        scan
    }
}

/// A text or a character at the begin of some code.
enum Literal {
    None,
    /// It has this length.
    Ends(usize),
    /// A raw string that ends in a later line, with this.
    Raw(String),
}

fn literal(code: &str) -> Literal {
    // Most characters begin none, and are looked at one by one.
    if !code.starts_with(['"', 'b', 'r', '\'']) {
        return Literal::None;
    }
    let quoted = |begin: usize| {
        let mut escaped = false;
        let end = code.bytes().enumerate().skip(begin).find(|(_, byte)| {
            let ends = *byte == b'"' && !escaped;
            escaped = *byte == b'\\' && !escaped;
            ends
        });
        Literal::Ends(end.map_or(code.len(), |(at, _)| at + 1))
    };
    if code.starts_with('"') {
        return quoted(1);
    }
    if code.starts_with("b\"") {
        return quoted(2);
    }
    if let Some(rest) = code.strip_prefix('r') {
        let marks = rest.bytes().take_while(|byte| *byte == b'#').count();
        if rest[marks..].starts_with('"') {
            let end = format!("\"{}", "#".repeat(marks));
            let begin = marks + 2;
            return match code[begin..].find(&end) {
                Some(at) => Literal::Ends(begin + at + end.len()),
                None => Literal::Raw(end),
            };
        }
    }
    if let Some(rest) = code.strip_prefix("'\\") {
        let end = rest.find('\'');
        return Literal::Ends(end.map_or(2, |at| at + 3));
    }
    // `'a'` is a character, `'a` a lifetime.
    let mut chars = code.char_indices().skip(1);
    match (code.starts_with('\''), chars.next(), chars.next()) {
        (true, Some(_), Some((at, '\''))) => Literal::Ends(at + 1),
        _ => Literal::None,
    }
}

/// Removes the commas that a loop of a template leaves before a bracket.
fn tidy(code: &str) -> Cow<'_, str> {
    let closes = |behind: &str| behind.starts_with([']', ')', '}']);
    let mut commas = code.match_indices(", ");
    // Nearly all lines have none.
    if !commas.any(|(at, comma)| closes(code[at + comma.len()..].trim_start())) {
        return Cow::Borrowed(code);
    }
    let mut out = String::with_capacity(code.len());
    let mut at = 0;
    while at < code.len() {
        let rest = &code[at..];
        if let Literal::Ends(length) = literal(rest) {
            out.push_str(&rest[..length]);
            at += length;
            continue;
        }
        if let Some(behind) = rest.strip_prefix(", ") {
            let behind = behind.trim_start();
            if closes(behind) {
                at = code.len() - behind.len();
                out.push_str(if behind.starts_with('}') { " " } else { "" });
                continue;
            }
        }
        let next = rest.chars().next().unwrap_or_default();
        out.push(next);
        at += next.len_utf8();
    }
    Cow::Owned(out)
}

fn indent(depth: usize, out: &mut String) {
    for _ in 0..depth {
        out.push_str("    ");
    }
}

/// Writes a line of code, broken if it is too long.
fn write(code: &str, depth: usize, out: &mut String) {
    let room = LINE.saturating_sub(4 * depth);
    let list = (code.len() > room).then(|| longest_list(code)).flatten();
    let Some((begin, end)) = list else {
        indent(depth, out);
        out.push_str(code);
        return;
    };
    indent(depth, out);
    out.push_str(&code[..begin]);
    let mut line = String::new();
    let flush = |line: &mut String, out: &mut String| {
        out.push('\n');
        write(line, depth + 1, out);
        line.clear();
    };
    let parts = parts(&code[begin..end]);
    // A comma after the only part makes it a tuple.
    let has_comma = parts.len() > 1 || code[begin..end].ends_with(',');
    let comma = if has_comma { "," } else { "" };
    for part in parts {
        if !line.is_empty() && line.len() + part.len() + 2 > room.saturating_sub(4) {
            flush(&mut line, out);
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(part);
        line.push_str(comma);
    }
    if !line.is_empty() {
        flush(&mut line, out);
    }
    out.push('\n');
    indent(depth, out);
    out.push_str(&code[end..]);
}

/// The longest list in brackets that is not inside others: the place after its opening bracket, and
/// that of its closing one.
fn longest_list(code: &str) -> Option<(usize, usize)> {
    let mut open: Vec<usize> = Vec::new();
    let mut best: Option<(usize, usize)> = None;
    let mut at = 0;
    while at < code.len() {
        let rest = &code[at..];
        if let Literal::Ends(length) = literal(rest) {
            at += length;
            continue;
        }
        match rest.as_bytes()[0] {
            b'(' | b'[' | b'{' => open.push(at),
            b')' | b']' | b'}' => {
                let begin = open.pop()? + 1;
                let longer = best.is_none_or(|(b, e)| e - b < at - begin);
                let is_list = !code[..begin].ends_with('{') && !code[..begin].starts_with("#[");
                if open.is_empty() && longer && at > begin + SHORTEST && is_list {
                    best = Some((begin, at));
                }
            }
            _ => {}
        }
        at += rest.chars().next().map_or(1, char::len_utf8);
    }
    best
}

/// The parts of a list.
fn parts(list: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let (mut depth, mut angles, mut begin, mut at) = (0_usize, 0_usize, 0, 0);
    let mut last = ' ';
    let mut in_closure = false;
    while at < list.len() {
        let rest = &list[at..];
        if let Literal::Ends(length) = literal(rest) {
            at += length;
            last = '"';
            continue;
        }
        let next = rest.chars().next().unwrap_or_default();
        match next {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.saturating_sub(1),
            '<' if last.is_alphanumeric() || last == ':' => angles += 1,
            '>' if last != '-' && last != '=' => angles = angles.saturating_sub(1),
            '|' if depth == 0 => in_closure = !in_closure,
            ',' if depth == 0 && angles == 0 && !in_closure => {
                parts.push(list[begin..at].trim());
                begin = at + 1;
            }
            _ => {}
        }
        last = next;
        at += next.len_utf8();
    }
    let rest = list[begin..].trim();
    if !rest.is_empty() {
        parts.push(rest);
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::file;

    fn check(text: &str, expected: &str) {
        assert_eq!(file(text).expect("balanced"), expected);
    }

    #[test]
    fn lines_are_indented_by_their_brackets() {
        check(
            "// A file.\nuse a;\nuse b;\nfn f() {\nlet x = \"}{\"; // }\nif '{' == x {\ng(&[1, 2, ]);\n}\n}\nfn g() {}\n",
            "// A file.\n\nuse a;\nuse b;\n\nfn f() {\n    let x = \"}{\"; // }\n    if '{' == x {\n        g(&[1, 2]);\n    }\n}\n\nfn g() {}\n",
        );
        check("f(A {\nb,\n});\n", "f(A {\n    b,\n});\n");
    }

    #[test]
    fn raw_strings_stay() {
        check(
            "const A: &str = r#\"{\n  [\n\"#;\nconst B: u8 = 1;\n",
            "const A: &str = r#\"{\n  [\n\"#;\nconst B: u8 = 1;\n",
        );
    }

    #[test]
    fn long_lines_break_behind_commas() {
        let long = "a_long_argument: std::collections::BTreeMap<String, u8>";
        check(
            &format!("fn f({long}, {long}, {long}) -> u8;\n"),
            &format!("fn f(\n    {long}, {long},\n    {long},\n) -> u8;\n"),
        );
    }

    #[test]
    fn a_bracket_too_few_is_an_error() {
        assert!(file("fn f() {\n").is_err());
        assert!(file("}\n").is_err());
    }
}
