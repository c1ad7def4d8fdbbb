//! The reply to a query, from its server to the client that waits.

use crate::body::{Body, Pool};
use crate::hub::lock;
use rc_middleware::{DeferredReply, Encoding, ReceiveError, Reply, SharedValue, WakeEvent};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The server's side of a call that waits. Dropping it without a reply ends the call.
pub(crate) struct Ticket {
    pub(crate) slot: Arc<Mutex<ReplyState>>,
    pub(crate) signal: WakeEvent,
}

#[derive(Default)]
pub(crate) enum ReplyState {
    #[default]
    Pending,
    /// With the age of its value.
    Ready(Answer, Duration),
    Dropped,
}

/// The reply of a server.
pub(crate) enum Answer {
    Copied(Vec<u8>),
    /// In memory of the server, in this encoding.
    Lent(Arc<Body>, Encoding),
    Value(SharedValue),
}

impl Ticket {
    fn resolve(&self, state: ReplyState) {
        let mut slot = lock(&self.slot);
        if matches!(*slot, ReplyState::Pending) {
            *slot = state;
            self.signal.wake();
        }
    }
}

impl Drop for Ticket {
    fn drop(&mut self) {
        self.resolve(ReplyState::Dropped);
    }
}

/// Takes a reply: a value, copied, or in memory that the client reads.
pub(crate) struct LocalReply<'s> {
    value: Option<SharedValue>,
    copied: Vec<u8>,
    pool: &'s mut Pool,
    lent: Option<(Arc<Body>, Encoding)>,
    is_lent_sent: bool,
    /// The request of a query, until its reply is deferred.
    ticket: Option<Ticket>,
    /// The age of its value.
    age: Duration,
}

impl<'s> LocalReply<'s> {
    pub(crate) fn new(pool: &'s mut Pool, ticket: Option<Ticket>) -> Self {
        Self {
            value: None,
            copied: Vec::new(),
            pool,
            lent: None,
            is_lent_sent: false,
            ticket,
            age: Duration::ZERO,
        }
    }

    /// Sends the written reply, unless there is none.
    pub(crate) fn finish(self) {
        let lent = self.lent.filter(|_| self.is_lent_sent);
        let answer = match (self.value, lent) {
            (Some(value), _) => Some(Answer::Value(value)),
            (None, Some((body, encoding))) => {
                self.pool.keep(&body);
                Some(Answer::Lent(body, encoding))
            }
            (None, None) => Some(self.copied)
                .filter(|copied| !copied.is_empty())
                .map(Answer::Copied),
        };
        if let Some((ticket, answer)) = self.ticket.zip(answer) {
            ticket.resolve(ReplyState::Ready(answer, self.age));
        }
    }
}

/// A deferred reply.
struct LocalDeferred(Ticket);

impl DeferredReply for LocalDeferred {
    fn send(self: Box<Self>, write: &mut dyn FnMut(&mut dyn Reply)) -> Result<(), ReceiveError> {
        let mut pool = Pool::default();
        let mut reply = LocalReply::new(&mut pool, Some(self.0));
        write(&mut reply);
        reply.finish();
        Ok(())
    }
}

impl Reply for LocalReply<'_> {
    fn body(&mut self) -> &mut Vec<u8> {
        &mut self.copied
    }

    fn set_age(&mut self, age: Duration) {
        self.age = age;
    }

    fn takes_values(&self) -> bool {
        true
    }

    fn send_value(&mut self, value: SharedValue) {
        self.value = Some(value);
    }

    fn can_loan(&self, _encoding: Encoding) -> bool {
        true
    }

    fn loan(&mut self, length: usize, encoding: Encoding) -> Option<&mut [u8]> {
        let body = self.pool.take(length)?;
        let (body, _) = self.lent.insert((body, encoding));
        Arc::get_mut(body).map(Body::bytes_mut)
    }

    fn send_loan(&mut self) {
        self.is_lent_sent = self.lent.is_some();
    }

    fn defer(&mut self) -> Option<Box<dyn DeferredReply>> {
        Some(Box::new(LocalDeferred(self.ticket.take()?)))
    }
}
