//! Programs that are not part of a network, but of which the file has a `.cdsl`:
//! `external mapper.lidar at "scan" { cdsl "lidar.cdsl"; convert; };`
//!
//! While the connections are computed, such a program is an instance that no other slot sees, with
//! the one slot that is meant. So it is compared with its peer like any other component.

use crate::endpoint::{Endpoint, slot};
use crate::exports::{Exports, is_provider};
use crate::model::{
    Bind, Convert, Deployment, External, Instance, InstanceOrGroup, Peer, SlotPath,
};
use crate::network::{Connection, Network};
use rc_cdsl::Component;
use rc_cdsl::model::{Role, Slot};
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_syntax::Name;
use std::collections::BTreeMap;

/// The slot of a network that a path names.
pub(crate) fn find(
    exports: &Exports<'_>,
    components: &[Option<&Component>],
    path: &SlotPath,
) -> Option<Endpoint> {
    match path.place {
        InstanceOrGroup::Group(group) => exports.get(group, &path.slot.text),
        InstanceOrGroup::Instance(instance) => {
            let component = components.get(instance).copied().flatten()?;
            let mut slots = component.slots.iter();
            let slot = slots.position(|slot| slot.name == path.slot.text)?;
            Some(Endpoint { instance, slot })
        }
    }
}

/// The role of the peers of a slot.
fn opposite(role: Role) -> Role {
    match role {
        Role::Implements => Role::Requires,
        Role::Requires => Role::Implements,
        Role::Publishes => Role::SubscribesTo,
        Role::SubscribesTo => Role::Publishes,
    }
}

/// The slot of a program outside that is the peer of a slot. Reports a program without one, or
/// with several.
pub(crate) fn peer_slot<'p>(
    peer: &Peer,
    described: &'p Component,
    (component, own): (&Component, &Slot),
    found: &mut Diagnostics,
) -> Option<&'p Slot> {
    let path = component.library.interface_path(own.interface);
    let role = opposite(own.role);
    let mut fitting = described.slots.iter().filter(|slot| {
        slot.role == role && described.library.interface_path(slot.interface) == path
    });
    let (first, second) = (fitting.next(), fitting.next());
    let file = &peer.cdsl.text;
    let wrong = |code, message| {
        let error = Diagnostic::error(code, peer.cdsl.span, message);
        error.label(described.name.span, "its component")
    };
    match (first, second) {
        (Some(slot), None) => Some(slot),
        (None, _) => {
            let message = format!(
                "`{file}` has no slot that {} `{path}`, as the peer of `{}` does",
                role.word(),
                own.name
            );
            found.push(wrong("unknown-slot", message));
            None
        }
        (Some(one), Some(other)) => {
            let message = format!(
                "`{file}` has two slots of which each {} `{path}`: `{}` and `{}`",
                role.word(),
                one.name,
                other.name
            );
            let error = wrong("ambiguous-slot", message);
            found.push(error.help("name a file with one of them"));
            None
        }
    }
}

/// A network with the programs outside as its last instances.
pub(crate) struct WithPeers<'a> {
    pub(crate) deployment: Deployment,
    components: Vec<Option<&'a Component>>,
    /// The components of the programs, each with one slot.
    peers: Vec<Component>,
    /// The number of instances of the network itself.
    count: usize,
    /// The slots of the network that are connected with a program, each with its address.
    slots: BTreeMap<Endpoint, Option<Name>>,
}

