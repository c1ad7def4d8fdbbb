//! Queues of samples that were received and not read yet: of a topic, of requests, of replies.

use crate::endpoint_state::Backlog;
use crate::{Guid, lock};
use rc_middleware::rpc::RequestId;
use std::collections::VecDeque;
use std::sync::{Mutex, OnceLock};
use std::time::Instant;

/// Most requests of one client that wait here. Components stop sending long before that.
const MOST_REQUESTS: usize = 256;
/// Most bytes that wait here, of all clients together.
const MOST_BYTES: usize = 256 << 20;
/// Number of senders of a topic whose last sequence number is remembered.
const MOST_SENDERS: usize = 256;
/// Most replies to one client that wait here. More than there are requests come only from a flood.
const MOST_REPLIES: usize = 256;

/// The newest samples of a topic that nobody took yet.
#[derive(Debug)]
pub struct SampleQueue<S> {
    samples: Mutex<VecDeque<S>>,
    depth: usize,
}

impl<S> SampleQueue<S> {
    /// A queue of `depth` samples, at least one.
    pub fn new(depth: u32) -> Self {
        Self {
            samples: Mutex::new(VecDeque::new()),
            depth: (depth as usize).max(1),
        }
    }

    /// Takes the oldest sample.
    pub fn next(&self) -> Option<S> {
        lock(&self.samples).pop_front()
    }

    /// Adds a sample. A full queue drops its oldest sample.
    pub fn put(&self, sample: S) {
        let mut samples = lock(&self.samples);
        if samples.len() >= self.depth {
            samples.pop_front();
        }
        samples.push_back(sample);
    }
}

/// Recognizes samples that arrive a second time.
///
/// A DDS library forgets a sender that is out of reach. When it finds the sender again, the sender
/// sends its kept samples once more.
#[derive(Debug, Default)]
pub struct DuplicateFilter(Vec<(u128, u64)>);

impl DuplicateFilter {
    /// Notes a sample, and says whether it is new. A `sequence` of 0 is always new: its sender does
    /// not count.
    pub fn is_new(&mut self, sender: u128, sequence: u64) -> bool {
        let Some(at) = self.0.iter().position(|(known, _)| *known == sender) else {
            self.0.truncate(MOST_SENDERS - 1);
            self.0.insert(0, (sender, sequence));
            return true;
        };
        self.0[..=at].rotate_right(1);
        let last = &mut self.0[0].1;
        let is_new = sequence == 0 || sequence > *last;
        *last = sequence.max(*last);
        is_new
    }
}

/// The replies to one client.
#[derive(Debug)]
pub struct ReplyQueue<S> {
    /// The identity of the client in its requests.
    client: OnceLock<Guid>,
    samples: Mutex<VecDeque<(RequestId, S)>>,
}

impl<S> Default for ReplyQueue<S> {
    fn default() -> Self {
        Self {
            client: OnceLock::new(),
            samples: Mutex::new(VecDeque::new()),
        }
    }
}

impl<S> ReplyQueue<S> {
    /// Sets the client whose replies are kept.
    pub fn set_client(&self, client: Guid) {
        let _ = self.client.set(client);
    }

    /// Takes the oldest reply.
    pub fn next(&self) -> Option<(RequestId, S)> {
        lock(&self.samples).pop_front()
    }

    /// Adds the reply to request `id`, unless it is for another client: every client receives the
    /// replies to all.
    pub fn put(&self, id: RequestId, sample: S) {
        if Some(&id.writer) != self.client.get() {
            return;
        }
        let mut samples = lock(&self.samples);
        if samples.len() >= MOST_REPLIES {
            samples.pop_front();
        }
        samples.push_back((id, sample));
    }
}

/// The requests to a server: one queue for each client `C`, in the order in which the server serves
/// them.
#[derive(Debug)]
pub struct RequestQueues<C, S>(Mutex<Queues<C, S>>);

#[derive(Debug)]
struct Queues<C, S> {
    clients: VecDeque<(C, VecDeque<QueuedRequest<S>>)>,
    /// Bytes of all waiting requests.
    bytes: usize,
}

/// A request that waits.
#[derive(Debug)]
pub struct QueuedRequest<S> {
    /// The request.
    pub sample: S,
    /// Its place among the requests of its client.
    order: u64,
    /// When it arrived.
    pub since: Instant,
    size: usize,
}

impl<C, S> Default for RequestQueues<C, S> {
    fn default() -> Self {
        Self(Mutex::new(Queues {
            clients: VecDeque::new(),
            bytes: 0,
        }))
    }
}

impl<C: PartialEq, S> RequestQueues<C, S> {
    /// Takes the next request for which `may` holds. Clients take turns.
    pub fn next(&self, may: impl Fn(&QueuedRequest<S>) -> bool) -> Option<QueuedRequest<S>> {
        let mut queues = lock(&self.0);
        let at = queues
            .clients
            .iter()
            .position(|(_, waiting)| waiting.front().is_some_and(&may))?;
        let (client, mut waiting) = queues.clients.remove(at)?;
        let next = waiting.pop_front()?;
        queues.bytes -= next.size;
        if !waiting.is_empty() {
            queues.clients.push_back((client, waiting));
        }
        Some(next)
    }

    /// Adds a request of `client` with a body of `size` bytes. It comes before the waiting requests
    /// of this client with a higher `order`. Gives it back where there is no room.
    pub fn put(&self, (client, order): (C, u64), size: usize, sample: S) -> Result<(), S> {
        let mut queues = lock(&self.0);
        let at = queues.clients.iter().position(|(c, _)| *c == client);
        // An empty queue takes a request of any size.
        let is_room = at.is_none_or(|at| queues.clients[at].1.len() < MOST_REQUESTS)
            && (queues.bytes == 0 || queues.bytes + size <= MOST_BYTES);
        if !is_room {
            return Err(sample);
        }
        let waiting = QueuedRequest {
            sample,
            order,
            since: Instant::now(),
            size,
        };
        queues.bytes += size;
        match at {
            Some(at) => {
                let requests = &mut queues.clients[at].1;
                let place = requests.partition_point(|request| request.order <= order);
                requests.insert(place, waiting);
            }
            None => queues
                .clients
                .push_back((client, VecDeque::from([waiting]))),
        }
        Ok(())
    }
}

impl<C: Send, S: Send> Backlog for RequestQueues<C, S> {
    fn awaits_peers(&self) -> bool {
        !lock(&self.0).clients.is_empty()
    }
}

impl<S: Send> Backlog for SampleQueue<S> {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeated_samples_are_not_new() {
        let mut filter = DuplicateFilter::default();
        let mut new = |sender, numbers: &[u64]| -> Vec<bool> {
            numbers.iter().map(|n| filter.is_new(sender, *n)).collect()
        };
        assert_eq!(new(1, &[7, 8, 10]), [true; 3]);
        assert_eq!(new(2, &[8, 9]), [true; 2]);
        assert_eq!(new(1, &[9, 10, 11]), [false, false, true]);
        assert_eq!(new(3, &[0, 0]), [true; 2]);
        for sender in 10..1000 {
            assert_eq!(new(sender, &[5, 4]), [true, false]);
        }
        assert_eq!(filter.0.len(), MOST_SENDERS);
    }
}
