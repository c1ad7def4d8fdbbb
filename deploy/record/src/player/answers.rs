//! Servers that answer as they did: by the same request, at the same time of the recording.

use crate::error::RecordError;
use crate::reader::{Message, Reader, Record};
use crate::{envelope, keys};
use rc_middleware::backend::Profile;
use rc_middleware::rpc::Outcome;
use rc_middleware::{Writer, rpc};
use rc_observe::{Network, Responder, Service};
use rc_values::{Interface, Pattern};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

/// The most bytes of recorded calls that are kept.
const MOST: usize = 256 * 1024 * 1024;
/// Approximate memory of a call in addition to its bytes.
const OVERHEAD: usize = 64;

/// Servers that answer as they did.
pub(super) struct Answers {
    responder: Responder,
    services: Vec<ServiceReplies>,
    answered: u64,
    /// Calls whose parameters were not recorded.
    guessed: u64,
}

/// Recorded replies of one service.
struct ServiceReplies {
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
struct CallKey {
    interface: String,
    operation: String,
    address: String,
}

type Recorded = BTreeMap<CallKey, Rc<Calls>>;

impl Answers {
    /// Reads all calls of a recording, and serves what components require, was recorded, and has no
    /// server. Returns what there is to say.
    /// `see` is called with each message, and says whether to go on reading.
    pub(super) fn open(
        path: &Path,
        network: &Network,
        see: &mut dyn FnMut(&Message) -> bool,
    ) -> Result<(Self, Vec<String>), RecordError> {
        let mut notes = Vec::new();
        let services = network.services();
        let operations = services.iter().flat_map(|service| {
            let all = service.interface.operations.iter();
            all.map(|one| (service.interface.name.as_str(), one))
        });
        let commands = operations.filter(|(_, one)| one.pattern != Pattern::Query);
        let commands = commands.map(|(name, one)| (name, one.name.as_str()));
        let recorded = read(path, &commands.collect(), &mut notes, see)?;
        let mut answers = Self {
            responder: Responder::new(network)?,
            services: Vec::new(),
            answered: 0,
            guessed: 0,
        };
        for service in services {
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
            answers.services.push(ServiceReplies {
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

    /// Answers the calls that are there. `position` is a time of the recording. Returns what was
    /// wrong with calls.
    pub(super) fn serve(&mut self, position: u64) -> Vec<String> {
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
        })
    }

    pub(super) fn finish(self) {
        self.responder.finish();
    }
}

/// A reply that says that there is none. ROS 2 has no such reply; its client waits for its limit.
fn refusal(profile: Profile, id: rpc::RequestId) -> Option<Vec<u8>> {
    if profile == Profile::Bare {
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

/// Reads all calls of a recording. `commands` are the operations without a reply, by interface.
fn read(
    path: &Path,
    commands: &BTreeSet<(&str, &str)>,
    notes: &mut Vec<String>,
    see: &mut dyn FnMut(&Message) -> bool,
) -> Result<Recorded, RecordError> {
    let mut recorded = Recorded::new();
    // The requests without their replies, by place, client and number.
    let mut open: HashMap<(CallKey, String, u32), Vec<u8>> = HashMap::new();
    let (mut held, mut is_full) = (0, false);
    let mut reader = Reader::open(path)?;
    while let Some(record) = reader.next() {
        let Record::Message(message) = record else {
            continue;
        };
        if !see(&message) {
            break;
        }
        let channel = &message.channel;
        let kind = channel.get(keys::KIND);
        if is_full || !matches!(kind, Some("request" | "reply")) {
            continue;
        }
        let entry = |name: &str| channel.get(name).unwrap_or_default().to_owned();
        let place = CallKey {
            interface: entry(keys::INTERFACE),
            operation: entry(keys::OPERATION),
            address: entry(keys::ADDRESS),
        };
        let calls = Rc::make_mut(recorded.entry(place.clone()).or_default());
        calls.hash = entry(keys::HASH);
        let sender = entry(keys::SENDER);
        let is_request = kind == Some("request");
        // No reply follows a command, and none can be told apart from those of other clients.
        let is_alone = sender.is_empty()
            || commands.contains(&(place.interface.as_str(), place.operation.as_str()));
        if is_request && is_alone {
            continue;
        }
        held += message.data.len() + OVERHEAD;
        if is_request {
            held += place.interface.len() + place.operation.len();
            held += place.address.len() + sender.len() + size_of::<(CallKey, String)>();
        }
        if held > MOST {
            let most = MOST >> 20;
            notes.push(format!(
                "the recording holds more than {most} MiB of calls; the later ones are left out"
            ));
            is_full = true;
            open.clear();
            continue;
        }
        let key = (place, sender, message.sequence);
        if is_request {
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

/// The recorded calls of a service, by operation: those of the same place in the network, else
/// those of the only place with this interface.
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

    #[test]
    fn only_replies_of_a_known_client_belong_to_a_request() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("x.mcap");
        let mut writer = crate::Writer::create(&path, crate::Limits::default()).expect("a file");
        let calls = [("ask", "01"), ("ask", ""), ("go", "01")];
        for (operation, sender) in calls {
            for (kind, data) in [("request", [1]), ("reply", [2])] {
                let metadata = [
                    (keys::KIND, kind),
                    (keys::INTERFACE, "A"),
                    (keys::OPERATION, operation),
                    (keys::ADDRESS, "n/a"),
                    (keys::SENDER, sender),
                ];
                let metadata = metadata.map(|(key, text)| (key.to_owned(), text.to_owned()));
                let topic = format!("/{operation}/{kind}");
                let channel = writer.channel(&topic, "cdr", None, metadata.into());
                let stamp = crate::Stamp {
                    log_time: 1,
                    publish_time: 1,
                    sequence: 1,
                };
                writer.write(channel, stamp, &data).expect("to write");
            }
        }
        writer.finish().expect("to finish");
        let (mut notes, mut seen) = (Vec::new(), 0);
        let commands = BTreeSet::from([("A", "go")]);
        let recorded = read(&path, &commands, &mut notes, &mut |_| {
            seen += 1;
            true
        });
        let recorded = recorded.expect("calls");
        let counts = |operation: &str| {
            let (_, calls) = recorded.iter().find(|(at, _)| at.operation == operation)?;
            Some((calls.replies.len(), calls.by_request.len()))
        };
        assert_eq!((counts("ask"), counts("go")), (Some((2, 1)), Some((1, 0))));
        assert_eq!((notes, seen), (Vec::new(), 6));
        // What sees the messages may end the reading.
        let none = read(&path, &commands, &mut Vec::new(), &mut |_| false);
        assert_eq!(none.expect("nothing").len(), 0);
    }
}
