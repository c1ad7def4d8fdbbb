//! The last values of the worker, which answer queries of slots with `serve latest` without a handler.

use crate::ages::{FreshCounts, age};
use crate::component::Component;
use crate::context::Core;
use crate::freshness::Moments;
use crate::latest_values::{Answer, Latest, LatestValues};
use crate::slots::OpenSlot;
use rc_middleware::freshness::{Freshness, Made};
use rc_middleware::typed::{HandlerError, Request};
use rc_middleware::{SendError, Writer};
use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

/// The last values of a slot with `serve latest`: a field of the context has one.
#[derive(Debug)]
pub struct LatestSlot {
    slot: usize,
    values: Rc<RefCell<LatestValues>>,
    moments: Moments,
    shared: Arc<crate::status::Shared>,
}

impl LatestSlot {
    /// The values of a slot.
    pub fn new(core: &Core, slot: usize) -> Self {
        Self {
            slot,
            values: Rc::clone(&core.latest),
            moments: core.moments(),
            shared: Arc::clone(&core.shared),
        }
    }

    /// Sets what a query is answered with from now on. `write` writes it. A client in this process
    /// gets a clone.
    ///
    /// # Errors
    /// The value cannot be sent: the last one stays.
    pub fn set<R: Clone + Send + Sync + 'static>(
        &self,
        operation: usize,
        value: R,
        write: fn(&R, &mut Writer<'_>),
    ) -> Result<(), SendError> {
        let mut writer = Writer::default();
        write(&value, &mut writer);
        writer.finish()?;
        let answer: Answer = Rc::new(move |request| request.reply_again(&value, write));
        let made = self.moments.now();
        let values = &mut *self.values.borrow_mut();
        let known = values.counts.iter().find(|(slot, _)| *slot == self.slot);
        let known = known.map(|(_, counts)| counts.clone());
        let counts = known.unwrap_or_else(|| {
            let counts = FreshCounts::new(None);
            values.counts.push((self.slot, counts.clone()));
            self.shared.status().fresh.push((self.slot, counts.clone()));
            counts
        });
        counts.came(made);
        let latest = Latest {
            slot: self.slot,
            operation,
            made,
            is_used: false,
            answer,
        };
        let mut all = values.values.iter_mut();
        match all.find(|of| of.slot == self.slot && of.operation == operation) {
            Some(last) => *last = latest,
            None => values.values.push(latest),
        }
        Ok(())
    }
}

/// Answers a request with the last value of the worker. `None` if it has to be handled: there is no
/// value, or it is too old.
pub(crate) fn answer(
    component: &mut dyn Component,
    slot: &OpenSlot,
    request: &mut Request<'_>,
) -> Option<Result<(), HandlerError>> {
    let longest = slot.qos.latest?;
    let mut operations = slot.operations.iter();
    let operation = operations.position(|of| of.id == request.operation)?;
    let core = component.core();
    let values = Rc::clone(&core.latest);
    let values = &mut *values.borrow_mut();
    let mut all = values.values.iter_mut();
    let latest = all.find(|of| of.slot == slot.described && of.operation == operation)?;
    let now = core.moments().now();
    let (age, is_fresh) = age(latest.made, now, Some(longest));
    // A value of before time was set back would stay until it comes again.
    if !is_fresh || now < latest.made {
        return None;
    }
    let made = if std::mem::replace(&mut latest.is_used, true) {
        Made::Cached
    } else {
        Made::Computed
    };
    let of_slot = values.counts.iter().find(|(at, _)| *at == slot.described);
    if let Some((_, counts)) = of_slot {
        counts.used(Freshness {
            age,
            made,
            is_fresh,
        });
    }
    let answer = &latest.answer;
    let operation = &slot.operations[operation];
    let opened = request.arguments(operation, rc_middleware::typed::read::<()>);
    request.set_age(age);
    Some(opened.and_then(|()| answer(request)))
}
