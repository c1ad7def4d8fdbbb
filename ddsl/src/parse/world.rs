//! Worlds.

use super::{Rule, report_skipped};
use crate::ast::{World, WorldField};
use pest::iterators::Pair;
use rc_syntax::{Literal, Name, ParseContext, home_in_path};

const WORLD: [(&str, Rule); 3] = [
    ("schema", Rule::world_file),
    ("start", Rule::world_file),
    ("keep", Rule::world_keep),
];

pub(super) fn world(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> World {
    let mut world = World {
        name: Name::new("", r.span(&pair)),
        doc: r.doc(&pair),
        fields: Vec::new(),
        incomplete: false,
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => world.name = r.name(&part),
            Rule::world_field => {
                let word = r.first_word(&part);
                let fields = part.into_inner().filter_map(|field| world_field(r, field));
                let fields = fields.map(|field| (word.clone(), field));
                world.fields.extend(fields);
            }
            Rule::skipped => {
                world.incomplete = true;
                report_skipped(r, &part, &WORLD, "a field of a world");
            }
            _ => {}
        }
    }
    world
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
