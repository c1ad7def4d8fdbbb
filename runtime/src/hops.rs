//! Notes of messages on chains: the inputs, the outputs that they caused, and the times.
//!
//! The supervisor says what to follow, and takes the notes over management. Until then, a message
//! costs one load of a number that never changes. A note costs no call of the kernel.

use crate::slots::OpenSlot;
use rc_management::hops::{Hop, Kind, RING, Way, short};
use rc_middleware::{Header, Reader, RequestBody, now, rpc};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Represents all operations of a slot with one sender: a client has one queue.
pub(crate) const ALL_OPERATIONS: usize = usize::MAX;

/// The state shared by the worker's thread and management.
#[derive(Debug, Default)]
pub(crate) struct SharedHops {
    /// Counts the requests to follow; 0 while nothing is followed.
    generation: AtomicU64,
    state: Mutex<State>,
    /// The senders of each sending end, by slot and operation.
    senders: Mutex<Vec<(usize, usize, Vec<u32>)>>,
}

#[derive(Debug, Default)]
struct State {
    /// Counts on while nothing is followed.
    generation: u64,
    pairs: Arc<[FollowedPair]>,
    ring: VecDeque<Hop>,
    overwritten: u64,
}

/// A pair whose slots are found.
#[derive(Clone, Debug)]
pub(crate) struct FollowedPair {
    pub(crate) input: Option<FollowedEnd>,
    pub(crate) output: Option<FollowedEnd>,
    pub(crate) way: Way,
}

/// An operation of a slot, or of all members of an array.
#[derive(Clone, Debug)]
pub(crate) struct FollowedEnd {
    /// The numbers of the slot or the members.
    pub(crate) slots: Vec<usize>,
    pub(crate) operation: usize,
    /// The discriminator in the envelopes of calls.
    pub(crate) id: i32,
}

impl FollowedEnd {
    fn is(&self, slot: usize, operation: usize) -> bool {
        self.operation == operation && self.slots.contains(&slot)
    }
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SharedHops {
    /// Follows these pairs from now on, in place of others. Returns the senders of each output.
    pub(crate) fn follow(&self, pairs: Vec<FollowedPair>) -> Vec<Vec<u32>> {
        let senders = pairs.iter().map(|pair| self.senders_of(pair)).collect();
        let mut state = locked(&self.state);
        state.generation += 1;
        let generation = if pairs.is_empty() {
            0
        } else {
            state.generation
        };
        state.ring = VecDeque::with_capacity(RING * pairs.len());
        state.overwritten = 0;
        state.pairs = pairs.into();
        // The lock orders it; the worker's thread takes the pairs under the lock, too.
        self.generation.store(generation, Ordering::Relaxed);
        senders
    }

    fn senders_of(&self, pair: &FollowedPair) -> Vec<u32> {
        let senders = locked(&self.senders);
        let of_output = senders.iter().filter(|(slot, operation, _)| {
            let mut output = pair.output.iter();
            output.any(|end| {
                end.slots.contains(slot) && [end.operation, ALL_OPERATIONS].contains(operation)
            })
        });
        of_output.flat_map(|(.., all)| all).copied().collect()
    }

    /// Takes the hops that wait, and how many had no room.
    pub(crate) fn take(&self) -> (VecDeque<Hop>, u64) {
        let mut state = locked(&self.state);
        let empty = VecDeque::with_capacity(RING * state.pairs.len());
        let overwritten = std::mem::take(&mut state.overwritten);
        (std::mem::replace(&mut state.ring, empty), overwritten)
    }

    /// Adds a hop that the worker's thread has noted for this generation.
    fn push(&self, generation: u64, hop: Hop) {
        let mut state = locked(&self.state);
        if state.generation != generation {
            return;
        }
        if state.ring.len() >= RING * state.pairs.len() {
            state.ring.pop_front();
            state.overwritten += 1;
        }
        state.ring.push_back(hop);
    }
}

/// The notes of the worker's thread.
pub(crate) struct HopNotes {
    shared: Arc<SharedHops>,
    /// The number of `local`.
    generation: Cell<u64>,
    local: RefCell<Local>,
    clock: fn() -> u64,
}

#[derive(Default)]
struct Local {
    pairs: Arc<[FollowedPair]>,
    /// For each pair, the last message of each slot.
    last: Vec<Vec<Input>>,
    /// The message whose handler runs, if it is followed.
    current: Option<(usize, usize)>,
    /// When the handler or the `compute()` began that runs now; 0 if none does.
    begun: u64,
}

/// An input.
#[derive(Clone, Copy)]
struct Input {
    slot: usize,
    sender: u32,
    number: u32,
    sent: u64,
    begun: u64,
    is_used: bool,
    /// Whether a hop says that it waits.
    is_kept: bool,
}

impl Input {
    fn hop(&self, pair: usize, kind: Kind, left: u64) -> Hop {
        Hop {
            sender: self.sender,
            pair: pair as u16,
            kind,
            input: self.number,
            output: 0,
            sent: self.sent,
            begun: self.begun,
            used: self.begun,
            left,
        }
    }
}

impl HopNotes {
    pub(crate) fn new(shared: Arc<SharedHops>) -> Self {
        Self {
            shared,
            generation: Cell::new(0),
            local: RefCell::default(),
            clock: now,
        }
    }

