//! The server: for each operation a service, with a reader of requests and a writer of replies.

use crate::calls::{self, Id, Service};
use crate::config::Mapping;
use crate::endpoint_state::{Inbox, Peer, Reasons, Sender, is_ready};
use crate::held::UNKNOWN;
use crate::session::{Session, Unsent, signal};
use crate::shared::Shared;
use crate::wire::{Body, Sample};
use rc_middleware::rpc::{self, ReplyKind, RequestId};
use rc_middleware::{
    Endpoint, Header, OpenError, Profile, Reader, ReceiveError, Reply, Server, WakeEvent, Writer,
};
use rc_network::{
    Backlog, Guid, QueuedRequest, RateLimit, RequestQueues, Role, lock, prefix, stamp,
};
use std::collections::VecDeque;
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// How long a request waits until its client can be reached. A client whose reader was not found by
/// then has none.
const HOLD: Duration = Duration::from_millis(200);
/// Most requests without room that are kept for a refusal.
const MOST_REFUSED: usize = 64;

/// A request with its identity.
struct Asked {
    sample: Sample,
    id: Id,
    /// Number of bytes before the body of the sample.
    skipped: usize,
}

/// The requests to a server.
struct Queue {
    mapping: Mapping,
    shared: Arc<Shared>,
    requests: RequestQueues<Guid, Asked>,
    /// Requests that found no room.
    refused: Mutex<VecDeque<(usize, Guid, Id)>>,
    reasons: Reasons,
}

impl Inbox for Queue {
    fn put(&self, samples: Vec<Sample>) {
        for sample in samples {
            let (id, skipped) = match calls::read(self.mapping, &sample, None) {
                Ok(read) => read,
                Err(reason) => {
                    self.unreadable(reason);
                    continue;
                }
            };
            let client = self.shared.sender(&sample.writer);
            let size = sample.taken.len();
            let refuse = |asked: &Asked| {
                let mut refused = lock(&self.refused);
                if refused.len() < MOST_REFUSED {
                    refused.push_back((asked.sample.place, asked.sample.writer, asked.id));
                }
                None
            };
            let asked = Asked {
                sample,
                id,
                skipped,
            };
            self.requests.put(client, size, asked, refuse);
        }
    }

    fn unreadable(&self, reason: String) {
        self.reasons.put(reason);
    }
}

impl Backlog for Queue {
    fn awaits_peers(&self) -> bool {
        self.requests.awaits_peers()
    }
}

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<RosServer, OpenError> {
    let address = endpoint.address.to_string();
    let signal = signal(&address)?;
    let mapping = session.config.mapping;
    let queue = Arc::new(Queue {
        mapping,
        shared: Arc::clone(&session.shared),
        requests: RequestQueues::default(),
        refused: Mutex::default(),
        reasons: Reasons::default(),
    });
    let inbox: Arc<dyn Inbox> = Arc::clone(&queue) as _;
    let services = calls::services(session, endpoint, Role::Server, &signal, &inbox)?;
    Ok(RosServer {
        address,
        services,
        queue,
        signal,
        mapping,
        reply: Vec::new(),
        rate_limit: RateLimit::default(),
    })
}

pub(crate) struct RosServer {
    address: String,
    services: Vec<Service>,
    queue: Arc<Queue>,
    signal: WakeEvent,
    mapping: Mapping,
    reply: Vec<u8>,
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

impl Service {
    /// Whether to serve a request now: its client is known, and the reply reaches it, or the client
    /// has gone and gets none.
    fn may_serve(&self, waiting: &QueuedRequest<Asked>) -> bool {
        let member = waiting.sample.sample.prefix();
        let same = |peer: &Peer| peer.prefix() == member;
        let sender = self.requests.state.sender(&waiting.sample.sample.writer);
        if sender == Sender::Unknown && waiting.since.elapsed() < UNKNOWN {
            return false;
        }
        self.replies.state.has(|peer| same(peer) && is_ready(peer))
            || (!self.requests.state.has(same)
                && self.requests.state.knows(&waiting.sample.sample.writer))
            || waiting.since.elapsed() >= HOLD
    }
}

impl RosServer {
    /// Takes in the samples that have arrived.
    fn hear(&self) {
        if let Some(service) = self.services.first() {
            service.requests.state.hear();
        }
    }

    fn failed(&self, reason: String) -> ReceiveError {
        ReceiveError {
            address: self.address.clone(),
            reason,
        }
    }

