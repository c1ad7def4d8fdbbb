//! Sensors that feel contacts.

use crate::error::Error;
use crate::ranges::OwnBodies;
use innermodel::{NodeId, NodeRef, Transform};
use innermodel_collision::Space;

/// The body that touches one of a sensor and does not belong to its robot. `space` has the bodies
/// as they were in the frame.
pub(crate) fn touched(space: &Space, sensor: NodeRef<'_>) -> Result<Option<NodeId>, Error> {
    let own = OwnBodies::of(sensor, space);
    let counts = |_, other| !own.contains(other);
    let touched = space.touching(sensor.node_id(), &Transform::identity(), &counts)?;
    Ok(touched.first().map(|touching| touching.other))
}
