//! The server: a reader of requests and a writer of replies.

use crate::inbox::{Received, Requests};
use crate::names;
use rc_ddsc::Loan;
use rc_middleware::rpc::{self, Outcome};
use rc_middleware::{
    DeferredReply, Endpoint, Header, OpenError, Profile, QueueGauge, Reader, ReceiveError, Reply,
    Server, Writer,
};
use rc_network::{
    EndpointSpec, GuidPrefix, Opening, Peer, QueuedRequest, ReaderPort, ReplyMemory, Role, Session,
    WriterPort, Written, body, prefix, reply_stamp, sample_header, signal, stamp,
};
use std::cell::Cell;
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// How long a request waits until its client can be reached. A client whose reader was not found by
/// then counts as one without a reader.
const HOLD: Duration = Duration::from_millis(200);
/// How long a request of a component waits, which has a reader of replies.
const HOLD_COMPONENT: Duration = Duration::from_secs(5);

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<DdsServer, OpenError> {
    let address = endpoint.address.to_string();
    let signal = signal(&address)?;
    let queue = Arc::new(Requests::new(session.queue_limit()));
    let spec = |names| EndpointSpec {
        names,
        role: Role::Server,
        types: &endpoint.types,
        qos: None,
        signal: signal.clone(),
        labels: String::new(),
    };
    let [request, reply] = names::service(endpoint);
    let opening = Opening::begin(session, &address)?;
    let replies = opening.writer(spec(reply), Arc::clone(&queue) as _)?;
    let requests = opening.reader(spec(request), Arc::clone(&queue) as _)?;
    opening.meet(&[replies.state(), requests.state()]);
    Ok(DdsServer {
        requests,
        replies: Rc::new(Replies {
            address,
            port: replies,
            sent: Cell::new(0),
        }),
        queue,
        reply: Vec::new(),
    })
}

pub(crate) struct DdsServer {
    requests: ReaderPort,
    replies: Rc<Replies>,
    queue: Arc<Requests>,
    reply: Vec<u8>,
}

/// The state for sending replies. Deferred replies share it with their server.
struct Replies {
    address: String,
    port: WriterPort,
    /// Number of replies that were sent.
    sent: Cell<u64>,
}

/// A deferred reply, and the time stamp of its request.
struct DdsDeferred(Rc<Replies>, i64);

impl DeferredReply for DdsDeferred {
    fn send(self: Box<Self>, write: &mut dyn FnMut(&mut dyn Reply)) -> Result<(), ReceiveError> {
        let mut reply = ReplyMemory::new(&self.0.port.writer, Profile::Rpc, Vec::new());
        write(&mut reply);
        let at = reply_stamp(self.1, reply.age());
        match reply.finish() {
            Written::Loan(loan, _) => self.0.send_lent(loan, at),
            Written::Buffer(reply) if !reply.is_empty() => self.0.send(&reply, at),
            Written::Buffer(_) | Written::Deferred(_) => Ok(()),
        }
    }
}

impl DdsServer {
    /// Whether to serve a request now: its reply reaches the client, or the client has left and
    /// gets none.
    fn may_serve(&self, waiting: &QueuedRequest<Received>) -> bool {
        let writer = waiting.sample.sample.writer();
        let client = self.requests.shared.peer(writer);
        let Some(client) = client else {
            return true;
        };
        let hold = if client.is_external() {
            HOLD
        } else {
            HOLD_COMPONENT
        };
        let same = |peer: &Peer| peer.prefix() == client.prefix();
        self.replies.port.state().has(same)
            || self.requests.shared.has_lost(writer)
            || waiting.since.elapsed() >= hold
    }

