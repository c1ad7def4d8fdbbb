//! Puts samples of calls into queues.

use rc_ddsc::{Guid, Sample};
use rc_middleware::rpc::{self, RequestId};
use rc_network::{
    Backlog, GuidPrefix, Inbox, RateLimit, ReplyQueue, RequestQueues, body, lock, prefix,
};
use std::collections::BTreeSet;
use std::sync::{Mutex, OnceLock};

/// The replies to one client.
pub(crate) struct Replies {
    /// The address of the server.
    address: String,
    /// The identity of the client in its requests.
    client: OnceLock<Guid>,
    /// The requests by their numbers.
    pub(crate) queue: ReplyQueue<u64, Sample>,
    rate_limit: RateLimit,
}

impl Replies {
    pub(crate) fn new(address: &str, limit: u64) -> Self {
        Self {
            address: address.to_owned(),
            client: OnceLock::new(),
            queue: ReplyQueue::new(limit),
            rate_limit: RateLimit::default(),
        }
    }

    /// Sets the client whose replies are kept.
    pub(crate) fn set_client(&self, client: Guid) {
        let _ = self.client.set(client);
    }
}

impl Backlog for Replies {}

impl Inbox for Replies {
    fn put(&self, sample: Sample, from: Option<GuidPrefix>) {
        let envelope = |body| rpc::request_id(body).ok_or_else(|| "it has no envelope".to_owned());
        match body(&sample).and_then(envelope) {
            // Every client receives the replies to all.
            Ok(id) if Some(&id.writer) != self.client.get() => {}
            Ok(id) => self.queue.put(id.sequence, from, sample.len(), sample),
            Err(reason) => {
                if let Some(suppressed) = self.rate_limit.allow() {
                    let (count, address) = (suppressed + 1, &self.address);
                    tracing::warn!(
                        "`{address}` sent a sample that is not a reply ({count} times): {reason}"
                    );
                }
            }
        }
    }
}

/// Most requests without room that are kept for a refusal.
const MOST_REFUSED: usize = 256;

/// A request, and the participant that sent it, as far as it was known then.
pub(crate) struct Received {
    pub(crate) sample: Sample,
    from: Option<GuidPrefix>,
}

/// The requests to a server. The library names clients by handles.
pub(crate) struct Requests {
    pub(crate) waiting: RequestQueues<u64, Received>,
    /// Requests that found no room; the server refuses them.
    refused: Mutex<BTreeSet<(Guid, u64)>>,
}

impl Requests {
    pub(crate) fn new(limit: u64) -> Self {
        Self {
            waiting: RequestQueues::new(limit),
            refused: Mutex::default(),
        }
    }

    /// Takes a request that found no room.
    pub(crate) fn refused(&self) -> Option<RequestId> {
        let (writer, sequence) = lock(&self.refused).pop_first()?;
        Some(RequestId { writer, sequence })
    }
}

impl Backlog for Requests {
    fn awaits_peers(&self) -> bool {
        self.waiting.awaits_peers()
    }
}

impl Inbox for Requests {
    fn put(&self, sample: Sample, from: Option<GuidPrefix>) {
        let (client, size) = (sample.writer(), sample.len());
        let received = Received { sample, from };
        let without_room = self.waiting.put((client, 0), size, received);
        if without_room.is_empty() {
            return;
        }
        let mut refused = lock(&self.refused);
        for Received { sample, from } in without_room {
            if refused.len() < MOST_REFUSED
                && let Some(id) = body(&sample).ok().and_then(rpc::request_id)
                && from == Some(prefix(&id.writer))
            {
                refused.insert((id.writer, id.sequence));
            }
        }
    }
}
