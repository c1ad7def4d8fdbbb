//! Commands of the management thread to the event loop.

use super::report::NotHandled;
use super::{EventLoop, answer, receive};
use crate::commands::Command;
use crate::component::Body;
use crate::proposal::CHANGE_LIMIT;
use crate::tool_message::{ToolMessage, ToolReply};
use rc_management::component::State;
use rc_management::observation::TappedKind;
use rc_middleware::backend::Profile;
use rc_middleware::typed::HandlerError;
use rc_middleware::{Header, Message};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long a turn waits for the changes of parameters that its worker has requested. In lockstep it waits as long
/// as a change may take, so that a run repeats.
const SETTLING: Duration = Duration::from_millis(100);

impl EventLoop<'_> {
    pub(super) fn execute_commands(&mut self) {
        let (emergencies, commands) = self.commands.take();
        for command in commands {
            // Commands about the emergency come first; others may take long.
            if !matches!(command, Command::Emergency(_)) {
                self.commands.executed(emergencies);
            }
            match command {
                Command::Period(period) => self.component.core().new_period = Some(period),
                Command::Parameters(proposal) => {
                    let result = proposal.put_to(self.component);
                    self.apply(result);
                }
                Command::Message(message) => self.handle(&message),
                Command::Fire(fired) => {
                    if let Some(machine) = self.component.machine() {
                        machine.fire_from_outside(fired);
                    }
                }
                Command::Emergency(true) => self.enter_emergency("asked for by management"),
                Command::Emergency(false) => {
                    if self.component.core().state() == State::Emergency {
                        self.component.restore();
                        self.enter(State::Running);
                    }
                }
            }
        }
        self.commands.executed(emergencies);
    }

    /// Makes the changes of parameters that the worker has requested: waits until the management thread has
    /// checked them.
    pub(super) fn settle_own_changes(&mut self) {
        if !self.component.core().own_changes.are_open() {
            return;
        }
        let limit = if self.role.is_lockstep() {
            CHANGE_LIMIT
        } else {
            SETTLING
        };
        let shared = Arc::clone(&self.shared);
        let end = Instant::now() + limit;
        while self.component.core().own_changes.are_open()
            && self.fatal.is_none()
            && !shared.wake_event.is_stopping()
        {
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                break;
            }
            let left = Timespec::try_from(left).ok();
            // After an error, the limit still ends the wait.
            let _ = poll(
                &mut [PollFd::new(&shared.wake_event, PollFlags::IN)],
                left.as_ref(),
            );
            shared.wake_event.clear();
            self.execute_commands();
        }
        // It may have been for another part of the loop that somebody woke it.
        shared.wake_event.wake();
    }

    /// Handles a message of a tool as if a peer had sent it.
    fn handle(&mut self, message: &Arc<ToolMessage>) {
        if !message.begin() {
            return;
        }
        let (slot, body) = (message.slot, message.body.as_slice());
        let header = Header {
            sent: rc_middleware::now(),
            ..Header::default()
        };
        let mut reply = ToolReply::new(message);
        let idle = self.idle_state();
        let connections = self.connections;
        let Some(of) = connections.slots().get(slot) else {
            return;
        };
        let taps = connections.taps();
        let exact = self.component.core().exact.clone();
        let request = Message::Bytes(body);
        let result: Result<(), NotHandled> = match message.operation {
            Some(operation) => {
                let kind = (TappedKind::Sample, Some(operation));
                taps.copy(slot, kind, header, Profile::Rpc, body);
                let received = match idle {
                    Some(state) => Err(HandlerError(format!("the component is {state}"))),
                    None => exact.sample(slot, operation, header, body, || {
                        receive(self.component, &of, operation, header, Body::Borrowed(body))
                    }),
                };
                received.map_err(Into::into)
            }
            None => taps.serve(slot, header, &request, &mut reply, |reply| {
                exact.request(slot, header, body, reply, |reply| {
                    answer(self.component, &of, idle, header, &request, reply)
                })
            }),
        };
        if let Err(NotHandled::Refused(_)) = &result {
            self.shared.status().slots[slot].refused += 1;
        }
        if reply.is_deferred {
            return;
        }
        // A refused query has a reply, which says why.
        message.end(match result {
            Err(error) if reply.body.is_empty() => Err(error.to_string()),
            _ => Ok(reply.body),
        });
    }
}
