//! The client: for each operation a service, with a writer of requests and a reader of replies.

use crate::calls::{self, Service};
use crate::config::Mapping;
use crate::endpoint_state::{Inbox, Peer, is_ready};
use crate::session::{Session, Unsent, signal};
use crate::wire::{Body, Sample};
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::rpc::{self, Outcome, RequestId};
use rc_middleware::{
    CallError, Cdr, Client, Endpoint, Header, OpenError, Profile, Reader, WakeEvent, Writer, wait,
};
use rc_network::{Backlog, Guid, GuidPrefix, RateLimit, Role, lock, stamp};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::os::fd::AsFd;
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Longest wait before the client looks for a stop: somebody else may have cleared the wake event.
const CYCLE: Duration = Duration::from_millis(50);
/// Longest wait for room in a full queue: replies to requests that the server has taken are on
/// their way.
const ROOM: Duration = Duration::from_millis(50);
/// Longest wait until a server that was found has found this client. A server of another program
/// counts as ready after a tenth of a second.
const MEETING: Duration = Duration::from_millis(200);
/// Pause between two looks for it.
const LOOK: Duration = Duration::from_millis(2);
/// After this time a request to a server of another program no longer counts as pending.
const SILENCE: Duration = Duration::from_secs(1);
/// Longest wait for the reply of a server that has gone.
const LAST_WORDS: Duration = Duration::from_millis(20);
/// Most replies that wait here. More than there are requests come only from a flood.
const MOST_ANSWERS: usize = 256;

/// The replies to one client.
struct Answers {
    address: String,
    mapping: Mapping,
    /// The writers of requests, by operation.
    writers: Mutex<Vec<Guid>>,
    samples: Mutex<VecDeque<Answer>>,
    rate_limit: RateLimit,
}

struct Answer {
    /// The operation, and the number of the request; negative if it was refused.
    request: (usize, i64),
    sample: Sample,
    /// Number of bytes before the body of the sample.
    skipped: usize,
}

impl Answers {
    fn next(&self) -> Option<Answer> {
        lock(&self.samples).pop_front()
    }

    fn of(&self, operation: usize, writer: Guid) {
        let mut writers = lock(&self.writers);
        if writers.len() <= operation {
            writers.resize(operation + 1, [0; 16]);
        }
        writers[operation] = writer;
    }
}

impl Backlog for Answers {}

impl Inbox for Answers {
    fn put(&self, samples: Vec<Sample>) {
        for sample in samples {
            let Some(client) = lock(&self.writers).get(sample.place).copied() else {
                continue;
            };
            match calls::read(self.mapping, &sample, Some(&client)) {
                // Every client receives the replies to all.
                Ok(((writer, _), _)) if writer != client => {}
                Ok(((_, number), skipped)) => {
                    let mut samples = lock(&self.samples);
                    if samples.len() >= MOST_ANSWERS {
                        samples.pop_front();
                    }
                    samples.push_back(Answer {
                        request: (sample.place, number),
                        sample,
                        skipped,
                    });
                }
                Err(reason) => self.unreadable(reason),
            }
        }
    }

    fn unreadable(&self, reason: String) {
        if let Some(passed) = self.rate_limit.allow() {
            let (count, address) = (passed + 1, &self.address);
            tracing::warn!("`{address}` sent a sample that is no reply ({count} times): {reason}");
        }
    }
}

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<RosClient, OpenError> {
    let address = endpoint.address.to_string();
    let signal = signal(&address)?;
    let mapping = session.config.mapping;
    let answers = Arc::new(Answers {
        address: address.clone(),
        mapping,
        writers: Mutex::default(),
        samples: Mutex::default(),
        rate_limit: RateLimit::default(),
    });
    let inbox: Arc<dyn Inbox> = Arc::clone(&answers) as _;
    let services = calls::services(session, endpoint, Role::Client, &signal, &inbox)?;
    for (operation, service) in services.iter().enumerate() {
        answers.of(operation, service.requests.guid);
    }
    let client = RosClient {
        address,
        services,
        answers,
        mapping,
        signal,
        wake_event: session.environment.wake_event.clone(),
        spin: endpoint.qos.spin,
        sent: 0,
        under_way: BTreeMap::new(),
        asked: None,
        last: 0,
    };
    if let Some(service) = client.services.first() {
        session
            .opener
            .wait_for_remote(&service.requests.state, || client.peers() > 0);
    }
    Ok(client)
}

fn is_server(peer: &Peer) -> bool {
    let info = peer.info.as_ref();
    info.is_none_or(|info| info.role == Role::Server)
}

