//! Parses text into a syntax tree. Parsing never fails: unreadable parts become diagnostics.

use crate::ast::{
    Array, DefaultValue, File, Flag, FlagKind, Group, Item, Length, List, Param, Params, Range,
};
use crate::condition;
use pest::iterators::Pair;
use rc_configuration::model::Type;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Literal, Name, ParseContext};

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "common.pest"]
#[grammar = "condition.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// Parses one `.pdsl` text.
pub fn parse(sources: &SourceMap, source: SourceId) -> (File, Diagnostics) {
    let mut reader = ParseContext::new(sources, source);
    let file = file(&mut reader);
    let mut found = Diagnostics::new();
    for mut error in reader.finish() {
        if error.code == "unknown-time-unit" {
            let (before, from) = statement_around(sources.text(source), error.span.start);
            error.help = unit_of_number(before, from).or(error.help);
        }
        found.push(error);
    }
    (file, found)
}

/// How many bytes around an error are read, so that many errors in a long text take no longer than it.
const AROUND: usize = 2000;

/// The declaration around `at`, before it and from it on. Of a long one, the parts next to it.
fn statement_around(text: &str, at: usize) -> (&str, &str) {
    let ends = |byte: u8| matches!(byte, b';' | b'{' | b'}');
    let before = &text[text.ceil_char_boundary(at.saturating_sub(AROUND))..at];
    let from = &text[at..text.floor_char_boundary(at + AROUND)];
    let start = before.bytes().rposition(ends).map_or(0, |end| end + 1);
    let end = from.bytes().position(ends).unwrap_or(from.len());
    (&before[start..], &from[..end])
}

/// How a number gets the unit that is written after it: only durations have units in their values.
fn unit_of_number(before: &str, from: &str) -> Option<String> {
    let code = before
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let mut words = code.flat_map(str::split_whitespace);
    let ty = words.nth(1)?.split('[').next()?;
    let is_number = ["int", "long", "float", "double"].contains(&ty);
    let unit = from.split([';', ' ', '\n']).next()?.trim();
    let is_unit = unit.starts_with(char::is_alphabetic) && words.next().is_some();
    if !is_number || !is_unit {
        return None;
    }
    if let Some(flag) = rc_diagnostics::nearest(unit, FLAGS) {
        return Some(format!("did you mean `{flag}`?"));
    }
    let is_flags = unit.chars().all(|c| matches!(c, 'T' | 'F'));
    (!is_flags).then(|| format!("a unit follows the default and the range: `unit \"{unit}\"`"))
}

/// Flags that are words; `T` and `F` are like units.
const FLAGS: [&str; 5] = ["unit", "restart", "secret", "reads", "element"];

/// What to write instead of a declaration as other languages have it.
fn habit(before: &str, from: &str) -> Option<String> {
    let before = before.trim();
    let (name, ty) = before
        .split_once(char::is_whitespace)
        .unwrap_or((before, ""));
    if let Some((ty, length)) = before.strip_suffix(']').and_then(|ty| ty.rsplit_once('['))
        && ty.ends_with(char::is_alphabetic)
        && length.parse::<u32>().is_ok()
    {
        return Some(format!(
            "the length of an array is a range: `{ty}[{length}:{length}]`"
        ));
    }
    let (name, ty, order) = match ty.trim() {
        // As in C.
        second if !second.is_empty() && Type::from_word(name).is_some() => (
            second,
            name,
            "the name comes first, then the type and the default",
        ),
        "" => (name, "TYPE", "the type and the default follow the name"),
        ty => (name, ty, "the default follows the type"),
    };
    match from.chars().next()? {
        ':' | '=' if name.is_empty() => None,
        ':' => Some(format!(
            "a declaration has no `:`, as in `{name} float 0.5;`"
        )),
        '=' => Some(format!("{order}: `{name} {ty} VALUE;`")),
        '[' => Some("a range has no brackets, as in `0:1`".to_owned()),
        '0'..='9' if from.contains("..") => Some("a range has a colon, as in `0:1`".to_owned()),
        _ => unit_of_number(before, from).or_else(|| {
            let end = from.find(|c: char| !c.is_alphanumeric() && c != '_');
            let near = rc_diagnostics::nearest(&from[..end.unwrap_or(from.len())], FLAGS);
            near.map(|flag| format!("did you mean `{flag}`?"))
        }),
    }
}

fn file(r: &mut ParseContext<'_>) -> File {
    let mut file = File::default();
    for pair in r.file::<Rule>().into_iter().flatten() {
        match pair.as_rule() {
            Rule::import => file.imports.extend(r.texts(pair)),
            Rule::params => file.params = Some(params(r, pair)),
            Rule::trailing => r.trailing(&pair),
            _ => {}
        }
    }
    file
}

