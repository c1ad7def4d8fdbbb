//! What has come and was not read yet, and how a sample becomes a header and a body.

use crate::ear::Inbox;
use crate::report::Seldom;
use crate::session::lock;
use rc_ddsc::{Guid, Sample};
use rc_middleware::rpc::{self, RequestId};
use rc_middleware::{Encoding, Header, backend};
use rustix::time::{ClockId, clock_gettime};
use std::collections::{BTreeSet, VecDeque};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

/// The bytes before a body (RTPS 2.5, 10.2): the representation, and how many bytes pad the body.
const ENCAPSULATION: usize = 4;
/// Of one client, how many requests wait here at most, and of all together how many bytes. Clients of ours stop long
/// before that.
const MOST_REQUESTS: usize = 256;
const MOST_BYTES: usize = 256 << 20;
/// Of how many senders of a topic it is known what they sent last.
const MOST_SENDERS: usize = 256;
/// How many answers to one client may be unread. There are as many as there are requests, unless somebody floods it.
const MOST_ANSWERS: usize = 256;

/// The body of a sample, or why it has none.
pub(crate) fn body(sample: &[u8]) -> Result<&[u8], String> {
    let Some((head, body)) = sample.split_at_checked(ENCAPSULATION) else {
        return Err(format!(
            "a sample of {} bytes has no encapsulation",
            sample.len()
        ));
    };
    match head[..2] {
        [0, 1] => {}
        [0, 0] => return Err("a sample is big endian; only little endian is read".to_owned()),
        [a, b] => {
            return Err(format!(
                "a sample has the representation {a:02x}{b:02x}; only XCDR1, little endian (0001), is read"
            ));
        }
        _ => return Err("a sample has no encapsulation".to_owned()),
    }
    let padding = usize::from(head[3] & 3);
    Ok(&body[..body.len().saturating_sub(padding)])
}

