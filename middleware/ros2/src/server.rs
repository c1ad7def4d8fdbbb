//! The server: for each operation a service, with a reader of requests and a writer of replies.

use crate::calls::{self, HEADER, Mapping, Request};
use crate::graph::Listed;
use crate::names;
use crate::node::Node;
use rc_ddsc::{Identity, Sample};
use rc_middleware::rpc::{self, ENVELOPE, ReplyKind, RequestId};
use rc_middleware::{
    Endpoint, Header, OpenError, Profile, QueueGauge, Reader, ReceiveError, Reply, Server,
    WakeEvent, Writer,
};
use rc_network::{
    Backlog, EndpointSpec, Guid, GuidPrefix, Inbox, NO_ROOM, Opening, QueuedRequest, RateLimit,
    ReaderPort, ReaderState, RequestQueues, Role, WriterPort, WriterState, body, call_qos, lock,
    prefix, sample_header, signal, stamp,
};
use std::collections::{BTreeSet, HashMap, VecDeque};
use std::os::fd::{AsFd, BorrowedFd};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How long a request waits until its client can be reached. A client whose reader was not found by
/// then has none.
const HOLD: Duration = Duration::from_millis(200);
/// The same, of a client that names its reader.
const HOLD_NAMED: Duration = Duration::from_secs(5);
/// How long a request of a component waits for an earlier one, to another operation.
const ORDER: Duration = Duration::from_millis(50);
/// Number of clients whose last request is remembered.
const MOST_CLIENTS: usize = 256;
/// Most reasons that are remembered, so that each is logged once.
const MOST_REASONS: usize = 16;
/// Most requests without room that are kept for a refusal.
const MOST_REFUSED: usize = 64;

/// A request that was received.
struct Received {
    /// Its operation.
    place: usize,
    sample: Sample,
    /// Its client and its place there.
    turn: (u128, u64),
}

/// The requests to a server.
struct Queue {
    requests: RequestQueues<u128, Received>,
    /// Requests that found no room.
    refused: Mutex<VecDeque<Refused>>,
}

/// A request without its bytes.
struct Refused {
    place: usize,
    /// The handle of its writer.
    writer: u64,
    /// Its identity; only a component gets the reason.
    id: Option<Identity>,
    turn: (u128, u64),
}

/// Puts the requests of one operation into the queue of the server.
struct OfOperation {
    place: usize,
    queue: Arc<Queue>,
}

impl Backlog for Queue {
    fn awaits_peers(&self) -> bool {
        self.requests.awaits_peers()
    }
}

impl Backlog for OfOperation {
    fn awaits_peers(&self) -> bool {
        self.queue.awaits_peers()
    }
}

impl Inbox for OfOperation {
    fn put(&self, sample: Sample, from: Option<GuidPrefix>) {
        let (turn, size) = (calls::turn(&sample, from), sample.len());
        let received = Received {
            place: self.place,
            sample,
            turn,
        };
        if let Err(received) = self.queue.requests.put(turn, size, received) {
            let mut refused = lock(&self.queue.refused);
            if refused.len() < MOST_REFUSED {
                refused.push_back(Refused {
                    place: received.place,
                    writer: received.sample.writer(),
                    id: received
                        .sample
                        .related()
                        .filter(|id| from == Some(prefix(&id.guid))),
                    turn,
                });
            }
        }
    }
}

/// One operation.
struct Service {
    /// Its discriminator in the envelope of a call.
    id: i32,
    requests: ReaderPort,
    replies: WriterPort,
}

pub(crate) fn open(node: &Node, endpoint: &Endpoint) -> Result<RosServer, OpenError> {
    let address = endpoint.address.to_string();
    let signal = signal(&address)?;
    let queue = Arc::new(Queue {
        requests: RequestQueues::new(node.session.queue_limit()),
        refused: Mutex::default(),
    });
    let opening = Opening::begin(&node.session, &address)?;
    let mut services = Vec::new();
    for (place, external) in endpoint.external_types.iter().enumerate() {
        let [request, reply] = names::service(endpoint, external, &node.rules)?;
        let spec = |names| EndpointSpec {
            names,
            role: Role::Server,
            types: &endpoint.types,
            qos: call_qos(),
            signal: signal.clone(),
            labels: node.types.labels(&external.type_name),
        };
        let inbox = OfOperation {
            place,
            queue: Arc::clone(&queue),
        };
        let replies = opening.writer(spec(reply), Arc::clone(&queue) as _)?;
        services.push(Service {
            id: external.id,
            requests: opening.reader(spec(request), Arc::new(inbox))?,
            replies,
        });
    }
    let states: Vec<_> = services
        .iter()
        .flat_map(|service| [service.replies.state(), service.requests.state()])
        .collect();
    opening.meet(&states);
    let guids = |of: fn(&Service) -> Guid| services.iter().map(of).collect::<Vec<_>>();
    let listed = node.graph.list(
        &guids(|service| service.requests.guid),
        &guids(|service| service.replies.guid),
    );
    Ok(RosServer {
        address,
        services,
        _listed: listed,
        queue,
        signal,
        last: HashMap::new(),
        reported: BTreeSet::new(),
        request: Vec::new(),
        reply: Vec::new(),
        sent: 0,
        rate_limit: RateLimit::default(),
    })
}

