//! A client whose last replies answer queries for a while, and whose replies know their age.

use crate::ages::{FreshCounts, age, moment, nanoseconds};
use crate::clock::Clock;
use crate::slots::OpenSlot;
use rc_middleware::freshness::{Freshness, Made};
use rc_middleware::in_place::IntoBytes;
use rc_middleware::qos::Stale;
use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::rpc::{self, IDENTITY};
use rc_middleware::shared_value::{HeldValue, SharedValue};
use rc_middleware::started::Awaiting;
use rc_middleware::typed::{Operation, reply_values};
use rc_middleware::{CallError, Client, Header, Message, Profile, QueueGauge};
use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// The most bytes of the replies that a client keeps, and of their requests.
const MOST_BYTES: usize = 16 * 1024 * 1024;
/// The most replies that a client keeps: one for each operation with its arguments.
const MOST_REPLIES: usize = 64;
/// How long a server that is gone may go unnoticed: asking the middleware costs as much as a kept
/// reply.
const LOOK: u64 = 1_000_000;

/// Keeps replies, and counts how old they are.
pub(crate) struct CachingClient {
    port: Box<dyn Client>,
    operations: &'static [Operation],
    cache: u64,
    fresh: Option<Duration>,
    stale: Stale,
    simulated: Option<Arc<dyn Clock>>,
    /// The oldest one first.
    kept: VecDeque<Kept>,
    bytes: usize,
    server: u128,
    looked: u64,
    last: Option<Freshness>,
    counts: FreshCounts,
}

/// A reply.
struct Kept {
    /// The request behind its identity.
    request: Vec<u8>,
    reply: KeptReply,
    /// When its call began.
    begun: u64,
    /// When its value was made: then, or before.
    made: u64,
}

impl Kept {
    fn size(&self) -> usize {
        self.request.len() + self.reply.size()
    }
}

/// A reply that outlives its call.
struct KeptReply {
    header: Header,
    body: KeptBody,
}

enum KeptBody {
    /// Its bytes, aligned as an image needs them, and their number.
    Bytes(Vec<u128>, usize),
    /// That of a server in this process.
    Value(SharedValue),
}

impl KeptReply {
    fn of(header: Header, message: &Message<'_>) -> Self {
        let value = match message {
            Message::Value(value) => value.shared(),
            Message::Bytes(_) => None,
        };
        let copy = || {
            let bytes = message.bytes();
            let mut memory = vec![0_u128; bytes.len().div_ceil(size_of::<u128>())];
            memory.as_mut_slice().as_mut_bytes()[..bytes.len()].copy_from_slice(bytes);
            KeptBody::Bytes(memory, bytes.len())
        };
        let body = value.map_or_else(copy, KeptBody::Value);
        Self { header, body }
    }

    fn size(&self) -> usize {
        match &self.body {
            KeptBody::Bytes(memory, _) => memory.len() * size_of::<u128>(),
            KeptBody::Value(value) => value.memory(),
        }
    }

    /// Hands it over as the reply to a request.
    fn answer(&mut self, request: &[u8], take: &mut dyn FnMut(Header, Message<'_>)) {
        let Some(identity) = request.first_chunk::<IDENTITY>() else {
            return;
        };
        match &mut self.body {
            KeptBody::Bytes(memory, length) => {
                let reply = &mut memory.as_mut_slice().as_mut_bytes()[..*length];
                if let Some(begin) = reply.first_chunk_mut() {
                    *begin = *identity;
                }
                take(self.header, Message::Bytes(reply));
            }
            KeptBody::Value(value) => {
                let reply = HeldValue::again(value.clone(), *identity);
                take(self.header, Message::Value(reply));
            }
        }
    }
}

impl CachingClient {
    pub(crate) fn new(
        port: Box<dyn Client>,
        slot: &OpenSlot,
        simulated: Option<Arc<dyn Clock>>,
        counts: FreshCounts,
    ) -> Self {
        Self {
            port,
            operations: slot.operations,
            cache: slot.qos.cache.map_or(0, nanoseconds),
            fresh: slot.qos.fresh,
            stale: slot.qos.stale,
            simulated,
            kept: VecDeque::new(),
            bytes: 0,
            server: 0,
            looked: 0,
            last: None,
            counts,
        }
    }

