//! Resolves attributes and ports.

use crate::ast::{Flag, FlagKind, Member, Type};
use crate::blocks::Blocks;
use graph_schema::{Attribute, Kind, Port};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_syntax::{Literal, unknown_unit};
use std::sync::Arc;
use std::time::Duration;

/// The words for types.
pub const TYPES: [&str; 8] = [
    "bool", "int", "long", "float", "double", "string", "bytes", "pose",
];

/// Whether a name is a type of attributes.
pub(crate) fn is_reserved(name: &str) -> bool {
    TYPES.contains(&name) || ["dproto", "topic"].contains(&name)
}

/// The type of an attribute. `None` if the member is not an attribute.
pub(crate) fn kind(member: &Member, blocks: &Blocks<'_>, found: &mut Diagnostics) -> Option<Kind> {
    let (name, array) = match &member.kind {
        Type::Block(name) => return Some(blocks.block(name, found)),
        Type::Topic(_, kind) => return Some(Kind::Topic(kind.as_ref().map(|k| k.text.clone()))),
        Type::Choice(words) => {
            let words = words.iter().map(|word| word.text.clone());
            return Some(Kind::Enum(words.collect()));
        }
        Type::Named(name, array) => (name, array),
    };
    let single = match name.text.as_str() {
        "bool" => Kind::Bool,
        "int" | "long" => Kind::Int,
        "float" | "double" => Kind::Float,
        "string" => Kind::Text,
        "bytes" => Kind::Bytes,
        "pose" => Kind::Floats(Some(6)),
        _ => return None,
    };
    let Some(count) = array else {
        return Some(single);
    };
    let count = count.as_ref().map(|literal| {
        let number = literal
            .as_i64()
            .and_then(|number| usize::try_from(number).ok());
        number
            .filter(|n| (1..=8192).contains(n))
            .unwrap_or_else(|| {
                let message = format!(
                    "expected a length from 1 to 8192, found {}",
                    literal.described()
                );
                found.push(Diagnostic::error("bad-length", literal.span, message));
                1
            })
    });
    Some(match single {
        Kind::Int => Kind::Ints(count),
        Kind::Float => Kind::Floats(count),
        Kind::Text if count.is_none() => Kind::Texts,
        other => {
            let message = format!("there are no arrays of `{}` like this one", name.text);
            let diagnostic = Diagnostic::error("wrong-type", name.span, message);
            found.push(
                diagnostic.help("use `int[]`, `int[N]`, `float[]`, `float[N]` or `string[]`"),
            );
            other
        }
    })
}

/// Reports each flag that is there twice.
fn check_repeated(member: &Member, found: &mut Diagnostics) {
    let mut seen: Vec<&Flag> = Vec::new();
    for flag in &member.flags {
        let same = |other: &&&Flag| {
            std::mem::discriminant(&other.kind) == std::mem::discriminant(&flag.kind)
        };
        if let Some(first) = seen.iter().find(same) {
            let message = format!("`{}` has this property already", member.name.text);
            let diagnostic = Diagnostic::error("repeated-flag", flag.span, message);
            found.push(diagnostic.label(first.span, "first given here"));
        }
        seen.push(flag);
    }
}

fn bound(literal: Option<&Literal>, kind: &Kind, missing: f64, found: &mut Diagnostics) -> f64 {
    let Some(literal) = literal else {
        return missing;
    };
    let is_whole = matches!(kind, Kind::Int | Kind::Ints(_));
    let number = literal.as_f64().filter(|number| number.is_finite());
    if let Some(number) = number.filter(|_| !is_whole || literal.as_i64().is_some()) {
        return number;
    }
    let expected = if is_whole {
        "an integer of 64 bits"
    } else {
        "a number"
    };
    let message = format!("expected {expected}, found {}", literal.described());
    found.push(Diagnostic::error("bad-range", literal.span, message));
    missing
}

