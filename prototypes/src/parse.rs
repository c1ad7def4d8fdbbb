//! The parser. Errors become diagnostics, and parsing continues with the next declaration.

use crate::ast::{
    Entry, Field, File, Item, ItemKind, Map, Operand, OperandKind, Representation, Shape, Value,
};
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::ParseContext;

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "common.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// The keywords of declarations, with their rules.
const DECLARATIONS: [(&str, Rule); 12] = [
    ("import", Rule::import),
    ("axes", Rule::axes),
    ("algebraic", Rule::algebraic),
    ("ddr", Rule::ddr),
    ("units", Rule::units),
    ("alias", Rule::alias),
    ("view", Rule::view),
    ("conversion", Rule::conversion),
    ("load", Rule::load),
    ("fproto", Rule::function),
    ("domain", Rule::domain),
    ("dproto", Rule::prototype),
];

/// Parses one `.dproto` text.
pub fn parse(sources: &SourceMap, source: SourceId) -> (File, Diagnostics) {
    let mut reader = ParseContext::new(sources, source);
    let mut file = File::default();
    for pair in reader.file::<Rule>().into_iter().flatten() {
        match pair.as_rule() {
            Rule::trailing => reader.trailing(&pair),
            Rule::skipped_declaration => skipped(&mut reader, &pair),
            _ => file.items.extend(item(&mut reader, pair)),
        }
    }
    (file, reader.finish())
}

/// Reports a declaration that could not be read.
fn skipped(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    let first = r.first_word(pair);
    let mut known = DECLARATIONS.into_iter();
    if let Some((_, rule)) = known.find(|(word, _)| *word == first.text) {
        r.report_skipped(pair, rule);
        return;
    }
    let message = format!("expected a declaration, found `{}`", first.text);
    let diagnostic = Diagnostic::error("unknown-declaration", first.span, message);
    let words = DECLARATIONS.map(|(word, _)| word);
    r.found.push(diagnostic.suggest(&first.text, words));
}

/// A span without the blanks and comments at its end.
fn trimmed(r: &ParseContext<'_>, pair: &Pair<'_, Rule>) -> Span {
    let span = r.span(pair);
    let end = r.trivia.end_of_token_before(span.end).max(span.start);
    Span::new(span.source, span.start, end)
}

fn item(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Item> {
    let (rule, span) = (pair.as_rule(), trimmed(r, &pair));
    let (mut names, mut fields, mut map) = (Vec::new(), Vec::new(), None);
    let (mut shape, mut represented) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name | Rule::symbol => names.push(r.name(&part)),
            Rule::string => names.push(r.string(&part)),
            Rule::field => fields.extend(field(r, part)),
            Rule::map => map = Some(entries(r, part)),
            Rule::scalar | Rule::vector | Rule::matrix => shape = shape_of(r, part),
            Rule::represented => represented = representation(r, part),
            _ => {}
        }
    }
    let mut names = names.into_iter();
    let first = names.next()?;
    let kind = match rule {
        Rule::import => ItemKind::Import(first),
        Rule::axes => ItemKind::Axes(first, names.collect()),
        Rule::algebraic => ItemKind::Algebraic(first, shape?),
        Rule::ddr => ItemKind::Ddr(first, represented?),
        Rule::units => ItemKind::Units(first, names.next()?, names.next()?, map?),
        Rule::alias => ItemKind::Alias(first, names.next()?, map?),
        Rule::view => ItemKind::View(first, names.next()?, names.next()?, map?),
        Rule::conversion => ItemKind::Conversion(first, names.next()?, names.next()?),
        Rule::load => ItemKind::Load(first),
        Rule::function => ItemKind::Function(first, names.next(), fields),
        Rule::domain => ItemKind::Domain(first, fields),
        Rule::prototype => ItemKind::Prototype(first, names.next()?, fields),
        _ => return None,
    };
    Some(Item { span, kind })
}