/// What travels beside the body of a sample. The hash is that of the sender's types, where it tells one.
pub(crate) fn header(sample: &Sample, sender: u128, type_hash: u64) -> Header {
    Header {
        type_hash,
        sequence: sample.sequence(),
        sent: sent(sample.stamp()),
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
pub(crate) fn stamp(sent: u64) -> i64 {
    let age = match sent {
        0 => 0,
        sent => backend::now().saturating_sub(sent),
    };
    wall_clock() - age as i64
}

/// How long ago a sample was sent.
pub(crate) fn age(sample: &Sample) -> Duration {
    let age = wall_clock().saturating_sub(sample.stamp());
    Duration::from_nanos(u64::try_from(age).unwrap_or(0))
}

/// The other way round; what comes from the future, by the clock of another machine, comes from now.
fn sent(stamp: i64) -> u64 {
    let age = wall_clock().saturating_sub(stamp).max(0).unsigned_abs();
    backend::now().saturating_sub(age)
}

/// The last values of a topic.
pub(crate) struct Values {
    samples: Mutex<VecDeque<Sample>>,
    depth: usize,
}

impl Values {
    pub(crate) fn new(depth: u32) -> Self {
        Self {
            samples: Mutex::default(),
            depth: (depth as usize).max(1),
        }
    }

    pub(crate) fn next(&self) -> Option<Sample> {
        lock(&self.samples).pop_front()
    }
}

impl Inbox for Values {
    fn put(&self, sample: Sample) {
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
#[derive(Default)]
pub(crate) struct Heard(Vec<(u128, u64)>);

impl Heard {
    /// Notes a value; says whether it is new.
    pub(crate) fn is_new(&mut self, sender: u128, sequence: u64) -> bool {
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
pub(crate) struct Answers {
    /// Whom it calls.
    address: String,
    /// The client, as its requests name it.
    client: OnceLock<Guid>,
    samples: Mutex<VecDeque<(RequestId, Sample)>>,
    seldom: Seldom,
}

impl Answers {
    pub(crate) fn new(address: &str) -> Self {
        Self {
            address: address.to_owned(),
            client: OnceLock::new(),
            samples: Mutex::default(),
            seldom: Seldom::default(),
        }
    }

    /// From now on, answers to this client are kept.
    pub(crate) fn of(&self, client: Guid) {
        let _ = self.client.set(client);
    }

    pub(crate) fn next(&self) -> Option<(RequestId, Sample)> {
        lock(&self.samples).pop_front()
    }
}

impl Inbox for Answers {
    fn put(&self, sample: Sample) {
        let envelope = |body| rpc::request_id(body).ok_or_else(|| "it has no envelope".to_owned());
        let id = match body(&sample).and_then(envelope) {
            Ok(id) => id,
            Err(reason) => {
                if let Some(passed) = self.seldom.now() {
                    let (count, address) = (passed + 1, &self.address);
                    tracing::warn!("`{address}` sent what is no reply ({count} times): {reason}");
                }
                return;
            }
        };
        // Every client hears the answers to all.
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

/// The requests to a server, a queue for each client, in the order in which they are served next.
#[derive(Default)]
pub(crate) struct Requests(Mutex<Queues>);

#[derive(Default)]
struct Queues {
    clients: VecDeque<(u64, VecDeque<Waiting>)>,
    /// How large what waits is.
    bytes: usize,
    /// What found no place, to be refused.
    refused: BTreeSet<(Guid, u64)>,
}

/// A request that has come.
pub(crate) struct Waiting {
    pub(crate) sample: Sample,
    pub(crate) since: Instant,
}

impl Requests {
    /// Takes the next request that `may` be served; who was served waits until all others were.
    pub(crate) fn next(&self, may: impl Fn(&Waiting) -> bool) -> Option<Waiting> {
        let mut queues = lock(&self.0);
        let at = queues
            .clients
            .iter()
            .position(|(_, waiting)| waiting.front().is_some_and(&may))?;
        let (client, mut waiting) = queues.clients.remove(at)?;
        let next = waiting.pop_front()?;
        queues.bytes -= next.sample.len();
        if !waiting.is_empty() {
            queues.clients.push_back((client, waiting));
        }
        Some(next)
    }

    /// A request that is to be refused.
    pub(crate) fn refused(&self) -> Option<RequestId> {
        let (writer, sequence) = lock(&self.0).refused.pop_first()?;
        Some(RequestId { writer, sequence })
    }
}

impl Inbox for Requests {
    fn waits(&self) -> bool {
        !lock(&self.0).clients.is_empty()
    }

    fn put(&self, sample: Sample) {
        let mut queues = lock(&self.0);
        let (client, size) = (sample.writer(), sample.len());
        let at = queues.clients.iter().position(|(c, _)| *c == client);
        // One that is large is served where it is alone.
        let is_room = at.is_none_or(|at| queues.clients[at].1.len() < MOST_REQUESTS)
            && (queues.bytes == 0 || queues.bytes + size <= MOST_BYTES);
        if is_room {
            let since = Instant::now();
            let waiting = Waiting { sample, since };
            queues.bytes += size;
            match at {
                Some(at) => queues.clients[at].1.push_back(waiting),
                None => queues
                    .clients
                    .push_back((client, VecDeque::from([waiting]))),
            }
        } else if queues.refused.len() < MOST_REQUESTS
            && let Some(id) = body(&sample).ok().and_then(rpc::request_id)
        {
            queues.refused.insert((id.writer, id.sequence));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_is_what_is_behind_the_encapsulation_and_before_the_padding() {
        assert_eq!(body(&[0, 1, 0, 0, 7, 8]), Ok(&[7, 8][..]));
        assert_eq!(body(&[0, 1, 0, 3, 7, 0, 0, 0]), Ok(&[7][..]));
        assert_eq!(body(&[0, 1, 0, 3]), Ok(&[][..]));
        for wrong in [&[][..], &[0, 1, 0], &[0, 0, 0, 0, 1], &[0, 7, 0, 0, 1]] {
            assert!(body(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn what_is_sent_again_is_not_new() {
        let mut heard = Heard::default();
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
