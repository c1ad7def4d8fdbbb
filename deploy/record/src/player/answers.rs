//! Servers that answer as they did: by the same request, at the same time of the recording.

use crate::error::RecordError;
use crate::reader::{Reader, Record};
use crate::{envelope, keys};
use rc_middleware::backend::Profile;
use rc_middleware::rpc::Outcome;
use rc_middleware::{Writer, rpc};
use rc_observe::{Network, Responder, Service};
use rc_values::{Interface, Pattern};
use std::collections::{BTreeMap, HashMap};
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

/// The most bytes of recorded calls that are kept.
const MOST: usize = 256 * 1024 * 1024;
/// What a call takes in memory beside its bytes, about.
const OVERHEAD: usize = 64;

/// Servers that answer as they did.
pub(super) struct Answers {
    responder: Responder,
    services: Vec<Answering>,
    answered: u64,
    /// Calls whose parameters were not recorded.
    guessed: u64,
}

/// What one service answers.
struct Answering {
    interface: Arc<Interface>,
    /// For each operation its calls.
    calls: BTreeMap<String, Rc<Calls>>,
}

/// The recorded calls of an operation at one address.
#[derive(Clone, Default)]
struct Calls {
    hash: String,
    /// The replies in the order of their times.
    replies: Vec<(u64, Arc<[u8]>)>,
    /// Where the replies to a request are.
    by_request: HashMap<Vec<u8>, Vec<usize>>,
}

/// Where calls were recorded.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Place {
    interface: String,
    operation: String,
    address: String,
}

type Recorded = BTreeMap<Place, Rc<Calls>>;

impl Answers {
    /// Reads all calls of a recording, and serves what components require, was recorded, and has no
    /// server. Returns what there is to say.
    pub(super) fn open(path: &Path, network: &Network) -> Result<(Self, Vec<String>), RecordError> {
        let mut notes = Vec::new();
        let recorded = read(path, &mut notes)?;
        let mut answers = Self {
            responder: Responder::new(network)?,
            services: Vec::new(),
            answered: 0,
            guessed: 0,
        };
        for service in network.services() {
            if service.clients.is_empty() {
                continue;
            }
            let calls = calls_of(&service, &recorded, &mut notes);
            if calls.is_empty() {
                continue;
            }
            if let Some(server) = service.servers.first() {
                notes.push(format!("{server} runs, so it answers its calls itself"));
                continue;
            }
            answers.responder.open(network, &service)?;
            answers.services.push(Answering {
                interface: service.interface,
                calls,
            });
        }
        Ok((answers, notes))
    }

    pub(super) fn counts(&self) -> (u64, u64) {
        (self.answered, self.guessed)
    }

    pub(super) fn descriptors(&self) -> Vec<BorrowedFd<'_>> {
        self.responder.descriptors().collect()
    }

    /// Answers the calls that are there. `position` is a time of the recording.
    pub(super) fn serve(&mut self, position: u64) -> Result<(), RecordError> {
        let (services, answered, guessed) = (&self.services, &mut self.answered, &mut self.guessed);
        self.responder.serve(&mut |number, profile, body| {
            let service = services.get(number)?;
            let asked = envelope::request(&service.interface, profile, body)?;
            let operation = asked.operation;
            if operation.pattern != Pattern::Query {
                *answered += 1;
                return None;
            }
            let calls = service.calls.get(&operation.name);
            let Some((reply, is_same)) = calls.and_then(|c| c.choose(&asked.data, position)) else {
                return refusal(profile, asked.id);
            };
            *answered += 1;
            *guessed += u64::from(!is_same);
            envelope::answer(operation, profile, asked.id, reply).ok()
        })?;
        Ok(())
    }

    pub(super) fn finish(self) {
        self.responder.finish();
    }
}

/// A reply that says that there is none. ROS 2 has no such reply; its client waits for its limit.
fn refusal(profile: Profile, id: rpc::RequestId) -> Option<Vec<u8>> {
    if profile == Profile::Ros {
        return None;
    }
    let mut writer = Writer::default();
    let reason = "the recording has no reply of this operation";
    rpc::refuse(&mut writer, id, Outcome::Unsupported, reason);
    Some(writer.into_bytes())
}

