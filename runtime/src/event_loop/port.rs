//! The receiving ends that the loop serves.

use super::report::{LogLimit, NotHandled};
use crate::clock::Time;
use crate::collect::Collected;
use crate::component::{Body, Component, Sample};
use crate::freshness::Limits;
use crate::latest;
use crate::lifecycle::LifecycleState;
use crate::ports::Receiver;
use crate::slots::OpenSlot;
use crate::status::Shared;
use crate::stored_sample::StoredSample;
use rc_middleware::qos::Stale;
use rc_middleware::typed::{HandlerError, Request};
use rc_middleware::{Gaps, Header, Message, Reply, Spin};
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// This many samples after one wake-up are a burst.
const BURST: u32 = 2;
/// After the last message of a burst, the loop looks so long for another one before it clears the
/// wake-ups. A wake-up that is cleared costs the sender a kernel call at its next message: a fast
/// publisher would pay it for every second sample. Clients wait for replies, so that servers have
/// no such bursts.
const BURST_WAIT: Duration = Duration::from_micros(5);

/// A receiving end with the state that the loop keeps for it.
pub(super) struct Port {
    /// The number of its slot.
    pub(super) slot: usize,
    pub(super) of: Arc<OpenSlot>,
    pub(super) receiver: Receiver,
    pub(super) ready: bool,
    pub(super) gaps: Gaps,
    /// Whether the component takes no more requests for now.
    pub(super) is_full: bool,
    /// Consecutive messages that could not be read.
    pub(super) failures: usize,
    /// Whether the descriptor was readable, so that there is a wake-up to clear.
    pub(super) woken: bool,
    /// Whether the wake-ups were cleared since the port became ready.
    pub(super) acknowledged: bool,
    /// Whether nothing has woken the port: without a message, there is nothing to clear.
    pub(super) is_look: bool,
    /// Messages since the port became ready.
    pub(super) burst: u32,
    /// Until when the loop waits for the next message of a burst.
    pub(super) burst_until: Option<Instant>,
    /// Until when the loop looks at the port again and again, without sleeping.
    pub(super) spin_until: Option<Instant>,
    /// How long it polls after a message.
    pub(super) spin: Spin,
    logged: LogLimit,
    /// The longest time between two samples of a topic.
    pub(super) deadline: Option<Duration>,
    /// When the last sample came, or the first publisher, as a `stamp`.
    pub(super) last_sample: Option<Time>,
}

impl Port {
    /// The first turn serves messages that have arrived before.
    pub(super) fn new(slot: usize, of: Arc<OpenSlot>, receiver: Receiver) -> Self {
        let spin = Spin::new(of.qos.spin);
        Self {
            slot,
            of,
            deadline: match receiver {
                Receiver::Subscriber { deadline, .. } => deadline,
                Receiver::Server { .. } => None,
            },
            receiver,
            ready: true,
            gaps: Gaps::default(),
            is_full: false,
            failures: 0,
            woken: false,
            acknowledged: false,
            is_look: false,
            burst: 0,
            burst_until: None,
            spin_until: None,
            spin,
            logged: LogLimit::default(),
            last_sample: None,
        }
    }

    /// Makes the loop look at the port. `woken` says whether the descriptor is readable.
    pub(super) fn wake(&mut self, woken: bool) {
        self.ready = true;
        self.woken = woken;
        self.acknowledged = false;
        self.is_look = false;
        self.burst = 0;
        self.burst_until = None;
    }

    /// Makes the loop look for messages without a wake-up. If there is none, no wake-up is cleared.
    pub(super) fn look(&mut self) {
        self.wake(false);
        self.is_look = true;
    }

    /// Whether the handler of a subscriber's samples may keep them.
    pub(super) fn keeps(&self, component: &dyn Component) -> bool {
        match &self.receiver {
            Receiver::Subscriber { operation, .. } => {
                component.keeps(self.of.described, *operation)
            }
            Receiver::Server { .. } => false,
        }
    }

    /// Asks the component whether it takes one more request.
    pub(super) fn find_room(&mut self, component: &dyn Component) {
        let (described, member) = (self.of.described, self.of.member.as_ref());
        self.is_full = matches!(self.receiver, Receiver::Server { .. })
            && !component.has_room(described, member);
    }

    /// A message was taken and handled at `now`.
    pub(super) fn received(&mut self, now: Instant) {
        self.failures = 0;
        self.is_look = false;
        self.burst = self.burst.saturating_add(1);
        let is_burst = self.burst >= BURST && matches!(self.receiver, Receiver::Subscriber { .. });
        self.burst_until = is_burst.then(|| now + BURST_WAIT);
    }

