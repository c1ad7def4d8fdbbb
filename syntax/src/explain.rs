//! What pest could not read, in words.

use pest::error::{ErrorVariant, InputLocation};
use pest::{Parser, RuleType};
use rc_diagnostics::{Diagnostic, SourceId, Span};

/// Deeper nesting than this is refused before parsing, since the parser calls itself for each level.
const DEEPEST: usize = 100;

/// Reads `text`, which stands at byte `offset` of `source`, once more as `rule`, and says where and why it
/// cannot be. `word` names each rule as people know it; a rule without a word is not mentioned.
pub fn explain<P: Parser<R>, R: RuleType>(
    rule: R,
    text: &str,
    source: SourceId,
    offset: usize,
    word: impl Fn(R) -> Option<&'static str>,
) -> Option<Diagnostic> {
    let error = P::parse(rule, text).err()?;
    let at = match error.location {
        InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
    };
    let found = text[at..]
        .split(|c: char| c.is_whitespace())
        .next()
        .unwrap_or_default();
    let length = found
        .find(|c: char| !(c.is_alphanumeric() || c == '_'))
        .unwrap_or(found.len())
        .max(found.chars().next().map_or(0, char::len_utf8));
    let mut expected: Vec<&'static str> = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => {
            positives.iter().filter_map(|r| word(*r)).collect()
        }
        ErrorVariant::CustomError { .. } => Vec::new(),
    };
    expected.sort_unstable();
    expected.dedup();
    let what = if length == 0 {
        "the end of the file".to_owned()
    } else {
        format!("`{}`", &found[..length])
    };
    let message = match expected.as_slice() {
        [] => format!("{what} is not possible here"),
        [one] => format!("expected {one}, found {what}"),
        [rest @ .., last] => format!("expected {} or {last}, found {what}", rest.join(", ")),
    };
    let span = Span::new(source, offset + at, offset + at + length);
    Some(Diagnostic::error("syntax-error", span, message))
}

/// An error where brackets nest deeper than any description of a robot does.
pub fn nesting(text: &str, source: SourceId) -> Option<Diagnostic> {
    let mut depth = 0_usize;
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'{' | b'<' | b'(' | b'[' => depth += 1,
            b'}' | b'>' | b')' | b']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        if depth > DEEPEST {
            let message = format!("brackets nest deeper than {DEEPEST} levels here");
            return Some(Diagnostic::error(
                "nested-too-deep",
                Span::new(source, at, at + 1),
                message,
            ));
        }
    }
    None
}
