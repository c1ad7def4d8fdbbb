//! The server: a reader of requests and a writer of replies.

use crate::inbox::{Received, Requests};
use crate::names;
use rc_ddsc::Loan;
use rc_middleware::rpc::{self, Outcome};
use rc_middleware::{
    Endpoint, Header, OpenError, Profile, QueueGauge, Reader, ReceiveError, Reply, Server, Writer,
};
use rc_network::{
    EndpointSpec, Opening, Peer, QueuedRequest, ReaderPort, ReplyMemory, Role, Session, WriterPort,
    body, prefix, sample_header, signal, stamp,
};
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// How long a request waits until its client can be reached. A client whose reader was not found by
/// then has none.
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
        address,
        requests,
        replies,
        queue,
        reply: Vec::new(),
        sent: 0,
    })
}

pub(crate) struct DdsServer {
    address: String,
    requests: ReaderPort,
    replies: WriterPort,
    queue: Arc<Requests>,
    reply: Vec<u8>,
    /// Number of replies that were sent.
    sent: u64,
}

impl DdsServer {
    /// Whether to serve a request now: its reply reaches the client, or the client has gone and
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
        self.replies.state().has(same)
            || self.requests.shared.has_lost(writer)
            || waiting.since.elapsed() >= hold
    }

    fn send_reply(&mut self, reply: &[u8]) -> Result<(), ReceiveError> {
        self.sent += 1;
        let sent = self.replies.writer.write(self.sent, stamp(0), reply);
        self.sent_reply(sent)
    }

    fn send_lent(&mut self, reply: Loan) -> Result<(), ReceiveError> {
        self.sent += 1;
        let numbers = (self.sent, stamp(0));
        let sent = self.replies.writer.send(reply, numbers, 0, None);
        self.sent_reply(sent)
    }

    fn sent_reply(&self, sent: Result<(), rc_ddsc::Error>) -> Result<(), ReceiveError> {
        sent.map_err(|error| self.failed(format!("a reply cannot be sent: {error}")))
    }

    fn failed(&self, reason: String) -> ReceiveError {
        ReceiveError {
            address: self.address.clone(),
            reason,
        }
    }

    fn refuse(
        &mut self,
        id: rpc::RequestId,
        outcome: Outcome,
        reason: &str,
    ) -> Result<(), ReceiveError> {
        let mut writer = Writer::default();
        rpc::refuse(&mut writer, id, outcome, reason);
        self.send_reply(&writer.into_bytes())
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
            self.refuse(id, Outcome::OutOfResources, rc_network::NO_ROOM)?;
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
        let body = body(&sample).map_err(|reason| self.failed(reason))?;
        let client = self.requests.shared.participant(sample.writer());
        if let (Some(client), Some(id)) = (client, rpc::request_id(body))
            && prefix(&id.writer) != client
        {
            // The reply would pass for the reply to a request of that client.
            return Err(self.failed("a request names another client than its sender".to_owned()));
        }
        let Some(sender) = self.requests.shared.sender(sample.writer()) else {
            if let Some(id) = rpc::request_id(body) {
                let reason = "the types differ; regenerate and rebuild both ends";
                self.refuse(id, Outcome::InvalidArgument, reason)?;
            }
            return Ok(true);
        };
        let buffer = std::mem::take(&mut self.reply);
        let mut reply = ReplyMemory::new(&self.replies.writer, Profile::Rpc, buffer);
        // The client tells the hash of the whole interface, which is equal. The runtime compares
        // hashes of operations.
        handler(sample_header(&sample, sender.id, 0), body, &mut reply);
        let (mut reply, loan) = reply.finish();
        if let Some(loan) = loan {
            self.reply = reply;
            let sent = client.map_or(Ok(()), |_| self.send_lent(loan));
            return sent.map(|()| true);
        }
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
            // It was no request, or its client has gone.
            Ok(())
        } else {
            self.send_reply(&reply)
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