    /// Whether there may be a message that may be handled now. `gated`: samples wait for this
    /// component's turn of a tick, and only calls are served.
    pub(super) fn may_be_served(&self, gated: bool) -> bool {
        self.ready
            && !self.is_full
            && !(gated && matches!(self.receiver, Receiver::Subscriber { .. }))
    }

    /// Leaves its messages until this component's turn, which looks at all ports, or until there is
    /// room, and lets the loop sleep.
    pub(super) fn postpone(&mut self) {
        self.receiver.acknowledge(self.woken);
        self.wake(false);
    }

    /// The port has no message. After its wake-ups are cleared, the loop looks once more for a
    /// message that came before; a later message wakes the loop.
    pub(super) fn rest(&mut self, now: Instant) {
        if self.spin_until.is_some_and(|until| now < until) {
            // The wake-up stays set, so that senders need not set it again.
            self.spin.looked(now);
            self.ready = false;
        } else if self.spin_until.take().is_some() {
            self.spin.in_vain();
            self.wake(false);
        } else if self.burst_until.is_some_and(|until| now < until) {
            // The wake-up stays set, and the loop looks again.
        } else if self.acknowledged || self.is_look {
            self.ready = false;
        } else {
            self.receiver.acknowledge(self.woken);
            self.acknowledged = true;
        }
    }

    /// Sets the last error. Logs it at most once in `LOG_PAUSE`.
    pub(super) fn log_failure(&mut self, shared: &Shared, now: Instant, message: &str) {
        shared.status().last_error = Some(message.to_owned());
        self.warn(now, message);
    }

    /// Logs that the state of the component refuses a request, at most once in `LOG_PAUSE`. This is
    /// not an error of the component.
    pub(super) fn log_refusal(&mut self, shared: &Shared, now: Instant, reason: &str) {
        let count = shared.status().slots[self.slot].refused;
        let message = format!("a request is refused, number {count}: {reason}");
        self.warn(now, &message);
    }

    fn warn(&mut self, now: Instant, message: &str) {
        if self.logged.allows(now) {
            tracing::warn!("slot {}: {message}", self.of.name);
        }
    }
}

/// Lets the worker handle a sample, if it has the type of the topic.
pub(crate) fn receive(
    component: &mut dyn Component,
    slot: &OpenSlot,
    operation: usize,
    header: Header,
    body: Body<'_>,
) -> Result<(), HandlerError> {
    let expected = slot.operations[operation].type_hash;
    if header.type_hash != 0 && header.type_hash != expected {
        return Err(HandlerError("it is of another type".to_owned()));
    }
    let collects = component.collects();
    let is_kept = slot.qos.fresh.is_some() || !collects.is_empty();
    if is_kept && slot.member.is_none() {
        return keep(component, slot, operation, header, body);
    }
    let sample = Sample {
        encoding: header.encoding,
        sent: header.sent,
        body,
    };
    component.receive(slot.described, slot.member.as_ref(), operation, sample)
}

/// [`receive`] for a sample that may be collected with others, or asked for later.
fn keep(
    component: &mut dyn Component,
    slot: &OpenSlot,
    operation: usize,
    header: Header,
    body: Body<'_>,
) -> Result<(), HandlerError> {
    let (topic, qos) = ((slot.described, operation), &slot.qos);
    let all = component.collects();
    let collects = |topic| all.iter().any(|collect| collect.topics.contains(&topic));
    // A slot whose topics are all collected has no handlers of its own.
    let has_handlers = !(0..slot.operations.len()).all(|at| collects((slot.described, at)));
    if qos.fresh.is_none() && !collects(topic) {
        let sample = Sample {
            encoding: header.encoding,
            sent: header.sent,
            body,
        };
        return component.receive(slot.described, None, operation, sample);
    }
    let moments = component.core().moments();
    let (made, now) = (moments.of(&header), moments.now());
    let limits = Limits {
        topic,
        fresh: qos.fresh,
        stale: qos.stale,
    };
    let core = component.core();
    let inputs = Rc::clone(&core.inputs);
    let arrival = inputs
        .borrow_mut()
        .arrive(limits, (made, now), header.encoding, &body);
    if let Some(counts) = arrival.new {
        core.shared.status().fresh.push((slot.described, counts));
    }
    if !arrival.is_handled {
        return Ok(());
    }
    let mut matched = Vec::new();
    for (number, collect) in all.iter().enumerate() {
        let Some(place) = collect.topics.iter().position(|of| *of == topic) else {
            continue;
        };
        let sample = Collected {
            at: made,
            limit: qos.fresh,
            refuses: qos.stale == Stale::Refuse,
            freshness: arrival.freshness,
            sample: StoredSample::of(header.encoding, &body, None),
        };
        let mut inputs = inputs.borrow_mut();
        let found = inputs.collect(all, (number, place), qos.depth, (sample, now));
        matched.extend(found.map(|samples| (number, samples)));
    }
    let mut result = Ok(());
    if has_handlers {
        inputs.borrow_mut().handled(topic, arrival.freshness);
        let sample = Sample {
            encoding: header.encoding,
            sent: header.sent,
            body,
        };
        result = component.receive(slot.described, None, operation, sample);
    }
    for (number, samples) in matched {
        for (topic, sample) in all[number].topics.iter().zip(&samples) {
            inputs.borrow_mut().handled(*topic, sample.freshness);
        }
        result = result.and(component.collected(number, &samples));
    }
    result
}

