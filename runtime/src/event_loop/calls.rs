//! The loop's part in calls that the worker starts, and that end between two turns.

use super::report::{End, Handled};
use super::{EventLoop, HANDLERS_A_TURN};
use crate::component::{CallEnd, Component};
use crate::slots::{OpenSlot, SlotTable};
use rc_management::component::Role;
use rustix::event::epoll;
use rustix::io::Errno;
use std::io;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// The clients whose calls end in the loop, each with the descriptor and time to wait for.
pub(super) struct Calls {
    /// The number and the slot of each client.
    clients: Vec<(usize, Arc<OpenSlot>)>,
    /// Whether the last look left ends to be handled.
    pub(super) has_more: bool,
    /// How many have ended in this turn of a tick.
    pub(super) ended_in_turn: usize,
}

impl Calls {
    pub(super) fn new(component: &dyn Component, slots: &SlotTable) -> Self {
        let clients = slots.all().into_iter().enumerate().filter(|(_, open)| {
            open.slot.role == Role::Requires
                && !open.is_whole_array()
                && component.starts_calls(open.described)
        });
        Self {
            clients: clients.collect(),
            has_more: false,
            ended_in_turn: 0,
        }
    }

    /// Adds to `epoll`, under the number `data`, what announces the ends of calls. Gives the
    /// shorter one of `limit` and the time until the next deadline of a call. `in_order`: only the
    /// first client with calls may end some.
    pub(super) fn watch(
        &self,
        component: &mut dyn Component,
        (epoll, data): (&OwnedFd, u64),
        in_order: bool,
        mut limit: Duration,
    ) -> io::Result<Duration> {
        let now = Instant::now();
        for (_, open) in &self.clients {
            let Some(awaiting) = component.awaiting(open.described, open.member.as_ref()) else {
                continue;
            };
            limit = limit.min(awaiting.until.saturating_duration_since(now));
            let data = epoll::EventData::new_u64(data);
            // What a window has left, see `unwatch`, wakes the loop at most once.
            let once = epoll::EventFlags::IN | epoll::EventFlags::ONESHOT;
            match epoll::add(epoll, awaiting.descriptor, data, once) {
                Ok(()) => {}
                // Two clients have one descriptor, or a window has left it.
                Err(Errno::EXIST) => epoll::modify(epoll, awaiting.descriptor, data, once)?,
                Err(error) => return Err(error.into()),
            }
            if in_order {
                break;
            }
        }
        Ok(limit)
    }

    /// Takes out what [`Calls::watch`] added: calls that wait leave it readable while none is
    /// started. A client whose last call was ended or dropped in the window of the worker is left.
    pub(super) fn unwatch(&self, component: &mut dyn Component, epoll: &OwnedFd) -> io::Result<()> {
        for (_, open) in &self.clients {
            let awaiting = component.awaiting(open.described, open.member.as_ref());
            match awaiting.map(|awaiting| epoll::delete(epoll, awaiting.descriptor)) {
                None | Some(Ok(()) | Err(Errno::NOENT)) => {}
                Some(Err(error)) => return Err(error.into()),
            }
        }
        Ok(())
    }
}

