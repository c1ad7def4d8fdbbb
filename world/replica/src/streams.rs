//! Values of streams: the newest one counts, and lost ones are not repaired, but the last value of
//! each stream arrives in the end.

use property_graph::{Id, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// How many streams a replica holds at most.
const MOST_STREAMS: usize = 1 << 16;

/// A value of a stream.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sample {
    /// The element.
    pub(crate) of: Id,
    /// The attribute.
    pub(crate) name: String,
    /// Greater than the counts of all that the writer had seen, changes among them.
    pub(crate) count: u64,
    /// The writer.
    pub(crate) writer: u64,
    /// The value.
    pub(crate) value: Value,
}

struct Latest {
    count: u64,
    writer: u64,
    value: Value,
    /// How often this replica sends it at most, if it has written it.
    each: Duration,
    /// When it was last sent, or received.
    sent: Option<Duration>,
}

/// The newest values of all streams.
#[derive(Default)]
pub(crate) struct Streams {
    latest: BTreeMap<(Id, String), Latest>,
    /// Those that this replica has written and not sent yet.
    unsent: BTreeSet<(Id, String)>,
}

impl Streams {
    /// Notes a value of this replica, to be sent.
    pub(crate) fn put_own(&mut self, sample: Sample, each: Duration) {
        let key = (sample.of, sample.name);
        let sent = self.latest.get(&key).and_then(|known| known.sent);
        if self.latest.len() >= MOST_STREAMS && !self.latest.contains_key(&key) {
            return;
        }
        let latest = Latest {
            count: sample.count,
            writer: sample.writer,
            value: sample.value,
            each,
            sent,
        };
        self.unsent.insert(key.clone());
        self.latest.insert(key, latest);
    }

    /// Notes a value of another replica. Returns whether it is the newest one.
    pub(crate) fn put(&mut self, sample: &Sample, now: Duration) -> bool {
        let key = (sample.of, sample.name.clone());
        let known = self.latest.get(&key);
        let is_old =
            known.is_some_and(|known| (known.count, known.writer) >= (sample.count, sample.writer));
        if is_old || known.is_none() && self.latest.len() >= MOST_STREAMS {
            return false;
        }
        let latest = Latest {
            count: sample.count,
            writer: sample.writer,
            value: sample.value.clone(),
            each: Duration::ZERO,
            sent: Some(now),
        };
        self.unsent.remove(&key);
        self.latest.insert(key, latest);
        true
    }

    /// The values of an element, with their counts and writers.
    pub(crate) fn of(&self, of: Id) -> impl Iterator<Item = (&str, (u64, u64), &Value)> {
        let all = self.latest.range((of, String::new())..);
        let all = all.take_while(move |((id, _), _)| *id == of);
        all.map(|((_, name), latest)| (name.as_str(), (latest.count, latest.writer), &latest.value))
    }

    /// Drops the values that a change has replaced, and those of elements that are no more.
    pub(crate) fn prune(&mut self, holds: impl Fn(Id, &str, (u64, u64)) -> bool) {
        self.latest
            .retain(|(id, name), latest| holds(*id, name, (latest.count, latest.writer)));
    }

    /// The values that are due, and when the next ones are.
    pub(crate) fn due(&mut self, now: Duration) -> (Vec<Sample>, Option<Duration>) {
        let (mut due, mut next) = (Vec::new(), None::<Duration>);
        let all = &mut self.latest;
        self.unsent.retain(|key| {
            // A change may have replaced it.
            let Some(latest) = all.get_mut(key) else {
                return false;
            };
            let at = latest
                .sent
                .map_or(now, |sent| sent.saturating_add(latest.each));
            if at > now {
                next = Some(next.map_or(at, |next| next.min(at)));
                return true;
            }
            latest.sent = Some(now);
            due.push(sample(key.0, &key.1, latest));
            false
        });
        (due, next)
    }

    /// The values that have not changed since, for replicas that lack some.
    pub(crate) fn before(&self, time: Duration) -> Vec<Sample> {
        let all = self.latest.iter();
        let all = all.filter(|(_, latest)| latest.sent.is_some_and(|sent| sent <= time));
        all.map(|((of, name), latest)| sample(*of, name, latest))
            .collect()
    }

    /// All values.
    pub(crate) fn all(&self) -> Vec<Sample> {
        let all = self.latest.iter();
        all.map(|((of, name), latest)| sample(*of, name, latest))
            .collect()
    }

    /// Equal if two replicas have the same newest values.
    pub(crate) fn digest(&self) -> u64 {
        let mut sum = 0_u64;
        for ((of, name), latest) in &self.latest {
            let mut hash = 0xcbf2_9ce4_8422_2325_u64;
            let numbers = [of.writer(), of.count(), latest.count, latest.writer];
            let numbers = numbers.iter().flat_map(|number| number.to_le_bytes());
            for byte in numbers.chain(name.bytes()) {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
            sum = sum.wrapping_add(hash);
        }
        sum
    }

    pub(crate) fn len(&self) -> usize {
        self.latest.len()
    }
}

fn sample(of: Id, name: &str, latest: &Latest) -> Sample {
    Sample {
        of,
        name: name.to_owned(),
        count: latest.count,
        writer: latest.writer,
        value: latest.value.clone(),
    }
}