    /// Notes the senders of a sending end that was opened, as subscribers or servers see them.
    pub(crate) fn opened(&self, slot: usize, operation: usize, senders: &[u128]) {
        let senders = senders.iter().map(|sender| short(*sender)).collect();
        locked(&self.shared.senders).push((slot, operation, senders));
    }

    /// Whether messages are followed.
    pub(crate) fn is_on(&self) -> bool {
        let generation = self.shared.generation.load(Ordering::Relaxed);
        if generation == 0 {
            return false;
        }
        if generation != self.generation.get() {
            self.reset();
        }
        true
    }

    /// Takes over the pairs to follow now.
    #[cold]
    fn reset(&self) {
        let state = locked(&self.shared.state);
        self.generation.set(state.generation);
        let pairs = Arc::clone(&state.pairs);
        // The present function began before.
        *self.local.borrow_mut() = Local {
            last: vec![Vec::new(); pairs.len()],
            pairs,
            ..Local::default()
        };
    }

    fn push(&self, hop: Hop) {
        self.shared.push(self.generation.get(), hop);
    }

    /// The handler of a sample begins.
    pub(crate) fn sample(&self, slot: usize, operation: usize, header: &Header) {
        if self.is_on() {
            let sender = short(header.sender);
            self.begins((slot, operation), sender, header.sequence, header.sent);
        }
    }

    /// The handler of a request begins.
    pub(crate) fn request(&self, slot: usize, of: &OpenSlot, header: &Header, body: &[u8]) {
        if !self.is_on() {
            return;
        }
        let Ok((id, operation)) = rpc::open_request(&mut Reader::new(body)) else {
            return;
        };
        let operation = of.operations.iter().position(|o| o.id == operation);
        if let Some(operation) = operation {
            let sender = short(u128::from_be_bytes(id.writer));
            self.begins((slot, operation), sender, id.sequence, header.sent);
        }
    }

    fn begins(&self, (slot, operation): (usize, usize), sender: u32, number: u64, sent: u64) {
        let local = &mut *self.local.borrow_mut();
        let mut input = None;
        for (at, pair) in local.pairs.iter().enumerate() {
            if !pair
                .input
                .as_ref()
                .is_some_and(|end| end.is(slot, operation))
            {
                continue;
            }
            let input = *input.get_or_insert_with(|| Input {
                slot,
                sender,
                number: number as u32,
                sent,
                begun: (self.clock)(),
                is_used: false,
                is_kept: false,
            });
            match local.last[at].iter_mut().find(|last| last.slot == slot) {
                Some(last) => {
                    if !last.is_used {
                        self.push(last.hop(at, Kind::Replaced, input.begun));
                    }
                    *last = input;
                }
                None => local.last[at].push(input),
            }
        }
        if let Some(input) = input {
            local.current = Some((slot, operation));
            local.begun = input.begun;
        }
    }

    /// The handler of a message has ended.
    pub(crate) fn handled(&self) {
        if self.shared.generation.load(Ordering::Relaxed) == 0 {
            return;
        }
        let local = &mut *self.local.borrow_mut();
        local.begun = 0;
        let Some((slot, operation)) = local.current.take() else {
            return;
        };
        let mut left = None;
        for (at, pair) in local.pairs.iter().enumerate() {
            let is_input = pair
                .input
                .as_ref()
                .is_some_and(|end| end.is(slot, operation));
            let ends_here = pair.output.is_none() || pair.way == Way::Handler;
            if !is_input || !ends_here {
                continue;
            }
            let unused = |last: &&mut Input| last.slot == slot && !last.is_used;
            if let Some(last) = local.last[at].iter_mut().find(unused) {
                last.is_used = true;
                let left = *left.get_or_insert_with(self.clock);
                self.push(last.hop(at, Kind::Ended, left));
            }
        }
    }

