//! The client: for each operation a service, with a writer of requests and a reader of replies.

use crate::calls::{self, HEADER, Mapping};
use crate::graph::Listed;
use crate::names;
use crate::node::Node;
use rc_ddsc::{BEFORE_BODY, Identity, Sample};
use rc_diagnostics::foreign::clean;
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::rpc::{self, ENVELOPE, RequestId};
use rc_middleware::{
    CallError, Client, Endpoint, Header, OpenError, Profile, QueueGauge, Reader, RequestBody,
    WakeEvent, wait,
};
use rc_network::{
    Backlog, CallState, EndpointSpec, Guid, GuidPrefix, Inbox, Opening, Peer, PendingCall,
    RateLimit, ReaderPort, ReplyQueue, Role, WriterPort, body, sample_header, signal, stamp,
};
use std::collections::BTreeSet;
use std::os::fd::AsFd;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// Longest wait for room in a full queue: replies to requests that the server has taken are on
/// their way. And for the requests of another operation to arrive.
const ROOM: Duration = Duration::from_millis(50);
/// After this time a request to a server of another program no longer counts as pending.
const SILENCE: Duration = Duration::from_secs(1);
/// Longest wait for the reply of a server that has gone: samples and discovery arrive on different
/// threads.
const LAST_WORDS: Duration = Duration::from_millis(20);

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
struct OfOperation {
    place: usize,
    /// The reader of replies and the writer of requests.
    own: OnceLock<[Guid; 2]>,
    replies: Arc<Replies>,
}

impl Backlog for OfOperation {}