    /// Sends the reply to a request that the client wrote with `writer`.
    fn answer(
        &mut self,
        place: usize,
        writer: &Guid,
        id: Id,
        body: &[u8],
    ) -> Result<(), ReceiveError> {
        let member = prefix(writer);
        let ours = |peer: &Peer| peer.prefix() == member && peer.info.is_some();
        let mut mapping = self.mapping;
        if calls::is_too_large(mapping, body.len()) {
            if !self.services[place].replies.state.has(ours) {
                return Err(self.failed(format!(
                    "an answer of {} bytes cannot be sent to a client that is no component: rustdds has no way for one of more than a kilobyte in the Enhanced mapping. Set `service_mapping = \"cyclone\"`, on both sides",
                    body.len()
                )));
            }
            mapping = Mapping::Cyclone;
        }
        let mark = calls::mark(mapping, id, true);
        let port = &mut self.services[place].replies;
        // A large reply, or one only for components, goes to the one reader of that process. A
        // small reply goes to all: that costs less than to tell the others that they miss nothing.
        let mut to = None;
        if body.len() > calls::LARGE || id.1 < 0 {
            let same = |peer: &Peer| (peer.prefix() == member).then_some(peer.guid);
            if let [only] = port.state.usable(same)[..] {
                to = Some(only);
            }
        }
        let body = Body::of(&[&mark.header, body]);
        let sent = match port.send(body.clone(), stamp(0), mark.related, to) {
            Err(Unsent::Full) => match port.renew() {
                Ok(()) => Err(Unsent::Full),
                Err(reason) => Err(Unsent::Failed(reason)),
            },
            sent => sent,
        };
        match sent {
            Ok(_) => Ok(()),
            Err(Unsent::Full) => {
                Err(self.failed("a reply was lost: a client confirms nothing".to_owned()))
            }
            Err(Unsent::Failed(reason)) => {
                Err(self.failed(format!("a reply cannot be sent: {reason}")))
            }
        }
    }

    /// Tells the client, if it is a component, that nothing was executed, and why. ROS has no
    /// message for that.
    fn refuse(
        &mut self,
        place: usize,
        writer: &Guid,
        id: Id,
        reason: &str,
    ) -> Result<(), ReceiveError> {
        let member = prefix(writer);
        let ours = |peer: &Peer| peer.prefix() == member && peer.info.is_some();
        if !self.services[place].replies.state.has(ours) {
            if let Some(passed) = self.rate_limit.allow() {
                let (count, address) = (passed + 1, &self.address);
                tracing::warn!(
                    "a request to `{address}` stays without an answer ({count} times): {reason}"
                );
            }
            return Ok(());
        }
        let mut body = Writer::default();
        rc_middleware::cdr::text(&reason.replace('\0', " "), &mut body);
        self.answer(place, writer, (id.0, -id.1), &body.into_bytes())
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
        // All samples that have arrived are in the queue, so that clients take turns.
        self.hear();
        if let Some(reason) = self.queue.reasons.next() {
            return Err(self.failed(reason));
        }
        let refused = lock(&self.queue.refused).pop_front();
        if let Some((place, writer, id)) = refused {
            let reason = "too many requests of this client wait already";
            return self.refuse(place, &writer, id, reason).map(|()| true);
        }
        let services = &self.services;
        let may = |waiting: &QueuedRequest<Asked>| {
            let service = services.get(waiting.sample.sample.place);
            service.is_none_or(|service| service.may_serve(waiting))
        };
        let Some(QueuedRequest { sample: asked, .. }) = self.queue.requests.next(may) else {
            if self.queue.awaits_peers() {
                self.queue.shared.search_soon();
            }
            return Ok(false);
        };
        let Asked {
            mut sample,
            id,
            skipped,
        } = asked;
        let (place, writer) = (sample.place, sample.writer);
        let Some(service) = self.services.get(place) else {
            return Ok(true);
        };
        if service.requests.state.sender(&writer) == Sender::Mismatched {
            let reason = "the types differ; regenerate and rebuild both ends";
            return self.refuse(place, &writer, id, reason).map(|()| true);
        }
        let request = RequestId {
            writer: id.0,
            sequence: id.1.unsigned_abs(),
        };
        let operation = service.id;
        let mut envelope = Writer::default();
        rpc::begin_request(&mut envelope, request, operation);
        rpc::begin_body(&mut envelope, Profile::Ros);
        let sender = u128::from_be_bytes(writer);
        let header = rc_network::header(sample.sequence, sample.stamp, sender, 0);
        let body = sample.taken.in_envelope(skipped, &envelope.into_bytes());
        let mut reply = RosReply(std::mem::take(&mut self.reply));
        reply.0.clear();
        answer(header, body, &mut reply);
        let RosReply(reply) = reply;
        let done = if reply.is_empty() {
            // A command: its empty structure is one octet.
            self.answer(place, &writer, id, &[0])
        } else {
            match rpc::open_reply(&mut Reader::new(&reply), operation) {
                Ok((_, ReplyKind::Case(_))) => {
                    let body = reply.get(rpc::ENVELOPE..).unwrap_or_default();
                    self.answer(place, &writer, id, body)
                }
                Ok((_, ReplyKind::Refused(reason))) => self.refuse(place, &writer, id, &reason),
                Err(error) => Err(self.failed(error.to_string())),
            }
        };
        self.reply = reply;
        done.map(|()| true)
    }

    fn peers(&self) -> usize {
        let all = self.services.iter();
        let counts = all.map(|service| service.requests.state.count());
        counts.max().unwrap_or(0)
    }
}
