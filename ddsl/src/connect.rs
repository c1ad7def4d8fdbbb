//! Who talks to whom, and what is wrong with it, before anything starts.

use crate::model::{Bind, Deployment, SlotPath};
use rc_cdsl::Component;
use rc_cdsl::model::{Backend, Role, Slot};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_idsl::canonical::operation_text;
use std::collections::BTreeSet;

/// One end of a connection: the numbers of an instance and of its slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Endpoint {
    /// Index into [`Deployment::components`].
    pub instance: usize,
    /// Index into [`Component::slots`].
    pub slot: usize,
}

/// A consumer and its provider.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Connection {
    /// The end that requires or subscribes.
    pub consumer: Endpoint,
    /// The end that implements or publishes.
    pub provider: Endpoint,
}

/// All connections of a network.
#[derive(Clone, Debug, Default)]
pub struct Network {
    /// Each consumer with its provider; a subscriber of several publishers stands several times.
    pub connections: Vec<Connection>,
}

impl Network {
    /// The instances that `instance` requires.
    pub fn required_by(
        &self,
        instance: usize,
        components: &[Option<&Component>],
    ) -> BTreeSet<usize> {
        let of = |c: &&Connection| {
            let component = components.get(instance).copied().flatten();
            let role = component
                .and_then(|k| k.slots.get(c.consumer.slot))
                .map(|s| s.role);
            c.consumer.instance == instance
                && c.provider.instance != instance
                && role == Some(Role::Requires)
        };
        self.connections
            .iter()
            .filter(of)
            .map(|c| c.provider.instance)
            .collect()
    }
}

/// Connects every slot: as `bind` says, else to the only component that provides its interface. `components`
/// has one entry for each instance, none where its files could not be read; `middleware` is that of slots
/// which do not choose one.
pub fn connect(
    deployment: &Deployment,
    components: &[Option<&Component>],
    middleware: Backend,
) -> (Network, Diagnostics) {
    let mut connector = Connector {
        deployment,
        components,
        middleware,
        network: Network::default(),
        found: Diagnostics::new(),
    };
    let bound = connector.binds();
    connector.unbound(&bound);
    connector.cycles();
    connector.network.connections.sort();
    connector.network.connections.dedup();
    (connector.network, connector.found)
}

struct Connector<'a> {
    deployment: &'a Deployment,
    components: &'a [Option<&'a Component>],
    middleware: Backend,
    network: Network,
    found: Diagnostics,
}