/// Reads the envelope of a request, lets the worker answer and sends the reply. A request without
/// an envelope gets no reply. In a state that does not serve the slot, no handler runs.
pub(crate) fn answer(
    component: &mut dyn Component,
    slot: &OpenSlot,
    idle: Option<LifecycleState>,
    header: Header,
    message: &Message<'_>,
    reply: &mut dyn Reply,
) -> Result<(), NotHandled> {
    let mut request = Request::open_message(header, message, reply).map_err(HandlerError::from)?;
    let idle = idle.map(|state| state.word().to_owned());
    let state = idle.or_else(|| component.unavailable(slot.described));
    let refusal = state.and_then(|state| {
        let known = slot.operations.iter().find(|o| o.id == request.operation)?;
        Some(request.unavailable(known, &state))
    });
    let result = match refusal {
        Some(reason) => Err(NotHandled::Refused(reason)),
        None => latest::answer(component, slot, &mut request)
            .unwrap_or_else(|| component.serve(slot.described, slot.member.as_ref(), &mut request))
            .map_err(Into::into),
    };
    request.close();
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::slots::{Listed, SlotTable};
    use crate::tool_requests::tests::DESCRIPTION;
    use rc_middleware::{ReceiveError, Subscriber};
    use rustix::fd::{AsFd, BorrowedFd};
    use std::fs::File;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A subscriber without samples, which counts how often its wake-ups are cleared.
    struct Silent(File, Arc<AtomicUsize>);

    impl Subscriber for Silent {
        fn descriptor(&self) -> BorrowedFd<'_> {
            self.0.as_fd()
        }

        fn acknowledge(&mut self, _woken: bool) {
            self.1.fetch_add(1, Ordering::Relaxed);
        }

        fn receive(&mut self, _: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
            Ok(false)
        }

        fn peers(&self) -> usize {
            0
        }
    }

    #[test]
    fn a_receive_without_a_message_keeps_the_notification() {
        let cleared = Arc::new(AtomicUsize::new(0));
        let silent = Silent(
            File::open("/dev/null").expect("a descriptor"),
            cleared.clone(),
        );
        let receiver = Receiver::Subscriber {
            port: Box::new(silent),
            operation: 0,
            deadline: None,
        };
        let slots = SlotTable::replayed(&DESCRIPTION, ("n", "c"), Listed::new());
        let mut port = Port::new(0, slots.get(0).expect("a slot"), receiver);
        let now = Instant::now();
        let rests = |port: &mut Port, at: Instant| {
            let mut rests = 0;
            while port.ready && rests < 10 {
                port.rest(at);
                rests += 1;
            }
            (rests, cleared.swap(0, Ordering::Relaxed))
        };
        // After a wake-up, the loop looks once more when it is cleared.
        port.wake(true);
        assert_eq!(rests(&mut port, now), (2, 1));
        port.look();
        assert_eq!(rests(&mut port, now), (1, 0));
        // A message without a wake-up so far: its wake-up may be set now.
        port.look();
        port.received(now);
        assert_eq!(rests(&mut port, now), (2, 1));
        // A burst: the wake-up stays for a while, and the loop looks on.
        port.wake(true);
        port.received(now);
        port.received(now);
        assert_eq!(rests(&mut port, now), (10, 0));
        assert_eq!(rests(&mut port, now + BURST_WAIT), (2, 1));
        // The next wake-up starts again.
        port.wake(true);
        port.received(now);
        assert_eq!(rests(&mut port, now), (2, 1));
    }
}
