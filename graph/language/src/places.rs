//! Where a schema declares something.

use crate::ast::{Domain, Item, Member};
use crate::parse::parse;
use rc_diagnostics::{SourceId, SourceMap, Span};
use rc_syntax::Name;

/// The place of what a [difference](graph_schema::Difference) is about in the files of a schema, the
/// one that names the others first: of a type, an attribute, a rule or a query, or of an open domain. An
/// inherited attribute is where it is declared. `None` if no file declares it.
pub fn place(sources: &SourceMap, files: &[SourceId], what: &str) -> Option<Span> {
    let domains = files.iter();
    let domains = domains.filter_map(|source| parse(sources, *source).0.domain);
    let domains: Vec<Domain> = domains.collect();
    if what.starts_with("Domain ") {
        return domains.first().map(|domain| domain.name.span);
    }
    let mut items = domains.iter().flat_map(|domain| &domain.items);
    if let Some(query) = what.strip_prefix("query ") {
        return items.find_map(|item| match item {
            Item::Query(own) if own.name.text == query => Some(own.name.span),
            _ => None,
        });
    }
    if what.starts_with("require ") {
        return items.find_map(|item| match item {
            Item::Require(rule) => {
                let (left, right) = (&rule.left.1.text, &rule.right.1.text);
                let start = format!(".{left} {} ", rule.comparison.text);
                let end = format!(".{right} of {}", rule.relation.text);
                (what.contains(&start) && what.ends_with(&end)).then_some(rule.message.span)
            }
            _ => None,
        });
    }
    // A type, and perhaps what it inherits from or is composed by.
    let name = what.split(' ').next()?;
    let (kind, attribute) = match name.split_once('.') {
        Some((kind, attribute)) => (kind, Some(attribute)),
        None => (name, None),
    };
    let of = |kind: &str| items.clone().find_map(|item| Declared::of(item, kind));
    let first = of(kind)?;
    let Some(attribute) = attribute else {
        return Some(first.name.span);
    };
    let above = |own: &Declared<'_>| of(&own.inherits?.text);
    let mut ancestry = std::iter::successors(Some(first), above).take(graph_schema::DEEPEST + 2);
    let own = ancestry.find_map(|own| {
        let mut members = own.members.iter();
        members.find(|member| member.name.text == attribute)
    });
    own.map(|own| own.name.span)
}

/// A type as a file declares it.
#[derive(Clone, Copy)]
struct Declared<'a> {
    name: &'a Name,
    members: &'a [Member],
    /// The type whose attributes it has, too.
    inherits: Option<&'a Name>,
}

impl<'a> Declared<'a> {
    fn of(item: &'a Item, kind: &str) -> Option<Self> {
        let declared = match item {
            Item::Entity(own) => Self {
                name: &own.name,
                members: &own.members,
                inherits: own.parent.as_ref(),
            },
            Item::Relation(own) => Self {
                name: &own.name,
                members: &own.members,
                inherits: own.promotes.first(),
            },
            Item::Require(_) | Item::Query(_) => return None,
        };
        (declared.name.text == kind).then_some(declared)
    }
}