impl<'a> Connector<'a> {
    fn slot(&self, end: Endpoint) -> Option<&'a Slot> {
        self.components
            .get(end.instance)
            .copied()
            .flatten()?
            .slots
            .get(end.slot)
    }

    fn name(&self, end: Endpoint) -> String {
        let slot = self.slot(end).map_or("?", |s| s.name.as_str());
        format!(
            "{}.{slot}",
            self.deployment.components[end.instance].name.text
        )
    }

    fn path(&self, end: Endpoint) -> String {
        let component = self.components.get(end.instance).copied().flatten();
        let path = component
            .zip(self.slot(end))
            .map(|(c, s)| c.library.interface_path(s.interface));
        path.unwrap_or_default()
    }

    /// The slot that a path names; says so where there is none.
    fn find(&mut self, path: &SlotPath) -> Option<Endpoint> {
        let instance = self
            .deployment
            .components
            .iter()
            .position(|c| c.name.text == path.instance.text)?;
        let component = self.components.get(instance).copied().flatten()?;
        if let Some(slot) = component
            .slots
            .iter()
            .position(|s| s.name == path.slot.text)
        {
            return Some(Endpoint { instance, slot });
        }
        let message = format!("`{}` has no slot `{}`", path.instance.text, path.slot.text);
        let known = component.slots.iter().map(|s| s.name.as_str());
        self.found.push(
            Diagnostic::error("unknown-slot", path.slot.span, message)
                .suggest(&path.slot.text, known),
        );
        None
    }

    fn binds(&mut self) -> Vec<Endpoint> {
        let mut bound = Vec::new();
        for bind in &self.deployment.binds {
            let (consumer, provider) = (self.find(&bind.consumer), self.find(&bind.provider));
            let (Some(consumer), Some(provider)) = (consumer, provider) else {
                continue;
            };
            if let Some((first, _)) = bound.iter().find(|(end, b): &&(Endpoint, &Bind)| {
                *end == consumer
                    && self
                        .slot(consumer)
                        .is_some_and(|s| s.role == Role::Requires)
                    && b.provider.span() != bind.provider.span()
            }) {
                let message = format!(
                    "`{}` is bound twice; a required slot has one provider",
                    self.name(*first)
                );
                self.found.push(Diagnostic::error(
                    "bound-twice",
                    bind.consumer.span(),
                    message,
                ));
                continue;
            }
            bound.push((consumer, bind));
            if self.fits(bind, consumer, provider) {
                self.network
                    .connections
                    .push(Connection { consumer, provider });
            }
        }
        bound.into_iter().map(|(end, _)| end).collect()
    }

    /// Whether a bind joins two ends that belong together; says so where it does not.
    fn fits(&mut self, bind: &Bind, consumer: Endpoint, provider: Endpoint) -> bool {
        let (Some(one), Some(other)) = (self.slot(consumer), self.slot(provider)) else {
            return false;
        };
        let wanted = match one.role {
            Role::Requires => Role::Implements,
            Role::SubscribesTo => Role::Publishes,
            Role::Implements | Role::Publishes => {
                let message = format!(
                    "`{}` {} its interface; the consumer stands left of `->`",
                    self.name(consumer),
                    one.role.word()
                );
                let diagnostic =
                    Diagnostic::error("wrong-direction", bind.consumer.span(), message);
                self.found.push(diagnostic.help(
                    "a consumer requires or subscribesTo, a provider implements or publishes",
                ));
                return false;
            }
        };
        if other.role != wanted {
            let message = format!(
                "`{}` {} its interface; `{}` needs a slot that {}",
                self.name(provider),
                other.role.word(),
                self.name(consumer),
                wanted.word()
            );
            self.found.push(Diagnostic::error(
                "wrong-direction",
                bind.provider.span(),
                message,
            ));
            return false;
        }
        if self.path(consumer) != self.path(provider) {
            let message = format!(
                "`{}` speaks {}, `{}` speaks {}",
                self.name(consumer),
                self.path(consumer),
                self.name(provider),
                self.path(provider)
            );
            self.found.push(Diagnostic::error(
                "different-interfaces",
                bind.consumer.span().to(bind.provider.span()),
                message,
            ));
            return false;
        }
        self.agree(bind.consumer.span(), consumer, provider)
    }

    /// Whether two ends of one interface have the same types, the same middleware and a quality of service
    /// that goes together.
    fn agree(
        &mut self,
        span: rc_diagnostics::Span,
        consumer: Endpoint,
        provider: Endpoint,
    ) -> bool {
        let (Some(one), Some(other)) = (self.slot(consumer), self.slot(provider)) else {
            return false;
        };
        let (Some(a), Some(b)) = (
            self.components[consumer.instance],
            self.components[provider.instance],
        ) else {
            return false;
        };
        let texts = |c: &Component, s: &Slot| -> Vec<String> {
            let operations = &c.library.interface(s.interface).operations;
            operations
                .iter()
                .map(|o| operation_text(&c.library, s.interface, o))
                .collect()
        };
        let (ours, theirs) = (texts(a, one), texts(b, other));
        let ends = format!("`{}` and `{}`", self.name(consumer), self.name(provider));
        let before = self.found.iter().count();
        if ours != theirs {
            let differing = ours
                .iter()
                .find(|t| !theirs.contains(t))
                .or_else(|| theirs.iter().find(|t| !ours.contains(t)));
            let operation = differing
                .and_then(|t| t.split('(').next())
                .unwrap_or("the order of operations");
            let message = format!(
                "{ends} have different definitions of {}: {operation} differs",
                self.path(consumer)
            );
            let declared = a.library.interface(one.interface).name.span;
            let diagnostic =
                Diagnostic::error("type-mismatch", span, message).label(declared, "one definition");
            let declared = b.library.interface(other.interface).name.span;
            self.found.push(diagnostic.label(declared, "the other one"));
        }
        let (here, there) = (
            one.backend.unwrap_or(self.middleware),
            other.backend.unwrap_or(self.middleware),
        );
        if here != there {
            let message = format!(
                "{ends} use different middleware: {} and {}",
                here.word(),
                there.word()
            );
            self.found
                .push(Diagnostic::error("middleware-mismatch", span, message));
        }
        let weak_reliability = one.qos.reliable == Some(true) && other.qos.reliable == Some(false);
        let weak_durability =
            one.qos.transient_local == Some(true) && other.qos.transient_local != Some(true);
        for (wrong, asked, offered) in [
            (weak_reliability, "reliability reliable", "best_effort"),
            (weak_durability, "durability transient_local", "volatile"),
        ] {
            if wrong {
                let message = format!(
                    "`{}` asks for {asked}, `{}` offers {offered}",
                    self.name(consumer),
                    self.name(provider)
                );
                self.found
                    .push(Diagnostic::error("qos-mismatch", span, message));
            }
        }
        self.found.iter().count() == before
    }

    /// Slots that no bind names meet the only provider of their interface, topics every publisher.
    fn unbound(&mut self, bound: &[Endpoint]) {
        let ends: Vec<Endpoint> = self
            .components
            .iter()
            .enumerate()
            .filter_map(|(instance, component)| component.map(|c| (instance, c.slots.len())))
            .flat_map(|(instance, count)| (0..count).map(move |slot| Endpoint { instance, slot }))
            .collect();
        let mut read = BTreeSet::new();
        read.extend(self.network.connections.iter().map(|c| c.provider));
        for consumer in ends.iter().copied().filter(|end| !bound.contains(end)) {
            let Some(slot) = self.slot(consumer) else {
                continue;
            };
            let wanted = match slot.role {
                Role::Requires => Role::Implements,
                Role::SubscribesTo => Role::Publishes,
                Role::Implements | Role::Publishes => continue,
            };
            let path = self.path(consumer);
            let providers: Vec<Endpoint> = ends
                .iter()
                .copied()
                .filter(|end| {
                    self.slot(*end).is_some_and(|s| s.role == wanted) && self.path(*end) == path
                })
                .collect();
            let name = &self.deployment.components[consumer.instance].name;
            match (slot.role, providers.as_slice()) {
                (Role::Requires, []) => {
                    let message = format!(
                        "`{}` requires {path}, and no component implements it",
                        self.name(consumer)
                    );
                    let diagnostic = Diagnostic::error("no-provider", name.span, message);
                    self.found
                        .push(diagnostic.label(slot.span, "required here"));
                }
                (Role::Requires, [first, _, ..]) => {
                    let names: Vec<String> = providers
                        .iter()
                        .map(|p| format!("`{}`", self.name(*p)))
                        .collect();
                    let message = format!(
                        "`{}` could be served by {}",
                        self.name(consumer),
                        names.join(", ")
                    );
                    let help = format!(
                        "choose one: `bind {} -> {};`",
                        self.name(consumer),
                        self.name(*first)
                    );
                    self.found.push(
                        Diagnostic::error("several-providers", name.span, message).help(help),
                    );
                }
                (_, []) => {
                    let message = format!(
                        "`{}` subscribes to {path}, and nobody publishes it",
                        self.name(consumer)
                    );
                    self.found.push(
                        Diagnostic::warning("no-publisher", name.span, message)
                            .label(slot.span, "subscribed here"),
                    );
                }
                (_, all) => {
                    for provider in all.iter().copied() {
                        read.insert(provider);
                        if self.agree(name.span, consumer, provider) {
                            self.network
                                .connections
                                .push(Connection { consumer, provider });
                        }
                    }
                }
            }
        }
        for provider in ends {
            if self
                .slot(provider)
                .is_some_and(|s| s.role == Role::Publishes)
                && !read.contains(&provider)
            {
                let message = format!("nobody reads what `{}` publishes", self.name(provider));
                let span = self.deployment.components[provider.instance].name.span;
                self.found
                    .push(Diagnostic::note("no-subscriber", span, message));
            }
        }
    }

    /// Two components that query each other at the same moment time out.
    fn cycles(&mut self) {
        let count = self.deployment.components.len();
        let next: Vec<BTreeSet<usize>> = (0..count)
            .map(|i| self.network.required_by(i, self.components))
            .collect();
        let mut reported = vec![false; count];
        for start in 0..count {
            let mut path = vec![start];
            if let Some(cycle) = circle(&next, &mut path, &mut vec![false; count])
                && !cycle.iter().any(|i| reported[*i])
            {
                cycle.iter().for_each(|i| reported[*i] = true);
                let names: Vec<&str> = cycle
                    .iter()
                    .chain(cycle.first())
                    .map(|i| self.deployment.components[*i].name.text.as_str())
                    .collect();
                let message = format!(
                    "these components require each other: {}; calls that they make at the same moment time out",
                    names.join(" → ")
                );
                let span = self.deployment.components[start].name.span;
                self.found
                    .push(Diagnostic::warning("requires-cycle", span, message));
            }
        }
    }
}

fn circle(
    next: &[BTreeSet<usize>],
    path: &mut Vec<usize>,
    seen: &mut Vec<bool>,
) -> Option<Vec<usize>> {
    let last = *path.last()?;
    for step in &next[last] {
        if *step == path[0] {
            return Some(path.clone());
        }
        if !seen[*step] {
            seen[*step] = true;
            path.push(*step);
            if let Some(found) = circle(next, path, seen) {
                return Some(found);
            }
            path.pop();
        }
    }
    None
}
