//! What has come and was not read yet, and how the numbers beside a sample become a header.

use crate::{Guid, lock};
use rc_middleware::rpc::RequestId;
use rc_middleware::{Encoding, Header, backend};
use rustix::time::{ClockId, clock_gettime};
use std::collections::{BTreeSet, VecDeque};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Of one client, how many requests wait here at most, and of all together how many bytes. Clients of ours stop long
/// before that.
const MOST_REQUESTS: usize = 256;
const MOST_BYTES: usize = 256 << 20;
/// Of how many senders of a topic it is known what they sent last.
const MOST_SENDERS: usize = 256;
/// How many answers to one client may be unread. There are as many as there are requests, unless somebody floods it.
const MOST_ANSWERS: usize = 256;

/// What travels beside the body of a sample. The hash is that of the sender's types, where it tells one.
pub fn header(sequence: u64, stamp: i64, sender: u128, type_hash: u64) -> Header {
    Header {
        type_hash,
        sequence,
        sent: sent(stamp),
        encoding: Encoding::Cdr,
        sender,
    }
}

/// Nanoseconds since 1970.
fn wall_clock() -> i64 {
    let time = clock_gettime(ClockId::Realtime);
    time.tv_sec * 1_000_000_000 + time.tv_nsec
}

/// The stamp of DDS, which is of the wall clock, for a time of the monotonic clock.
pub fn stamp(sent: u64) -> i64 {
    let age = match sent {
        0 => 0,
        sent => backend::now().saturating_sub(sent),
    };
    wall_clock() - age as i64
}

/// How long ago a sample with this stamp was sent.
pub fn age(stamp: i64) -> Duration {
    let age = wall_clock().saturating_sub(stamp);
    Duration::from_nanos(u64::try_from(age).unwrap_or(0))
}

/// The other way round; what comes from the future, by the clock of another machine, comes from now.
fn sent(stamp: i64) -> u64 {
    let age = wall_clock().saturating_sub(stamp).max(0).unsigned_abs();
    backend::now().saturating_sub(age)
}

/// The last values of a topic.
#[derive(Debug)]
pub struct SampleQueue<S> {
    samples: Mutex<VecDeque<S>>,
    depth: usize,
}

impl<S> SampleQueue<S> {
    /// Room for `depth` of them, and for one at least.
    pub fn new(depth: u32) -> Self {
        Self {
            samples: Mutex::new(VecDeque::new()),
            depth: (depth as usize).max(1),
        }
    }

    /// Takes the oldest one.
    pub fn next(&self) -> Option<S> {
        lock(&self.samples).pop_front()
    }

    /// Keeps one; where there is no room, the oldest one goes.
    pub fn put(&self, sample: S) {
        let mut samples = lock(&self.samples);
        if samples.len() >= self.depth {
            samples.pop_front();
        }
        samples.push_back(sample);
    }
}

/// What was heard of the senders of a topic, the last one first.
///
/// The library knows nothing any more of a sender that was out of reach: found again, it sends again what it keeps for
/// those who come late.
#[derive(Debug, Default)]
pub struct DuplicateFilter(Vec<(u128, u64)>);

impl DuplicateFilter {
    /// Notes a value; says whether it is new.
    pub fn is_new(&mut self, sender: u128, sequence: u64) -> bool {
        let Some(at) = self.0.iter().position(|(known, _)| *known == sender) else {
            self.0.truncate(MOST_SENDERS - 1);
            self.0.insert(0, (sender, sequence));
            return true;
        };
        self.0[..=at].rotate_right(1);
        let last = &mut self.0[0].1;
        // Nothing is known of one who does not count.
        let is_new = sequence == 0 || sequence > *last;
        *last = sequence.max(*last);
        is_new
    }
}

/// The answers to one client.
#[derive(Debug)]
pub struct ReplyQueue<S> {
    /// The client, as its requests name it.
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
    /// From now on, answers to this client are kept.
    pub fn of(&self, client: Guid) {
        let _ = self.client.set(client);
    }

