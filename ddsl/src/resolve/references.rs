//! The names that a `.ddsl` refers to: hosts, components, groups, and slots of components.

use super::{Resolver, Scope};
use crate::ast;
use crate::host_address::LOCALHOST;
use crate::members::member_slot;
use crate::model::{InstanceOrGroup, SlotPath};
use rc_diagnostics::{Diagnostic, Span};
use rc_syntax::Name;

/// The number of name comparisons for suggestions, for all files together.
const MAX_COMPARISONS: usize = 200_000;

impl Resolver<'_> {
    /// The scopes visible in `group`, from inside to outside.
    pub(super) fn visible(&self, group: Option<usize>) -> impl Iterator<Item = &Scope> {
        let groups = self.deployment.enclosing(group).map(|group| group + 1);
        groups.chain([0]).map(|scope| &self.scopes[scope])
    }

    pub(super) fn host_named(&mut self, name: &Name, group: Option<usize>) -> Option<usize> {
        let host = self
            .visible(group)
            .find_map(|s| s.hosts.known.get(&name.text).copied());
        if host.is_none() && name.text != LOCALHOST {
            let message = format!("unknown host `{}`", name.text);
            let error = Diagnostic::error("unknown-host", name.span, message);
            let any = self.visible(group).any(|s| !s.hosts.known.is_empty());
            if !any && rc_diagnostics::nearest(&name.text, [LOCALHOST]).is_none() {
                let declared = format!(
                    "declare it: `Host {} {{ address \"10.0.0.2\"; }};`",
                    name.text
                );
                self.found.push(error.help(declared));
                return None;
            }
            self.report_unknown(error, &name.text, |r| {
                let hosts = r.visible(group).flat_map(|s| s.hosts.known.keys().cloned());
                hosts.chain([LOCALHOST.to_owned()]).collect()
            });
        }
        host
    }

    /// Resolves a single name, or the first name of a path, in `group`.
    pub(super) fn first(&mut self, name: &Name, group: Option<usize>) -> Option<InstanceOrGroup> {
        let place = self
            .visible(group)
            .find_map(|s| s.places.known.get(&name.text).copied());
        if place.is_none() {
            let message = format!("unknown component or group `{}`", name.text);
            let error = Diagnostic::error("unknown-instance", name.span, message);
            self.report_unknown(error, &name.text, |r| {
                let scopes = r.visible(group);
                scopes
                    .flat_map(|s| s.places.known.keys().cloned())
                    .collect()
            });
        }
        let place = place?;
        self.deployment.references.push((name.span, place));
        Some(place)
    }

    /// Resolves the component that publishes the time. It may be inside a group that does not
    /// export it.
    pub(super) fn source_of_time(&mut self, path: &[Name]) -> Option<(usize, Span)> {
        let (first, rest) = path.split_first()?;
        let mut place = self.first(first, None)?;
        let mut last = first;
        for name in rest {
            place = self.inside(place, last, name)?;
            last = name;
        }
        let span = first.span.to(last.span);
        match place {
            InstanceOrGroup::Instance(at) => Some((at, span)),
            InstanceOrGroup::Group(group) => {
                let group = &self.deployment.groups[group];
                let message = format!("`{}` is a group; a component publishes time", group.path);
                let error = Diagnostic::error("not-a-time-source", span, message)
                    .label(group.name.span, "the group")
                    .help(format!("write `time simulated by {}.NAME;`", group.path));
                self.found.push(error);
                None
            }
        }
    }

    /// Resolves `name` in `place`, which `last` names: it has to be a group.
    pub(super) fn inside(
        &mut self,
        place: InstanceOrGroup,
        last: &Name,
        name: &Name,
    ) -> Option<InstanceOrGroup> {
        let InstanceOrGroup::Group(inside) = place else {
            let message = format!("expected a group, found component `{}`", last.text);
            let error = Diagnostic::error("not-a-group", name.span, message);
            let last = &last.text;
            let help = format!("write `{last}.SLOT`, or `{last}.ARRAY.MEMBER` for a slot array");
            self.found.push(error.help(help));
            return None;
        };
        let known = &self.scopes[inside + 1].places.known;
        let found = known.get(&name.text).copied();
        if found.is_none() {
            let message = format!(
                "group `{}` has no component or group `{}`",
                self.deployment.groups[inside].path, name.text
            );
            let error = Diagnostic::error("unknown-instance", name.span, message);
            self.report_unknown(error, &name.text, |r| {
                let known = &r.scopes[inside + 1].places.known;
                known.keys().cloned().collect()
            });
        }
        let found = found?;
        self.deployment.references.push((name.span, found));
        Some(found)
    }

    /// Reports an unknown name with a suggestion, until [`MAX_COMPARISONS`] is reached.
    fn report_unknown(
        &mut self,
        error: Diagnostic,
        name: &str,
        known: impl FnOnce(&Self) -> Vec<String>,
    ) {
        if self.comparisons > MAX_COMPARISONS {
            return self.found.push(error);
        }
        let mut known = known(self);
        self.comparisons += known.len();
        known.sort_unstable();
        known.dedup();
        self.found
            .push(error.suggest(name, known.iter().map(String::as_str)));
    }

    /// Whether the last name before the slot is a slot array: in a component, or exported by a
    /// group. `None` after an error: it might be an array and a component or group at once.
    fn is_array(
        &mut self,
        place: InstanceOrGroup,
        name: &Name,
        tree: &ast::SlotPath,
    ) -> Option<bool> {
        let InstanceOrGroup::Group(inside) = place else {
            return Some(true);
        };
        let group = &self.deployment.groups[inside];
        let Some(export) = group.exports.iter().find(|e| e.text == name.text) else {
            return Some(false);
        };
        let Some(place) = self.scopes[inside + 1].places.known.get(&name.text) else {
            return Some(true);
        };
        let (what, span) = match place {
            InstanceOrGroup::Instance(at) => {
                ("component", self.deployment.instances[*at].name.span)
            }
            InstanceOrGroup::Group(at) => ("group", self.deployment.groups[*at].name.span),
        };
        let message = format!(
            "`{}.{}` could mean a member of the exported slot `{}`, or a slot of the {what} `{}`",
            name.text, tree.slot.text, name.text, name.text
        );
        let error = Diagnostic::error("ambiguous-slot", name.span.to(tree.slot.span), message)
            .label(export.span, "the export")
            .label(span, format!("the {what}"))
            .help("give one of them another name");
        self.found.push(error);
        None
    }

    /// The outermost group with a proxy that a path of `group` enters from outside, with the name
    /// inside.
    fn behind_proxy<'n>(
        &self,
        entered: &[(usize, &'n Name)],
        group: Option<usize>,
    ) -> Option<(usize, &'n Name)> {
        let mut entered = entered.iter().copied();
        entered.find(|(inside, _)| {
            self.deployment.groups[*inside].proxy.is_some()
                && !self.deployment.is_inside(group, Some(*inside))
        })
    }

    /// Resolves a path in `group`. A path may enter a group from outside only if the group exports
    /// the slot.
    pub(super) fn slot_path(
        &mut self,
        tree: &ast::SlotPath,
        group: Option<usize>,
    ) -> Option<SlotPath> {
        let (first, rest) = tree.path.split_first()?;
        let mut place = self.first(first, group)?;
        let mut entered: Vec<(usize, &Name)> = Vec::new();
        let mut array = None;
        for (at, (name, next)) in rest.iter().zip(&tree.path).enumerate() {
            if at + 1 == rest.len() && self.is_array(place, name, tree)? {
                array = Some(name);
                break;
            }
            if let InstanceOrGroup::Group(inside) = place {
                entered.push((inside, name));
            }
            place = self.inside(place, next, name)?;
        }
        // A group exports an array as a whole.
        let exported = array.unwrap_or(&tree.slot);
        if let Some((inside, name)) = self.behind_proxy(&entered, group) {
            let within = &self.deployment.groups[inside];
            let message = format!(
                "`{}` is behind the proxy of group `{}`, and cannot be reached from outside",
                name.text, within.path
            );
            let span = name.span.to(tree.slot.span);
            let proxy = within.proxy.as_ref().map(|proxy| proxy.span);
            let error = Diagnostic::error("behind-proxy", span, message)
                .label(proxy.unwrap_or(within.name.span), "the proxy");
            let is_exported = within.exports.iter().any(|e| e.text == exported.text);
            let help = if is_exported {
                format!("write `{}.{}`", within.path, exported.text)
            } else {
                format!(
                    "{}, and name it as `{}.{}`",
                    within.export_with(&exported.text),
                    within.path,
                    exported.text
                )
            };
            self.found.push(error.help(help));
            return None;
        }
        let private = entered.iter().find(|(inside, _)| {
            let exports = &self.deployment.groups[*inside].exports;
            // Inside a group, all of its content is visible.
            !self.deployment.is_inside(group, Some(*inside))
                && !exports.iter().any(|e| e.text == exported.text)
        });
        if let Some((inside, name)) = private {
            let within = &self.deployment.groups[*inside];
            let message = format!(
                "`{}` is inside group `{}`, which does not export `{}`",
                name.text, within.path, exported.text
            );
            let span = name.span.to(tree.slot.span);
            let error = Diagnostic::error("not-exported", span, message)
                .label(within.name.span, "the group")
                .help(within.export_with(&exported.text));
            self.found.push(error);
            return None;
        }
        if let InstanceOrGroup::Group(of) = place {
            let of = &self.deployment.groups[of];
            if !of.exports.iter().any(|e| e.text == exported.text) {
                let message = format!("group `{}` does not export `{}`", of.path, tree.slot.text);
                let error = Diagnostic::error("not-exported", tree.slot.span, message)
                    .label(of.name.span, "the group");
                let known = of.exports.iter().map(|e| e.text.as_str());
                let near = rc_diagnostics::nearest(&tree.slot.text, known);
                self.found.push(match near {
                    Some(_) => error.did_you_mean(&tree.slot.text, near),
                    None => error.help(of.export_with(&tree.slot.text)),
                });
                return None;
            }
        }
        Some(SlotPath {
            place,
            slot: array.map_or_else(|| tree.slot.clone(), |array| member_slot(array, tree)),
            span: first.span.to(tree.slot.span),
        })
    }
}
