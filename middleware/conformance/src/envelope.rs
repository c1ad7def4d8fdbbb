//! Messages of any bytes, for tests without envelopes: this backend adds the envelopes of calls.
//! Where the backend under test pads bodies, a length precedes each body.

use rc_middleware::rpc::{self, ReplyKind, RequestId};
use rc_middleware::{
    Backend, CallError, Client, Endpoint, Header, OpenError, Publisher, Reader, ReceiveError,
    Reply, SendError, Server, Subscriber, Writer,
};
use std::os::fd::BorrowedFd;
use std::time::Duration;

/// The operation of every call.
const OPERATION: i32 = 5;

/// A backend whose messages carry any bytes.
pub(crate) struct Enveloping {
    pub(crate) backend: Box<dyn Backend>,
    /// Whether a length precedes each body.
    pub(crate) pads: bool,
}

/// `body` with its length before it, where lengths are used.
fn sized(pads: bool, body: &[u8]) -> Vec<u8> {
    let length = u32::try_from(body.len()).expect("a length").to_le_bytes();
    let length = length.iter().filter(|_| pads);
    length.chain(body).copied().collect()
}

/// Removes the length.
fn unsized_body(pads: bool, body: &[u8]) -> &[u8] {
    if !pads {
        return body;
    }
    let (length, body) = body.split_first_chunk().expect("a length");
    let length = u32::from_le_bytes(*length) as usize;
    assert!(
        length <= body.len() && body.len() - length < 4,
        "too much padding"
    );
    &body[..length]
}

struct Sizing<P: ?Sized>(Box<P>);

impl Publisher for Sizing<dyn Publisher> {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        self.0.publish(header, &sized(true, body))
    }

    fn peers(&self) -> usize {
        self.0.peers()
    }
}

impl Subscriber for Sizing<dyn Subscriber> {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.0.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.0.acknowledge(woken);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        self.0
            .receive(&mut |header, body| take(header, unsized_body(true, body)))
    }

    fn peers(&self) -> usize {
        self.0.peers()
    }
}

impl Backend for Enveloping {
    fn name(&self) -> &'static str {
        self.backend.name()
    }

    fn publisher(&self, endpoint: &Endpoint) -> Result<Box<dyn Publisher>, OpenError> {
        let port = self.backend.publisher(endpoint)?;
        Ok(if self.pads {
            Box::new(Sizing(port))
        } else {
            port
        })
    }

    fn subscriber(&self, endpoint: &Endpoint) -> Result<Box<dyn Subscriber>, OpenError> {
        let port = self.backend.subscriber(endpoint)?;
        Ok(if self.pads {
            Box::new(Sizing(port))
        } else {
            port
        })
    }

    fn client(&self, endpoint: &Endpoint) -> Result<Box<dyn Client>, OpenError> {
        Ok(Box::new(Asking {
            port: self.backend.client(endpoint)?,
            sequence: 0,
            pads: self.pads,
        }))
    }

    fn server(&self, endpoint: &Endpoint) -> Result<Box<dyn Server>, OpenError> {
        Ok(Box::new(EnvelopedServer {
            port: self.backend.server(endpoint)?,
            pads: self.pads,
        }))
    }

    fn linger(&self, limit: Duration) {
        self.backend.linger(limit);
    }
}

struct Asking {
    port: Box<dyn Client>,
    sequence: u64,
    pads: bool,
}

impl Asking {
    fn envelope(&mut self, request: &[u8]) -> Vec<u8> {
        self.sequence += 1;
        let id = RequestId {
            writer: self.port.guid(),
            sequence: self.sequence,
        };
        let mut writer = Writer::default();
        rpc::begin_request(&mut writer, id, OPERATION);
        rpc::begin_body(&mut writer, self.port.profile());
        writer.raw(&sized(self.pads, request));
        writer.into_bytes()
    }
}

impl Client for Asking {
    fn guid(&self) -> [u8; 16] {
        self.port.guid()
    }

    fn send(&mut self, header: Header, request: &[u8]) -> Result<(), CallError> {
        let request = self.envelope(request);
        self.port.send(header, &request)
    }

    fn call(
        &mut self,
        header: Header,
        request: &[u8],
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let request = self.envelope(request);
        let (sequence, profile, pads) = (self.sequence, self.port.profile(), self.pads);
        self.port
            .call(header, &request, limit, &mut |header, reply| {
                let mut reader = Reader::new(reply);
                let (id, kind) = rpc::open_reply(&mut reader, OPERATION).expect("an envelope");
                assert_eq!(id.sequence, sequence, "a reply to another request");
                assert_eq!(kind, ReplyKind::Case(0));
                rpc::open_body(&mut reader, profile);
                take(header, unsized_body(pads, reader.rest()));
            })
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }
}

struct EnvelopedServer {
    port: Box<dyn Server>,
    pads: bool,
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
        let pads = self.pads;
        self.port.serve(&mut |header, request, reply| {
            let mut reader = Reader::new(request);
            let (id, operation) = rpc::open_request(&mut reader).expect("an envelope");
            let profile = reply.profile();
            rpc::open_body(&mut reader, profile);
            let mut bytes = Vec::new();
            handler(header, unsized_body(pads, reader.rest()), &mut bytes);
            if !bytes.is_empty() {
                let mut writer = Writer::over(std::mem::take(reply.body()));
                rpc::begin_reply(&mut writer, id, operation, 0);
                rpc::begin_body(&mut writer, profile);
                writer.raw(&sized(pads, &bytes));
                *reply.body() = writer.into_bytes();
            }
        })
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }
}
