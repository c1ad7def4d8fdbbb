//! Default values in place of a server that is not there, for whole components under test.

use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::started::{Awaiting, STARTED_CALLS};
use rc_middleware::typed::{HandlerError, Request};
use rc_middleware::{CallError, Client, Header, Profile, QueueGauge, Reply};
use std::collections::VecDeque;
use std::time::Duration;

/// Replies to a request of one slot with default values.
pub type DefaultReply = fn(&mut Request<'_>) -> Result<(), HandlerError>;

/// A client that gets default values where no server takes its call.
pub(crate) struct DefaultingClient {
    pub(crate) port: Box<dyn Client>,
    pub(crate) reply: DefaultReply,
    /// Started calls that got default values, and end at the next polls.
    pub(crate) ended: VecDeque<(Header, Vec<u8>)>,
}

/// A reply that stays in this process.
struct Kept {
    body: Vec<u8>,
    profile: Profile,
}

impl Reply for Kept {
    fn body(&mut self) -> &mut Vec<u8> {
        &mut self.body
    }

    fn profile(&self) -> Profile {
        self.profile
    }
}

impl DefaultingClient {
    /// The reply to a request; empty for a command.
    fn default_of(&self, header: Header, request: &dyn RequestBody) -> Result<Vec<u8>, CallError> {
        let request = buffer(request)?;
        let mut reply = Kept {
            body: Vec::new(),
            profile: self.port.profile(),
        };
        let mut opened = Request::open(header, &request, &mut reply)?;
        // The error is in the reply.
        let _ = (self.reply)(&mut opened);
        opened.close();
        Ok(reply.body)
    }
}

impl Client for DefaultingClient {
    fn guid(&self) -> [u8; 16] {
        self.port.guid()
    }

    fn profile(&self) -> Profile {
        self.port.profile()
    }

    fn can_loan(&self) -> bool {
        self.port.can_loan()
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        match self.port.send(header, request) {
            Err(CallError::NoServer(_)) => self.default_of(header, request).map(drop),
            sent => sent,
        }
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        match self.port.call(header, request, limit, take) {
            Err(CallError::NoServer(_)) => {
                let reply = self.default_of(header, request)?;
                take(header, &reply);
                Ok(())
            }
            called => called,
        }
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        match self.port.start(header, request, limit) {
            Err(CallError::NoServer(_)) if self.ended.len() < STARTED_CALLS => {
                let reply = self.default_of(header, request)?;
                self.ended.push_back((header, reply));
                Ok(())
            }
            Err(CallError::NoServer(_)) => Err(CallError::TooManyStarted),
            started => started,
        }
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        let Some((header, reply)) = self.ended.pop_front() else {
            return self.port.poll(take);
        };
        take(header.sequence, header, &reply);
        Some((header.sequence, Ok(())))
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.port.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        self.ended.retain(|(header, _)| header.sequence != sequence);
        self.port.forget(sequence);
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.port.awaiting()
    }

    fn replies_have_ages(&self) -> bool {
        self.port.replies_have_ages()
    }

    fn senders(&self) -> Vec<u128> {
        self.port.senders()
    }

    fn number_there(&self, request: &dyn RequestBody) -> Option<u64> {
        self.port.number_there(request)
    }

    /// At least one: the calls of the worker get replies.
    fn peers(&self) -> usize {
        self.port.peers().max(1)
    }

    fn server(&self) -> u128 {
        self.port.server()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_middleware::Writer;
    use rc_middleware::rpc::{self, RequestId};

    /// A client with or without a server, which replies with one byte.
    struct Port(bool);

    impl Client for Port {
        fn guid(&self) -> [u8; 16] {
            [1; 16]
        }

        fn profile(&self) -> Profile {
            Profile::Bare
        }

        fn send(&mut self, _: Header, _: &dyn RequestBody) -> Result<(), CallError> {
            self.0
                .then_some(())
                .ok_or_else(|| CallError::QueueFull(String::new()))
        }

        fn call(
            &mut self,
            header: Header,
            _: &dyn RequestBody,
            _: Duration,
            take: &mut dyn FnMut(Header, &[u8]),
        ) -> Result<(), CallError> {
            if !self.0 {
                return Err(CallError::NoServer(String::new()));
            }
            take(header, &[7]);
            Ok(())
        }

        fn start(&mut self, _: Header, _: &dyn RequestBody, _: Duration) -> Result<(), CallError> {
            Err(CallError::NoServer(String::new()))
        }

        fn poll(
            &mut self,
            _: &mut dyn FnMut(u64, Header, &[u8]),
        ) -> Option<(u64, Result<(), CallError>)> {
            None
        }

        fn forget(&mut self, _: u64) {}

        fn peers(&self) -> usize {
            0
        }
    }

    fn client(has_server: bool) -> DefaultingClient {
        DefaultingClient {
            port: Box::new(Port(has_server)),
            reply: |request| request.reply_with(0, |writer| writer.put(&9_i32)),
            ended: VecDeque::new(),
        }
    }

    fn request() -> Vec<u8> {
        let id = RequestId {
            writer: [1; 16],
            sequence: 1,
        };
        let mut writer = Writer::over(Vec::new());
        rpc::begin_request(&mut writer, id, 3);
        rpc::begin_body(&mut writer, Profile::Bare);
        writer.into_bytes()
    }

    fn call(has_server: bool) -> Vec<u8> {
        let (mut client, request) = (client(has_server), request());
        let mut reply = Vec::new();
        let mut take = |_: Header, body: &[u8]| body.clone_into(&mut reply);
        let limit = Duration::from_secs(1);
        let called = client.call(Header::default(), &request, limit, &mut take);
        assert_eq!(called, Ok(()));
        assert_eq!(client.peers(), 1);
        reply
    }

    #[test]
    fn a_server_comes_before_default_values() {
        assert_eq!(call(true), [7]);
        let reply = call(false);
        // The body is where the client of a middleware without envelopes looks for it.
        assert_eq!(reply.len(), rpc::ENVELOPE + 4);
        assert_eq!(reply[rpc::ENVELOPE..], 9_i32.to_le_bytes());
    }

    #[test]
    fn started_calls_get_default_values_and_end_once() {
        let (mut client, request) = (client(false), request());
        let start = |client: &mut DefaultingClient, sequence| {
            let header = Header {
                sequence,
                ..Header::default()
            };
            client.start(header, &request, Duration::from_secs(1))
        };
        for sequence in 0..STARTED_CALLS as u64 {
            assert_eq!(start(&mut client, sequence), Ok(()));
        }
        let full = start(&mut client, 99);
        assert_eq!(full, Err(CallError::TooManyStarted));
        client.forget(1);
        let mut ended = Vec::new();
        let mut take = |sequence, _: Header, body: &[u8]| ended.push((sequence, body.len()));
        while let Some((_, result)) = client.poll(&mut take) {
            assert_eq!(result, Ok(()));
        }
        let all = (0..STARTED_CALLS as u64).filter(|sequence| *sequence != 1);
        let expected = all.map(|sequence| (sequence, rpc::ENVELOPE + 4));
        assert_eq!(ended, expected.collect::<Vec<_>>());
    }

    #[test]
    fn other_errors_stay() {
        let mut client = DefaultingClient {
            port: Box::new(Port(false)),
            reply: |_| Ok(()),
            ended: VecDeque::new(),
        };
        let sent = client.send(Header::default(), &Vec::new());
        assert!(matches!(sent, Err(CallError::QueueFull(_))), "{sent:?}");
    }
}
