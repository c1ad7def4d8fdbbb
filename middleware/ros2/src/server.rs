//! The server: for each operation a service, with a reader of requests and a writer of replies.

use crate::calls::{self, HEADER, Mapping, Request};
use crate::graph::Listed;
use crate::names;
use crate::node::Node;
use rc_ddsc::{BEFORE_BODY, Identity, Loan, Sample};
use rc_middleware::rpc::{self, ENVELOPE, ReplyKind, RequestId};
use rc_middleware::{
    DeferredReply, Endpoint, Header, OpenError, Profile, QueueGauge, Reader, ReceiveError, Reply,
    Server, WakeEvent, Writer,
};
use rc_network::{
    Backlog, EndpointSpec, Guid, GuidPrefix, Inbox, NO_ROOM, Opening, QueuedRequest, RateLimit,
    ReaderPort, ReaderState, ReplyMemory, RequestQueues, Role, WriterPort, WriterState, Written,
    body, lock, prefix, reply_stamp, sample_header, signal, stamp,
};
use std::cell::Cell;
use std::collections::{BTreeSet, HashMap, VecDeque};
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How long a request waits until its client can be reached. A client whose reader was not found by
/// then counts as one without a reader.
const HOLD: Duration = Duration::from_millis(200);
/// How long a request waits whose client names its reader.
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
    /// Index of the operation.
    place: usize,
    sample: Sample,
    /// The participant that sent it, as far as it was known then.
    from: Option<GuidPrefix>,
    /// Client and its place there.
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
    /// Identity; only a component gets the reason.
    id: Option<Identity>,
    turn: (u128, u64),
}

/// Puts the requests of one operation into the queue of the server.
struct OperationRequests {
    place: usize,
    queue: Arc<Queue>,
}

impl Backlog for Queue {
    fn awaits_peers(&self) -> bool {
        self.requests.awaits_peers()
    }
}

impl Backlog for OperationRequests {
    fn awaits_peers(&self) -> bool {
        self.queue.awaits_peers()
    }
}

impl Inbox for OperationRequests {
    fn put(&self, sample: Sample, from: Option<GuidPrefix>) {
        let (turn, size) = (calls::turn(&sample, from), sample.len());
        let received = Received {
            place: self.place,
            sample,
            from,
            turn,
        };
        let without_room = self.queue.requests.put(turn, size, received);
        if without_room.is_empty() {
            return;
        }
        let mut refused = lock(&self.queue.refused);
        for received in without_room {
            if refused.len() < MOST_REFUSED {
                refused.push_back(Refused {
                    place: received.place,
                    writer: received.sample.writer(),
                    id: received
                        .sample
                        .related()
                        .filter(|id| received.from == Some(prefix(&id.guid))),
                    turn: received.turn,
                });
            }
        }
    }
}

/// One operation.
struct Service {
    /// Discriminator in the envelope of a call.
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
            qos: None,
            signal: signal.clone(),
            labels: node.types.labels(&external.type_name),
        };
        let inbox = OperationRequests {
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
        replies: Rc::new(Replies {
            address,
            services,
            sent: Cell::new(0),
            rate_limit: RateLimit::default(),
        }),
        _listed: listed,
        queue,
        signal,
        last: HashMap::new(),
        reported: BTreeSet::new(),
        request: Vec::new(),
        reply: Vec::new(),
    })
}

pub(crate) struct RosServer {
    replies: Rc<Replies>,
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
}

/// The state for sending replies. Deferred replies share it with their server.
struct Replies {
    address: String,
    services: Vec<Service>,
    /// Number of replies that were sent.
    sent: Cell<u64>,
    rate_limit: RateLimit,
}

/// The request that a reply belongs to.
#[derive(Clone, Copy)]
struct Asked {
    /// Index of the operation.
    place: usize,
    /// The handle of the client's writer.
    writer: u64,
    request: Request,
}

/// A deferred reply.
struct RosDeferred {
    replies: Rc<Replies>,
    asked: Asked,
    /// The time stamp of the request.
    asked_at: i64,
}

