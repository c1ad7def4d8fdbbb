//! The queues of a server.

use crate::endpoint_state::Backlog;
use crate::lock;
use rc_middleware::QueueGauge;
use std::collections::VecDeque;
use std::sync::Mutex;
use std::time::Instant;

/// Most requests of one client that wait here. Components stop sending long before that.
const MOST_REQUESTS: usize = 256;
/// Upper bound of a waiting request's memory in addition to its body, in bytes.
const OVERHEAD: usize = 512;

/// Why a server refuses a request that found no room.
pub const NO_ROOM: &str = "the queue of the server has no room: too many requests of this client wait already, or the requests of all clients have more bytes than the setting `queue_mib` allows";

/// The requests to a server: one queue for each client `C`, in the order in which the server serves
/// them.
///
/// If there is no room in bytes, the client whose requests have the most bytes loses its newest
/// ones. So a client below an equal share of the room always finds some.
#[derive(Debug)]
pub struct RequestQueues<C, S> {
    queues: Mutex<VecDeque<ClientQueue<C, S>>>,
    /// Counts the bytes of all waiting requests.
    gauge: QueueGauge,
}

#[derive(Debug)]
struct ClientQueue<C, S> {
    client: C,
    waiting: VecDeque<QueuedRequest<S>>,
    bytes: usize,
    /// Whether its first request is looked at, outside of the queue.
    is_out: bool,
}

/// A request that waits.
#[derive(Debug)]
pub struct QueuedRequest<S> {
    /// The request.
    pub sample: S,
    /// Place among the requests of its client.
    order: u64,
    /// When it arrived.
    pub since: Instant,
    size: usize,
}

impl<C: PartialEq + Copy, S> RequestQueues<C, S> {
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

    /// Takes the next request for which `may` holds. Clients take turns. One thread may do so.
    ///
    /// `may` asks the library about the client, which waits for the thread that receives; and that
    /// thread puts requests in here. So no lock is held meanwhile.
    pub fn next(&self, may: impl Fn(&QueuedRequest<S>) -> bool) -> Option<QueuedRequest<S>> {
        for at in 0.. {
            let mut queues = lock(&self.queues);
            let queue = queues.get_mut(at)?;
            let client = queue.client;
            let Some(first) = queue.waiting.pop_front() else {
                continue;
            };
            queue.is_out = true;
            drop(queues);
            let is_served = may(&first);
            let mut queues = lock(&self.queues);
            // Others may have been removed meanwhile, and this one is there.
            let here = |queue: &ClientQueue<C, S>| queue.client == client;
            let place = queues.get(at).filter(|queue| here(queue)).map(|_| at);
            let place = place.or_else(|| queues.iter().position(here))?;
            let queue = &mut queues[place];
            queue.is_out = false;
            if !is_served {
                let place = queue
                    .waiting
                    .partition_point(|request| request.order < first.order);
                queue.waiting.insert(place, first);
                continue;
            }
            queue.bytes -= first.size;
            self.gauge.remove(first.size);
            if let Some(queue) = queues.remove(place).filter(|q| !q.waiting.is_empty()) {
                queues.push_back(queue);
            }
            return Some(first);
        }
        None
    }