impl Calls {
    /// The reply to the same request, else to any: the last one before this time, else the first.
    /// And whether the request was the same.
    fn choose(&self, asked: &[u8], position: u64) -> Option<(&[u8], bool)> {
        let same = self.by_request.get(asked);
        let reply = if let Some(places) = same {
            let before = places.partition_point(|at| self.replies[*at].0 <= position);
            self.replies.get(*places.get(before.saturating_sub(1))?)
        } else {
            let before = self.replies.partition_point(|(time, _)| *time <= position);
            self.replies.get(before.saturating_sub(1))
        };
        Some((&reply?.1, same.is_some()))
    }
}

/// Reads all calls of a recording.
fn read(path: &Path, notes: &mut Vec<String>) -> Result<Recorded, RecordError> {
    let mut recorded = Recorded::new();
    // The requests without their replies, by place, client and number.
    let mut open: HashMap<(Place, String, u32), Vec<u8>> = HashMap::new();
    let mut held = 0;
    let mut reader = Reader::open(path)?;
    while let Some(record) = reader.next() {
        let Record::Message(message) = record else {
            continue;
        };
        let channel = &message.channel;
        let kind = channel.get(keys::KIND);
        if !matches!(kind, Some("request" | "reply")) {
            continue;
        }
        let entry = |name: &str| channel.get(name).unwrap_or_default().to_owned();
        let place = Place {
            interface: entry(keys::INTERFACE),
            operation: entry(keys::OPERATION),
            address: entry(keys::ADDRESS),
        };
        held += message.data.len() + OVERHEAD;
        if held > MOST {
            let most = MOST >> 20;
            notes.push(format!(
                "the recording holds more than {most} MiB of calls; the later ones are left out"
            ));
            break;
        }
        let calls = Rc::make_mut(recorded.entry(place.clone()).or_default());
        calls.hash = entry(keys::HASH);
        let key = (place, entry(keys::SENDER), message.sequence);
        if kind == Some("request") {
            open.insert(key, message.data);
            continue;
        }
        let at = calls.replies.len();
        // A component may answer while the clock of its machine is set back.
        let last = calls.replies.last().map_or(0, |(time, _)| *time);
        let time = message.log_time.max(last);
        calls.replies.push((time, message.data.into()));
        if let Some(request) = open.remove(&key) {
            calls.by_request.entry(request).or_default().push(at);
        }
    }
    Ok(recorded)
}

/// The recorded calls of a service, by operation: those of the same place in the network, else those
/// of the only place with this interface.
fn calls_of(
    service: &Service,
    recorded: &Recorded,
    notes: &mut Vec<String>,
) -> BTreeMap<String, Rc<Calls>> {
    let mut found = BTreeMap::new();
    for operation in &service.interface.operations {
        let of_operation = || {
            recorded.iter().filter(|(place, _)| {
                place.operation == operation.name && place.interface == service.interface.name
            })
        };
        let rest = super::rest;
        let mut same =
            of_operation().filter(|(place, _)| rest(&place.address) == rest(&service.address));
        let mut all = of_operation();
        let only = all.next().filter(|_| all.next().is_none());
        let Some((place, calls)) = same.next().or(only) else {
            continue;
        };
        if calls.hash != format!("{:016x}", operation.hash) {
            notes.push(format!(
                "calls of {}.{} are not answered: their types have changed since",
                place.interface, place.operation
            ));
            continue;
        }
        found.insert(operation.name.clone(), Rc::clone(calls));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reply_to_the_same_request_at_the_same_time_is_chosen() {
        let mut calls = Calls::default();
        for (time, request, reply) in [(10, 1, 11), (20, 2, 12), (30, 1, 13)] {
            calls.replies.push((time, Arc::from([reply])));
            let places = calls.by_request.entry(vec![request]).or_default();
            places.push(calls.replies.len() - 1);
        }
        let choose = |request: u8, at| calls.choose(&[request], at).map(|(r, same)| (r[0], same));
        assert_eq!(choose(1, 5), Some((11, true)));
        assert_eq!(choose(1, 29), Some((11, true)));
        assert_eq!(choose(1, 30), Some((13, true)));
        assert_eq!(choose(2, 99), Some((12, true)));
        assert_eq!(choose(9, 25), Some((12, false)));
        assert_eq!(Calls::default().choose(&[1], 5), None);
    }
}
