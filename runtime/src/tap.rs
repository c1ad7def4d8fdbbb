//! Copies of the messages of a slot for tools, in a queue with a bound in bytes.

mod client;

pub(crate) use client::TappedClient;

use crate::hops::HopNotes;
use crate::waker::Waker;
use rc_management::observation::TappedKind;
use rc_middleware::backend::{ImageEncoder, LoanedSample, Profile, Publisher, Reply};
use rc_middleware::{
    DeferredReply, Encoding, Header, Message, ReceiveError, SendError, SharedValue, now,
};
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The most bytes that wait for the management thread.
const MOST: usize = 8 << 20;
/// Approximate memory of a copy in addition to its body.
const OVERHEAD: usize = 128;

/// The taps of a component. Worker and management share them.
#[derive(Debug)]
pub(crate) struct Taps {
    slots: Vec<Tap>,
    queue: Mutex<Queue>,
    management: Option<Waker>,
}

#[derive(Debug, Default)]
struct Tap {
    is_on: AtomicBool,
    /// Messages that were not copied since the tap is on.
    dropped: AtomicU64,
}

#[derive(Debug, Default)]
struct Queue {
    copies: VecDeque<Copied>,
    bytes: usize,
}

/// The copy of a message.
#[derive(Debug)]
pub(crate) struct Copied {
    pub(crate) slot: usize,
    pub(crate) kind: TappedKind,
    /// The operation of a sample.
    pub(crate) operation: Option<usize>,
    pub(crate) header: Header,
    pub(crate) profile: Profile,
    /// The messages of the slot that were not copied before it.
    pub(crate) dropped: u64,
    pub(crate) body: Vec<u8>,
}

impl Taps {
    /// The taps of so many slots, all off.
    pub(crate) fn new(slots: usize, management: Option<Waker>) -> Self {
        Self {
            slots: (0..slots).map(|_| Tap::default()).collect(),
            queue: Mutex::default(),
            management,
        }
    }

    pub(crate) fn is_on(&self, slot: usize) -> bool {
        let tap = self.slots.get(slot);
        tap.is_some_and(|tap| tap.is_on.load(Ordering::Relaxed))
    }

    /// Switches a tap. Counting starts again.
    pub(crate) fn set(&self, slot: usize, on: bool) {
        if let Some(tap) = self.slots.get(slot)
            && tap.is_on.swap(on, Ordering::Relaxed) != on
        {
            tap.dropped.store(0, Ordering::Relaxed);
        }
    }

    /// The messages of a slot that were not copied since the tap is on.
    pub(crate) fn dropped(&self, slot: usize) -> u64 {
        let tap = self
            .slots
            .get(slot)
            .filter(|tap| tap.is_on.load(Ordering::Relaxed));
        tap.map_or(0, |tap| tap.dropped.load(Ordering::Relaxed))
    }

