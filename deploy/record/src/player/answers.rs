//! Servers that repeat recorded answers: by the same request, at the same time of the recording.
//!
//! A call may be answered by a later reply of the recording, so a thread reads all calls while the
//! player begins. Calls that come before are answered when it has finished.

use crate::error::RecordError;
use crate::reader::{Channel, Reader, Record};
use crate::{envelope, keys};
use rc_middleware::backend::Profile;
use rc_middleware::rpc::Outcome;
use rc_middleware::{Writer, rpc};
use rc_observe::{Network, Responder, Service};
use rc_values::Pattern;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::os::fd::BorrowedFd;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// The most bytes of recorded calls that are kept.
const MOST: usize = 256 * 1024 * 1024;
/// Approximate memory of a call in addition to its bytes.
const OVERHEAD: usize = 64;

/// Servers that answer as they did.
pub(super) struct Answers {
    responder: Responder,
    services: Vec<ServiceReplies>,
    /// The thread that reads the calls, until it has.
    loading: Option<Loading>,
    notes: Vec<String>,
    answered: u64,
    /// Calls whose parameters were not recorded.
    guessed: u64,
}

struct Loading {
    thread: JoinHandle<Result<(Recorded, Vec<String>), RecordError>>,
    /// Ends the thread when its result is no longer needed.
    _end: EndOnDrop,
}

struct EndOnDrop(Arc<AtomicBool>);

impl Drop for EndOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Recorded replies of one service.
struct ServiceReplies {
    service: Service,
    /// For each operation its calls.
    calls: BTreeMap<String, Arc<Calls>>,
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

type Recorded = BTreeMap<CallKey, Arc<Calls>>;

impl CallKey {
    fn of(channel: &Channel) -> Self {
        let entry = |name: &str| channel.get(name).unwrap_or_default().to_owned();
        Self {
            interface: entry(keys::INTERFACE),
            operation: entry(keys::OPERATION),
            address: entry(keys::ADDRESS),
        }
    }
}

fn hash(channel: &Channel) -> String {
    channel.get(keys::HASH).unwrap_or_default().to_owned()
}

/// Operations without a reply, by interface.
type Commands = BTreeSet<(String, String)>;

fn commands(services: &[Service]) -> Commands {
    let operations = services.iter().flat_map(|service| {
        let all = service.interface.operations.iter();
        all.map(|one| (service.interface.name.clone(), one))
    });
    let commands = operations.filter(|(_, one)| one.pattern != Pattern::Query);
    commands
        .map(|(interface, one)| (interface, one.name.clone()))
        .collect()
}

impl Answers {
    /// Serves the required interfaces that were recorded and have no server, and begins to read the
    /// calls. `channels` are those of the recording that have messages. Returns notes.
    pub(super) fn open(
        path: &Path,
        network: &Network,
        channels: &[Arc<Channel>],
        stop: Arc<AtomicBool>,
    ) -> Result<(Self, Vec<String>), RecordError> {
        let mut notes = Vec::new();
        let mut answers = Self {
            responder: Responder::new(network)?,
            services: Vec::new(),
            loading: None,
            notes: Vec::new(),
            answered: 0,
            guessed: 0,
        };
        let services = network.services();
        let commands = commands(&services);
        let mut recorded = Recorded::new();
        for channel in channels {
            if matches!(channel.get(keys::KIND), Some("request" | "reply")) {
                let calls = recorded.entry(CallKey::of(channel)).or_default();
                Arc::make_mut(calls).hash = hash(channel);
            }
        }
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
            answers.services.push(ServiceReplies { service, calls });
        }
        if !answers.services.is_empty() {
            let is_over = Arc::new(AtomicBool::new(false));
            let (path, over) = (path.to_owned(), Arc::clone(&is_over));
            let thread = std::thread::Builder::new().name("answers".to_owned());
            let thread = thread.spawn(move || {
                let mut notes = Vec::new();
                let goes_on = || {
                    let ends = [&stop, &over];
                    !ends.iter().any(|end| end.load(Ordering::Relaxed))
                };
                let recorded = read(&path, &commands, &mut notes, &goes_on)?;
                Ok((recorded, notes))
            });
            let thread = thread.map_err(|e| RecordError::file(Path::new("a thread"), &e))?;
            answers.loading = Some(Loading {
                thread,
                _end: EndOnDrop(is_over),
            });
        }
        Ok((answers, notes))
    }

