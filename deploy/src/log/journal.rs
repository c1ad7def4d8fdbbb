//! The last events of a network, for clients that follow them or connect late.

use rc_management::event::Event;
use std::collections::VecDeque;

/// How many events are kept.
const KEPT: usize = 1000;

/// The last events, numbered. Each reader remembers the number of its next event, so that a slow
/// reader blocks no other.
#[derive(Debug, Default)]
pub(crate) struct Journal {
    first: u64,
    events: VecDeque<Event>,
}

impl Journal {
    pub(crate) fn add(&mut self, event: &Event) {
        if self.events.len() >= KEPT {
            self.events.pop_front();
            self.first += 1;
        }
        self.events.push_back(event.clone());
    }

    /// The number of kept events, and the number of the first one.
    pub(crate) fn kept(&self) -> (usize, u64) {
        (self.events.len(), self.first)
    }

    /// The event with this number, or how many events the reader has missed. `None` if the event
    /// has not come yet.
    pub(crate) fn get(&self, number: u64) -> Option<Result<&Event, u64>> {
        match number.checked_sub(self.first) {
            None => Some(Err(self.first - number)),
            Some(at) => self.events.get(usize::try_from(at).ok()?).map(Ok),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rc_management::event::Severity;

    #[test]
    fn a_slow_reader_learns_how_many_events_it_missed() {
        let mut journal = Journal::default();
        assert_eq!(journal.get(0), None);
        for i in 0..KEPT + 3 {
            journal.add(&Event::network(Severity::Info, "up", i.to_string()));
        }
        assert_eq!(journal.kept(), (KEPT, 3));
        assert_eq!(journal.get(1), Some(Err(2)));
        let first = journal.get(3).and_then(Result::ok).expect("an event");
        assert_eq!(first.message, "3");
        assert_eq!(journal.get(KEPT as u64 + 3), None);
    }
}
