//! Attributes that are one value in several representations.

use crate::ast::{self, Item, Member};
use crate::blocks::MOST;
use crate::resolve::Resolver;
use graph_schema::{Attribute, Block, Kind};
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::Name;
use std::collections::{HashMap, HashSet};

/// The data prototype of an attribute.
fn block(attribute: &Attribute) -> Option<&Block> {
    match &attribute.kind {
        Kind::Block(block) => Some(block),
        _ => None,
    }
}

/// Why a member cannot be the value of another attribute, which `size` attributes have as theirs.
fn wrong_consistency(
    member: &Member,
    of: &Name,
    other: &Attribute,
    size: usize,
) -> Option<Diagnostic> {
    let error = |message: String| Diagnostic::error("wrong-consistency", of.span, message);
    let Some(block) = block(other) else {
        let message = format!("`{}` has no data prototype", of.text);
        let help = "`consistency` connects attributes of type `dproto`";
        return Some(error(message).help(help));
    };
    if other.name == member.name.text {
        let message = format!("`{}` is consistent with itself", of.text);
        return Some(error(message));
    }
    if let Some(head) = &block.consistent_with {
        let message = format!("`{}` is itself the value of `{head}`", of.text);
        return Some(error(message).help(format!("write `consistency {head}`")));
    }
    (size > MOST).then(|| error(format!("more than {MOST} attributes have this value")))
}

impl Resolver<'_> {
    /// Notes which attributes are the value of another one.
    pub(crate) fn consistent(&mut self, domain: &ast::Domain) {
        for item in &domain.items {
            let (name, members) = match item {
                Item::Entity(entity) => (&entity.name.text, &entity.members),
                Item::Relation(relation) => (&relation.name.text, &relation.members),
                _ => continue,
            };
            let all = self.attributes_of(name);
            // The first one of a name that is there twice.
            let named = all.iter().rev().map(|own| (own.name.as_str(), own));
            let named: HashMap<&str, &Attribute> = named.collect();
            let mut sizes: HashMap<&str, usize> = HashMap::new();
            for attribute in all {
                *sizes.entry(attribute.value_of()).or_default() += 1;
            }
            let wrong = members.iter().filter_map(|member| {
                let of = member.consistent_with()?;
                // An invalid block is a finding already.
                block(named.get(&*member.name.text)?)?;
                let Some(other) = named.get(&*of.text) else {
                    let message = format!("`{name}` has no attribute `{}`", of.text);
                    let known = all.iter().map(|attribute| attribute.name.as_str());
                    let diagnostic = Diagnostic::error("unknown-attribute", of.span, message);
                    return Some(diagnostic.suggest(&of.text, known));
                };
                let size = sizes.get(&*of.text).copied().unwrap_or_default();
                wrong_consistency(member, of, other, size)
            });
            let wrong: Vec<Diagnostic> = wrong.collect();
            self.found.extend(wrong);
        }
    }

    fn attributes_of(&self, kind: &str) -> &[Attribute] {
        let entity = self.entity(kind).map(|entity| &entity.attributes);
        let all = entity.or_else(|| self.relation(kind).map(|r| &r.attributes));
        all.map_or(&[], Vec::as_slice)
    }

    /// Makes the conversions between attributes that are one value.
    pub(crate) fn convert(&mut self, domains: &[ast::Domain]) {
        let mut known: HashSet<Span> = self.found.iter().map(|known| known.span).collect();
        for item in domains.iter().flat_map(|domain| &domain.items) {
            let (name, members) = match item {
                Item::Entity(entity) => (&entity.name.text, &entity.members),
                Item::Relation(relation) => (&relation.name.text, &relation.members),
                _ => continue,
            };
            let mut attributes = self.attributes_of(name).to_vec();
            let wrong = self.blocks.convert(&mut attributes);
            let own: HashMap<&str, &Member> = members
                .iter()
                .rev()
                .map(|member| (member.name.text.as_str(), member))
                .collect();
            for (at, code, message) in wrong {
                // An inherited one is a finding of the ancestor.
                if let Some(of) = own.get(&*at).and_then(|member| member.consistent_with())
                    && known.insert(of.span)
                {
                    self.found.push(Diagnostic::error(code, of.span, message));
                }
            }
            if let Some(entity) = self.entity_mut(name) {
                entity.attributes = attributes;
            } else if let Some(relation) = self.relation_mut(name) {
                relation.attributes = attributes;
            }
        }
    }
}
