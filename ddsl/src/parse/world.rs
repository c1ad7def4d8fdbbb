//! Worlds.

use super::{Rule, field_block, fields_by};
use crate::ast::{World, WorldField};
use pest::iterators::Pair;
use rc_syntax::{Literal, ParseContext, home_in_path};

const WORLD: [(&str, Rule); 3] = [
    ("schema", Rule::world_file),
    ("start", Rule::world_file),
    ("keep", Rule::world_keep),
];

pub(super) fn world(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> World {
    let fields = (Rule::world_field, &WORLD[..], "a field of a world");
    field_block(r, pair, fields, |r, part| {
        fields_by(r, part, |r, field, _| world_field(r, field))
    })
}

fn world_field(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<WorldField> {
    let (mut file, mut time) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::string => file = Some(r.string(&part)),
            Rule::time => time = Some(Literal::parse(part.as_str(), r.span(&part))),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    let file = file?;
    r.found.extend(home_in_path(&file.text, file.span));
    Some(WorldField { file, time })
}
