//! The ports of a component that is recorded: they pass everything on and note it.

use super::entry::{Entry, Kind, number};
use super::error_codes;
use super::recorder::Recorder;
use rc_middleware::freshness::{Freshness, Made};
use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::started::Awaiting;
use rc_middleware::{
    CallError, Client, Encoding, Header, KeptSample, Profile, Publisher, QueueGauge, ReceiveError,
    Reply, SendError, Server, Subscriber,
};
use std::borrow::Cow;
use std::os::fd::BorrowedFd;
use std::rc::Rc;
use std::time::Duration;

/// A publisher. It lends no memory, because sent values have to be copied for the recording.
pub(super) struct Publishing {
    recorder: Rc<Recorder>,
    slot: usize,
    operation: usize,
    port: Box<dyn Publisher>,
}

impl Publishing {
    pub(super) fn new(
        recorder: &Rc<Recorder>,
        slot: usize,
        operation: usize,
        port: Box<dyn Publisher>,
    ) -> Self {
        Self {
            recorder: Rc::clone(recorder),
            slot,
            operation,
            port,
        }
    }
}

impl Publisher for Publishing {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let (slot, operation) = (self.slot, self.operation);
        let sent = Entry::message(Kind::Publish, slot, operation, header, body);
        self.recorder.push(&sent);
        self.port.publish(header, body).map_err(|error| {
            let (entry, error) = error_codes::of_sending(slot, &error);
            self.recorder.push(&entry);
            error
        })
    }

    fn senders(&self) -> Vec<u128> {
        self.port.senders()
    }

    fn peers(&self) -> usize {
        peers(&self.recorder, self.slot, self.operation, self.port.peers())
    }
}

/// Notes a number of peers.
fn peers(recorder: &Recorder, slot: usize, operation: usize, peers: usize) -> usize {
    recorder.push(&Entry {
        value: peers as u64,
        ..Entry::at(Kind::Peers, slot, operation)
    });
    peers
}

/// Entry for the freshness of a client's last reply.
fn fresh_entry(slot: usize, found: Option<Freshness>) -> Entry<'static> {
    let state = found.map_or(0, |found| 1 + usize::from(found.is_fresh));
    Entry {
        value: found.map_or(0, |found| found.age.as_nanos() as u64),
        type_hash: found.map_or(0, |found| match found.made {
            Made::Computed => 0,
            Made::PartlyCached => 1,
            Made::Cached => 2,
        }),
        ..Entry::at(Kind::Fresh, slot, state)
    }
}

/// Freshness in an entry of [`fresh_entry`].
pub(super) fn freshness_of(entry: &Entry<'_>) -> Option<Freshness> {
    (entry.operation > 0).then(|| Freshness {
        age: Duration::from_nanos(entry.value),
        made: match entry.type_hash {
            0 => Made::Computed,
            1 => Made::PartlyCached,
            _ => Made::Cached,
        },
        is_fresh: entry.operation > 1,
    })
}

/// A client.
pub(super) struct Calling {
    recorder: Rc<Recorder>,
    slot: usize,
    port: Box<dyn Client>,
}

impl Calling {
    pub(super) fn new(recorder: &Rc<Recorder>, slot: usize, port: Box<dyn Client>) -> Self {
        recorder.push(&Entry {
            value: profile_number(port.profile()),
            data: Cow::Borrowed(&port.guid()),
            ..Entry::at(Kind::Opened, slot, 0)
        });
        Self {
            recorder: Rc::clone(recorder),
            slot,
            port,
        }
    }

    fn failed(&self, kind: Kind, error: &CallError) -> CallError {
        let (entry, error) = error_codes::of_call(kind, self.slot, error);
        self.recorder.push(&entry);
        error
    }
}

/// The number of a profile in the file.
pub(super) fn profile_number(profile: Profile) -> u64 {
    match profile {
        Profile::Rpc => 0,
        Profile::Bare => 1,
    }
}

/// The profile of a number.
pub(super) fn profile_of(number: u64) -> Profile {
    match number {
        0 => Profile::Rpc,
        _ => Profile::Bare,
    }
}

impl Client for Calling {
    fn guid(&self) -> [u8; 16] {
        self.port.guid()
    }

    fn profile(&self) -> Profile {
        self.port.profile()
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        let request = buffer(request)?;
        let sent = Entry::message(Kind::Send, self.slot, 0, header, &request);
        self.recorder.push(&sent);
        let result = self.port.send(header, &request);
        result.map_err(|error| self.failed(Kind::Failed, &error))
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        let request = buffer(request)?;
        let sent = Entry::message(Kind::Call, self.slot, 0, header, &request);
        self.recorder.push(&Entry {
            value: limit.as_nanos() as u64,
            ..sent
        });
        let (recorder, slot) = (&self.recorder, self.slot);
        let result = self
            .port
            .call(header, &request, limit, &mut |header, body| {
                let encoding = number(header.encoding) as usize;
                let answer = Entry::message(Kind::Answer, slot, encoding, header, body);
                recorder.push(&answer);
                take(header, body);
            });
        result.map_err(|error| self.failed(Kind::Answer, &error))
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        let request = buffer(request)?;
        let sent = Entry::message(Kind::Started, self.slot, 0, header, &request);
        self.recorder.push(&Entry {
            value: limit.as_nanos() as u64,
            ..sent
        });
        let result = self.port.start(header, &request, limit);
        result.map_err(|error| self.failed(Kind::Failed, &error))
    }