    /// Counts a message that no client gets.
    fn count_dropped(&self, slot: usize) {
        if let Some(tap) = self.slots.get(slot) {
            tap.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The copies that wait.
    pub(crate) fn take(&self) -> VecDeque<Copied> {
        let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        queue.bytes = 0;
        std::mem::take(&mut queue.copies)
    }

    /// Copies a message if its slot is tapped. It never waits.
    pub(crate) fn copy(
        &self,
        slot: usize,
        (kind, operation): (TappedKind, Option<usize>),
        header: Header,
        profile: Profile,
        body: &[u8],
    ) {
        if !self.is_on(slot) {
            return;
        }
        let dropped = self.slots[slot].dropped.load(Ordering::Relaxed);
        let size = body.len() + OVERHEAD;
        let mut queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        if queue.bytes + size > MOST {
            drop(queue);
            return self.count_dropped(slot);
        }
        let was_empty = queue.copies.is_empty();
        queue.bytes += size;
        queue.copies.push_back(Copied {
            slot,
            kind,
            operation,
            header,
            profile,
            dropped,
            body: body.to_vec(),
        });
        drop(queue);
        // One wake-up for many copies: its socket must never be full.
        if let Some(management) = self.management.as_ref().filter(|_| was_empty) {
            management.wake();
        }
    }

    /// [`Taps::copy`] for a reply, which is encoded only if its slot is tapped. For tools, it was sent
    /// when it came: its header has the time of the request, or of the value.
    fn copy_reply(&self, slot: usize, header: Header, profile: Profile, reply: &Message<'_>) {
        if self.is_on(slot) {
            let kind = (TappedKind::Reply, None);
            let sent = now();
            let header = Header { sent, ..header };
            self.copy(slot, kind, header, profile, reply.bytes());
        }
    }

    /// Lets `answer` handle a request, and copies both messages if the slot is tapped.
    pub(crate) fn serve<R>(
        self: &Arc<Self>,
        slot: usize,
        header: Header,
        request: &Message<'_>,
        reply: &mut dyn Reply,
        answer: impl FnOnce(&mut dyn Reply) -> R,
    ) -> R {
        if !self.is_on(slot) {
            return answer(reply);
        }
        let profile = reply.profile();
        let kind = (TappedKind::Request, None);
        self.copy(slot, kind, header, profile, request.bytes());
        self.keep(slot, header, reply, answer)
    }

    /// Lets `answer` write a reply, and copies it.
    fn keep<R>(
        self: &Arc<Self>,
        slot: usize,
        header: Header,
        reply: &mut dyn Reply,
        answer: impl FnOnce(&mut dyn Reply) -> R,
    ) -> R {
        let result = answer(&mut KeptReply {
            reply,
            taps: self,
            slot,
            header,
        });
        let header = Header {
            sent: now(),
            encoding: Encoding::Cdr,
            ..header
        };
        if !reply.body().is_empty() {
            let kind = (TappedKind::Reply, None);
            self.copy(slot, kind, header, reply.profile(), reply.body());
        }
        result
    }
}

/// A reply that lends no memory and is not a value, so that it can be read afterwards.
struct KeptReply<'r> {
    reply: &'r mut dyn Reply,
    taps: &'r Arc<Taps>,
    slot: usize,
    header: Header,
}

impl Reply for KeptReply<'_> {
    fn body(&mut self) -> &mut Vec<u8> {
        self.reply.body()
    }

    fn set_age(&mut self, age: Duration) {
        self.reply.set_age(age);
    }

    fn profile(&self) -> Profile {
        self.reply.profile()
    }

    fn defer(&mut self) -> Option<Box<dyn DeferredReply>> {
        Some(Box::new(TappedReply {
            reply: self.reply.defer()?,
            taps: Arc::clone(self.taps),
            slot: self.slot,
            header: self.header,
        }))
    }
}

/// A deferred reply, which is copied when it is sent.
struct TappedReply {
    reply: Box<dyn DeferredReply>,
    taps: Arc<Taps>,
    slot: usize,
    header: Header,
}

impl DeferredReply for TappedReply {
    fn send(self: Box<Self>, write: &mut dyn FnMut(&mut dyn Reply)) -> Result<(), ReceiveError> {
        let Self {
            reply,
            taps,
            slot,
            header,
        } = *self;
        reply.send(&mut |reply| taps.keep(slot, header, reply, |reply| write(reply)))
    }
}

/// A publisher whose samples can be copied and followed.
pub(crate) struct TappedPublisher {
    pub(crate) port: Box<dyn Publisher>,
    pub(crate) taps: Arc<Taps>,
    pub(crate) hops: Rc<HopNotes>,
    pub(crate) slot: usize,
    pub(crate) operation: usize,
}

impl TappedPublisher {
    const fn kind(operation: usize) -> (TappedKind, Option<usize>) {
        (TappedKind::Sample, Some(operation))
    }
}

