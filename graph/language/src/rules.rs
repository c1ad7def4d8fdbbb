//! Rules over relations, and queries with a name.

use crate::ast::{self, Item};
use crate::members::TYPES;
use crate::resolve::Resolver;
use graph_schema::{Comparison, Kind, Query, Relation, Rule};
use rc_diagnostics::Diagnostic;
use rc_syntax::Name;

impl Resolver<'_> {
    /// Adds the rules and the queries of a domain, once all of its types are known.
    pub(crate) fn rules_and_queries(&mut self, domain: &ast::Domain) {
        for item in &domain.items {
            match item {
                Item::Require(require) => {
                    let rule = self.rule(require);
                    self.schema.rules.extend(rule);
                }
                Item::Query(query) if self.is_new(&query.name) => {
                    for (_, kind) in &query.parameters {
                        let known = TYPES.contains(&kind.text.as_str());
                        if !known && self.entity(&kind.text).is_none() {
                            self.unknown_entity(kind);
                        }
                    }
                    let parameters = query.parameters.iter();
                    self.schema.queries.push(Query {
                        name: query.name.text.clone(),
                        parameters: parameters
                            .map(|(name, kind)| (name.text.clone(), kind.text.clone()))
                            .collect(),
                        text: query.text.text.clone(),
                    });
                }
                _ => {}
            }
        }
    }

    fn rule(&mut self, require: &ast::Require) -> Option<Rule> {
        let Some(relation) = self.schema.relation(&require.relation.text).cloned() else {
            let message = format!("unknown relation `{}`", require.relation.text);
            let known = self.schema.relations.iter().map(|r| r.name.as_str());
            let diagnostic = Diagnostic::error("unknown-relation", require.relation.span, message);
            self.found
                .push(diagnostic.suggest(&require.relation.text, known));
            return None;
        };
        let left = self.side(&relation, &require.left);
        let right = self.side(&relation, &require.right);
        let comparison = match require.comparison.text.as_str() {
            "<" => Comparison::Less,
            "<=" => Comparison::LessOrEqual,
            ">" => Comparison::Greater,
            ">=" => Comparison::GreaterOrEqual,
            "==" => Comparison::Equal,
            _ => Comparison::NotEqual,
        };
        let rule = Rule {
            relation: relation.name,
            left: left?,
            comparison,
            right: right?,
            message: require.message.text.clone(),
        };
        self.units_of_rule(require, &rule);
        Some(rule)
    }

    /// One side of a rule: a port, or the entity of a port, and a number of it.
    fn side(
        &mut self,
        relation: &Relation,
        (end, attribute): &(Name, Name),
    ) -> Option<(usize, String)> {
        let named = relation.ports.iter().position(|port| port.name == end.text);
        let mut fit = relation.ports.iter().filter(|port| port.entity == end.text);
        if named.is_none() && fit.by_ref().count() > 1 {
            let message = format!(
                "both ports of `{}` are for `{}`; name one of them",
                relation.name, end.text
            );
            self.error("unknown-port", end.span, message);
            return None;
        }
        let by_entity = || {
            relation
                .ports
                .iter()
                .position(|port| port.entity == end.text)
        };
        let port = named.or_else(by_entity);
        let Some(port) = port else {
            let message = format!("`{}` has no port `{}`", relation.name, end.text);
            let known = relation.ports.iter();
            let known = known.flat_map(|port| [port.name.as_str(), port.entity.as_str()]);
            let known: std::collections::BTreeSet<&str> = known.collect();
            let diagnostic = Diagnostic::error("unknown-port", end.span, message);
            self.found.push(diagnostic.suggest(&end.text, known));
            return None;
        };
        let entity = self.entity(&relation.ports[port].entity)?.clone();
        match entity.attribute(&attribute.text).map(|a| &a.kind) {
            Some(Kind::Int | Kind::Float) => Some((port, attribute.text.clone())),
            Some(kind) => {
                let message = format!("`{}` is {}, no number", attribute.text, kind.text());
                self.error("wrong-type", attribute.span, message);
                None
            }
            None => {
                let message = format!("`{}` has no attribute `{}`", entity.name, attribute.text);
                let known = entity.attributes.iter().map(|a| a.name.as_str());
                let diagnostic = Diagnostic::error("unknown-attribute", attribute.span, message);
                self.found.push(diagnostic.suggest(&attribute.text, known));
                None
            }
        }
    }
}
