//! The parser. Errors become diagnostics, and parsing continues after the skipped input.

use crate::ast::{
    Domain, Entity, File, Flag, FlagKind, Item, Member, Query, Relation, Require, Tree, Type,
};
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap};
use rc_syntax::{Name, ParseContext};

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "common.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// The keywords of declarations.
const KEYWORDS: [&str; 4] = ["entity", "relation", "require", "query"];

/// Parses one `.gdsl` text.
pub fn parse(sources: &SourceMap, source: SourceId) -> (File, Diagnostics) {
    let mut reader = ParseContext::new(sources, source);
    let file = file(&mut reader);
    (file, reader.finish())
}

fn file(r: &mut ParseContext<'_>) -> File {
    let mut file = File::default();
    for pair in r.file::<Rule>().into_iter().flatten() {
        match pair.as_rule() {
            Rule::import => {
                let texts = r.texts(pair);
                file.imports.extend(texts.into_iter().last());
            }
            Rule::domain => file.domain = Some(domain(r, pair)),
            Rule::trailing => r.trailing(&pair),
            _ => {}
        }
    }
    file
}

fn domain(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Domain {
    let mut domain = Domain {
        name: Name::new("", r.span(&pair)),
        open: false,
        items: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => domain.name = r.name(&part),
            Rule::kw_open => domain.open = true,
            Rule::entity => domain.items.push(Item::Entity(entity(r, part))),
            Rule::relation => domain.items.push(Item::Relation(relation(r, part))),
            Rule::require => domain.items.extend(require(r, part).map(Item::Require)),
            Rule::query => domain.items.extend(query(r, part).map(Item::Query)),
            Rule::skipped => skipped(r, &part),
            _ => {}
        }
    }
    domain
}

/// Reports a declaration that could not be read.
fn skipped(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>) {
    let first = r.first_word(pair);
    let rule = match first.text.to_lowercase().as_str() {
        "entity" => Rule::entity,
        "relation" => Rule::relation,
        "require" => Rule::require,
        "query" => Rule::query,
        _ => {
            let message = format!("expected a declaration of a domain, found `{}`", first.text);
            let diagnostic = Diagnostic::error("unknown-declaration", first.span, message);
            r.found.push(diagnostic.suggest(&first.text, KEYWORDS));
            return;
        }
    };
    r.report_skipped(pair, rule);
}

fn entity(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Entity {
    let mut entity = Entity {
        name: Name::new("", r.span(&pair)),
        parent: None,
        doc: r.doc(&pair),
        members: Vec::new(),
        parts: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => entity.name = r.name(&part),
            Rule::parent => entity.parent = r.texts(part).into_iter().last(),
            Rule::member => entity.members.extend(member(r, part)),
            Rule::composed_by => entity.parts.extend(names(r, part)),
            Rule::skipped => r.report_skipped(&part, Rule::member),
            _ => {}
        }
    }
    entity
}

fn relation(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Relation {
    let mut relation = Relation {
        name: Name::new("", r.span(&pair)),
        doc: r.doc(&pair),
        members: Vec::new(),
        trees: Vec::new(),
        promotes: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => relation.name = r.name(&part),
            Rule::member => relation.members.extend(member(r, part)),
            Rule::tree => relation.trees.push(tree(r, part)),
            Rule::promotes => relation.promotes.extend(names(r, part)),
            Rule::skipped => r.report_skipped(&part, Rule::member),
            _ => {}
        }
    }
    relation
}

