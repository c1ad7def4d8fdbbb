//! Groups with a proxy: what the proxy forwards, and its connections to the slots inside.
//!
//! The component of a proxy has a slot for each exported one, which outsiders see, and then, in the
//! same order, the opposite slots, which connect to the slots inside.

use crate::connect::Connector;
use crate::endpoint::Endpoint;
use crate::exports::{Exports, is_provider};
use crate::model::Deployment;
use crate::network::Connection;
use rc_cdsl::Component;
use rc_diagnostics::{Diagnostics, Span};
use std::collections::HashMap;

/// The slots of the proxy of a group, each with its name outside: in the order of the exports, all
/// members of an array. The proxies of groups inside must have their components. [`crate::connect`]
/// reports wrong exports.
pub fn proxied(
    deployment: &Deployment,
    components: &[Option<&Component>],
    group: usize,
) -> Vec<(String, Endpoint)> {
    let exports = Exports::new(deployment, components, &mut Diagnostics::new());
    let behind = exports.behind(group);
    behind.map(|(name, end)| (name.to_owned(), end)).collect()
}

impl Connector<'_> {
    /// Whether an endpoint is a slot of a proxy that connects to the inside of its group.
    pub(crate) fn is_inside_of_proxy(&self, end: Endpoint) -> bool {
        let component = self.components.get(end.instance).copied().flatten();
        self.instance(end).proxy.is_some()
            && component.is_some_and(|component| end.slot >= component.slots.len() / 2)
    }

    /// Whether an endpoint is a slot of the proxy of the group of another one, or of a group around
    /// it: who is inside does not take the way around.
    pub(crate) fn is_own_proxy(&self, proxy: Endpoint, inside: Endpoint) -> bool {
        let group = self.instance(proxy).proxy;
        let own = self.instance(inside).group;
        group.is_some() && self.deployment.is_inside(own, group)
    }

    /// Whether a slot is exported by a group whose proxy has no component because of an error, so that its
    /// peers are unknown.
    pub(crate) fn is_behind_unknown(&self, end: Endpoint) -> bool {
        let Some(slot) = self.slot(end) else {
            return false;
        };
        let mut groups = self.deployment.enclosing(self.instance(end).group);
        groups.any(|group| {
            let has_proxy = self.deployment.groups[group].proxy.is_some();
            has_proxy && self.exports.is_unknown(group, &slot.name)
        })
    }

    /// Connects the proxies to the slots behind them. Returns the consumers of these connections.
    pub(crate) fn connect_proxies(&mut self) -> HashMap<Endpoint, Span> {
        let mut bound = HashMap::new();
        for (instance, at) in self.deployment.instances.iter().zip(0..) {
            let Some(group) = instance.proxy else {
                continue;
            };
            let count = self.components[at].map_or(0, |component| component.slots.len()) / 2;
            let behind: Vec<Endpoint> = self.exports.behind(group).map(|(_, end)| end).collect();
            for (slot, end) in (count..).zip(behind).take(count) {
                let own = Endpoint { instance: at, slot };
                let provides = self.slot(end).is_some_and(|slot| is_provider(slot.role));
                let (consumer, provider) = if provides { (own, end) } else { (end, own) };
                let span = self.deployment.groups[group].proxy.as_ref();
                let span = span.map_or(instance.name.span, |proxy| proxy.span);
                bound.insert(consumer, span);
                self.bound_by
                    .push((Connection { consumer, provider }, span));
                self.join(span, (None, &[]), consumer, provider);
            }
        }
        bound
    }
}