impl EventLoop<'_> {
    /// How many calls may end now, at most as many as handlers run in a turn. In lockstep, they end
    /// when the turn has handled its samples and run `compute()`, and this is the bound of the
    /// whole turn: otherwise the arrival of their replies would decide the order.
    pub(super) fn ends_left(&self) -> usize {
        if !self.role.is_lockstep() {
            HANDLERS_A_TURN
        } else if self.has_computed() {
            HANDLERS_A_TURN.saturating_sub(self.calls.ended_in_turn)
        } else {
            0
        }
    }

    /// Lets the worker handle calls that have ended, at most this many. Every call ends once, so
    /// they are also handled in the state Emergency and while a managed component is not active.
    pub(super) fn end_calls(&mut self, most: usize) {
        self.calls.has_more = false;
        let is_lockstep = self.role.is_lockstep();
        for (_, open) in &self.calls.clients {
            let member = open.member.as_ref();
            self.component
                .end_in_order(open.described, member, is_lockstep);
        }
        if is_lockstep {
            self.end_calls_in_order(most);
        } else {
            self.end_calls_at_once(most);
        }
        self.count_handled();
    }

    /// Ends calls in an order that is equal in each run, whenever their replies come: those of the
    /// first slot, each in the order of its start, then those of the next slot. All run meanwhile.
    fn end_calls_in_order(&mut self, most: usize) {
        let mut left = most;
        let mut at = 0;
        while left > 0 && self.fatal.is_none() && at < self.calls.clients.len() {
            if let Some(end) = self.end_call(at) {
                if end == CallEnd::Deadline && !self.shared.wake_event.is_stopping() {
                    self.warn_of_deadline(at);
                }
                left -= 1;
                self.take_failure();
                // Its handler may have started calls through any slot.
                at = 0;
            } else if self.is_awaited(at) {
                return;
            } else {
                at += 1;
            }
        }
        self.calls.has_more = left == 0;
    }

    /// Whether a call of a client has not ended.
    fn is_awaited(&mut self, at: usize) -> bool {
        let (_, open) = &self.calls.clients[at];
        let member = open.member.as_ref();
        self.component.awaiting(open.described, member).is_some()
    }

    fn warn_of_deadline(&mut self, at: usize) {
        let message = format!(
            "slot {}: a call ended at its deadline, which the clock of the system measures: the \
             next run may differ",
            self.calls.clients[at].1.name
        );
        self.shared.status().last_error = Some(message.clone());
        if self.logged.allows(Instant::now()) {
            tracing::warn!("{message}");
        }
    }

    /// Ends calls as their replies come.
    fn end_calls_at_once(&mut self, most: usize) {
        let mut left = most;
        let mut goes_on = !self.calls.clients.is_empty() && self.fatal.is_none();
        // A handler may call through a client that was looked at before.
        while std::mem::take(&mut goes_on) {
            for at in 0..self.calls.clients.len() {
                while left > 0 && self.fatal.is_none() && self.end_call(at).is_some() {
                    left -= 1;
                    goes_on = true;
                    self.take_failure();
                }
            }
            if self.fatal.is_some() {
                break;
            }
            if left == 0 && goes_on {
                self.calls.has_more = true;
                break;
            }
        }
    }

    /// Lets the worker handle one end, if there is one.
    fn end_call(&mut self, at: usize) -> Option<CallEnd> {
        let (number, open) = &self.calls.clients[at];
        let (slot, name) = (*number, Arc::clone(open));
        let start = Instant::now();
        let hops = self.connections.hops();
        hops.begin();
        let ended = self
            .component
            .end_call(open.described, open.member.as_ref());
        hops.end(false);
        let end = ended?;
        let took = start.elapsed();
        self.calls.ended_in_turn += 1;
        let message = Handled {
            slot,
            took,
            lost: 0,
            end: End::Handled,
        };
        self.handled.push(message, start);
        if self.is_overrun(took) && self.logged.allows(Instant::now()) {
            tracing::warn!(
                "slot {}: a handler took {took:?}, longer than the period of {:?}",
                name.name,
                self.period
            );
        }
        Some(end)
    }

    /// Whether calls that were started have not ended. A turn of a tick lasts until they have, for
    /// as many as handlers run in a turn: otherwise the time of their replies would decide in which
    /// tick they are handled.
    pub(super) fn holds_turn(&mut self) -> bool {
        let Self {
            calls, component, ..
        } = self;
        let mut clients = calls.clients.iter();
        calls.ended_in_turn < HANDLERS_A_TURN
            && clients.any(|(_, open)| {
                let member = open.member.as_ref();
                component.awaiting(open.described, member).is_some()
            })
    }
}
