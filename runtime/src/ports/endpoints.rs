//! Endpoints of slots, and which of them are opened.

use crate::slots::OpenSlot;
use rc_management::component::ClockKind;
use rc_middleware::{Address, Endpoint, ExternalType, Linked, OpenError, TypeIdentity};
use std::collections::BTreeSet;

/// Whether a component opens a middleware in addition to its own one: for its slots, or for its
/// clock. One without slots is a node of its middlewares; a source of time publishes over all of
/// them.
pub(super) fn is_needed(
    linked: &Linked,
    used: &BTreeSet<&str>,
    clock: ClockKind,
    of_time: Option<&str>,
) -> bool {
    let by_clock = match clock {
        ClockKind::System => false,
        ClockKind::Source => true,
        ClockKind::Nodes => linked.clock.is_some(),
        ClockKind::Simulated => of_time == Some(linked.name),
    };
    by_clock || used.is_empty() || used.contains(linked.name)
}

pub(super) fn call_endpoint(slot: &OpenSlot) -> Result<Endpoint, OpenError> {
    let types = TypeIdentity {
        name: slot.type_name.to_owned(),
        hash: slot.type_hash,
    };
    Ok(Endpoint {
        address: slot.address()?.clone(),
        types,
        qos: slot.qos,
        external_types: slot.external_types().collect(),
    })
}

impl OpenSlot {
    pub(super) fn address(&self) -> Result<&Address, OpenError> {
        self.address.as_ref().ok_or_else(|| OpenError::Backend {
            address: self.name.to_string(),
            reason: "it is an array; open its members".to_owned(),
        })
    }

    /// The operations, for a middleware that has types of its own.
    pub(super) fn external_types(&self) -> impl Iterator<Item = ExternalType> {
        let operations = self.operations.iter().zip(self.external_types);
        operations.map(|(operation, type_name)| ExternalType {
            slot: self.path(),
            operation: operation.name.to_owned(),
            id: operation.id,
            type_name: (*type_name).to_owned(),
        })
    }
}
