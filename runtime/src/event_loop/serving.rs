//! Serves the ports: handlers run as messages come.

use super::network_time::stamp;
use super::port::{Port, answer, receive};
use super::report::{End, Handled, NotHandled};
use super::{EventLoop, HANDLERS_A_TURN, HANDLING_A_TURN};
use crate::component::Body;
use crate::ports::Receiver;
use rc_management::observation::TappedKind;
use rc_middleware::Header;
use rc_middleware::backend::Profile;
use rc_middleware::typed::HandlerError;
use std::time::Instant;

impl EventLoop<'_> {
    /// Serves ready ports within the bound of a turn, one message each in rotation.
    pub(super) fn serve(&mut self, now: Instant) {
        let mut start = now;
        let count = self.ports.len();
        let mut left = HANDLERS_A_TURN;
        let gated = self.is_gated();
        let is_lockstep = self.role.is_lockstep();
        self.first_port = if self.first_port + 1 < count && !is_lockstep {
            self.first_port + 1
        } else {
            0
        };
        'turn: while left > 0 && self.ports.iter().any(|p| p.may_be_served(gated)) {
            for at in (self.first_port..count).chain(0..self.first_port) {
                if self.shared.wake_event.is_stopping() {
                    break 'turn;
                }
                if left > 0 && self.ports[at].may_be_served(gated) {
                    start = self.serve_port(at, start);
                    left -= 1;
                    if !is_lockstep && start.saturating_duration_since(now) >= HANDLING_A_TURN {
                        break 'turn;
                    }
                }
            }
        }
        self.count_handled();
    }

    /// Serves one message of a port, if there is one. `start` is the time now; returns the time
    /// afterwards.
    fn serve_port(&mut self, at: usize, start: Instant) -> Instant {
        let idle = self.idle_state();
        let Self {
            component,
            ports,
            connections,
            ..
        } = self;
        let (taps, hops) = (connections.taps(), connections.hops());
        connections.set_idle(idle.is_some());
        let port = &mut ports[at];
        // Another middleware of the slot, or a tool, may have taken the room since.
        port.find_room(&**component);
        if port.is_full {
            return start;
        }
        let slot = port.slot;
        let of = &port.of;
        let keeps = port.keeps(&**component);
        let mut result: Result<(), NotHandled> = Ok(());
        let mut lost = 0;
        let gaps = &mut port.gaps;
        let (spin, polls) = (&mut port.spin, port.spin_until.is_some());
        // Before the handler, whose time is not that of the poll.
        let mut came = || {
            if polls {
                spin.came(Instant::now());
            }
        };
        let taken = match &mut port.receiver {
            Receiver::Server { port, counter } => {
                port.serve_message(&mut |header, message, reply| {
                    came();
                    counter.next();
                    if idle.is_none() {
                        hops.request(slot, of, &header, message.begin());
                    }
                    result = taps.serve(slot, header, &message, reply, |reply| {
                        answer(*component, of, idle, header, &message, reply)
                    });
                    hops.handled();
                })
            }
            Receiver::Subscriber {
                port, operation, ..
            } => {
                let mut take = |header: Header, body: Body<'_>| {
                    came();
                    lost = gaps.note(&header);
                    let kind = (TappedKind::Sample, Some(*operation));
                    if taps.is_on(slot) {
                        taps.copy(slot, kind, header, Profile::Rpc, body.memory());
                    }
                    if idle.is_some() {
                        return;
                    }
                    hops.sample(slot, *operation, &header, || body.memory());
                    let received = receive(*component, of, *operation, header, body);
                    hops.handled();
                    result = received.map_err(Into::into);
                };
                if keeps && port.can_keep() {
                    port.receive_kept(&mut |header, sample| take(header, Body::Kept(sample)))
                } else {
                    port.receive_message(&mut |header, message| take(header, message.into()))
                }
            }
        };
        let now = Instant::now();
        match taken {
            Ok(false) => port.rest(now),
            Ok(true) => {
                port.received(now);
                port.last_sample = Some(stamp(&self.role, self.began, now));
                let spin = port.spin.begin(now);
                port.spin_until = (!spin.is_zero()).then(|| now + spin);
                self.handled(at, start, now, lost, result);
            }
            Err(error) => {
                // A message that cannot be read does not hold up later ones, and a port that has no
                // others does not keep the loop busy.
                port.failures += 1;
                if port.failures % HANDLERS_A_TURN == 0 {
                    port.receiver.acknowledge(false);
                    port.ready = false;
                    port.spin_until = None;
                }
                let error = HandlerError(error.to_string());
                self.handled(at, start, now, lost, Err(error.into()));
            }
        }
        // The time of a look is not that of the next handler.
        now
    }

    /// Notes a message that was handled from `start` until `now`. The status counts an overrun, a
    /// loss and an error at once, for the turn may go on for long, or never end.
    fn handled(
        &mut self,
        at: usize,
        start: Instant,
        now: Instant,
        lost: u64,
        result: Result<(), NotHandled>,
    ) {
        let took = now.saturating_duration_since(start);
        let message = Handled {
            slot: self.ports[at].slot,
            took,
            lost,
            end: result
                .as_ref()
                .map_or_else(NotHandled::end, |()| End::Handled),
        };
        self.handled.push(message, start);
        let is_overrun = self.is_overrun(took);
        if is_overrun || lost > 0 || result.is_err() || self.handled.is_due(now) {
            self.count_handled();
        }
        let port = &mut self.ports[at];
        if is_overrun {
            let message = format!(
                "a handler took {took:?}, longer than the period of {:?}",
                self.period
            );
            port.log_failure(&self.shared, now, &message);
        }
        match result {
            Ok(()) => {}
            Err(NotHandled::Failed(error)) => {
                let message = format!("a message was not handled: {error}");
                port.log_failure(&self.shared, now, &message);
            }
            Err(NotHandled::Refused(reason)) => port.log_refusal(&self.shared, now, &reason),
        }
    }

    /// Adds the handled messages to the status.
    pub(super) fn count_handled(&mut self) {
        let limit = self.role.keeps_period().then_some(self.period);
        self.handled.count(&self.shared, limit);
    }

    /// Notes topics that exceed their deadline. A sample that has come and waits to be handled
    /// counts as received.
    pub(super) fn check_deadlines(&mut self, now: Instant) {
        let late =
            |port: &&Port| !port.ready && port.deadline.is_some() && port.last_sample.is_some();
        for port in self.ports.iter().filter(late) {
            if let (Receiver::Subscriber { operation, .. }, Some(last_sample), Some(deadline)) =
                (&port.receiver, port.last_sample, port.deadline)
            {
                let silence = stamp(&self.role, self.began, now) - last_sample;
                if silence > deadline {
                    let mut status = self.shared.status();
                    status.delta.silent(port.slot, *operation, silence);
                }
            }
        }
    }
}