    fn now(&self) -> u64 {
        moment(self.simulated.as_deref())
    }

    fn forget_all(&mut self) {
        self.kept.clear();
        self.bytes = 0;
    }

    /// Forgets all replies if their server is gone, or another one is there.
    fn look(&mut self) {
        let now = rc_middleware::now();
        if now.saturating_sub(self.looked) < LOOK {
            return;
        }
        self.looked = now;
        let server = self.port.server();
        if server != self.server {
            self.server = server;
            self.forget_all();
        }
    }

    fn remove(&mut self, place: usize) {
        if let Some(kept) = self.kept.remove(place) {
            self.bytes -= kept.size();
        }
    }

    /// The place of the reply to this request.
    fn find(&self, request: &[u8]) -> Option<usize> {
        let request = request.get(IDENTITY..)?;
        self.kept.iter().position(|kept| kept.request == request)
    }

    /// Keeps the reply to a request, if it is not too large.
    fn keep(&mut self, request: &[u8], reply: KeptReply, (begun, made): (u64, u64)) {
        let kept = Kept {
            request: request.get(IDENTITY..).unwrap_or_default().to_vec(),
            reply,
            begun,
            made,
        };
        if let Some(place) = self.find(request) {
            self.remove(place);
        }
        if kept.size() > MOST_BYTES {
            return;
        }
        self.bytes += kept.size();
        self.kept.push_back(kept);
        while self.bytes > MOST_BYTES || self.kept.len() > MOST_REPLIES {
            self.remove(0);
        }
    }

    /// Answers a request with a kept reply.
    fn answer(
        &mut self,
        place: usize,
        request: &[u8],
        now: u64,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) {
        let Some(kept) = self.kept.get_mut(place) else {
            return;
        };
        let (age, is_fresh) = age(kept.made, now, self.fresh);
        let freshness = Freshness {
            age,
            made: Made::Cached,
            is_fresh,
        };
        self.last = Some(freshness);
        self.counts.used(freshness);
        kept.reply.answer(request, take);
    }
}

/// Parts of a reply.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Content {
    /// Values, which have an age, and which can be kept.
    Values,
    /// No values: the query is there for what it does.
    Nothing,
    /// An exception or a refusal, which is of now.
    Failure,
}

impl Content {
    /// That of a reply. `request` begins with the envelope.
    fn of(
        operations: &[Operation],
        profile: Profile,
        request: &[u8],
        (header, reply): (Header, &Message<'_>),
    ) -> Self {
        let Ok((id, _)) = rpc::request_values(request, profile) else {
            return Self::Failure;
        };
        let operation = operations.iter().find(|operation| operation.id == id);
        let values = operation.map(|of| reply_values(of, profile, header, reply.begin()));
        let Some(Ok(Some((0, begin)))) = values else {
            return Self::Failure;
        };
        let is_empty = match reply.length().saturating_sub(begin) {
            0 => true,
            // A message of ROS 2 without members has one byte, 0. One with a `false` is not kept.
            1 => profile == Profile::Bare && reply.bytes().last() == Some(&0),
            _ => false,
        };
        if is_empty {
            Self::Nothing
        } else {
            Self::Values
        }
    }
}

impl Client for CachingClient {
    fn guid(&self) -> [u8; 16] {
        self.port.guid()
    }

    fn profile(&self) -> Profile {
        self.port.profile()
    }

    /// A command may change the server: the next query asks the server again.
    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        self.forget_all();
        self.port.send(header, request)
    }

    fn takes_values(&self) -> bool {
        self.port.takes_values()
    }