    /// Takes the calls when the thread has read them.
    fn load(&mut self) {
        let is_ready = |loading: &mut Loading| loading.thread.is_finished();
        let Some(loading) = self.loading.take_if(is_ready) else {
            return;
        };
        let panicked = || RecordError::Value("the thread that reads the calls panicked".to_owned());
        match loading.thread.join().unwrap_or_else(|_| Err(panicked())) {
            Ok((recorded, notes)) => {
                self.notes.extend(notes);
                for ServiceReplies { service, calls } in &mut self.services {
                    // Differences were reported when it began.
                    *calls = calls_of(service, &recorded, &mut Vec::new());
                }
            }
            Err(error) => self.notes.push(error.to_string()),
        }
    }

    pub(super) fn counts(&self) -> (u64, u64) {
        (self.answered, self.guessed)
    }

    pub(super) fn descriptors(&self) -> Vec<BorrowedFd<'_>> {
        if self.loading.is_some() {
            return Vec::new();
        }
        self.responder.descriptors().collect()
    }

    /// Answers the received calls. `position` is a time of the recording. Returns errors of calls.
    pub(super) fn serve(&mut self, position: u64) -> Vec<String> {
        self.load();
        let mut notes = std::mem::take(&mut self.notes);
        if self.loading.is_some() {
            return notes;
        }
        let (services, answered, guessed) = (&self.services, &mut self.answered, &mut self.guessed);
        let errors = self.responder.serve(&mut |number, profile, body| {
            let replies = services.get(number)?;
            let asked = envelope::request(&replies.service.interface, profile, body)?;
            let operation = asked.operation;
            if operation.pattern != Pattern::Query {
                *answered += 1;
                return None;
            }
            let calls = replies.calls.get(&operation.name);
            let Some((reply, is_same)) = calls.and_then(|c| c.choose(&asked.data, position)) else {
                return refusal(profile, asked.id);
            };
            *answered += 1;
            *guessed += u64::from(!is_same);
            envelope::answer(operation, profile, asked.id, reply).ok()
        });
        let errors = errors.into_iter();
        notes.extend(errors.map(|error| format!("a call cannot be answered: {error}")));
        notes
    }

    /// Waits until the last replies have arrived.
    pub(super) fn finish(self) {
        self.responder.finish();
    }
}

/// A reply that says that none was recorded. ROS 2 has no such reply; its client waits for its
/// limit.
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
    /// Also returns whether the request was the same.
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

/// Reads all calls of a recording, until `goes_on` says no.
fn read(
    path: &Path,
    commands: &Commands,
    notes: &mut Vec<String>,
    goes_on: &dyn Fn() -> bool,
) -> Result<Recorded, RecordError> {
    let mut recorded = Recorded::new();
    // The requests without their replies, by place, client and number.
    let mut open: HashMap<(CallKey, String, u32), Vec<u8>> = HashMap::new();
    let mut held = 0;
    let mut reader = Reader::open(path)?;
    while let Some(record) = reader.next() {
        let Record::Message(message) = record else {
            continue;
        };
        if !goes_on() {
            break;
        }
        let channel = &message.channel;
        let kind = channel.get(keys::KIND);
        if !matches!(kind, Some("request" | "reply")) {
            continue;
        }
        let place = CallKey::of(channel);
        let calls = Arc::make_mut(recorded.entry(place.clone()).or_default());
        calls.hash = hash(channel);
        let sender = channel.get(keys::SENDER).unwrap_or_default().to_owned();
        let is_request = kind == Some("request");
        // A command has no reply that could be assigned to its client.
        let is_alone = sender.is_empty()
            || commands.contains(&(place.interface.clone(), place.operation.clone()));
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
            break;
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
) -> BTreeMap<String, Arc<Calls>> {
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
        found.insert(operation.name.clone(), Arc::clone(calls));
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
        let mut notes = Vec::new();
        let commands = BTreeSet::from([("A".to_owned(), "go".to_owned())]);
        let recorded = read(&path, &commands, &mut notes, &|| true);
        let recorded = recorded.expect("calls");
        let counts = |operation: &str| {
            let (_, calls) = recorded.iter().find(|(at, _)| at.operation == operation)?;
            Some((calls.replies.len(), calls.by_request.len()))
        };
        assert_eq!((counts("ask"), counts("go")), (Some((2, 1)), Some((1, 0))));
        assert_eq!(notes, Vec::<String>::new());
        let none = read(&path, &commands, &mut Vec::new(), &|| false);
        assert_eq!(none.expect("nothing").len(), 0);
    }
}
