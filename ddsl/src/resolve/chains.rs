//! Chains: their names, their ends, their limits.

use super::Resolver;
use crate::ast::{self, ChainField};
use crate::duplicates::check_unique;
use crate::fields::duration;
use crate::model::{Chain, ChainPoint, InstanceOrGroup, Late, Outside};
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::{Literal, Name};
use rc_vocabulary::member;
use std::collections::HashMap;

impl Resolver<'_> {
    pub(super) fn resolve_chains(&mut self) {
        let mut names: HashMap<String, Span> = HashMap::new();
        for (group, tree) in std::mem::take(&mut self.chains) {
            let prefix = group.map(|group| format!("{}.", self.deployment.groups[group].path));
            let path = format!("{}{}", prefix.unwrap_or_default(), tree.name.text);
            self.length("chain", &path, tree.name.span);
            if let Some(first) = names.insert(path.to_lowercase(), tree.name.span) {
                let message = format!("duplicate name `{}`", tree.name.text);
                let error = Diagnostic::error("duplicate-name", tree.name.span, message);
                self.found.push(error.label(first, "first declared here"));
                continue;
            }
            let chain = self.chain(tree, path, group);
            self.deployment.chains.extend(chain);
        }
    }

    fn chain(&mut self, tree: &ast::Chain, path: String, group: Option<usize>) -> Option<Chain> {
        let words = tree.fields.iter().map(|(word, _)| word);
        check_unique(words, "field", &mut self.found);
        let (mut from, mut through, mut to) = (None, Vec::new(), None);
        let (mut within, mut age, mut transport) = (None, None, None);
        let (mut late, mut outside) = (None, Vec::new());
        // The first field of a name counts, even if it is wrong.
        for (word, field) in tree.fields.iter().rev() {
            let keyword = word.text.to_lowercase();
            match field {
                ChainField::Points(points) => {
                    let may_be_short = keyword == "through";
                    let points = points.iter();
                    let points = points.map(|point| self.chain_point(point, group, may_be_short));
                    let points: Vec<Option<ChainPoint>> = points.collect();
                    match keyword.as_str() {
                        "from" => from = Some(points.into_iter().next().flatten()),
                        "to" => to = Some(points.into_iter().next().flatten()),
                        _ => through = points,
                    }
                }
                ChainField::Time(literal) => {
                    let time = duration(literal, word, &mut self.found);
                    match keyword.as_str() {
                        "within" => within = time,
                        "age" => age = time,
                        _ => transport = time,
                    }
                }
                ChainField::Outside(all) => outside = self.outside(all, word, group),
                ChainField::Late(action) => {
                    late = self.late(action, group).map(|late| (word.span, late));
                }
            }
        }
        for (end, word) in [(&from, "from"), (&to, "to")] {
            if end.is_none() && !tree.incomplete {
                let message = format!("chain `{}` has no field `{word}`", tree.name.text);
                let error = Diagnostic::error("missing-clause", tree.name.span, message);
                let help = format!("add `{word} COMPONENT.SLOT.OPERATION;`");
                self.found.push(error.help(help));
            }
        }
        let has_time = |name: &str| {
            let mut fields = tree.fields.iter();
            fields.any(|(word, _)| word.text.eq_ignore_ascii_case(name))
        };
        if let Some((span, _)) = late
            && !tree.incomplete
            && !has_time("within")
            && !has_time("age")
        {
            let message = format!(
                "chain `{}` has no limit, so it is never late",
                tree.name.text
            );
            let error = Diagnostic::error("bad-chain", span, message);
            self.found
                .push(error.help("add `within 80ms;` or `age 120ms;`"));
        }
        // A point with an error is reported already.
        let through = through.into_iter().collect::<Option<Vec<ChainPoint>>>()?;
        Some(Chain {
            name: tree.name.clone(),
            path,
            doc: tree.doc.clone(),
            from: from??,
            through,
            to: to??,
            outside: outside.into_iter().collect::<Option<_>>()?,
            within,
            age,
            transport,
            late: late.map(|(_, late)| late).unwrap_or_default(),
        })
    }

    /// What programs outside do. `None` for what has an error.
    fn outside(
        &mut self,
        all: &[(Vec<Name>, Vec<Name>, Literal)],
        word: &Name,
        group: Option<usize>,
    ) -> Vec<Option<Outside>> {
        let all = all.iter().map(|(from, to, time)| {
            let from = self.chain_point(from, group, false);
            let to = self.chain_point(to, group, false);
            let within = duration(time, word, &mut self.found);
            Some(Outside {
                from: from?,
                to: to?,
                within: within?,
            })
        });
        all.collect()
    }

    /// The action if a chain is late.
    fn late(&mut self, tree: &ast::Late, group: Option<usize>) -> Option<Late> {
        const ACTIONS: [(&str, &str); 5] = [
            ("warn", "warn"),
            ("event", "event"),
            ("stop", "stop COMPONENT"),
            ("emergency", "emergency COMPONENT"),
            ("fire", "fire COMPONENT EVENT"),
        ];
        let action = &tree.action;
        let word = action.text.to_lowercase();
        let Some((_, form)) = ACTIONS.iter().find(|(known, _)| *known == word) else {
            let message = format!("`late` has no action `{}`", action.text);
            let error = Diagnostic::error("bad-chain", action.span, message);
            let words = ACTIONS.iter().map(|(known, _)| *known);
            self.found.push(error.suggest(&action.text, words));
            return None;
        };
        let takes = form.split(' ').count() - 1;
        let has = usize::from(!tree.component.is_empty()) + usize::from(tree.event.is_some());
        if takes != has {
            let message = format!("`late {word}` is written as `late {form};`");
            let error = Diagnostic::error("bad-chain", action.span, message);
            self.found.push(error);
            return None;
        }
        if takes == 0 {
            let event = word == "event";
            return Some(if event { Late::Event } else { Late::Warn });
        }
        let (instance, rest) = self.chain_instance(&tree.component, group)?;
        let (Some(instance), []) = (instance, rest) else {
            let written: Vec<&str> = tree.component.iter().map(|name| &*name.text).collect();
            let message = format!("`{}` is not a component", written.join("."));
            let error = Diagnostic::error("bad-chain", action.span, message);
            self.found.push(error.help(format!("write `late {form};`")));
            return None;
        };
        Some(match (word.as_str(), &tree.event) {
            ("stop", _) => Late::Stop(instance),
            (_, Some(event)) => Late::Fire(instance, event.clone()),
            _ => Late::Emergency(instance),
        })
    }

    /// The component that a path begins with, and the names after it. `None` for a group.
    fn chain_instance<'p>(
        &mut self,
        path: &'p [Name],
        group: Option<usize>,
    ) -> Option<(Option<usize>, &'p [Name])> {
        let (first, rest) = path.split_first()?;
        let mut place = self.first(first, group)?;
        let mut last = first;
        let mut rest = rest.iter();
        let instance = loop {
            match place {
                InstanceOrGroup::Instance(at) => break Some(at),
                InstanceOrGroup::Group(at) => match self.chain_proxy(at, rest.as_slice()) {
                    Some(proxy) => break Some(proxy),
                    None => match rest.next() {
                        Some(name) => {
                            place = self.inside(place, last, name)?;
                            last = name;
                        }
                        None => break None,
                    },
                },
            }
        };
        Some((instance, rest.as_slice()))
    }

    /// The proxy of a group, unless the path goes on with a name inside.
    fn chain_proxy(&self, group: usize, rest: &[Name]) -> Option<usize> {
        let inside = &self.scopes[group + 1].places.known;
        let proxy = self.deployment.groups[group].proxy.as_ref()?;
        let goes_on = rest
            .first()
            .is_some_and(|name| inside.contains_key(&name.text));
        (!goes_on).then_some(proxy.instance)
    }

    /// Resolves a component, and the names after it. It may be inside a group that does not export
    /// it, because a chain changes nothing there.
    fn chain_point(
        &mut self,
        path: &[Name],
        group: Option<usize>,
        may_be_short: bool,
    ) -> Option<ChainPoint> {
        let first = path.first()?;
        let (instance, rest) = self.chain_instance(path, group)?;
        let span = first.span.to(path.last().unwrap_or(first).span);
        let operation = match (instance, rest) {
            (Some(_), []) if may_be_short => None,
            (Some(_), [slot, operation]) => Some((slot.clone(), operation.clone())),
            (Some(_), [array, name, operation]) => {
                let slot = member::path(&array.text, &name.text);
                Some((Name::new(slot, array.span.to(name.span)), operation.clone()))
            }
            _ => {
                let written: Vec<&str> = path.iter().map(|name| name.text.as_str()).collect();
                let written = written.join(".");
                let expected = if may_be_short {
                    "COMPONENT or COMPONENT.SLOT.OPERATION"
                } else {
                    "COMPONENT.SLOT.OPERATION"
                };
                let message = format!("expected {expected}, found `{written}`");
                let error = Diagnostic::error("bad-chain", span, message);
                let help = "name the operation whose message counts, such as `lidar.LaserPub.scan`";
                self.found.push(error.help(help));
                return None;
            }
        };
        Some(ChainPoint {
            instance: instance?,
            operation,
            span,
        })
    }
}
