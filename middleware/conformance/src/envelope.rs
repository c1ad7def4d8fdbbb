//! Messages of any bytes, for tests without envelopes: this backend adds the envelopes of calls.

use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::rpc::{self, ReplyKind, RequestId};
use rc_middleware::started::Awaiting;
use rc_middleware::{
    Backend, CallError, Client, Endpoint, Header, OpenError, Profile, Publisher, Reader,
    ReceiveError, Reply, Server, Subscriber, Writer,
};
use std::collections::BTreeMap;
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// The operation of every call.
const OPERATION: i32 = 5;

/// A backend whose messages carry any bytes.
pub(crate) struct Enveloping(pub(crate) Box<dyn Backend>);

impl Backend for Enveloping {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        self.0.publisher(endpoint)
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        self.0.subscriber(endpoint)
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        Ok(Box::new(Asking {
            port: self.0.client(endpoint)?,
            sequence: 0,
            started: BTreeMap::new(),
        }))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Ok(Box::new(EnvelopedServer {
            port: self.0.server(endpoint)?,
        }))
    }

    fn have_arrived(&self, limit: Duration) -> bool {
        self.0.have_arrived(limit)
    }

    fn linger(&self, limit: Duration) {
        self.0.linger(limit);
    }
}

struct Asking {
    port: Box<dyn Client>,
    sequence: u64,
    /// The numbers in the envelopes of started calls, by those in their headers.
    started: BTreeMap<u64, u64>,
}

/// The number in the envelope of a reply, and its body.
fn opened(reply: &[u8], profile: Profile) -> (u64, &[u8]) {
    let mut reader = Reader::new(reply);
    let (id, kind) = rpc::open_reply(&mut reader, OPERATION).expect("an envelope");
    assert_eq!(kind, ReplyKind::Case(0));
    rpc::open_body(&mut reader, profile);
    (id.sequence, reader.rest())
}

impl Asking {
    fn envelope(&mut self, request: &dyn RequestBody) -> Vec<u8> {
        self.sequence += 1;
        let id = RequestId {
            writer: self.port.guid(),
            sequence: self.sequence,
        };
        let mut writer = Writer::default();
        rpc::begin_request(&mut writer, id, OPERATION);
        rpc::begin_body(&mut writer, self.port.profile());
        writer.raw(&buffer(request).expect("a request"));
        writer.into_bytes()
    }
}

impl Client for Asking {
    fn guid(&self) -> [u8; 16] {
        self.port.guid()
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        let request = self.envelope(request);
        self.port.send(header, &request)
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let request = self.envelope(request);
        let (sequence, profile) = (self.sequence, self.port.profile());
        self.port
            .call(header, &request, limit, &mut |header, reply| {
                let (number, body) = opened(reply, profile);
                assert_eq!(number, sequence, "a reply to another request");
                take(header, body);
            })
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        let request = self.envelope(request);
        self.port.start(header, &request, limit)?;
        self.started.insert(header.sequence, self.sequence);
        Ok(())
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        let profile = self.port.profile();
        let mut replied = None;
        let (sequence, result) = self.port.poll(&mut |sequence, header, reply| {
            let (number, body) = opened(reply, profile);
            assert_eq!(replied.replace(number), None, "two replies to one call");
            take(sequence, header, body);
        })?;
        let asked = self.started.remove(&sequence);
        assert!(
            asked.is_some(),
            "a call that was not started, or ended before"
        );
        let answered = result.is_ok().then_some(asked).flatten();
        assert_eq!(replied, answered, "a reply to another request");
        Some((sequence, result))
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.port.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        self.started.remove(&sequence);
        self.port.forget(sequence);
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.port.awaiting()
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }
}

struct EnvelopedServer {
    port: Box<dyn Server>,
}

impl Server for EnvelopedServer {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.port.acknowledge(woken);
    }

    fn serve(
        &mut self,
        handler: &mut dyn FnMut(Header, &[u8], &mut dyn Reply),
    ) -> Result<bool, ReceiveError> {
        self.port.serve(&mut |header, request, reply| {
            let mut reader = Reader::new(request);
            let (id, operation) = rpc::open_request(&mut reader).expect("an envelope");
            let profile = reply.profile();
            rpc::open_body(&mut reader, profile);
            let mut bytes = Vec::new();
            handler(header, reader.rest(), &mut bytes);
            if !bytes.is_empty() {
                let mut writer = Writer::over(std::mem::take(reply.body()));
                rpc::begin_reply(&mut writer, id, operation, 0);
                rpc::begin_body(&mut writer, profile);
                writer.raw(&bytes);
                *reply.body() = writer.into_bytes();
            }
        })
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }
}
