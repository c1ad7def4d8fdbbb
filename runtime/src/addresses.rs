//! The addresses of slots.

use crate::description::Slot;
use rc_middleware::{Address, OpenError};
use std::collections::BTreeMap;

/// The address of a slot: that of `bindings`, else `NETWORK/Interface`.
pub(crate) fn address(
    network: &str,
    slot: &Slot,
    bindings: &BTreeMap<String, Address>,
) -> Result<Address, OpenError> {
    if let Some(address) = bindings.get(slot.name) {
        return Ok(address.clone());
    }
    let text = format!("{network}/{}", slot.interface);
    Address::parse(&text).map_err(|reason| OpenError::Backend {
        address: text,
        reason,
    })
}
