//! Computes the connections of a deployment and checks them.

use crate::check::{describe_cycle, node_index, start_dependencies};
use crate::compatibility::CompatibilityChecker;
use crate::conversion::Conversion;
use crate::endpoint::{Endpoint, slot};
use crate::exports::{Exports, is_provider};
use crate::graph::{cycles, shortest_path, strongly_connected_components};
use crate::members::wrong_member;
use crate::model::{Bind, Deployment, Instance, InstanceOrGroup, SlotPath};
use crate::network::{Connection, ConnectionDiagnostic, Network};
use crate::peers::WithPeers;
use rc_cdsl::Component;
use rc_cdsl::model::{Middleware, Role, Slot};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
use rc_vocabulary::member;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

mod join;
mod languages;
mod missing;
mod transports;
mod trees;

/// Connects all slots: as `bind` declares, otherwise to the only visible provider of the interface.
/// `components` has one entry for each instance, then one for each of [`Deployment::externals`],
/// if any peer is described; `None` if there is no such file, or it has errors.
pub fn connect(
    deployment: &Deployment,
    components: &[Option<&Component>],
) -> (Network, Diagnostics) {
    let mut found = Diagnostics::new();
    let count = deployment.instances.len();
    match WithPeers::new(deployment, components, &mut found) {
        None => connect_all(deployment, &components[..count], count, found),
        Some(all) => {
            let (network, found) = connect_all(&all.deployment, &all.components(), count, found);
            (all.without(network), found)
        }
    }
}

/// Connects the first `count` instances of a network with each other and with the others, which are
/// programs outside.
fn connect_all(
    deployment: &Deployment,
    components: &[Option<&Component>],
    count: usize,
    mut found: Diagnostics,
) -> (Network, Diagnostics) {
    let exports = Exports::new(deployment, components, &mut found);
    let mut connector = Connector {
        deployment,
        components,
        count,
        exports,
        compatibility: CompatibilityChecker::new(deployment, components),
        connections: Vec::new(),
        conversions: BTreeMap::new(),
        trees: Vec::new(),
        transports: BTreeMap::new(),
        bound_by: Vec::new(),
        externals: BTreeMap::new(),
        diagnostics: Vec::new(),
        found,
    };
    let mut bound = connector.connect_proxies();
    connector.connect_binds(&mut bound);
    connector.take_externals(&mut bound);
    connector.connect_implicitly(&bound);
    connector.choose_transports();
    connector.check_conversions();
    connector.check_trees();
    languages::check(deployment, components, &mut connector.found);
    let mut network = connector.network();
    connector.check_requires_cycles(&network);
    connector.check_start_order(&network);
    network.connections.sort();
    network.connections.dedup();
    (network, connector.found)
}

/// The maximum number of names that a message lists.
const MAX_LISTED: usize = 8;

pub(crate) struct Connector<'a> {
    pub(crate) deployment: &'a Deployment,
    pub(crate) components: &'a [Option<&'a Component>],
    /// The number of instances that are not programs outside.
    count: usize,
    pub(crate) exports: Exports<'a>,
    compatibility: CompatibilityChecker<'a>,
    connections: Vec<Connection>,
    conversions: BTreeMap<Connection, Conversion>,
    /// The slots that know where frames are, of connections that need them.
    trees: Vec<(Connection, Vec<Name>)>,
    transports: BTreeMap<Connection, Middleware>,
    /// The explicit connections, each with the location of its consumer.
    pub(crate) bound_by: Vec<(Connection, Span)>,
    externals: BTreeMap<Endpoint, Option<Name>>,
    diagnostics: Vec<ConnectionDiagnostic>,
    found: Diagnostics,
}

/// The providers of one interface.
#[derive(Debug, Default)]
struct Providers {
    /// The providers by the outermost group in which they are visible.
    seen_in: HashMap<Option<usize>, Vec<Endpoint>>,
    /// Any of them.
    any: Option<Endpoint>,
}