impl DeferredReply for RosDeferred {
    fn send(self: Box<Self>, write: &mut dyn FnMut(&mut dyn Reply)) -> Result<(), ReceiveError> {
        let Self {
            replies,
            mut asked,
            asked_at,
        } = *self;
        let writer = &replies.services[asked.place].replies.writer;
        let mut reply = ReplyMemory::new(writer, Profile::Bare, Vec::new());
        write(&mut reply);
        asked.request.reply_at = reply_stamp(asked_at, reply.age());
        match reply.finish() {
            Written::Loan(loan, _) => replies.send(asked.place, asked.request, loan),
            Written::Buffer(reply) => replies.reply(asked, &reply),
            Written::Deferred(_) => Ok(()),
        }
    }
}

/// Whether the reply to a request reaches its client.
pub(crate) fn is_reachable(sample: &Sample, requests: &ReaderState, replies: &WriterState) -> bool {
    let client = requests.participant(sample.writer());
    client.is_none_or(|client| replies.state.has(|peer| peer.prefix() == client))
}

/// A reply with this body.
pub(crate) fn lend(writer: &rc_ddsc::Writer, body: &[u8]) -> Result<Loan, String> {
    let mut loan = writer.loan(body.len()).map_err(unsent)?;
    loan.memory()[BEFORE_BODY..].copy_from_slice(body);
    Ok(loan)
}

/// Sends the reply to `request`, with the number `sequence` among those of its writer.
pub(crate) fn send_reply(
    writer: &rc_ddsc::Writer,
    sequence: u64,
    request: Request,
    mut reply: Loan,
) -> Result<(), String> {
    let at = match request.reply_at {
        0 => stamp(0),
        at => at,
    };
    let numbers = (sequence, at);
    let sent = match request.mapping {
        Mapping::Beside => writer.send(reply, numbers, 0, Some(request.id)),
        Mapping::Before => {
            let header = calls::header(request.id);
            reply.memory()[BEFORE_BODY - HEADER..BEFORE_BODY].copy_from_slice(&header);
            writer.send(reply, numbers, HEADER, None)
        }
    };
    sent.map_err(unsent)
}

fn unsent(error: rc_ddsc::Error) -> String {
    format!("a reply cannot be sent: {error}")
}

