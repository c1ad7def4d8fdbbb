//! The queues of a server.

use crate::endpoint_state::Backlog;
use crate::lock;
use rc_middleware::QueueGauge;
use std::collections::VecDeque;
use std::sync::Mutex;
use std::time::Instant;

/// Most requests of one client that wait here. Components stop sending long before that.
const MOST_REQUESTS: usize = 256;
/// What a waiting request needs beside its body, in bytes, counted generously.
const OVERHEAD: usize = 512;

/// Why a server refuses a request that found no room.
pub const NO_ROOM: &str = "the queue of the server has no room: too many requests of this client wait already, or the requests of all clients have more bytes than the setting `queue_mib` allows";

/// The requests to a server: one queue for each client `C`, in the order in which the server serves
/// them.
#[derive(Debug)]
pub struct RequestQueues<C, S> {
    queues: Mutex<VecDeque<(C, VecDeque<QueuedRequest<S>>)>>,
    /// Counts the bytes of all waiting requests.
    gauge: QueueGauge,
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

impl<C: PartialEq, S> RequestQueues<C, S> {
    /// Queues with room for `limit` bytes together.
    pub fn new(limit: u64) -> Self {
        Self {
            queues: Mutex::default(),
            gauge: QueueGauge::new(limit),
        }
    }

    /// Their use.
    pub fn gauge(&self) -> &QueueGauge {
        &self.gauge
    }

    /// Takes the next request for which `may` holds. Clients take turns.
    pub fn next(&self, may: impl Fn(&QueuedRequest<S>) -> bool) -> Option<QueuedRequest<S>> {
        let mut queues = lock(&self.queues);
        let at = queues
            .iter()
            .position(|(_, waiting)| waiting.front().is_some_and(&may))?;
        let (client, mut waiting) = queues.remove(at)?;
        let next = waiting.pop_front()?;
        self.gauge.remove(next.size);
        if !waiting.is_empty() {
            queues.push_back((client, waiting));
        }
        Some(next)
    }

    /// Adds a request of `client` with a body of `size` bytes. It comes before the waiting requests
    /// of this client with a higher `order`. Gives it back where there is no room.
    pub fn put(&self, (client, order): (C, u64), size: usize, sample: S) -> Result<(), S> {
        let size = size.saturating_add(OVERHEAD);
        let mut queues = lock(&self.queues);
        let at = queues.iter().position(|(c, _)| *c == client);
        if at.is_some_and(|at| queues[at].1.len() >= MOST_REQUESTS) {
            self.gauge.drop_one();
            return Err(sample);
        }
        if !self.gauge.add(size) {
            return Err(sample);
        }
        let waiting = QueuedRequest {
            sample,
            order,
            since: Instant::now(),
            size,
        };
        match at {
            Some(at) => {
                let requests = &mut queues[at].1;
                let place = requests.partition_point(|request| request.order <= order);
                requests.insert(place, waiting);
            }
            None => queues.push_back((client, VecDeque::from([waiting]))),
        }
        Ok(())
    }
}

impl<C: Send, S: Send> Backlog for RequestQueues<C, S> {
    fn awaits_peers(&self) -> bool {
        !lock(&self.queues).is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_have_a_bound_in_bytes_and_one_in_number() {
        let queues = RequestQueues::new(1 << 20);
        assert_eq!(queues.put((1, 0), 600_000, 'a'), Ok(()));
        assert_eq!(queues.put((2, 0), 600_000, 'b'), Err('b'));
        assert_eq!(queues.gauge().dropped(), 1);
        for _ in 0..MOST_REQUESTS {
            assert_eq!(queues.put((3, 0), 8, 'c'), Ok(()));
        }
        assert_eq!(queues.put((3, 0), 8, 'd'), Err('d'));
        // Requests of many clients without a body are not free.
        let all = (4..100_000).filter(|client| queues.put((*client, 0), 0, 'e').is_ok());
        assert!(all.count() < 1 << 10);
        while queues.next(|_| true).is_some() {}
        assert_eq!(queues.gauge().bytes(), 0);
    }
}