pub(crate) struct RosClient {
    address: String,
    services: Vec<Service>,
    answers: Arc<Answers>,
    mapping: Mapping,
    signal: WakeEvent,
    wake_event: WakeEvent,
    spin: Duration,
    /// Number of requests, for the mapping that numbers them itself.
    sent: i64,
    /// Requests without a reply, by operation and number, with the identity that the caller uses
    /// and the time of sending. Each gets a reply, a command an empty response.
    under_way: BTreeMap<(usize, i64), (RequestId, Instant)>,
    /// The server that has them.
    asked: Option<GuidPrefix>,
    /// The operation of the last request.
    last: usize,
}

impl Service {
    /// Whether this client can reach `server` and `server` can reach this client.
    fn meets(&self, server: GuidPrefix) -> bool {
        let same = |peer: &Peer| peer.prefix() == server && is_server(peer) && is_ready(peer);
        self.replies.state.has(same) && self.requests.state.has(same)
    }

    /// The servers that this client can reach and that can reach it.
    fn servers(&self) -> BTreeSet<GuidPrefix> {
        let member = |peer: &Peer| (is_server(peer) && is_ready(peer)).then_some(peer.prefix());
        let answering = self.replies.state.usable(member);
        let mut hearing: BTreeSet<GuidPrefix> =
            self.requests.state.usable(member).into_iter().collect();
        hearing.retain(|member| answering.contains(member));
        hearing
    }

    /// One of them; waits a moment for it to find this client.
    fn find_server(&self) -> Option<GuidPrefix> {
        let (mut servers, begin) = (self.servers(), Instant::now());
        while servers.is_empty() && begin.elapsed() < MEETING {
            let awaits = self.awaits_server();
            servers = self.servers();
            if !awaits {
                break;
            }
            self.requests.state.wait_for_change(LOOK);
        }
        servers.first().copied()
    }

    /// Whether a server was found that has not found this client yet, as far as it tells.
    fn awaits_server(&self) -> bool {
        self.requests.state.search();
        self.replies.state.search();
        let coming = |peer: &Peer| is_server(peer) && !is_ready(peer);
        self.requests.state.has(coming) || self.replies.state.has(coming)
    }

    /// Whether `server` is there.
    fn has(&self, server: GuidPrefix) -> bool {
        let same = |peer: &Peer| peer.prefix() == server && is_server(peer);
        self.replies.state.has(same) && self.requests.state.has(same)
    }
}

impl RosClient {
    fn failed(&self, reason: String) -> CallError {
        CallError::Backend {
            address: self.address.clone(),
            reason,
        }
    }

    /// Takes in the samples that have arrived.
    fn hear(&self) {
        if let Some(service) = self.services.first() {
            service.replies.state.hear();
        }
    }

    /// The operation of a request.
    fn operation(&self, request: &[u8]) -> Result<(usize, RequestId), CallError> {
        let (id, operation) = rpc::open_request(&mut Reader::new(request))?;
        let at = self
            .services
            .iter()
            .position(|service| service.id == operation);
        let at = at.ok_or_else(|| {
            self.failed("this component was generated without types of ROS 2 for this operation; generate it anew with --middleware ros2".to_owned())
        })?;
        Ok((at, id))
    }

    /// Takes replies, and waits until there is room for one more request.
    fn make_room(&mut self, server: GuidPrefix, at: usize) -> Result<(), CallError> {
        if self.asked != Some(server) {
            self.asked = Some(server);
            self.under_way.clear();
        }
        let deadline = Instant::now() + ROOM;
        loop {
            self.signal.clear();
            self.hear();
            while let Some(answer) = self.answers.next() {
                let (operation, number) = answer.request;
                self.under_way.remove(&(operation, number.abs()));
            }
            let same = |peer: &Peer| peer.prefix() == server && peer.info.is_none();
            if self.under_way.len() >= REQUEST_QUEUE && self.services[at].requests.state.has(same) {
                self.under_way
                    .retain(|_, (_, sent)| sent.elapsed() < SILENCE);
            }
            if self.under_way.len() < REQUEST_QUEUE {
                break;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(CallError::QueueFull(self.address.clone()));
            }
            wait(&[self.signal.as_fd()], left);
        }
        // Services are independent of each other: the requests to another one must have arrived
        // first.
        let pending = self
            .under_way
            .keys()
            .any(|(operation, _)| *operation == self.last);
        if self.last != at && pending && !self.services[self.last].requests.is_confirmed(ROOM) {
            return Err(CallError::QueueFull(self.address.clone()));
        }
        Ok(())
    }

