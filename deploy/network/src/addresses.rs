//! The addresses of slots, from the connections of a network.

use crate::model::Network;
use rc_cdsl::model::{Role, Slot};
use rc_ddsl::Endpoint;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_syntax::Name;
use std::collections::{BTreeMap, HashSet};

impl Network {
    /// The address of each slot: that of its provider. Topics with a common subscriber share the
    /// address of the first of them.
    pub(crate) fn addresses(&self) -> BTreeMap<Endpoint, String> {
        let name = |end: &Endpoint| {
            let instance = &self.deployment.instances[end.instance].path;
            let slot = self.slot(*end).map_or(String::new(), Slot::path);
            format!("{}/{}/{slot}", self.name(), instance.replace('.', "/"))
        };
        let leaders = self.leaders();
        let addresses = leaders.iter().map(|(end, leader)| {
            let outside = self.connections.externals.get(end);
            let address = outside.map(|named| self.external_address(*end, named.as_ref()));
            (*end, address.unwrap_or_else(|| name(leader)))
        });
        addresses.collect()
    }

    /// The address of an external slot: that of its declaration, else that of the configuration,
    /// else the one of components that are started by hand.
    fn external_address(&self, end: Endpoint, named: Option<&Name>) -> String {
        let slot = self.slot(end).map_or("", |s| s.name.as_str());
        let own = self.bindings[end.instance].get(slot);
        named
            .map(|n| &n.text)
            .or(own.map(|b| &b.address))
            .cloned()
            .unwrap_or_else(|| {
                let component = self.projects[end.instance].as_ref().map(|p| &p.component);
                let interface = component.zip(self.slot(end));
                let interface = interface.map(|(c, s)| c.library.interface(s.interface));
                let interface = interface.map_or("", |i| i.name.text.as_str());
                format!("{}/{interface}", self.name())
            })
    }

    /// For each slot, the slot whose address it has.
    fn leaders(&self) -> BTreeMap<Endpoint, Endpoint> {
        let projects = self.projects.iter();
        let components: Vec<_> = projects
            .map(|project| project.as_ref().map(|project| &project.component))
            .collect();
        self.connections.leaders(&components)
    }

    /// Refuses subscribers that would receive topics they are not connected to. A slot has one
    /// address in this version, so all subscribers of a shared address receive all its topics.
    pub(crate) fn check_topics(&self, found: &mut Diagnostics) {
        let connections = &self.connections.connections;
        let joined: HashSet<(Endpoint, Endpoint)> = connections
            .iter()
            .map(|c| (c.consumer, c.provider))
            .collect();
        let leaders = self.leaders();
        let mut topics: BTreeMap<Endpoint, (Vec<Endpoint>, Vec<Endpoint>)> = BTreeMap::new();
        for (end, leader) in leaders {
            let (subscribers, publishers) = topics.entry(leader).or_default();
            match self.slot(end).map(|s| s.role) {
                Some(Role::SubscribesTo) => subscribers.push(end),
                Some(Role::Publishes) => publishers.push(end),
                _ => {}
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
                self.full_name(subscriber),
                self.full_name(strange)
            );
            let name = |end: Endpoint| self.deployment.instances[end.instance].name.span;
            let error = Diagnostic::error("mixed-topics", name(subscriber), message)
                .label(name(strange), "the other publisher")
                .help("by `bind`, let no subscriber hear publishers that others must not hear");
            found.push(error);
        }
    }

    fn full_name(&self, end: Endpoint) -> String {
        let slot = self.slot(end).map_or("", |s| s.name.as_str());
        format!("{}.{slot}", self.deployment.instances[end.instance].path)
    }
}
