//! Diagnostics for text that the grammar does not match.

use crate::Language;
use crate::scan::{SegmentKind, segments};
use pest::Parser;
use pest::error::{ErrorVariant, InputLocation};
use rc_diagnostics::{Diagnostic, SourceId, Span};

/// Maximum nesting of brackets. The parser recurses for each level, so this is checked before it
/// runs.
const MAX_NESTING: usize = 100;

/// Explains why `rule` does not match `piece`, which starts at byte `offset` of `text`. Parses the
/// piece again to find the location.
pub(crate) fn syntax_error<R: Language>(
    rule: R,
    piece: &str,
    offset: usize,
    text: &str,
    source: SourceId,
) -> Option<Diagnostic> {
    let error = R::Grammar::parse(rule, piece).err()?;
    let at = offset
        + match error.location {
            InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
        };
    let found = text[at..]
        .split(char::is_whitespace)
        .next()
        .unwrap_or_default();
    let length = found
        .find(|c: char| !(c.is_alphanumeric() || c == '_'))
        .unwrap_or(found.len())
        .max(found.chars().next().map_or(0, char::len_utf8));
    let rules: &[R] = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => positives,
        ErrorVariant::CustomError { .. } => &[],
    };
    let described = rules.iter().filter_map(|rule| rule.description());
    let mut expected: Vec<String> = described.map(str::to_owned).collect();
    let mut keywords: Vec<String> = rules.iter().filter_map(keyword).collect();
    if expected.is_empty() {
        expected.extend(keywords.iter().map(|word| format!("`{word}`")));
    }
    expected.sort_unstable();
    expected.dedup();
    if rules.contains(&R::FILE) {
        keywords.push("import".to_owned());
    }
    let what = if length == 0 {
        "the end of the file".to_owned()
    } else {
        let found = &found[..length];
        // `а` of another alphabet looks like `a`.
        match found.chars().find(|c| !c.is_ascii() && c.is_alphabetic()) {
            Some(c) => format!("`{found}` (with U+{:04X})", u32::from(c)),
            None => format!("`{found}`"),
        }
    };
    let message = match expected.as_slice() {
        [] => format!("unexpected {what}"),
        [one] => format!("expected {one}, found {what}"),
        [rest @ .., last] => format!("expected {} or {last}, found {what}", rest.join(", ")),
    };
    let span = Span::new(source, at, at + length);
    let diagnostic = Diagnostic::error("syntax-error", span, message);
    let words = expected
        .iter()
        .flat_map(|text| text.split('`').skip(1).step_by(2));
    let words = words.chain(keywords.iter().map(String::as_str));
    let near = rc_diagnostics::nearest(
        &found[..length],
        words.filter(|word| is_word(word) && *word != &found[..length]),
    );
    Some(if let Some(help) = help_for(&text[at..]) {
        diagnostic.help(help)
    } else if is_inside_name(text, at) {
        diagnostic.help("a name consists of letters, digits and `_`")
    } else if piece.trim_start().starts_with("unsigned ") {
        diagnostic.help("write `uint16`, `uint32` or `uint64` instead of an `unsigned` type")
    } else {
        diagnostic.did_you_mean(&found[..length], near)
    })
}

/// The word that a rule such as `kw_import` matches. One with other words has a description.
fn keyword<R: Language>(rule: &R) -> Option<String> {
    let name = format!("{rule:?}");
    let word = name
        .strip_prefix("kw_")
        .filter(|_| rule.description().is_none());
    word.map(str::to_owned)
}

fn is_word(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Whether the character at `at` joins two words, as in `my-robot` and `arm-2`.
fn is_inside_name(text: &str, at: usize) -> bool {
    let mut rest = text[at..].chars();
    let before = text[..at]
        .rsplit(|c: char| !(c.is_alphanumeric() || c == '_'))
        .next();
    rest.next() == Some('-')
        && rest.next().is_some_and(char::is_alphanumeric)
        && before.is_some_and(|word| word.starts_with(|c: char| c.is_alphabetic() || c == '_'))
}

/// What to write instead of text of other languages, which begins with a character that no language
/// here has in this place.
pub(crate) fn help_for(found: &str) -> Option<&'static str> {
    let directive = found.strip_prefix('#').map(str::trim_start);
    let guards = ["if", "define", "endif", "pragma", "include"];
    match directive {
        Some(word) if guards.iter().any(|guard| word.starts_with(guard)) => {
            Some("delete the include guard: each file is read only once")
        }
        Some(_) => Some("a comment begins with `//`"),
        None if found.starts_with('\'') => Some("a string has double quotes: `\"text\"`"),
        None => None,
    }
}

/// Reports brackets that are nested deeper than [`MAX_NESTING`].
pub(crate) fn check_nesting(
    text: &str,
    source: SourceId,
    has_angle_brackets: bool,
) -> Option<Diagnostic> {
    let (mut depth, mut angle_brackets) = (0_usize, 0_usize);
    let code = segments(text).filter(|(kind, ..)| *kind == SegmentKind::Code);
    for at in code.flat_map(|(_, start, stop)| start..stop) {
        match text.as_bytes()[at] {
            b'{' | b'(' | b'[' => depth += 1,
            b'}' | b')' | b']' => depth = depth.saturating_sub(1),
            // In the rules of a .pdsl, `<` and `>` are operators, which nothing closes.
            b'<' if has_angle_brackets => angle_brackets += 1,
            b'>' => angle_brackets = angle_brackets.saturating_sub(1),
            b';' => angle_brackets = 0,
            _ => {}
        }
        if depth + angle_brackets > MAX_NESTING {
            let message = format!("brackets are nested more than {MAX_NESTING} levels deep");
            let span = Span::new(source, at, at + 1);
            return Some(Diagnostic::error("nested-too-deep", span, message));
        }
    }
    None
}