    /// Sends a request; gives its operation, its number and its server.
    fn submit(
        &mut self,
        header: Header,
        request: &[u8],
    ) -> Result<(usize, i64, GuidPrefix), CallError> {
        let (at, id) = self.operation(request)?;
        let service = &self.services[at];
        let same = self.asked.filter(|asked| service.meets(*asked));
        let server = same.or_else(|| service.find_server());
        let server = server.ok_or_else(|| CallError::NoServer(self.address.clone()))?;
        self.make_room(server, at)?;
        let body = request.get(rpc::ENVELOPE..).unwrap_or_default();
        self.sent += 1;
        let port = &mut self.services[at].requests;
        let mark = calls::mark(self.mapping, (port.guid, self.sent), false);
        let body = Body::of(&[&mark.header, body]);
        let number = match port.send(body, stamp(header.sent), mark.related, None) {
            Ok(number) => number,
            Err(Unsent::Full) => {
                port.renew().map_err(|reason| CallError::Backend {
                    address: self.address.clone(),
                    reason,
                })?;
                self.answers.of(at, port.guid);
                // Their replies are for the writer that was replaced.
                self.under_way.retain(|(operation, _), _| *operation != at);
                return Err(CallError::QueueFull(self.address.clone()));
            }
            Err(Unsent::Failed(reason)) => return Err(self.failed(reason)),
        };
        let number = match self.mapping {
            Mapping::Enhanced => number,
            Mapping::Cyclone => self.sent,
        };
        self.under_way.insert((at, number), (id, Instant::now()));
        self.last = at;
        Ok((at, number, server))
    }

    /// Hands the reply to request `wanted` to `take`, if it is there. Other replies only end their
    /// requests.
    fn answer(
        &mut self,
        wanted: (usize, i64),
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Option<Result<(), CallError>> {
        self.hear();
        while let Some(mut answer) = self.answers.next() {
            let (operation, number) = answer.request;
            let request = (operation, number.abs());
            let Some((id, _)) = self.under_way.remove(&request) else {
                continue;
            };
            if request != wanted {
                continue;
            }
            let mut writer = Writer::default();
            if number < 0 {
                let body = answer.sample.taken.body().unwrap_or_default();
                let body = body.get(answer.skipped..).unwrap_or_default();
                let reason = String::decode(&mut Reader::new(body));
                let reason = reason.unwrap_or_else(|_| "no reason was told".to_owned());
                rpc::refuse(&mut writer, id, Outcome::UnknownException, &reason);
                take(Header::default(), &writer.into_bytes());
                return Some(Ok(()));
            }
            rpc::begin_reply(&mut writer, id, self.services[operation].id, 0);
            rpc::begin_body(&mut writer, Profile::Ros);
            let (sequence, stamp) = (answer.sample.sequence, answer.sample.stamp);
            let sender = u128::from_be_bytes(answer.sample.writer);
            let header = rc_network::header(sequence, stamp, sender, 0);
            let body = answer
                .sample
                .taken
                .in_envelope(answer.skipped, &writer.into_bytes());
            take(header, body);
            return Some(Ok(()));
        }
        None
    }
}

impl Client for RosClient {
    fn guid(&self) -> [u8; 16] {
        self.services
            .first()
            .map_or([0; 16], |service| service.requests.guid)
    }

    fn profile(&self) -> Profile {
        Profile::Ros
    }

    fn send(&mut self, header: Header, request: &[u8]) -> Result<(), CallError> {
        self.submit(header, request).map(drop)
    }

    fn call(
        &mut self,
        header: Header,
        request: &[u8],
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let start = Instant::now();
        let wake_event = self.wake_event.clone();
        if wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        let (at, number, server) = self.submit(header, request)?;
        let signal = self.signal.clone();
        let mut interrupted = false;
        loop {
            signal.clear();
            // The server is looked up first: a reply that it sent before it left is there by then,
            // or comes at once.
            let there = self.services[at].has(server);
            if let Some(result) = self.answer((at, number), take) {
                return result;
            }
            if !there {
                wait(&[signal.as_fd()], LAST_WORDS);
                let last = self.answer((at, number), take);
                return last.unwrap_or_else(|| Err(CallError::ServerDied(self.address.clone())));
            }
            if wake_event.is_stopping() {
                return Err(CallError::Stopping);
            }
            let elapsed = start.elapsed();
            if elapsed >= limit {
                return Err(CallError::Deadline {
                    address: self.address.clone(),
                    limit,
                });
            }
            if elapsed < self.spin {
                std::hint::spin_loop();
                continue;
            }
            // The wake event stays readable for its owner: this call does not wait for it twice.
            let descriptors = [signal.as_fd(), wake_event.as_fd()];
            let waited = if interrupted { 1 } else { 2 };
            let left = limit.saturating_sub(elapsed);
            interrupted |= wait(&descriptors[..waited], left.min(CYCLE)) & 2 != 0;
        }
    }

    fn peers(&self) -> usize {
        let mut services = self.services.iter();
        let is_served = |service: &Service| {
            let _ = service.awaits_server();
            !service.servers().is_empty()
        };
        usize::from(services.any(is_served))
    }
}