impl Inbox for OfOperation {
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
                        "`{address}` sent a sample that is no reply ({count} times): {reason}"
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
    requests: WriterPort,
    replies: ReaderPort,
    /// Number of samples that `requests` has sent.
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
        let inbox = Arc::new(OfOperation {
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
            requests: writer,
            replies: reader,
            sent: 0,
        });
    }
    let states: Vec<_> = services
        .iter()
        .flat_map(|service| [service.replies.state(), service.requests.state()])
        .collect();
    opening.meet(&states);
    let guids = |of: fn(&Service) -> Guid| services.iter().map(of).collect::<Vec<_>>();
    let listed = node.graph.list(
        &guids(|service| service.replies.guid),
        &guids(|service| service.requests.guid),
    );
    let client = RosClient {
        address,
        services,
        _listed: listed,
        received: replies,
        signal,
        wake_event: node.session.environment.wake_event.clone(),
        spin: endpoint.qos.spin,
        number: node.number_client(),
        sent: 0,
        has_advised: false,
        last: 0,
        buffer: Vec::new(),
    };
    if let Some(service) = client.services.first() {
        let state = service.requests.state();
        node.session.wait_for_remote(state, || client.peers() > 0);
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
    _listed: Listed,
    received: Arc<Replies>,
    signal: WakeEvent,
    wake_event: WakeEvent,
    spin: Duration,
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

impl Service {
    /// The servers that this client can reach and that can reach it: components first, since
    /// another program may answer anything.
    fn servers(&self) -> BTreeSet<(bool, GuidPrefix)> {
        let server = |peer: &Peer| is_server(peer).then(|| (peer.is_external(), peer.prefix()));
        let replying = self.replies.state().usable(server);
        let receiving = self.requests.state().usable(server);
        let both = receiving.into_iter().filter(|one| replying.contains(one));
        both.collect()
    }

    /// Whether `server` is among them.
    fn has(&self, server: GuidPrefix) -> bool {
        let same = |peer: &Peer| peer.prefix() == server && is_server(peer);
        self.replies.state().has(same) && self.requests.state().has(same)
    }

    /// The reader of `server`, whether it belongs to another program, and how it relates replies to
    /// requests.
    fn reader_of(&self, server: GuidPrefix) -> Option<(Guid, bool, Mapping)> {
        let reader = |peer: &Peer| {
            let mapping = Mapping::of(peer);
            (peer.prefix() == server).then_some((peer.guid, peer.is_external(), mapping))
        };
        self.requests.state().usable(reader).first().copied()
    }
}

impl RosClient {
    fn failed(&self, reason: String) -> CallError {
        CallError::Backend {
            address: self.address.clone(),
            reason,
        }
    }

    /// Says once what to do about a server that does not reply, if its mapping is unknown.
    fn advise(&mut self, at: usize, server: GuidPrefix) {
        if let Some((guid, true, _)) = self.services[at].reader_of(server)
            && let Some(advice) = calls::advice_on_server(&guid)
            && !std::mem::replace(&mut self.has_advised, true)
        {
            tracing::warn!("no reply from `{}`: {advice}", self.address);
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
            self.failed("this component was generated without types of ROS 2 for this operation; generate it anew with --middleware ros2".to_owned())
        })?;
        Ok((at, id))
    }

    /// Waits until there is room for one more request.
    fn make_room(&self, server: GuidPrefix, is_external: bool) -> Result<(), CallError> {
        let queue = &self.received.queue;
        queue.set_server(server);
        let deadline = Instant::now() + ROOM;
        loop {
            self.signal.clear();
            if queue.pending() >= REQUEST_QUEUE && is_external {
                queue.expire(SILENCE);
            }
            if queue.pending() < REQUEST_QUEUE {
                return Ok(());
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(CallError::QueueFull(self.address.clone()));
            }
            wait(&[self.signal.as_fd()], left);
        }
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
            last.requests.writer.wait_for_acks_of(&reader, ROOM)
        };
        waited.map_err(|_| CallError::QueueFull(self.address.clone()))
    }

    /// Sends a request; gives its operation, its identity and its server. Each request gets a
    /// reply, a command an empty response. `is_awaited`: whether a call waits for the reply.
    fn submit(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        is_awaited: bool,
    ) -> Result<(usize, RequestId, GuidPrefix), CallError> {
        let (at, id) = self.operation(request)?;
        let no_server = || CallError::NoServer(self.address.clone());
        let service = &self.services[at];
        let asked = self.received.queue.server();
        let same = asked.filter(|asked| service.has(*asked));
        let server = same.or_else(|| Some(service.servers().first()?.1));
        let server = server.ok_or_else(no_server)?;
        let (_, is_external, mapping) = service.reader_of(server).ok_or_else(no_server)?;
        self.make_room(server, is_external)?;
        if is_external {
            self.keep_order(server, at)?;
        }
        let failed = |error: rc_ddsc::Error| self.failed(error.to_string());
        let service = &self.services[at];
        let writer = &service.requests.writer;
        let length = request.length().saturating_sub(ENVELOPE);
        let mut loan = writer.loan(length).map_err(failed)?;
        request.write_into(loan.memory())?;
        let sequence = service.sent + 1;
        let count = self.sent + 1;
        let number = match mapping {
            Mapping::Beside if is_external => sequence.cast_signed(),
            Mapping::Beside => calls::number(self.number, count),
            Mapping::Before => count.cast_signed(),
        };
        let key = (at, number, mapping);
        let queue = &self.received.queue;
        queue.begin(key, is_awaited);
        let numbers = (sequence, stamp(header.sent));
        let sent = match mapping {
            Mapping::Beside => {
                let related = Identity {
                    guid: service.replies.guid,
                    // Fast DDS counts samples by itself, and has nothing here.
                    number: if is_external { -1 << 32 } else { number },
                };
                writer.send(loan, numbers, 0, Some(related))
            }
            Mapping::Before => {
                let guid = service.requests.guid;
                let header = calls::header(Identity { guid, number });
                loan.memory()[BEFORE_BODY - HEADER..BEFORE_BODY].copy_from_slice(&header);
                writer.send(loan, numbers, HEADER, None)
            }
        };
        sent.map_err(|error| {
            queue.cancel(key);
            if error.is_timeout() {
                CallError::QueueFull(self.address.clone())
            } else {
                failed(error)
            }
        })?;
        self.services[at].sent = sequence;
        self.sent = count;
        self.last = at;
        Ok((at, id, server))
    }

    /// Passes the reply to the waiting call, of operation `at`, to `take`, if it has arrived.
    fn take_reply(
        &mut self,
        (at, id): (usize, RequestId),
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Option<Result<(), CallError>> {
        let received = match self.received.queue.take()? {
            Ok(received) => received,
            Err(reason) => return Some(Err(self.failed(reason))),
        };
        let (is_refusal, mut sample) = (received.is_refusal, received.sample);
        let header = sample_header(&sample, sample.writer().into(), 0);
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
            Err(reason) => Err(self.failed(reason)),
        };
        self.buffer = buffer;
        Some(taken)
    }

    /// Waits for the reply of `server` to `request`, at most until `limit` has passed since
    /// `start`.
    fn await_reply(
        &mut self,
        request: (usize, RequestId),
        server: GuidPrefix,
        (start, limit): (Instant, Duration),
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let (signal, wake_event) = (self.signal.clone(), self.wake_event.clone());
        let call = PendingCall {
            signal: &signal,
            wake_event: &wake_event,
            spin: self.spin,
            last_words: LAST_WORDS,
        };
        let waited = call.wait((start, limit), || CallState {
            has_server: self.services[request.0].has(server),
            reply: self.take_reply(request, take),
        });
        waited.unwrap_or_else(|why| Err(why.error(&self.address, limit)))
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

    fn can_loan(&self) -> bool {
        true
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        self.submit(header, request, false).map(drop)
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let start = Instant::now();
        if self.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        let (at, id, server) = self.submit(header, request, true)?;
        let result = self.await_reply((at, id), server, (start, limit), take);
        if matches!(result, Err(CallError::Deadline { .. })) {
            self.advise(at, server);
        }
        self.received.queue.finish();
        result
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.received.queue.gauge().clone())
    }

    fn peers(&self) -> usize {
        let mut services = self.services.iter();
        usize::from(services.any(|service| !service.servers().is_empty()))
    }
}
