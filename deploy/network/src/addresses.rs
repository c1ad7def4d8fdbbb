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