impl<'a> WithPeers<'a> {
    /// `components` has one entry for each instance, then one for each external slot. Returns
    /// `None` if the network has no such program.
    pub(crate) fn new(
        deployment: &Deployment,
        components: &[Option<&'a Component>],
        found: &mut Diagnostics,
    ) -> Option<Self> {
        let count = deployment.instances.len();
        let described = components.get(count..).unwrap_or_default();
        if described.iter().all(Option::is_none) {
            return None;
        }
        let exports = Exports::new(deployment, &components[..count], &mut Diagnostics::new());
        let own = |path: &SlotPath| {
            let end = find(&exports, &components[..count], path)?;
            Some((end, components[end.instance]?, slot(components, end)?))
        };
        let mut bound: Vec<Endpoint> = Vec::new();
        let binds = deployment.binds.iter();
        bound.extend(binds.filter_map(|bind| find(&exports, components, &bind.consumer)));
        let mut all = Self {
            deployment: deployment.clone(),
            components: components[..count].to_vec(),
            peers: Vec::new(),
            count,
            slots: BTreeMap::new(),
        };
        let mut left = Vec::new();
        for (at, external) in deployment.externals.iter().enumerate() {
            let known = described.get(at).copied().flatten();
            let peer = external.peer.as_ref().zip(known);
            let Some(((peer, known), (end, component, slot))) = peer.zip(own(&external.slot))
            else {
                left.push(external.clone());
                continue;
            };
            let is_consumer = !is_provider(slot.role);
            if is_consumer && bound.contains(&end) {
                // It is bound to another one, which is reported.
                left.push(external.clone());
                continue;
            }
            let Some(of_peer) = peer_slot(peer, known, (component, slot), found) else {
                continue;
            };
            bound.push(end);
            if is_consumer {
                all.slots.insert(end, external.address.clone());
            } else if let Some(address) = external.address.as_ref()
                && peer.convert.span.is_none()
            {
                let path = &deployment.instances[end.instance].path;
                let message = format!(
                    "without `convert`, programs outside have the address of `{path}.{}` itself, not `{}`",
                    slot.name, address.text
                );
                let error = Diagnostic::error("missing-clause", address.span, message);
                found.push(
                    error.help(
                        "add `convert;`, so that an adaptor serves them here, or remove `at`",
                    ),
                );
            }
            all.add((external, peer), (end, is_consumer), (known, of_peer));
        }
        all.deployment.externals = left;
        Some(all)
    }

    /// Adds a program, and its connection.
    fn add(
        &mut self,
        (external, peer): (&External, &Peer),
        (end, is_consumer): (Endpoint, bool),
        (known, slot): (&Component, &Slot),
    ) {
        let own = &self.deployment.instances[end.instance];
        let name = Name::new(known.name.text.clone(), peer.cdsl.span);
        let path = SlotPath {
            place: InstanceOrGroup::Instance(self.deployment.instances.len()),
            slot: Name::new(slot.name.clone(), external.slot.span),
            span: external.slot.span,
        };
        let instance = Instance {
            path: name.text.clone(),
            name,
            cdsl: Some(peer.cdsl.clone()),
            process: None,
            // No other slot sees it.
            adaptor: Some(peer.cdsl.span),
            ..own.clone()
        };
        let Convert {
            span,
            frames,
            process: _,
        } = peer.convert.clone();
        let (consumer, provider, frames) = if is_consumer {
            (external.slot.clone(), path, frames)
        } else {
            // A program that knows no frames is reported where it would get an adaptor.
            (path, external.slot.clone(), Vec::new())
        };
        self.deployment.binds.push(Bind {
            consumer,
            provider: Some(provider),
            convert: span,
            frames,
            process: None,
        });
        self.deployment.instances.push(instance);
        self.peers.push(Component {
            slots: vec![slot.clone()],
            ..known.clone()
        });
    }

    /// The components of all instances.
    pub(crate) fn components(&self) -> Vec<Option<&Component>> {
        let own = self.components.iter().copied();
        own.chain(self.peers.iter().map(Some)).collect()
    }

    /// The connections of the network itself.
    pub(crate) fn without(self, mut network: Network) -> Network {
        let count = self.count;
        let is_own =
            |made: &Connection| made.consumer.instance < count && made.provider.instance < count;
        network.connections.retain(is_own);
        network.required.truncate(count);
        network.externals.extend(self.slots);
        for found in &mut network.diagnostics {
            let peer = found.peer.take();
            match peer {
                Some(peer) if found.endpoint.instance >= count => found.endpoint = peer,
                other => found.peer = other.filter(|peer| peer.instance < count),
            }
        }
        network
    }
}
