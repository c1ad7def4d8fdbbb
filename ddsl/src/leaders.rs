//! Which slots share an address.

use crate::endpoint::{Endpoint, slot};
use crate::network::{Connection, Network};
use rc_cdsl::Component;
use rc_cdsl::model::{Role, Slot};
use std::collections::BTreeMap;

impl Network {
    /// For each slot of `components`, the slot whose address it has: a consumer has that of its provider,
    /// and topics with a common subscriber have that of the first of them.
    pub fn leaders(&self, components: &[Option<&Component>]) -> BTreeMap<Endpoint, Endpoint> {
        let mut leader: BTreeMap<Endpoint, Endpoint> = BTreeMap::new();
        for (instance, component) in components.iter().enumerate() {
            let slots = component.map_or(0, |component| component.slots.len());
            let ends = (0..slots).map(|slot| Endpoint { instance, slot });
            leader.extend(ends.map(|end| (end, end)));
        }
        for Connection { consumer, provider } in &self.connections {
            let (from, to) = (leader[consumer], leader[provider]);
            // A consumer follows its provider; two groups follow the first provider.
            let role = slot(components, from).map(|slot: &Slot| slot.role);
            let provides = matches!(role, Some(Role::Implements | Role::Publishes));
            let first = if provides && from < to { from } else { to };
            leader
                .values_mut()
                .filter(|l| **l == from || **l == to)
                .for_each(|l| *l = first);
        }
        leader
    }
}
