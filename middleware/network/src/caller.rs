//! The client's side of calls, which all middlewares over a network share.

use crate::{GuidPrefix, Peer, ReaderPort, ReplyQueue, Role, WriterPort};
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::started::{Awaiting, StartedCalls, StartedState};
use rc_middleware::{CallError, Spin, WakeEvent, wait};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

/// Longest wait for room in a full queue: replies to requests that the server has taken are on
/// their way. And for the requests of another operation to arrive.
pub const ROOM: Duration = Duration::from_millis(50);
/// After this time a request to a server of another program no longer counts as pending: such a
/// server may not reply to commands.
const SILENCE: Duration = Duration::from_secs(1);
/// Longest wait for the reply of a server that has left: samples and discovery arrive on different
/// threads.
const AFTER_DEATH: Duration = Duration::from_millis(20);
/// Longest wait before the client looks for a stop: another thread may have cleared the wake event.
const CYCLE: Duration = Duration::from_millis(50);

/// The client's ends of a service.
pub struct ClientPorts {
    /// Writes requests.
    pub requests: WriterPort,
    /// Reads replies.
    pub replies: ReaderPort,
}

impl ClientPorts {
    /// The servers that this client can reach and that can reach it: components first, since
    /// another program may answer anything.
    pub fn servers(&self) -> BTreeSet<(bool, GuidPrefix)> {
        let server = |peer: &Peer| is_server(peer).then(|| (peer.is_external(), peer.prefix()));
        let replying = self.replies.state().usable(server);
        let receiving = self.requests.state().usable(server);
        let both = receiving.into_iter().filter(|one| replying.contains(one));
        both.collect()
    }

    /// Another number for other servers, 0 for none.
    pub fn server_number(&self) -> u128 {
        let servers = self.servers().into_iter();
        servers.fold(0, |all, (_, prefix)| {
            let mut bytes = [0; 16];
            bytes[..prefix.len()].copy_from_slice(&prefix);
            all.rotate_left(8) ^ u128::from_le_bytes(bytes) ^ (1 << 127)
        })
    }

    /// Whether `server` is among them.
    pub fn has(&self, server: GuidPrefix) -> bool {
        let same = |peer: &Peer| peer.prefix() == server && is_server(peer);
        self.replies.state().has(same) && self.requests.state().has(same)
    }

    /// Whether `server` is another program, which does not describe itself.
    pub fn is_external(&self, server: GuidPrefix) -> bool {
        let same = |peer: &Peer| peer.prefix() == server && peer.is_external();
        self.requests.state().has(same)
    }

    /// The server of the next request: `last`, while it is there.
    pub fn server(&self, last: Option<GuidPrefix>) -> Option<GuidPrefix> {
        let same = last.filter(|last| self.has(*last));
        same.or_else(|| Some(self.servers().first()?.1))
    }
}

fn is_server(peer: &Peer) -> bool {
    let info = peer.info.as_ref();
    info.is_none_or(|info| info.role == Role::Server)
}

/// State of a call, for a client that looks for the reply.
pub struct CallState {
    /// Whether the server is there. Determine it before the reply: a reply that a server sent
    /// before it left is there by then, or comes at once.
    pub has_server: bool,
    /// The result of the call, if the reply has come.
    pub reply: Option<Result<(), CallError>>,
}

/// Waits for room and for replies, for one client.
pub struct Caller {
    /// The address of the connection.
    pub address: String,
    /// Readable when a sample has come, or the server has changed.
    pub signal: WakeEvent,
    /// Stops the component.
    pub wake_event: WakeEvent,
    /// How long the client polls before it sleeps.
    pub spin: Cell<Spin>,
}

impl Caller {
    /// The error of a call that the backend could not make.
    pub fn failed(&self, reason: &dyn std::fmt::Display) -> CallError {
        CallError::Backend {
            address: self.address.clone(),
            reason: reason.to_string(),
        }
    }

    /// The error of a request that was not sent.
    pub fn not_sent(&self, error: &rc_ddsc::Error) -> CallError {
        if error.is_timeout() {
            CallError::QueueFull(self.address.clone())
        } else {
            self.failed(error)
        }
    }

    /// Waits until there is room for one more request to `server`, at most `limit`.
    pub fn make_room<K: Copy + Ord, S>(
        &self,
        queue: &ReplyQueue<K, S>,
        server: GuidPrefix,
        is_external: bool,
        limit: Duration,
    ) -> Result<(), CallError> {
        queue.set_server(server);
        let deadline = Instant::now() + limit;
        loop {
            self.signal.clear();
            if queue.pending() >= REQUEST_QUEUE && is_external {
                queue.expire(SILENCE);
            }
            if queue.pending() < REQUEST_QUEUE {
                return Ok(());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(CallError::QueueFull(self.address.clone()));
            }
            wait(&[self.signal.as_fd()], left);
        }
    }

    /// The state of a started call.
    pub fn look(&self, state: CallState) -> StartedState {
        match state {
            CallState {
                reply: Some(result),
                ..
            } => StartedState::Ended(result),
            CallState {
                has_server: false, ..
            } => StartedState::Lost(CallError::ServerDied(self.address.clone()), AFTER_DEATH),
            CallState { .. } => StartedState::Pending,
        }
    }

    /// The descriptor and time to wait for while started calls have not ended.
    pub fn awaiting<T>(&self, calls: &StartedCalls<T>) -> Option<Awaiting<'_>> {
        let until = calls.due().unwrap_or_else(|| Instant::now() + CYCLE);
        (!calls.is_empty()).then(|| Awaiting {
            descriptor: self.signal.as_fd(),
            until,
        })
    }

    /// Waits for the reply, at most until `limit` has passed since `start`, and returns the result
    /// of the call.
    pub fn await_reply(
        &self,
        (start, limit): (Instant, Duration),
        mut state: impl FnMut() -> CallState,
    ) -> Result<(), CallError> {
        let address = || self.address.clone();
        let mut interrupted = false;
        let polled = Spin::poll(&self.spin, limit, |found| {
            let CallState { has_server, reply } = state();
            if reply.is_some() {
                *found = Some(Instant::now());
            }
            let is_over = reply.is_some() || !has_server || self.wake_event.is_stopping();
            is_over.then_some(reply)
        });
        if let Some(Some(result)) = polled {
            return result;
        }
        loop {
            self.signal.clear();
            let CallState { has_server, reply } = state();
            if let Some(result) = reply {
                return result;
            }
            if !has_server {
                wait(&[self.signal.as_fd()], AFTER_DEATH);
                let died = || Err(CallError::ServerDied(address()));
                return state().reply.unwrap_or_else(died);
            }
            if self.wake_event.is_stopping() {
                return Err(CallError::Stopping);
            }
            let elapsed = start.elapsed();
            if elapsed >= limit {
                let address = address();
                return Err(CallError::Deadline { address, limit });
            }
            // The wake event stays readable for its owner: this call does not wait for it twice.
            let descriptors = [self.signal.as_fd(), self.wake_event.as_fd()];
            let waited = if interrupted { 1 } else { 2 };
            let left = limit.saturating_sub(elapsed);
            interrupted |= wait(&descriptors[..waited], left.min(CYCLE)) & 2 != 0;
        }
    }
}
