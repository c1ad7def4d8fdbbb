//! The client: a writer of requests and a reader of replies.

use crate::inbox::Replies;
use crate::names;
use rc_ddsc::BEFORE_BODY;
use rc_middleware::qos::REQUEST_QUEUE;
use rc_middleware::rpc;
use rc_middleware::{
    CallError, Client, Endpoint, Header, OpenError, QueueGauge, RequestBody, wait,
};
use rc_network::{
    CallState, EndpointSpec, GuidPrefix, Opening, Peer, PendingCall, ReaderPort, Role, Session,
    WriterPort, body, sample_header, signal, stamp,
};
use std::collections::BTreeSet;
use std::os::fd::AsFd;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest wait for room in a full queue: replies to requests that the server has taken are on
/// their way.
const ROOM: Duration = Duration::from_millis(50);

/// After this time a request to a server of another program no longer counts as pending: such a
/// server may not reply to commands.
const SILENCE: Duration = Duration::from_secs(1);
/// Longest wait for the reply of a server that has gone: samples and discovery arrive on different
/// threads.
const LAST_WORDS: Duration = Duration::from_millis(10);

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<DdsClient, OpenError> {
    let address = endpoint.address.to_string();
    let signal = signal(&address)?;
    let inbox = Arc::new(Replies::new(&address, session.queue_limit()));
    let spec = |names| EndpointSpec {
        names,
        role: Role::Client,
        types: &endpoint.types,
        qos: None,
        signal: signal.clone(),
        labels: String::new(),
    };
    let [request, reply] = names::service(endpoint);
    let opening = Opening::begin(session, &address)?;
    // The reader comes first: a server that has found the writer soon finds the reader, too.
    let replies = opening.reader(spec(reply), Arc::clone(&inbox) as _)?;
    let requests = opening.writer(spec(request), Arc::new(()))?;
    inbox.set_client(requests.guid);
    opening.meet(&[replies.state(), requests.state()]);
    let client = DdsClient {
        address,
        requests,
        replies,
        inbox,
        spin: endpoint.qos.spin,
    };
    let found = || client.server().is_some();
    let state = client.requests.state();
    session.wait_for_remote(state, found);
    Ok(client)
}

fn is_server(peer: &Peer) -> bool {
    let info = peer.info.as_ref();
    info.is_none_or(|info| info.role == Role::Server)
}

pub(crate) struct DdsClient {
    address: String,
    requests: WriterPort,
    replies: ReaderPort,
    inbox: Arc<Replies>,
    spin: Duration,
}

impl DdsClient {
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
    fn is_there(&self, server: GuidPrefix) -> bool {
        let same = |peer: &Peer| peer.prefix() == server && is_server(peer);
        self.replies.state().has(same) && self.requests.state().has(same)
    }

    /// Whether `server` is another program, which tells nothing of itself.
    fn is_external(&self, server: GuidPrefix) -> bool {
        let same = |peer: &Peer| peer.prefix() == server && peer.is_external();
        self.requests.state().has(same)
    }

    fn server(&self) -> Option<GuidPrefix> {
        let asked = self.inbox.queue.server();
        let same = asked.filter(|asked| self.is_there(*asked));
        same.or_else(|| Some(self.servers().first()?.1))
    }

    fn failed(&self, reason: String) -> CallError {
        CallError::Backend {
            address: self.address.clone(),
            reason,
        }
    }

    /// Sends a request; gives its server. Each request gets a reply, a command an empty one.
    /// `is_awaited`: whether a call waits for the reply.
    fn submit(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        is_awaited: bool,
    ) -> Result<GuidPrefix, CallError> {
        let no_server = || CallError::NoServer(self.address.clone());
        let server = self.server().ok_or_else(no_server)?;
        let queue = &self.inbox.queue;
        queue.set_server(server);
        let deadline = Instant::now() + ROOM;
        loop {
            self.requests.state().signal.clear();
            if queue.pending() >= REQUEST_QUEUE && self.is_external(server) {
                queue.expire(SILENCE);
            }
            if queue.pending() < REQUEST_QUEUE {
                break;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(CallError::QueueFull(self.address.clone()));
            }
            wait(&[self.requests.state().signal.as_fd()], left);
        }
        let id = rpc::request_id(request.begin());
        let id = id.ok_or_else(|| self.failed("a request has no envelope".to_owned()))?;
        let writer = &self.requests.writer;
        let loan = writer.loan(request.length());
        let mut loan = loan.map_err(|error| self.failed(error.to_string()))?;
        request.write_into(&mut loan.memory()[BEFORE_BODY..])?;
        queue.begin(id.sequence, is_awaited);
        let sent = writer.send(loan, (header.sequence, stamp(header.sent)), 0, None);
        sent.map_err(|error| {
            queue.cancel(id.sequence);
            if error.is_timeout() {
                CallError::QueueFull(self.address.clone())
            } else {
                self.failed(error.to_string())
            }
        })?;
        Ok(server)
    }

    /// Passes the reply to the waiting call to `take`, if it has arrived.
    fn take_reply(&self, take: &mut dyn FnMut(Header, &[u8])) -> Option<Result<(), CallError>> {
        let reply = self.inbox.queue.take()?;
        let taken = reply.and_then(|sample| {
            let header = sample_header(&sample, sample.writer().into(), 0);
            take(header, body(&sample)?);
            Ok(())
        });
        Some(taken.map_err(|reason| self.failed(reason)))
    }

    /// Waits for the reply of `server`, at most until `limit` has passed since `start`.
    fn await_reply(
        &self,
        server: GuidPrefix,
        (start, limit): (Instant, Duration),
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let call = PendingCall {
            signal: &self.requests.state().signal,
            wake_event: &self.requests.session.environment.wake_event,
            spin: self.spin,
            last_words: LAST_WORDS,
        };
        let waited = call.wait((start, limit), || CallState {
            has_server: self.is_there(server),
            reply: self.take_reply(take),
        });
        waited.unwrap_or_else(|why| Err(why.error(&self.address, limit)))
    }
}

impl Client for DdsClient {
    /// The identity of its writer, as DDS-RPC defines it.
    fn guid(&self) -> [u8; 16] {
        self.requests.guid
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
        if self.requests.session.environment.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        let server = self.submit(header, request, true)?;
        let result = self.await_reply(server, (start, limit), take);
        self.inbox.queue.finish();
        result
    }

    fn peers(&self) -> usize {
        usize::from(!self.servers().is_empty())
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.inbox.queue.gauge().clone())
    }
}