    /// A sample was sent.
    pub(crate) fn published(&self, slot: usize, operation: usize, header: &Header) {
        if self.is_on() {
            let is_output = |end: &FollowedEnd| end.is(slot, operation);
            self.sends(is_output, header.sequence, header.sent);
        }
    }

    /// A request was sent. `number`: that by which its server sees it, if its envelope has another one.
    pub(crate) fn called(
        &self,
        slot: usize,
        header: &Header,
        request: &dyn RequestBody,
        number: impl FnOnce() -> Option<u64>,
    ) {
        if !self.is_on() {
            return;
        }
        if let Ok((id, operation)) = rpc::open_request(&mut Reader::new(request.begin())) {
            let is_output = |end: &FollowedEnd| end.id == operation && end.slots.contains(&slot);
            let number = number().unwrap_or(id.sequence);
            self.sends(is_output, number, header.sent);
        }
    }

    fn sends(&self, is_output: impl Fn(&FollowedEnd) -> bool, number: u64, left: u64) {
        let local = &mut *self.local.borrow_mut();
        for (at, pair) in local.pairs.iter().enumerate() {
            if !pair.output.as_ref().is_some_and(&is_output) {
                continue;
            }
            let Some(end) = &pair.input else {
                self.push(Hop {
                    sender: 0,
                    pair: at as u16,
                    kind: Kind::Sent,
                    input: 0,
                    output: number as u32,
                    sent: 0,
                    begun: left,
                    used: left,
                    left,
                });
                continue;
            };
            for last in &mut local.last[at] {
                let in_handler = local
                    .current
                    .is_some_and(|(slot, operation)| slot == last.slot && end.is(slot, operation));
                let follows = in_handler
                    || match pair.way {
                        Way::Handler => false,
                        Way::Compute => local.current.is_none(),
                        Way::Any => true,
                    };
                if !follows {
                    continue;
                }
                let used = match local.begun {
                    _ if in_handler => last.begun,
                    0 => left,
                    begun => begun,
                };
                last.is_used = true;
                self.push(Hop {
                    output: number as u32,
                    used: used.clamp(last.begun, left.max(last.begun)),
                    ..last.hop(at, Kind::Sent, left)
                });
            }
        }
    }

    /// A function of the worker begins that is not a handler of a message.
    pub(crate) fn begin(&self) {
        if self.is_on() {
            self.local.borrow_mut().begun = (self.clock)();
        }
    }

