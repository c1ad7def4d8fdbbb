//! The answering end of a connection: a reader of requests and a writer of replies.

use crate::client::topics;
use crate::endpoint_state::Peer;
use crate::inbox;
use crate::publisher::signal;
use crate::qos::call_qos;
use crate::session::{EndpointSpec, Port, Session};
use rc_ddsc::Sample;
use rc_middleware::rpc::{self, Outcome};
use rc_middleware::{Endpoint, Header, OpenError, Reader, ReceiveError, Reply, Server, Writer};
use rc_network::{QueuedRequest, RequestQueues, Role, stamp};
use std::os::fd::{AsFd, BorrowedFd};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// How long a request waits until its client can be answered. A client whose reader was not found by then has none.
const HOLD: Duration = Duration::from_millis(200);

pub(crate) fn open(session: &Rc<Session>, endpoint: &Endpoint) -> Result<DdsServer, OpenError> {
    let address = endpoint.address.to_string();
    let signal = signal(&address)?;
    let waiting = Arc::new(RequestQueues::<u64, Sample>::default());
    let [request, reply] = topics(endpoint);
    let spec = |(topic, type_name): (String, String), sends: bool| EndpointSpec {
        address: &address,
        topic,
        type_name,
        role: Role::Server,
        types: &endpoint.types,
        sends,
        qos: call_qos(),
        signal: signal.clone(),
        inbox: Arc::clone(&waiting) as _,
    };
    let [replies, requests] = session.ports([spec(reply, true), spec(request, false)])?;
    Ok(DdsServer {
        address: address.clone(),
        requests,
        replies,
        waiting,
        reply: Vec::new(),
        sent: 0,
    })
}

pub(crate) struct DdsServer {
    address: String,
    requests: Port,
    replies: Port,
    waiting: Arc<RequestQueues<u64, Sample>>,
    reply: Vec<u8>,
    /// How many replies there were.
    sent: u64,
}

impl DdsServer {
    /// Whether what is answered now reaches the client: its reader has been found, or it has gone and hears nothing.
    fn may_serve(&self, waiting: &QueuedRequest<Sample>) -> bool {
        let Some(member) = self.requests.state.member(waiting.sample.writer()) else {
            return true;
        };
        let reachable = |peer: &Peer| peer.member == member;
        self.replies.state.has(reachable)
            || !self.requests.state.has(reachable)
            || waiting.since.elapsed() >= HOLD
    }

    fn answer(&mut self, reply: &[u8]) -> Result<(), ReceiveError> {
        self.sent += 1;
        let entity = &self.replies.entity;
        entity
            .write(self.sent, stamp(0), reply)
            .map_err(|error| self.failed(format!("an answer cannot be sent: {error}")))
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
        self.answer(&writer.into_bytes())
    }
}

impl Server for DdsServer {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.requests.state.signal.as_fd()
    }

    fn acknowledge(&mut self, _woken: bool) {
        self.requests.state.signal.clear();
    }

    fn serve(
        &mut self,
        answer: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        if let Some(id) = self.waiting.refused() {
            let reason = "too many requests of this client wait already";
            self.refuse(id, Outcome::OutOfResources, reason)?;
            return Ok(true);
        }
        let Some(QueuedRequest { sample, .. }) =
            self.waiting.next(|waiting| self.may_serve(waiting))
        else {
            return Ok(false);
        };
        let body = inbox::body(&sample).map_err(|reason| self.failed(reason))?;
        let Some(sender) = self.requests.state.sender(sample.writer()) else {
            if let Some(id) = rpc::request_id(body) {
                let reason = "the types differ; regenerate and rebuild both ends";
                self.refuse(id, Outcome::InvalidArgument, reason)?;
            }
            return Ok(true);
        };
        let mut reply = std::mem::take(&mut self.reply);
        reply.clear();
        // The hash that the client tells is of the whole interface, not of one operation, and is the same.
        answer(inbox::header(&sample, sender.id, 0), body, &mut reply);
        if reply.is_empty() {
            // A command; DDS-RPC answers it like an operation without a result, and the client counts by that.
            if let Ok((id, operation)) = rpc::open_request(&mut Reader::new(body)) {
                let mut writer = Writer::over(reply);
                rpc::begin_reply(&mut writer, id, operation, 0);
                writer.put(&0_u8);
                reply = writer.into_bytes();
            }
        }
        let answered = if reply.is_empty() {
            Ok(())
        } else {
            self.answer(&reply)
        };
        self.reply = reply;
        answered.map(|()| true)
    }

    fn peers(&self) -> usize {
        self.requests.state.count()
    }
}
