//! The ports of a component that is repeated: they end in its recording.

use super::entry::{Entry, Kind};
use super::error_codes;
use super::ports::{freshness_of, profile_of};
use super::replay::Replay;
use rc_middleware::freshness::Freshness;
use rc_middleware::request_body::{RequestBody, buffer};
use rc_middleware::{CallError, Client, Header, Profile, Publisher, SendError};
use std::rc::Rc;
use std::time::Duration;

/// A publisher.
pub(crate) struct Publishing {
    replay: Rc<Replay>,
    slot: usize,
    operation: usize,
}

impl Publishing {
    pub(crate) fn new(replay: &Rc<Replay>, slot: usize, operation: usize) -> Self {
        Self {
            replay: Rc::clone(replay),
            slot,
            operation,
        }
    }
}

impl Publisher for Publishing {
    fn publish(&mut self, header: Header, body: &[u8]) -> Result<(), SendError> {
        let (slot, operation) = (self.slot, self.operation);
        let sent = Entry::message(Kind::Publish, slot, operation, header, body);
        self.replay.compare(&sent);
        match self.replay.failure() {
            Some(entry) => Err(error_codes::send_error(&entry)),
            None => Ok(()),
        }
    }

    fn peers(&self) -> usize {
        let entry = self.replay.take(Kind::Peers, self.slot, self.operation);
        entry.value as usize
    }
}

/// A client.
pub(crate) struct Calling {
    replay: Rc<Replay>,
    slot: usize,
    guid: [u8; 16],
    profile: Profile,
}

impl Calling {
    pub(crate) fn new(replay: &Rc<Replay>, slot: usize) -> Self {
        let opened = replay.take(Kind::Opened, slot, 0);
        Self {
            replay: Rc::clone(replay),
            slot,
            guid: opened.data[..].try_into().unwrap_or_default(),
            profile: profile_of(opened.value),
        }
    }
}

impl Client for Calling {
    fn guid(&self) -> [u8; 16] {
        self.guid
    }

    fn profile(&self) -> Profile {
        self.profile
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        let request = buffer(request)?;
        let sent = Entry::message(Kind::Send, self.slot, 0, header, &request);
        self.replay.compare(&sent);
        match self.replay.failure() {
            Some(entry) => Err(error_codes::call_error(&entry)),
            None => Ok(()),
        }
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
        self.replay.compare(&Entry {
            value: limit.as_nanos() as u64,
            ..sent
        });
        let answer = self.replay.take(Kind::Answer, self.slot, 0);
        if error_codes::is_error(&answer) {
            return Err(error_codes::call_error(&answer));
        }
        take(answer.header(u64::from(answer.operation)), &answer.data);
        Ok(())
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        let request = buffer(request)?;
        let sent = Entry::message(Kind::Started, self.slot, 0, header, &request);
        self.replay.compare(&Entry {
            value: limit.as_nanos() as u64,
            ..sent
        });
        match self.replay.failure() {
            Some(entry) => Err(error_codes::call_error(&entry)),
            None => Ok(()),
        }
    }

    /// The call whose end began the present turn.
    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        let sequence = self.replay.ended_call(self.slot)?;
        let answer = self.replay.take(Kind::Answer, self.slot, 0);
        if error_codes::is_error(&answer) {
            return Some((sequence, Err(error_codes::call_error(&answer))));
        }
        let header = answer.header(u64::from(answer.operation));
        take(sequence, header, &answer.data);
        Some((sequence, Ok(())))
    }

    fn freshness(&self) -> Option<Freshness> {
        freshness_of(&self.replay.take(Kind::Fresh, self.slot, 0))
    }

    /// A forgotten call ended in no turn.
    fn forget(&mut self, _: u64) {}

    fn peers(&self) -> usize {
        self.replay.take(Kind::Peers, self.slot, 0).value as usize
    }
}