impl Publisher for TappedPublisher {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let kind = Self::kind(self.operation);
        self.taps.copy(self.slot, kind, header, Profile::Rpc, body);
        self.hops
            .published(self.slot, self.operation, &header, || body);
        self.port.publish(header, body)
    }

    fn takes_values(&self) -> bool {
        self.port.takes_values()
    }

    fn publish_value(&mut self, header: Header, body: SharedValue) -> Result<(), SendError> {
        if self.taps.is_on(self.slot) {
            let kind = Self::kind(self.operation);
            let encoded = body.bytes();
            self.taps
                .copy(self.slot, kind, header, Profile::Rpc, encoded);
        }
        self.hops
            .published(self.slot, self.operation, &header, || body.bytes());
        self.port.publish_value(header, body)
    }

    fn can_loan(&self, encoding: Encoding) -> bool {
        self.port.can_loan(encoding)
    }

    fn loan(&mut self, length: usize) -> Result<Box<dyn LoanedSample + '_>, SendError> {
        let loan = self.port.loan(length)?;
        if !self.taps.is_on(self.slot) && !self.hops.is_on() {
            return Ok(loan);
        }
        Ok(Box::new(TappedLoan {
            loan,
            taps: Arc::clone(&self.taps),
            hops: Rc::clone(&self.hops),
            slot: self.slot,
            operation: self.operation,
        }))
    }

    fn loan_image(&mut self, length: usize) -> Result<Option<Box<dyn LoanedSample>>, SendError> {
        // It may be kept for long, so taps are checked when it is sent.
        self.port.loan_image(length)
    }

    fn send_lent(
        &mut self,
        loan: Box<dyn LoanedSample>,
        header: Header,
        encode: ImageEncoder<'_>,
    ) -> Result<(), SendError> {
        let (kind, body) = (Self::kind(self.operation), loan.memory());
        self.taps.copy(self.slot, kind, header, Profile::Rpc, body);
        self.hops
            .published(self.slot, self.operation, &header, || body);
        self.port.send_lent(loan, header, encode)
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }
}

struct TappedLoan<'p> {
    loan: Box<dyn LoanedSample + 'p>,
    taps: Arc<Taps>,
    hops: Rc<HopNotes>,
    slot: usize,
    operation: usize,
}

impl LoanedSample for TappedLoan<'_> {
    fn memory(&self) -> &[u8] {
        self.loan.memory()
    }

    fn memory_mut(&mut self) -> &mut [u8] {
        self.loan.memory_mut()
    }

    fn send(self: Box<Self>, header: Header) -> Result<(), SendError> {
        self.note(header);
        self.loan.send(header)
    }

    fn send_image(
        self: Box<Self>,
        header: Header,
        encode: ImageEncoder<'_>,
    ) -> Result<(), SendError> {
        self.note(header);
        self.loan.send_image(header, encode)
    }
}

