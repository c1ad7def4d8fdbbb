//! Notes of messages on chains: the inputs, the outputs that they caused, and the times.
//!
//! The supervisor says what to follow, and takes the notes over management. Until then, a message
//! costs one load of a number that never changes. A note costs no call of the kernel.

use crate::slots::OpenSlot;
use rc_management::hops::{Hop, Kind, RING, Way, short};
use rc_middleware::{Header, Reader, RequestBody, now, rpc};
use rc_vocabulary::Stamp;
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
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FollowedPair {
    pub(crate) input: Option<FollowedEnd>,
    pub(crate) output: Option<FollowedEnd>,
    pub(crate) way: Way,
    pub(crate) stamp: Option<Stamp>,
}

/// An operation of a slot, or of all members of an array.
#[derive(Clone, Debug, PartialEq)]
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
    /// Follows these pairs from now on, in place of others. Returns the senders of each output. What
    /// was noted of the same pairs stays: the supervisor may have had no answer for a while.
    pub(crate) fn follow(&self, pairs: Vec<FollowedPair>) -> Vec<Vec<u32>> {
        let senders = pairs.iter().map(|pair| self.senders_of(pair)).collect();
        let mut state = locked(&self.state);
        if *state.pairs == *pairs {
            return senders;
        }
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
    pub(crate) fn sample<'b>(
        &self,
        slot: usize,
        operation: usize,
        header: &Header,
        body: impl Fn() -> &'b [u8],
    ) {
        if self.is_on() {
            let sender = short(header.sender);
            let sent = |stamp: &Stamp| stamp.read(body()).unwrap_or(0);
            self.begins((slot, operation), (sender, header), header.sequence, sent);
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
            // Stamps are those of topics.
            self.begins((slot, operation), (sender, header), id.sequence, |_| 0);
        }
    }

    fn begins(
        &self,
        (slot, operation): (usize, usize),
        (sender, header): (u32, &Header),
        number: u64,
        stamp: impl Fn(&Stamp) -> u64,
    ) {
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
                sent: header.sent,
                begun: (self.clock)(),
                is_used: false,
                is_kept: false,
            });
            let input = Input {
                sent: pair.stamp.as_ref().map_or(input.sent, &stamp),
                ..input
            };
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
        } else if local.pairs.iter().any(|pair| pair.input.is_none()) {
            local.begun = (self.clock)();
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
    pub(crate) fn published<'b>(
        &self,
        slot: usize,
        operation: usize,
        header: &Header,
        body: impl Fn() -> &'b [u8],
    ) {
        if self.is_on() {
            let is_output = |end: &FollowedEnd| end.is(slot, operation);
            let stamp = |stamp: &Stamp| stamp.read(body()).unwrap_or(0);
            self.sends(is_output, header.sequence, header.sent, stamp);
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
            self.sends(is_output, number, header.sent, |_| 0);
        }
    }

    fn sends(
        &self,
        is_output: impl Fn(&FollowedEnd) -> bool,
        number: u64,
        left: u64,
        stamp: impl Fn(&Stamp) -> u64,
    ) {
        let local = &mut *self.local.borrow_mut();
        let mut passed_on = None;
        for (at, pair) in local.pairs.iter().enumerate() {
            if !pair.output.as_ref().is_some_and(&is_output) {
                continue;
            }
            // A proxy passes the time on at which a message was sent first.
            let left = match local.begun {
                begun if left < begun => *passed_on.get_or_insert_with(self.clock),
                _ => left,
            };
            let Some(end) = &pair.input else {
                self.push(Hop {
                    sender: 0,
                    pair: at as u16,
                    kind: Kind::Sent,
                    input: 0,
                    output: number as u32,
                    sent: pair.stamp.as_ref().map_or(0, &stamp),
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
mod tests;
