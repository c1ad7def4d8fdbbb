//! The counts of ports: messages sent, withheld and converted, queues, mismatches.

use super::Connections;
use crate::ages::FreshCounts;
use crate::converting::ConversionCounts;
use crate::forwarded::ForwardCounts;
use rc_management::component::ClockKind;
use rc_middleware::{Counter, QueueGauge};

impl Connections {
    /// The counters of the sending ends, each with the index of its slot.
    pub(crate) fn sent(&self) -> Vec<(usize, Counter)> {
        self.sent.borrow().clone()
    }

    /// The counters of samples that were not published, each with the index of its slot.
    pub(crate) fn withheld(&self) -> Vec<(usize, Counter)> {
        self.withheld.borrow().clone()
    }

    /// The counts of slots that convert, each with the index of its slot.
    pub(crate) fn converted(&self) -> Vec<(usize, ConversionCounts)> {
        self.converted.borrow().clone()
    }

    /// How old the values of slots are, each with the index of its slot.
    pub(crate) fn fresh(&self) -> Vec<(usize, FreshCounts)> {
        self.fresh.borrow().clone()
    }

    /// The forwarded messages of slots, each with the index of its slot.
    pub(crate) fn forwarded(&self) -> Vec<(usize, ForwardCounts)> {
        self.forwarded.borrow().clone()
    }

    /// Whether time is that of the network, which waits for its components or leaves them behind.
    pub fn is_time_simulated(&self) -> bool {
        self.clock != ClockKind::System
    }

    /// New counts for a slot of a component that forwards what the slot receives.
    pub fn forwards(&self, slot: usize) -> ForwardCounts {
        let counts = ForwardCounts::default();
        self.forwarded.borrow_mut().push((slot, counts.clone()));
        counts
    }

    /// The messages over each middleware of providers, each with the index of its slot.
    pub(crate) fn transports(&self) -> Vec<(usize, &'static str, Counter)> {
        self.transports.borrow().clone()
    }

    /// A new counter for a middleware of a provider.
    pub(super) fn transport(&self, slot: usize, name: &'static str) -> Counter {
        let counter = Counter::default();
        let of = (slot, name, counter.clone());
        self.transports.borrow_mut().push(of);
        counter
    }

    /// New counts for a slot that converts.
    pub(super) fn conversion(&self, slot: usize) -> ConversionCounts {
        let open = self.slots.get(slot);
        let providers = &self.conversions.providers;
        let counts = ConversionCounts::of(open.and_then(|open| providers.get(&*open.name)));
        self.converted.borrow_mut().push((slot, counts.clone()));
        counts
    }

    /// The receive queues, each with the index of its slot.
    pub(crate) fn queues(&self) -> Vec<(usize, QueueGauge)> {
        self.queues.borrow().clone()
    }

    pub(super) fn watch(&self, slot: usize, queue: Option<QueueGauge>) {
        let queue = queue.map(|queue| (slot, queue));
        self.queues.borrow_mut().extend(queue);
    }

    pub(super) fn count(&self, slot: usize, counter: &Counter) {
        self.sent.borrow_mut().push((slot, counter.clone()));
    }

    /// Peers that are there and do not fit.
    pub(crate) fn mismatches(&self) -> Vec<String> {
        let all = self.backends.iter().map(|(_, backend)| backend);
        all.flat_map(|backend| backend.mismatches()).collect()
    }
}
