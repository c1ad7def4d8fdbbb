//! Endpoints of connections.

use rc_cdsl::Component;
use rc_cdsl::model::Slot;

/// A slot of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Endpoint {
    /// Index into [`Deployment::instances`](crate::Deployment::instances).
    pub instance: usize,
    /// Index into [`Component::slots`].
    pub slot: usize,
}

/// The slot of an endpoint. `None` if the files of its component have errors.
pub(crate) fn slot<'a>(components: &[Option<&'a Component>], end: Endpoint) -> Option<&'a Slot> {
    let component = components.get(end.instance).copied().flatten()?;
    component.slots.get(end.slot)
}
