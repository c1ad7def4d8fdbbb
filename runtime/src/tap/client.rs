//! Copies of the calls of a client for tools.

use super::Taps;
use crate::hops::HopNotes;
use rc_management::observation::TappedKind;
use rc_middleware::backend::{Client, Profile};
use rc_middleware::freshness::Freshness;
use rc_middleware::started::Awaiting;
use rc_middleware::{CallError, Header, Message, QueueGauge, RequestBody, request_body};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Duration;

/// A client whose calls can be copied and followed.
pub(crate) struct TappedClient {
    pub(crate) port: Box<dyn Client>,
    pub(crate) taps: Arc<Taps>,
    pub(crate) hops: Rc<HopNotes>,
    pub(crate) slot: usize,
}

impl TappedClient {
    fn note_request(&self, header: Header, request: &dyn RequestBody) {
        let number = || self.port.number_there(request);
        self.hops.called(self.slot, &header, request, number);
        // A request that cannot be written fails when it is sent.
        if self.taps.is_on(self.slot)
            && let Ok(body) = request_body::buffer(request)
        {
            let profile = self.port.profile();
            let kind = (TappedKind::Request, None);
            self.taps.copy(self.slot, kind, header, profile, &body);
        }
    }
}

impl Client for TappedClient {
    fn guid(&self) -> [u8; 16] {
        self.port.guid()
    }

    fn profile(&self) -> Profile {
        self.port.profile()
    }

    fn send(&mut self, header: Header, request: &dyn RequestBody) -> Result<(), CallError> {
        self.note_request(header, request);
        self.port.send(header, request)
    }

    fn takes_values(&self) -> bool {
        self.port.takes_values()
    }

    fn can_loan(&self) -> bool {
        self.port.can_loan()
    }

    fn call(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, &[u8]),
    ) -> Result<(), CallError> {
        self.call_message(header, request, limit, &mut |header, message| {
            take(header, message.bytes());
        })
    }

    fn call_message(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
        take: &mut dyn FnMut(Header, Message<'_>),
    ) -> Result<(), CallError> {
        self.note_request(header, request);
        let (profile, taps, slot) = (self.port.profile(), &self.taps, self.slot);
        self.port
            .call_message(header, request, limit, &mut |header, message| {
                taps.copy_reply(slot, header, profile, &message);
                take(header, message);
            })
    }

    fn start(
        &mut self,
        header: Header,
        request: &dyn RequestBody,
        limit: Duration,
    ) -> Result<(), CallError> {
        self.note_request(header, request);
        self.port.start(header, request, limit)
    }

    fn poll(
        &mut self,
        take: &mut dyn FnMut(u64, Header, &[u8]),
    ) -> Option<(u64, Result<(), CallError>)> {
        self.poll_message(&mut |sequence, header, message| {
            take(sequence, header, message.bytes());
        })
    }

    fn poll_message(
        &mut self,
        take: &mut dyn FnMut(u64, Header, Message<'_>),
    ) -> Option<(u64, Result<(), CallError>)> {
        let (profile, taps, slot) = (self.port.profile(), &self.taps, self.slot);
        self.port.poll_message(&mut |sequence, header, message| {
            taps.copy_reply(slot, header, profile, &message);
            take(sequence, header, message);
        })
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

    fn replies_have_ages(&self) -> bool {
        self.port.replies_have_ages()
    }

    fn peers(&self) -> usize {
        self.port.peers()
    }

    fn server(&self) -> u128 {
        self.port.server()
    }

    fn freshness(&self) -> Option<Freshness> {
        self.port.freshness()
    }

    fn queue(&self) -> Option<QueueGauge> {
        self.port.queue()
    }
}
