//! The clause `world`: the graph that a component shares with others.

use super::Rule;
use crate::ast::{Access, World};
use pest::iterators::Pair;
use rc_diagnostics::Diagnostic;
use rc_syntax::{Literal, Name, ParseContext, home_in_path};

const ACCESS: [&str; 2] = ["writes", "reads"];

pub(super) fn world(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<World> {
    let (mut schema, mut span, mut name, mut access) = (None, None, None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::string => schema = Some(r.string(&part)),
            Rule::kw_any => span = Some(r.span(&part)),
            Rule::name => name = Some(r.name(&part)),
            Rule::world_block => access = Some(block(r, part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    let path = schema.iter();
    r.found
        .extend(path.filter_map(|path| home_in_path(&path.text, path.span)));
    Some(World {
        span: schema.as_ref().map(|path| path.span).or(span)?,
        schema,
        name: name?,
        access,
    })
}

fn block(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<(Name, Vec<Access>)> {
    let mut all = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::access => all.extend(access(r, part)),
            Rule::skipped => {
                let first = r.first_word(&part);
                let mut words = ACCESS.iter();
                if words.any(|word| word.eq_ignore_ascii_case(&first.text)) {
                    r.report_skipped(&part, Rule::access);
                } else {
                    let message = format!("expected `writes` or `reads`, found `{}`", first.text);
                    let error = Diagnostic::error("unknown-clause", first.span, message);
                    r.found.push(error.suggest(&first.text, ACCESS));
                }
            }
            _ => {}
        }
    }
    all
}

fn access(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<(Name, Vec<Access>)> {
    let (mut keyword, mut items) = (None, Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_access => keyword = Some(r.name(&part)),
            Rule::access_item => items.extend(item(r, part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some((keyword?, items))
}

fn item(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Access> {
    let (mut names, mut stream, mut shared) = (Vec::new(), Vec::new(), Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => names.push(r.name(&part)),
            Rule::kw_shared => shared.push(r.name(&part)),
            Rule::stream => {
                let word = r.first_word(&part);
                let mut parts = part.into_inner();
                let time = parts.find(|p| matches!(p.as_rule(), Rule::duration | Rule::number));
                let time = time.map(|time| Literal::parse(time.as_str(), r.span(&time)));
                stream.push((word, time));
            }
            _ => {}
        }
    }
    let mut names = names.into_iter();
    Some(Access {
        kind: names.next()?,
        attribute: names.next(),
        stream,
        shared,
    })
}