    /// Sends a reply to the request in `body`, with the time stamp `at`, and gives its buffer back.
    fn send(
        &self,
        client: Option<GuidPrefix>,
        body: &[u8],
        mut reply: Vec<u8>,
        at: i64,
    ) -> (Vec<u8>, Result<(), ReceiveError>) {
        if reply.is_empty() {
            // A command. DDS-RPC replies to it as to an operation without a result, and the client
            // counts these replies.
            if let Ok((id, operation)) = rpc::open_request(&mut Reader::new(body)) {
                let mut writer = Writer::over(reply);
                rpc::begin_reply(&mut writer, id, operation, 0);
                writer.put(&0_u8);
                reply = writer.into_bytes();
            }
        }
        let sent = if reply.is_empty() || client.is_none() {
            // It was not a request, or its client has left.
            Ok(())
        } else {
            self.replies.send(&reply, at)
        };
        (reply, sent)
    }
}

impl Replies {
    fn next(&self) -> u64 {
        self.sent.set(self.sent.get() + 1);
        self.sent.get()
    }

    fn send(&self, reply: &[u8], at: i64) -> Result<(), ReceiveError> {
        self.sent(self.port.writer.write(self.next(), at, reply))
    }

    fn send_lent(&self, reply: Loan, at: i64) -> Result<(), ReceiveError> {
        let numbers = (self.next(), at);
        self.sent(self.port.writer.send(reply, numbers, 0, None))
    }

    fn sent(&self, sent: Result<(), rc_ddsc::Error>) -> Result<(), ReceiveError> {
        sent.map_err(|error| self.failed(format!("a reply cannot be sent: {error}")))
    }

    fn failed(&self, reason: String) -> ReceiveError {
        ReceiveError {
            address: self.address.clone(),
            reason,
        }
    }

    fn refuse(
        &self,
        id: rpc::RequestId,
        outcome: Outcome,
        reason: &str,
    ) -> Result<(), ReceiveError> {
        let mut writer = Writer::default();
        rpc::refuse(&mut writer, id, outcome, reason);
        self.send(&writer.into_bytes(), stamp(0))
    }
}

impl Server for DdsServer {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.requests.state().signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.requests.state().signal.clear();
    }

    fn serve(
        &mut self,
        handler: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        if let Some(id) = self.queue.refused() {
            self.replies
                .refuse(id, Outcome::OutOfResources, rc_network::NO_ROOM)?;
            return Ok(true);
        }
        let next = self.queue.waiting.next(|waiting| self.may_serve(waiting));
        let Some(QueuedRequest {
            sample: Received { sample, .. },
            ..
        }) = next
        else {
            return Ok(false);
        };
        let body = body(&sample).map_err(|reason| self.replies.failed(reason))?;
        let client = self.requests.shared.participant(sample.writer());
        if let (Some(client), Some(id)) = (client, rpc::request_id(body))
            && prefix(&id.writer) != client
        {
            // The reply would pass for the reply to a request of that client.
            return Err(self
                .replies
                .failed("a request names another client than its sender".to_owned()));
        }
        let Some(sender) = self.requests.shared.sender(sample.writer()) else {
            if let Some(id) = rpc::request_id(body) {
                let reason = "the types differ; regenerate and rebuild both ends";
                self.replies.refuse(id, Outcome::InvalidArgument, reason)?;
            }
            return Ok(true);
        };
        let buffer = std::mem::take(&mut self.reply);
        let later = || -> Box<dyn DeferredReply> {
            Box::new(DdsDeferred(Rc::clone(&self.replies), sample.stamp()))
        };
        let reply = ReplyMemory::new(&self.replies.port.writer, Profile::Rpc, buffer);
        // Also if the client has left: its request must not delay others.
        let mut reply = reply.or_later(&later);
        // The client sends the hash of the whole interface, which is equal. The runtime compares
        // hashes of operations.
        handler(sample_header(&sample, sender.id, 0), body, &mut reply);
        let at = reply_stamp(sample.stamp(), reply.age());
        let (reply, sent) = match reply.finish() {
            Written::Deferred(buffer) => (buffer, Ok(())),
            Written::Loan(loan, buffer) => {
                let sent = client.map_or(Ok(()), |_| self.replies.send_lent(loan, at));
                (buffer, sent)
            }
            Written::Buffer(reply) => self.send(client, body, reply, at),
        };
        self.reply = reply;
        sent.map(|()| true)
    }

    fn peers(&self) -> usize {
        self.requests.state().count()
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.queue.waiting.gauge().clone())
    }
}