fn shape_of(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Shape> {
    let rule = pair.as_rule();
    let mut texts = r.texts(pair).into_iter();
    Some(match rule {
        Rule::scalar => Shape::Scalar(texts.collect()),
        Rule::vector => Shape::Vector(texts.next()?),
        _ => Shape::Matrix(texts.next()?, texts.next()?),
    })
}

fn representation(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Representation> {
    let mut texts = r.texts(pair).into_iter();
    let (language, mut model) = (texts.next()?, texts.next()?);
    let words: Vec<&str> = model.text.split_whitespace().collect();
    model.text = words.join(" ");
    Some(Representation { language, model })
}

fn field(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Field> {
    let start = r.span(&pair);
    let (mut name, mut value) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::value => value = value_of(r, part),
            _ => {}
        }
    }
    let (name, value) = (name?, value?);
    let end = match &value {
        // The brace after the type.
        Value::Representation(of) => {
            let after = of.model.span.end;
            let rest = r.text.get(after..start.end).unwrap_or_default();
            after + rest.find('}').map_or(0, |at| at + 1)
        }
        other => other.span().end,
    };
    Some(Field {
        span: Span::new(start.source, start.start, end),
        name,
        value,
    })
}

fn value_of(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Value> {
    let part = pair.into_inner().next()?;
    Some(match part.as_rule() {
        Rule::foreign => Value::Representation(representation(r, part.into_inner().next()?)?),
        Rule::map => Value::Map(entries(r, part)),
        _ => Value::Operand(operand(r, part)?),
    })
}

fn entries(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Map {
    let span = trimmed(r, &pair);
    let parts = pair.into_inner();
    let entries = parts.filter(|part| part.as_rule() == Rule::entry);
    let entries = entries.filter_map(|part| {
        let (mut sides, mut relation, mut minus) = (Vec::new(), None, None);
        for part in part.into_inner() {
            match part.as_rule() {
                Rule::operand => sides.extend(operand(r, part.into_inner().next()?)),
                Rule::relation => relation = Some(r.name(&part)),
                Rule::minus => minus = Some(trimmed(r, &part)),
                _ => {}
            }
        }
        let mut sides = sides.into_iter();
        let left = sides.next()?;
        let right = relation.zip(sides.next());
        let end = right.as_ref().map_or(left.span, |(_, right)| right.span);
        Some(Entry {
            span: left.span.to(end),
            left,
            right,
            minus,
        })
    });
    Map {
        span,
        entries: entries.collect(),
    }
}

fn operand(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Operand> {
    let span = trimmed(r, &pair);
    let kind = match pair.as_rule() {
        Rule::string => OperandKind::Text(r.string(&pair).text),
        Rule::symbol => OperandKind::Symbol(r.name(&pair).text),
        Rule::member => OperandKind::Member(r.texts(pair).into_iter().last()?.text),
        Rule::index => {
            let numbers = r.texts(pair).into_iter().map(|number| number.text);
            OperandKind::Index(numbers.collect())
        }
        _ => return None,
    };
    Some(Operand { span, kind })
}

rc_syntax::language!("declarations such as `dproto NAME :: DOMAIN { … }`", words: [symbol, integer, model], HAS_DURATIONS = false, HAS_ANGLE_BRACKETS = false, {
    file => "a declaration",
    import => "`import`",
    axes => "`axes`",
    algebraic => "`algebraic`",
    ddr => "`ddr`",
    units => "`units`",
    alias => "`alias`",
    view => "`view`",
    conversion => "`conversion`",
    load => "`load`",
    function => "`fproto`",
    domain => "`domain`",
    prototype => "`dproto`",
    scalar => "`Scalar`",
    vector => "`Vector`",
    matrix => "`Matrix`",
    represented => "`LANGUAGE { TYPE }`",
    foreign => "`:: LANGUAGE { TYPE }`",
    field => "`NAME = VALUE`",
    value => "a value",
    map => "`{`",
    entry | operand => "an entry",
    relation => "`=`, `<=` or `=>`",
    minus => "`-`",
    index => "`{ROW, COLUMN}`",
    member => "`member`",
    symbol => "a name or a number",
    integer => "a number without a sign",
    model => "the name of a type",
    arrow => "`->`",
    both_ways => "`<->`",
    equals => "`=`",
});
