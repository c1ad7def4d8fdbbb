//! Messages of any bytes, for tests without envelopes: this backend adds the envelopes of calls.

use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::rpc::{self, ReplyKind, RequestId};
use rc_middleware::{
    Backend, CallError, Client, Endpoint, Header, OpenError, Publisher, Reader, ReceiveError,
    Reply, Server, Subscriber, Writer,
};
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
        }))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Ok(Box::new(EnvelopedServer {
            port: self.0.server(endpoint)?,
        }))
    }

    fn linger(&self, limit: Duration) {
        self.0.linger(limit);
    }
}

struct Asking {
    port: Box<dyn Client>,
    sequence: u64,
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
                let mut reader = Reader::new(reply);
                let (id, kind) = rpc::open_reply(&mut reader, OPERATION).expect("an envelope");
                assert_eq!(id.sequence, sequence, "a reply to another request");
                assert_eq!(kind, ReplyKind::Case(0));
                rpc::open_body(&mut reader, profile);
                take(header, reader.rest());
            })
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