fn tree(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Tree {
    let mut tree = Tree {
        span: r.span(&pair),
        of: None,
        interpolated: false,
        pose: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::tree_of => tree.of = r.texts(part).into_iter().last(),
            Rule::kw_interpolated => tree.interpolated = true,
            Rule::pose => tree.pose = r.texts(part),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    tree
}

/// The names of a clause that ends with a semicolon.
fn names(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Vec<Name> {
    let mut names = Vec::new();
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => names.push(r.name(&part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    names
}

fn member(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Member> {
    let (doc, mut name, mut kind, mut flags) = (r.doc(&pair), None, None, Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::choice => kind = Some(Type::Choice(r.texts(part))),
            Rule::block => kind = r.texts(part).into_iter().last().map(Type::Block),
            Rule::topic => kind = topic(r, part),
            Rule::type_ref => kind = named(r, part),
            Rule::flag => flags.extend(flag(r, part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Member {
        name: name?,
        doc,
        kind: kind?,
        flags,
    })
}

fn named(r: &ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Type> {
    let (mut name, mut array) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::array => {
                let mut inside = part.into_inner();
                let number = inside.find(|p| p.as_rule() == Rule::number);
                array = Some(number.map(|number| r.literal(&number)));
            }
            _ => {}
        }
    }
    Some(Type::Named(name?, array))
}

fn topic(r: &ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Type> {
    let (mut word, mut kind) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_topic => word = Some(r.name(&part)),
            Rule::string => kind = Some(r.string(&part)),
            _ => {}
        }
    }
    Some(Type::Topic(word?, kind))
}

fn flag(r: &ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Flag> {
    let span = r.span(&pair);
    let mut kind = None;
    for part in pair.into_inner() {
        kind = match part.as_rule() {
            Rule::string => Some(FlagKind::Unit(r.string(&part))),
            Rule::duration => Some(FlagKind::History(r.literal(&part))),
            Rule::name => Some(FlagKind::Consistency(r.name(&part))),
            Rule::kw_key => Some(FlagKind::Key),
            Rule::kw_optional => Some(FlagKind::Optional),
            Rule::range => {
                let (mut low, mut high) = (None, None);
                for end in part.into_inner() {
                    match end.as_rule() {
                        Rule::low => low = Some(r.literal(&end)),
                        Rule::high => high = Some(r.literal(&end)),
                        _ => {}
                    }
                }
                Some(FlagKind::Range(low, high))
            }
            _ => kind,
        };
    }
    Some(Flag { span, kind: kind? })
}

fn require(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Require> {
    let (mut paths, mut comparison, mut relation, mut message) = (Vec::new(), None, None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::path => paths.push(r.texts(part)),
            Rule::comparison => comparison = Some(r.name(&part)),
            Rule::name => relation = Some(r.name(&part)),
            Rule::string => message = Some(r.string(&part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    let mut paths = paths.into_iter().filter_map(|names| {
        let mut names = names.into_iter();
        Some((names.next()?, names.next()?))
    });
    Some(Require {
        left: paths.next()?,
        comparison: comparison?,
        right: paths.next()?,
        relation: relation?,
        message: message?,
    })
}

fn query(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Query> {
    let (mut name, mut parameters, mut text) = (None, Vec::new(), None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => name = Some(r.name(&part)),
            Rule::parameter => {
                let mut names = r.texts(part).into_iter();
                parameters.extend(names.next().zip(names.next()));
            }
            Rule::string => text = Some(r.string(&part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    Some(Query {
        name: name?,
        parameters,
        text: text?,
    })
}

rc_syntax::language!("`Domain NAME { … };`", words: [], {
    file | domain | kw_domain => "`Domain`",
    import | kw_import => "`import`",
    entity => "`entity`",
    relation => "`relation`",
    require => "`require`",
    query => "`query`",
    member => "an attribute",
    type_ref => "a type",
    block => "`dproto`",
    topic => "`topic`",
    flag => "`unit`, `key`, `optional`, `history`, `consistency` or a range",
    tree => "`tree`",
    promotes => "`promotes`",
    composed_by => "`composed_by`",
    kw_of => "`of`",
    path => "`PORT.ATTRIBUTE`",
    comparison => "a comparison",
    parameter => "a parameter",
    duration => "a duration",
    end_of_member => "`;`",
    close_square => "`]`",
});
