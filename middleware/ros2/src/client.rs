//! The client: for each operation a service, with a writer of requests and a reader of replies.

use crate::calls::{self, HEADER, Mapping};
use crate::graph::Listed;
use crate::names;
use crate::node::Node;
use rc_ddsc::{BEFORE_BODY, Identity, Sample};
use rc_diagnostics::foreign::clean;
use rc_middleware::rpc::{self, ENVELOPE, RequestId};
use rc_middleware::started::{Awaiting, StartedCalls};
use rc_middleware::{
    CallError, Client, Endpoint, Header, OpenError, Profile, QueueGauge, Reader, RequestBody, Spin,
};
use rc_network::{
    Backlog, CallState, Caller, ClientPorts, EndpointSpec, Guid, GuidPrefix, Inbox, Opening, Peer,
    ROOM, RateLimit, ReplyQueue, Role, body, reply_sent, sample_header, signal, stamp,
};
use std::cell::Cell;
use std::rc::Rc;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Identifies a request: its operation, its number there, and how its reply names it.
type RequestKey = (usize, i64, Mapping);

/// The replies to one client.
struct Replies {
    address: String,
    queue: ReplyQueue<RequestKey, Received>,
    rate_limit: RateLimit,
}

struct Received {
    /// Whether nothing was executed, and the sample holds the reason.
    is_refusal: bool,
    sample: Sample,
}

/// Puts the replies of one operation into the queue of its client.
struct OperationReplies {
    place: usize,
    /// The reader of replies and the writer of requests.
    own: OnceLock<[Guid; 2]>,
    replies: Arc<Replies>,
}

impl Backlog for OperationReplies {}

impl Inbox for OperationReplies {
    fn put(&self, sample: Sample, from: Option<GuidPrefix>) {
        let replies = &self.replies;
        let Some(own) = self.own.get() else {
            return;
        };
        match calls::read_reply(&sample, own) {
            // Every client receives the replies to all.
            Ok(None) => {}
            Ok(Some((number, mapping))) => {
                let (request, size) = ((self.place, number.abs(), mapping), sample.len());
                let received = Received {
                    is_refusal: number < 0,
                    sample,
                };
                replies.queue.put(request, from, size, received);
            }
            Err(reason) => {
                if let Some(suppressed) = replies.rate_limit.allow() {
                    let (count, address) = (suppressed + 1, &replies.address);
                    tracing::warn!(
                        "`{address}` sent a sample that is not a reply ({count} times): {reason}"
                    );
                }
            }
        }
    }
}

/// One operation.
struct Service {
    /// Discriminator in the envelope of a call.
    id: i32,
    ports: ClientPorts,
    /// Number of requests that were sent.
    sent: u64,
}

pub(crate) fn open(node: &Node, endpoint: &Endpoint) -> Result<RosClient, OpenError> {
    let address = endpoint.address.to_string();
    let signal = signal(&address)?;
    let replies = Arc::new(Replies {
        address: address.clone(),
        queue: ReplyQueue::new(node.session.queue_limit()),
        rate_limit: RateLimit::default(),
    });
    let opening = Opening::begin(&node.session, &address)?;
    let mut services = Vec::new();
    for (place, external) in endpoint.external_types.iter().enumerate() {
        let [request, reply] = names::service(endpoint, external, &node.rules)?;
        let spec = |names| EndpointSpec {
            names,
            role: Role::Client,
            types: &endpoint.types,
            qos: None,
            signal: signal.clone(),
            labels: node.types.labels(&external.type_name),
        };
        let inbox = Arc::new(OperationReplies {
            place,
            own: OnceLock::new(),
            replies: Arc::clone(&replies),
        });
        // The reader comes first: a server that has found the writer soon finds the reader, too.
        let reader = opening.reader(spec(reply), Arc::clone(&inbox) as _)?;
        let writer = opening.writer(spec(request), Arc::new(()))?;
        let _ = inbox.own.set([reader.guid, writer.guid]);
        services.push(Service {
            id: external.id,
            ports: ClientPorts {
                requests: writer,
                replies: reader,
            },
            sent: 0,
        });
    }
    let states: Vec<_> = services
        .iter()
        .flat_map(|service| {
            [
                service.ports.replies.state(),
                service.ports.requests.state(),
            ]
        })
        .collect();
    opening.meet(&states);
    let guids = |of: fn(&Service) -> Guid| services.iter().map(of).collect::<Vec<_>>();
    let listed = node.graph.list(
        &guids(|service| service.ports.replies.guid),
        &guids(|service| service.ports.requests.guid),
    );
    let client = RosClient {
        caller: Rc::new(Caller {
            address,
            signal,
            wake_event: node.session.environment.wake_event.clone(),
            spin: Cell::new(Spin::new(endpoint.qos.spin)),
        }),
        services,
        _listed: listed,
        received: replies,
        started: StartedCalls::default(),
        number: node.number_client(),
        sent: 0,
        has_advised: false,
        last: 0,
        buffer: Vec::new(),
    };
    if let Some(service) = client.services.first() {
        let state = service.ports.requests.state();
        node.session.wait_for_remote(state, || client.peers() > 0);
    }
    Ok(client)
}