    /// The function has ended. `is_compute`: inputs that it has not used wait for the next one.
    pub(crate) fn end(&self, is_compute: bool) {
        if self.shared.generation.load(Ordering::Relaxed) == 0 {
            return;
        }
        let local = &mut *self.local.borrow_mut();
        local.begun = 0;
        if !is_compute {
            return;
        }
        let mut left = None;
        for (at, last) in local.last.iter_mut().enumerate() {
            for input in last
                .iter_mut()
                .filter(|input| !input.is_used && !input.is_kept)
            {
                input.is_kept = true;
                let left = *left.get_or_insert_with(self.clock);
                self.push(input.hop(at, Kind::Kept, left));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    thread_local! {
        static TIME: Cell<u64> = const { Cell::new(0) };
    }

    fn notes(pairs: Vec<FollowedPair>) -> (HopNotes, Vec<Vec<u32>>) {
        let notes = HopNotes {
            clock: || TIME.get(),
            ..HopNotes::new(Arc::default())
        };
        notes.opened(3, 0, &[77]);
        notes.opened(4, ALL_OPERATIONS, &[78]);
        let senders = notes.shared.follow(pairs);
        (notes, senders)
    }

    fn end(slot: usize) -> FollowedEnd {
        FollowedEnd {
            slots: vec![slot],
            operation: 0,
            id: 5,
        }
    }

    fn pair(way: Way) -> FollowedPair {
        FollowedPair {
            input: Some(end(1)),
            output: Some(end(3)),
            way,
        }
    }

    fn header(sequence: u64, sent: u64) -> Header {
        Header {
            sequence,
            sent,
            sender: 7,
            ..Header::default()
        }
    }

    /// Kind, input, output and times of a note.
    fn taken(notes: &HopNotes) -> Vec<(Kind, u32, u32, [u64; 4])> {
        let (hops, overwritten) = notes.shared.take();
        assert_eq!(overwritten, 0);
        let hops = hops.iter();
        hops.map(|hop| {
            let times = [hop.sent, hop.begun, hop.used, hop.left];
            (hop.kind, hop.input, hop.output, times)
        })
        .collect()
    }

    #[test]
    fn a_handler_that_sends_is_one_hop_with_its_four_times() {
        let (notes, senders) = notes(vec![pair(Way::Handler)]);
        assert_eq!(senders, [vec![short(77)]]);
        TIME.set(20);
        notes.sample(1, 0, &header(4, 10));
        TIME.set(25);
        notes.published(3, 0, &header(9, 25));
        notes.handled();
        assert_eq!(taken(&notes), [(Kind::Sent, 4, 9, [10, 20, 20, 25])]);
        // Other slots and operations are not followed, nor are outputs outside of the handler.
        notes.sample(2, 0, &header(5, 30));
        notes.published(3, 0, &header(10, 31));
        notes.handled();
        notes.published(3, 1, &header(1, 31));
        notes.begin();
        notes.published(3, 0, &header(11, 32));
        notes.end(true);
        assert_eq!(taken(&notes), []);
        // A handler that sends nothing ends the message.
        notes.sample(1, 0, &header(5, 30));
        TIME.set(40);
        notes.handled();
        assert_eq!(taken(&notes), [(Kind::Ended, 5, 0, [30, 25, 25, 40])]);
    }

    #[test]
    fn compute_uses_the_newest_message_and_may_use_it_again() {
        let (notes, _) = notes(vec![pair(Way::Compute)]);
        for (number, at) in [(1, 10), (2, 20)] {
            TIME.set(at);
            notes.sample(1, 0, &header(number, at - 5));
            notes.handled();
        }
        let compute = |at: u64, sends: Option<u64>| {
            TIME.set(at);
            notes.begin();
            if let Some(number) = sends {
                notes.published(3, 0, &header(number, at + 3));
            }
            TIME.set(at + 4);
            notes.end(true);
        };
        compute(30, None);
        compute(40, None);
        compute(50, Some(8));
        compute(60, Some(9));
        let expected = [
            (Kind::Replaced, 1, 0, [5, 10, 10, 20]),
            (Kind::Kept, 2, 0, [15, 20, 20, 34]),
            (Kind::Sent, 2, 8, [15, 20, 50, 53]),
            (Kind::Sent, 2, 9, [15, 20, 60, 63]),
        ];
        assert_eq!(taken(&notes), expected);
        // Outputs of the handler of another message do not result from it.
        notes.sample(1, 0, &header(3, 70));
        notes.handled();
        let other = vec![
            pair(Way::Compute),
            FollowedPair {
                input: Some(end(2)),
                ..pair(Way::Handler)
            },
        ];
        notes.shared.follow(other);
        notes.sample(1, 0, &header(3, 70));
        notes.handled();
        notes.sample(2, 0, &header(6, 71));
        notes.published(3, 0, &header(10, 72));
        notes.handled();
        let hops = taken(&notes);
        assert_eq!(hops.iter().map(|hop| hop.1).collect::<Vec<_>>(), [6]);
    }

    #[test]
    fn beginnings_ends_and_calls_are_noted() {
        let source = FollowedPair {
            input: None,
            output: Some(end(4)),
            way: Way::Any,
        };
        let sink = FollowedPair {
            output: None,
            ..pair(Way::Handler)
        };
        let (notes, senders) = notes(vec![source, sink]);
        assert_eq!(senders, [vec![short(78)], vec![]]);
        let id = rpc::RequestId {
            writer: [1; 16],
            sequence: 12,
        };
        for operation in [5, 6] {
            let mut writer = rc_middleware::Writer::default();
            rpc::begin_request(&mut writer, id, operation);
            notes.called(4, &header(12, 100), &writer.into_bytes(), || None);
        }
        TIME.set(110);
        notes.sample(1, 0, &header(2, 105));
        TIME.set(120);
        notes.handled();
        let expected = [
            (Kind::Sent, 0, 12, [0, 100, 100, 100]),
            (Kind::Ended, 2, 0, [105, 110, 110, 120]),
        ];
        assert_eq!(taken(&notes), expected);
    }

    #[test]
    fn the_ring_keeps_the_newest_and_counts_the_others() {
        let (notes, _) = notes(vec![pair(Way::Handler)]);
        // A second of the fastest sender, of which nothing is taken.
        let many = 100_000;
        for number in 1..=many {
            notes.sample(1, 0, &header(number, 1));
            notes.handled();
        }
        let (hops, overwritten) = notes.shared.take();
        assert_eq!((hops.len(), overwritten), (RING, many - RING as u64));
        assert_eq!(hops.back().map(|hop| hop.input), Some(many as u32));
        assert_eq!(notes.shared.take().1, 0);
        // Without a follower, it notes nothing.
        notes.shared.follow(Vec::new());
        notes.sample(1, 0, &header(1, 1));
        notes.handled();
        assert!(!notes.is_on() && notes.shared.take().0.is_empty());
    }
}
