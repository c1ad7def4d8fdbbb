//! The calling end of a connection: a writer of requests and a reader of replies.

use crate::endpoint_state::Peer;
use crate::inbox::{self, Replies};
use crate::publisher::signal;
use crate::qos::call_qos;
use crate::session::{EndpointSpec, Port, Session};
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::rpc::{self, RequestId};
use rc_middleware::{CallError, Client, Endpoint, Header, OpenError, wait};
use rc_network::{Role, stamp};
use std::collections::{BTreeMap, BTreeSet};
use std::os::fd::AsFd;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest wait before a stop is looked for: the wake-up of an interrupt can be meant for somebody else.
const CYCLE: Duration = Duration::from_millis(50);
/// How long a full queue is given to make room: what the server has taken already is on its way to us.
const ROOM: Duration = Duration::from_millis(50);

/// After this a stranger is not waited for any more that has not answered a request: it may take commands for one-way.
const SILENCE: Duration = Duration::from_secs(1);
/// How long the answer of a server that has gone is waited for: data and discovery come by different threads.
const LAST_WORDS: Duration = Duration::from_millis(10);

/// The names of the topics of calls in DDS: what OMG DDS-RPC 1.0, 7.4.2.2, lets an annotation name.
pub(crate) fn topics(endpoint: &Endpoint) -> [(String, String); 2] {
    let (address, types) = (&endpoint.address, &endpoint.types.name);
    ["Request", "Reply"].map(|word| (format!("{address}_{word}"), format!("{types}_{word}")))
}

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<DdsClient, OpenError> {
    let address = endpoint.address.to_string();
    let signal = signal(&address)?;
    let answers = Arc::new(Replies::new(&address));
    let [request, reply] = topics(endpoint);
    let spec = |(topic, type_name): (String, String), sends: bool| EndpointSpec {
        address: &address,
        topic,
        type_name,
        role: Role::Client,
        types: &endpoint.types,
        sends,
        qos: call_qos(),
        signal: signal.clone(),
        inbox: Arc::clone(&answers) as _,
    };
    // The reader comes first, so that a server that finds the writer soon finds it, too.
    let [replies, requests] = session.ports([spec(reply, false), spec(request, true)])?;
    answers.of(requests.guid);
    let client = DdsClient {
        address: address.clone(),
        requests,
        replies,
        answers,
        spin: endpoint.qos.spin,
        under_way: BTreeMap::new(),
        asked: None,
    };
    let (state, found) = (&client.requests.state, || client.server().is_some());
    session.grace(state, found);
    Ok(client)
}

fn is_server(peer: &Peer) -> bool {
    let info = peer.info.as_ref();
    info.is_none_or(|info| info.role == Role::Server)
}

/// The first bytes of the identity of a participant and all its ends.
type Member = [u8; 12];

pub(crate) struct DdsClient {
    address: String,
    requests: Port,
    replies: Port,
    answers: Arc<Replies>,
    spin: Duration,
    /// Requests that were sent and not confirmed yet: each is answered, a command by an empty result.
    under_way: BTreeMap<u64, Instant>,
    /// Who has them.
    asked: Option<Member>,
}

impl DdsClient {
    /// The servers that hear and answer this client.
    fn servers(&self) -> BTreeSet<Member> {
        let member = |peer: &Peer| is_server(peer).then_some(peer.member);
        let answering = self.replies.state.here(member);
        let mut hearing: BTreeSet<Member> = self.requests.state.here(member).into_iter().collect();
        hearing.retain(|member| answering.contains(member));
        hearing
    }

    /// Whether this one is among them.
    fn is_there(&self, server: Member) -> bool {
        let same = |peer: &Peer| peer.member == server && is_server(peer);
        self.replies.state.has(same) && self.requests.state.has(same)
    }

    /// Whether it tells nothing of itself.
    fn is_stranger(&self, server: Member) -> bool {
        let same = |peer: &Peer| peer.member == server && peer.info.is_none();
        self.requests.state.has(same)
    }

    fn server(&self) -> Option<Member> {
        let same = self.asked.filter(|asked| self.is_there(*asked));
        same.or_else(|| self.servers().first().copied())
    }

    /// Sends a request; gives its number and who has it.
    fn submit(&mut self, header: Header, request: &[u8]) -> Result<(RequestId, Member), CallError> {
        let no_server = || CallError::NoServer(self.address.clone());
        let server = self.server().ok_or_else(no_server)?;
        if self.asked != Some(server) {
            self.asked = Some(server);
            self.under_way.clear();
        }
        let deadline = Instant::now() + ROOM;
        loop {
            self.requests.state.signal.clear();
            while let Some((id, _)) = self.answers.next() {
                self.under_way.remove(&id.sequence);
            }
            if self.under_way.len() >= REQUEST_QUEUE && self.is_stranger(server) {
                self.under_way.retain(|_, sent| sent.elapsed() < SILENCE);
            }
            if self.under_way.len() < REQUEST_QUEUE {
                break;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(CallError::QueueFull(self.address.clone()));
            }
            wait(&[self.requests.state.signal.as_fd()], left);
        }
        let failed = |reason: String| CallError::Backend {
            address: self.address.clone(),
            reason,
        };
        let id = rpc::request_id(request)
            .ok_or_else(|| failed("a request has no envelope".to_owned()))?;
        self.requests
            .entity
            .write(header.sequence, stamp(header.sent), request)
            .map_err(|error| {
                if error.is_timeout() {
                    CallError::QueueFull(self.address.clone())
                } else {
                    failed(error.to_string())
                }
            })?;
        self.under_way.insert(id.sequence, Instant::now());
        Ok((id, server))
    }

    /// The answer to `wanted`, if it is there; what else is there is confirmed.
    fn answer(
        &mut self,
        wanted: RequestId,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Option<Result<(), CallError>> {
        while let Some((id, sample)) = self.answers.next() {
            self.under_way.remove(&id.sequence);
            if id != wanted {
                continue;
            }
            return Some(match inbox::body(&sample) {
                Ok(body) => {
                    take(inbox::header(&sample, sample.writer().into(), 0), body);
                    Ok(())
                }
                Err(reason) => Err(CallError::Backend {
                    address: self.address.clone(),
                    reason,
                }),
            });
        }
        None
    }
}

impl Client for DdsClient {
    /// That of its writer, as DDS-RPC wants it.
    fn guid(&self) -> [u8; 16] {
        self.requests.guid
    }

    fn send(&mut self, header: Header, request: &[u8]) -> Result<(), CallError> {
        self.submit(header, request).map(|_| ())
    }

    fn call(
        &mut self,
        header: Header,
        request: &[u8],
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let start = Instant::now();
        let wake_event = self.requests.session.environment.wake_event.clone();
        if wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        let (id, server) = self.submit(header, request)?;
        let signal = self.requests.state.signal.clone();
        let mut interrupted = false;
        loop {
            signal.clear();
            // Who is there is looked up first: what it sent before it left has come by then, or comes at once.
            let there = self.is_there(server);
            if let Some(result) = self.answer(id, take) {
                return result;
            }
            if !there {
                wait(&[signal.as_fd()], LAST_WORDS);
                let last = self.answer(id, take);
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
            // The wake-up of somebody else stays where it is, and is not waited for again.
            let descriptors = [signal.as_fd(), wake_event.as_fd()];
            let waited = if interrupted { 1 } else { 2 };
            let left = limit.saturating_sub(elapsed);
            interrupted |= wait(&descriptors[..waited], left.min(CYCLE)) & 2 != 0;
        }
    }

    fn peers(&self) -> usize {
        usize::from(!self.servers().is_empty())
    }
}
