//! Composition of prototypes: without cycles, not too deep, of fitting types.

use super::super::Resolver;
use crate::model::{Content, Prototype};
use rc_diagnostics::Diagnostic;
use std::collections::{HashMap, HashSet};

/// The deepest composition.
const DEEPEST: usize = 16;

impl Resolver<'_> {
    /// Reports prototypes that compose themselves, and compositions that are too deep.
    pub(in crate::resolve) fn compose(&mut self) {
        let prototypes = &self.library.prototypes;
        let parts: HashMap<&str, Vec<&str>> = prototypes
            .iter()
            .map(|prototype| {
                let parts = match &prototype.content {
                    Content::Parts(parts) => parts.iter().map(|p| p.prototype.as_str()).collect(),
                    Content::Values { .. } => Vec::new(),
                };
                (prototype.name.as_str(), parts)
            })
            .collect();
        // Those with this many levels below them.
        let mut deep: HashSet<&str> = parts.keys().copied().collect();
        for _ in 0..=DEEPEST {
            deep = parts
                .iter()
                .filter(|(_, parts)| parts.iter().any(|part| deep.contains(part)))
                .map(|(name, _)| *name)
                .collect();
        }
        let wrong = prototypes
            .iter()
            .filter(|prototype| deep.contains(prototype.name.as_str()))
            .map(|prototype| {
                let (code, message) = if composes_itself(&prototype.name, &parts) {
                    let message = format!("`{}` composes itself", prototype.name);
                    ("circular-prototypes", message)
                } else {
                    let message =
                        format!("prototypes are composed more than {DEEPEST} levels deep");
                    ("nested-too-deep", message)
                };
                Diagnostic::error(code, prototype.span, message)
            });
        self.found.extend(wrong.collect::<Vec<_>>());
        self.check_held();
        self.check_members();
    }

    /// Reports parts of composites that are of another type than their prototypes.
    fn check_held(&mut self) {
        let mut wrong = Vec::new();
        for (composite, held) in &self.held {
            let Some(composite) = self.library.prototype(composite) else {
                continue;
            };
            for (name, member, ty) in held {
                let part = self.library.prototype(name);
                let Some((wanted, ty)) = part.and_then(Prototype::interface_type).zip(ty.as_ref())
                else {
                    continue;
                };
                if wanted != ty {
                    let what = match member.as_str() {
                        "" => "the whole".to_owned(),
                        member => format!("`{member}`"),
                    };
                    let message = format!("{what} is {ty}, and `{name}` is about {wanted}");
                    wrong.push(Diagnostic::error("wrong-type", composite.span, message));
                }
            }
        }
        self.found.extend(wrong);
    }

    /// Reports members of a type that two parts of a composite about this type name.
    fn check_members(&mut self) {
        let library = &self.library;
        let mut wrong = Vec::new();
        for composite in &library.prototypes {
            let Content::Parts(parts) = &composite.content else {
                continue;
            };
            let held = parts.iter().filter(|p| p.member.as_deref() == Some(""));
            let held = held.filter_map(|part| library.prototype(&part.prototype));
            let members = held.flat_map(|part| {
                let data = match &part.content {
                    Content::Values { data, .. } => data.as_slice(),
                    Content::Parts(_) => &[],
                };
                let own = data.iter().map(|datum| &datum.member);
                own.chain(part.covariance.iter().map(|of| &of.member))
            });
            let own = composite.covariance.iter().map(|of| &of.member);
            let mut seen = HashSet::new();
            let twice = own.chain(members).find(|member| !seen.insert(*member));
            if let Some(member) = twice {
                let message = format!(
                    "two parts of `{}` name the member `{member}`",
                    composite.name
                );
                wrong.push(Diagnostic::error("repeated-key", composite.span, message));
            }
        }
        self.found.extend(wrong);
    }
}

/// Whether a prototype is among its parts, their parts and so on.
fn composes_itself(name: &str, parts: &HashMap<&str, Vec<&str>>) -> bool {
    let mut seen = HashSet::new();
    let mut open = vec![name];
    while let Some(next) = open.pop() {
        for part in parts.get(next).into_iter().flatten() {
            if *part == name {
                return true;
            }
            if seen.insert(*part) {
                open.push(part);
            }
        }
    }
    false
}