    /// The end of a call begins a turn, which [`super::component::Recorded`] ends.
    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        let (recorder, slot) = (&self.recorder, self.slot);
        let begin = |sequence: u64| {
            recorder.begin_turn(&Entry {
                value: sequence,
                ..Entry::at(Kind::Ended, slot, 0)
            });
        };
        let (sequence, result) = self.port.poll(&mut |sequence, header, body| {
            begin(sequence);
            let encoding = number(header.encoding) as usize;
            let answer = Entry::message(Kind::Answer, slot, encoding, header, body);
            recorder.push(&answer);
            take(sequence, header, body);
        })?;
        if result.is_err() {
            begin(sequence);
        }
        let result = result.map_err(|error| self.failed(Kind::Answer, &error));
        Some((sequence, result))
    }

    fn end_in_order(&mut self, keeps: bool) {
        self.port.end_in_order(keeps);
    }

    fn forget(&mut self, sequence: u64) {
        self.port.forget(sequence);
    }

    fn awaiting(&self) -> Option<Awaiting<'_>> {
        self.port.awaiting()
    }

    fn senders(&self) -> Vec<u128> {
        self.port.senders()
    }

    fn number_there(&self, request: &dyn RequestBody) -> Option<u64> {
        self.port.number_there(request)
    }

    fn peers(&self) -> usize {
        peers(&self.recorder, self.slot, 0, self.port.peers())
    }

    fn freshness(&self) -> Option<Freshness> {
        let found = self.port.freshness();
        self.recorder.push(&fresh_entry(self.slot, found));
        found
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}

/// A subscriber: each sample is a turn.
pub(super) struct Subscribing {
    recorder: Rc<Recorder>,
    slot: usize,
    operation: usize,
    port: Box<dyn Subscriber>,
}

impl Subscribing {
    pub(super) fn new(
        recorder: &Rc<Recorder>,
        slot: usize,
        operation: usize,
        port: Box<dyn Subscriber>,
    ) -> Self {
        Self {
            recorder: Rc::clone(recorder),
            slot,
            operation,
            port,
        }
    }
}

impl Subscriber for Subscribing {
    fn descriptor(&self) -> BorrowedFd<'_> {
        self.port.descriptor()
    }

    fn acknowledge(&mut self, woken: bool) {
        self.port.acknowledge(woken);
    }

    fn receive(&mut self, take: &mut dyn FnMut(Header, &[u8])) -> Result<bool, ReceiveError> {
        let (recorder, slot, operation) = (&self.recorder, self.slot, self.operation);
        self.port.receive(&mut |header, body| {
            recorder.sample(slot, operation, header, body, || take(header, body));
        })
    }

    fn can_keep(&self) -> bool {
        self.port.can_keep()
    }

    fn receive_kept(
        &mut self,
        take: &mut dyn FnMut(Header, Box<dyn KeptSample>),
    ) -> Result<bool, ReceiveError> {
        let (recorder, slot, operation) = (&self.recorder, self.slot, self.operation);
        self.port.receive_kept(&mut |header, sample| {
            let entry = Entry::message(Kind::Sample, slot, operation, header, sample.memory());
            recorder.begin_turn(&entry);
            take(header, sample);
            recorder.end_turn();
        })
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}

/// A server: each request is a turn.
pub(super) struct Serving {
    recorder: Rc<Recorder>,
    slot: usize,
    port: Box<dyn Server>,
}

impl Serving {
    pub(super) fn new(recorder: &Rc<Recorder>, slot: usize, port: Box<dyn Server>) -> Self {
        Self {
            recorder: Rc::clone(recorder),
            slot,
            port,
        }
    }
}

impl Server for Serving {
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
        let (recorder, slot) = (&self.recorder, self.slot);
        self.port.serve(&mut |header, body, reply| {
            recorder.request(slot, header, body, reply, |reply| {
                handler(header, body, reply);
            });
        })
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}

impl Recorder {
    /// Lets `handle` handle a sample, in a turn of its own.
    pub(crate) fn sample<R>(
        &self,
        slot: usize,
        operation: usize,
        header: Header,
        body: &[u8],
        handle: impl FnOnce() -> R,
    ) -> R {
        self.begin_turn(&Entry::message(Kind::Sample, slot, operation, header, body));
        let result = handle();
        self.end_turn();
        result
    }

    /// Lets `answer` reply to a request, in a turn of its own.
    pub(crate) fn request<R>(
        &self,
        slot: usize,
        header: Header,
        body: &[u8],
        reply: &mut dyn Reply,
        answer: impl FnOnce(&mut dyn Reply) -> R,
    ) -> R {
        let profile = profile_number(reply.profile()) as usize;
        self.begin_turn(&Entry::message(Kind::Request, slot, profile, header, body));
        let mut replying = Replying(reply);
        let result = answer(&mut replying);
        self.push(&Entry {
            data: Cow::Borrowed(replying.body()),
            ..Entry::at(Kind::Reply, slot, 0)
        });
        self.end_turn();
        result
    }
}

/// A reply. It lends no memory, as for a publisher.
struct Replying<'a>(&'a mut dyn Reply);

impl Reply for Replying<'_> {
    fn body(&mut self) -> &mut Vec<u8> {
        self.0.body()
    }

    fn set_age(&mut self, age: Duration) {
        self.0.set_age(age);
    }

    fn profile(&self) -> Profile {
        self.0.profile()
    }

    fn can_loan(&self, _encoding: Encoding) -> bool {
        false
    }
}