impl TappedLoan<'_> {
    fn note(&self, header: Header) {
        let kind = TappedPublisher::kind(self.operation);
        let body = self.loan.memory();
        self.taps.copy(self.slot, kind, header, Profile::Rpc, body);
        self.hops
            .published(self.slot, self.operation, &header, || body);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::backend::Client;
    use rc_middleware::shared_value::HeldValue;
    use rc_middleware::{CallError, RequestBody};
    use std::time::Duration;

    #[test]
    fn copies_are_bounded_and_drops_are_counted() {
        let taps = Taps::new(2, None);
        let copy = |slot, body: &[u8]| {
            let kind = (TappedKind::Sample, Some(0));
            taps.copy(slot, kind, Header::default(), Profile::Rpc, body);
        };
        copy(0, &[1; 10]);
        assert!(taps.take().is_empty(), "the tap is off");
        taps.set(1, true);
        for _ in 0..20 {
            copy(1, &vec![1; 1 << 20]);
        }
        let copies = taps.take();
        assert_eq!(copies.len(), 7);
        copy(1, &[1]);
        assert_eq!(taps.take().front().map(|copied| copied.dropped), Some(13));
        taps.set(1, false);
        taps.set(1, true);
        copy(1, &[1]);
        assert_eq!(taps.take().front().map(|copied| copied.dropped), Some(0));
    }

    #[test]
    fn a_request_and_its_reply_are_copied() {
        let taps = Arc::new(Taps::new(1, None));
        taps.set(0, true);
        let mut reply = Vec::new();
        let request = Message::Bytes(&[1]);
        let result = taps.serve(0, Header::default(), &request, &mut reply, |reply| {
            assert!(!reply.can_loan(Encoding::Cdr));
            reply.body().extend([2, 3]);
            7
        });
        assert_eq!((result, reply), (7, vec![2, 3]));
        let copies: Vec<_> = taps.take().into_iter().map(|c| (c.kind, c.body)).collect();
        let expected = [
            (TappedKind::Request, vec![1]),
            (TappedKind::Reply, vec![2, 3]),
        ];
        assert_eq!(copies, expected);
    }

    /// Replies with the request, as a server in this process that gets and sends values.
    #[derive(Default)]
    struct Echo(Option<SharedValue>);

    impl Client for Echo {
        fn guid(&self) -> [u8; 16] {
            [1; 16]
        }

        fn send(&mut self, _: Header, _: &dyn RequestBody) -> Result<(), CallError> {
            Ok(())
        }

        fn takes_values(&self) -> bool {
            true
        }

        fn call(
            &mut self,
            _: Header,
            _: &dyn RequestBody,
            _: Duration,
            _: &mut dyn FnMut(Header, &[u8]),
        ) -> Result<(), CallError> {
            unreachable!("the reply would be encoded")
        }

        fn start(
            &mut self,
            _: Header,
            request: &dyn RequestBody,
            _: Duration,
        ) -> Result<(), CallError> {
            self.0 = request.value();
            Ok(())
        }

        fn poll(
            &mut self,
            _: &mut dyn FnMut(u64, Header, &[u8]),
        ) -> Option<(u64, Result<(), CallError>)> {
            unreachable!("the reply would be encoded")
        }

        fn poll_message(
            &mut self,
            take: &mut dyn FnMut(u64, Header, Message<'_>),
        ) -> Option<(u64, Result<(), CallError>)> {
            let value = self.0.take()?;
            take(1, Header::default(), Message::Value(value.into()));
            Some((1, Ok(())))
        }

        fn forget(&mut self, _: u64) {}

        fn peers(&self) -> usize {
            1
        }
    }

    /// A reply to a client in this process.
    #[derive(Default)]
    struct InProcess {
        body: Vec<u8>,
        value: Option<SharedValue>,
    }

    impl Reply for InProcess {
        fn body(&mut self) -> &mut Vec<u8> {
            &mut self.body
        }

        fn takes_values(&self) -> bool {
            true
        }

        fn send_value(&mut self, value: SharedValue) {
            self.value = Some(value);
        }
    }

    #[test]
    fn a_tap_passes_values_of_calls_and_has_replies_encoded_while_it_is_on() {
        let taps = Arc::new(Taps::new(1, None));
        let mut client = TappedClient {
            port: Box::new(Echo::default()),
            taps: Arc::clone(&taps),
            hops: Rc::new(HopNotes::new(Arc::default())),
            slot: 0,
        };
        let value = || SharedValue::of((&7_i32,)).expect("a number");
        for is_on in [false, true, false] {
            taps.set(0, is_on);
            assert!(client.takes_values());
            let request = HeldValue::from(value());
            let started = client.start(Header::default(), &request, Duration::from_secs(20));
            started.expect("to be started");
            let mut is_value = false;
            let ended = client.poll_message(&mut |_, _, message| {
                is_value = matches!(message, Message::Value(_));
            });
            assert_eq!((ended, is_value), (Some((1, Ok(()))), true));
            let mut reply = InProcess::default();
            let request = Message::Value(value().into());
            taps.serve(0, Header::default(), &request, &mut reply, |reply| {
                if reply.takes_values() {
                    reply.send_value(value());
                } else {
                    reply.body().extend(value().bytes());
                }
            });
            assert_eq!(
                (reply.value.is_some(), reply.body.is_empty()),
                (!is_on, !is_on)
            );
            // A request and a reply at both ends.
            assert_eq!(taps.take().len(), if is_on { 4 } else { 0 });
        }
    }
}