impl RosServer {
    /// Whether to serve a request now: it is its turn, and its reply reaches the client, or the
    /// client has left and gets none.
    fn may_serve(&self, waiting: &QueuedRequest<Received>) -> bool {
        let Received {
            place,
            sample,
            turn: (client, number),
            ..
        } = &waiting.sample;
        let Some(service) = self.replies.services.get(*place) else {
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

    /// Logs that a request cannot be served, once for each reason.
    fn report_once(&mut self, reason: String) {
        if self.reported.len() < MOST_REASONS && !self.reported.contains(&reason) {
            tracing::warn!(
                "a request to `{}` stays without a reply: {reason}",
                self.replies.address
            );
            self.reported.insert(reason);
        }
    }

    /// Refuses a request that found no room.
    fn refuse_one(&mut self, refused: &Refused) -> Result<(), ReceiveError> {
        self.has_been(refused.turn);
        self.replies
            .refuse(refused.place, refused.writer, refused.id, NO_ROOM, None)
    }
}

impl Replies {
    fn failed(&self, reason: String) -> ReceiveError {
        ReceiveError {
            address: self.address.clone(),
            reason,
        }
    }

    /// Sends a reply that is in a buffer, with its envelope.
    fn reply(&self, asked: Asked, reply: &[u8]) -> Result<(), ReceiveError> {
        let Asked {
            place,
            writer,
            request,
        } = asked;
        if reply.is_empty() {
            // A command: its empty structure is one octet.
            return self.answer(place, request, &[0]);
        }
        match rpc::open_reply(&mut Reader::new(reply), self.services[place].id) {
            Ok((_, ReplyKind::Case(_))) => {
                let body = reply.get(ENVELOPE..).unwrap_or_default();
                self.answer(place, request, body)
            }
            Ok((_, ReplyKind::Refused(reason))) => {
                self.refuse(place, writer, Some(request.id), &reason, None)
            }
            Ok((_, ReplyKind::Unavailable(state))) => {
                let reason = rpc::not_served_in(&state);
                self.refuse(place, writer, Some(request.id), &reason, Some(&state))
            }
            Err(error) => Err(self.failed(error.to_string())),
        }
    }

    /// Sends a reply with this body.
    fn answer(&self, place: usize, request: Request, body: &[u8]) -> Result<(), ReceiveError> {
        let lent = lend(&self.services[place].replies.writer, body);
        let lent = lent.map_err(|reason| self.failed(reason))?;
        self.send(place, request, lent)
    }

    fn send(&self, place: usize, request: Request, reply: Loan) -> Result<(), ReceiveError> {
        let writer = &self.services[place].replies.writer;
        self.sent.set(self.sent.get() + 1);
        let sent = send_reply(writer, self.sent.get(), request, reply);
        sent.map_err(|reason| self.failed(reason))
    }

    /// Tells the client, if it is a component, that nothing was executed, and why. ROS has no
    /// message for that.
    fn refuse(
        &self,
        place: usize,
        writer: u64,
        id: Option<Identity>,
        reason: &str,
        state: Option<&str>,
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
        rpc::put_reason(&mut writer, reason, state);
        let refused = Request {
            id: Identity {
                guid,
                number: -number,
            },
            mapping: Mapping::Beside,
            reply_at: 0,
        };
        self.answer(place, refused, &writer.into_bytes())
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
            mut sample,
            turn,
            ..
        } = received;
        self.has_been(turn);
        let service = &self.replies.services[place];
        let (requests, operation) = (&service.requests.shared, service.id);
        let request = Request::read(&sample, requests);
        let mut request = request.map_err(|reason| self.replies.failed(reason))?;
        let (client, asked_at) = (sample.writer(), sample.stamp());
        let Some(sender) = requests.sender(client) else {
            let reason = "the types differ; regenerate and rebuild both ends";
            let refused = self
                .replies
                .refuse(place, client, Some(request.id), reason, None);
            return refused.map(|()| true);
        };
        let id = RequestId {
            writer: request.id.guid,
            sequence: request.id.number.unsigned_abs(),
        };
        let body = body(&sample).map_err(|reason| self.replies.failed(reason))?;
        if let Some(reason) = request.unserved(body) {
            self.report_once(reason);
            return Ok(true);
        }
        // The client sends the hash of the whole interface, which is equal. The runtime compares
        // hashes of operations.
        let header = sample_header(&sample, sender.id, 0);
        let mut buffer = std::mem::take(&mut self.request);
        let skipped = request.skipped();
        let whole = calls::enveloped(&mut sample, skipped, &mut buffer, |writer| {
            rpc::begin_request(writer, id, operation);
        });
        let whole = whole.map_err(|reason| self.replies.failed(reason))?;
        let writer = &self.replies.services[place].replies.writer;
        let asked = Asked {
            place,
            writer: client,
            request,
        };
        let later = || -> Box<dyn DeferredReply> {
            Box::new(RosDeferred {
                replies: Rc::clone(&self.replies),
                asked,
                asked_at,
            })
        };
        let reply = ReplyMemory::new(writer, Profile::Bare, std::mem::take(&mut self.reply));
        let mut reply = reply.or_later(&later);
        answer(header, whole, &mut reply);
        request.reply_at = reply_stamp(asked_at, reply.age());
        let (reply, done) = match reply.finish() {
            Written::Deferred(unused) => (unused, Ok(())),
            Written::Loan(loan, unused) => (unused, self.replies.send(place, request, loan)),
            Written::Buffer(reply) => {
                let done = self.replies.reply(Asked { request, ..asked }, &reply);
                (reply, done)
            }
        };
        self.request = buffer;
        self.reply = reply;
        done.map(|()| true)
    }

    fn peers(&self) -> usize {
        let all = self.replies.services.iter();
        let counts = all.map(|service| service.requests.state().count());
        counts.max().unwrap_or(0)
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.queue.requests.gauge().clone())
    }
}