    fn can_loan(&self) -> bool {
        self.port.can_loan()
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        self.call_message(header, request, limit, &mut |header, reply| {
            take(header, reply.bytes());
        })
    }

    fn call_message(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Result<(), CallError> {
        let keeps = self.cache > 0 || self.stale == Stale::Last;
        let begun = self.now();
        if self.kept.back().is_some_and(|last| last.begun > begun) {
            // Time was set back.
            self.forget_all();
        }
        let bytes = if !keeps || request.begin().len() == request.length() {
            Cow::Borrowed(request.begin())
        } else {
            Cow::Owned(buffer(request)?)
        };
        if keeps {
            self.look();
            let refuses = self.stale == Stale::Refuse;
            let fresh = self.fresh.filter(|_| refuses).map_or(u64::MAX, nanoseconds);
            if let Some(place) = self.find(&bytes)
                && self.cache > 0
                && begun - self.kept[place].begun <= self.cache
                && begun.saturating_sub(self.kept[place].made) <= fresh
            {
                self.answer(place, &bytes, begun, take);
                return Ok(());
            }
        }
        let simulated = self.simulated.clone();
        let (limit_of_age, informs) = (self.fresh, self.stale == Stale::Inform);
        let (operations, profile) = (self.operations, self.port.profile());
        let (mut came, mut reply) = (None, None);
        let asked = if self.port.replies_have_ages() {
            header.sent
        } else {
            0
        };
        let mut came_in = |header: Header, message: Message<'_>| {
            let now = moment(simulated.as_deref());
            // A value that was there before the call is older than it. A program outside may not say.
            let before = match header.sent {
                0 => 0,
                sent => asked.saturating_sub(sent),
            };
            let made = begun.saturating_sub(before);
            let (age, is_fresh) = age(made, now, limit_of_age);
            let content = Content::of(operations, profile, &bytes, (header, &message));
            let is_used = is_fresh || informs || content != Content::Values;
            if content == Content::Values && (keeps || !is_used) {
                reply = Some(KeptReply::of(header, &message));
            }
            if is_used {
                take(header, message);
            }
            came = Some(((now, made), (age, is_fresh), content));
        };
        let called = self.port.call_message(header, request, limit, &mut came_in);
        if called.is_err() {
            // The server may be gone, or may have done what was asked.
            self.forget_all();
        }
        called?;
        let Some(((now, made_at), (age, is_fresh), content)) = came else {
            return Ok(());
        };
        if content != Content::Values {
            // A query without results is a command that waits for its end; an exception may be the
            // end of one.
            self.forget_all();
            return Ok(());
        }
        let freshness = Freshness {
            age,
            made: Made::Computed,
            is_fresh,
        };
        if !is_fresh && !informs {
            self.counts.refused();
            if self.stale == Stale::Refuse {
                return Err(CallError::Stale { age });
            }
            if let Some(place) = self.find(&bytes) {
                self.answer(place, &bytes, now, take);
                return Ok(());
            }
            // There is no last one: this one is better than none.
            if let Some(reply) = &mut reply {
                reply.answer(&bytes, take);
            }
        }
        self.last = Some(freshness);
        self.counts.came(made_at);
        self.counts.used(freshness);
        if let Some(reply) = reply
            && is_fresh
        {
            self.keep(&bytes, reply, (begun, made_at));
        }
        Ok(())
    }

    /// A started call asks the server, and may change it.
    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        self.forget_all();
        self.port.start(header, request, limit)
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        self.port.poll(take)
    }

    fn poll_message(
        &mut self,
        take: &mut dyn FnMut(u64, Header, Message<'_>),
    ) -> Option<(u64, Result<(), CallError>)> {
        self.port.poll_message(take)
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.port.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        self.port.forget(sequence);
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.port.awaiting()
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }

    fn server(&self) -> u128 {
        self.port.server()
    }

    fn freshness(&self) -> Option<Freshness> {
        self.last
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}

#[cfg(test)]
mod tests;