pub(crate) struct RosClient {
    caller: Rc<Caller>,
    services: Vec<Service>,
    _listed: Listed,
    received: Arc<Replies>,
    started: StartedCalls<SentRequest>,
    /// The number of this client in its component.
    number: u32,
    /// Number of requests, for servers that do not count samples.
    sent: u64,
    /// Whether the log has advice about a server that does not reply.
    has_advised: bool,
    /// The operation of the last request.
    last: usize,
    /// The envelope of a reply.
    buffer: Vec<u8>,
}

/// A request that was sent: its operation, its identity in the envelope and here, its server, and when
/// it was sent, also as a time stamp.
#[derive(Clone, Copy)]
struct SentRequest {
    at: usize,
    id: RequestId,
    key: RequestKey,
    server: GuidPrefix,
    sent: (u64, i64),
}

impl Service {
    /// The reader of `server`, whether it belongs to another program, and how it relates replies to
    /// requests.
    fn reader_of(&self, server: GuidPrefix) -> Option<(Guid, bool, Mapping)> {
        let reader = |peer: &Peer| {
            let mapping = Mapping::of(peer);
            (peer.prefix() == server).then_some((peer.guid, peer.is_external(), mapping))
        };
        let state = self.ports.requests.state();
        state.usable(reader).first().copied()
    }
}

impl RosClient {
    /// Says once what to do about a server that does not reply, if its mapping is unknown.
    fn advise(&mut self, at: usize, server: GuidPrefix) {
        if let Some((guid, true, _)) = self.services[at].reader_of(server)
            && let Some(advice) = calls::advice_on_server(&guid)
            && !std::mem::replace(&mut self.has_advised, true)
        {
            tracing::warn!("no reply from `{}`: {advice}", self.caller.address);
        }
    }

    /// The operation of a request.
    fn operation(&self, request: &dyn RequestBody) -> Result<(usize, RequestId), CallError> {
        let (id, operation) = rpc::open_request(&mut Reader::new(request.begin()))?;
        let at = self
            .services
            .iter()
            .position(|service| service.id == operation);
        let at = at.ok_or_else(|| {
            self.caller.failed(&"this component was generated without types of ROS 2 for this operation; generate it again with --middleware ros2")
        })?;
        Ok((at, id))
    }

    /// Waits until a server of another program has the requests of the last operation: services are
    /// independent of each other, and only components number requests over all of them.
    fn keep_order(&self, server: GuidPrefix, at: usize) -> Result<(), CallError> {
        let of_last = |request: &RequestKey| request.0 == self.last;
        let is_pending = self.received.queue.is_pending(of_last);
        let last = &self.services[self.last];
        let Some((reader, ..)) = last.reader_of(server).filter(|_| is_pending) else {
            return Ok(());
        };
        let waited = if self.last == at {
            Ok(())
        } else {
            last.ports.requests.writer.wait_for_acks_of(&reader, ROOM)
        };
        waited.map_err(|_| CallError::QueueFull(self.caller.address.clone()))
    }

