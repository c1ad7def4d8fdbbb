//! The slots of a component at which its replica meets the others.

use rc_runtime::Slot;
use rc_runtime::middleware::typed::Operation;
use rc_vocabulary::WORLD_SLOTS;

/// A slot of a world: `number` is that in [`WORLD_SLOTS`], the rest is what only generated code
/// knows. Generated code calls it.
pub const fn slot(
    number: usize,
    name: &'static str,
    type_hash: u64,
    backend: &'static str,
    operations: &'static [Operation],
    external_types: &'static [&'static str],
) -> Slot {
    let of = WORLD_SLOTS[number];
    Slot {
        name,
        role: of.role,
        interface: of.interface,
        type_name: of.type_name,
        type_hash,
        backend,
        qos: of.qos,
        is_array: false,
        operations,
        external_types,
    }
}