fn literals(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<Literal> {
    pair.into_inner().map(|p| r.literal(&p)).collect()
}

fn bounds(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<Literal> {
    pair.into_inner()
        .filter(|p| p.as_rule() == Rule::number)
        .map(|p| r.literal(&p))
        .collect()
}

/// Reports a declaration with a syntax error.
fn skipped(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) -> Option<Item> {
    let first = r.first_word(pair);
    let likely = match first.text.to_lowercase().as_str() {
        "group" => Rule::group,
        "list" => Rule::list,
        "require" => Rule::require,
        _ => Rule::param,
    };
    r.report_skipped_with(pair, likely, |before, from| {
        (likely == Rule::param)
            .then(|| habit(before, from))
            .flatten()
    });
    let is_name = |text: &str| text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    let named = if likely == Rule::param {
        first.clone()
    } else {
        next_word(r, &first)?
    };
    let ty = next_word(r, &named).filter(|word| likely == Rule::param && is_name(&word.text));
    is_name(&named.text).then_some(Item::Broken(named, ty))
}

/// The word after `word` and white space.
fn next_word(r: &ParseContext<'_>, word: &Name) -> Option<Name> {
    let rest = &r.text[word.span.end..];
    let start = word.span.end + (rest.len() - rest.trim_start().len());
    let rest = &r.text[start..];
    let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
    let end = start + end.unwrap_or(rest.len());
    (end > start).then(|| Name::new(&r.text[start..end], Span::new(r.source, start, end)))
}

fn params(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Params {
    let block = block(r, pair);
    Params {
        name: block.name,
        doc: block.doc,
        items: block.items,
    }
}

/// Parses `ComponentParams`, `group` or `list`.
fn block(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Block {
    let doc = r.doc(&pair);
    let mut name = Name::new("", r.span(&pair));
    let (mut items, mut bounds) = (Vec::new(), Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = r.name(&part),
            Rule::number => bounds.push(r.literal(&part)),
            Rule::param => {
                items.extend(param(r, part).map(|param| Item::Param(Box::new(param))));
            }
            Rule::require => items.extend(condition::require(r, part).map(Item::Rule)),
            Rule::skipped => items.extend(skipped(r, &part)),
            Rule::group => {
                let Block {
                    name,
                    doc,
                    items: inner,
                    ..
                } = block(r, part);
                items.push(Item::Group(Group {
                    name,
                    doc,
                    items: inner,
                }));
            }
            Rule::list => {
                let Block {
                    name,
                    doc,
                    items: inner,
                    length,
                } = block(r, part);
                items.push(Item::List(List {
                    name,
                    doc,
                    length,
                    items: inner,
                }));
            }
            _ => {}
        }
    }
    Block {
        name,
        doc,
        items,
        length: length(bounds),
    }
}

fn param(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Param> {
    let doc = r.doc(&pair);
    let (mut name, mut ty, mut array, mut default) = (None, None, None, None);
    let (mut range, mut choices, mut flags) = (None, Vec::new(), Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::type_ref => {
                for piece in part.into_inner() {
                    match piece.as_rule() {
                        Rule::name => ty = Some(r.name(&piece)),
                        _ => {
                            array = Some(Array {
                                span: r.span(&piece),
                                length: length(bounds(r, piece)),
                            });
                        }
                    }
                }
            }
            Rule::default => default = part.into_inner().next().map(|p| default_value(r, p)),
            Rule::range => range = Some(limits(r, part)),
            Rule::choice => {
                let span = r.span(&part);
                choices = literals(r, part);
                if choices.is_empty() {
                    let message = "expected at least one choice";
                    r.found.push(Diagnostic::error("bad-choice", span, message));
                }
            }
            Rule::flag => flags.extend(flag(r, part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Param {
        name: name?,
        doc,
        ty: ty?,
        array,
        default,
        range,
        choices,
        flags,
    })
}

fn default_value(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> DefaultValue {
    let span = r.span(&pair);
    match pair.as_rule() {
        Rule::values => DefaultValue::Many(literals(r, pair), span),
        _ => DefaultValue::One(r.literal(&pair)),
    }
}

fn limits(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Range {
    let mut range = Range {
        min: None,
        max: None,
        span: r.span(&pair),
    };
    for part in pair.into_inner() {
        let literal = Some(r.literal(&part));
        if part.as_rule() == Rule::low {
            range.min = literal;
        } else {
            range.max = literal;
        }
    }
    range
}

fn flag(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Flag> {
    let span = r.span(&pair);
    let mut parts = pair.into_inner();
    let kind = match parts.next()?.as_rule() {
        Rule::kw_editable => FlagKind::Editable,
        Rule::kw_fixed => FlagKind::Fixed,
        Rule::kw_unit => FlagKind::Unit(r.string(&parts.next()?).text),
        Rule::kw_restart => FlagKind::Restart,
        Rule::kw_reads => FlagKind::Reads(r.string(&parts.next()?)),
        Rule::kw_element => {
            let kind = r.string(&parts.next()?);
            // The word `of` is between them.
            FlagKind::Element(kind, r.name(&parts.nth(1)?))
        }
        _ => FlagKind::Secret,
    };
    Some(Flag { kind, span })
}

struct Block {
    name: Name,
    doc: Vec<String>,
    items: Vec<Item>,
    length: Option<Length>,
}

fn length(bounds: Vec<Literal>) -> Option<Length> {
    let mut bounds = bounds.into_iter();
    Some(Length {
        min: bounds.next()?,
        max: bounds.next()?,
    })
}

rc_syntax::language!("`ComponentParams NAME { … };`", words: [], {
    file | params | kw_params => "`ComponentParams`",
    high => "a number",
    operand => "a value",
    type_ref => "a type",
    default | values => "a default",
    range => "a range",
    choice => "choices",
    flag => "a flag",
    end_of_item | next_item => "`;`",
    condition => "a condition",
    operator => "an operator",
    close_bracket => "`)`",
    path | param => "a parameter",
});
crate::condition_rules!();
