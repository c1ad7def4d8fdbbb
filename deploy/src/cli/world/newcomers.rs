//! Replicas of which a listener hears later than of the others. If the network was started again, they are of
//! another run, whose world is another one: their messages wait until that is known.

use rc_world::Message;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// How many bytes of messages wait at most. The replica asks for what it lacks.
const MOST_HELD: usize = 4 << 20;
/// How many replicas are known at most, and how many newcomers wait.
const MOST: usize = 1024;

/// The messages of newcomers.
#[derive(Default)]
pub(super) struct Newcomers {
    /// The replicas of this run; none while all are taken.
    known: Option<BTreeSet<u64>>,
    heard: BTreeSet<u64>,
    /// The others, and when each was heard first.
    waiting: BTreeMap<u64, Instant>,
    /// The sender of each, and its bytes.
    held: Vec<(u64, Message, usize)>,
    bytes: usize,
    are_new: bool,
}

impl Newcomers {
    /// From now on, replicas that were not heard so far are newcomers.
    pub(super) fn hold(&mut self) {
        self.known = Some(std::mem::take(&mut self.heard));
    }

    /// Gives a message back unless it is of a newcomer.
    pub(super) fn pass(
        &mut self,
        sender: Option<u64>,
        message: Message,
        bytes: usize,
    ) -> Option<Message> {
        let Some(sender) = sender else {
            return Some(message);
        };
        let Some(known) = &self.known else {
            if self.heard.len() < MOST {
                self.heard.insert(sender);
            }
            return Some(message);
        };
        if known.contains(&sender) {
            return Some(message);
        }
        let is_new = !self.waiting.contains_key(&sender);
        if is_new && known.len() + self.waiting.len() >= 2 * MOST {
            return None;
        }
        if is_new {
            self.waiting.insert(sender, Instant::now());
            self.are_new = true;
        }
        if self.bytes + bytes <= MOST_HELD {
            self.bytes += bytes;
            self.held.push((sender, message, bytes));
        }
        None
    }

    /// Whether one has come since the last call.
    pub(super) fn are_new(&mut self) -> bool {
        std::mem::take(&mut self.are_new)
    }

    /// The messages of newcomers that were heard before a time, which are none any more.
    pub(super) fn accept(&mut self, before: Instant) -> Vec<Message> {
        let Some(known) = &mut self.known else {
            return Vec::new();
        };
        let accepted = self.waiting.extract_if(.., |_, heard| *heard < before);
        known.extend(accepted.map(|(sender, _)| sender));
        let is_known = |held: &mut (u64, Message, usize)| known.contains(&held.0);
        let passed = self.held.extract_if(.., is_known);
        let passed = passed.map(|(_, message, bytes)| {
            self.bytes = self.bytes.saturating_sub(bytes);
            message
        });
        passed.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use graph_language::Schema;
    use rc_world::{Setup, World};
    use std::time::Duration;

    fn message() -> Message {
        let world = World::new(Setup::new("door_finder", Schema::anything().into()));
        let made = world.change(|edit| {
            edit.add_node("door")?;
            Ok(())
        });
        made.expect("a sound change");
        world.take().expect("its message")
    }

    #[test]
    fn messages_of_newcomers_wait_for_a_look_that_begins_after_them() {
        let mut newcomers = Newcomers::default();
        let pass = |newcomers: &mut Newcomers, sender: u64, bytes: usize| {
            newcomers.pass(Some(sender), message(), bytes).is_some()
        };
        assert!(pass(&mut newcomers, 1, 10));
        newcomers.hold();
        assert!(pass(&mut newcomers, 1, 10) && !newcomers.are_new());
        let before = Instant::now();
        assert!(!pass(&mut newcomers, 2, 10));
        assert!(newcomers.are_new() && !newcomers.are_new());
        assert!(newcomers.accept(before).is_empty());
        // More than may wait is dropped.
        for _ in 0..9 {
            assert!(!pass(&mut newcomers, 2, MOST_HELD / 4));
        }
        assert!(!newcomers.are_new());
        let after = Instant::now() + Duration::from_millis(1);
        assert_eq!(newcomers.accept(after).len(), 4);
        assert!(pass(&mut newcomers, 2, 10));
        assert!(!pass(&mut newcomers, 3, MOST_HELD / 2));
    }
}
