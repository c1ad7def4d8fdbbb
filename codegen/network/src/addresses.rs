//! The addresses of slots, from the connections of a network.

use crate::model::{Addresses, Network};
use rc_cdsl::model::{Role, Slot};
use rc_configuration::Binding;
use rc_ddsl::Endpoint;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_syntax::Name;
use std::collections::{BTreeMap, HashSet};

/// Gives each slot the address of its provider. Topics with a common subscriber share the address
/// of the first of them. `bindings`: for each instance, the addresses in its configuration.
pub(crate) fn addresses(network: &Network, bindings: &[BTreeMap<String, Binding>]) -> Addresses {
    let projects = network.projects.iter();
    let components: Vec<_> = projects
        .map(|project| project.as_ref().map(|project| &project.component))
        .collect();
    let leaders = network.connections.leaders(&components);
    let name = |end: &Endpoint| {
        let instance = &network.deployment.instances[end.instance].path;
        let slot = network.slot(*end).map_or(String::new(), Slot::path);
        format!("{}/{}/{slot}", network.name(), instance.replace('.', "/"))
    };
    let of = leaders.iter().map(|(end, leader)| {
        let outside = network.connections.externals.get(end);
        let bindings = &bindings[end.instance];
        let address = outside.map(|named| external(network, *end, named.as_ref(), bindings));
        (*end, address.unwrap_or_else(|| name(leader)))
    });
    Addresses {
        of: of.collect(),
        leaders,
    }
}

/// Refuses subscribers that would receive topics they are not connected to. A slot has one
/// address in this version, so all subscribers of a shared address receive all its topics.
pub(crate) fn check_topics(network: &Network, found: &mut Diagnostics) {
    let connections = &network.connections.connections;
    let joined: HashSet<(Endpoint, Endpoint)> = connections
        .iter()
        .map(|c| (c.consumer, c.provider))
        .collect();
    let mut topics: BTreeMap<Endpoint, (Vec<Endpoint>, Vec<Endpoint>)> = BTreeMap::new();
    for (end, leader) in &network.addresses.leaders {
        let (subscribers, publishers) = topics.entry(*leader).or_default();
        match network.slot(*end).map(|s| s.role) {
            Some(Role::SubscribesTo) => subscribers.push(*end),
            Some(Role::Publishes) => publishers.push(*end),
            Some(Role::Implements | Role::Requires) | None => {}
        }
    }
    for (subscribers, publishers) in topics.values() {
        let mut pairs = subscribers
            .iter()
            .flat_map(|s| publishers.iter().map(move |p| (*s, *p)));
        // One such pair is enough for an address.
        let Some((subscriber, strange)) = pairs.find(|pair| !joined.contains(pair)) else {
            continue;
        };
        let message = format!(
            "`{}` would hear `{}` as well, to which it is not connected: in this version, publishers that have a subscriber in common share all their subscribers",
            full_name(network, subscriber),
            full_name(network, strange)
        );
        let name = |end: Endpoint| network.deployment.instances[end.instance].name.span;
        let error = Diagnostic::error("mixed-topics", name(subscriber), message)
            .label(name(strange), "the other publisher")
            .help("by `bind`, let no subscriber hear publishers that others must not hear");
        found.push(error);
    }
}

/// Refuses adaptors that serve programs outside at an address that is in use: callers need one server,
/// and converted samples must not come back to what converts them. Publishers share an address if the
/// file gives it to both.
pub(crate) fn check_outside(network: &Network, found: &mut Diagnostics) {
    let externals = &network.connections.externals;
    let slot = |end: &Endpoint| {
        let slot = network.slot(*end)?;
        let project = network.projects[end.instance].as_deref()?;
        Some((
            slot.role,
            project.component.library.interface_path(slot.interface),
        ))
    };
    for (end, named) in externals {
        let Some((role @ (Role::Implements | Role::Publishes), interface)) = slot(end) else {
            continue;
        };
        let address = network.addresses.of(*end);
        let middlewares = network.middlewares(*end);
        let conflicts = |other: &Endpoint| match externals.get(other) {
            None => true,
            Some(theirs) => {
                let shared = role == Role::Publishes && named.is_some() && theirs.is_some();
                other < end && !shared && slot(other).is_some_and(|(own, _)| own == role)
            }
        };
        let mut same = network.addresses.iter().filter(|(other, own)| {
            other != end
                && *own == address
                && slot(other).is_some_and(|(_, own)| own == interface)
                && network
                    .middlewares(*other)
                    .iter()
                    .any(|own| middlewares.contains(own))
        });
        let Some((other, _)) = same.find(|(other, _)| conflicts(other)) else {
            continue;
        };
        let instance = |end: Endpoint| &network.deployment.instances[end.instance];
        let own = instance(*end);
        let span = named
            .as_ref()
            .map_or(own.adaptor.unwrap_or(own.name.span), |name| name.span);
        let message = format!(
            "`{}` would serve programs outside at `{address}`, which is the address of `{}`",
            full_name(network, *end),
            full_name(network, other)
        );
        let error = Diagnostic::error("bad-address", span, message)
            .label(instance(other).name.span, "declared here")
            .help("give it another one: `at \"ADDRESS\"` after the external slot");
        found.push(error);
    }
}

/// The address of an external slot: that of its declaration, else that of the configuration, else
/// the one of components that are started by hand.
fn external(
    network: &Network,
    end: Endpoint,
    named: Option<&Name>,
    bindings: &BTreeMap<String, Binding>,
) -> String {
    let slot = network.slot(end);
    let own = slot.and_then(|slot| bindings.get(&slot.name));
    let given = named.map(|name| &name.text).or(own.map(|own| &own.address));
    given.cloned().unwrap_or_else(|| {
        let project = network.projects[end.instance].as_deref();
        let interface = project.zip(slot).map_or("", |(project, slot)| {
            let library = &project.component.library;
            &library.interface(slot.interface).name.text
        });
        format!("{}/{interface}", network.name())
    })
}

fn full_name(network: &Network, end: Endpoint) -> String {
    let slot = network.slot(end).map_or("", |s| s.name.as_str());
    format!("{}.{slot}", network.deployment.instances[end.instance].path)
}