pub(crate) struct RosServer {
    address: String,
    services: Vec<Service>,
    _listed: Listed,
    queue: Arc<Queue>,
    signal: WakeEvent,
    /// The place of the last request of each component.
    last: HashMap<u128, u64>,
    /// Why requests could not be served.
    reported: BTreeSet<String>,
    /// A request with its envelope.
    request: Vec<u8>,
    reply: Vec<u8>,
    /// Number of replies that were sent.
    sent: u64,
    rate_limit: RateLimit,
}

/// Takes the reply to a request, in the form of ROS.
struct RosReply(Vec<u8>);

impl Reply for RosReply {
    fn body(&mut self) -> &mut Vec<u8> {
        &mut self.0
    }

    fn profile(&self) -> Profile {
        Profile::Ros
    }
}

/// Whether the reply to a request reaches its client.
pub(crate) fn is_reachable(sample: &Sample, requests: &ReaderState, replies: &WriterState) -> bool {
    let client = requests.participant(sample.writer());
    client.is_none_or(|client| replies.state.has(|peer| peer.prefix() == client))
}

/// Sends the reply `body` to `request`, with the number `sequence` among those of its writer. The
/// body begins at [`ENVELOPE`] of `reply`, and what is before it may be overwritten.
pub(crate) fn send_reply(
    writer: &rc_ddsc::Writer,
    sequence: u64,
    request: Request,
    reply: &mut [u8],
) -> Result<(), String> {
    let sent = match request.mapping {
        Mapping::Beside => {
            let body = reply.get(ENVELOPE..).unwrap_or_default();
            writer.write_related(sequence, stamp(0), body, request.id)
        }
        Mapping::Before => {
            let before = ENVELOPE - HEADER;
            let whole = reply.get_mut(before..).unwrap_or_default();
            if let Some(header) = whole.first_chunk_mut::<HEADER>() {
                *header = calls::header(request.id);
            }
            writer.write(sequence, stamp(0), whole)
        }
    };
    sent.map_err(|error| format!("a reply cannot be sent: {error}"))
}

impl RosServer {
    fn failed(&self, reason: String) -> ReceiveError {
        ReceiveError {
            address: self.address.clone(),
            reason,
        }
    }

    /// Whether to serve a request now: it is its turn, and its reply reaches the client, or the
    /// client has gone and gets none.
    fn may_serve(&self, waiting: &QueuedRequest<Received>) -> bool {
        let Received {
            place,
            sample,
            turn: (client, number),
        } = &waiting.sample;
        let Some(service) = self.services.get(*place) else {
            return true;
        };
        let is_next = *number == 0
            || self.last.get(client).is_none_or(|last| *number <= last + 1)
            || waiting.since.elapsed() >= ORDER;
        let requests = &service.requests.shared;
        let hold = match sample.related() {
            Some(_) => HOLD_NAMED,
            None => HOLD,
        };
        is_next
            && (is_reachable(sample, requests, &service.replies.shared)
                || requests.has_lost(sample.writer())
                || waiting.since.elapsed() >= hold)
    }

    /// Notes that a request has had its turn.
    fn has_been(&mut self, (client, number): (u128, u64)) {
        if number == 0 {
            return;
        }
        if self.last.len() >= MOST_CLIENTS && !self.last.contains_key(&client) {
            self.last.clear();
        }
        let last = self.last.entry(client).or_default();
        *last = number.max(*last);
    }

    /// Sends a reply whose body begins at [`ENVELOPE`].
    fn answer(
        &mut self,
        place: usize,
        request: Request,
        reply: &mut [u8],
    ) -> Result<(), ReceiveError> {
        self.sent += 1;
        let writer = &self.services[place].replies.writer;
        let sent = send_reply(writer, self.sent, request, reply);
        sent.map_err(|reason| self.failed(reason))
    }