impl<'a> Connector<'a> {
    pub(crate) fn slot(&self, end: Endpoint) -> Option<&'a Slot> {
        slot(self.components, end)
    }

    pub(crate) fn instance(&self, end: Endpoint) -> &'a Instance {
        &self.deployment.instances[end.instance]
    }

    /// Reports a diagnostic about a slot or a connection.
    fn report(&mut self, end: Endpoint, other: Option<Endpoint>, diagnostic: Diagnostic) {
        self.diagnostics.push(ConnectionDiagnostic {
            endpoint: end,
            peer: other,
            diagnostic: diagnostic.clone(),
        });
        self.found.push(diagnostic);
    }

    /// The full name of a slot.
    fn name(&self, end: Endpoint) -> String {
        let slot = self.slot(end).map_or("?", |s| s.name.as_str());
        format!("{}.{slot}", self.instance(end).path)
    }

    /// The path of a visible slot in a `bind` next to the instance of `from`.
    fn name_beside(&self, from: Endpoint, end: Endpoint) -> String {
        let own = self.deployment.enclosing(self.instance(from).group);
        let common = own.map(|group| &self.deployment.groups[group].path);
        let name = self.name(end);
        let mut within =
            common.filter_map(|path| name.strip_prefix(path.as_str())?.strip_prefix('.'));
        within.next().map_or_else(|| name.clone(), str::to_owned)
    }

    fn interface(&self, end: Endpoint) -> String {
        let component = self.components.get(end.instance).copied().flatten();
        let path = component
            .zip(self.slot(end))
            .map(|(c, s)| c.library.interface_path(s.interface));
        path.unwrap_or_default()
    }

    /// Resolves a path to a slot. Reports an error if there is none.
    fn find(&mut self, path: &SlotPath) -> Option<Endpoint> {
        let instance = match path.place {
            // `Exports` reports errors of exports.
            InstanceOrGroup::Group(group) => {
                let exported = self.exports.get(group, &path.slot.text);
                let is_member = member::split(&path.slot.text).is_some();
                if exported.is_none() && is_member && self.exports.knows(group, &path.slot.text) {
                    let group = &self.deployment.groups[group].path;
                    let message = format!("group `{group}` has no slot `{}`", path.slot.text);
                    let error = Diagnostic::error("unknown-member", path.slot.span, message);
                    let help = "name a member that `slots { … }` of a component inside lists";
                    self.found.push(error.help(help));
                }
                return exported;
            }
            InstanceOrGroup::Instance(instance) => instance,
        };
        let component = self.components.get(instance).copied().flatten()?;
        let mut slots = component.slots.iter();
        if let Some(slot) = slots.position(|s| s.name == path.slot.text) {
            return Some(Endpoint { instance, slot });
        }
        if let Some(error) = wrong_member(&self.deployment.instances[instance], &path.slot) {
            self.found.push(error);
            return None;
        }
        let name = &self.deployment.instances[instance].path;
        let message = format!("`{name}` has no slot `{}`", path.slot.text);
        let known = component.slots.iter().map(|s| s.name.as_str());
        let error = Diagnostic::error("unknown-slot", path.slot.span, message)
            .label(component.name.span, "its component")
            .suggest(&path.slot.text, known);
        self.found.push(error);
        None
    }

    /// Makes the explicit connections. Adds their consumers to `bound`, including those with
    /// errors.
    fn connect_binds(&mut self, bound: &mut HashMap<Endpoint, Span>) {
        let mut pairs: HashSet<(Endpoint, Endpoint)> = HashSet::new();
        for bind in &self.deployment.binds {
            let consumer = self.find(&bind.consumer);
            let named = bind.provider.as_ref();
            let provider = named.and_then(|path| self.find(path));
            let (Some(consumer), Some(provider), Some(named)) = (consumer, provider, named) else {
                // The consumer counts as bound, although the bind has an error.
                bound.extend(consumer.map(|end| (end, bind.consumer.span)));
                continue;
            };
            let calls = self
                .slot(consumer)
                .is_some_and(|s| s.role == Role::Requires);
            let new = pairs.insert((consumer, provider));
            if let Some(first) = bound.get(&consumer).filter(|_| calls || !new) {
                let name = self.name(consumer);
                let message = if new {
                    format!("required slot `{name}` is bound to a second provider")
                } else {
                    format!("`{name}` is bound twice to `{}`", self.name(provider))
                };
                let error = Diagnostic::error("bound-twice", bind.consumer.span, message);
                let error = error.label(*first, "first bound here");
                self.report(consumer, Some(provider), error);
                continue;
            }
            bound.entry(consumer).or_insert(bind.consumer.span);
            let connection = Connection { consumer, provider };
            self.bound_by.push((connection, bind.consumer.span));
            self.connect_bind((bind, named), consumer, provider);
        }
    }

    /// Takes the slots whose peers are not part of the network, and adds them to `bound`.
    fn take_externals(&mut self, bound: &mut HashMap<Endpoint, Span>) {
        for external in &self.deployment.externals {
            let span = external.slot.span;
            let Some(end) = self.find(&external.slot) else {
                continue;
            };
            let Some(slot) = self.slot(end) else { continue };
            if provider_of(slot.role).is_none() {
                if external.peer.is_some() {
                    // The file that describes its peer has errors, or an editor did not read it.
                    continue;
                }
                if self.instance(end).adaptor.is_some() {
                    self.externals.insert(end, external.address.clone());
                    continue;
                }
                let message = format!(
                    "expected a consumer after `external`, but `{}` {} its interface",
                    self.name(end),
                    slot.role.word()
                );
                let error = Diagnostic::error("wrong-direction", span, message)
                    .label(slot.span, "declared here")
                    .help(
                        "remove it: peers outside the network need no declaration to use this slot over its middleware, unless values are converted for them: `{ cdsl \"FILE\"; convert; }`",
                    );
                self.report(end, None, error);
            } else if let Some(first) = bound.get(&end) {
                let message = format!("`{}` is bound already", self.name(end));
                let error = Diagnostic::error("bound-twice", span, message);
                let error = error.label(*first, "first bound here");
                self.report(end, None, error);
            } else {
                bound.insert(end, span);
                self.externals.insert(end, external.address.clone());
            }
        }
    }

    /// Connects the ends of a bind, if they are a consumer and a provider of one interface. Reports
    /// errors if not.
    fn connect_bind(
        &mut self,
        (bind, named): (&Bind, &SlotPath),
        consumer: Endpoint,
        provider: Endpoint,
    ) {
        let written = (&bind.consumer, named);
        let (Some(one), Some(other)) = (self.slot(consumer), self.slot(provider)) else {
            return;
        };
        let Some(wanted) = provider_of(one.role) else {
            let message = format!(
                "expected a consumer left of `->`, but `{}` {} its interface",
                self.name(consumer),
                one.role.word()
            );
            let error = Diagnostic::error("wrong-direction", written.0.span, message)
                .label(one.span, "declared here")
                .help("write the slot that requires or subscribes left of `->`");
            self.report(consumer, Some(provider), error);
            return;
        };
        if other.role != wanted {
            let message = format!(
                "`{}` needs a slot that {} its interface, but `{}` {} it",
                self.name(consumer),
                wanted.word(),
                self.name(provider),
                other.role.word()
            );
            let error = Diagnostic::error("wrong-direction", written.1.span, message);
            let error = error.label(other.span, "declared here");
            self.report(consumer, Some(provider), error);
            return;
        }
        let (ours, theirs) = (self.interface(consumer), self.interface(provider));
        if ours != theirs {
            let message = format!(
                "`{}` has the interface `{ours}`, but `{}` has `{theirs}`",
                self.name(consumer),
                self.name(provider)
            );
            let span = written.0.span.to(written.1.span);
            let error = Diagnostic::error("different-interfaces", span, message)
                .label(one.span, "consumer")
                .label(other.span, "provider");
            self.report(consumer, Some(provider), error);
            return;
        }
        let convert = (bind.convert, bind.frames.as_slice());
        self.join(written.0.span, convert, consumer, provider);
    }

    /// All slots of all components, as endpoints.
    fn ends(&self) -> Vec<Endpoint> {
        let components = self.components.iter().enumerate();
        components
            .filter_map(|(instance, component)| Some((instance, (*component)?.slots.len())))
            .flat_map(|(instance, count)| (0..count).map(move |slot| Endpoint { instance, slot }))
            .collect()
    }

    /// Connects slots without a bind: clients to the only visible provider, subscribers to every
    /// visible publisher.
    fn connect_implicitly(&mut self, bound: &HashMap<Endpoint, Span>) {
        let mut ends = self.ends();
        ends.retain(|end| !self.is_inside_of_proxy(*end));
        let unknown = ends.iter().copied();
        let unknown: HashSet<_> = unknown.filter(|end| self.is_behind_unknown(*end)).collect();
        let mut providers: HashMap<(Role, String), Providers> = HashMap::new();
        for end in ends.iter().copied() {
            // An adaptor is there for its consumer only.
            let is_seen = self.instance(end).adaptor.is_none();
            if let Some(slot) = self.slot(end).filter(|s| is_seen && is_provider(s.role)) {
                let seen_in = self.exports.reach(self.deployment, end, &slot.name);
                let same = providers
                    .entry((slot.role, self.interface(end)))
                    .or_default();
                same.seen_in.entry(seen_in).or_default().push(end);
                same.any.get_or_insert(end);
            }
        }
        let mut read: HashSet<Endpoint> = self.connections.iter().map(|c| c.provider).collect();
        read.extend(&unknown);
        read.extend(self.externals.keys());
        let open = |end: &Endpoint| !bound.contains_key(end) && !unknown.contains(end);
        for consumer in ends.iter().copied().filter(open) {
            let Some(slot) = self.slot(consumer) else {
                continue;
            };
            let Some(wanted) = provider_of(slot.role) else {
                continue;
            };
            let interface = self.interface(consumer);
            let all = providers.get(&(wanted, interface.clone()));
            let mut seen: Vec<Endpoint> = Vec::new();
            if let Some(all) = all {
                let own = self.deployment.enclosing(self.instance(consumer).group);
                let groups = own.map(Some).chain([None]);
                let visible = groups.filter_map(|g| all.seen_in.get(&g)).flatten();
                seen.extend(visible.filter(|end| !self.is_own_proxy(**end, consumer)));
                seen.sort_unstable();
            }
            let mut others = all.iter().flat_map(|all| all.seen_in.values().flatten());
            if seen.is_empty() && others.any(|end| unknown.contains(end)) {
                continue;
            }
            match (slot.role, seen.as_slice()) {
                (_, []) => {
                    let hidden = all.and_then(|all| all.any);
                    self.report_no_provider(consumer, &interface, hidden);
                }
                (Role::Requires, [_, _, ..]) => self.report_several_providers(consumer, &seen),
                _ => {
                    read.extend(seen.iter().copied());
                    let span = self.instance(consumer).name.span;
                    for provider in seen {
                        self.join(span, (None, &[]), consumer, provider);
                    }
                }
            }
        }
        for end in ends {
            let slot = self.slot(end);
            if slot.is_some_and(|s| s.role == Role::Publishes) && !read.contains(&end) {
                let message = format!("`{}` has no subscriber", self.name(end));
                let span = self.instance(end).name.span;
                self.report(end, None, Diagnostic::note("no-subscriber", span, message));
            }
        }
    }

    /// The name of an instance, the end of the block around it, and the indentation of that block.
    fn block_of(&self, end: Endpoint) -> (Span, Span, String) {
        let instance = self.instance(end);
        let group = instance.group.map(|at| &self.deployment.groups[at]);
        let block = group.map_or(self.deployment.end, |group| group.end);
        let depth = self.deployment.enclosing(instance.group).count();
        (instance.name.span, block, "    ".repeat(depth))
    }

    fn report_several_providers(&mut self, consumer: Endpoint, seen: &[Endpoint]) {
        let listed = seen.iter().take(MAX_LISTED);
        let mut names: Vec<String> = listed.map(|p| format!("`{}`", self.name(*p))).collect();
        if seen.len() > MAX_LISTED {
            names.push(format!("{} more", seen.len() - MAX_LISTED));
        }
        let message = format!(
            "several providers for `{}`: {}",
            self.name(consumer),
            names.join(", ")
        );
        let bind = format!(
            "bind {} -> {};",
            self.name_beside(consumer, consumer),
            self.name_beside(consumer, seen[0])
        );
        let help = format!("choose one{}: `{bind}`", self.in_group(consumer));
        let (span, end, indent) = self.block_of(consumer);
        let error = Diagnostic::error("several-providers", span, message).help(help);
        let error = error.addition(end, format!("    {bind}\n{indent}"));
        self.report(consumer, None, error);
    }

    fn network(&mut self) -> Network {
        let mut required = vec![BTreeSet::new(); self.deployment.instances.len()];
        for Connection { consumer, provider } in &self.connections {
            let calls = self
                .slot(*consumer)
                .is_some_and(|s| s.role == Role::Requires && !s.optional);
            if calls && consumer.instance != provider.instance {
                required[consumer.instance].insert(provider.instance);
            }
        }
        let mut over: BTreeMap<Endpoint, BTreeSet<Middleware>> = BTreeMap::new();
        for (of, middleware) in &self.transports {
            for end in [of.consumer, of.provider] {
                over.entry(end).or_default().insert(*middleware);
            }
        }
        Network {
            connections: std::mem::take(&mut self.connections),
            conversions: std::mem::take(&mut self.conversions),
            transports: std::mem::take(&mut self.transports),
            over,
            externals: std::mem::take(&mut self.externals),
            required,
            diagnostics: std::mem::take(&mut self.diagnostics),
        }
    }

    /// Warns of components that require each other: simultaneous queries time out. A component does
    /// not wait for the queries of an asynchronous slot.
    fn check_requires_cycles(&mut self, network: &Network) {
        // A proxy serves its exports side by side, as if each had a component of its own; in simulated
        // time, one call after the other.
        let mut nodes: Vec<usize> = (0..self.deployment.instances.len()).collect();
        let mut exports: HashMap<(usize, usize), usize> = HashMap::new();
        let mut node = |end: Endpoint| {
            let is_proxy = self.instance(end).proxy.is_some() && self.deployment.time.is_none();
            let component = self.components[end.instance].filter(|_| is_proxy);
            let Some(half) = component.map(|component| component.slots.len() / 2) else {
                return end.instance;
            };
            let export = (end.instance, end.slot % half.max(1));
            *exports.entry(export).or_insert_with(|| {
                nodes.push(end.instance);
                nodes.len() - 1
            })
        };
        let mut calls = Vec::new();
        for Connection { consumer, provider } in &network.connections {
            let is_call = self
                .slot(*consumer)
                .is_some_and(|s| s.role == Role::Requires && !s.asynchronous);
            if is_call && consumer.instance != provider.instance {
                calls.push((node(*consumer), node(*provider)));
            }
        }
        let mut next = vec![BTreeSet::new(); nodes.len()];
        for (from, to) in calls {
            next[from].insert(to);
        }
        let next: Vec<Vec<usize>> = next.into_iter().map(Vec::from_iter).collect();
        for cycle in cycles(&next) {
            let cycle: Vec<usize> = cycle.into_iter().map(|node| nodes[node]).collect();
            let names = cycle.iter().chain(cycle.first());
            let names = names.map(|i| self.deployment.instances[*i].path.as_str());
            let message = format!(
                "cyclic requirements: {}: simultaneous calls time out",
                names.collect::<Vec<_>>().join(" → ")
            );
            let span = self.deployment.instances[cycle[0]].name.span;
            let proxies = cycle.iter();
            let proxies = proxies.filter(|at| self.deployment.instances[**at].proxy.is_some());
            self.found.push(if proxies.collect::<BTreeSet<_>>().len() < 2 {
                Diagnostic::warning("requires-cycle", span, message)
            } else {
                let help = "a proxy waits for each call that it forwards: remove one of the proxies, or export only one direction";
                Diagnostic::error("proxy-cycle", span, message).help(help)
            });
        }
    }
}

