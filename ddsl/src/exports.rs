//! The exports of groups: which slot an exported name refers to, and where a slot is visible.

use crate::endpoint::Endpoint;
use crate::model::{Deployment, Group};
use rc_cdsl::Component;
use rc_cdsl::model::Role;
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
use rc_vocabulary::member;
use std::collections::{BTreeMap, HashMap};

/// The slot of each exported name of each group. `None` after an error.
#[derive(Debug, Default)]
pub(crate) struct Exports<'a> {
    /// For everybody outside: of a group with a proxy, a slot of the proxy.
    seen: HashMap<(usize, &'a str), Option<Endpoint>>,
    /// For groups with a proxy, the slots behind it, in the order of the exports.
    behind: Vec<(usize, &'a str, Endpoint)>,
}

/// A slot inside a group that matches an exported name.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    end: Endpoint,
    provides: bool,
    /// The location of the component, or of the `export` of an inner group.
    span: Span,
}

/// The slots directly in one group, by name.
#[derive(Debug, Default)]
struct GroupSlots<'a> {
    slots: BTreeMap<&'a str, Vec<Candidate>>,
    /// Whether an error hides some of its slots.
    incomplete: bool,
}

/// Whether the role provides an interface: implements or publishes it.
pub(crate) fn is_provider(role: Role) -> bool {
    matches!(role, Role::Implements | Role::Publishes)
}

impl<'a> Exports<'a> {
    /// Resolves all exports. `components` has one entry for each instance, `None` if its files have
    /// errors.
    pub(crate) fn new(
        deployment: &'a Deployment,
        components: &'a [Option<&'a Component>],
        found: &mut Diagnostics,
    ) -> Self {
        let mut exports = Self::default();
        // The slots of each group. Inner groups come after their enclosing groups.
        let mut inside: Vec<GroupSlots<'_>> = Vec::new();
        inside.resize_with(deployment.groups.len(), GroupSlots::default);
        for (at, instance) in deployment.instances.iter().enumerate() {
            // A proxy stands for its group, whose exports follow.
            let is_made = instance.proxy.is_some() || instance.adaptor.is_some();
            let Some(group) = instance.group.filter(|_| !is_made) else {
                continue;
            };
            let Some(component) = components.get(at).copied().flatten() else {
                inside[group].incomplete = true;
                continue;
            };
            for (slot, described) in component.slots.iter().enumerate() {
                let candidate = Candidate {
                    end: Endpoint { instance: at, slot },
                    provides: is_provider(described.role),
                    span: instance.name.span,
                };
                let name = described.name.as_str();
                inside[group].slots.entry(name).or_default().push(candidate);
            }
        }
        for (number, group) in deployment.groups.iter().enumerate().rev() {
            let own = std::mem::take(&mut inside[number]);
            let slots = group.exports.iter();
            for (slot, name) in slots.flat_map(|name| own.exported(name)) {
                let end = own.find(group, slot, name, found);
                let end = match (&group.proxy, end) {
                    (Some(proxy), Some(end)) => {
                        exports.behind.push((number, slot, end));
                        outer_slot(components, proxy.instance, slot)
                    }
                    (_, end) => end,
                };
                exports.seen.insert((number, slot), end);
                let Some(parent) = group.parent else { continue };
                match end {
                    Some(end) => {
                        let described = components[end.instance].map(|c| &c.slots[end.slot]);
                        let candidate = Candidate {
                            end,
                            provides: described.is_some_and(|s| is_provider(s.role)),
                            span: name.span,
                        };
                        let slots = &mut inside[parent].slots;
                        slots.entry(slot).or_default().push(candidate);
                    }
                    None => inside[parent].incomplete = true,
                }
            }
        }
        exports
    }

    /// The slot that `group` exports as `name`.
    pub(crate) fn get(&self, group: usize, name: &str) -> Option<Endpoint> {
        self.seen.get(&(group, name)).copied().flatten()
    }

    /// Whether `group` exports this name, and the slot is not known.
    pub(crate) fn is_unknown(&self, group: usize, name: &str) -> bool {
        self.seen.get(&(group, name)) == Some(&None)
    }

    /// The slots behind the proxy of a group, each with the name outside.
    pub(crate) fn behind(&self, group: usize) -> impl Iterator<Item = (&'a str, Endpoint)> {
        let own = self.behind.iter().filter(move |(of, ..)| *of == group);
        own.map(|(_, name, end)| (*name, *end))
    }

    /// Whether the exports of `group` are without errors. Only then is a member unknown if no
    /// export names it.
    pub(crate) fn knows(&self, group: usize, slot: &str) -> bool {
        let array = member::split(slot).map_or(slot, |(array, _)| array);
        !self.seen.contains_key(&(group, slot)) && !self.seen.contains_key(&(group, array))
    }

    /// The outermost group in which a slot is visible. `None` is the whole deployment.
    pub(crate) fn reach(
        &self,
        deployment: &Deployment,
        end: Endpoint,
        name: &str,
    ) -> Option<usize> {
        let own = deployment.instances[end.instance].group;
        let mut groups = deployment.enclosing(own);
        groups.find(|group| self.get(*group, name) != Some(end))
    }
}

/// The slot of a proxy that outsiders see under this name.
fn outer_slot(components: &[Option<&Component>], instance: usize, name: &str) -> Option<Endpoint> {
    let slots = &components.get(instance).copied().flatten()?.slots;
    let mut outer = slots[..slots.len() / 2].iter();
    let slot = outer.position(|slot| slot.name == name)?;
    Some(Endpoint { instance, slot })
}

impl<'a> GroupSlots<'a> {
    /// The slots that an exported name means, each with this name: all members of an array, else
    /// one slot.
    fn exported(&self, name: &'a Name) -> Vec<(&'a str, &'a Name)> {
        let slots = self.slots.keys().filter(|slot| match member::split(slot) {
            Some((array, _)) => array == name.text,
            None => false,
        });
        let members: Vec<_> = slots.map(|slot| (*slot, name)).collect();
        if members.is_empty() || self.slots.contains_key(name.text.as_str()) {
            return vec![(name.text.as_str(), name)];
        }
        members
    }

    /// The slot that `slot`, exported as `name`, refers to: the only provider, otherwise the only
    /// slot. A provider takes precedence, because a consumer inside the group connects to it.
    fn find(
        &self,
        group: &Group,
        slot: &str,
        name: &Name,
        found: &mut Diagnostics,
    ) -> Option<Endpoint> {
        let all = self.slots.get(slot).map_or(&[][..], Vec::as_slice);
        let providers: Vec<&Candidate> = all.iter().filter(|c| c.provides).collect();
        let group = &group.path;
        let text = slot;
        match (providers.as_slice(), all) {
            ([one], _) => return Some(one.end),
            ([], [one]) => return Some(one.end),
            ([], []) if self.incomplete => {}
            ([], []) => {
                let message = format!("group `{group}` has no slot `{text}`");
                let error = Diagnostic::error("unknown-export", name.span, message);
                found.push(error.suggest(text, self.slots.keys().copied()));
            }
            _ => {
                let message = format!("several slots in group `{group}` match `{text}`");
                let mut error = Diagnostic::error("ambiguous-export", name.span, message).help(
                    "move one of them into a group of its own, or rename the slot with `as NAME`",
                );
                let meant = if providers.is_empty() {
                    all.iter().collect()
                } else {
                    providers
                };
                for candidate in meant {
                    error = error.label(candidate.span, "candidate");
                }
                found.push(error);
            }
        }
        None
    }
}
