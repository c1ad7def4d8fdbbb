//! The client: a writer of requests and a reader of replies.

use crate::inbox::Replies;
use crate::names;
use rc_ddsc::BEFORE_BODY;
use rc_middleware::rpc;
use rc_middleware::started::{Awaiting, StartedCalls};
use rc_middleware::{
    CallError, Client, Endpoint, Header, OpenError, QueueGauge, RequestBody, Spin,
};
use rc_network::{
    CallState, Caller, ClientPorts, EndpointSpec, GuidPrefix, Opening, ROOM, Role, Session, body,
    reply_sent, sample_header, signal, stamp,
};
use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};

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
    // The reader comes first: a server that has found the writer will soon also find the reader.
    let replies = opening.reader(spec(reply), Arc::clone(&inbox) as _)?;
    let requests = opening.writer(spec(request), Arc::new(()))?;
    inbox.set_client(requests.guid);
    opening.meet(&[replies.state(), requests.state()]);
    let client = DdsClient {
        caller: Caller {
            address,
            signal,
            wake_event: session.environment.wake_event.clone(),
            spin: Cell::new(Spin::new(endpoint.qos.spin)),
        },
        ports: ClientPorts { requests, replies },
        inbox,
        started: StartedCalls::default(),
    };
    let found = || client.peers() > 0;
    let state = client.ports.requests.state();
    session.wait_for_remote(state, found);
    Ok(client)
}

pub(crate) struct DdsClient {
    caller: Caller,
    ports: ClientPorts,
    inbox: Arc<Replies>,
    started: StartedCalls<SentRequest>,
}

/// A request that was sent: its number, its server, and when it was sent, also as a time stamp.
#[derive(Clone, Copy)]
struct SentRequest {
    request: u64,
    server: GuidPrefix,
    sent: (u64, i64),
}

impl DdsClient {
    /// Sends a request after it has waited for room, at most `room`. Each request gets a reply, a
    /// command an empty one. `is_awaited`: whether a call waits for the reply.
    fn submit(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        is_awaited: bool,
        room: Duration,
    ) -> Result<SentRequest, CallError> {
        let (caller, queue) = (&self.caller, &self.inbox.queue);
        let server = self.ports.server(queue.server());
        let server = server.ok_or_else(|| CallError::NoServer(caller.address.clone()))?;
        caller.make_room(queue, server, self.ports.is_external(server), room)?;
        let id = rpc::request_id(request.begin());
        let id = id.ok_or_else(|| caller.failed(&"a request has no envelope"))?;
        let writer = &self.ports.requests.writer;
        let loan = writer.loan(request.length());
        let mut loan = loan.map_err(|error| caller.failed(&error))?;
        request.write_into(&mut loan.memory()[BEFORE_BODY..])?;
        queue.begin(id.sequence, is_awaited);
        let at = stamp(header.sent);
        let sent = writer.send(loan, (header.sequence, at), 0, None);
        sent.map_err(|error| {
            queue.cancel(id.sequence);
            caller.not_sent(&error)
        })?;
        Ok(SentRequest {
            request: id.sequence,
            server,
            sent: (header.sent, at),
        })
    }

    /// The state of a call. If its reply has arrived, `take` gets it.
    fn state(&self, asked: SentRequest, take: &mut dyn FnMut(Header, &[u8])) -> CallState {
        CallState {
            has_server: self.ports.has(asked.server),
            reply: self.take_reply(asked, take),
        }
    }

    /// Passes the reply to a request to `take`, if it has arrived.
    fn take_reply(
        &self,
        asked: SentRequest,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Option<Result<(), CallError>> {
        let reply = self.inbox.queue.take(asked.request)?;
        let taken = reply.and_then(|sample| {
            let header = Header {
                sent: reply_sent(asked.sent, sample.stamp()),
                ..sample_header(&sample, sample.writer().into(), 0)
            };
            take(header, body(&sample)?);
            Ok(())
        });
        Some(taken.map_err(|reason| self.caller.failed(&reason)))
    }
}

impl Client for DdsClient {
    /// The identity of its writer, as DDS-RPC defines it.
    fn guid(&self) -> [u8; 16] {
        self.ports.requests.guid
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
        let state = || self.state(asked, take);
        let result = self.caller.await_reply((start, limit), state);
        self.inbox.queue.finish(asked.request);
        result
    }

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
        self.caller.signal.clear();
        let mut started = std::mem::take(&mut self.started);
        let is_stopping = self.caller.wake_event.is_stopping();
        let ended = started.next(&self.caller.address, is_stopping, |sequence, asked| {
            self.caller
                .look(self.state(*asked, &mut |header, body| take(sequence, header, body)))
        });
        self.started = started;
        let (sequence, asked, result) = ended?;
        self.inbox.queue.finish(asked.request);
        Some((sequence, result))
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.started.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        if let Some(asked) = self.started.forget(sequence) {
            self.inbox.queue.finish(asked.request);
        }
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.caller.awaiting(&self.started)
    }

    fn peers(&self) -> usize {
        usize::from(!self.ports.servers().is_empty())
    }

    /// A program outside stamps its replies with its own clock.
    fn replies_have_ages(&self) -> bool {
        let server = self.ports.server(self.inbox.queue.server());
        server.is_some_and(|server| !self.ports.is_external(server))
    }

    fn server(&self) -> u128 {
        self.ports.server_number()
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.inbox.queue.gauge().clone())
    }
}