    /// Takes the oldest one.
    pub fn next(&self) -> Option<(RequestId, S)> {
        lock(&self.samples).pop_front()
    }

    /// Keeps the answer to a request, if it is one of this client: every client hears the answers to all.
    pub fn put(&self, id: RequestId, sample: S) {
        if Some(&id.writer) != self.client.get() {
            return;
        }
        let mut samples = lock(&self.samples);
        if samples.len() >= MOST_ANSWERS {
            samples.pop_front();
        }
        samples.push_back((id, sample));
    }
}

/// The requests to a server, a queue for each client `C`, in the order in which they are served next.
#[derive(Debug)]
pub struct RequestQueues<C, S>(Mutex<Queues<C, S>>);

#[derive(Debug)]
struct Queues<C, S> {
    clients: VecDeque<(C, VecDeque<QueuedRequest<S>>)>,
    /// How large what waits is.
    bytes: usize,
    /// What found no place, to be refused.
    refused: BTreeSet<(Guid, u64)>,
}

/// A request that has come.
#[derive(Debug)]
pub struct QueuedRequest<S> {
    /// What has come.
    pub sample: S,
    /// When.
    pub since: Instant,
    size: usize,
}

impl<C, S> Default for RequestQueues<C, S> {
    fn default() -> Self {
        Self(Mutex::new(Queues {
            clients: VecDeque::new(),
            bytes: 0,
            refused: BTreeSet::new(),
        }))
    }
}

impl<C: PartialEq, S> RequestQueues<C, S> {
    /// Takes the next request that `may` be served; who was served waits until all others were.
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

    /// A request that is to be refused.
    pub fn refused(&self) -> Option<RequestId> {
        let (writer, sequence) = lock(&self.0).refused.pop_first()?;
        Some(RequestId { writer, sequence })
    }

    /// Whether a request waits.
    pub fn waits(&self) -> bool {
        !lock(&self.0).clients.is_empty()
    }

    /// Keeps a request of `client` with a body of `size` bytes; where there is no room, the one that `id` gives is refused.
    pub fn put(&self, client: C, size: usize, sample: S, id: impl FnOnce(&S) -> Option<RequestId>) {
        let mut queues = lock(&self.0);
        let at = queues.clients.iter().position(|(c, _)| *c == client);
        // One that is large is served where it is alone.
        let is_room = at.is_none_or(|at| queues.clients[at].1.len() < MOST_REQUESTS)
            && (queues.bytes == 0 || queues.bytes + size <= MOST_BYTES);
        if is_room {
            let waiting = QueuedRequest {
                sample,
                since: Instant::now(),
                size,
            };
            queues.bytes += size;
            match at {
                Some(at) => queues.clients[at].1.push_back(waiting),
                None => queues
                    .clients
                    .push_back((client, VecDeque::from([waiting]))),
            }
        } else if queues.refused.len() < MOST_REQUESTS
            && let Some(id) = id(&sample)
        {
            queues.refused.insert((id.writer, id.sequence));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sent_again_is_not_new() {
        let mut heard = DuplicateFilter::default();
        let mut new = |sender, numbers: &[u64]| -> Vec<bool> {
            numbers.iter().map(|n| heard.is_new(sender, *n)).collect()
        };
        assert_eq!(new(1, &[7, 8, 10]), [true; 3]);
        assert_eq!(new(2, &[8, 9]), [true; 2]);
        assert_eq!(new(1, &[9, 10, 11]), [false, false, true]);
        assert_eq!(new(3, &[0, 0]), [true; 2]);
        for sender in 10..1000 {
            assert_eq!(new(sender, &[5, 4]), [true, false]);
        }
        assert_eq!(heard.0.len(), MOST_SENDERS);
    }

    #[test]
    fn a_time_goes_there_and_back() {
        let before = backend::now();
        let there = stamp(before);
        let back = sent(there);
        assert!(back <= backend::now());
        // By the clock of another machine, it was sent in a second.
        let ahead = sent(there + 1_000_000_000);
        assert!((before..=backend::now()).contains(&ahead));
    }
}
