//! A running machine, as the worker sees it: the active states, and the queue of events.

use crate::chart::{Chart, NONE};
use crate::set::Set;
use std::collections::VecDeque;

/// The most events that wait in the external queue.
pub const MAX_EVENTS: usize = 256;

/// Why an event was not taken into the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// The machine has reached its end.
    Ended,
    /// [`MAX_EVENTS`] events wait.
    Full,
}

/// A running machine.
#[derive(Clone, Debug)]
pub struct Session {
    chart: &'static Chart,
    pub(crate) active: Set,
    pub(crate) external: VecDeque<u16>,
    pub(crate) ended: bool,
    /// The end state of the machine that was entered.
    pub(crate) end: u16,
}

impl Session {
    /// A machine that has not started.
    pub fn new(chart: &'static Chart) -> Self {
        Self {
            chart,
            active: Set::new(chart.states.len()),
            external: VecDeque::with_capacity(MAX_EVENTS),
            ended: false,
            end: NONE,
        }
    }

    /// The tables.
    pub fn chart(&self) -> &'static Chart {
        self.chart
    }

    /// Whether a state is active.
    pub fn is_in(&self, state: u16) -> bool {
        self.active.contains(state)
    }

    /// The active states in document order.
    pub fn active(&self) -> impl Iterator<Item = u16> + '_ {
        self.active.iter()
    }

    /// The first active state that is not before `from`, in document order.
    pub fn next_active(&self, from: u16) -> Option<u16> {
        self.active.next(from)
    }

    /// Puts an event into the external queue.
    ///
    /// # Errors
    /// The machine has ended, or the queue is full. The event is dropped.
    pub fn fire(&mut self, event: u16) -> Result<(), Refused> {
        if self.ended {
            Err(Refused::Ended)
        } else if self.external.len() >= MAX_EVENTS {
            Err(Refused::Full)
        } else {
            self.external.push_back(event);
            Ok(())
        }
    }

    /// Whether an event waits.
    pub fn has_events(&self) -> bool {
        !self.external.is_empty()
    }

    /// Whether the machine has reached an end state of its own, or was stopped.
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    /// The end state with which the machine ended.
    pub fn end_state(&self) -> Option<u16> {
        (self.end != NONE).then_some(self.end)
    }
}
