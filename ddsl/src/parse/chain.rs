//! Chains.

use super::{Rule, field_block, fields_by, values};
use crate::ast::{Chain, ChainField, Late};
use pest::iterators::Pair;
use rc_syntax::{Literal, Name, ParseContext};

const CHAIN: [(&str, Rule); 8] = [
    ("from", Rule::chain_end),
    ("through", Rule::chain_through),
    ("to", Rule::chain_end),
    ("external", Rule::chain_external),
    ("within", Rule::chain_time),
    ("age", Rule::chain_time),
    ("transport", Rule::chain_time),
    ("late", Rule::chain_late),
];

pub(super) fn chain(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Chain {
    let fields = (Rule::chain_field, &CHAIN[..], "a field of a chain");
    field_block(r, pair, fields, |r, part| {
        fields_by(r, part, |r, field, _| chain_field(r, field))
    })
}

fn chain_field(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<ChainField> {
    if pair.as_rule() == Rule::chain_time {
        return values(r, pair).into_iter().next().map(ChainField::Time);
    }
    if pair.as_rule() == Rule::chain_late {
        return chain_late(r, pair).map(ChainField::Late);
    }
    if pair.as_rule() == Rule::chain_external {
        return Some(ChainField::Outside(chain_external(r, pair)));
    }
    let mut points = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::chain_point => points.push(r.texts(part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(ChainField::Points(points))
}

fn chain_external(
    r: &mut ParseContext<'_>,
    pair: Pair<'_, Rule>,
) -> Vec<(Vec<Name>, Vec<Name>, Literal)> {
    let mut all = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::chain_outside => {
                let points = part.clone().into_inner();
                let points = points.filter(|inner| inner.as_rule() == Rule::chain_point);
                let mut points = points.map(|point| r.texts(point)).collect::<Vec<_>>();
                let time = values(r, part).into_iter().next();
                if let (Some(to), Some(from), Some(time)) = (points.pop(), points.pop(), time) {
                    all.push((from, to, time));
                }
            }
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    all
}

fn chain_late(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Late> {
    let (mut action, mut component, mut event) = (None, Vec::new(), None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => action = Some(r.name(&part)),
            Rule::chain_event => {
                let span = r.span(&part);
                let names = r.texts(part);
                let words: Vec<&str> = names.iter().map(|name| name.text.as_str()).collect();
                event = Some(Name::new(words.join("."), span));
            }
            Rule::chain_point => component = r.texts(part),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Late {
        action: action?,
        component,
        event,
    })
}
