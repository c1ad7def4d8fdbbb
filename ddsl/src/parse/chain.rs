//! Chains.

use super::{Rule, field_block, fields_by, values};
use crate::ast::{Chain, ChainField, Late};
use pest::iterators::Pair;
use rc_syntax::{Name, ParseContext};

const CHAIN: [(&str, Rule); 7] = [
    ("from", Rule::chain_end),
    ("through", Rule::chain_through),
    ("to", Rule::chain_end),
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