    /// Sends a request after it has waited for room, at most `room`. Each request gets a reply, a
    /// command an empty response. `is_awaited`: whether a call waits for the reply.
    fn submit(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        is_awaited: bool,
        room: Duration,
    ) -> Result<SentRequest, CallError> {
        let (at, id) = self.operation(request)?;
        let no_server = || CallError::NoServer(self.caller.address.clone());
        let service = &self.services[at];
        let server = service.ports.server(self.received.queue.server());
        let server = server.ok_or_else(no_server)?;
        let (_, is_external, mapping) = service.reader_of(server).ok_or_else(no_server)?;
        let queue = &self.received.queue;
        self.caller.make_room(queue, server, is_external, room)?;
        if is_external {
            self.keep_order(server, at)?;
        }
        let service = &self.services[at];
        let writer = &service.ports.requests.writer;
        let length = request.length().saturating_sub(ENVELOPE);
        let loan = writer.loan(length);
        let mut loan = loan.map_err(|error| self.caller.failed(&error))?;
        request.write_into(loan.memory())?;
        let sequence = service.sent + 1;
        let count = self.sent + 1;
        let number = match mapping {
            Mapping::Beside if is_external => sequence.cast_signed(),
            Mapping::Beside => calls::number(self.number, count),
            Mapping::Before => count.cast_signed(),
        };
        let key = (at, number, mapping);
        queue.begin(key, is_awaited);
        let asked = (header.sent, stamp(header.sent));
        let numbers = (sequence, asked.1);
        let sent = match mapping {
            Mapping::Beside => {
                let related = Identity {
                    guid: service.ports.replies.guid,
                    // Fast DDS counts samples by itself, and has nothing here.
                    number: if is_external { -1 << 32 } else { number },
                };
                writer.send(loan, numbers, 0, Some(related))
            }
            Mapping::Before => {
                let guid = service.ports.requests.guid;
                let header = calls::header(Identity { guid, number });
                loan.memory()[BEFORE_BODY - HEADER..BEFORE_BODY].copy_from_slice(&header);
                writer.send(loan, numbers, HEADER, None)
            }
        };
        sent.map_err(|error| {
            queue.cancel(key);
            self.caller.not_sent(&error)
        })?;
        self.services[at].sent = sequence;
        self.sent = count;
        self.last = at;
        Ok(SentRequest {
            at,
            id,
            key,
            server,
            sent: asked,
        })
    }

    /// The state of a call. If its reply has arrived, `take` gets it.
    fn state(&mut self, asked: SentRequest, take: &mut dyn FnMut(Header, &[u8])) -> CallState {
        CallState {
            has_server: self.services[asked.at].ports.has(asked.server),
            reply: self.take_reply(asked, take),
        }
    }

    /// Ends a call, which has this result.
    fn finish(&mut self, asked: SentRequest, result: &Result<(), CallError>) {
        if matches!(result, Err(CallError::Deadline { .. })) {
            self.advise(asked.at, asked.server);
        }
        self.received.queue.finish(asked.key);
    }

