//! The client: a writer of requests and a reader of replies.

use crate::inbox::Replies;
use crate::names;
use rc_ddsc::BEFORE_BODY;
use rc_middleware::rpc;
use rc_middleware::{
    CallError, Client, Endpoint, Header, OpenError, QueueGauge, RequestBody, Spin,
};
use rc_network::{
    CallState, Caller, ClientPorts, EndpointSpec, GuidPrefix, Opening, Role, Session, body,
    sample_header, signal, stamp,
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
    // The reader comes first: a server that has found the writer soon finds the reader, too.
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
}

impl DdsClient {
    /// Sends a request; gives its server. Each request gets a reply, a command an empty one.
    /// `is_awaited`: whether a call waits for the reply.
    fn submit(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        is_awaited: bool,
    ) -> Result<GuidPrefix, CallError> {
        let (caller, queue) = (&self.caller, &self.inbox.queue);
        let server = self.ports.server(queue.server());
        let server = server.ok_or_else(|| CallError::NoServer(caller.address.clone()))?;
        caller.make_room(queue, server, self.ports.is_external(server))?;
        let id = rpc::request_id(request.begin());
        let id = id.ok_or_else(|| caller.failed(&"a request has no envelope"))?;
        let writer = &self.ports.requests.writer;
        let loan = writer.loan(request.length());
        let mut loan = loan.map_err(|error| caller.failed(&error))?;
        request.write_into(&mut loan.memory()[BEFORE_BODY..])?;
        queue.begin(id.sequence, is_awaited);
        let sent = writer.send(loan, (header.sequence, stamp(header.sent)), 0, None);
        sent.map_err(|error| {
            queue.cancel(id.sequence);
            caller.not_sent(&error)
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
        if self.caller.wake_event.is_stopping() {
            return Err(CallError::Stopping);
        }
        let server = self.submit(header, request, true)?;
        let result = self.caller.await_reply((start, limit), || CallState {
            has_server: self.ports.has(server),
            reply: self.take_reply(take),
        });
        self.inbox.queue.finish();
        result
    }

    fn peers(&self) -> usize {
        usize::from(!self.ports.servers().is_empty())
    }

    fn queue(&self) -> Option<QueueGauge> {
        Some(self.inbox.queue.gauge().clone())
    }
}
