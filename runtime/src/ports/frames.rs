//! Where frames are, for slots that convert.

use super::Connections;
use super::endpoints::call_endpoint;
use crate::converting::{
    ConversionCounts, ConvertingClient, ConvertingSubscriber, Fed, Frames, Places, Shared, Source,
    Tf, TfSlot, Tree, history,
};
use crate::slots::OpenSlot;
use rc_conversion::TRANSFORMS;
use rc_management::component::{ClockKind, Role};
use rc_middleware::typed::Operation;
use rc_middleware::{Durability, OpenError, Subscriber};
use rc_vocabulary::WORLD_SLOTS;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// How far ahead of this clock the time of a message for a world may be: clocks of two machines differ
/// a little.
const AHEAD: Duration = Duration::from_secs(1);

impl Connections {
    /// Sets whether the component is not active.
    pub(crate) fn set_idle(&self, is_idle: bool) {
        self.idle.set(is_idle);
    }

    /// The source of transforms for a slot that converts.
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
        let of_tf = |name: &str| {
            let mut slots = self.description.slots.iter();
            let at = slots.position(|own| own.name == name && own.role == Role::SubscribesTo)?;
            Some((at, transforms(self.description.slots[at].operations)?))
        };
        let slots: Option<Vec<(usize, usize)>> = tree.split(',').map(of_tf).collect();
        let mut all = self.description.slots.iter();
        let is_world = all.any(|own| {
            let of = WORLD_SLOTS[0];
            own.name == tree && (own.role, own.type_name) == (of.role, of.type_name)
        });
        let (source, limit) = match slots {
            _ if is_world => (Source::World(Rc::clone(&self.places)), AHEAD),
            Some(slots) => self.received_transforms(&slots)?,
            None => self.asked_tree(tree).map_err(wrong)??,
        };
        let stop = self.stop.clone();
        let clock = (&self.now, stop.filter(|_| self.clock == ClockKind::System));
        Ok(Frames::new(source, limit, clock, &self.idle))
    }

    /// From now on, `places` knows where frames are in the world of the component.
    pub fn know_frames(&self, places: Rc<dyn Places>) {
        *self.places.borrow_mut() = Some(places);
    }

    /// The tree that a required slot asks, and its timeout.
    fn asked_tree(&self, tree: &str) -> Result<Result<(Source, Duration), OpenError>, String> {
        let mut slots = self.description.slots.iter();
        let at = slots.position(|own| own.name == tree && own.role == Role::Requires);
        let at = at.ok_or_else(|| {
            format!("`{tree}` is not a slot that requires a tree, or receives transforms")
        })?;
        let opened = self.slot(at).and_then(|open| {
            let port = self.backend(&open)?.client(&call_endpoint(&open)?)?;
            // The tree may have other units, as for the component itself.
            let port = match self.plan(tree)? {
                Some(plan) => {
                    ConvertingClient::over(&plan, open.slot.operations, &self.conversion(at), port)
                }
                None => port,
            };
            Ok((open, port))
        });
        let (open, port) = match opened {
            Ok(opened) => opened,
            Err(error) => return Ok(Err(error)),
        };
        // A recording of the component has the converted samples, and not these calls.
        let client = self.calling(at, open.qos.timeout, port);
        let known = Tree::new(client, open.slot.operations).ok_or_else(|| {
            format!("`{tree}` is not of `RcInnerModel::InnerModel` as this component knows it")
        })?;
        Ok(Ok((Source::Tree(Box::new(known)), open.qos.timeout)))
    }

    /// The transforms that slots receive with these operations, and the longest wait for one.
    fn received_transforms(
        &self,
        slots: &[(usize, usize)],
    ) -> Result<(Source, Duration), OpenError> {
        let mut limit = Duration::MAX;
        let all = slots.iter().map(|(at, operation)| {
            let open = self.slot(*at)?;
            limit = limit.min(open.qos.timeout);
            let endpoint = self.topic_endpoint(&open, *operation, open.middleware())?;
            let port = self.backend(&open)?.subscriber(&endpoint)?;
            // The event loop counts and reports its conversions.
            let port = match self.plan(&open.name)? {
                Some(plan) => {
                    let address = endpoint.address.to_string();
                    let plan = (&plan, *operation, &open.operations[*operation]);
                    let counts = ConversionCounts::default();
                    let frames = || Err(needs_itself(&open.name));
                    ConvertingSubscriber::over(plan, address, &counts, frames, port)?
                }
                None => port,
            };
            Ok(TfSlot {
                history: self.history(&open),
                port,
                type_hash: TRANSFORMS.1,
            })
        });
        let all = all.collect::<Result<_, OpenError>>()?;
        Ok((Source::Tf(Tf(all)), limit))
    }

    /// The history of a slot. Samples that a publisher keeps for late subscribers hold for all
    /// times, as on `/tf_static`.
    fn history(&self, slot: &OpenSlot) -> Shared {
        let mut all = self.histories.borrow_mut();
        let is_constant = slot.qos.durability == Durability::TransientLocal;
        let own = all.entry(slot.name.to_string());
        Rc::clone(own.or_insert_with(|| history(is_constant)))
    }

    /// A subscriber of an operation of a slot, from whose samples, in the units of this component,
    /// conversions learn where frames are, if they do.
    pub(super) fn fed(
        &self,
        (slot, operation): (&OpenSlot, usize),
        port: Box<dyn Subscriber>,
    ) -> Box<dyn Subscriber> {
        let mut trees = self.conversions.trees.values();
        let is_asked = trees.any(|tree| tree.split(',').any(|name| name == &*slot.name));
        if !is_asked || transforms(slot.operations) != Some(operation) {
            return port;
        }
        Box::new(Fed {
            port,
            history: self.history(slot),
            type_hash: TRANSFORMS.1,
            clock: Arc::clone(&self.now),
        })
    }
}

/// The operation with transforms of tf.
fn transforms(operations: &[Operation]) -> Option<usize> {
    let mut all = operations.iter();
    all.position(|of| (of.name, of.type_hash) == TRANSFORMS)
}

/// The error for a slot of tf whose own conversion changes frames.
fn needs_itself(slot: &str) -> OpenError {
    OpenError::Backend {
        address: slot.to_owned(),
        reason: "it knows where frames are, so its own plan cannot change frames".to_owned(),
    }
}