    /// Passes the reply to a request to `take`, if it has arrived.
    fn take_reply(
        &mut self,
        SentRequest {
            at, id, key, sent, ..
        }: SentRequest,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Option<Result<(), CallError>> {
        let received = match self.received.queue.take(key)? {
            Ok(received) => received,
            Err(reason) => return Some(Err(self.caller.failed(&reason))),
        };
        let (is_refusal, mut sample) = (received.is_refusal, received.sample);
        let header = Header {
            sent: reply_sent(sent, sample.stamp()),
            ..sample_header(&sample, sample.writer().into(), 0)
        };
        if is_refusal {
            let (reason, state) = match body(&sample) {
                Ok(body) => rpc::read_reason(&mut Reader::new(body)),
                Err(reason) => (Some(clean(&reason)), None),
            };
            return Some(Err(match (reason, state) {
                (_, Some(state)) => CallError::Unavailable { state },
                (Some(reason), None) => CallError::Refused(reason),
                (None, None) => CallError::Refused("no reason was given".to_owned()),
            }));
        }
        // Only a reply in the mapping of its request is here.
        let skipped = match sample.related() {
            Some(_) => Mapping::Beside.skipped(),
            None => Mapping::Before.skipped(),
        };
        let operation = self.services[at].id;
        let mut buffer = std::mem::take(&mut self.buffer);
        let whole = calls::enveloped(&mut sample, skipped, &mut buffer, |writer| {
            rpc::begin_reply(writer, id, operation, 0);
        });
        let taken = match whole {
            Ok(whole) => {
                take(header, whole);
                Ok(())
            }
            Err(reason) => Err(self.caller.failed(&reason)),
        };
        self.buffer = buffer;
        Some(taken)
    }
}

impl Client for RosClient {
    fn guid(&self) -> [u8; 16] {
        self.services
            .first()
            .map_or([0; 16], |service| service.ports.requests.guid)
    }

    fn profile(&self) -> Profile {
        Profile::Bare
    }

    /// A program outside stamps its replies with its own clock.
    fn replies_have_ages(&self) -> bool {
        let service = self.services.first();
        service.is_some_and(|service| {
            let server = service.ports.server(self.received.queue.server());
            let reader = server.and_then(|server| service.reader_of(server));
            reader.is_some_and(|(_, is_external, _)| !is_external)
        })
    }

    fn can_loan(&self) -> bool {
        true
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        self.submit(header, request, false, ROOM).map(drop)
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let start = Instant::now();
        if self.caller.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        let asked = self.submit(header, request, true, ROOM)?;
        let caller = Rc::clone(&self.caller);
        let result = caller.await_reply((start, limit), || self.state(asked, take));
        self.finish(asked, &result);
        result
    }

    /// A server of another program is asked only after it has the requests of the last operation,
    /// which takes at most [`ROOM`].
    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        let start = Instant::now();
        if self.caller.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        self.started.check_room()?;
        let asked = self.submit(header, request, true, Duration::ZERO)?;
        self.started.add(header.sequence, asked, (start, limit));
        Ok(())
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        if self.started.is_empty() {
            return None;
        }
        let caller = Rc::clone(&self.caller);
        caller.signal.clear();
        let mut started = std::mem::take(&mut self.started);
        let is_stopping = caller.wake_event.is_stopping();
        let ended = started.next(&caller.address, is_stopping, |sequence, asked| {
            caller.look(self.state(*asked, &mut |header, body| take(sequence, header, body)))
        });
        self.started = started;
        let (sequence, asked, result) = ended?;
        self.finish(asked, &result);
        Some((sequence, result))
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.started.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        if let Some(asked) = self.started.forget(sequence) {
            self.received.queue.finish(asked.key);
        }
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.caller.awaiting(&self.started)
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.received.queue.gauge().clone())
    }

    /// Requests to components name the reader of their replies.
    fn senders(&self) -> Vec<u128> {
        let services = self.services.iter();
        let guids = services.map(|service| service.ports.replies.guid);
        guids.map(u128::from_be_bytes).collect()
    }

    fn number_there(&self, _: &dyn RequestBody) -> Option<u64> {
        let number = calls::number(self.number, self.sent + 1);
        Some(number.unsigned_abs())
    }

    fn peers(&self) -> usize {
        let mut services = self.services.iter();
        usize::from(services.any(|service| !service.ports.servers().is_empty()))
    }

    fn server(&self) -> u128 {
        let services = self.services.iter();
        services.fold(0, |all, service| {
            all.rotate_left(1) ^ service.ports.server_number()
        })
    }
}