impl Connector<'_> {
    /// Reports `after` declarations that contradict the required interfaces. Both determine the
    /// start order.
    fn check_start_order(&mut self, network: &Network) {
        let after = start_dependencies(self.deployment);
        let mut both = after.clone();
        for (instance, required) in network.required.iter().enumerate() {
            both[instance].extend(required);
        }
        let (alone, together) = (
            strongly_connected_components(&after),
            strongly_connected_components(&both),
        );
        let mut reported: HashSet<usize> = HashSet::new();
        for (at, instance) in self.deployment.instances.iter().enumerate() {
            for (place, span) in &instance.after {
                let other = node_index(self.deployment, *place);
                // `check_after_cycles` reports cycles of `after` alone.
                let new = together[at] == together[other] && alone[at] != alone[other];
                if !new || !reported.insert(together[at]) {
                    continue;
                }
                let mut cycle = shortest_path(&both, other, at);
                cycle.rotate_right(1);
                let (message, _) = describe_cycle(self.deployment, &cycle);
                let error = Diagnostic::error("after-cycle", *span, message);
                self.found.push(error.help(
                    "remove this `after`: providers start first, and components that require each other start together",
                ));
            }
        }
    }
}

/// The role of the provider for a consumer of this role. `None` for a provider.
fn provider_of(role: Role) -> Option<Role> {
    match role {
        Role::Requires => Some(Role::Implements),
        Role::SubscribesTo => Some(Role::Publishes),
        Role::Implements | Role::Publishes => None,
    }
}
