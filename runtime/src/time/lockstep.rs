//! The state of a source of time: the present tick, and the followers that it waits for.

use super::protocol::{Done, turn_of};
use crate::clock::{SimulatedClock, Time};
use rc_middleware::qos::MAX_READERS;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The turn of no follower.
const NO_FOLLOWER: u64 = u64::MAX;

/// In which order followers do a tick that the source waits for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// One after the other, as the network lists them, then by name. A run repeats exactly.
    #[default]
    InTurn,
    /// All at the same time. Messages between them may arrive in this tick or in the next one.
    AtOnce,
}

/// Why time did not advance.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TimeError {
    /// The network has another clock.
    #[error(
        "this component is not the source of its network's time; start it with --clock source, or write `time simulated by NAME;` in the .ddsl"
    )]
    Inactive,
    /// The tick before is not done yet.
    #[error("tick {tick} waits for {}", waiting_for.join(", "))]
    Waiting {
        /// The tick.
        tick: u64,
        /// The followers that have not done it.
        waiting_for: Vec<String>,
    },
}

/// State that the worker and the event loop share.
#[derive(Debug)]
pub(crate) struct State {
    pub(super) epoch: u64,
    pub(super) number: u64,
    pub(super) clock: Arc<SimulatedClock>,
    pub(super) limit: Option<Duration>,
    pub(super) order: Order,
    pub(super) paced: bool,
    pub(super) followers: Vec<Entry>,
    /// A tick is to be sent.
    pub(super) unsent: bool,
    /// Whether the last `compute()` has advanced.
    pub(super) advanced: bool,
    pub(super) missing: Vec<String>,
}

#[derive(Debug)]
pub(super) struct Entry {
    pub(super) name: String,
    /// The place in the network's list; those that it does not list come after, by name.
    pub(super) place: usize,
    /// Whether it has said something in this run.
    pub(super) is_here: bool,
    /// Whether it is waited for.
    pub(super) is_awaited: bool,
    /// The last tick that it has done.
    pub(super) done: Option<u64>,
}

impl State {
    /// `expected` are the followers that the network lists, in their order.
    pub(crate) fn new(clock: Arc<SimulatedClock>, expected: &[String]) -> Self {
        let nanoseconds = SystemTime::now().duration_since(UNIX_EPOCH);
        let epoch = nanoseconds.unwrap_or_default().as_nanos() as u64;
        let expected = expected.iter().take(MAX_READERS).enumerate();
        Self {
            epoch: epoch.max(1),
            number: 0,
            clock,
            limit: None,
            order: Order::default(),
            paced: true,
            followers: expected
                .map(|(place, name)| Entry {
                    name: name.clone(),
                    place,
                    is_here: false,
                    is_awaited: true,
                    done: None,
                })
                .collect(),
            unsent: true,
            advanced: false,
            missing: Vec::new(),
        }
    }

    pub(super) fn begin(&mut self, time: Time) -> Result<u64, TimeError> {
        if self.limit.is_some() && self.missing.is_empty() && !self.is_complete() {
            return Err(TimeError::Waiting {
                tick: self.number,
                waiting_for: self.waiting_for(),
            });
        }
        self.clock.set(time);
        self.number += 1;
        self.unsent = true;
        self.advanced = true;
        self.missing.clear();
        Ok(self.number)
    }

    pub(super) fn names(&self, which: impl Fn(&Entry) -> bool) -> Vec<String> {
        let which = self.followers.iter().filter(|entry| which(entry));
        which.map(|entry| entry.name.clone()).collect()
    }

    pub(super) fn awaits(&self, entry: &Entry) -> bool {
        entry.is_awaited && entry.done != Some(self.number)
    }

    pub(super) fn first_awaited(&self) -> Option<&Entry> {
        self.followers.iter().find(|entry| self.awaits(entry))
    }

    /// Whether all have done the present tick. A source that waits for no follower is always
    /// complete.
    pub(super) fn is_complete(&self) -> bool {
        self.limit.is_none() || self.first_awaited().is_none()
    }

    /// The followers that the present tick waits for; in turn, the one whose turn it is.
    pub(super) fn waiting_for(&self) -> Vec<String> {
        match self.order() {
            Order::InTurn => self
                .first_awaited()
                .map(|e| e.name.clone())
                .into_iter()
                .collect(),
            Order::AtOnce => self.names(|entry| self.awaits(entry)),
        }
    }

    /// Before the first tick there is nothing to do in turn.
    pub(super) fn order(&self) -> Order {
        match self.number {
            0 => Order::AtOnce,
            _ => self.order,
        }
    }

    pub(super) fn turn(&self) -> u64 {
        match (self.limit, self.order()) {
            (None, _) | (_, Order::AtOnce) => 0,
            _ => self
                .first_awaited()
                .map_or(NO_FOLLOWER, |e| turn_of(&e.name)),
        }
    }

    pub(super) fn release(&mut self, name: &str) -> bool {
        let entry = self.followers.iter_mut().find(|entry| entry.name == name);
        if let Some(entry) = entry {
            entry.is_awaited = false;
            self.missing.retain(|missing| missing != name);
            return true;
        }
        false
    }

    /// Handles a message of a follower.
    pub(super) fn receive(&mut self, done: Done) -> FollowerMessage {
        let at = self.followers.iter().position(|e| e.name == done.follower);
        if done.leaving {
            if let Some(at) = at {
                self.followers[at].is_here = false;
                self.release(&done.follower);
                if self.followers[at].place == usize::MAX {
                    self.followers.remove(at);
                }
            }
            return FollowerMessage::Nothing;
        }
        let at = match at {
            Some(at) => at,
            None if self.followers.len() >= MAX_READERS => return FollowerMessage::Nothing,
            None => {
                let place = usize::MAX;
                let key = |e: &Entry| (e.place, e.name.clone());
                let new = (place, done.follower.clone());
                let at = self.followers.partition_point(|e| key(e) < new);
                let entry = Entry {
                    name: done.follower,
                    place,
                    is_here: false,
                    is_awaited: true,
                    done: None,
                };
                self.followers.insert(at, entry);
                at
            }
        };
        let entry = &mut self.followers[at];
        let joins = done.epoch != self.epoch;
        if joins || !entry.is_here {
            tracing::info!("{} follows this component's time", entry.name);
        }
        entry.is_here = true;
        entry.is_awaited = true;
        if joins {
            entry.done = None;
            return FollowerMessage::Joins;
        }
        let before = entry.done.replace(done.number);
        if done.number != self.number || before == entry.done {
            return FollowerMessage::Nothing;
        }
        let name = entry.name.clone();
        self.missing.retain(|missing| *missing != name);
        FollowerMessage::Done
    }
}

/// Meaning of a follower's message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FollowerMessage {
    /// Nothing new.
    Nothing,
    /// It has done the present tick.
    Done,
    /// It wants to know the present tick.
    Joins,
}