    /// Tells the client, if it is a component, that nothing was executed, and why. ROS has no
    /// message for that.
    fn refuse(
        &mut self,
        place: usize,
        writer: u64,
        id: Option<Identity>,
        reason: &str,
    ) -> Result<(), ReceiveError> {
        let client = self.services[place].requests.shared.peer(writer);
        let id = id.filter(|_| client.is_some_and(|client| !client.is_external()));
        let Some(Identity { guid, number }) = id else {
            if let Some(suppressed) = self.rate_limit.allow() {
                let (count, address) = (suppressed + 1, &self.address);
                tracing::warn!(
                    "a request to `{address}` stays without a reply ({count} times): {reason}"
                );
            }
            return Ok(());
        };
        let mut writer = Writer::default();
        writer.raw(&[0; ENVELOPE]);
        rc_middleware::cdr::text(&reason.replace('\0', " "), &mut writer);
        let refused = Request {
            id: Identity {
                guid,
                number: -number,
            },
            mapping: Mapping::Beside,
        };
        self.answer(place, refused, &mut writer.into_bytes())
    }

    /// Logs that a request cannot be served, once for each reason.
    fn report_once(&mut self, reason: String) {
        if self.reported.len() < MOST_REASONS && !self.reported.contains(&reason) {
            tracing::warn!(
                "a request to `{}` stays without a reply: {reason}",
                self.address
            );
            self.reported.insert(reason);
        }
    }

    /// Refuses a request that found no room.
    fn refuse_one(&mut self, refused: &Refused) -> Result<(), ReceiveError> {
        self.has_been(refused.turn);
        self.refuse(refused.place, refused.writer, refused.id, NO_ROOM)
    }
}

impl Server for RosServer {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.signal.clear();
    }

    fn serve(
        &mut self,
        answer: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        let refused = lock(&self.queue.refused).pop_front();
        if let Some(refused) = refused {
            return self.refuse_one(&refused).map(|()| true);
        }
        let next = self.queue.requests.next(|waiting| self.may_serve(waiting));
        let Some(QueuedRequest {
            sample: received, ..
        }) = next
        else {
            return Ok(false);
        };
        let Received {
            place,
            sample,
            turn,
        } = received;
        self.has_been(turn);
        let service = &self.services[place];
        let (requests, operation) = (&service.requests.shared, service.id);
        let request = Request::read(&sample, requests).map_err(|reason| self.failed(reason))?;
        let Some(sender) = requests.sender(sample.writer()) else {
            let reason = "the types differ; regenerate and rebuild both ends";
            let refused = self.refuse(place, sample.writer(), Some(request.id), reason);
            return refused.map(|()| true);
        };
        let id = RequestId {
            writer: request.id.guid,
            sequence: request.id.number.unsigned_abs(),
        };
        let body = body(&sample).map_err(|reason| self.failed(reason))?;
        if let Some(reason) = request.unserved(body) {
            self.report_once(reason);
            return Ok(true);
        }
        let mut whole = std::mem::take(&mut self.request);
        whole.clear();
        let mut writer = Writer::over(whole);
        rpc::begin_request(&mut writer, id, operation);
        rpc::begin_body(&mut writer, Profile::Ros);
        writer.raw(body.get(request.skipped()..).unwrap_or_default());
        let whole = writer.into_bytes();
        let mut reply = RosReply(std::mem::take(&mut self.reply));
        reply.0.clear();
        // The client tells the hash of the whole interface, which is equal. The runtime compares
        // hashes of operations.
        answer(sample_header(&sample, sender.id, 0), &whole, &mut reply);
        self.request = whole;
        let RosReply(mut reply) = reply;
        if reply.is_empty() {
            // A command: its empty structure is one octet.
            reply.resize(ENVELOPE + 1, 0);
            let done = self.answer(place, request, &mut reply);
            self.reply = reply;
            return done.map(|()| true);
        }
        let done = match rpc::open_reply(&mut Reader::new(&reply), operation) {
            Ok((_, ReplyKind::Case(_))) => self.answer(place, request, &mut reply),
            Ok((_, ReplyKind::Refused(reason))) => {
                self.refuse(place, sample.writer(), Some(request.id), &reason)
            }
            Err(error) => Err(self.failed(error.to_string())),
        };
        self.reply = reply;
        done.map(|()| true)
    }

    fn peers(&self) -> usize {
        let all = self.services.iter();
        let counts = all.map(|service| service.requests.state().count());
        counts.max().unwrap_or(0)
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.queue.requests.gauge().clone())
    }
}