/// An attribute of a type.
pub(crate) fn attribute(member: &Member, kind: Kind, found: &mut Diagnostics) -> Attribute {
    check_repeated(member, found);
    let is_number = matches!(
        kind,
        Kind::Int | Kind::Float | Kind::Ints(_) | Kind::Floats(_)
    );
    let may_be_key = matches!(kind, Kind::Int | Kind::Text | Kind::Bool | Kind::Enum(_));
    let consistent = member.consistent_with();
    let mut kind = kind;
    if let (Kind::Block(block), Some(of)) = (&mut kind, consistent) {
        Arc::make_mut(block).consistent_with = Some(of.text.clone());
    }
    let mut attribute = Attribute {
        name: member.name.text.clone(),
        kind,
        unit: None,
        range: None,
        // It is there as soon as the other one is.
        optional: consistent.is_some(),
        key: false,
        history: None,
        doc: member.doc.clone(),
    };
    for flag in &member.flags {
        let kind = &attribute.kind;
        let mut wrong = |what: &str| {
            let message = format!(
                "`{}` of type {} cannot have {what}",
                member.name.text,
                kind.text()
            );
            found.push(Diagnostic::error("wrong-type", flag.span, message));
        };
        match &flag.kind {
            FlagKind::Unit(_) | FlagKind::Range(..) if matches!(kind, Kind::Block(_)) => {
                let message = format!("`{}` has what its prototype says", member.name.text);
                let diagnostic = Diagnostic::error("wrong-type", flag.span, message);
                found.push(diagnostic.help("change the `.dproto`"));
            }
            FlagKind::Unit(_) if !is_number => wrong("a unit"),
            FlagKind::Range(..) if !is_number => wrong("a range"),
            FlagKind::Key if !may_be_key => wrong("the property `key`"),
            FlagKind::Consistency(_) if !matches!(kind, Kind::Block(_)) => {
                wrong("the property `consistency`");
            }
            FlagKind::Optional | FlagKind::History(_) if consistent.is_some() => {
                let message = format!(
                    "`{}` has the properties of another attribute",
                    member.name.text
                );
                let diagnostic = Diagnostic::error("wrong-type", flag.span, message);
                let of = consistent.map_or("", |of| of.text.as_str());
                found.push(diagnostic.help(format!("give `{of}` this property")));
            }
            // Resolved when all attributes of the type are known.
            FlagKind::Consistency(_) => {}
            FlagKind::Unit(unit) => {
                found.extend(unknown_unit(&unit.text, unit.span));
                attribute.unit = Some(unit.text.clone());
            }
            FlagKind::Range(low, high) => {
                let low = bound(low.as_ref(), kind, f64::NEG_INFINITY, found);
                let high = bound(high.as_ref(), kind, f64::INFINITY, found);
                if low > high {
                    let message = format!("the range {low}:{high} is empty");
                    found.push(Diagnostic::error("bad-range", flag.span, message));
                } else {
                    attribute.range = Some((low, high));
                }
            }
            FlagKind::Key => attribute.key = true,
            FlagKind::Optional => attribute.optional = true,
            FlagKind::History(duration) => {
                attribute.history = duration.as_nanoseconds().map(Duration::from_nanos);
                if attribute.history.is_none_or(|time| time.is_zero()) {
                    let message = "expected a time above 0 such as `2s`";
                    found.push(Diagnostic::error("bad-time", duration.span, message));
                }
            }
        }
    }
    attribute
}

/// Reports `key` at an attribute of a relation: keys find nodes.
pub(crate) fn check_key_of_relation(member: &Member, found: &mut Diagnostics) {
    let keys = member.flags.iter().filter(|f| f.kind == FlagKind::Key);
    for flag in keys {
        let message = format!(
            "`{}` belongs to a relation, and only entities have keys",
            member.name.text
        );
        let diagnostic = Diagnostic::error("key-of-relation", flag.span, message);
        found.push(diagnostic.help("remove `key`, or make an entity of the relation"));
    }
}

/// A port of a relation. Its range says how many edges a node has there.
pub(crate) fn port(member: &Member, entity: &str, found: &mut Diagnostics) -> Port {
    check_repeated(member, found);
    let mut port = Port {
        name: member.name.text.clone(),
        entity: entity.to_owned(),
        min: 0,
        max: None,
    };
    for flag in &member.flags {
        let FlagKind::Range(low, high) = &flag.kind else {
            let message = format!("port `{}` can have a range only", member.name.text);
            found.push(Diagnostic::error("wrong-type", flag.span, message));
            continue;
        };
        let mut count = |literal: &Option<Literal>| {
            let literal = literal.as_ref()?;
            let number = literal.as_i64().and_then(|n| u32::try_from(n).ok());
            if number.is_none() {
                let message = format!("expected a count, found {}", literal.described());
                found.push(Diagnostic::error("bad-range", literal.span, message));
            }
            number
        };
        port.min = count(low).unwrap_or_default();
        port.max = count(high);
        if port.max.is_some_and(|most| most < port.min) {
            let message = "the range is empty";
            found.push(Diagnostic::error("bad-range", flag.span, message));
        }
    }
    port
}