    /// Adds a request of `client` with a body of `size` bytes. It comes before the waiting requests
    /// of this client with a higher `order`. Returns the requests without room: this one, or those
    /// that were removed for it.
    pub fn put(&self, (client, order): (C, u64), size: usize, sample: S) -> Vec<S> {
        let size = size.saturating_add(OVERHEAD);
        let mut queues = lock(&self.queues);
        let own = queues.iter().find(|queue| queue.client == client);
        let (number, bytes) = own.map_or((0, 0), |queue| (queue.waiting.len(), queue.bytes));
        if number >= MOST_REQUESTS || size as u64 > self.gauge.limit() {
            self.gauge.drop_one();
            return vec![sample];
        }
        let mut removed = Vec::new();
        while self.gauge.bytes() + size as u64 > self.gauge.limit() {
            let largest = queues.iter_mut().max_by_key(|queue| queue.bytes);
            // No other client has more than this one would have.
            let largest = largest.filter(|queue| queue.bytes > bytes.saturating_add(size));
            let last = largest.and_then(|queue| {
                let last = queue.waiting.pop_back()?;
                queue.bytes -= last.size;
                Some(last)
            });
            let Some(last) = last else {
                self.gauge.drop_one();
                removed.push(sample);
                return removed;
            };
            self.gauge.remove(last.size);
            self.gauge.drop_one();
            removed.push(last.sample);
        }
        self.gauge.add(size);
        queues.retain(|queue| queue.is_out || !queue.waiting.is_empty());
        let own = queues.iter_mut().find(|queue| queue.client == client);
        let waiting = QueuedRequest {
            sample,
            order,
            since: Instant::now(),
            size,
        };
        if let Some(queue) = own {
            let requests = &mut queue.waiting;
            let place = requests.partition_point(|request| request.order <= order);
            requests.insert(place, waiting);
            queue.bytes += size;
        } else {
            queues.push_back(ClientQueue {
                client,
                waiting: VecDeque::from([waiting]),
                bytes: size,
                is_out: false,
            });
        }
        removed
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
        assert!(queues.put((1, 0), 600_000, 'a').is_empty());
        assert_eq!(queues.put((2, 0), 600_000, 'b'), ['b']);
        assert_eq!(queues.gauge().dropped(), 1);
        for _ in 0..MOST_REQUESTS {
            assert!(queues.put((3, 0), 8, 'c').is_empty());
        }
        assert_eq!(queues.put((3, 0), 8, 'd'), ['d']);
        assert_eq!(queues.put((4, 0), 2 << 20, 'e'), ['e']);
        // Requests of many clients without a body are not free.
        for client in 5..10_000 {
            queues.put((client, 0), 0, 'f');
        }
        let mut left = 0;
        while queues.next(|_| true).is_some() {
            left += 1;
        }
        assert!(left <= (1 << 20) / OVERHEAD, "{left}");
        assert_eq!(queues.gauge().bytes(), 0);
    }

    #[test]
    fn requests_arrive_while_one_is_looked_at() {
        let queues = RequestQueues::new(1 << 20);
        queues.put((1, 0), 8, 'a');
        queues.put((2, 0), 8, 'b');
        // A message that comes meanwhile does not wait. Requests that are not served keep their places.
        let next = queues.next(|request| {
            queues.put((1, 0), 8, 'c');
            queues.put((3, 0), 8, 'd');
            request.sample != 'a'
        });
        assert_eq!(next.map(|next| next.sample), Some('b'));
        let rest = std::iter::from_fn(|| queues.next(|_| true));
        let rest: String = rest.map(|next| next.sample).collect();
        // Twice `c` and `d`: `may` was asked twice.
        assert_eq!(rest, "adcdc");
        assert_eq!(queues.gauge().bytes(), 0);
    }

    #[test]
    fn a_client_cannot_take_the_room_of_others() {
        let queues = RequestQueues::new(10 * 100_000);
        let size = 100_000 - OVERHEAD;
        for number in 0..10 {
            assert!(queues.put((1, 0), size, number).is_empty());
        }
        assert_eq!(
            queues.put((1, 0), size, 10),
            [10],
            "its own room is used up"
        );
        // The newest of the client with the most give way, until both have as much.
        for number in 0..5 {
            assert_eq!(queues.put((2, 0), size, 20 + number), [9 - number]);
        }
        assert_eq!(queues.put((2, 0), size, 25), [25]);
        // A small request of a third client costs one of a large one.
        assert_eq!(queues.put((3, 0), 0, 30).len(), 1);
        let mut served = Vec::new();
        while let Some(next) = queues.next(|_| true) {
            served.push(next.sample);
        }
        assert_eq!(served.len(), 10);
        assert!(served.contains(&0) && served.contains(&20) && served.contains(&30));
        assert_eq!(queues.gauge().bytes(), 0);
    }
}
