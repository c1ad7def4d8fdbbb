//! Units of what belongs together: both sides of a rule, and the poses of one graph.

use crate::ast::{self, Item};
use crate::resolve::Resolver;
use graph_schema::{Kind, PoseOf, Rule, compared_units, is_same_unit};
use rc_diagnostics::{Diagnostic, Span};

/// Whether numbers in one unit are numbers in the other one. Unknown units fit any.
fn are_equal(one: Option<&str>, other: Option<&str>) -> bool {
    let pair = one.zip(other);
    pair.is_none_or(|(one, other)| is_same_unit(one, other))
}

impl Resolver<'_> {
    /// Reports a rule that compares numbers of different units.
    pub(crate) fn units_of_rule(&mut self, require: &ast::Require, rule: &Rule) {
        let unit = |(port, attribute): &(usize, String)| {
            let port = self.schema.relation(&rule.relation)?.ports.get(*port)?;
            let attribute = self.entity(&port.entity)?.attribute(attribute)?;
            attribute.unit.clone()
        };
        let (left, right) = (unit(&rule.left), unit(&rule.right));
        if are_equal(left.as_deref(), right.as_deref()) {
            return;
        }
        if let (Some(left), Some(right)) = (left, right) {
            let message = format!(
                "`{}` is in `{left}`, but `{}` is in `{right}`",
                rule.left.1, rule.right.1
            );
            let span = require.right.1.span;
            let diagnostic = Diagnostic::error("unit-mismatch", span, message);
            self.found
                .push(diagnostic.help(compared_units(&right, &left)));
        }
    }

    /// Reports poses whose lengths differ in their units: transforms multiply them. Angles are radians.
    pub(crate) fn units_of_poses(&mut self, domains: &[ast::Domain]) {
        let mut first: Option<(String, String)> = None;
        for item in domains.iter().flat_map(|domain| &domain.items) {
            let Item::Relation(declared) = item else {
                continue;
            };
            let Some(relation) = self.schema.relation(&declared.name.text) else {
                continue;
            };
            let Some(placed) = relation.placed() else {
                continue;
            };
            let (by, angles) = match placed.pose {
                PoseOf::One(pose) => (pose, None),
                PoseOf::Two(by, angles) => (by, Some(angles)),
            };
            let unit = |name: &str| {
                let attribute = relation.attribute(name)?;
                match &attribute.kind {
                    // Transforms have metres of any prototype.
                    Kind::Block(_) => Some("m".to_owned()),
                    _ => attribute.unit.clone(),
                }
            };
            let place = |name: &str| -> Span {
                let member = declared.members.iter().find(|m| m.name.text == name);
                member.map_or(declared.name.span, |member| member.name.span)
            };
            let mut wrong = Vec::new();
            if let Some(angles) = angles
                && let Some(unit) = unit(&angles).filter(|unit| !are_equal(Some(unit), Some("rad")))
            {
                let message = format!("the angles `{angles}` are in `{unit}`, expected `rad`");
                let diagnostic = Diagnostic::error("unit-mismatch", place(&angles), message);
                wrong.push(diagnostic.help("a transform takes radians"));
            }
            if let Some(own) = unit(&by) {
                match &first {
                    Some((relation, known)) if !are_equal(Some(&own), Some(known)) => {
                        let message = format!(
                            "`{by}` is in `{own}`, but the poses of `{relation}` are in `{known}`"
                        );
                        let diagnostic = Diagnostic::error("unit-mismatch", place(&by), message);
                        wrong.push(diagnostic.help(compared_units(&own, known)));
                    }
                    Some(_) => {}
                    None => first = Some((declared.name.text.clone(), own)),
                }
            }
            self.found.extend(wrong);
        }
    }
}
