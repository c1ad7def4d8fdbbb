//! Where frames are, for slots that convert.

use super::Connections;
use super::endpoints::call_endpoint;
use crate::converting::{ConvertingClient, Frames, Tree};
use rc_management::component::{ClockKind, Role};
use rc_middleware::OpenError;

impl Connections {
    /// Sets whether the component is not active.
    pub(crate) fn set_idle(&self, is_idle: bool) {
        self.idle.set(is_idle);
    }

    /// What knows where frames are, for a slot that converts.
    pub(super) fn frames(&self, slot: &str) -> Result<Frames, OpenError> {
        let wrong = |reason: String| OpenError::Backend {
            address: slot.to_owned(),
            reason,
        };
        let tree = self.conversions.trees.get(slot);
        let tree = tree.ok_or_else(|| {
            wrong(format!(
                "its plan changes frames: pass the slot that knows where they are, `--frames {slot}=TREE`"
            ))
        })?;
        let mut slots = self.description.slots.iter();
        let at = slots.position(|own| own.name == tree && own.role == Role::Requires);
        let at = at.ok_or_else(|| wrong(format!("`{tree}` is no slot that requires a tree")))?;
        let open = self.slot(at)?;
        let port = self.backend(&open)?.client(&call_endpoint(&open)?)?;
        // The tree may have other units, as for the component itself.
        let port = match self.conversions.plans.get(tree) {
            Some(plan) => {
                ConvertingClient::over(plan, open.slot.operations, &self.conversion(at), port)
            }
            None => port,
        };
        // A recording of the component has the converted samples, and not these calls.
        let client = self.calling(at, open.qos.timeout, port);
        let known = Tree::new(client, open.slot.operations).ok_or_else(|| {
            wrong(format!(
                "`{tree}` is not of `RcInnerModel::InnerModel` as this component knows it"
            ))
        })?;
        let clock = (&self.now, self.clock == ClockKind::System);
        Ok(Frames::new(known, open.qos.timeout, clock, &self.idle))
    }
}
